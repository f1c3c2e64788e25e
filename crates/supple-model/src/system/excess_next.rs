//! Excesses beyond limits of quantities that take the next state: like stage costs that do, with multipliers as weights.

use supple_kernels::graph::{Batch, Source};
use supple_kernels::{Matrices, Scratch, dispatch};

use super::authored::Authored;
use super::authored_substeps::Moving;
use super::batch::weighed;
use super::kept::Kept;
use super::next::{GivenNext, Spread};
use super::programs::{GradientOf, excess_source};
use super::substeps::step_repeatedly;
use super::trace::source;
use super::{ExcessVariation, Points, Variation};
use crate::Model;

impl<M: Model> Authored<M> {
    /// The excesses of all stages.
    pub(super) fn write_excesses_of_next(
        &self,
        kept: &Kept,
        at: Points,
        phi: &[f64],
        out: &mut Matrices,
        scratch: &mut Scratch,
    ) {
        let mut next = Matrices::vectors(at.stages, self.size.states);
        step_repeatedly(self.step_program(), self.substeps, at, phi, &mut next, scratch);
        let program = kept.excesses[0].get_or_init(|| self.recorder().excesses(&kept.ends, false));
        let sources = [at.states.into(), at.controls.into(), (&next).into()];
        program.run(Batch { first: 0, count: at.stages }, (&sources, phi), (Some(out), &mut []), scratch);
    }

    /// Blocks of stages with any weight that is not 0, with the states that they lead to.
    fn blocks_given_next<'a>(
        &self,
        kept: &'a Kept,
        at: Points,
        weights: &[&Matrices],
        phi: &[f64],
        scratch: &mut Scratch,
        mut work: impl FnMut(&GivenNext<'a>, Batch, &mut Scratch),
    ) {
        let counting = kept.counting.get_or_init(|| self.recorder().excesses_count(&kept.ends));
        let step = self.step_of(phi);
        for part in weighed(Batch { first: 0, count: at.stages }, weights) {
            for block in step.blocks(part.count) {
                let block = Batch { first: part.first + block.first, count: block.count };
                let given = self.given_next(step.divide(at, block, scratch), &counting[..], phi, scratch);
                work(&given, block, scratch);
            }
        }
    }

    /// `e_z` of the stages with multipliers.
    pub(super) fn write_excess_jacobians_of_next(
        &self,
        kept: &Kept,
        at: Points,
        multipliers: &Matrices,
        phi: &[f64],
        out: &mut Matrices,
        scratch: &mut Scratch,
    ) {
        let program = kept.jacobian[0].get_or_init(|| self.recorder().excess_jacobian(&kept.ends, false));
        self.blocks_given_next(kept, at, &[multipliers], phi, scratch, |given, block, scratch| {
            let mut by_both = Matrices::zeros(block.count, out.rows(), given.wide);
            program.run(given.batch(), (&given.sources(), phi), (Some(&mut by_both), &mut []), scratch);
            let (from, to, joint) = (by_both.stride(), out.stride(), given.joint);
            for i in 0..block.count {
                let rows = by_both.at(i).chunks_exact(from).zip(out.at_mut(block.first + i).chunks_exact_mut(to));
                for (by_both, row) in rows {
                    row[..joint].copy_from_slice(&by_both[..joint]);
                    for (&slope, moved) in by_both[joint..].iter().zip(given.rows(i)) {
                        row[..joint].iter_mut().zip(moved).for_each(|(to, entry)| *to += slope * entry);
                    }
                }
            }
        });
    }

    /// `[(mu' e)'' | (mu' e)']` of a block, by `z` and the next state.
    fn excess_quadratics(
        &self,
        kept: &Kept,
        given: &GivenNext,
        multipliers: &Matrices,
        phi: &[f64],
        scratch: &mut Scratch,
    ) -> Matrices {
        let program = kept.curvature[0].get_or_init(|| self.recorder().excess_curvature(&kept.ends, false));
        let mut out = Matrices::zeros(given.steps.stages, given.wide, given.wide + 1);
        let [x, u, next] = given.sources();
        let sources = [x, u, next, multipliers.into()];
        program.run(given.batch(), (&sources, phi), (Some(&mut out), &mut []), scratch);
        out
    }

