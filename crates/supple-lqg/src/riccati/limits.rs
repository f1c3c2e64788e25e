use supple_kernels::Matrices;

use super::bounds::ControlBounds;

/// What restricts the controls in a sweep.
///
/// Example: [`solve_limited`](crate::solve_limited).
#[derive(Clone, Copy)]
pub enum Limits<'a> {
    /// Bounds, and the controls of the trajectory about which the sweep linearises.
    Bounds(&'a ControlBounds, &'a Matrices),
    /// Which controls do not move at all: m for each step.
    Held(&'a [bool]),
}
