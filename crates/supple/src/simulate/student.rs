//! Student's t: how far the mean of a small sample may be from the expectation.

use statrs::function::beta::checked_beta_reg;

/// The number of standard errors that Student's t with `freedom` degrees of freedom exceeds, on either side, with a
/// probability of `outside`; NaN without freedom.
///
/// ```
/// use supple::simulate::student_quantile;
///
/// // A mean of 20 numbers is within 2.09 of its standard errors of the expectation, in 95 % of all samples.
/// assert!((student_quantile(0.05, 19.0) - 2.093024).abs() < 1e-6);
/// ```
#[must_use]
pub fn student_quantile(outside: f64, freedom: f64) -> f64 {
    if !(freedom > 0.0 && outside > 0.0) {
        return f64::NAN;
    }
    let exceeds = |t: f64| student_tails(t, freedom) > outside;
    let mut above: f64 = 1.0;
    while exceeds(above) {
        above *= 2.0;
    }
    let mut below = 0.0;
    // Halves of an interval that doubles to more than the quantile: no digits are left after so many.
    for _ in 0..64 {
        let middle = 0.5 * (below + above);
        *(if exceeds(middle) { &mut below } else { &mut above }) = middle;
    }
    0.5 * (below + above)
}

/// Half-width of the 95 % confidence interval of the mean of `count` samples with a standard error; NaN of fewer than two.
///
/// ```
/// use supple::simulate::half_width_95;
///
/// assert!((half_width_95(0.1, 20) - 0.2093024).abs() < 1e-7);
/// ```
#[must_use]
pub fn half_width_95(standard_error: f64, count: usize) -> f64 {
    student_quantile(0.05, count as f64 - 1.0) * standard_error
}

/// How likely Student's t is as far from 0 as `t`, on either side: `I_(nu / (nu + t^2)) (nu / 2, 1 / 2)`, which keeps
/// its digits where it is small.
///
/// ```
/// use supple::simulate::student_tails;
///
/// // Of one degree of freedom it is Cauchy's: half of it is farther from 0 than 1.
/// assert!((student_tails(1.0, 1.0) - 0.5).abs() < 1e-12);
/// ```
#[must_use]
pub fn student_tails(t: f64, freedom: f64) -> f64 {
    checked_beta_reg(0.5 * freedom, 0.5, freedom / (freedom + t * t)).unwrap_or(f64::NAN)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(found: f64, expected: f64, tolerance: f64) {
        assert!((found - expected).abs() <= tolerance * expected.abs(), "{found}, not {expected}");
    }

    /// From tables of Student's distribution, and closed forms for one and two degrees of freedom.
    #[test]
    fn quantiles_of_student() {
        let tangent = (std::f64::consts::PI * 0.475).tan();
        close(student_quantile(0.05, 1.0), tangent, 1e-9);
        close(student_quantile(0.05, 2.0), 0.95 * (2.0 / (4.0 * 0.975 * 0.025f64)).sqrt(), 1e-9);
        close(student_quantile(0.05, 19.0), 2.093_024_054_408_263, 1e-9);
        // The normal distribution's, and the first term of what it lacks: (z^3 + z) / (4 nu).
        let normal = 1.959_963_984_540_054f64;
        let first = |freedom: f64| normal + (normal.powi(3) + normal) / (4.0 * freedom);
        close(student_quantile(0.05, 1999.0), first(1999.0), 1e-6);
        close(student_quantile(0.05, 1e6), first(1e6), 1e-10);
        assert!(student_quantile(0.05, 0.0).is_nan());
    }

    /// Closed forms for one degree of freedom (Cauchy) and two, and a far tail.
    #[test]
    fn tails_of_student() {
        close(student_tails(1.0, 1.0), 0.5, 1e-12);
        close(student_tails(-3.0, 2.0), 1.0 - 3.0 / 11f64.sqrt(), 1e-10);
        close(student_tails(2.093_024_054_408_263, 19.0), 0.05, 1e-9);
        assert_eq!(student_tails(0.0, 7.0), 1.0);
        let far = student_tails(40.0, 1999.0);
        assert!(far > 0.0 && far < 1e-200, "{far}");
    }
}