    /// Adds `(mu' e)_zz` of the stages with multipliers, as for stage costs of the next state.
    pub(super) fn add_excess_curvature_of_next(
        &self,
        kept: &Kept,
        at: Points,
        multipliers: &Matrices,
        phi: &[f64],
        out: &mut Matrices,
        scratch: &mut Scratch,
    ) {
        let joint = self.size.joint();
        self.blocks_given_next(kept, at, &[multipliers], phi, scratch, |given, block, scratch| {
            let quadratics = self.excess_quadratics(kept, given, &part(multipliers, block), phi, scratch);
            let mut spread = Matrices::zeros(block.count, joint, joint + 1);
            dispatch(Spread { given, quadratics: &quadratics, out: &mut spread, first: 0 });
            let costates = self.costates_of_cost(given, &quadratics, None);
            let curved = self.curvature_of(&given.steps, &costates, phi, scratch);
            given.steps.add_curvature(&given.products, &curved, &mut spread, 0);
            for i in 0..block.count {
                let stride = spread.stride();
                let rows = out.at_mut(block.first + i).chunks_exact_mut(stride);
                for (to, from) in rows.zip(spread.at(i).chunks_exact(stride)) {
                    to[..joint].iter_mut().zip(from).for_each(|(to, more)| *to += more);
                }
            }
        });
    }

    /// Adds the gradient of `sum mu' e` over the stages by the parameters, or its derivative along a variation.
    pub(super) fn add_excess_gradient_of_next(
        &self,
        kept: &Kept,
        (at, multipliers): (Points, &Matrices),
        variation: Option<ExcessVariation>,
        phi: &[f64],
        parameters: &mut [f64],
        scratch: &mut Scratch,
    ) {
        let n = self.size.states;
        let weights: Vec<&Matrices> =
            [Some(multipliers), variation.map(|moved| moved.multipliers)].into_iter().flatten().collect();
        let still = Matrices::vectors(at.stages + 1, n);
        let of_steps = self.gradient_program(GradientOf::Step, variation.is_some());
        self.blocks_given_next(kept, at, &weights, phi, scratch, |given, block, scratch| {
            let weights = part(multipliers, block);
            let quadratics = self.excess_quadratics(kept, given, &weights, phi, scratch);
            let costates = self.costates_of_cost(given, &quadratics, None);
            let [x, u, next] = given.sources();
            let mut sources = [x, u, next, x, x, x];
            sources[excess_source::MULTIPLIERS] = (&weights).into();
            let Points { states, controls, .. } = given.steps.points();
            let x = Source::from(states);
            let mut of_step = [x, controls.into(), (&costates).into(), x, x, x, x, x];
            let Some(variation) = variation else {
                let record = || self.recorder().excess_parameter_gradient(&kept.ends, false);
                let program = kept.parameter_gradient[0].get_or_init(record);
                program.run(given.batch(), (&sources, phi), (None, &mut *parameters), scratch);
                of_steps.run(given.steps.batch(), (&of_step, phi), (None, &mut *parameters), scratch);
                return;
            };
            // The multipliers' variation changes slopes by the next state, and so the costates.
            let moved_weights = part(variation.multipliers, block);
            let moved_quadratics = self.excess_quadratics(kept, given, &moved_weights, phi, scratch);
            let mut more = given.steps.vectors(n);
            given.add_slopes_by_next(&moved_quadratics, &mut more);
            let of_states = Variation { joint: variation.joint, costates: &still };
            let (of_cost, more) = (Some((given, &quadratics)), Some(&more));
            let moving = Moving { variation: of_states, first: block.first, of_cost, more };
            let [joint, moved_costates] = self.vary(&given.steps, &costates, moving, phi, scratch);
            let along = given.vary(&joint);
            sources[excess_source::VARIATION] = (&along).into();
            sources[excess_source::MULTIPLIER_VARIATION] = (&moved_weights).into();
            let record = || self.recorder().excess_parameter_gradient_along(&kept.ends, false);
            let program = kept.parameter_gradient_along[0].get_or_init(record);
            program.run(given.batch(), (&sources, phi), (None, &mut *parameters), scratch);
            of_step[source::VARIATION] = (&joint).into();
            of_step[source::COSTATE_VARIATION] = (&moved_costates).into();
            of_steps.run(given.steps.batch(), (&of_step, phi), (None, &mut *parameters), scratch);
        });
    }
}

/// The vectors of a block.
fn part(vectors: &Matrices, block: Batch) -> Matrices {
    let mut part = Matrices::vectors(block.count, vectors.cols());
    (0..block.count).for_each(|i| part.vector_mut(i).copy_from_slice(vectors.vector(block.first + i)));
    part
}
