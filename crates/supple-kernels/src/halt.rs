//! A process-wide request that long computations end within moments and discard partial results: for a
//! program that was asked to stop, when checking a flag only between two designs would be too late.

use std::sync::atomic::{AtomicBool, Ordering};

static REQUESTED: AtomicBool = AtomicBool::new(false);

/// Asks all long work of this process to end, or withdraws the request.
///
/// ```
/// use supple_kernels::halt;
///
/// halt::request(true);
/// assert!(halt::is_requested());
/// halt::request(false);
/// ```
pub fn request(wanted: bool) {
    REQUESTED.store(wanted, Ordering::SeqCst);
}

/// Whether a stop has been requested.
///
/// Example: [`request`].
#[inline]
pub fn is_requested() -> bool {
    REQUESTED.load(Ordering::Relaxed)
}
