use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::sync_channel;

use super::point::{Evaluator, Neighbour, Study};
use crate::{Cell, StudyError, Watch};

/// A point that is done.
pub(super) struct Done {
    pub point: usize,
    pub row: Vec<Cell>,
}

/// Evaluates all points; the rows that are done, in their order.
pub(super) fn run(study: &Study, watch: Watch) -> Result<Vec<Vec<Cell>>, StudyError> {
    let grid = &study.grid;
    watch.progress.begin("points", 0, grid.points as u64);
    let next = AtomicUsize::new(0);
    let (sender, receiver) = sync_channel::<Done>(1024);
    let mut rows: Vec<Option<Vec<Cell>>> = vec![None; grid.points];
    std::thread::scope(|scope| {
        let rows = &mut rows;
        scope.spawn(move || {
            for done in receiver {
                rows[done.point] = Some(done.row);
            }
        });
        rayon::broadcast(|_| {
            let sender = sender.clone();
            let mut evaluator = Evaluator::new(study, watch.stop);
            loop {
                let segment = next.fetch_add(1, Ordering::Relaxed);
                if segment >= grid.segments() {
                    break;
                }
                let mut neighbour: Neighbour = vec![None; study.problem.tasks.len()];
                for point in grid.segment(segment) {
                    if watch.is_stopped() {
                        return;
                    }
                    let row = evaluator.evaluate(point, &mut neighbour);
                    if sender.send(Done { point, row }).is_err() {
                        return;
                    }
                    watch.progress.advance(1);
                }
            }
        });
        drop(sender);
    });
    Ok(rows.into_iter().flatten().collect())
}
