/// Axes are clipped if runs leave the range of plans by more than this many times its size.
const CLIPPED: f64 = 5.0;

/// An axis range around the plans, so that they stay readable, and the most distant value of the runs; `None` if the
/// runs do not go far beyond the plans.
///
/// ```
/// use supple_study::clipped;
///
/// let plans = [0.1, 0.3, 0.2];
/// assert_eq!(clipped(&plans, &[0.15, 0.4]), None);
/// assert_eq!(clipped(&plans, &[0.15, -1e27]).map(|(_, worst)| worst), Some(-1e27), "a run diverged");
/// ```
#[must_use]
pub fn clipped(plans: &[f64], runs: &[f64]) -> Option<([f64; 2], f64)> {
    let ends = |values: &[f64]| {
        let finite = values.iter().copied().filter(|value| value.is_finite());
        finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), value| (least.min(value), most.max(value)))
    };
    let ((least, most), (lowest, highest)) = (ends(plans), ends(runs));
    let size = (most - least).max(most.abs()).max(least.abs());
    let (above, below) = (highest - most, least - lowest);
    if !(size > 0.0 && size.is_finite()) || above.max(below) <= CLIPPED * size {
        return None;
    }
    Some(([least - size, most + size], if above > below { highest } else { lowest }))
}

#[cfg(test)]
mod tests {
    use super::clipped;

    #[test]
    fn one_point_that_diverges_does_not_flatten_a_plot() {
        let plans = [0.1, 0.3, 0.2];
        assert_eq!(clipped(&plans, &[0.15, 0.4, -0.2]), None);
        let (range, worst) = clipped(&plans, &[0.15, f64::NAN, -1e27, 0.2]).unwrap();
        assert_eq!(worst, -1e27);
        assert!(range[0] <= 0.1 && range[1] >= 0.3 && range[1] - range[0] < 1.0, "{range:?}");
        assert_eq!(clipped(&plans, &[]), None);
        assert_eq!(clipped(&[0.0, 0.0], &[1.0]), None, "nothing to compare with");
    }
}
