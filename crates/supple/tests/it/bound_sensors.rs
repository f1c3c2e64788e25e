//! The sensors that attain the least directed information: their filter, and the loop closed around them.

use crate::common::bound as horizons;

use crate::common::bound::{dense, tanaka, tanaka_horizon};
use nalgebra::{DMatrix, DVector};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use supple::bound::{BoundSettings, VirtualSensor, minimum_information, stationary_minimum, virtual_sensors};

const STEPS: usize = 20;

/// `C`, `V` and the gain that the filter itself computes.
fn parts(sensor: &VirtualSensor, predicted: &DMatrix<f64>) -> (DMatrix<f64>, DMatrix<f64>, DMatrix<f64>) {
    let c = dense(&sensor.measurement, 0);
    let v = DMatrix::from_diagonal(&DVector::from_vec(sensor.variances.clone()));
    let gain = predicted * c.transpose() * (&c * predicted * c.transpose() + &v).try_inverse().unwrap();
    (c, v, gain)
}

#[test]
fn the_filter_of_the_sensors_needs_the_minimum() {
    let (horizon, _) = tanaka_horizon(STEPS);
    let found = minimum_information(&horizon, 40.0 * STEPS as f64, &BoundSettings::default()).unwrap();
    let sensors = virtual_sensors(&found);
    let (mut predicted, mut nats) = (dense(&horizon.initial, 0), 0.0);
    for (t, sensor) in sensors.iter().enumerate() {
        let (c, v, gain) = parts(sensor, &predicted);
        assert!(sensor.rank <= 3 && sensor.variances.iter().all(|v| *v > 0.0));
        assert!((&gain - dense(&sensor.gain, 0)).norm() < 1e-4 * gain.norm().max(1e-3), "gain at {t}");
        nats += 0.5 * ((&c * &predicted * c.transpose() + &v).determinant() / v.determinant()).ln();
        let posterior = (DMatrix::identity(4, 4) - &gain * &c) * &predicted;
        let wished = dense(&found.posterior, t);
        assert!((&posterior - &wished).norm() < 1e-4 * wished.norm(), "posterior at {t}");
        predicted = dense(&horizon.dynamics, 0) * posterior * dense(&horizon.dynamics, 0).transpose()
            + dense(&horizon.process, 0);
    }
    assert!((nats - found.nats).abs() < 1e-4 * found.nats, "{nats} {}", found.nats);
}

#[test]
fn the_stationary_sensor_keeps_its_covariance() {
    let (system, known) = tanaka();
    let found = stationary_minimum(&system, 50.0 - known, &BoundSettings::default()).unwrap();
    let sensor = found.virtual_sensor();
    let mut predicted = dense(&found.predicted, 0) * 3.0;
    let (a, w) = (dense(&system.dynamics, 0), dense(&system.process, 0));
    let mut nats = 0.0;
    for _ in 0..400 {
        let (c, v, gain) = parts(&sensor, &predicted);
        nats = 0.5 * ((&c * &predicted * c.transpose() + &v).determinant() / v.determinant()).ln();
        predicted = &a * (DMatrix::identity(4, 4) - gain * c) * &predicted * a.transpose() + &w;
    }
    assert!((&predicted - dense(&found.predicted, 0)).norm() < 1e-4 * predicted.norm());
    assert!((nats - found.nats).abs() < 1e-4, "{nats} {}", found.nats);
}

/// Roll-outs with the sensors, their filter and the regulator cost on average what was asked for.
#[test]
fn the_closed_loop_costs_what_was_asked_for() {
    let (horizon, gains) = tanaka_horizon(STEPS);
    let cost = 40.0 * STEPS as f64;
    let found = minimum_information(&horizon, cost, &BoundSettings::default()).unwrap();
    let sensors = virtual_sensors(&found);
    let b = DMatrix::from_fn(4, 4, |i, j| horizons::B[i][j]);
    let a = dense(&horizon.dynamics, 0);
    let root = dense(&horizon.process, 0).cholesky().unwrap().l();
    let rolls = 40_000;
    let (mut sum, mut squares) = (0.0, 0.0);
    for roll in 0..rolls {
        let mut random = ChaCha8Rng::seed_from_u64(7);
        random.set_stream(roll);
        let mut normal = |n: usize| DVector::from_fn(n, |_, _| -> f64 { StandardNormal.sample(&mut random) });
        let (mut x, mut estimate, mut total) = (normal(4), DVector::zeros(4), 0.0);
        for (sensor, gain) in sensors.iter().zip(&gains) {
            let (c, noise) = (dense(&sensor.measurement, 0), normal(sensor.rank));
            let y = &c * &x + DVector::from_fn(sensor.rank, |k, _| sensor.variances[k].sqrt() * noise[k]);
            estimate = &estimate + dense(&sensor.gain, 0) * (y - c * &estimate);
            let u = gain * &estimate;
            x = &a * x + &b * &u + &root * normal(4);
            estimate = &a * estimate + &b * &u;
            total += x.norm_squared() + u.norm_squared();
        }
        sum += total;
        squares += total * total;
    }
    let mean = sum / rolls as f64;
    let error = ((squares / rolls as f64 - mean * mean) / rolls as f64).sqrt();
    assert!((mean - cost).abs() < 4.0 * error && error < 0.005 * cost, "{mean} +- {error}, not {cost}");
}
