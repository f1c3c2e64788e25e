use serde::{Deserialize, Serialize};
use supple_kernels::rows::{self, Left, Medium, Product, View, ViewMut};
use supple_kernels::{Job, Lanes, Matrices, dispatch, math};
use supple_lqg::InnovationCovariance;

use crate::pipeline::TaskState;
use crate::problem::Task;

/// Information and benefit of one measurement over time (theory, section I).
///
/// Information of several measurements is not the sum of each alone: shared information is counted in each.
///
/// Example: [`Evaluation`](crate::Evaluation).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct MeasurementReport {
    /// Its name.
    pub name: String,
    /// Nats that it would deliver at each step if the others were not read at that step (equation I.9).
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
    dispatch(AlongPlan { state, independent, reports: &mut reports });
    reports
}

/// Information and benefit of each measurement at every step.
struct AlongPlan<'a> {
    state: &'a TaskState,
    /// Whether the noises of the measurements are independent.
    independent: bool,
    reports: &'a mut [MeasurementReport],
}

impl Job for AlongPlan<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self { state, independent, reports } = self;
        let (v, c, xi) =
            (&state.noise.measurement, &state.plan.knots.measurement, &state.plan.policy.value_of_information);
        let (p, n) = (v.rows(), c.cols());
        let (mut covariance, mut work) = (InnovationCovariance::zeros(n, p), Work::new(p, n));
        let steps = state.belief.predicted.count() - 1;
        let mut precision = inverse_diagonal(v, 0);
        for t in 0..=steps {
            if t > 0 && !v.is_constant() {
                precision = inverse_diagonal(v, t);
            }
            let innovation = covariance.form(c.at(t), state.belief.predicted.at(t), v.at(t));
            let given_all = inverse_diagonal(innovation, 0);
            for (i, report) in reports.iter_mut().enumerate() {
                report.alone_nats.push(0.5 * math::ln(innovation.get(0, i, i) / v.get(t, i, i)));
                let shared = precision.as_ref().zip(given_all.as_ref());
                let ratio = shared.map_or(f64::NAN, |(v, s)| v[i] / s[i]);
                report.beyond_others_nats.push(0.5 * math::ln(ratio));
            }
            if independent && t < steps {
                work.weigh::<L>(c.at(t), state.belief.corrected.at(t), xi.at(t));
                for (i, report) in reports.iter_mut().enumerate() {
                    report.saved_cost.push(work.saved(i, c.at(t), v.get(t, i, i)));
                }
            }
        }
    }
}

/// Matrices of one step.
struct Work {
    /// `C Sigma` and `C Sigma Xi`, p x n.
    seen: Matrices,
    weighted: Matrices,
}

impl Work {
    fn new(p: usize, n: usize) -> Self {
        let [seen, weighted] = [(); 2].map(|()| Matrices::constant(p, n));
        Self { seen, weighted }
    }

    /// Projects the belief's covariance onto each measurement, and multiplies it by the value of information.
    #[inline(always)]
    fn weigh<L: Lanes>(&mut self, c: &[f64], corrected: &[f64], xi: &[f64]) {
        let n = self.seen.cols();
        multiply::<L>(&mut self.seen, c, corrected, n);
        multiply::<L>(&mut self.weighted, self.seen.as_slice(), xi, n);
    }

    /// `1/2 Tr(Xi (Sigma' - Sigma))`: without the measurement, `Sigma' = Sigma + s s' / (v - c' s)` with `s = Sigma c`.
    fn saved(&self, measurement: usize, c: &[f64], variance: f64) -> f64 {
        let stride = self.seen.stride();
        let row = measurement * stride..(measurement + 1) * stride;
        let s = &self.seen.as_slice()[row.clone()];
        0.5 * rows::dot(s, &self.weighted.as_slice()[row.clone()]) / (variance - rows::dot(s, &c[row]))
    }
}

/// `out = left right`, `right` n x n.
#[inline(always)]
fn multiply<L: Lanes>(out: &mut Matrices, left: &[f64], right: &[f64], n: usize) {
    let (rows, width) = (out.rows(), out.stride());
    let product = Product { left: Left::plain(left, width), right: View::new(right, width), rows, inner: n, width };
    product.set::<L, Medium>(ViewMut::new(out.as_mut_slice(), width));
}

/// The diagonal of the inverse of such a positive definite matrix `L L'`: the squared columns of `L^-1`,
/// summed. `None` if it is not positive definite.
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
