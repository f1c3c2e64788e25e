//! How fast the door task is linearised, planned, measured and designed, in process on one thread but for `design`:
//! 16 states, 7 controls, 14 measurements, 500 steps, the bushing included.
#![allow(missing_docs, clippy::unwrap_used)]

use std::hint::black_box;
use std::path::{Path, PathBuf};

use criterion::{Criterion, criterion_group, criterion_main};
use supple::Linearise;
use supple::design::{Control, DesignSettings, design};
use supple::gradient::Functional;
use supple::lqg::{Belief, Information, Policy, information, kalman};
use supple::pipeline::TaskState;
use supple::plan::PlanSettings;
use supple::system::{Curvature, RollOut};
use supple::{EvaluateOptions, Level, Problem, Scratch};

#[path = "common/sweep.rs"]
mod sweep;

use sweep::sweep;

fn file() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tasks/iiwa_door.toml")
}

fn load() -> Problem {
    supple_file::load(file()).unwrap()
}

/// The same task with the default integrator.
fn implicit() -> Problem {
    let models = concat!("file = \"", env!("CARGO_MANIFEST_DIR"), "/../../models/");
    let text = std::fs::read_to_string(file()).unwrap().replace("file = \"../models/", models);
    supple_file::parse(&text.replace("\"semi_implicit\"", "\"implicit\""), "iiwa_door.toml").unwrap()
}

/// One iteration of a task's plan with either integrator, beside each other.
fn integrators(c: &mut Criterion) {
    for (name, problem) in [("semi_implicit", load()), ("implicit", implicit())] {
        let (task, phi) = (&problem.tasks[0], problem.parameters.initial());
        let system = &*task.system;
        let mut state = TaskState::new(task);
        state.evaluate(task, &phi, &PlanSettings::default(), None).unwrap();
        let trajectory = state.plan.trajectory.clone();
        let (mut knots, mut candidate) = (state.plan.knots.clone(), trajectory.clone());
        let mut policy = Policy::zeros(system.dimensions(), task.steps);
        let mut scratch = Scratch::new();
        c.bench_function(&format!("integrator/{name}"), |b| {
            b.iter(|| {
                let at = black_box(&trajectory).points();
                knots.linearise_plan(system, at, &phi, Curvature::GaussNewton, &mut scratch);
                sweep(&knots, &mut policy);
                system.roll_out(
                    RollOut::Law { reference: &trajectory, policy: &policy, step: 1.0, bounds: None },
                    &phi,
                    &mut candidate,
                    &mut scratch,
                )
            });
        });
    }
}

/// The parts of one iLQG iteration, of the belief and of the gradient, at every level of instructions.
fn parts(c: &mut Criterion) {
    let problem = load();
    let (task, phi) = (&problem.tasks[0], problem.parameters.initial());
    let system = &*task.system;
    let best = Level::current();
    for level in Level::ALL.into_iter().filter(|level| level.force()) {
        let mut state = TaskState::new(task);
        state.evaluate(task, &phi, &PlanSettings::default(), None).unwrap();
        let trajectory = state.plan.trajectory.clone();
        let mut knots = state.plan.knots.clone();
        let mut policy = Policy::zeros(system.dimensions(), task.steps);
        let mut candidate = trajectory.clone();
        let mut scratch = Scratch::new();
        let size = system.dimensions();
        let mut belief = Belief::zeros(size.states, size.measurements, task.steps);
        let mut found = Information::default();
        let mut gradient = Vec::new();
        let mut group = c.benchmark_group(format!("door/{level:?}"));
        group.bench_function("linearise", |b| {
            b.iter(|| {
                let at = black_box(&trajectory).points();
                knots.linearise_plan(system, at, &phi, Curvature::GaussNewton, &mut scratch);
            });
        });
        group.bench_function("riccati", |b| {
            b.iter(|| sweep(black_box(&knots), &mut policy));
        });
        group.bench_function("rollout", |b| {
            b.iter(|| {
                system.roll_out(
                    RollOut::Law { reference: black_box(&trajectory), policy: &policy, step: 1.0, bounds: None },
                    &phi,
                    &mut candidate,
                    &mut scratch,
                )
            });
        });
        group.bench_function("iteration", |b| {
            b.iter(|| {
                let at = black_box(&trajectory).points();
                knots.linearise_plan(system, at, &phi, Curvature::GaussNewton, &mut scratch);
                sweep(&knots, &mut policy);
                system.roll_out(
                    RollOut::Law { reference: &trajectory, policy: &policy, step: 1.0, bounds: None },
                    &phi,
                    &mut candidate,
                    &mut scratch,
                )
            });
        });
        group.bench_function("kalman_and_information", |b| {
            b.iter(|| {
                kalman(black_box(&knots), &state.noise, &mut belief).unwrap();
                information(&belief, &state.noise, &mut found).unwrap();
            });
        });
        // With the belief anew each time, so that nothing is known from the last time.
        group.bench_function("information_gradient", |b| {
            b.iter(|| {
                state.assess(task, &phi).unwrap();
                state.total_gradient(task, &phi, Functional::INFORMATION, &mut gradient).unwrap();
            });
        });
        group.bench_function("both_gradients", |b| {
            b.iter(|| {
                state.assess(task, &phi).unwrap();
                state.total_gradient(task, &phi, Functional::INFORMATION, &mut gradient).unwrap();
                state.total_gradient(task, &phi, Functional::NOISE, &mut gradient).unwrap();
                state.nominal_gradient(task, &phi, &mut gradient).unwrap();
            });
        });
        group.finish();
    }
    best.force();
}

/// A whole evaluation with the total gradient, and a whole design from one start.
fn whole(c: &mut Criterion) {
    let problem = load();
    let phi = problem.parameters.initial();
    let mut group = c.benchmark_group("door");
    group.sample_size(10);
    let options = EvaluateOptions { total_gradient: true, ..Default::default() };
    group
        .bench_function("evaluate_total_gradient", |b| b.iter(|| problem.evaluate(black_box(&phi), &options).unwrap()));
    let settings = DesignSettings { starts: 1, ..problem.design.clone() };
    let control = Control::default();
    group.bench_function("design_one_start", |b| b.iter(|| design(&problem, &phi, &settings, control).unwrap()));
    group.finish();
}

criterion_group!(benches, parts, integrators, whole);
criterion_main!(benches);
