//! Enforced limits of authored models.

use std::sync::OnceLock;

use supple_kernels::graph::{Program, Source};
use supple_kernels::{Matrices, Scratch};

use super::authored::Authored;
use super::batch::{at_points, parts, weighed};
use super::kept::Kept;
use super::programs::{Recorder, excess_source};
use super::{Constraints, ExcessVariation, KeptEnd, Points};
use crate::followed::{Followed, LimitEnd};
use crate::{Channel, Model};

impl<M: Model> Authored<M> {
    /// Runs a program of stages, unless their excesses take the next state, and that of the end, each recorded when it is first
    /// asked for, where any of the weights of a point, if there are weights, is not 0.
    fn run_kept(
        &self,
        (cells, record): (&[OnceLock<Program>; 2], impl Fn(&Recorder<M>, bool) -> Program),
        (at, weights): (Points, &[&Matrices]),
        (sources, phi): (&[Source], &[f64]),
        (mut out, sums): (Option<&mut Matrices>, &mut [f64]),
        scratch: &mut Scratch,
    ) {
        let gives_next = self.kept.as_ref().is_some_and(|kept| kept.ends.need_next());
        for (last, batch) in parts(&at).into_iter().filter(|(last, batch)| batch.count > 0 && (*last || !gives_next)) {
            for batch in weighed(batch, weights) {
                let program = cells[usize::from(last)].get_or_init(|| record(&self.recorder(), last));
                program.run(batch, (sources, phi), (out.as_deref_mut(), &mut *sums), scratch);
            }
        }
    }
}

/// Systems without enforced limits do not expose this.
impl<M: Model> Constraints for Authored<M> {
    fn ends(&self) -> Vec<KeptEnd> {
        let Some(Kept { ends, .. }) = &self.kept else { return Vec::new() };
        let of_limit = |limit: &Followed| limit.quantity.channels(self.vocabulary());
        let channels: Vec<Vec<Channel>> = ends.followed.iter().map(of_limit).collect();
        let of_end = |end: &LimitEnd| KeptEnd { channel: channels[end.limit][end.entry].clone(), upper: end.upper };
        ends.list.iter().map(of_end).collect()
    }

    fn bounds(&self, phi: &[f64]) -> Vec<f64> {
        let Some(Kept { ends, .. }) = &self.kept else { return Vec::new() };
        ends.list.iter().map(|end| ends.bound(end).resolve(phi)).collect()
    }

    fn excesses(&self, at: Points, phi: &[f64], out: &mut Matrices, scratch: &mut Scratch) {
        let Some(kept) = &self.kept else { return };
        let Kept { ends, excesses, .. } = kept;
        if ends.need_next() {
            self.write_excesses_of_next(kept, at, phi, out, scratch);
        }
        let program = (excesses, |recorder: &Recorder<M>, last| recorder.excesses(ends, last));
        self.run_kept(program, (at, &[]), (&at_points(at), phi), (Some(out), &mut []), scratch);
        for i in at.stages..at.count() {
            let undefined = out.vector_mut(i).iter_mut().zip(&ends.of_control).filter(|(_, of_control)| **of_control);
            undefined.for_each(|(excess, _)| *excess = f64::NEG_INFINITY);
        }
    }

    fn of_control(&self) -> &[bool] {
        self.kept.as_ref().map_or(&[], |kept| &kept.ends.of_control)
    }

    fn excess_jacobians(
        &self,
        at: Points,
        phi: &[f64],
        multipliers: &Matrices,
        out: &mut Matrices,
        scratch: &mut Scratch,
    ) {
        let Some(kept) = &self.kept else { return };
        let Kept { ends, jacobian, .. } = kept;
        if ends.need_next() {
            self.write_excess_jacobians_of_next(kept, at, multipliers, phi, out, scratch);
        }
        let program = (jacobian, |recorder: &Recorder<M>, last| recorder.excess_jacobian(ends, last));
        self.run_kept(program, (at, &[multipliers]), (&at_points(at), phi), (Some(out), &mut []), scratch);
    }

    fn add_excess_curvature(
        &self,
        at: Points,
        phi: &[f64],
        multipliers: &Matrices,
        out: &mut Matrices,
        scratch: &mut Scratch,
    ) {
        let Some(kept) = &self.kept else { return };
        let Kept { ends, curvature, .. } = kept;
        if ends.need_next() {
            self.add_excess_curvature_of_next(kept, at, multipliers, phi, out, scratch);
        }
        let program = (curvature, |recorder: &Recorder<M>, last| recorder.excess_curvature(ends, last));
        let [x, u] = at_points(at);
        let sources = [x, u, x, multipliers.into()];
        self.run_kept(program, (at, &[multipliers]), (&sources, phi), (Some(out), &mut []), scratch);
    }

    fn add_excess_parameter_gradient(
        &self,
        at: Points,
        phi: &[f64],
        multipliers: &Matrices,
        variation: Option<ExcessVariation>,
        parameters: &mut [f64],
        scratch: &mut Scratch,
    ) {
        let Some(kept) = &self.kept else { return };
        let Kept { ends, parameter_gradient, parameter_gradient_along, .. } = kept;
        if ends.need_next() {
            self.add_excess_gradient_of_next(kept, (at, multipliers), variation, phi, parameters, scratch);
        }
        let [x, u] = at_points(at);
        match variation {
            None => {
                let record = |recorder: &Recorder<M>, last| recorder.excess_parameter_gradient(ends, last);
                let sources = [x, u, x, multipliers.into()];
                let program = (parameter_gradient, record);
                self.run_kept(program, (at, &[multipliers]), (&sources, phi), (None, parameters), scratch);
            }
            Some(moved) => {
                let record = |recorder: &Recorder<M>, last| recorder.excess_parameter_gradient_along(ends, last);
                let mut sources = [x, u, x, x, x, x];
                sources[excess_source::MULTIPLIERS] = multipliers.into();
                sources[excess_source::VARIATION] = moved.joint.into();
                sources[excess_source::MULTIPLIER_VARIATION] = moved.multipliers.into();
                let (program, weights) = ((parameter_gradient_along, record), [multipliers, moved.multipliers]);
                self.run_kept(program, (at, &weights), (&sources, phi), (None, parameters), scratch);
            }
        }
    }
}
