//! Stationary regulators of least cost, where motions without a cost grow.
#![allow(clippy::unwrap_used)]

use supple_lqg::bound::Stationary;
use supple_kernels::Matrices;

fn matrix(rows: &[Vec<f64>]) -> Matrices {
    let mut out = Matrices::constant(rows.len(), rows[0].len());
    rows.iter().enumerate().for_each(|(i, row)| row.iter().enumerate().for_each(|(j, &entry)| out.set(0, i, j, entry)));
    out
}

/// Only `c'x` costs, and the control can hold it at 0 from the next step on. What is left then grows at no cost, so that the
/// least cost of a step is that of the noise in `c'x`, however fast it grows.
#[test]
fn what_grows_at_no_cost_is_not_held_back() {
    for growth in [0.5, 0.99, 1.0, 1.1, 1.9, 3.0] {
        let dynamics = matrix(&[vec![0.0, 1.0, 0.0], vec![0.3, -0.7, 1.1]]);
        // With `c'x = 0` the first state grows by `growth`.
        let c = [-growth * 0.7, 0.7, 0.0];
        let cost: Vec<Vec<f64>> = c.iter().map(|a| c.iter().map(|b| a * b).collect()).collect();
        let process = matrix(&[vec![0.2, 0.0], vec![0.0, 0.1]]);
        let found = Stationary::new(&dynamics, &process, &matrix(&cost)).unwrap();
        let least = 0.5 * (0.2 * c[0] * c[0] + 0.1 * c[1] * c[1]);
        assert!((found.base_cost / least - 1.0).abs() < 1e-9, "growth {growth}: {} for {least}", found.base_cost);
    }
}
