//! Derivatives of the information that the controller uses with respect to what is computed along the plan.

use nalgebra::Cholesky;

use super::control::{Told, told};
use crate::Error;
use crate::belief::Belief;
use crate::dense::{Dense, dense, symmetric};
use crate::given::MEASUREMENT;
use crate::knots::Knots;
use crate::noise::Noise;
use crate::partials::{Partials, add_dense};
use crate::riccati::Policy;

/// Adds `weight` times the derivatives of [`control_information`](super::control_information) to `out`, and returns the
/// information, nats (theory, equation I.15).
///
/// # Errors
/// Where `V` is not positive definite; if arrays do not fit each other.
///
/// ```
/// use supple_lqg::{Belief, Knots, LinearQuadratic, Noise, Partials, Policy, Regularisation};
/// use supple_lqg::{add_control_partials, constant, control_information, kalman, solve_riccati};
///
/// let plant = LinearQuadratic { a: &[[0.9]], b: &[[1.0]], c: &[[1.0]], q: &[[1.0]], r: &[[1.0]] };
/// let knots = Knots::linear(10, plant)?;
/// let mut policy = Policy::zeros(knots.dimensions, 10);
/// solve_riccati(&knots.dynamics, &knots.cost, Regularisation::default(), &mut policy)?;
/// let one = constant(&[[1.0]]);
/// let noise = Noise { initial: one.clone(), process: one.clone(), measurement: one };
/// let mut belief = Belief::zeros(1, 1, 10);
/// kalman(&knots, &noise, &mut belief)?;
/// let mut partials = Partials::zeros(knots.dimensions, 10);
/// let nats = add_control_partials(&knots, &policy, &belief, &noise, 1.0, &mut partials)?;
/// let used: f64 = control_information(&knots, &policy, &belief, &noise)?.iter().sum();
/// assert!((nats - used).abs() < 1e-9 && partials != Partials::zeros(knots.dimensions, 10));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn add_control_partials(
    knots: &Knots,
    policy: &Policy,
    belief: &Belief,
    noise: &Noise,
    weight: f64,
    out: &mut Partials,
) -> Result<f64, Error> {
    let steps = told(knots, policy, belief, noise)?;
    let n = knots.dimensions.states;
    let mut after = [Dense::zeros(n, n), Dense::zeros(n, n)];
    for t in (0..steps.len()).rev() {
        let here = before_telling(&steps[t], &dense(&policy.feedback, t), weight, after, t, out);
        let given = t.checked_sub(1).map(|before| &steps[before]);
        after = before_measuring(knots, belief, noise, t, given, here, out)?;
    }
    Ok(steps.iter().map(|step| step.nats).sum())
}

/// Adjoints of `N^a` and `N^b` before conditioning on the controls of step `t`, from those after; and of the feedback.
fn before_telling(
    step: &Told,
    feedback: &Dense,
    weight: f64,
    after: [Dense; 2],
    t: usize,
    out: &mut Partials,
) -> [Dense; 2] {
    if step.controls.is_empty() {
        return after;
    }
    let rows = feedback.select_rows(&step.controls);
    let mut by_rows = Dense::zeros(rows.nrows(), rows.ncols());
    let mut side = |side: usize, weight: f64, adjoint: &Dense| {
        let (before, after) = (&step.before[side], &step.after[side]);
        let adjoint = within(adjoint, before, after);
        // N K' = F Q R with F' K' = Q R, so that K N K' = R' R.
        let found = before.tr_mul(&rows.transpose()).qr();
        let (q, r) = (found.q(), found.r());
        let gain = r.solve_upper_triangular(&(q.transpose() * before.transpose()));
        let whitened = r.tr_solve_upper_triangular(&rows);
        let (Some(gain_transposed), Some(whitened)) = (gain, whitened) else { return adjoint };
        let kept = Dense::identity(rows.ncols(), rows.ncols()) - gain_transposed.transpose() * &rows;
        let left = after * after.transpose();
        by_rows += &gain_transposed * weight - &gain_transposed * &adjoint * left * 2.0;
        symmetric(kept.transpose() * adjoint * kept + whitened.transpose() * whitened * (0.5 * weight))
    };
    let here = [side(0, weight, &after[0]), side(1, -weight, &after[1])];
    let mut by_feedback = Dense::zeros(feedback.nrows(), feedback.ncols());
    for (row, &a) in step.controls.iter().enumerate() {
        by_feedback.set_row(a, &by_rows.row(row));
    }
    add_dense(&mut out.feedback, t, &by_feedback);
    here
}

