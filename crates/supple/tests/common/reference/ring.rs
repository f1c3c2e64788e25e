use supple::cost::{Absolute, Cost};
use supple::noise::{Covariance, NoiseModel};
use supple::quantity::{Control, State};
use supple::system::Authored;
use supple::{Dimensions, Model, ParameterHandle, Point, Scalar, Task, Value};

use super::numbers;

/// A ring of states that push their neighbours, of any size: controls push every so many states, and measurements are
/// curved and may be more than states.
pub struct Ring(pub Dimensions);

/// Damping, coupling, sensor gain, and variances of process and measurement.
pub const DESIGN: [f64; 5] = [0.8, 1.4, 1.2, 2e-2, 5e-2];

impl Model for Ring {
    fn dimensions(&self) -> Dimensions {
        self.0
    }

    #[inline(always)]
    fn step<S: Scalar>(&self, at: &Point<S>, next: &mut [S]) {
        let (n, m) = (self.0.states, self.0.controls);
        for (i, next) in next.iter_mut().enumerate() {
            let push = at.phi[1] * at.x[(i + 1) % n].sin() * (at.x[i] * 0.3 + 1.0);
            *next = at.x[i] + at.time_step * (push - at.phi[0] * at.x[i] + at.u[i % m] * (0.5 + i as f64 / n as f64));
        }
    }

    #[inline(always)]
    fn observe<S: Scalar>(&self, at: &Point<S>, y: &mut [S]) {
        let n = self.0.states;
        for (j, y) in y.iter_mut().enumerate() {
            *y = at.phi[2] * at.x[j % n] + at.x[(j + 1) % n].square() * 0.2 + at.x[(2 * j + 1) % n].sin() * 0.3;
        }
    }
}

pub fn task(states: usize, controls: usize, measurements: usize, steps: usize) -> Task {
    let model = Ring(Dimensions { states, controls, measurements });
    let targets = (0..states).map(|i| 0.2 * i as f64 / states as f64);
    let costs = vec![
        Cost::new(State::new((0..states).collect::<Vec<_>>()), 1.0)
            .with_targets(targets)
            .with_norm(Absolute { smoothing: Value::Number(0.5) })
            .with_final_weight(3.0),
        Cost::new(Control::all(controls), 0.3),
    ];
    let noise = NoiseModel {
        initial: Covariance::diagonal(vec![0.05; states]),
        process: Covariance::Diagonal(vec![ParameterHandle::at(3).into(); states]),
        measurement: Covariance::Diagonal(vec![ParameterHandle::at(4).into(); measurements]),
        varying: Vec::new(),
    };
    let system = Authored::new(model, costs, Value::Number(0.1), DESIGN.len());
    let start: Vec<f64> = (0..states).map(|i| 0.5 - 0.7 * (i % 3) as f64).collect();
    super::task(system, steps, numbers(&start), &vec![0.1; controls], noise)
}
