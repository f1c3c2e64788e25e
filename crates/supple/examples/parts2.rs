//! x
use std::hint::black_box;
use std::time::Instant;
use supple::belief::*;
use supple::noise::Noise;
use supple::pipeline::TaskState;
use supple::plan::*;
use supple::system::*;
use supple::*;
fn time(name: &str, mut f: impl FnMut()) {
    if std::env::args().nth(1).is_some_and(|a| a != name) {
        f();
        return;
    }
    let mut best = f64::MAX;
    for _ in 0..60000 {
        let t = Instant::now();
        f();
        best = best.min(t.elapsed().as_secs_f64());
    }
    println!("{name:32} {:8.2} us  {:6.1} ns/knot", best * 1e6, best * 1e9 / 125.0);
}
fn main() {
    let problem = Problem::load("tasks/two_mass_small.toml").unwrap();
    let (task, phi) = (&problem.tasks[0], [100.0, 50.0]);
    let mut state = TaskState::new(task);
    state.evaluate(task, &phi, &PlanSettings::default(), None).unwrap();
    let system = &*task.system;
    let mut knots = state.plan.knots.clone();
    let mut policy = Policy::zeros(system.dimensions(), task.steps);
    let mut cand = state.plan.trajectory.clone();
    let mut s = Scratch::new();
    let at = state.plan.trajectory.points();
    time("dynamics_jacobians", || system.dynamics_jacobians(black_box(at), &phi, &mut knots.dynamics, &mut s));
    time("measurement_jacobians", || system.measurement_jacobians(black_box(at), &phi, &mut knots.measurement, &mut s));
    time("cost GN", || system.cost_quadratics(black_box(at), &phi, Curvature::GaussNewton, &mut knots.cost, &mut s));
    time("cost exact", || system.cost_quadratics(black_box(at), &phi, Curvature::Exact, &mut knots.cost, &mut s));
    let mut h = knots.cost.clone();
    time("dynamics curvature", || {
        system.add_dynamics_curvature(black_box(at), &phi, &state.plan.costates, &mut h, &mut s)
    });
    time("riccati", || {
        solve_riccati(&knots.dynamics, black_box(&knots.cost), Regularisation::default(), &mut policy).unwrap();
    });
    time("rollout", || {
        black_box(rollout(system, &phi, &state.plan.trajectory, (&policy, 1.0), &mut cand, &mut s));
    });
    let mut b = state.belief.clone();
    time("kalman", || kalman(black_box(&knots), &state.noise, &mut b).unwrap());
    let mut inf = information::Information::default();
    time("information", || information::information(&b, &state.noise, &mut inf).unwrap());
    let mut w = BeliefAdjoint::new(5, 2);
    let mut adj = KnotAdjoints::zeros(system.dimensions(), 125);
    let mut na = Noise::zeros(5, 2);
    time("reverse_kalman", || {
        reverse_kalman(
            (&knots, &state.noise, black_box(&b)),
            BeliefSeeds { information: 1.0, weights: None },
            &mut w,
            &mut adj,
            &mut na,
        )
    });
    let mut joint = knots.cost.clone();
    let mut g = vec![0.0; 2];
    time("contract", || system.contract(black_box(at), &phi, &adj, &mut joint, &mut g, &mut s));
    time("frozen", || {
        let mut f = gradient::FrozenGradient::default();
        state.frozen_gradient(task, &phi, &mut f);
    });
    let mut g = vec![];
    time("total info", || {
        state.total_gradient(task, &phi, gradient::Functional::INFORMATION, &mut g).unwrap();
    });
    time("total noise", || {
        state.total_gradient(task, &phi, gradient::Functional::NOISE, &mut g).unwrap();
    });
    time("evaluate(1 guess)", || {
        state.evaluate(task, &phi, &PlanSettings::default(), None).unwrap();
    });
    println!("{}", state.plan.iterations);
}
