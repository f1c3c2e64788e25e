use super::watch::Reach;

/// Result of one roll-out.
#[derive(Clone, Debug, Default)]
pub(crate) struct Outcome {
    /// Its cost; infinite where it diverged.
    pub cost: f64,
    pub diverged: bool,
    /// The sum of `nu' S^-1 nu` over its measurements.
    pub squared: f64,
    /// The logarithm of the likelihood of its measurements given the states over that given past measurements, by the filter
    /// that knows the plant best; NaN where that one failed.
    pub nats: f64,
    /// Which contacts touched at any of the steps that were checked.
    pub touched: Vec<bool>,
    /// How far it went beyond each limit that was looked at.
    pub limits: Vec<Reach>,
}
