//! Whether an expected cost meets its bound, and a price its budget: the one comparison that searches, evaluations, tables,
//! sweeps and exit codes share.

/// How far above its bound an expected cost may be for the task to count as met, relative to the bound, if
/// `[design] feasibility` is not set.
///
/// Example: [`meets`].
pub const FEASIBILITY: f64 = 1e-6;

/// `(J - D) / |D|`: how far a number is above its bound, relative to it; infinite where it is not a number.
///
/// ```
/// assert!((supple::violation(110.0, 100.0) - 0.1).abs() < 1e-12);
/// ```
#[must_use]
pub fn violation(value: f64, bound: f64) -> f64 {
    if bound == f64::INFINITY && value < f64::INFINITY {
        return f64::NEG_INFINITY;
    }
    let violation = (value - bound) / bound.abs().max(1e-300);
    if violation.is_nan() { f64::INFINITY } else { violation }
}

/// Whether a number is at most its bound, with a relative tolerance `feasibility`. A number that is not finite is never
/// feasible, even without a bound.
///
/// ```
/// use supple::{FEASIBILITY, meets};
///
/// assert!(meets(249.0, Some(250.0), FEASIBILITY) && meets(1e9, None, FEASIBILITY));
/// assert!(!meets(251.0, Some(250.0), FEASIBILITY) && !meets(f64::NAN, None, FEASIBILITY));
/// ```
#[must_use]
pub fn meets(value: f64, bound: Option<f64>, feasibility: f64) -> bool {
    value.is_finite() && bound.is_none_or(|bound| violation(value, bound) <= feasibility)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounds_of_every_sign_are_met_up_to_a_share_of_them() {
        assert!(meets(100.09, Some(100.0), 1e-3) && !meets(100.11, Some(100.0), 1e-3));
        assert!(meets(-99.91, Some(-100.0), 1e-3) && !meets(-99.89, Some(-100.0), 1e-3));
        assert!(meets(0.0, Some(0.0), 1e-3) && !meets(1e-12, Some(0.0), 1e-3));
        assert!(meets(1e300, Some(f64::INFINITY), 0.0) && meets(1e300, None, 0.0));
    }

    #[test]
    fn numbers_that_are_not_finite_meet_no_bound() {
        for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            assert!(
                !meets(value, None, 1.0) && !meets(value, Some(f64::INFINITY), 1.0) && !meets(value, Some(1.0), 1.0)
            );
        }
    }
}
