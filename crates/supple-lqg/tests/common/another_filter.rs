//! A Kalman filter that shares no formula with the library's.

use nalgebra::{DMatrix, DVector};
use supple_lqg::bound::{Stationary, StationaryMinimum};
use supple_lqg::dense::dense;

/// What a sensor gives, nats, and pays, by a filter of its own after many steps.
pub fn filtered(system: &Stationary, found: &StationaryMinimum, steps: usize) -> (f64, f64) {
    let (a, w, price) = (dense(&system.dynamics, 0), dense(&system.process, 0), dense(&system.price, 0));
    let sensor = found.virtual_sensor();
    let c = dense(&sensor.measurement, 0);
    let v = DMatrix::from_diagonal(&DVector::from_vec(sensor.variances.clone()));
    let mut predicted = dense(&found.predicted, 0);
    let mut out = (0.0, 0.0);
    for _ in 0..steps {
        let innovation = &c * &predicted * c.transpose() + &v;
        let gain = &predicted * c.transpose() * innovation.clone().try_inverse().unwrap();
        let kept = DMatrix::identity(a.nrows(), a.nrows()) - &gain * &c;
        let posterior = &kept * &predicted * kept.transpose() + &gain * &v * gain.transpose();
        out = (0.5 * (innovation.determinant() / v.determinant()).ln(), (&price * &posterior).trace());
        predicted = &a * posterior * a.transpose() + &w;
        predicted = 0.5 * (&predicted + predicted.transpose());
    }
    out
}
