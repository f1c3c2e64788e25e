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

/// The parts of a batch at whose points any weight is not 0; all of it if there are no weights. Limits are active at few points
/// of a plan, and their second derivatives take long.
pub(super) fn weighed(batch: Batch, weights: &[&Matrices]) -> Vec<Batch> {
    if weights.is_empty() {
        return vec![batch];
    }
    let counts = |point: usize| weights.iter().any(|weights| weights.vector(point).iter().any(|weight| *weight != 0.0));
    let mut found: Vec<Batch> = Vec::new();
    for point in (batch.first..batch.first + batch.count).filter(|&point| counts(point)) {
        match found.last_mut() {
            // Points that are this near to one another run together.
            Some(part) if point < part.first + part.count + TOGETHER => part.count = point + 1 - part.first,
            _ => found.push(Batch { first: point, count: 1 }),
        }
    }
    found
}

/// Number of points that run at once at most.
const TOGETHER: usize = 8;

/// Sources that are read at the points themselves.
pub(super) fn at_points<'a>(at: Points<'a>) -> [Source<'a>; 2] {
    [at.states.into(), at.controls.into()]
}

/// A source that is read at the next state.
pub(super) fn after(matrices: &Matrices) -> Source<'_> {
    Source { matrices, shift: 1 }
}
