//! A robot that the library has never heard of: one `impl Model`, and everything else follows.

#![allow(clippy::unwrap_used, reason = "a test stops at the first thing that is wrong")]

#[path = "common/reference/mod.rs"]
mod reference;

use reference::differences::{gradients, total_gradient_errors};
use reference::{assert_near, diagonal, evaluated, numbers, relative_error, task};
use supple::cost::Cost;
use supple::design::{
    Aim, Control as Watch, DesignSettings, Ending, NoObserver, Optimiser, OuterPoint, OuterProblem, Searcher,
};
use supple::gradient::{FrozenGradient, Functional};
use supple::noise::{Covariance, NoiseModel};
use supple::pipeline::TaskState;
use supple::plan::PlanSettings;
use supple::quantity::{Control, State};
use supple::system::Authored;
use supple::{Dimensions, Model, Point, Scalar, Scratch, Task, Value};

const GRAVITY: f64 = 9.81;
const TIME_STEP: f64 = 0.02;

/// A pole on a cart, upright at angle 0; the place of the cart and that of the pole's tip beside it are measured.
///
/// State `[x, a, x', a']`, control `F`:
///
/// ```text
/// (M + m) x'' + m l (a'' cos a - a'^2 sin a) = F      l a'' + x'' cos a = g sin a
/// ```
struct CartPole {
    cart_mass: Value,
    pole_mass: Value,
    length: Value,
}

impl Model for CartPole {
    fn dimensions(&self) -> Dimensions {
        Dimensions { states: 4, controls: 1, measurements: 2 }
    }

    #[inline(always)]
    fn step<S: Scalar>(&self, at: &Point<S>, next: &mut [S]) {
        let &[place, angle, speed, rate] = at.x else { return };
        let (sin, cos) = angle.sin_cos();
        let (pole, length) = (at.value(self.pole_mass), at.value(self.length));
        let force = at.u[0] + pole * sin * (length * rate.square() - cos * GRAVITY);
        let push = force / (at.value(self.cart_mass) + pole * sin.square());
        let turn = (sin * GRAVITY - push * cos) / length;
        next[0] = place + at.time_step * speed;
        next[1] = angle + at.time_step * rate;
        next[2] = speed + at.time_step * push;
        next[3] = rate + at.time_step * turn;
    }

    #[inline(always)]
    fn observe<S: Scalar>(&self, at: &Point<S>, y: &mut [S]) {
        y[0] = at.x[0];
        y[1] = at.value(self.length) * at.x[1].sin();
    }
}

/// Parameters: cart's mass, pole's length, and the variance of the sensor of place.
const DESIGN: [f64; 3] = [1.0, 0.5, 1e-4];

fn cart_pole() -> CartPole {
    CartPole { cart_mass: Value::Parameter(0), pole_mass: Value::Number(0.1), length: Value::Parameter(1) }
}

/// Brings the cart to its place with the pole upright, from a tilt.
fn balance() -> Task {
    let costs = vec![
        Cost::new(State::new([0, 1]), 1.0).with_final_weight(20.0),
        Cost::new(State::new([2, 3]), 0.1).with_final_weight(2.0),
        Cost::new(Control::all(1), 0.01),
    ];
    let noise = NoiseModel {
        initial: diagonal(&[1e-3, 1e-3, 1e-2, 1e-2]),
        process: diagonal(&[0.0, 0.0, 1e-4, 1e-3]),
        measurement: Covariance::Diagonal(vec![Value::Parameter(2), Value::Number(1e-4)]),
        varying: Vec::new(),
    };
    let system = Authored::new(cart_pole(), costs, Value::Number(TIME_STEP), DESIGN.len());
    let mut task = task(system, 150, numbers(&[-0.5, 0.3, 0.0, 0.0]), &[0.0], noise);
    task.initial_control = guess(&task, &DESIGN);
    task
}

/// Forces that more or less keep the pole up. Left alone it would fall over, and the plan start from there.
fn guess(task: &Task, phi: &[f64]) -> Vec<Vec<Value>> {
    let (mut x, mut next) = ([-0.5, 0.3, 0.0, 0.0], [0.0; 4]);
    let push = |t| {
        let force = 2.0 * x[0] + 30.0 * x[1] + 3.0 * x[2] + 6.0 * x[3];
        task.system.step(t, &x, &[force], phi, &mut next);
        x = next;
        numbers(&[force])
    };
    (0..task.steps).map(push).collect()
}

