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

/// Radius of a marker, pt.
pub const RADIUS: f64 = 2.1;

/// From the middle of a marker to the outermost of its lines, pt: those of stars reach farthest.
pub const REACH: f64 = 2.1 * RADIUS + 0.7;
