use proptest::prelude::{Strategy, prop};
use supple::cost::{Absolute, Cost, Weights};
use supple::noise::{Covariance, NoiseModel};
use supple::quantity::{ContactForce, Control, Penetration, State};
use supple::system::Authored;
use supple::{Dimensions, Model, ParameterHandle, Point, Scalar, Task, Value};

use super::numbers;

/// A finger: a link on a spring, driven by a torque and a motor, that presses on a surface of uncertain place.
///
/// State `[angle, rate, motor, surface]`, control `[torque, motor speed]`. Everything is there that derivatives may
/// trip over: sines, products of states, of state and control and of parameters with both, a quotient by a
/// parameter, smooth contact, a constant state, and a curved measurement.
pub struct Finger;

/// Where each parameter enters; the last one enters nowhere.
pub mod parameter {
    pub const STIFFNESS: usize = 0;
    pub const DAMPING: usize = 1;
    pub const INERTIA: usize = 2;
    pub const CONTACT: usize = 3;
    pub const SENSOR: usize = 4;
    pub const ANGLE_WEIGHT: usize = 5;
    pub const FORCE_WEIGHT: usize = 6;
    pub const FORCE_SMOOTHING: usize = 7;
    pub const CROSS_WEIGHT: usize = 8;
    pub const PROCESS_VARIANCE: usize = 9;
    pub const MEASUREMENT_VARIANCE: usize = 10;
    pub const MEASUREMENT_COVARIANCE: usize = 11;
    pub const INITIAL_VARIANCE: usize = 12;
    pub const INITIAL_ANGLE: usize = 13;
    pub const TIME_STEP: usize = 14;
    pub const TARGET: usize = 15;
    pub const UNUSED: usize = 16;
    pub const COUNT: usize = 17;
}

/// Least and greatest values of the parameters in random designs.
pub const BOUNDS: [[f64; 2]; parameter::COUNT] = [
    [2.0, 8.0],
    [0.5, 2.0],
    [0.6, 1.5],
    [4.0, 12.0],
    [0.5, 2.0],
    [0.5, 3.0],
    [0.05, 0.2],
    [0.3, 1.5],
    [-0.1, 0.1],
    [1e-3, 1e-2],
    [5e-3, 5e-2],
    [-2e-3, 2e-3],
    [1e-2, 1e-1],
    [-0.5, 0.5],
    [0.05, 0.12],
    [0.5, 1.5],
    [-1.0, 1.0],
];

/// A random design inside the bounds.
pub fn design() -> impl Strategy<Value = Vec<f64>> {
    prop::collection::vec(0.0..1.0, parameter::COUNT).prop_map(|shares| {
        let between = |([lower, upper], share): ([f64; 2], f64)| lower + share * (upper - lower);
        BOUNDS.into_iter().zip(shares).map(between).collect()
    })
}

/// How far each parameter ranges.
pub fn scales() -> Vec<f64> {
    BOUNDS.iter().map(|[lower, upper]| upper - lower).collect()
}

#[inline(always)]
fn at<S: Scalar>(point: &Point<S>, parameter: usize) -> S {
    point.phi[parameter]
}

impl Finger {
    #[inline(always)]
    fn depth<S: Scalar>(point: &Point<S>) -> S {
        point.x[0].sin() - point.x[3]
    }
}

impl Model for Finger {
    fn dimensions(&self) -> Dimensions {
        Dimensions { states: 4, controls: 2, measurements: 2 }
    }

    #[inline(always)]
    fn step<S: Scalar>(&self, point: &Point<S>, next: &mut [S]) {
        let &[angle, rate, motor, surface] = point.x else { return };
        let &[torque, speed] = point.u else { return };
        let spring = at(point, parameter::STIFFNESS) * (motor - angle);
        let damping = at(point, parameter::DAMPING) * rate * (motor.square() * 0.2 + 1.0);
        let contact =
            at(point, parameter::CONTACT) * Self::depth(point).smooth_positive_part(S::constant(0.2)) * angle.cos();
        let force = torque * (angle * 0.5).cos() + spring - damping - contact - angle.sin() * 0.5;
        let dt = point.time_step;
        next[0] = angle + dt * rate;
        next[1] = rate + dt * force / at(point, parameter::INERTIA);
        next[2] = motor + dt * (speed - motor * torque * 0.1);
        next[3] = surface;
    }

