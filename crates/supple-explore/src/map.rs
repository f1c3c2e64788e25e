//! A map over two knobs, from coarse to fine.

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use serde_json::{Value, json};
use supple::EvaluateOptions;
use supple_study::LoadedTask;

use crate::evaluate::{Evaluated, shadow_price};
use crate::knobs::{Knob, turned};

/// Gaps of the finest grid along each axis: a power of 2.
pub const GAPS: usize = 32;
/// Gaps of the coarsest one.
const COARSEST: usize = 4;
/// How often points are sent.
const PERIOD: Duration = Duration::from_millis(100);
/// How long a point waits at most while the design on screen is evaluated.
const PATIENCE: Duration = Duration::from_millis(300);

/// What a map is of.
#[derive(Clone, Debug)]
pub struct Wanted {
    /// The values of all knobs; those of the axes do not matter.
    pub values: Vec<f64>,
    /// The knobs along the two axes.
    pub axes: [usize; 2],
    /// Whether shadow prices are wanted: gradients take time.
    pub prices: bool,
}

/// Places of the grid, each once: those of the coarsest grid first, and of each finer one those that are new.
fn places() -> Vec<[usize; 2]> {
    let mut list = Vec::with_capacity((GAPS + 1) * (GAPS + 1));
    let mut step = GAPS / COARSEST;
    while step > 0 {
        let known = |place: usize| step < GAPS / COARSEST && place.is_multiple_of(2 * step);
        for j in (0..=GAPS).step_by(step) {
            let new = (0..=GAPS).step_by(step).filter(|&i| !(known(i) && known(j)));
            list.extend(new.map(|i| [i, j]));
        }
        step /= 2;
    }
    list
}

/// The numbers of one point: its place, then measured and used bits, the greatest excess over a limit, the sum of expected
/// costs, and the shadow price; nulls where it cannot be planned.
fn point(loaded: &LoadedTask, knobs: &[Knob], wanted: &Wanted, [i, j]: [usize; 2], stop: &AtomicBool) -> Option<Value> {
    let mut values = wanted.values.clone();
    for (axis, place) in wanted.axes.into_iter().zip([i, j]) {
        let Knob { scale, bounds, .. } = knobs[axis];
        values[axis] = scale.value(bounds, place as f64 / GAPS as f64);
    }
    let options = EvaluateOptions { total_gradient: wanted.prices, ..Default::default() };
    let found = turned(loaded, knobs, &values).and_then(|at| Evaluated::of(at, usize::MAX, &options, stop));
    let found = match found {
        Ok(found) => found?,
        Err(_) => return Some(json!([i, j, null, null, null, null, null])),
    };
    if !found.is_planned() {
        return Some(json!([i, j, null, null, null, null, null]));
    }
    let [measured, used] = found.bits();
    let excess = found.tasks.iter().filter_map(|task| Some((task.cost.expected, task.cost.bound?)));
    let excess = excess.map(|(cost, bound)| supple::violation(cost, bound)).reduce(f64::max);
    let cost: f64 = found.tasks.iter().map(|task| task.cost.expected).sum();
    let price = if wanted.prices { shadow_price(&found) } else { None };
    Some(json!([i, j, measured, used, excess, cost, price]))
}

/// Fills a map on the threads that the design on screen leaves free; `tell` receives new points with the number done of
/// all, and returns whether anyone is still listening. Pauses while the design on screen is evaluated.
pub fn fill(
    loaded: &LoadedTask,
    knobs: &[Knob],
    wanted: &Wanted,
    stop: &AtomicBool,
    busy: &AtomicUsize,
    tell: &(dyn Fn(Vec<Value>, [usize; 2]) -> bool + Sync),
) {
    let places = places();
    let total = places.len();
    let next = AtomicUsize::new(0);
    let found: Mutex<(Vec<Value>, usize, Instant)> = Mutex::new((Vec::new(), 0, Instant::now()));
    let work = || {
        while let Some(&place) = places.get(next.fetch_add(1, Ordering::Relaxed)) {
            let began = Instant::now();
            while busy.load(Ordering::Relaxed) > 0 && began.elapsed() < PATIENCE {
                std::thread::sleep(Duration::from_millis(1));
            }
            if stop.load(Ordering::Relaxed) {
                return;
            }
            let Some(point) = point(loaded, knobs, wanted, place, stop) else { return };
            let Ok(mut state) = found.lock() else { return };
            state.0.push(point);
            state.1 += 1;
            if state.2.elapsed() > PERIOD || state.1 == total {
                let points = std::mem::take(&mut state.0);
                state.2 = Instant::now();
                if !tell(points, [state.1, total]) {
                    stop.store(true, Ordering::Relaxed);
                }
            }
        }
    };
    let threads = std::thread::available_parallelism().map_or(1, |cores| cores.get().saturating_sub(1).max(1));
    std::thread::scope(|scope| {
        for _ in 0..threads {
            scope.spawn(work);
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_place_comes_once_and_coarse_grids_first() {
        let list = places();
        assert_eq!(list.len(), (GAPS + 1) * (GAPS + 1));
        let mut sorted = list.clone();
        sorted.sort_unstable();
        sorted.dedup();
        assert_eq!(sorted.len(), list.len());
        assert!(list[..25].iter().flatten().all(|place| place % 8 == 0));
        assert!(list[..81].iter().flatten().all(|place| place % 4 == 0));
    }
}
