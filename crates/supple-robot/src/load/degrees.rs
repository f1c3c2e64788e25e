//! Angles in rad that seem to be degrees.

use supple_text::digits;

/// A full turn, rad, with rounding of a file's digits.
pub(super) const TURN: f64 = 6.3;

/// Whether an angle, rad, is greater than a full turn, as no orientation is.
pub(super) fn turns<const N: usize>(angles: [f64; N]) -> bool {
    angles.iter().any(|angle| angle.abs() > TURN)
}

/// Numbers as in a file.
pub(super) fn given<const N: usize>(angles: [f64; N]) -> String {
    angles.map(digits).join(" ")
}
