//! A model of this crate: one `impl Model`, and everything else follows.

use std::error::Error;

use outsider::{CartPole, GRAVITY};
use supple::cost::Cost;
use supple::gradient::{FrozenGradient, Functional};
use supple::noise::{Covariance, NoiseModel};
use supple::parameters::{Parameter, Parameters};
use supple::pipeline::TaskState;
use supple::plan::PlanSettings;
use supple::quantity::{Control, State};
use supple::system::Authored;
use supple::{Scratch, Task, Value};

type Tested = Result<(), Box<dyn Error>>;

const TIME_STEP: f64 = 0.02;
const START: [f64; 4] = [-0.5, 0.3, 0.0, 0.0];

/// Parameters: cart's mass, pole's length, and the variance of the sensor of place.
const DESIGN: [f64; 3] = [1.0, 0.5, 1e-4];

/// Brings the cart to its place with the pole upright, from a tilt.
fn balance() -> Task {
    let mut parameters = Parameters::default();
    let [cart_mass, length, variance] =
        ["cart_mass", "length", "variance"].map(|name| parameters.declare(Parameter::new(name, 1.0, [0.0, 1.0])));
    let model = CartPole { cart_mass: cart_mass.into(), pole_mass: 0.1.into(), length: length.into() };
    let costs = vec![
        Cost::new(State::new([0, 1]), 1.0).with_final_weight(20.0),
        Cost::new(State::new([2, 3]), 0.1).with_final_weight(2.0),
        Cost::new(Control::all(1), 0.01),
    ];
    let noise = NoiseModel::new(
        Covariance::diagonal([1e-3, 1e-3, 1e-2, 1e-2]),
        Covariance::diagonal([0.0, 0.0, 1e-4, 1e-3]),
        Covariance::diagonal([Value::from(variance), 1e-4.into()]),
    );
    let system = Authored::new(model, costs, TIME_STEP, parameters.len());
    let mut task = Task::new("balance", system, noise, 150, TIME_STEP).starting_at(START);
    task.initial_control = guess(&task, &DESIGN);
    task
}

/// Forces that more or less keep the pole up. Left alone it would fall over, and the plan start from there.
fn guess(task: &Task, phi: &[f64]) -> Vec<Vec<Value>> {
    let (mut x, mut next) = (START, [0.0; 4]);
    let push = |t| {
        let force = 2.0 * x[0] + 30.0 * x[1] + 3.0 * x[2] + 6.0 * x[3];
        task.system.step(t, &x, &[force], phi, &mut next);
        x = next;
        vec![Value::from(force)]
    };
    (0..task.steps).map(push).collect()
}

fn evaluated(task: &Task, phi: &[f64]) -> Result<TaskState, Box<dyn Error>> {
    let mut state = TaskState::new(task);
    state.evaluate(task, phi, &PlanSettings { tolerance: 1e-13, ..PlanSettings::default() }, None)?;
    assert!(state.plan.status.is_converged(), "{}", state.plan.status);
    Ok(state)
}

#[track_caller]
fn assert_near(what: &str, found: f64, expected: f64, tolerance: f64) {
    let error = (found - expected).abs() / expected.abs().max(f64::MIN_POSITIVE);
    assert!(error <= tolerance, "{what}: {found} instead of {expected}, off by {error:.1e}");
}

#[test]
fn plan_brings_the_pole_upright() -> Tested {
    let task = balance();
    let state = evaluated(&task, &DESIGN)?;
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
        for (next, after) in next.iter().zip(states.vector(t + 1)) {
            assert!((next - after).abs() < 1e-12);
        }
        sum += x[0] * x[0] + x[1] * x[1] + 0.1 * (x[2] * x[2] + x[3] * x[3]) + 0.01 * u[0] * u[0];
    }
    let x = states.vector(task.steps);
    sum += 20.0 * (x[0] * x[0] + x[1] * x[1]) + 2.0 * (x[2] * x[2] + x[3] * x[3]);
    assert_near("nominal cost", state.cost.nominal, sum, 1e-12);
    Ok(())
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
fn information_rate_is_at_least_that_of_the_falling_pole() -> Tested {
    let task = balance();
    let state = evaluated(&task, &DESIGN)?;
    let falls = (GRAVITY * (DESIGN[0] + 0.1) / (DESIGN[0] * DESIGN[1])).sqrt();
    let rate = (1.0 + TIME_STEP * falls).ln();
    let last = state.information.per_step[task.steps];
    assert!(last > rate, "{last} nats in the last step, below {rate}");
    assert!(state.information.total > task.steps as f64 * rate);

    let precise = [DESIGN[0], DESIGN[1], 1e-2 * DESIGN[2]];
    let better = evaluated(&task, &precise)?;
    assert!(better.information.total > state.information.total, "a better sensor tells more");
    assert!(better.cost.belief < state.cost.belief, "and saves belief cost");
    assert_near("nominal cost", better.cost.nominal, state.cost.nominal, 1e-12);
    Ok(())
}

/// The slope of a number by a parameter, by central differences with Richardson's extrapolation.
fn slope(phi: &[f64; 3], parameter: usize, mut number: impl FnMut(&[f64; 3]) -> f64) -> f64 {
    let mut difference = |step: f64| {
        let mut moved = |by: f64| {
            let mut phi = *phi;
            phi[parameter] += by;
            number(&phi)
        };
        (moved(step) - moved(-step)) / (2.0 * step)
    };
    let step = 1e-4 * phi[parameter];
    (4.0 * difference(0.5 * step) - difference(step)) / 3.0
}

#[test]
fn total_gradients_are_those_of_the_task_planned_anew() -> Tested {
    let mut task = balance();
    for phi in [DESIGN, [0.6, 0.8, 1e-3]] {
        task.initial_control = guess(&task, &phi);
        let mut state = evaluated(&task, &phi)?;
        let mut found = Vec::new();
        state.total_gradient(&task, &phi, Functional::INFORMATION, &mut found)?;
        for (parameter, &found) in found.iter().enumerate() {
            let expected =
                slope(&phi, parameter, |phi| evaluated(&task, phi).map_or(f64::NAN, |state| state.information.total));
            assert_near("information", found, expected, 1e-6);
        }
    }
    Ok(())
}

#[test]
fn frozen_gradient_is_a_part_of_the_total_one() -> Tested {
    let task = balance();
    let mut state = evaluated(&task, &DESIGN)?;
    let (mut frozen, mut total) = (FrozenGradient::default(), Vec::new());
    state.frozen_gradient(&task, &DESIGN, &mut frozen);
    state.total_gradient(&task, &DESIGN, Functional::INFORMATION, &mut total)?;
    // A sensor's noise moves no trajectory: both gradients agree on it and on nothing else.
    assert_near("information by the variance", frozen.information[2], total[2], 1e-12);
    for parameter in [0, 1] {
        assert!((frozen.information[parameter] / total[parameter] - 1.0).abs() > 1e-3, "parameter {parameter}");
    }
    Ok(())
}
