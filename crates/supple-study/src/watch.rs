use std::sync::atomic::{AtomicBool, Ordering};

/// Sees how far long work is; called from several threads.
pub trait Progress: Send + Sync {
    /// Work of `total` parts began; `done` of them were done before.
    fn begin(&self, what: &str, done: u64, total: u64);

    /// `parts` more are done.
    fn advance(&self, parts: u64);

    /// Something to say beside it, such as the best design until now.
    fn say(&self, _message: &str) {}
}

/// Ignores all progress.
#[derive(Clone, Copy, Debug, Default)]
pub struct Silent;

impl Progress for Silent {
    fn begin(&self, _: &str, _: u64, _: u64) {}
    fn advance(&self, _: u64) {}
}

/// How long work is watched and stopped.
#[derive(Clone, Copy)]
pub struct Watch<'a> {
    /// Sees how far it is.
    pub progress: &'a dyn Progress,
    /// Set to stop soon, keeping what was found.
    pub stop: &'a AtomicBool,
}

impl Watch<'_> {
    /// Whether to stop.
    pub fn is_stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }
}
