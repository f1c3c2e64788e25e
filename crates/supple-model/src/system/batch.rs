//! The points of a batch as sources for programs.

use supple_kernels::Matrices;
use supple_kernels::graph::{Batch, Source};

use super::Points;

/// Variations of trajectory and costates, along which second derivatives are contracted.
#[derive(Clone, Copy, Debug)]
pub struct Variation<'a> {
    /// Of state and control together, vectors of length n + m, stages and end (where the control's part is 0).
    pub joint: &'a Matrices,
    /// Of the costates, vectors of length n; entry t belongs to the state at t.
    pub costates: &'a Matrices,
}

/// The stages and the end of a batch.
pub(super) fn parts(at: &Points) -> [(bool, Batch); 2] {
    let end = Batch { first: at.stages, count: usize::from(at.has_end) };
    [(false, Batch { first: 0, count: at.stages }), (true, end)]
}

/// Sources that are read at the points themselves.
pub(super) fn at_points<'a>(at: Points<'a>) -> [Source<'a>; 2] {
    [at.states.into(), at.controls.into()]
}

/// A source that is read at the next state.
pub(super) fn after(matrices: &Matrices) -> Source<'_> {
    Source { matrices, shift: 1 }
}
