use supple_kernels::rows::{Rows, View};
use supple_kernels::{Job, Lanes};

use super::state::Belief;
use crate::carried::Carried;
use crate::knots::Knots;
use crate::shape::Shape;
use crate::transport::Mover;

/// Number of states from which exploiting the position-rate structure pays off.
pub(super) const LEAST: usize = 20;

/// Prediction step `P_to = A_from Sigma_from A_from' + W`, as a part of a sweep.
pub(super) struct Predict<'a, R> {
    pub shape: Shape<R>,
    pub suggested: Option<Carried>,
    pub from: usize,
    pub to: usize,
    pub knots: &'a Knots,
    pub w: &'a [f64],
    pub belief: &'a mut Belief,
}

impl<R: Rows> Job for Predict<'_, R> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self { shape, suggested, from, to, knots, w, belief } = self;
        let (narrow, wide, f) = (shape.narrow(), shape.wide(), knots.dynamics.at(from));
        let carried = Carried::at_step::<L>(suggested, f, wide);
        let Belief { predicted, corrected, work, .. } = belief;
        let (sigma, w) = (View::new(corrected.at(from), narrow), Some(View::new(w, narrow)));
        let mover = Mover { f: View::new(f, wide), rows: shape.n, columns: shape.n, carried };
        mover.transport::<L, R>(sigma, w, predicted.at_mut(to), &mut work.transport);
    }
}
