//! How fast the two-mass task is planned, measured and designed, in process on one thread but for `design`.
//!
//! The numbers of the public two-mass system in its small form, 125 steps, as in `peers/jax_two_mass.py`.
#![allow(missing_docs, clippy::unwrap_used)]

use std::hint::black_box;
use std::path::Path;

use criterion::{Criterion, criterion_group, criterion_main};
use supple::Linearise;
use supple::design::{Control, DesignSettings, design};
use supple::lqg::{
    Belief, BeliefAdjoint, BeliefSeeds, Information, KnotAdjoints, Noise, Policy, information, kalman, reverse_kalman,
};
use supple::pipeline::TaskState;
use supple::plan::PlanSettings;
use supple::system::{Adjoints, Curvature, RollOut};
use supple::{EvaluateOptions, Level, Problem, Scratch, Trajectory};

#[path = "common/sweep.rs"]
mod sweep;

use sweep::sweep;

fn load(name: &str) -> Problem {
    supple_file::load(Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tasks").join(name)).unwrap()
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
        b.iter(|| sweep(black_box(&knots), &mut policy));
    });
    group.bench_function("rollout", |b| {
        b.iter(|| {
            system.roll_out(
                RollOut::Law { reference: black_box(trajectory), policy: &policy, step: 1.0, bounds: None },
                &phi,
                &mut candidate,
                &mut scratch,
            )
        });
    });
    group.bench_function("ilqg_iteration", |b| {
        b.iter(|| {
            knots.linearise_plan(system, black_box(trajectory).points(), &phi, Curvature::GaussNewton, &mut scratch);
            sweep(&knots, &mut policy);
            system.roll_out(
                RollOut::Law { reference: trajectory, policy: &policy, step: 1.0, bounds: None },
                &phi,
                &mut candidate,
                &mut scratch,
            )
        });
    });
    // Linearisation, belief, information and its gradient by the parameters along a fixed trajectory.
    let size = system.dimensions();
    let mut belief = Belief::zeros(size.states, size.measurements, task.steps);
    let mut found = Information::default();
    let mut work = BeliefAdjoint::new(size.states, size.measurements);
    let mut adjoints = KnotAdjoints::zeros(size, task.steps);
    let mut noise = Noise::zeros(size.states, size.measurements);
    let mut by_trajectory = knots.cost.clone();
    let mut gradient = vec![0.0; 2];
    let seeds = BeliefSeeds { information: 1.0, weights: None, covariances: None };
    group.bench_function("di_value_and_frozen_gradient", |b| {
        b.iter(|| {
            let at = black_box(trajectory).points();
            system.dynamics_jacobians(at, &phi, &mut knots.dynamics, &mut scratch);
            system.measurement_jacobians(at, &phi, &mut knots.measurement, &mut scratch);
            kalman(&knots, &state.noise, &mut belief).unwrap();
            information(&belief, &state.noise, &mut found).unwrap();
            noise.clear();
            reverse_kalman(&knots, &state.noise, &belief, seeds, &mut work, &mut adjoints, &mut noise);
            gradient.fill(0.0);
            system.contract(
                at,
                &phi,
                Adjoints { knots: &adjoints, curvature: Curvature::Exact },
                &mut by_trajectory,
                &mut gradient,
                &mut scratch,
            );
            found.total
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
    let control = Control::default();
    let mut group = c.benchmark_group("design");
    group.sample_size(10);
    group.bench_function("two_mass.toml/one_start", |b| {
        b.iter(|| design(&problem, &problem.parameters.initial(), &settings, control).unwrap());
    });
    group.finish();
}

criterion_group!(benches, iteration, evaluate, design_one_start);
criterion_main!(benches);
