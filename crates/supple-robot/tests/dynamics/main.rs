//! Identities of rigid-body dynamics on robots at random, and how many operations an arm takes.

#![allow(clippy::unwrap_used, clippy::expect_used)]

mod identities;
mod locked;
mod mimic;
mod recorder;
mod robots;
mod structure;

/// Asserts that the entries are equal to `tolerance`, relative to the largest of them or 1.
fn assert_close(what: &str, a: &[f64], b: &[f64], tolerance: f64) {
    assert_eq!(a.len(), b.len(), "{what}");
    let largest = a.iter().chain(b).fold(1.0, |largest: f64, entry| largest.max(entry.abs()));
    for (x, y) in a.iter().zip(b) {
        assert!((x - y).abs() <= tolerance * largest, "{what}: {a:?} and {b:?}");
    }
}

/// `A x`
fn product(matrix: &[Vec<f64>], x: &[f64]) -> Vec<f64> {
    matrix.iter().map(|row| dot(row, x)).collect()
}

/// `a' b`
fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
