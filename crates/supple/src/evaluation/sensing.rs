use serde::{Deserialize, Serialize};
use supple_kernels::math;
use supple_kernels::{Matrices, rows};

use crate::pipeline::TaskState;
use crate::problem::Task;

/// What one measurement gives over time (theory, section I).
///
/// Information of several measurements is not the sum of what each gives alone: what they share counts in each.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MeasurementReport {
    /// Its name.
    pub name: String,
    /// Nats that it would give at each step if the others were not read at that step (equation I.9).
    pub alone_nats: Vec<f64>,
    /// Nats that it adds at each step to those of the others (equation I.10).
    pub beyond_others_nats: Vec<f64>,
    /// Cost that it saves at each step beyond the others: `1/2 Tr(Xi (Sigma' - Sigma))`, with `Sigma'` the belief if it
    /// were not read at that step (equation I.11). Empty where measurement noises are correlated.
    pub saved_cost: Vec<f64>,
}

/// Every measurement of a task whose plan and belief are known.
pub(super) fn measurements(task: &Task, state: &TaskState) -> Vec<MeasurementReport> {
    let v = &state.noise.measurement;
    let p = v.rows();
    let independent = (0..v.count()).all(|t| (0..p).all(|i| (0..i).all(|j| v.get(t, i, j) == 0.0)));
    let mut precision = inverse_diagonal(v, 0);
    let mut reports: Vec<MeasurementReport> = task
        .system
        .channels()
        .measurements
        .into_iter()
        .map(|channel| MeasurementReport {
            name: channel.name,
            alone_nats: Vec::with_capacity(task.steps + 1),
            beyond_others_nats: Vec::with_capacity(task.steps + 1),
            saved_cost: Vec::new(),
        })
        .collect();
    for t in 0..=task.steps {
        let c = &state.plan.knots.measurement;
        if t > 0 && !v.is_constant() {
            precision = inverse_diagonal(v, t);
        }
        let innovation = innovation_covariance(state, t);
        let given_all = inverse_diagonal(&innovation, 0);
        for (i, report) in reports.iter_mut().enumerate() {
            report.alone_nats.push(0.5 * math::ln(innovation.get(0, i, i) / v.get(t, i, i)));
            let shared = precision.as_ref().zip(given_all.as_ref());
            let ratio = shared.map_or(f64::NAN, |(v, s)| v[i] / s[i]);
            report.beyond_others_nats.push(0.5 * math::ln(ratio));
            if independent && t < task.steps {
                let xi = &state.plan.policy.value_of_information;
                report.saved_cost.push(saved(&state.belief.corrected, c, xi, (t, i, v.get(t, i, i))));
            }
        }
    }
    reports
}

/// `C P C' + V` at a step.
fn innovation_covariance(state: &TaskState, t: usize) -> Matrices {
    let (c, predicted, v) = (&state.plan.knots.measurement, &state.belief.predicted, &state.noise.measurement);
    let (p, n) = (v.rows(), predicted.rows());
    let mut innovation = Matrices::zeros(1, p, p);
    for i in 0..p {
        let row: Vec<f64> = (0..n).map(|b| (0..n).map(|a| c.get(t, i, a) * predicted.get(t, a, b)).sum()).collect();
        for j in 0..p {
            let sum: f64 = (0..n).map(|b| row[b] * c.get(t, j, b)).sum();
            innovation.set(0, i, j, sum + v.get(t, i, j));
        }
    }
    innovation
}

/// `1/2 Tr(Xi (Sigma' - Sigma))`: without the measurement, `Sigma' = Sigma + s s' / (v - c' s)` with `s = Sigma c`.
fn saved(corrected: &Matrices, c: &Matrices, xi: &Matrices, (t, measurement, variance): (usize, usize, f64)) -> f64 {
    let n = corrected.rows();
    let s: Vec<f64> = (0..n).map(|a| (0..n).map(|b| corrected.get(t, a, b) * c.get(t, measurement, b)).sum()).collect();
    let seen: f64 = (0..n).map(|a| c.get(t, measurement, a) * s[a]).sum();
    let weighted: f64 = (0..n).map(|a| (0..n).map(|b| s[a] * xi.get(t, a, b) * s[b]).sum::<f64>()).sum();
    0.5 * weighted / (variance - seen)
}

/// The diagonal of the inverse of one of these positive definite matrices, `L L'`: the columns of `L^-1`, squared and
/// summed. None where it is not positive definite.
fn inverse_diagonal(matrix: &Matrices, index: usize) -> Option<Vec<f64>> {
    let (n, stride) = (matrix.rows(), matrix.stride());
    let mut factor = matrix.at(index).to_vec();
    rows::cholesky(&mut factor, n, stride).ok()?;
    let mut column = vec![0.0; n];
    let entry = |unit: usize| {
        for i in unit..n {
            let below = rows::dot(&factor[i * stride + unit..i * stride + i], &column[unit..i]);
            column[i] = (f64::from(u8::from(i == unit)) - below) / factor[i * stride + i];
        }
        column[unit..].iter().map(|x| x * x).sum()
    };
    Some((0..n).map(entry).collect())
}
