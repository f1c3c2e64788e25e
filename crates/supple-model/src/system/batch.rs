use supple_kernels::Matrices;

/// Variations of trajectory and costates, along which second derivatives are contracted.
#[derive(Clone, Copy, Debug)]
pub struct Variation<'a> {
    /// Of state and control together, vectors of length n + m, stages and end (where the control's part is 0).
    pub joint: &'a Matrices,
    /// Of the costates, vectors of length n; entry t belongs to the state at t.
    pub costates: &'a Matrices,
}
