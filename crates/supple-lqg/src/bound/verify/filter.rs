//! What a sensor achieves: its Kalman filter on the problem as given.

use super::information::Stage;
use super::matrix::Matrix;
use supple_kernels::{halt, math};

/// A sensor `y = C x + v` with independent noises.
pub(crate) struct Sensor {
    pub measurement: Matrix,
    pub variances: Vec<f64>,
}

/// What the filter of the sensors gives and costs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Filtered {
    /// `sum 1/2 log |C Pbar C' + V| / |V|`, nats.
    pub nats: f64,
    /// `sum Tr(Theta P)`.
    pub price: f64,
}

/// Steps of a steady filter: at least, and at most.
const STEPS: [usize; 2] = [100, 5000];

/// A steady filter has settled when a step changes what it gives and costs by less than this, relatively.
const SETTLED: f64 = 1e-13;

/// That of a horizon from `X_0`, or none where the innovation is singular or a stop is requested.
pub(crate) fn over_horizon(stages: &[Stage], initial: &Matrix, sensors: &[Sensor]) -> Option<Filtered> {
    let (mut predicted, mut sum) = (initial.clone(), Filtered { nats: 0.0, price: 0.0 });
    for (t, (stage, sensor)) in stages.iter().zip(sensors).enumerate() {
        if halt::is_requested() {
            return None;
        }
        let (step, posterior) = correct(&predicted, stage, sensor)?;
        sum = Filtered { nats: sum.nats + step.nats, price: sum.price + step.price };
        if t + 1 < stages.len() {
            predicted = predict(&posterior, stage);
        }
    }
    (sum.nats.is_finite() && sum.price.is_finite()).then_some(sum)
}

/// That of a step of the steady state near a covariance `E E'` that is claimed to be it; none where it does not settle.
pub(crate) fn steady(stage: &Stage, basis: &Matrix, sensor: &Sensor) -> Option<Filtered> {
    let mut predicted = predict(&basis.times(&basis.transpose()), stage);
    let mut last: Option<Filtered> = None;
    for step in 0..STEPS[1] {
        let (now, posterior) = correct(&predicted, stage, sensor)?;
        if !(now.nats.is_finite() && now.price.is_finite()) {
            return None;
        }
        let near = |a: f64, b: f64| (a - b).abs() <= SETTLED * (a.abs() + b.abs());
        if step >= STEPS[0] && last.is_some_and(|last| near(last.nats, now.nats) && near(last.price, now.price)) {
            return Some(now);
        }
        last = Some(now);
        predicted = predict(&posterior, stage);
    }
    last
}

fn predict(posterior: &Matrix, stage: &Stage) -> Matrix {
    let carried = stage.dynamics.times(posterior).times(&stage.dynamics.transpose());
    let n = carried.rows;
    Matrix::from_fn(n, n, |i, j| 0.5 * (carried.at(i, j) + carried.at(j, i)) + stage.process.at(i, j))
}

/// One measurement after the other, which needs no inverse: `P - P c c' P / (c' P c + v)`.
fn correct(predicted: &Matrix, stage: &Stage, sensor: &Sensor) -> Option<(Filtered, Matrix)> {
    let n = predicted.rows;
    let (mut p, mut nats) = (predicted.clone(), 0.0);
    for (row, &variance) in sensor.variances.iter().enumerate() {
        let c = |j: usize| sensor.measurement.at(row, j);
        let along: Vec<f64> = (0..n).map(|i| (0..n).map(|j| p.at(i, j) * c(j)).sum()).collect();
        let known: f64 = (0..n).map(|i| c(i) * along[i]).sum();
        let innovation = known + variance;
        if !(variance > 0.0 && innovation > 0.0) {
            return None;
        }
        nats += 0.5 * math::ln_1p((known / variance).max(0.0));
        // Joseph's form, so that what is left stays a covariance.
        let gain: Vec<f64> = along.iter().map(|a| a / innovation).collect();
        p = Matrix::from_fn(n, n, |i, j| {
            p.at(i, j) - gain[i] * along[j] - along[i] * gain[j] + gain[i] * gain[j] * innovation
        });
    }
    let price = stage.price.entries.iter().zip(&p.entries).map(|(a, b)| a * b).sum();
    Some((Filtered { nats, price }, p))
}
