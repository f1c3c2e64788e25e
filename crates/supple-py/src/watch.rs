//! Long work: away from the interpreter, watched and stopped from it.

use std::collections::VecDeque;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use pyo3::prelude::*;
use supple::Stop;
use supple_study::{Progress, StudyError, Watch};

use crate::errors;
use crate::own::Failures;
use crate::pool::{self, Running};

/// How often progress is shown and signals are looked for.
const WAKE: Duration = Duration::from_millis(50);

/// Does long work on a separate thread while this one shows progress and listens for Ctrl-C; releases the interpreter's
/// lock except for brief moments.
///
/// `progress` has the methods `begin(what, done, total)`, `advance(parts)` and `say(message)`.
///
/// # Errors
/// What a signal or `progress` raised, after the work has stopped; the first exception of the user's own functions, or
/// what was not finite of them; a defect of the library.
pub fn long<T: Send>(
    py: Python<'_>,
    progress: Option<&Bound<'_, PyAny>>,
    failures: &Failures,
    work: impl FnOnce(Watch<'_>) -> T + Send,
) -> PyResult<T> {
    let done = watched(py, progress, failures, work);
    let not_finite = failures.take_not_finite();
    let done = done?;
    not_finite.map_or(Ok(done), Err)
}

/// The same of work on many designs, in which one that cannot be evaluated is not the end: says what was not finite only if
/// the work failed.
///
/// # Errors
/// As of [`long`].
pub fn long_study<T: Send>(
    py: Python<'_>,
    progress: Option<&Bound<'_, PyAny>>,
    failures: &Failures,
    work: impl FnOnce(Watch<'_>) -> Result<T, StudyError> + Send,
) -> PyResult<T> {
    let done = watched(py, progress, failures, work);
    let not_finite = failures.take_not_finite();
    done?.map_err(|error| match (error, not_finite) {
        (StudyError::Compute(_) | StudyError::ComputeOf { .. }, Some(not_finite)) => not_finite,
        (error, _) => errors::of_study(py, &error),
    })
}

fn watched<T: Send>(
    py: Python<'_>,
    progress: Option<&Bound<'_, PyAny>>,
    failures: &Failures,
    work: impl FnOnce(Watch<'_>) -> T + Send,
) -> PyResult<T> {
    let pool = pool::pool(py)?;
    let running = Running::begin();
    let relay = Relay::default();
    let stop = AtomicBool::new(false);
    let (outcome, raised) = std::thread::scope(|scope| {
        let worker = scope.spawn(|| {
            // Also signals the end if the work panics.
            let _end = End(&relay);
            pool.install(|| work(Watch { progress: &relay, stop: Stop::when(&stop) }))
        });
        let mut raised = None;
        loop {
            let ended = py.detach(|| relay.wait());
            let seen = relay.deliver(progress).and_then(|()| py.check_signals());
            if let Err(error) = seen {
                raised.get_or_insert(error);
            }
            if raised.is_some() || failures.any() {
                stop.store(true, Ordering::Relaxed);
                running.halt();
            }
            if ended {
                break;
            }
        }
        (py.detach(|| worker.join()), raised)
    });
    if let Some(error) = failures.take() {
        return Err(error);
    }
    if let Some(error) = raised {
        return Err(error);
    }
    outcome.map_err(|panic| errors::of_panic(py, &*panic))
}

/// What is to be told of long work.
enum Told {
    Begin(String, u64, u64),
    Say(String),
}

/// Carries progress from the threads that work to the one that may call Python.
#[derive(Default)]
struct Relay {
    told: Mutex<(VecDeque<Told>, bool)>,
    ended: Condvar,
    advanced: AtomicU64,
}

impl Relay {
    fn lock(&self) -> MutexGuard<'_, (VecDeque<Told>, bool)> {
        self.told.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Waits a moment; true where the work has ended.
    fn wait(&self) -> bool {
        let guard = self.lock();
        if guard.1 {
            return true;
        }
        let (guard, _) = self.ended.wait_timeout(guard, WAKE).unwrap_or_else(PoisonError::into_inner);
        guard.1
    }

    fn deliver(&self, progress: Option<&Bound<'_, PyAny>>) -> PyResult<()> {
        let told = std::mem::take(&mut self.lock().0);
        let advanced = self.advanced.swap(0, Ordering::Relaxed);
        let Some(progress) = progress else { return Ok(()) };
        for told in told {
            match told {
                Told::Begin(what, done, total) => progress.call_method1("begin", (what, done, total))?,
                Told::Say(message) => progress.call_method1("say", (message,))?,
            };
        }
        if advanced > 0 {
            progress.call_method1("advance", (advanced,))?;
        }
        Ok(())
    }
}

impl Progress for Relay {
    fn begin(&self, what: &str, done: u64, total: u64) {
        self.lock().0.push_back(Told::Begin(what.to_owned(), done, total));
    }

    fn advance(&self, parts: u64) {
        self.advanced.fetch_add(parts, Ordering::Relaxed);
    }

    fn say(&self, message: &str) {
        let mut guard = self.lock();
        if matches!(guard.0.back(), Some(Told::Say(_))) {
            guard.0.pop_back();
        }
        guard.0.push_back(Told::Say(message.to_owned()));
    }
}

struct End<'a>(&'a Relay);

impl Drop for End<'_> {
    fn drop(&mut self) {
        self.0.lock().1 = true;
        self.0.ended.notify_all();
    }
}
