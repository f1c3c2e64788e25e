//! Time steps of several sub-steps, of authored models: each function of a step is that of its parts, composed.

use supple_kernels::graph::{Batch, Program, Source};
use supple_kernels::{Matrices, Scratch};

use super::authored::Authored;
use super::batch::at_points;
use super::products::StepProducts;
use super::programs::GradientOf;
use super::roll_out::{RollOut, step_by_step};
use super::substeps::{Step, Substeps};
use super::trace::source;
use super::{Points, System, Variation};
use crate::Model;
use crate::trajectory::Trajectory;

impl<M: Model> Authored<M> {
    /// Whether a time step is more than one step of integration.
    pub(super) fn is_divided(&self) -> bool {
        self.substeps > 1
    }

    pub(super) fn step_of<'a>(&'a self, phi: &'a [f64]) -> Step<'a> {
        let (next, jacobian) = (self.step_program(), self.jacobian_program());
        Step { next, jacobian, phi, size: self.size, substeps: self.substeps }
    }

    /// The next states at all stages, by a program of one step of integration.
    pub(super) fn step_all_with(
        &self,
        program: &Program,
        at: Points,
        phi: &[f64],
        next: &mut Matrices,
        scratch: &mut Scratch,
    ) {
        let (batch, [x, u]) = (Batch { first: 0, count: at.stages }, at_points(at));
        program.run(batch, (&[x, u], phi), (Some(&mut *next), &mut []), scratch);
        if self.is_divided() {
            let mut from = next.clone();
            for _ in 1..self.substeps {
                from.copy_from(next);
                program.run(batch, (&[(&from).into(), u], phi), (Some(&mut *next), &mut []), scratch);
            }
        }
    }

    /// From the state after the first sub-step, that after all of them.
    pub(super) fn go_on(&self, next: &mut [f64], mut step: impl FnMut(&[f64], &mut [f64])) {
        let mut from = next.to_vec();
        for _ in 1..self.substeps {
            from.copy_from_slice(next);
            step(&from, next);
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
            for _ in 1..self.substeps {
                from.copy_from_slice(next);
                step.run(&[&from, u], &mut [&mut *next]);
            }
            let mut cost = [0.0];
            stage_cost.run(&[x, u], &mut [&mut cost]);
            cost[0]
        });
        scratch.give_back(second);
        cost + self.cost(out.states.vector(out.steps()), &[], phi, true)
    }

    /// Theory, equation U.13.
    pub(super) fn add_curvature_divided(
        &self,
        (at, phi, costates): (Points, &[f64], &Matrices),
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
    fn curvature_of(&self, steps: &Substeps, costates: &Matrices, phi: &[f64], scratch: &mut Scratch) -> Matrices {
        let joint = self.size.joint();
        let mut curvature = Matrices::zeros(steps.batch().count, joint, joint + 1);
        self.add_step_curvature((steps.points(), phi, costates.into()), &mut curvature, scratch);
        curvature
    }

    /// The gradient of `<F_bar, [A B]>` of whole steps (theory, equation U.12).
    pub(super) fn contract_divided(
        &self,
        (at, phi, whole): (Points, &[f64], &Matrices),
        joint: &mut Matrices,
        parameters: &mut [f64],
        scratch: &mut Scratch,
    ) {
        let (step, size) = (self.step_of(phi), self.size.joint());
        let [contract, by_parameters] = [self.contraction_program(), self.gradient_program(GradientOf::Step, false)];
        for block in step.blocks(at.stages) {
            let steps = step.divide(at, block, scratch);
            let adjoints = steps.adjoints(&steps.products(), whole, block.first);
            let Points { states, controls, .. } = steps.points();
            let (x, u) = (states.into(), controls.into());
            let mut slopes = steps.vectors(size);
            let sources = [x, u, x, (&adjoints).into()];
            contract.run(steps.batch(), (&sources, phi), (Some(&mut slopes), &mut *parameters), scratch);
            let (mut ends, mut total) = (steps.vectors(self.size.states), Matrices::vectors(steps.stages, size));
            steps.sweep_back(Some(&slopes), &mut ends, Some(&mut total));
            let sources = [x, u, (&ends).into()];
            by_parameters.run(steps.batch(), (&sources, phi), (None, &mut *parameters), scratch);
            let stride = joint.stride();
            for i in 0..steps.stages {
                let rows = joint.at_mut(block.first + i)[size..].iter_mut().step_by(stride);
                rows.zip(total.vector(i)).for_each(|(to, slope)| *to += slope);
            }
        }
    }

    /// The gradient by the parameters of `lambda' f` of whole steps, or its derivative along a variation (theory, equations
    /// U.11 and U.14).
    pub(super) fn add_gradient_divided(
        &self,
        (at, phi, costates): (Points, &[f64], &Matrices),
        variation: Option<Variation>,
        parameters: &mut [f64],
        scratch: &mut Scratch,
    ) {
        let step = self.step_of(phi);
        let program = self.gradient_program(GradientOf::Step, variation.is_some());
        for block in step.blocks(at.stages) {
            let steps = step.divide(at, block, scratch);
            let costates = steps.costates(costates, block.first);
            let moved = variation.map(|variation| self.vary(&steps, (&costates, block), variation, phi, scratch));
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

    /// How the points of sub-steps and the costates after them vary.
    fn vary(
        &self,
        steps: &Substeps,
        (costates, block): (&Matrices, Batch),
        variation: Variation,
        phi: &[f64],
        scratch: &mut Scratch,
    ) -> [Matrices; 2] {
        let (joint, at) = (self.size.joint(), steps.points());
        let (mut moved, mut slopes) = (steps.vectors(joint), steps.vectors(joint));
        steps.sweep_forward(variation.joint, block.first, &mut moved);
        if self.has_costly_curvature() {
            let (sizes, at) = ([joint, self.model.unknowns()], (at, phi, costates.into()));
            let mut products = StepProducts::new(self.product_programs(), sizes, at, scratch);
            products.add(at, &moved, &mut slopes, scratch);
        } else {
            steps.multiply(&self.curvature_of(steps, costates, phi, scratch), &moved, &mut slopes);
        }
        let mut ends = steps.ending_with(variation.costates, block.first + 1);
        steps.sweep_back(Some(&slopes), &mut ends, None);
        [moved, ends]
    }
}
