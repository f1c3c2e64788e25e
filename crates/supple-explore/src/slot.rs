//! Holds one pending request of a kind for its worker: a newer request replaces an older one.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// A request that a worker took.
pub struct Job<T> {
    /// What was asked for.
    pub what: T,
    /// Set where nobody waits for the answer any more.
    pub stop: Arc<AtomicBool>,
}

/// A place for one waiting request. Its memory does not grow with the number of requests.
pub struct Slot<T> {
    state: Mutex<State<T>>,
    ready: Condvar,
    /// How long a running job may continue after a newer request has arrived.
    grace: Duration,
}

struct State<T> {
    waiting: Option<T>,
    newest: u64,
    running: Option<(Instant, Arc<AtomicBool>)>,
    closed: bool,
}

impl<T> Slot<T> {
    /// An empty place, whose jobs may take `grace` even where a newer request waits.
    pub fn new(grace: Duration) -> Self {
        let state = State { waiting: None, newest: 0, running: None, closed: false };
        Self { state: Mutex::new(state), ready: Condvar::new(), grace }
    }

    /// Puts a request in place of the one that waits, and stops the running job. Requests that arrive after a newer one are
    /// ignored: their number is lower.
    pub fn submit(&self, number: u64, what: T) {
        let mut state = self.lock();
        if state.closed || number < state.newest {
            return;
        }
        state.newest = number;
        state.waiting = Some(what);
        if let Some((since, stop)) = &state.running
            && since.elapsed() >= self.grace
        {
            stop.store(true, Ordering::Relaxed);
        }
        self.ready.notify_one();
    }

    /// Stops the running job and forgets the waiting request.
    pub fn stop(&self) {
        let mut state = self.lock();
        state.waiting = None;
        if let Some((_, stop)) = &state.running {
            stop.store(true, Ordering::Relaxed);
        }
    }

    /// Ends the worker.
    pub fn close(&self) {
        self.stop();
        self.lock().closed = true;
        self.ready.notify_all();
    }

    /// Waits for a request; none once the place is closed.
    pub fn take(&self) -> Option<Job<T>> {
        let mut state = self.lock();
        state.running = None;
        loop {
            if state.closed {
                return None;
            }
            if let Some(what) = state.waiting.take() {
                let stop = Arc::new(AtomicBool::new(false));
                state.running = Some((Instant::now(), Arc::clone(&stop)));
                return Some(Job { what, stop });
            }
            state = self.ready.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
    }

    fn lock(&self) -> MutexGuard<'_, State<T>> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn the_newest_request_wins_and_stops_the_job_before() {
        let slot = Slot::new(Duration::ZERO);
        slot.submit(1, "a");
        let first = slot.take().unwrap();
        assert!(!first.stop.load(Ordering::Relaxed));
        for number in 2..=10_000 {
            slot.submit(number, "b");
        }
        slot.submit(10_001, "c");
        slot.submit(7, "late");
        assert!(first.stop.load(Ordering::Relaxed));
        assert_eq!(slot.take().unwrap().what, "c");
    }

    #[test]
    fn a_job_that_just_began_is_finished_first() {
        let slot = Slot::new(Duration::from_secs(1000));
        slot.submit(1, 1);
        let first = slot.take().unwrap();
        slot.submit(2, 2);
        assert!(!first.stop.load(Ordering::Relaxed));
        slot.stop();
        assert!(first.stop.load(Ordering::Relaxed));
    }

    #[test]
    fn a_closed_slot_ends_its_worker() {
        let slot = Arc::new(Slot::<u8>::new(Duration::ZERO));
        let worker = std::thread::spawn({
            let slot = Arc::clone(&slot);
            move || slot.take().is_none()
        });
        slot.close();
        assert!(worker.join().unwrap());
    }
}
