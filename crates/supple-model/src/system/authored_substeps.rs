//! Time steps of several sub-steps, of authored models: each function of a step is composed from those of its sub-steps.

use supple_kernels::graph::Source;
use supple_kernels::{Matrices, Scratch};

use super::authored::Authored;
use super::next::GivenNext;
use super::products::StepProducts;
use super::programs::GradientOf;
use super::roll_out::{RollOut, step_by_step};
use super::substeps::{Step, SubstepAdjoints, Substeps, add_slopes};
use super::trace::source;
use super::{Curvature, Points, System, Variation};
use crate::Model;
use crate::trajectory::Trajectory;

/// What moves the sub-steps of some stages, and the costates after them.
pub(super) struct Moving<'a> {
    /// The variation of all stages.
    pub variation: Variation<'a>,
    /// The number of the first of these stages.
    pub first: usize,
    /// Their costs, where these take the next state, and `[l'' | l']` of them.
    pub of_cost: Option<(&'a GivenNext<'a>, &'a Matrices)>,
    /// What is added to the variations of the costates at the ends of stages, vectors of the last sub-steps.
    pub more: Option<&'a Matrices>,
}

impl<M: Model> Authored<M> {
    /// Whether a time step consists of more than one integration step.
    pub(super) fn is_divided(&self) -> bool {
        self.substeps > 1
    }

    /// Whether derivatives of stages are composed from those of their integration steps.
    pub(super) fn is_composed(&self) -> bool {
        self.is_divided() || self.gives_next
    }

    pub(super) fn step_of<'a>(&'a self, phi: &'a [f64]) -> Step<'a> {
        let (next, jacobian) = (self.step_program(), self.jacobian_program());
        Step { next, jacobian, phi, size: self.size, substeps: self.substeps }
    }

    /// The cost of a stage, given the next state.
    pub(super) fn stage_cost_before(&self, next: &[f64], x: &[f64], u: &[f64], phi: &[f64]) -> f64 {
        let mut cost = [0.0];
        self.stage_cost_program().run_single(&[x, u, next], phi, &mut [&mut cost]);
        cost[0]
    }

    /// Continues from the state after the first sub-step through all others; `from` is scratch space for a state.
    pub(super) fn go_on(&self, from: &mut [f64], next: &mut [f64], mut step: impl FnMut(&[f64], &mut [f64])) {
        for _ in 1..self.substeps {
            from.copy_from_slice(next);
            step(from, next);
        }
    }

    pub(super) fn roll_out_divided(
        &self,
        law: RollOut,
        phi: &[f64],
        out: &mut Trajectory,
        scratch: &mut Scratch,
    ) -> f64 {
        let mut second = scratch.take();
        let mut step = self.step_program().with_parameters(phi, scratch);
        let mut stage_cost = self.stage_cost_program().with_parameters(phi, &mut second);
        let mut from = vec![0.0; self.size.states];
        let cost = step_by_step(law, out, |_, x, u, next| {
            step.run(&[x, u], &mut [&mut *next]);
            self.go_on(&mut from, next, |x, next| step.run(&[x, u], &mut [next]));
            let mut cost = [0.0];
            stage_cost.run(&[x, u, next], &mut [&mut cost]);
            cost[0]
        });
        scratch.give_back(second);
        cost + self.cost(out.states.vector(out.steps()), &[], phi, true)
    }

    /// Theory, equation U.13.
    pub(super) fn add_curvature_divided(
        &self,
        at: Points,
        phi: &[f64],
        costates: &Matrices,
        out: &mut Matrices,
        scratch: &mut Scratch,
    ) {
        let step = self.step_of(phi);
        for block in step.blocks(at.stages) {
            let steps = step.divide(at, block, scratch);
            let costates = steps.costates(costates, block.first);
            let curvature = self.curvature_of(&steps, &costates, phi, scratch);
            steps.add_curvature(&steps.products(), &curvature, out, block.first);
        }
    }

    /// The second derivatives of `lambda' f` of every sub-step by `(x_k, u)`.
    pub(super) fn curvature_of(
        &self,
        steps: &Substeps,
        costates: &Matrices,
        phi: &[f64],
        scratch: &mut Scratch,
    ) -> Matrices {
        let joint = self.size.joint();
        let mut curvature = Matrices::zeros(steps.batch().count, joint, joint + 1);
        self.add_step_curvature(steps.points(), phi, costates.into(), &mut curvature, scratch);
        curvature
    }

    /// The gradient of `<F_bar, [A B]>` of whole steps (theory, equation U.12).
    pub(super) fn contract_composed(
        &self,
        at: Points,
        phi: &[f64],
        whole: &Matrices,
        joint: &mut Matrices,
        parameters: &mut [f64],
        scratch: &mut Scratch,
    ) {
        let (step, size) = (self.step_of(phi), self.size.joint());
        for block in step.blocks(at.stages) {
            let steps = step.divide(at, block, scratch);
            let jacobians = steps.adjoints(&steps.products(), whole, block.first, None);
            let (slopes, ends) = (steps.vectors(size), steps.vectors(self.size.states));
            let mut total = Matrices::vectors(steps.stages, size);
            let adjoints = SubstepAdjoints { jacobians, slopes, ends };
            self.collect(&steps, phi, adjoints, &mut total, &mut *parameters, scratch);
            add_slopes(&total, joint, block.first);
        }
    }

