//! How long the least directed information takes, in process on one thread: small plants, and 500 steps of 16 states.
#![allow(missing_docs, clippy::unwrap_used)]

use std::hint::black_box;
use std::path::Path;

use criterion::{Criterion, criterion_group, criterion_main};
use nalgebra::DMatrix;
use supple::bound::{BoundSettings, Horizon, horizon_of_plan, minimum_information, stationary_minimum};
use supple::pipeline::TaskState;
use supple::plan::PlanSettings;

#[path = "../tests/common/bound.rs"]
mod horizons;

/// A random horizon of the door's size, unstable and with prices on half of the directions.
fn large(steps: usize, n: usize) -> Horizon {
    let mut state = 1u32;
    let mut next = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        f64::from(state >> 8) / f64::from(1 << 24) * 2.0 - 1.0
    };
    let mut all = |cols: usize, scale: f64| -> Vec<DMatrix<f64>> {
        (0..steps).map(|_| DMatrix::from_fn(n, cols, |_, _| scale * next())).collect()
    };
    let (a, w, price) = (all(n, 0.45), all(n, 0.3), all(n / 2, 1.0));
    let squares = |of: &[DMatrix<f64>]| horizons::sequence(&of.iter().map(|g| g * g.transpose()).collect::<Vec<_>>());
    Horizon {
        dynamics: horizons::sequence(&a),
        process: squares(&w),
        initial: horizons::matrix(n, n, |i, j| f64::from(u8::from(i == j))),
        prices: squares(&price),
        base_cost: 0.0,
    }
}

/// The door's horizon along its plan, and its expected cost.
fn door() -> (Horizon, f64) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tasks/iiwa_door.toml");
    let problem = supple_file::load(&path).unwrap();
    let (task, phi) = (&problem.tasks[0], problem.parameters.initial());
    let mut state = TaskState::new(task);
    state.evaluate(task, &phi, &PlanSettings::default(), None).unwrap();
    (horizon_of_plan(&state.plan, &state.noise).unwrap(), state.cost.expected())
}

fn bounds(c: &mut Criterion) {
    let settings = BoundSettings::default();
    let mut group = c.benchmark_group("bound");
    group.sample_size(10);
    let (system, known) = horizons::tanaka();
    group.bench_function("tanaka_stationary", |b| {
        b.iter(|| stationary_minimum(black_box(&system), 40.0 - known, &settings).unwrap());
    });
    let (horizon, _) = horizons::tanaka_horizon(20);
    group.bench_function("tanaka_20x4", |b| {
        b.iter(|| minimum_information(black_box(&horizon), 40.0 * 20.0, &settings).unwrap());
    });
    let horizon = large(500, 16);
    group.bench_function("random_500x16", |b| {
        b.iter(|| minimum_information(black_box(&horizon), 5.0 * 500.0, &settings).unwrap());
    });
    let (horizon, cost) = door();
    group.bench_function("door_500x16", |b| {
        b.iter(|| minimum_information(black_box(&horizon), cost, &settings).unwrap());
    });
    group.finish();
}

criterion_group!(benches, bounds);
criterion_main!(benches);
