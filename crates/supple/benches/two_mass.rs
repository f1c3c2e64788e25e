//! How fast the two-mass task is planned, measured and designed, in process on one thread but for `design`.
//!
//! The numbers of the public two-mass system in its small form, 125 steps, as in `peers/jax_two_mass.py`.
#![allow(missing_docs, clippy::unwrap_used)]

use std::hint::black_box;
use std::path::Path;
use std::sync::atomic::AtomicBool;

use criterion::{Criterion, criterion_group, criterion_main};
use supple::design::{Control, DesignSettings, NoObserver, design};
use supple::gradient::FrozenGradient;
use supple::pipeline::TaskState;
use supple::plan::{PlanSettings, Policy, Regularisation, rollout, solve_riccati};
use supple::system::Curvature;
use supple::{EvaluateOptions, Level, Problem, Scratch, Trajectory};

fn load(name: &str) -> Problem {
    Problem::load(Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tasks").join(name)).unwrap()
}

/// One iLQG iteration near convergence: linearise, Riccati sweep, roll-out with the full step accepted.
fn iteration(c: &mut Criterion) {
    let problem = load("two_mass_small.toml");
    let (task, phi) = (&problem.tasks[0], [100.0, 50.0]);
    let mut state = TaskState::new(task);
    state.evaluate(task, &phi, &PlanSettings::default(), None).unwrap();
    let system = &*task.system;
    let mut knots = state.plan.knots.clone();
    let mut policy = Policy::zeros(system.dimensions(), task.steps);
    let mut candidate = state.plan.trajectory.clone();
    let mut scratch = Scratch::new();
    let trajectory: &Trajectory = &state.plan.trajectory;
    let mut group = c.benchmark_group("two_mass_small");
    group.bench_function("linearise", |b| {
        b.iter(|| {
            knots.linearise_plan(system, black_box(trajectory).points(), &phi, Curvature::GaussNewton, &mut scratch);
        });
    });
    group.bench_function("riccati", |b| {
        b.iter(|| {
            solve_riccati(&knots.dynamics, black_box(&knots.cost), Regularisation::default(), &mut policy).unwrap()
        });
    });
    group.bench_function("rollout", |b| {
        b.iter(|| rollout(system, &phi, black_box(trajectory), (&policy, 1.0), &mut candidate, &mut scratch));
    });
    group.bench_function("ilqg_iteration", |b| {
        b.iter(|| {
            knots.linearise_plan(system, black_box(trajectory).points(), &phi, Curvature::GaussNewton, &mut scratch);
            solve_riccati(&knots.dynamics, &knots.cost, Regularisation::default(), &mut policy).unwrap();
            rollout(system, &phi, trajectory, (&policy, 1.0), &mut candidate, &mut scratch)
        });
    });
    // Belief, information and its frozen gradient along a fixed trajectory.
    let mut frozen = FrozenGradient::default();
    group.bench_function("di_value_and_frozen_gradient", |b| {
        b.iter(|| {
            let at = state.plan.trajectory.points();
            state.plan.knots.linearise_plan(system, at, black_box(&phi), Curvature::Exact, &mut scratch);
            state.plan.knots.linearise_measurement(system, at, &phi, &mut scratch);
            state.assess(task, &phi).unwrap();
            state.frozen_gradient(task, &phi, &mut frozen);
            state.information.total
        });
    });
    group.finish();
}

/// A whole evaluation with the total gradient, from the task's own first guess; at every level of instructions.
fn evaluate(c: &mut Criterion) {
    let mut group = c.benchmark_group("evaluate_total_gradient");
    let best = Level::current();
    for name in ["two_mass.toml", "two_mass_small.toml"] {
        let problem = load(name);
        let phi = problem.parameters.initial();
        let options = EvaluateOptions { total_gradient: true, ..Default::default() };
        for level in Level::ALL.into_iter().filter(|level| level.force()) {
            group.bench_function(format!("{name}/{level:?}"), |b| {
                b.iter(|| problem.evaluate(black_box(&phi), &options).unwrap());
            });
        }
    }
    best.force();
    group.finish();
}

/// A whole design from one start.
fn design_one_start(c: &mut Criterion) {
    let problem = load("two_mass.toml");
    let settings = DesignSettings { starts: 1, ..Default::default() };
    let stop = AtomicBool::new(false);
    let control = Control { observer: &NoObserver, stop: &stop };
    let mut group = c.benchmark_group("design");
    group.sample_size(10);
    group.bench_function("two_mass.toml/one_start", |b| {
        b.iter(|| design(&problem, &problem.parameters.initial(), &settings, control).unwrap());
    });
    group.finish();
}

criterion_group!(benches, iteration, evaluate, design_one_start);
criterion_main!(benches);