/// Adjoints of `N^a` and `N^b` after the previous controls, from those after the measurement at `t`; `given` is the
/// conditioning step of these controls.
fn before_measuring(
    knots: &Knots,
    belief: &Belief,
    noise: &Noise,
    t: usize,
    given: Option<&Told>,
    [by_told, by_both]: [Dense; 2],
    out: &mut Partials,
) -> Result<[Dense; 2], Error> {
    let n = knots.dimensions.states;
    let (c, v) = (dense(&knots.measurement, t), dense(&noise.measurement, t));
    let gain = dense(&belief.gain_transposed, t).transpose();
    let corrected = dense(&belief.corrected, t);
    // P - Sigma = P C' S^-1 C P as a function of P, C and V: the difference of two derivatives would be rounding alone where
    // a measurement adds little.
    let seen = &gain * &c;
    let by_seen = &by_told * &seen;
    add_dense(&mut out.predicted, t, &(&by_seen + by_seen.transpose() - symmetric(seen.transpose() * &by_seen)));
    let through_gain = gain.transpose() * &by_told;
    let mut by_c = &through_gain * &corrected * 2.0;
    add_dense(&mut out.measurement_noise, t, &-symmetric(through_gain * &gain));
    // L V L', and then L = Sigma C' V^-1.
    let mut by_gain = &by_both * &gain * &v * 2.0;
    let mut back = [Dense::zeros(n, n), Dense::zeros(n, n)];
    if let Some(given) = given {
        let a = dense(&knots.dynamics, t - 1).columns(0, n).into_owned();
        let covariance = |side: usize| &given.after[side] * given.after[side].transpose();
        let kept = Dense::identity(n, n) - &seen;
        let through = &kept * &a;
        let by_through = &by_both * &through * covariance(1) * 2.0;
        let by_a = &by_told * &a * covariance(0) * 2.0 + kept.transpose() * &by_through;
        add_dense(&mut out.dynamics, t - 1, &by_a);
        let by_kept = &by_through * a.transpose();
        by_gain -= &by_kept * c.transpose();
        by_c -= gain.transpose() * by_kept;
        back = [symmetric(a.transpose() * &by_told * &a), symmetric(through.transpose() * &by_both * &through)];
    }
    let factor = Cholesky::new(v).ok_or(Error::NotPositiveDefinite { what: MEASUREMENT, step: t })?;
    let precise = factor.solve(&by_gain.transpose()).transpose();
    add_dense(&mut out.corrected, t, &symmetric(&precise * &c));
    add_dense(&mut out.measurement, t, &(by_c + precise.transpose() * corrected));
    let by_v = gain.transpose() * (by_both * &gain - precise);
    add_dense(&mut out.measurement_noise, t, &symmetric(by_v));
    Ok(back)
}

/// An adjoint of `G G'` without the part that has no effect: `G` keeps its rank, so the part orthogonal to its columns on
/// both sides is constant. For non-minimum-phase loops that part would grow without limit.
fn within(adjoint: &Dense, before: &Dense, factor: &Dense) -> Dense {
    let (n, rank) = factor.shape();
    if rank >= n {
        return adjoint.clone();
    }
    let size: Vec<f64> = before.row_iter().map(|row| row.norm()).collect();
    let unit = |i: usize| if size[i] > 0.0 { size[i] } else { 1.0 };
    let mut across = Dense::identity(n, n);
    if rank > 0 {
        let q = Dense::from_fn(n, rank, |i, j| factor[(i, j)] / unit(i)).qr().q();
        across -= &q * q.transpose();
    }
    let scaled = Dense::from_fn(n, n, |i, j| adjoint[(i, j)] * unit(i) * unit(j));
    let inside = &scaled - &across * &scaled * &across;
    symmetric(Dense::from_fn(n, n, |i, j| inside[(i, j)] / (unit(i) * unit(j))))
}
