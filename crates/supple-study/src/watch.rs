use std::sync::{Mutex, PoisonError};

use supple::Stop;
use supple::design::{Event, Observer};

/// Observes the progress of long work; called from several threads.
///
/// ```
/// use std::sync::atomic::{AtomicU64, Ordering};
///
/// use supple_study::sweep::{Axis, SweepOptions, run};
/// use supple_study::{LoadedTask, Progress, Source, Watch};
///
/// #[derive(Default)]
/// struct Count(AtomicU64);
///
/// impl Progress for Count {
///     fn begin(&self, _what: &str, done: u64, _total: u64) {
///         self.0.store(done, Ordering::Relaxed);
///     }
///     fn advance(&self, parts: u64) {
///         self.0.fetch_add(parts, Ordering::Relaxed);
///     }
/// }
/// # let text = r#"
/// #     model = { kind = "linear", A = [[1.0]], B = [[1.0]], C = [[1.0]] }
/// #     parameters.variance = { initial = 1e-2, bounds = [1e-4, 1.0] }
/// #     [[tasks]]
/// #     name = "hold"
/// #     steps = 20
/// #     time_step = 0.1
/// #     initial_state = [1.0]
/// #     noise = { initial = [1e-2], process = [1e-3], measurement = ["variance"] }
/// #     costs = [{ kind = "quadratic", Q = [[1.0]], R = [[1.0]] }]
/// # "#;
/// # let source = Source { path: "hold.toml".to_owned(), text: text.to_owned() };
///
/// // The task of the front page.
/// let task = LoadedTask::restore(&[source])?;
/// let axes = vec![Axis::parse("variance=log:1e-3:1e-1:3", &task)?];
/// let options = SweepOptions { axes, rollouts: 0, starts: 0, branches: 0, seed: 0 };
/// let count = Count::default();
/// run(&task, &options, None, Watch { progress: &count, ..Watch::default() })?;
/// assert_eq!(count.0.load(Ordering::Relaxed), 3);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub trait Progress: Send + Sync {
    /// Work of `total` parts began; `done` of them were done before.
    fn begin(&self, what: &str, done: u64, total: u64);

    /// `parts` more are done.
    fn advance(&self, parts: u64);

    /// A message to show with the progress, such as the best design so far.
    fn say(&self, _message: &str) {}
}

/// Ignores all progress.
///
/// Example: [`Watch::default`] uses it.
#[derive(Clone, Copy, Debug, Default)]
pub struct Silent;

impl Progress for Silent {
    fn begin(&self, _: &str, _: u64, _: u64) {}
    fn advance(&self, _: u64) {}
}

/// How long work is watched and stopped. `Watch::default()` does neither.
///
/// Example: the [front page](crate).
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
    #[must_use]
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
            _ => {}
        }
    }
}
