//! Custom physics: a pole on a cart, whose length and place sensor are to be designed.
//!
//! Run by `cargo run --release -p supple --example 03_own_model`. Its twin in Python, `python/examples/03_own_model.py`,
//! prints the same.

use std::error::Error;
use std::io::Write;

use supple::cost::Cost;
use supple::design::{Control, DesignSettings, design};
use supple::noise::{Covariance, NoiseModel};
use supple::parameters::{Parameter, Parameters, Scale};
use supple::quantity::{Control as Effort, State};
use supple::system::Authored;
use supple::{Dimensions, EvaluateOptions, Model, Point, Problem, Scalar, Task, Value};

/// s
const TIME_STEP: f64 = 0.02;

/// A pole on a cart, upright at angle 0, with a spring at its foot; the cart's place and the pole's angle are measured.
/// State `[x, a, x', a']`, control: the force on the cart.
struct CartPole {
    stiffness: Value,
}

impl Model for CartPole {
    fn dimensions(&self) -> Dimensions {
        Dimensions { states: 4, controls: 1, measurements: 2 }
    }

    fn step<S: Scalar>(&self, at: &Point<S>, next: &mut [S]) {
        let &[place, angle, speed, rate] = at.x else { return };
        let (sin, cos) = angle.sin_cos();
        let torque = at.value(&self.stiffness) * angle;
        let force = at.u[0] + sin * 0.1 * (rate * rate * 0.5 - cos * 9.81) + torque * cos * 2.0;
        let push = force / (sin * sin * 0.1 + 1.0);
        let turn = (sin * 9.81 - push * cos) / 0.5 - torque * 40.0;
        next[0] = place + at.time_step * speed;
        next[1] = angle + at.time_step * rate;
        next[2] = speed + at.time_step * push;
        next[3] = rate + at.time_step * turn;
    }

    fn observe<S: Scalar>(&self, at: &Point<S>, y: &mut [S]) {
        y[0] = at.x[0];
        y[1] = at.x[1];
    }
}

/// Brings the cart to its place with the pole upright.
fn problem() -> Problem {
    let mut parameters = Parameters::default();
    let stiffness = Parameter::new("stiffness", 0.1, [0.01, 0.4]).with_unit("N m/rad").with_scale(Scale::Log);
    let stiffness = parameters.declare(stiffness);
    let variance = Parameter::new("angle_variance", 1e-4, [1e-5, 1e-2]).with_unit("rad^2").with_scale(Scale::Log);
    let variance = parameters.declare(variance);
    let costs = vec![
        Cost::new(State::new([0, 1]), 1.0).with_final_weight(20.0),
        Cost::new(State::new([2, 3]), 0.1).with_final_weight(2.0),
        Cost::new(Effort::all(1), 0.01),
    ];
    let noise = NoiseModel::new(
        Covariance::diagonal([1e-3, 1e-3, 1e-2, 1e-2]),
        Covariance::diagonal([0.0, 0.0, 1e-4, 1e-3]),
        Covariance::diagonal([Value::from(1e-4), variance.into()]),
    );
    let model = CartPole { stiffness: stiffness.into() };
    let system = Authored::new(model, costs, TIME_STEP, parameters.len());
    let task = Task::new("balance", system, noise, 150, TIME_STEP)
        .starting_at([-0.5, 0.1, 0.0, 0.0])
        .guessing([0.0])
        .within_cost(28.0);
    let settings = DesignSettings { starts: 2, ..Default::default() };
    Problem::new("A pole on a cart", parameters, vec![task]).with_design(settings)
}

fn main() -> Result<(), Box<dyn Error>> {
    run(&mut std::io::stdout())
}

/// Evaluates and designs the cart, and prints the result before and after.
pub fn run(out: &mut dyn Write) -> Result<(), Box<dyn Error>> {
    let problem = problem();
    let start = problem.parameters.initial();
    let at = problem.evaluate(&start, &EvaluateOptions { total_gradient: true, ..Default::default() })?;
    let gradient = at.tasks[0].gradient.as_ref().and_then(|gradient| gradient.total.as_ref()).ok_or("no gradient")?;
    writeln!(out, "{:.3} bits at cost {:.4}", at.objective.information_bits, at.tasks[0].cost.expected)?;
    for (name, value) in &gradient.information_nats.0 {
        writeln!(out, "d nats / d {name} = {value:.5}")?;
    }
    let control = Control::default();
    let found = design(&problem, &start, &problem.design, control)?;
    let best = &found.starts[found.best];
    for (parameter, value) in problem.parameters.iter().zip(&best.to) {
        writeln!(out, "{} = {value:.4} {}", parameter.name, parameter.unit)?;
    }
    writeln!(out, "{:.3} bits at cost {:.3}", best.information / std::f64::consts::LN_2, best.costs[0])?;
    Ok(())
}
