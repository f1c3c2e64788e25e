use supple_lqg::ControlBounds;

use supple_model::{Limit, Limited};

/// The bounds of `controls` controls from limits of a system and more limits of controls by index, the lower and the upper
/// one; `None` if no control is limited.
///
/// If a control has several limits, the tightest ones count.
///
/// ```
/// use supple::Limit;
/// use supple::plan::bounds_of;
///
/// let limits = [(-5.0, 5.0), (-4.0, f64::INFINITY)];
/// let limits = limits.map(|(lower, upper)| Limit::control("torque".to_owned(), 0, lower, upper));
/// let bounds = bounds_of(&limits, &[(0, [-9.0, 9.0])], 1).ok_or("the control is limited")?;
/// assert_eq!((bounds.lower(), bounds.upper()), (&[-4.0][..], &[5.0][..]));
/// # Ok::<(), &'static str>(())
/// ```
#[must_use]
pub fn bounds_of(limits: &[Limit], more: &[(usize, [f64; 2])], controls: usize) -> Option<ControlBounds> {
    let mut bounds = vec![(f64::NEG_INFINITY, f64::INFINITY); controls];
    let of_system = limits.iter().filter_map(|limit| match limit.of {
        Limited::Control(control) => Some((control, [limit.lower, limit.upper])),
        _ => None,
    });
    for (control, [least, most]) in of_system.chain(more.iter().copied()) {
        if let Some((lower, upper)) = bounds.get_mut(control) {
            (*lower, *upper) = (lower.max(least), upper.min(most));
        }
    }
    let limited = bounds.iter().any(|(lower, upper)| lower.is_finite() || upper.is_finite());
    limited.then(|| ControlBounds::new(&bounds))
}