    #[inline(always)]
    fn observe<S: Scalar>(&self, point: &Point<S>, y: &mut [S]) {
        let &[angle, rate, motor, _] = point.x else { return };
        y[0] = at(point, parameter::SENSOR) * angle.sin() + rate * motor * 0.2;
        y[1] = at(point, parameter::STIFFNESS) * (motor - angle);
    }

    fn signals(&self) -> Vec<String> {
        ["contact_force", "penetration"].map(String::from).to_vec()
    }

    #[inline(always)]
    fn signal<S: Scalar>(&self, point: &Point<S>, out: &mut [S]) {
        out[1] = Self::depth(point);
        out[0] = at(point, parameter::CONTACT) * out[1];
    }
}

fn named(index: usize) -> Value {
    ParameterHandle::at(index).into()
}

/// Costs of every norm and weight, with parameters in weights, norms, targets and matrices.
pub fn costs() -> Vec<Cost> {
    let number = Value::Number;
    let mut matrix = vec![numbers(&[0.0; 4]); 4];
    for (i, row) in matrix.iter_mut().enumerate() {
        row[i] = number(0.5);
    }
    for (i, j, weight) in [(0, 2, named(parameter::CROSS_WEIGHT)), (1, 3, number(0.05))] {
        (matrix[i][j], matrix[j][i]) = (weight.clone(), weight);
    }
    let smoothing = ParameterHandle::at(parameter::FORCE_SMOOTHING);
    vec![
        Cost::new(State::new([0, 1]), 0.7)
            .with_targets([named(parameter::TARGET), number(0.1)])
            .with_final_weight(named(parameter::ANGLE_WEIGHT)),
        Cost::new(ContactForce::new(0).with_smoothing(smoothing), named(parameter::FORCE_WEIGHT))
            .with_targets([named(parameter::TARGET)])
            .with_norm(Absolute { smoothing: smoothing.into() })
            .with_final_weight(0.2),
        Cost::new(Penetration::new(1), 0.0).with_targets([0.05]).with_final_weight(1.5),
        Cost::new(Control::all(2), 0.2).with_norm(Absolute { smoothing: number(0.5) }),
        Cost {
            stage: Weights::Matrix(matrix.clone()),
            last: Weights::Matrix(matrix),
            ..Cost::new(State::new([0, 1, 2, 3]), 0.0).with_targets([0.1; 4])
        },
    ]
}

pub fn system() -> Authored<Finger> {
    Authored::new(Finger, costs(), named(parameter::TIME_STEP), parameter::COUNT)
}

/// The whole task: parameters in the noise, in the first state and in the time step, too. The surface is constant.
pub fn task(steps: usize) -> Task {
    let diagonal = |mut variances: Vec<Value>, place: usize, parameter: usize| {
        variances[place] = named(parameter);
        Covariance::Diagonal(variances)
    };
    let [variance, covariance] =
        [parameter::MEASUREMENT_VARIANCE, parameter::MEASUREMENT_COVARIANCE].map(ParameterHandle::at);
    let measurement = [[variance, covariance], [covariance, variance]].map(|row| row.map(Value::from).into());
    let noise = NoiseModel {
        initial: diagonal(numbers(&[0.02, 0.03, 0.01, 0.0]), 3, parameter::INITIAL_VARIANCE),
        process: diagonal(numbers(&[1e-4, 0.0, 2e-3, 0.0]), 1, parameter::PROCESS_VARIANCE),
        measurement: Covariance::Full(measurement.into()),
        varying: Vec::new(),
    };
    let start = vec![named(parameter::INITIAL_ANGLE), Value::Number(0.2), Value::Number(-0.1), Value::Number(0.4)];
    Task { time_step: named(parameter::TIME_STEP), ..super::task(system(), steps, start, &[0.3, -0.2], noise) }
}
