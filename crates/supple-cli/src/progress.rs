use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, OnceLock};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};
use supple::design::{Event, Observer};
use supple::halt;
use supple_study::Watch;

/// Set by Ctrl-C and by SIGTERM: long work stops soon and keeps what it found.
pub static STOP: AtomicBool = AtomicBool::new(false);

/// A signal so soon after the first is the same one, sent by the terminal and by a study.
const SAME_SIGNAL: Duration = Duration::from_millis(500);

/// How work ends that a signal stops.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Stopping {
    /// At its next pause, as what is under way is of use.
    AtPause,
    /// Within moments: what is under way is kept elsewhere, or not at all.
    Now,
}

/// Listens for Ctrl-C and SIGTERM from now on; a second one ends the program at once.
pub fn listen(stopping: Stopping) {
    let first = OnceLock::new();
    let handler = move || {
        let now = Instant::now();
        if now.duration_since(*first.get_or_init(|| now)) > SAME_SIGNAL {
            std::process::exit(130);
        }
        STOP.store(true, Ordering::SeqCst);
        halt::request(stopping == Stopping::Now);
    };
    // Where signals cannot be listened for, Ctrl-C ends the program as usual.
    let _ = ctrlc::set_handler(handler);
}

/// A progress line on standard error, where that is a terminal.
pub struct Progress {
    bar: ProgressBar,
    feasibility: f64,
    state: Mutex<State>,
}

#[derive(Default)]
struct State {
    evaluations: usize,
    ended: usize,
    of: usize,
    /// Of catalogues: how many are done, and how many there are.
    combinations: Option<(usize, usize)>,
    best: Option<f64>,
}

impl Progress {
    /// Of a search in which costs may be above their bounds by a share `feasibility`.
    pub fn new(feasibility: f64) -> Self {
        let bar = ProgressBar::new_spinner();
        if let Ok(style) = ProgressStyle::with_template("{spinner} {elapsed} {msg}") {
            bar.set_style(style);
        }
        bar.enable_steady_tick(Duration::from_millis(100));
        Self { bar, feasibility, state: Mutex::default() }
    }

    pub fn finish(&self) {
        self.bar.finish_and_clear();
    }
}

impl Observer for Progress {
    fn observe(&self, event: Event) {
        let Ok(mut state) = self.state.lock() else { return };
        match event {
            Event::StartBegan { of, .. } => state.of = of,
            Event::StartEnded { .. } => state.ended += 1,
            Event::Evaluated { information, violation, .. } => {
                state.evaluations += 1;
                if violation <= self.feasibility && state.best.is_none_or(|best| information < best) {
                    state.best = Some(information);
                }
            }
            Event::Combination { done, of } => state.combinations = Some((done, of)),
            Event::Stepped { .. } | Event::SearchingBranches { .. } => {}
        }
        let best = state.best.map_or_else(
            || "none feasible yet".to_owned(),
            |nats| format!("{:.2} bits", nats / std::f64::consts::LN_2),
        );
        let State { evaluations, ended, of, combinations, .. } = &*state;
        self.bar.set_message(match combinations {
            Some((done, of)) => {
                format!("{done} of {of} combinations of catalogue entries; best without catalogues: {best}")
            }
            None => format!("{ended} of {of} starts, {evaluations} designs, best {best}"),
        });
    }
}

/// Does long work with a bar, until it is done or a signal stops it.
pub fn watched<T>(stopping: Stopping, work: impl FnOnce(Watch) -> T) -> T {
    listen(stopping);
    let bar = Bar::new();
    let found = work(Watch { progress: &bar, stop: &STOP });
    bar.finish();
    found
}

/// A bar with rate and time left on standard error, where that is a terminal.
struct Bar(ProgressBar);

impl Bar {
    fn new() -> Self {
        let bar = ProgressBar::new(0);
        let template = "{msg} {wide_bar} {pos} of {len}, {per_sec}, {eta} left";
        if let Ok(style) = ProgressStyle::with_template(template) {
            bar.set_style(style);
        }
        bar.enable_steady_tick(Duration::from_millis(100));
        Self(bar)
    }

    fn finish(&self) {
        self.0.finish_and_clear();
    }
}

impl supple_study::Progress for Bar {
    fn begin(&self, what: &str, done: u64, total: u64) {
        self.0.reset();
        self.0.set_length(total);
        self.0.set_position(done);
        self.0.reset_eta();
        self.0.set_message(what.to_owned());
    }

    fn advance(&self, parts: u64) {
        self.0.inc(parts);
    }

    fn say(&self, message: &str) {
        self.0.set_message(message.to_owned());
    }
}
