use std::sync::{Mutex, PoisonError};

use supple::Stop;
use supple::design::{Event, Observer};

/// Observes the progress of long work; called from several threads.
pub trait Progress: Send + Sync {
    /// Work of `total` parts began; `done` of them were done before.
    fn begin(&self, what: &str, done: u64, total: u64);

    /// `parts` more are done.
    fn advance(&self, parts: u64);

    /// A message to show with the progress, such as the best design so far.
    fn say(&self, _message: &str) {}
}

/// Ignores all progress.
#[derive(Clone, Copy, Debug, Default)]
pub struct Silent;

impl Progress for Silent {
    fn begin(&self, _: &str, _: u64, _: u64) {}
    fn advance(&self, _: u64) {}
}

/// How long work is watched and stopped. `Watch::default()` does neither.
#[derive(Clone, Copy)]
pub struct Watch<'a> {
    /// Sees how far it is.
    pub progress: &'a dyn Progress,
    /// When to stop, keeping what was found.
    pub stop: Stop<'a>,
}

/// Neither watched nor stopped.
impl Default for Watch<'_> {
    fn default() -> Self {
        Self { progress: &Silent, stop: Stop::never() }
    }
}

impl Watch<'_> {
    /// Whether to stop.
    pub fn is_stopped(&self) -> bool {
        self.stop.is_requested()
    }
}

/// What a design search has found so far, said beside its progress.
pub(crate) struct Searching<'a> {
    progress: &'a dyn Progress,
    feasibility: f64,
    seen: Mutex<Seen>,
}

#[derive(Default)]
struct Seen {
    evaluations: usize,
    best: Option<f64>,
}

impl<'a> Searching<'a> {
    /// For a search in which costs may exceed their limits by the relative tolerance `feasibility`.
    pub fn new(progress: &'a dyn Progress, feasibility: f64) -> Self {
        Self { progress, feasibility, seen: Mutex::default() }
    }
}

impl Observer for Searching<'_> {
    fn observe(&self, event: Event<'_>) {
        let mut seen = self.seen.lock().unwrap_or_else(PoisonError::into_inner);
        match event {
            Event::Evaluated { information, violation, .. } => {
                seen.evaluations += 1;
                if violation <= self.feasibility && seen.best.is_none_or(|best| information < best) {
                    seen.best = Some(information);
                }
                let best = match seen.best {
                    Some(nats) => format!("{:.2} bits", nats / std::f64::consts::LN_2),
                    None => "none feasible yet".to_owned(),
                };
                self.progress.say(&format!("{} designs, best {best}", seen.evaluations));
            }
            Event::Combination { done, of } => {
                self.progress.say(&format!("{done} of {of} combinations of catalogue entries"));
            }
            Event::StartBegan { .. }
            | Event::StartEnded { .. }
            | Event::Stepped { .. }
            | Event::SearchingBranches { .. } => {}
        }
    }
}
