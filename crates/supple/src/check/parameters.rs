//! Derivatives of the system by the parameters, along the plan.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use supple_kernels::Matrices;
use supple_model::Trajectory;
use supple_model::parameters::{Parameters, Scale};
use supple_model::system::{Points, Variation};

use super::compare::{Entries, Row};
use super::differences::{Difference, differentiate};
use super::system::{FIRST_ORDER, HIGHER_ORDER, SystemCheck, differencing};
use crate::candidates::uniform;

/// The longest step of a parameter, relative to its size, when the plan is held fixed.
const LONGEST: f64 = 1e-2;

/// The size of a parameter, which scales its steps: its value or, on a linear scale, at least a thousandth of its
/// range.
pub(super) fn size_of(parameters: &Parameters, phi: &[f64], index: usize) -> f64 {
    let parameter = parameters.get(index);
    let [lower, upper] = parameter.bounds;
    match parameter.scale {
        Scale::Log if phi[index] != 0.0 => phi[index].abs(),
        _ => phi[index].abs().max(1e-3 * (upper - lower)),
    }
}

/// The row of a gradient with respect to the parameters, each with its own scale.
pub(super) fn parameter_row(
    name: &str,
    tolerance: f64,
    parameters: &Parameters,
    analytic: &[f64],
    numeric: &[Option<Difference>],
) -> Row {
    let mut entries = Entries::default();
    for (index, (&analytic, &numeric)) in analytic.iter().zip(numeric).enumerate() {
        entries.add(index, index, analytic, numeric);
    }
    entries.row(name, tolerance, &mut None, |index| parameters.get(index).name.clone())
}

impl SystemCheck<'_> {
    /// Differences of a sum over all steps by every parameter: each step on its own, so that its rounding is known.
    fn by_parameters(
        &mut self,
        name: &str,
        tolerance: f64,
        analytic: &[f64],
        mut terms: impl FnMut(&mut Self, &[f64]) -> Vec<f64>,
    ) -> Row {
        let mut numeric = Vec::new();
        for index in 0..analytic.len() {
            let step = self.lengthened * LONGEST * size_of(&self.problem.parameters, self.phi, index);
            let found = differentiate(differencing(step, tolerance, 1), |h| {
                let mut phi = self.phi.to_vec();
                phi[index] += h;
                Some(terms(self, &phi))
            });
            numeric.push(found.map(|found| found.into_iter().fold(Difference::ZERO, Difference::plus)));
        }
        parameter_row(name, tolerance, &self.problem.parameters, analytic, &numeric)
    }

    pub(super) fn contraction_by_parameters(&mut self) -> Row {
        let adjoints = self.adjoints();
        let (_, analytic) = self.contraction(&adjoints);
        let trajectory = self.plan.trajectory.clone();
        self.by_parameters("contraction of the knots, by parameters", HIGHER_ORDER, &analytic, |check, phi| {
            check.inner_product(&adjoints, &trajectory, phi)
        })
    }

    /// The terms of `sum l + lambda_{t+1}' f` along a trajectory.
    fn lagrangian(&mut self, trajectory: &Trajectory, costates: &Matrices, phi: &[f64]) -> Vec<f64> {
        let system = &self.task.system;
        let mut next = vec![0.0; self.plan.knots.dimensions.states];
        let mut terms = Vec::new();
        for t in 0..trajectory.steps() {
            let (x, u) = (trajectory.states.vector(t), trajectory.controls.vector(t));
            terms.push(system.stage_cost(t, x, u, phi, &mut self.scratch));
            system.step(t, x, u, phi, &mut next);
            terms.extend(next.iter().zip(costates.vector(t + 1)).map(|(f, costate)| f * costate));
        }
        terms.push(system.final_cost(trajectory.states.vector(trajectory.steps()), phi, &mut self.scratch));
        terms
    }

    fn parameter_gradient(
        &mut self,
        at: Points,
        phi: &[f64],
        costates: &Matrices,
        variation: Option<Variation>,
    ) -> Vec<f64> {
        let mut out = vec![0.0; phi.len()];
        self.task.system.add_parameter_gradient(at, phi, costates, variation, &mut out, &mut self.scratch);
        out
    }

    pub(super) fn lagrangian_by_parameters(&mut self) -> Row {
        let trajectory = self.plan.trajectory.clone();
        let costates = self.plan.costates.clone();
        let analytic = self.parameter_gradient(trajectory.points(), self.phi, &costates, None);
        self.by_parameters("Lagrangian by parameters", FIRST_ORDER, &analytic, |check, phi| {
            check.lagrangian(&trajectory, &costates, phi)
        })
    }

    /// The derivative of the Lagrangian's gradient by the parameters along a random variation.
    pub(super) fn mixed(&mut self) -> Row {
        let mut random = ChaCha8Rng::seed_from_u64(2);
        let (size, steps) = (self.plan.knots.dimensions, self.plan.trajectory.steps());
        let mut joint = Matrices::vectors(steps + 1, size.joint());
        let mut costates = Matrices::vectors(steps + 1, size.states);
        for t in 0..=steps {
            let used = self.cost_variables(t);
            joint.vector_mut(t)[..used].iter_mut().for_each(|value| *value = uniform(&mut random) - 0.5);
            costates.vector_mut(t).iter_mut().for_each(|value| *value = uniform(&mut random) - 0.5);
        }
        let variation = Variation { joint: &joint, costates: &costates };
        let (trajectory, lambda) = (self.plan.trajectory.clone(), self.plan.costates.clone());
        let analytic = self.parameter_gradient(trajectory.points(), self.phi, &lambda, Some(variation));
        let numeric = differentiate(differencing(self.lengthened * LONGEST, HIGHER_ORDER, 1), |h| {
            let (mut trajectory, mut lambda) = (trajectory.clone(), lambda.clone());
            for t in 0..=steps {
                add(trajectory.states.vector_mut(t), h, &joint.vector(t)[..size.states]);
                add(lambda.vector_mut(t), h, costates.vector(t));
                if t < steps {
                    add(trajectory.controls.vector_mut(t), h, &joint.vector(t)[size.states..]);
                }
            }
            Some(self.parameter_gradient(trajectory.points(), self.phi, &lambda, None))
        });
        let numeric: Vec<_> = (0..analytic.len()).map(|index| numeric.as_ref().map(|found| found[index])).collect();
        parameter_row("Lagrangian, mixed", HIGHER_ORDER, &self.problem.parameters, &analytic, &numeric)
    }
}

fn add(to: &mut [f64], factor: f64, from: &[f64]) {
    to.iter_mut().zip(from).for_each(|(to, from)| *to += factor * from);
}
