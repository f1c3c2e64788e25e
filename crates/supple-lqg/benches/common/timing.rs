//! How long work takes.

use std::time::Instant;

/// Runs work again and again for so many seconds, and at least five times, after a first run that does not count: the times
/// of single runs, s, the least first.
pub fn times(seconds: f64, mut work: impl FnMut()) -> Vec<f64> {
    work();
    let begin = Instant::now();
    let mut times = Vec::new();
    while times.len() < 5 || begin.elapsed().as_secs_f64() < seconds {
        let start = Instant::now();
        work();
        times.push(start.elapsed().as_secs_f64());
    }
    times.sort_by(f64::total_cmp);
    times
}
