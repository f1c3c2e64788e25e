//! Enforced limits of authored models.

use supple_kernels::graph::Batch;
use supple_kernels::{Matrices, Scratch};

use super::authored::Authored;
use super::batch::{at_points, parts, weighed};
use super::kept::Kept;
use super::programs::excess_source;
use super::{Constraints, ExcessVariation, KeptEnd, Points};
use crate::followed::{Followed, LimitEnd};
use crate::{Channel, Model};

impl<M: Model> Authored<M> {
    /// Batches of stages, unless their excesses take the next state, and of the end, which is marked; if there are
    /// weights, only where any weight of a point is not 0.
    fn kept_batches(&self, at: &Points, weights: &[&Matrices]) -> impl Iterator<Item = (bool, Batch)> {
        let gives_next = self.kept.as_ref().is_some_and(|kept| kept.ends.need_next());
        let parts = parts(at).into_iter().filter(move |(last, batch)| batch.count > 0 && (*last || !gives_next));
        parts.flat_map(|(last, batch)| weighed(batch, weights).into_iter().map(move |batch| (last, batch)))
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
        for (last, batch) in self.kept_batches(&at, &[]) {
            let program = self.program(&excesses[usize::from(last)], |r| r.excesses(ends, last));
            program.run(batch, (&at_points(at), phi), (Some(&mut *out), &mut []), scratch);
        }
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
        for (last, batch) in self.kept_batches(&at, &[multipliers]) {
            let program = self.program(&jacobian[usize::from(last)], |r| r.excess_jacobian(ends, last));
            program.run(batch, (&at_points(at), phi), (Some(&mut *out), &mut []), scratch);
        }
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
        let [x, u] = at_points(at);
        let sources = [x, u, x, multipliers.into()];
        for (last, batch) in self.kept_batches(&at, &[multipliers]) {
            let program = self.program(&curvature[usize::from(last)], |r| r.excess_curvature(ends, last));
            program.run(batch, (&sources, phi), (Some(&mut *out), &mut []), scratch);
        }
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
                let sources = [x, u, x, multipliers.into()];
                for (last, batch) in self.kept_batches(&at, &[multipliers]) {
                    let cell = &parameter_gradient[usize::from(last)];
                    let program = self.program(cell, |r| r.excess_parameter_gradient(ends, last));
                    program.run(batch, (&sources, phi), (None, &mut *parameters), scratch);
                }
            }
            Some(moved) => {
                let mut sources = [x, u, x, x, x, x];
                sources[excess_source::MULTIPLIERS] = multipliers.into();
                sources[excess_source::VARIATION] = moved.joint.into();
                sources[excess_source::MULTIPLIER_VARIATION] = moved.multipliers.into();
                for (last, batch) in self.kept_batches(&at, &[multipliers, moved.multipliers]) {
                    let cell = &parameter_gradient_along[usize::from(last)];
                    let program = self.program(cell, |r| r.excess_parameter_gradient_along(ends, last));
                    program.run(batch, (&sources, phi), (None, &mut *parameters), scratch);
                }
            }
        }
    }
}