    /// Adds the slopes with respect to the stages' `z` to `total`, and those with respect to the parameters.
    pub(super) fn collect(
        &self,
        steps: &Substeps,
        phi: &[f64],
        adjoints: SubstepAdjoints,
        total: &mut Matrices,
        parameters: &mut [f64],
        scratch: &mut Scratch,
    ) {
        let SubstepAdjoints { jacobians, mut slopes, mut ends } = adjoints;
        let Points { states, controls, .. } = steps.points();
        let (x, u) = (states.into(), controls.into());
        let sources = [x, u, x, (&jacobians).into()];
        let contract = self.contraction_program();
        contract.run(steps.batch(), (&sources, phi), (Some(&mut slopes), &mut *parameters), scratch);
        steps.sweep_back(Some(&slopes), &mut ends, Some(total));
        let by_parameters = self.gradient_program(GradientOf::Step, false);
        by_parameters.run(steps.batch(), (&[x, u, (&ends).into()], phi), (None, parameters), scratch);
    }

    /// The gradient by the parameters of `lambda' f` of whole steps, or its derivative along a variation (theory, equations
    /// U.11 and U.14).
    pub(super) fn add_gradient_composed(
        &self,
        at: Points,
        phi: &[f64],
        costates: &Matrices,
        variation: Option<Variation>,
        parameters: &mut [f64],
        scratch: &mut Scratch,
    ) {
        let step = self.step_of(phi);
        let program = self.gradient_program(GradientOf::Step, variation.is_some());
        for block in step.blocks(at.stages) {
            let steps = step.divide(at, block, scratch);
            let mut ends = steps.ending_with(costates, block.first + 1);
            let counting = || self.counting_of_next();
            let given = self.gives_next.then(|| self.given_next(steps.clone(), counting(), phi, scratch));
            let of_cost = given.as_ref().map(|given| (given, self.quadratics(given, Curvature::Exact, phi, scratch)));
            if let Some((given, quadratics)) = &of_cost {
                given.add_slopes_by_next(quadratics, &mut ends);
            }
            steps.sweep_back(None, &mut ends, None);
            let costates = ends;
            let moved = variation.map(|variation| {
                let of_cost = of_cost.as_ref().map(|(given, quadratics)| (*given, quadratics));
                let moving = Moving { variation, first: block.first, of_cost, more: None };
                self.vary(&steps, &costates, moving, phi, scratch)
            });
            if let Some(given) = &given {
                let along = moved.as_ref().map(|[joint, _]| given.vary(joint));
                self.add_cost_gradient_of_next(given, along.as_ref(), phi, parameters, scratch);
            }
            let Points { states, controls, .. } = steps.points();
            let x = Source::from(states);
            let mut sources = [x, controls.into(), (&costates).into(), x, x, x, x, x];
            if let Some([joint, costates]) = &moved {
                sources[source::VARIATION] = joint.into();
                sources[source::COSTATE_VARIATION] = costates.into();
            }
            program.run(steps.batch(), (&sources, phi), (None, &mut *parameters), scratch);
        }
    }

    /// The variations of the sub-steps' points and of the costates after them.
    pub(super) fn vary(
        &self,
        steps: &Substeps,
        costates: &Matrices,
        moving: Moving,
        phi: &[f64],
        scratch: &mut Scratch,
    ) -> [Matrices; 2] {
        let Moving { variation, first, of_cost, more } = moving;
        let (joint, at) = (self.size.joint(), steps.points());
        let (mut moved, mut slopes) = (steps.vectors(joint), steps.vectors(joint));
        steps.sweep_forward(variation.joint, first, &mut moved);
        if self.has_costly_curvature() {
            let (sizes, after) = ([joint, self.model.unknowns()], costates.into());
            let mut products = StepProducts::new(self.product_programs(), sizes, at, phi, after, scratch);
            products.add(at, phi, after, &moved, &mut slopes, scratch);
        } else {
            steps.multiply(&self.curvature_of(steps, costates, phi, scratch), &moved, &mut slopes);
        }
        let mut ends = steps.ending_with(variation.costates, first + 1);
        if let Some((given, quadratics)) = of_cost {
            given.add_products_by_next(quadratics, &given.vary(&moved), &mut ends);
        }
        if let Some(more) = more {
            ends.as_mut_slice().iter_mut().zip(more.as_slice()).for_each(|(to, more)| *to += more);
        }
        steps.sweep_back(Some(&slopes), &mut ends, None);
        [moved, ends]
    }
}
