//! A request of the whole process that long work end within moments, keeping nothing of what is under way: for a
//! program that was asked to stop, when a flag checked between two designs would be too late.

use std::sync::atomic::{AtomicBool, Ordering};

static REQUESTED: AtomicBool = AtomicBool::new(false);

/// Asks all long work of this process to end, or takes that back.
pub fn request(wanted: bool) {
    REQUESTED.store(wanted, Ordering::SeqCst);
}

/// Whether work is to end.
#[inline]
pub fn is_requested() -> bool {
    REQUESTED.load(Ordering::Relaxed)
}