#[test]
fn plan_brings_the_pole_upright() {
    let task = balance();
    let state = evaluated(&task, &DESIGN);
    let states = &state.plan.trajectory.states;
    let furthest = (0..=task.steps).map(|t| states.vector(t)[1].abs()).fold(0.0, f64::max);
    assert!(furthest < 0.6, "the pole never tilts further than {furthest}");
    for (name, value) in task.system.state_names().iter().zip(states.vector(task.steps)) {
        assert!(value.abs() < 0.03, "{name} ends at {value}");
    }
    // The plan is a trajectory of the model, and its cost is that of the costs added up by hand.
    let mut next = [0.0; 4];
    let mut sum = 0.0;
    for t in 0..task.steps {
        let (x, u) = (states.vector(t), state.plan.trajectory.controls.vector(t));
        task.system.step(t, x, u, &DESIGN, &mut next);
        assert!(relative_error(&next, states.vector(t + 1)) < 1e-12);
        sum += x[0] * x[0] + x[1] * x[1] + 0.1 * (x[2] * x[2] + x[3] * x[3]) + 0.01 * u[0] * u[0];
    }
    let x = states.vector(task.steps);
    sum += 20.0 * (x[0] * x[0] + x[1] * x[1]) + 2.0 * (x[2] * x[2] + x[3] * x[3]);
    assert_near("nominal cost", state.cost.nominal, sum, 1e-12);
}

#[test]
fn linearisation_about_upright_is_the_textbook_one() {
    let task = balance();
    let mut state = TaskState::new(&task);
    state.plan.trajectory.states.clear();
    let mut scratch = Scratch::new();
    let plan = &mut state.plan;
    task.system.dynamics_jacobians(plan.trajectory.points(), &DESIGN, &mut plan.knots.dynamics, &mut scratch);
    task.system.measurement_jacobians(plan.trajectory.points(), &DESIGN, &mut plan.knots.measurement, &mut scratch);
    let (mass, pole, length) = (DESIGN[0], 0.1, DESIGN[1]);
    let (tilt, drag) = (GRAVITY * (mass + pole) / (mass * length), -GRAVITY * pole / mass);
    let dt = TIME_STEP;
    let expected = [
        [1.0, 0.0, dt, 0.0, 0.0],
        [0.0, 1.0, 0.0, dt, 0.0],
        [0.0, dt * drag, 1.0, 0.0, dt / mass],
        [0.0, dt * tilt, 0.0, 1.0, -dt / (mass * length)],
    ];
    for t in 0..task.steps {
        for (i, row) in expected.iter().enumerate() {
            for (j, &entry) in row.iter().enumerate() {
                let found = plan.knots.dynamics.get(t, i, j);
                assert!((found - entry).abs() < 1e-15, "[A B] ({i}, {j}) at {t}: {found} instead of {entry}");
            }
        }
        let c = [0, 1].map(|i| [0, 1, 2, 3].map(|j| plan.knots.measurement.get(t, i, j)));
        assert_eq!(c, [[1.0, 0.0, 0.0, 0.0], [0.0, length, 0.0, 0.0]]);
    }
}

/// Who balances a pole must learn about it at the rate at which it falls: the logarithm of its unstable eigenvalue.
#[test]
fn information_rate_is_at_least_that_of_the_falling_pole() {
    let task = balance();
    let state = evaluated(&task, &DESIGN);
    let falls = (GRAVITY * (DESIGN[0] + 0.1) / (DESIGN[0] * DESIGN[1])).sqrt();
    let rate = (1.0 + TIME_STEP * falls).ln();
    let last = state.information.per_step[task.steps];
    assert!(last > rate, "{last} nats in the last step, below {rate}");
    assert!(state.information.total > task.steps as f64 * rate);

    let precise = [DESIGN[0], DESIGN[1], 1e-2 * DESIGN[2]];
    let better = evaluated(&task, &precise);
    assert!(better.information.total > state.information.total, "a better sensor tells more");
    assert!(better.cost.belief < state.cost.belief, "and saves belief cost");
    assert_near("nominal cost", better.cost.nominal, state.cost.nominal, 1e-13);
}

