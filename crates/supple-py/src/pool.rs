//! Threads of this process. Those of rayon's global pool do not survive a fork, and the child would wait for them forever;
//! here, every process has its own pool.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};
use supple::halt;

use crate::errors;

/// State of this process; after a fork, the parent's state is useless.
#[derive(Default)]
struct Own {
    process: u32,
    pool: Option<Arc<ThreadPool>>,
    /// How many long computations are under way.
    running: usize,
}

static OWN: Mutex<Own> = Mutex::new(Own { process: 0, pool: None, running: 0 });

fn own() -> MutexGuard<'static, Own> {
    let mut own = OWN.lock().unwrap_or_else(PoisonError::into_inner);
    if own.process != std::process::id() {
        // Its threads are gone, so that dropping the pool would wait for them.
        std::mem::forget(own.pool.take());
        *own = Own { process: std::process::id(), ..Own::default() };
        halt::request(false);
    }
    own
}

/// The pool of this process.
///
/// # Errors
/// Where no threads can be made.
pub fn pool(py: Python<'_>) -> PyResult<Arc<ThreadPool>> {
    let mut own = own();
    if let Some(pool) = &own.pool {
        return Ok(Arc::clone(pool));
    }
    let made = ThreadPoolBuilder::new().build();
    let made = made.map_err(|error| errors::usage(py, &format!("no threads can be made: {error}")))?;
    Ok(Arc::clone(own.pool.insert(Arc::new(made))))
}

/// A long computation under way.
pub struct Running;

impl Running {
    pub fn begin() -> Self {
        own().running += 1;
        Self
    }

    /// Asks this computation to stop within moments. If others run in other threads, they are not disturbed, and this one
    /// stops at its next check.
    pub fn halt(&self) {
        if own().running == 1 {
            halt::request(true);
        }
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        let mut own = own();
        own.running = own.running.saturating_sub(1);
        halt::request(false);
    }
}
