//! Observing and stopping long computations.

use crate::Stop;

/// What happens during a long computation.
///
/// Example: [`Observer`].
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub enum Event<'a> {
    /// A start began; there are `of` of them.
    StartBegan {
        /// Its number, from 0.
        start: usize,
        /// How many there are.
        of: usize,
    },
    /// A design was evaluated.
    Evaluated {
        /// The start's number.
        start: usize,
        /// All its parameters.
        design: &'a [f64],
        /// The information, nats.
        information: f64,
        /// Expected cost of each task.
        costs: &'a [f64],
        /// How far the worst task is above its bound, or the price above the budget, relative to it.
        violation: f64,
    },
    /// The optimiser stepped to a design that it evaluated; other designs are trials of its line searches.
    Stepped {
        /// The start's number.
        start: usize,
        /// All its parameters.
        design: &'a [f64],
        /// Whether the next step may replace this one, as it is only the first trial of a line search.
        is_trial: bool,
    },
    /// Other local minima of the plans are being searched for.
    SearchingBranches {
        /// The start's number.
        start: usize,
    },
    /// A combination of entries of catalogues was designed.
    Combination {
        /// How many are done.
        done: usize,
        /// How many there are to be done, as far as is known.
        of: usize,
    },
    /// A start ended.
    StartEnded {
        /// Its number.
        start: usize,
    },
}

/// Receives progress events of a long computation; called from several threads.
///
/// ```
/// use std::sync::atomic::{AtomicUsize, Ordering};
///
/// use supple::design::{Control, DesignSettings, Event, Observer, design};
///
/// #[derive(Default)]
/// struct Count(AtomicUsize);
///
/// impl Observer for Count {
///     fn observe(&self, event: Event) {
///         if let Event::Evaluated { .. } = event {
///             self.0.fetch_add(1, Ordering::Relaxed);
///         }
///     }
/// }
/// # let task = r#"
/// #     model = { kind = "linear", A = [[1.0, 0.1], [0.1, 1.0]], B = [[0.0], [0.1]], C = [[1.0, 0.0]] }
/// #     parameters.variance = { initial = 1e-4, bounds = [1e-6, 1e-2], scale = "log", unit = "m^2" }
/// #     [[tasks]]
/// #     name = "balance"
/// #     steps = 50
/// #     time_step = 0.1
/// #     bound = 15.0
/// #     initial_state = [1.0, 0.0]
/// #     noise = { initial = [1e-2, 1e-2], process = [0.0, 1e-3], measurement = ["variance"] }
/// #     costs = [{ kind = "quadratic", Q = [[1.0, 0.0], [0.0, 0.1]], R = [[0.1]] }]
/// # "#;
///
/// // The task of the front page.
/// let problem = supple_file::parse(task, "balance.toml")?;
/// let settings = DesignSettings { starts: 1, ..problem.design.clone() };
/// let count = Count::default();
/// let control = Control { observer: &count, ..Control::default() };
/// design(&problem, &problem.parameters.initial(), &settings, control)?;
/// assert!(count.0.load(Ordering::Relaxed) > 0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub trait Observer: Send + Sync {
    /// Something happened.
    fn observe(&self, event: Event);
}

/// Ignores all progress.
///
/// Example: [`Control::default`] uses it.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoObserver;

impl Observer for NoObserver {
    fn observe(&self, _: Event) {}
}

/// How a long computation is observed and stopped. `Control::default()` does neither; use `..Control::default()` to set
/// only one of them.
///
/// Example: [`design`](crate::design::design()).
#[derive(Clone, Copy)]
pub struct Control<'a> {
    /// Receives progress events.
    pub observer: &'a dyn Observer,
    /// When to stop, keeping what was found.
    pub stop: Stop<'a>,
}

/// No observer, and never stopped.
impl Default for Control<'_> {
    fn default() -> Self {
        Self { observer: &NoObserver, stop: Stop::never() }
    }
}

impl Control<'_> {
    /// Whether to stop.
    #[must_use]
    pub fn is_stopped(&self) -> bool {
        self.stop.is_requested()
    }
}
