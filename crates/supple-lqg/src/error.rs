use supple_text::significant;

/// Digits of costs in messages.
const SHOWN: usize = 6;

/// Why something could not be computed.
///
/// ```
/// use supple_lqg::{Knots, LinearQuadratic};
///
/// // C has two columns for one state.
/// let plant = LinearQuadratic { a: &[[0.9]], b: &[[1.0]], c: &[[1.0, 0.0]], q: &[[2.0]], r: &[[0.1]] };
/// let found = Knots::linear(10, plant);
/// let message = found.err().map(|error| error.to_string());
/// assert_eq!(message.as_deref(), Some("a row of C has length 2, not 1"));
/// ```
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A matrix that must be positive definite is not.
    #[error("{what} is not positive definite at step {step}")]
    NotPositiveDefinite {
        /// Which matrix.
        what: &'static str,
        /// Where.
        step: usize,
    },
    /// A matrix that must be symmetric and positive semidefinite is not.
    #[error("{what} must be symmetric and positive semidefinite; at step {step} {found}")]
    NotPositiveSemidefinite {
        /// Which matrix.
        what: &'static str,
        /// Where.
        step: usize,
        /// Which of its entries, or which eigenvalue, and what it is.
        found: String,
    },
    /// An expected cost that no controller reaches.
    #[error(
        "no finite information achieves an expected cost of {}: with the state known exactly the least cost is {}; choose a larger cost",
        significant(*cost, SHOWN), significant(*least, SHOWN)
    )]
    CostBelowLeast {
        /// The cost asked for.
        cost: f64,
        /// The least there is.
        least: f64,
    },
    /// A bound that could not be computed.
    #[error("no certified bound: {what}; {advice}")]
    NoBound {
        /// What is in the way.
        what: String,
        /// What to change.
        advice: &'static str,
    },
    /// A number became infinite or not a number.
    #[error("{what} is not finite at step {step}")]
    NotFinite {
        /// Which number.
        what: &'static str,
        /// Where.
        step: usize,
    },
    /// Stopped by [`supple_kernels::halt`].
    #[error("stopped; no result was stored")]
    Stopped,
    /// Something has the wrong shape.
    #[error("{what} has length {found}, not {expected}")]
    Shape {
        /// Which thing.
        what: String,
        /// Its length.
        found: usize,
        /// The right length.
        expected: usize,
    },
    /// A size exceeds its limit.
    #[error("{what} must be at most {most}; found {found}")]
    TooMany {
        /// What was asked for.
        what: String,
        /// How many.
        found: usize,
        /// How many there may be.
        most: usize,
    },
    /// Candidate sensors whose noise is correlated.
    #[error("the noise of measurements {first} and {second} is correlated; put both in one sensor")]
    CorrelatedSensors {
        /// The index of a measurement of one.
        first: usize,
        /// The index of a measurement of the other.
        second: usize,
    },
    /// A candidate sensor with a price that none can have.
    #[error("sensor `{sensor}` has the price {price:?}; valid: 0 or more")]
    SensorPrice {
        /// Its name.
        sensor: String,
        /// Its price.
        price: f64,
    },
    /// A candidate sensor with a measurement that the plant does not have.
    #[error("sensor `{sensor}` has the measurement {row}, counted from 0, but the plant has {count}")]
    MissingMeasurement {
        /// Its name.
        sensor: String,
        /// The index of the measurement.
        row: usize,
        /// How many measurements there are.
        count: usize,
    },
    /// A number that nothing can be computed with.
    #[error("{what} is {found:?}; valid: {valid}")]
    OutOfRange {
        /// Which number.
        what: &'static str,
        /// What it is.
        found: f64,
        /// What it may be.
        valid: &'static str,
    },
    /// A measurement that belongs to two candidate sensors, or twice to one.
    #[error("measurement {row} belongs to sensor `{first}` and again to `{second}`; it may belong to one")]
    SharedMeasurement {
        /// The index of the measurement.
        row: usize,
        /// The name of a sensor.
        first: String,
        /// The name of the other, or the same.
        second: String,
    },
    /// No set of sensors within the limits is good enough.
    #[error(
        "no set of sensors within the limits has an expected cost of at most {}; with all of them it is {}",
        significant(*bound, SHOWN), significant(*least, SHOWN)
    )]
    NoSensorsSuffice {
        /// The bound on the expected cost.
        bound: f64,
        /// The expected cost with every candidate.
        least: f64,
    },
    /// No set of sensors that is good enough was found.
    #[error(
        "no set of sensors within the limits with an expected cost of at most {} was found, which does not prove that \
         there is none: ask for the method `exhaustive`, or loosen the limits",
        significant(*bound, SHOWN)
    )]
    NoSensorsFound {
        /// The bound on the expected cost.
        bound: f64,
    },
}
