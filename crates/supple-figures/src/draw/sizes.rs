//! Sizes that all parts of a page share.

/// Size of the text of labels and titles, pt.
pub const LABEL: f64 = 8.0;

/// Size of the text of ticks, contours and legend, pt.
pub const SMALL: f64 = 7.0;

/// Length of a tick, pt.
pub const TICK: f64 = 2.5;

/// From one line of text to the next, in its size.
pub const LEADING: f64 = 1.2;

/// Width of a colour bar, and of the gap before it, pt.
pub const BAR: f64 = 6.0;
