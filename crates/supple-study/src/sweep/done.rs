//! Which parts of a sweep are done.

use std::collections::BTreeMap;

use super::grid::Grid;
use super::point::Neighbour;
use crate::Cell;

/// A point that is done.
pub(super) struct Done {
    pub segment: usize,
    pub point: usize,
    pub row: Vec<Cell>,
    /// What the next point of the segment continues from.
    pub neighbour: Neighbour,
}

/// A segment of which something is done.
#[derive(Clone)]
pub(super) struct Started {
    /// The first point to do; the end of the segment where all is done.
    pub next: usize,
    /// What it continues from; empty where all is done.
    pub neighbour: Neighbour,
}

/// How many points of segments are done.
pub(super) fn points_done(grid: &Grid, started: &BTreeMap<usize, Started>) -> usize {
    started.iter().map(|(&segment, of)| of.next - grid.segment(segment).start).sum()
}
