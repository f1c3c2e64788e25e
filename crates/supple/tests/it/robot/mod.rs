//! Robots from files through the public interface: against independent programs, by their physics, and bad task files.

mod actuators;
pub mod arm;
mod bad_tasks;
mod bad_uses;
mod contact;
mod door;
mod elastic;
pub mod examples;
mod fields;
mod golden;
mod inserted;
mod integrator;
mod last_step;
mod limits;
mod locked;
mod mimic;
mod overrides;
mod planning;
mod quantities;
mod registries;
mod stability;
mod starts;
mod substeps;
mod torque_limits;
mod touching;
mod weights;

use crate::common::reference;

/// Compares lists of numbers, relative to the largest.
#[track_caller]
fn assert_close(what: &str, found: &[f64], expected: &[f64], tolerance: f64) {
    let error = reference::relative_error(found, expected);
    assert!(error <= tolerance, "{what}: {found:?} instead of {expected:?}, off by {error:.1e}");
}