#[test]
fn total_gradients_are_those_of_the_task_planned_anew() {
    let mut task = balance();
    for phi in [DESIGN, [0.6, 0.8, 1e-3]] {
        task.initial_control = guess(&task, &phi);
        let mut state = evaluated(&task, &phi);
        for (name, error) in total_gradient_errors(&task, &mut state, &phi, &phi) {
            assert!(error < 1e-7, "{name}: off by {error:.1e}");
        }
    }
}

#[test]
fn frozen_gradient_is_a_part_of_the_total_one() {
    let task = balance();
    let mut state = evaluated(&task, &DESIGN);
    let (mut frozen, mut total) = (FrozenGradient::default(), Vec::new());
    state.frozen_gradient(&task, &DESIGN, &mut frozen);
    state.total_gradient(&task, &DESIGN, Functional::INFORMATION, &mut total).unwrap();
    // A sensor's noise moves no trajectory: both gradients agree on it and on nothing else.
    assert_near("information by the variance", frozen.information[2], total[2], 1e-12);
    for parameter in [0, 1] {
        assert!((frozen.information[parameter] / total[parameter] - 1.0).abs() > 1e-3, "parameter {parameter}");
    }
    // By differences of the variance alone, the plan being what it is.
    let steps = DESIGN.map(|value| 1e-4 * value);
    let controls = state.plan.trajectory.controls.clone();
    let expected = gradients(&DESIGN[2..], &steps[2..], |variance| {
        let phi = [DESIGN[0], DESIGN[1], variance[0]];
        state.evaluate(&task, &phi, &PlanSettings::default(), Some(&controls)).unwrap();
        vec![state.information.total, state.cost.belief]
    });
    assert_near("information", frozen.information[2], expected[0][0], 1e-8);
    assert_near("belief cost", frozen.belief_cost[2], expected[1][0], 1e-8);
}

/// An optimiser that the library has never heard of: a pattern search on an exact penalty.
struct PatternSearch;

impl Optimiser for PatternSearch {
    fn minimise(&self, problem: &mut OuterProblem) -> Ending {
        let merit = |at: &OuterPoint| {
            let excess: f64 = at.constraints.iter().map(|constraint| constraint.max(0.0)).sum();
            at.objective + 100.0 * excess
        };
        let (mut best, bounds) = (problem.first(), problem.bounds());
        let Some(mut least) = problem.at(&best).as_ref().map(merit) else { return Ending::Stalled };
        let mut step = 0.25;
        while step > 1e-7 {
            let mut better = false;
            for variable in 0..best.len() {
                for sign in [-1.0, 1.0] {
                    let mut next = best.clone();
                    let [lower, upper] = bounds[variable];
                    next[variable] = (next[variable] + sign * step).clamp(lower, upper);
                    let Some(at) = problem.at(&next) else { return Ending::Stalled };
                    if let Some(ending) = problem.interrupted() {
                        return ending;
                    }
                    if merit(&at) < least {
                        problem.step_to(&next, false);
                        (best, least, better) = (next, merit(&at), true);
                    }
                }
            }
            if !better {
                step *= 0.5;
            }
        }
        Ending::Converged
    }
}

#[test]
fn an_optimiser_of_ones_own_finds_the_optimum() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tasks/two_mass_small.toml");
    let problem = supple::Problem::load(path).unwrap();
    let settings = DesignSettings { starts: 1, rounds: 1, ..Default::default() };
    let stop = std::sync::atomic::AtomicBool::new(false);
    let control = Watch { observer: &NoObserver, stop: &stop };
    let searcher = Searcher::new(&problem, &settings, Aim::default(), control);
    let phi = problem.parameters.initial();
    let own = searcher.with_optimiser(&PatternSearch).search(&phi).unwrap();
    let known = searcher.search(&phi).unwrap();
    let [own, known] = [&own, &known].map(|found| &found.starts[found.best]);
    assert_near("information", own.information, known.information, 1e-6);
    assert!((own.to[0] - known.to[0]).abs() < 1e-3, "{:?} is not {:?}", own.to, known.to);
}
