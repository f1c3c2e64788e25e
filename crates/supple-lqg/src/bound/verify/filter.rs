//! What a sensor achieves: its Kalman filter on the problem as given.

use super::given::Stage;
use super::matrix::Matrix;
use supple_kernels::math;

/// A sensor `y = C x + v` with independent noises.
pub(crate) struct Sensor {
    pub measurement: Matrix,
    pub variances: Vec<f64>,
}

/// Information and cost of the sensors' Kalman filter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Filtered {
    /// `sum 1/2 log |C Pbar C' + V| / |V|`, nats.
    pub nats: f64,
    /// `sum Tr(Theta P)`.
    pub price: f64,
}

/// The filter over a horizon from `X_0`; `None` if an innovation variance is not positive.
pub(crate) fn over_horizon(stages: &[Stage], initial: &Matrix, sensors: &[Sensor]) -> Option<Filtered> {
    let (mut predicted, mut sum) = (initial.clone(), Filtered { nats: 0.0, price: 0.0 });
    for (t, (stage, sensor)) in stages.iter().zip(sensors).enumerate() {
        let (step, posterior) = correct(&predicted, stage, sensor)?;
        sum = Filtered { nats: sum.nats + step.nats, price: sum.price + step.price };
        if t + 1 < stages.len() {
            predicted = predict(&posterior, stage);
        }
    }
    (sum.nats.is_finite() && sum.price.is_finite()).then_some(sum)
}

fn predict(posterior: &Matrix, stage: &Stage) -> Matrix {
    let carried = stage.dynamics.times(posterior).times(&stage.dynamics.transpose());
    let n = carried.rows;
    Matrix::from_fn(n, n, |i, j| 0.5 * (carried.at(i, j) + carried.at(j, i)) + stage.process.at(i, j))
}

/// One measurement at a time, which needs no inverse: `P - P c c' P / (c' P c + v)`.
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
        // Joseph form, (I - k c') P (I - c k') + k v k': where the measurement removes most of P, (I - k c') reduces the
        // rounding error of the first product as well, and only the last term remains.
        let gain: Vec<f64> = along.iter().map(|a| a / innovation).collect();
        let once = Matrix::from_fn(n, n, |i, j| p.at(i, j) - gain[i] * along[j]);
        let along_once: Vec<f64> = (0..n).map(|i| (0..n).map(|j| once.at(i, j) * c(j)).sum()).collect();
        let twice = |i, j| once.at(i, j) - along_once[i] * gain[j];
        p = Matrix::from_fn(n, n, |i, j| 0.5 * (twice(i, j) + twice(j, i)) + gain[i] * variance * gain[j]);
    }
    let price = stage.price.entries.iter().zip(&p.entries).map(|(a, b)| a * b).sum();
    Some((Filtered { nats, price }, p))
}
