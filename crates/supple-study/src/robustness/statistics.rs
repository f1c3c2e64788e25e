//! What samples of costs tell: means, confidence, quantiles, paired differences.

use supple::simulate::{half_width_95, student_tails};

use super::report::Paired;

/// Mean and standard deviation of a sample; NaN where it has a number that is not finite, or too few numbers.
pub(super) fn mean_and_deviation(sample: &[f64]) -> (f64, f64) {
    let count = sample.len() as f64;
    let mean = sample.iter().sum::<f64>() / count;
    if !mean.is_finite() {
        return (f64::NAN, f64::NAN);
    }
    let squares: f64 = sample.iter().map(|value| (value - mean).powi(2)).sum();
    (mean, if sample.len() > 1 { (squares / (count - 1.0)).sqrt() } else { f64::NAN })
}

/// Half-width of the confidence interval of a mean, by Student's t; NaN of fewer than two numbers.
pub(super) fn half_width(deviation: f64, count: usize) -> f64 {
    half_width_95(deviation / (count as f64).sqrt(), count)
}

/// A quantile of a sorted sample, linear between its numbers; NaN of an empty one.
pub(super) fn quantile(sorted: &[f64], share: f64) -> f64 {
    let Some(last) = sorted.len().checked_sub(1) else { return f64::NAN };
    let place = share * last as f64;
    let (below, rest) = (sorted[place.floor() as usize], place.fract());
    if rest == 0.0 {
        return below;
    }
    let above = sorted[(place.ceil() as usize).min(last)];
    if above.is_finite() { below + rest * (above - below) } else { above }
}

/// Whether the mean of differences over pairs is 0: Student's t test.
pub(super) fn paired(differences: &[f64]) -> Paired {
    let (difference, deviation) = mean_and_deviation(differences);
    let half = half_width(deviation, differences.len());
    let p_value = if deviation > 0.0 {
        let t = difference / (deviation / (differences.len() as f64).sqrt());
        student_tails(t, (differences.len() - 1) as f64)
    } else if deviation == 0.0 {
        // All differences are the same: either there is none, or there is one for certain.
        if difference == 0.0 { 1.0 } else { 0.0 }
    } else {
        f64::NAN
    };
    Paired { difference, interval_95: [difference - half, difference + half], p_value }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(found: f64, expected: f64, tolerance: f64) {
        assert!((found - expected).abs() <= tolerance * expected.abs(), "{found}, not {expected}");
    }

    /// Student's own data of 1908: hours of sleep gained with two drugs, in pairs.
    #[test]
    fn sleep_data() {
        let first = [0.7, -1.6, -0.2, -1.2, -0.1, 3.4, 3.7, 0.8, 0.0, 2.0];
        let second = [1.9, 0.8, 1.1, 0.1, -0.1, 4.4, 5.5, 1.6, 4.6, 3.4];
        let differences: Vec<f64> = first.iter().zip(second).map(|(a, b)| a - b).collect();
        let found = paired(&differences);
        close(found.difference, -1.58, 1e-12);
        close(found.p_value, 0.002_832_890, 1e-6);
        close(found.interval_95[0], -2.459_885_8, 1e-7);
        close(found.interval_95[1], -0.700_114_2, 1e-7);
    }

    #[test]
    fn certain_and_impossible_differences() {
        assert_eq!(paired(&[0.0, 0.0]).p_value, 1.0);
        assert_eq!(paired(&[2.0, 2.0]), Paired { difference: 2.0, interval_95: [2.0, 2.0], p_value: 0.0 });
        let diverged = paired(&[1.0, f64::INFINITY, 2.0]);
        assert!(diverged.difference.is_nan() && diverged.p_value.is_nan() && diverged.interval_95[0].is_nan());
        assert!(paired(&[]).p_value.is_nan());
    }

    #[test]
    fn quantiles_of_samples() {
        let sorted = [1.0, 2.0, 3.0, 4.0, 5.0];
        assert_eq!([0.0, 0.25, 0.5, 1.0].map(|share| quantile(&sorted, share)), [1.0, 2.0, 3.0, 5.0]);
        close(quantile(&sorted, 0.95), 4.8, 1e-12);
        assert_eq!(quantile(&[1.0, 2.0, f64::INFINITY], 0.75), f64::INFINITY);
        assert_eq!(quantile(&[1.0, 2.0, f64::INFINITY], 0.5), 2.0);
        assert!(quantile(&[], 0.5).is_nan());
    }
}
