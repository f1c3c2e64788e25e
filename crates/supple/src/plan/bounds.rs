use supple_lqg::ControlBounds;

use supple_model::{Limit, Limited};

/// The bounds of `controls` controls among the limits of a system; `None` where it limits no control.
///
/// Of several limits of one control the tightest count.
#[must_use]
pub fn bounds_of(limits: &[Limit], controls: usize) -> Option<ControlBounds> {
    let mut bounds = vec![(f64::NEG_INFINITY, f64::INFINITY); controls];
    for limit in limits {
        if let Limited::Control(control) = limit.of
            && let Some((lower, upper)) = bounds.get_mut(control)
        {
            *lower = lower.max(limit.lower);
            *upper = upper.min(limit.upper);
        }
    }
    let limited = bounds.iter().any(|(lower, upper)| lower.is_finite() || upper.is_finite());
    limited.then(|| ControlBounds::new(&bounds))
}
