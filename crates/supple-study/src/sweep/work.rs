use std::collections::BTreeMap;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, sync_channel};
use std::time::{Duration, Instant};

use supple::halt;

use super::done::{Done, Started, points_done};
use super::grid::Grid;
use super::point::{Evaluator, Neighbour, Study};
use super::store::Store;
use crate::{StudyError, Watch};

/// How long finished points wait to be stored in one batch, so that not every point waits for the disk.
const WAIT: Duration = Duration::from_millis(20);

/// Points that are done and not stored yet, at most; with more, threads wait for the disk.
const WAITING: usize = 1024;

/// Evaluates all points that are not done yet, on all threads of the current pool.
pub(super) fn work(
    study: &Study,
    started: &BTreeMap<usize, Started>,
    store: &mut Store,
    watch: Watch,
) -> Result<(), StudyError> {
    let grid = &study.grid;
    let done = points_done(grid, started);
    watch.progress.begin("points", done as u64, grid.points as u64);
    if done == grid.points {
        return Ok(());
    }
    let next = AtomicUsize::new(0);
    let (sender, receiver) = sync_channel(WAITING);
    std::thread::scope(|scope| {
        let writer = scope.spawn(|| write(grid, receiver, store, watch));
        // Segments are given out in order, and not stolen, so that a thread in the middle of a point never begins
        // another one.
        rayon::broadcast(|_| {
            let mut evaluator = Evaluator::new(study, watch.stop);
            loop {
                let segment = next.fetch_add(1, Ordering::Relaxed);
                let send = |done| sender.send(done).is_ok();
                if segment >= grid.segments() || !along(&mut evaluator, segment, started.get(&segment), send) {
                    break;
                }
            }
        });
        drop(sender);
        writer.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
    })
}

/// Evaluates the points of a segment that are not done, and gives each to `keep`; false where the work is to end, by the
/// evaluator's stop or that of `keep`.
pub(super) fn along(
    evaluator: &mut Evaluator,
    segment: usize,
    started: Option<&Started>,
    mut keep: impl FnMut(Done) -> bool,
) -> bool {
    let study = evaluator.study();
    let mut points = study.grid.segment(segment);
    let mut neighbour: Neighbour = vec![None; study.problem.tasks.len()];
    if let Some(started) = started {
        points.start = started.next;
        neighbour.clone_from(&started.neighbour);
    }
    for point in points {
        if evaluator.is_stopped() {
            return false;
        }
        let row = evaluator.evaluate(point, &mut neighbour);
        // An interrupted point may have a worse result than a complete one.
        let cut_short = halt::is_requested() || study.options.starts > 0 && evaluator.is_stopped();
        let done = Done { segment, point, row, neighbour: neighbour.clone() };
        if cut_short || !keep(done) {
            return false;
        }
    }
    true
}

/// Stores what is done until nobody is left to do anything.
fn write(grid: &Grid, receiver: Receiver<Done>, store: &mut Store, watch: Watch) -> Result<(), StudyError> {
    while let Ok(first) = receiver.recv() {
        let mut batch = vec![first];
        let until = Instant::now() + WAIT;
        while let Ok(done) = receiver.recv_timeout(until.saturating_duration_since(Instant::now())) {
            batch.push(done);
        }
        let parts = batch.len() as u64;
        store.keep(grid, batch)?;
        watch.progress.advance(parts);
    }
    Ok(())
}
