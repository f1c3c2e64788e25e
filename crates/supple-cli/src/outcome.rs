/// How a command that computed something ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// Success.
    Success,
    /// Computed, but something did not converge or a bound is not met.
    Shortfall,
}

impl Outcome {
    /// The combined outcome of two operations.
    pub fn and(self, other: Self) -> Self {
        if self == Self::Success { other } else { self }
    }
}
