use supple_lqg::ControlBounds;

use supple_model::{Limit, Limited};

/// The bounds of `controls` controls from those of the limits that are of controls; `None` if no control is limited.
///
/// If a control has several limits, the tightest ones count.
///
/// ```
/// use supple::Limit;
/// use supple::plan::bounds_of;
///
/// let limits = [(-5.0, 5.0), (-4.0, f64::INFINITY)];
/// let limits = limits.map(|(lower, upper)| Limit::control("torque".to_owned(), 0, lower, upper));
/// let bounds = bounds_of(&limits, 1).ok_or("the control is limited")?;
/// assert_eq!((bounds.lower(), bounds.upper()), (&[-4.0][..], &[5.0][..]));
/// # Ok::<(), &'static str>(())
/// ```
#[must_use]
pub fn bounds_of<'a>(limits: impl IntoIterator<Item = &'a Limit>, controls: usize) -> Option<ControlBounds> {
    let mut bounds = vec![[f64::NEG_INFINITY, f64::INFINITY]; controls];
    for limit in limits {
        if let Limited::Control(control) = limit.of
            && let Some([lower, upper]) = bounds.get_mut(control)
        {
            (*lower, *upper) = (lower.max(limit.lower), upper.min(limit.upper));
        }
    }
    let limited = bounds.iter().flatten().any(|bound| bound.is_finite());
    limited.then(|| ControlBounds::new(&bounds))
}
