use supple_kernels::Matrices;

use super::bounds::ControlBounds;

/// What keeps controls from moving freely in a sweep.
#[derive(Clone, Copy)]
pub enum Limits<'a> {
    /// Bounds, and the controls of the trajectory that the sweep is about.
    Bounds(&'a ControlBounds, &'a Matrices),
    /// Which controls do not move at all: m of each step.
    Held(&'a [bool]),
}
