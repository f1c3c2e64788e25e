//! How things ended, in words.

use supple::design::{DesignStatus, GradientKind, Method};
use supple_study::robustness::PlannedFor;
/// A count of things: `1 start`, `4 starts`.
pub use supple_text::count;

/// How a search ended, as the end of a sentence that begins with it.
pub fn ended(status: DesignStatus) -> &'static str {
    match status {
        DesignStatus::Converged => "converged",
        DesignStatus::NotOptimal => "stopped where the total gradient is not zero",
        DesignStatus::NotConverged => "did not converge",
        DesignStatus::BoundViolated => "found no design within all cost limits",
        DesignStatus::Stopped => "was stopped",
    }
}

/// An optimiser and its gradient.
pub fn method(method: Method, gradient: GradientKind) -> String {
    format!("{}, {gradient} gradient", method.description())
}

/// Which noise controllers are planned for.
pub fn planning(planned_for: PlannedFor) -> &'static str {
    match planned_for {
        PlannedFor::Nominal => "planned for the nominal noise",
        PlannedFor::Truth => "planned for the true noise",
    }
}

/// `a`, `a and b`, `a, b and c`.
pub fn list(items: &[String]) -> String {
    match items {
        [] => String::new(),
        [one] => one.clone(),
        [first @ .., last] => format!("{} and {last}", first.join(", ")),
    }
}
