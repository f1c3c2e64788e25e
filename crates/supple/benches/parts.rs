//! Times the parts of an iteration of task files, in process on one thread, and prints one line of JSON for each part:
//! `cargo bench -p supple --bench parts -- FILE.toml ..`. `SECONDS_EACH` is how long each part is repeated (1),
//! `PART` the only one that is timed.
//!
//! `benches/python/robot_parts.py` writes such files for any URDF file and runs crocoddyl beside it.
#![allow(missing_docs, clippy::unwrap_used, clippy::print_stdout)]

use std::hint::black_box;

use supple::gradient::Functional;
use supple::lqg::{
    Belief, BeliefAdjoint, BeliefSeeds, Information, KnotAdjoints, Noise, Policy, RiccatiAdjoint, RiccatiSeeds,
    control_information, information, kalman, reverse_kalman, reverse_riccati,
};
use supple::pipeline::TaskState;
use supple::plan::PlanSettings;
use supple::system::{Adjoints, Curvature, RollOut, Variation};
use supple::{EvaluateOptions, Linearise, Matrices, Scratch, Task};

#[path = "common/sweep.rs"]
mod sweep;
#[path = "../../supple-lqg/benches/common/timing.rs"]
mod timing;

use sweep::sweep;
use timing::times;

/// Runs work again and again, and prints the least and the median time of a run, ms.
fn time(name: &str, seconds: f64, work: impl FnMut()) {
    if std::env::var("PART").is_ok_and(|part| part != name) {
        return;
    }
    let times = times(seconds, work);
    let [least, median] = [times[0], times[times.len() / 2]].map(|time| 1e3 * time);
    println!("{{\"name\": \"{name}\", \"least_ms\": {least}, \"median_ms\": {median}, \"runs\": {}}}", times.len());
}

/// Times the parts of a total gradient.
fn time_sweeps(task: &Task, phi: &[f64], state: &TaskState, seconds: f64) {
    let TaskState { plan, belief, noise, .. } = state;
    let (system, size, at) = (&*task.system, task.system.dimensions(), plan.trajectory.points());
    let mut hessian = plan.knots.cost.clone();
    let mut scratch = Scratch::new();
    time("dynamics_curvature", seconds, || {
        system.add_dynamics_curvature(at, phi, black_box(&plan.costates), &mut hessian, &mut scratch);
    });
    let mut adjoints = KnotAdjoints::zeros(size, task.steps);
    let mut by_noise = Noise::zeros(size.states, size.measurements);
    let mut work = BeliefAdjoint::new(size.states, size.measurements);
    let weights = Some((&plan.policy.value_of_information, 1.0));
    let seeds = BeliefSeeds { information: 1.0, weights, covariances: None };
    time("reverse_kalman", seconds, || {
        let knots = black_box(&plan.knots);
        reverse_kalman(knots, noise, belief, seeds, &mut work, &mut adjoints, &mut by_noise);
    });
    let mut out = vec![0.0; phi.len()];
    let mut contract = |name: &str, adjoints: &KnotAdjoints| {
        time(name, seconds, || {
            let adjoints = Adjoints { knots: black_box(adjoints), curvature: plan.curvature };
            system.contract(at, phi, adjoints, &mut hessian, &mut out, &mut scratch);
        });
    };
    contract("contract_information", &adjoints);
    let seeds = RiccatiSeeds { belief: 1.0, process: 1.0, initial: 1.0, partials: None };
    let mut riccati = RiccatiAdjoint::new(size.states, size.joint());
    time("reverse_riccati", seconds, || {
        reverse_riccati(black_box(&plan.knots), &plan.policy, belief, noise, seeds, &mut riccati, &mut adjoints);
    });
    contract("contract_cost", &adjoints);
    let (joint, costates) = (Matrices::vectors(task.steps + 1, size.joint()), plan.costates.clone());
    for (name, variation) in
        [("parameters", None), ("parameters_along", Some(Variation { joint: &joint, costates: &costates }))]
    {
        time(name, seconds, || {
            system.add_parameter_gradient(at, phi, black_box(&plan.costates), variation, &mut out, &mut scratch);
        });
    }
}

fn main() {
    let seconds = std::env::var("SECONDS_EACH").ok().and_then(|text| text.parse().ok()).unwrap_or(1.0);
    for path in std::env::args().skip(1).filter(|argument| !argument.starts_with("--")) {
        let problem = supple_file::load(&path).unwrap();
        let (task, phi) = (&problem.tasks[0], problem.parameters.initial());
        let system = &*task.system;
        let size = system.dimensions();
        println!(
            "{{\"file\": {path:?}, \"states\": {}, \"controls\": {}, \"measurements\": {}, \"steps\": {}}}",
            size.states, size.controls, size.measurements, task.steps
        );
        let mut state = TaskState::new(task);
        state.evaluate(task, &phi, &PlanSettings::default(), None).unwrap();
        let trajectory = state.plan.trajectory.clone();
        let (mut knots, mut candidate) = (state.plan.knots.clone(), trajectory.clone());
        let mut policy = Policy::zeros(size, task.steps);
        let mut belief = Belief::zeros(size.states, size.measurements, task.steps);
        let mut found = Information::default();
        let (mut gradient, mut scratch) = (Vec::new(), Scratch::new());
        time("linearise", seconds, || {
            let at = black_box(&trajectory).points();
            knots.linearise_plan(system, at, &phi, Curvature::GaussNewton, &mut scratch);
        });
        time("riccati", seconds, || {
            sweep(black_box(&knots), &mut policy);
        });
        time("rollout", seconds, || {
            system.roll_out(
                RollOut::Law { reference: black_box(&trajectory), policy: &policy, step: 1.0, bounds: None },
                &phi,
                &mut candidate,
                &mut scratch,
            );
        });
        time("iteration", seconds, || {
            let at = black_box(&trajectory).points();
            knots.linearise_plan(system, at, &phi, Curvature::GaussNewton, &mut scratch);
            sweep(&knots, &mut policy);
            system.roll_out(
                RollOut::Law { reference: &trajectory, policy: &policy, step: 1.0, bounds: None },
                &phi,
                &mut candidate,
                &mut scratch,
            );
        });
        time("kalman_and_information", seconds, || {
            kalman(black_box(&state.plan.knots), &state.noise, &mut belief).unwrap();
            information(&belief, &state.noise, &mut found).unwrap();
        });
        time("used_information", seconds, || {
            let plan = black_box(&state.plan);
            control_information(&plan.knots, &plan.policy, &state.belief, &state.noise).unwrap();
        });
        for (name, trajectories) in [("evaluate", false), ("evaluate_with_trajectory", true)] {
            let options = EvaluateOptions { trajectories, ..Default::default() };
            time(name, seconds, || drop(black_box(problem.evaluate(&phi, &options).unwrap())));
        }
        // With the belief anew each time, so that nothing is known from the last time.
        time("information_gradient", seconds, || {
            state.assess(task, &phi).unwrap();
            state.total_gradient(task, &phi, Functional::INFORMATION, &mut gradient).unwrap();
        });
        // What a search needs of a design: the gradients of the information and of the expected cost.
        time("design_gradients", seconds, || {
            state.assess(task, &phi).unwrap();
            state.total_gradient(task, &phi, Functional::INFORMATION, &mut gradient).unwrap();
            state.cost_gradient(task, &phi, &mut gradient).unwrap();
        });
        time_sweeps(task, &phi, &state, seconds);
    }
}
