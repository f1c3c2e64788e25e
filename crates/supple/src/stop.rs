use std::sync::atomic::{AtomicBool, Ordering};

/// A request to stop a long computation, which keeps what it has found so far.
///
/// ```
/// use std::sync::atomic::{AtomicBool, Ordering};
/// use supple::Stop;
///
/// let flag = AtomicBool::new(false);
/// let stop = Stop::when(&flag);
/// assert!(!stop.is_requested() && !Stop::never().is_requested());
/// flag.store(true, Ordering::Relaxed); // by another thread, a handler of Ctrl-C ..
/// assert!(stop.is_requested());
/// ```
#[derive(Clone, Copy, Debug, Default)]
pub struct Stop<'a>(Option<&'a AtomicBool>);

impl<'a> Stop<'a> {
    /// No request ever.
    #[must_use]
    pub const fn never() -> Self {
        Self(None)
    }

    /// Requested once the flag is set.
    #[must_use]
    pub const fn when(flag: &'a AtomicBool) -> Self {
        Self(Some(flag))
    }

    /// Whether a stop has been requested.
    #[must_use]
    pub fn is_requested(self) -> bool {
        self.0.is_some_and(|flag| flag.load(Ordering::Relaxed))
    }
}
