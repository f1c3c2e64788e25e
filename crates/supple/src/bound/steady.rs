//! Tasks that can go on for ever: linear systems that do not change, and what their own sensors give per step.

use std::ops::Range;

use nalgebra::{Cholesky, Dyn};
use supple_kernels::{Matrices, Scratch};

use super::horizon::Stationary;
use super::proof::regulator_distance;
use super::regulator::{doubling, regulator};
use crate::Error;
use crate::belief::{Belief, kalman};
use crate::dense::{Dense, dense, store, symmetric};
use crate::information::control_information;
use crate::knots::Knots;
use crate::noise::Noise;
use crate::pipeline::TaskState;
use crate::plan::Policy;
use crate::problem::Task;

/// Values of a linear model may differ from `A x + B u` by this, relatively, for rounding.
const ROUNDING: f64 = 1e-9;

/// Steps of the filter at most until it counts as without a steady state.
const MOST_STEPS: usize = 100_000;

/// The eigenvalues of a filter that doubling led to are at most so far outside of the unit circle.
const STABLE: f64 = 1e-9;

/// The filter is steady when a step changes the covariance by less than this, relatively.
const STEADY: f64 = 1e-14;

/// Steps over which the information of the controls is looked at for a steady value: at first, and at most.
const CONTROL_STEPS: [usize; 2] = [256, 16_384];

/// The design's own sensors and controller in the steady state.
pub(super) struct Steady {
    /// `Tr(Theta Sigma)`: what not knowing costs per step.
    pub price: f64,
    /// `DI(x -> y)`, `1/2 log |C P C' + V| / |V|`, nats per step.
    pub measurement_nats: f64,
    /// `DI(x -> u)`, nats per step; none where it does not settle.
    pub control_nats: Option<f64>,
}

/// The stationary problem of a task whose plan and noise are known, and how far the cost is from one for which its regulator
/// is exact.
///
/// # Errors
/// Where the system changes over time, is not linear, its cost is not `1/2 z' L z` of `z = (x, u)`, or no regulator keeps the
/// cost finite.
pub(super) fn stationary(
    task: &Task,
    phi: &[f64],
    state: &TaskState,
) -> Result<(Stationary, Result<f64, String>), Error> {
    let (knots, noise) = (&state.plan.knots, &state.noise);
    let (n, joint) = (knots.dimensions.states, knots.dimensions.joint());
    let (stages, all) = (0..task.steps, 0..=task.steps);
    let all = *all.start()..all.end() + 1;
    let changes = [
        ("its dynamics differ from step to step", &knots.dynamics, stages.clone(), joint),
        ("its process noise differs from step to step", &noise.process, stages.clone(), n),
        ("the curvature of its costs differs from step to step", &knots.cost, stages, joint),
        ("its sensors differ from step to step", &knots.measurement, all.clone(), n),
        ("the noise of its sensors differs from step to step", &noise.measurement, all, noise.measurement.cols()),
    ];
    let change = changes.into_iter().find(|(_, matrices, range, cols)| !is_same(matrices, range.clone(), *cols));
    let other = "its model is not `A x + B u`, or its costs are not `x'Qx + u'Ru`";
    let what = change.map(|(what, ..)| what).or_else(|| (!is_quadratic(task, phi, state)).then_some(other));
    if let Some(what) = what {
        return Err(Error::NoBound {
            what: format!("task `{}` has no steady state to ask about: {what}", task.name),
            advice: "ask for the bounds over its horizon, without `stationary`; those of a steady state are for linear models \
                     that do not change over time, with costs `x'Qx + u'Ru` about 0",
        });
    }
    let (dynamics, cost) = (first(&knots.dynamics, n, joint), first(&knots.cost, joint, joint));
    let system = Stationary::new(&dynamics, &first(&noise.process, n, n), &cost)?;
    let distance = regulator_distance(&system, &dynamics, &cost);
    Ok((system, distance))
}

/// The first `rows` rows and `cols` columns of the first matrix, holding at every step.
fn first(matrices: &Matrices, rows: usize, cols: usize) -> Matrices {
    let mut out = Matrices::constant(rows, cols);
    store(&mut out, 0, &dense(matrices, 0).view((0, 0), (rows, cols)).into_owned());
    out
}

/// Whether the first `cols` columns and as many rows, where there are more, are the same at every step.
fn is_same(matrices: &Matrices, range: Range<usize>, cols: usize) -> bool {
    let rows = if matrices.rows() > cols { cols } else { matrices.rows() };
    let scale = |i: usize, j: usize| matrices.get(0, i, j).abs();
    matrices.is_constant()
        || range.into_iter().all(|t| {
            let mut entries = (0..rows).flat_map(|i| (0..cols).map(move |j| (i, j)));
            entries.all(|(i, j)| (matrices.get(t, i, j) - matrices.get(0, i, j)).abs() <= ROUNDING * scale(i, j))
        })
}

/// Whether the model is `A x + B u` and the stage cost `1/2 z' L z`, by their values at points small and great.
fn is_quadratic(task: &Task, phi: &[f64], state: &TaskState) -> bool {
    let knots = &state.plan.knots;
    let (n, joint) = (knots.dimensions.states, knots.dimensions.joint());
    let (f, l) = (dense(&knots.dynamics, 0), dense(&knots.cost, 0).view((0, 0), (joint, joint)).into_owned());
    let mut scratch = Scratch::new();
    [0.0, 1e-2, 1.0, 30.0].into_iter().all(|size| {
        let z = Dense::from_fn(joint, 1, |i, _| size * (1.7 * (i as f64 + 1.0) + size).sin());
        let (x, u) = z.as_slice().split_at(n);
        let mut next = vec![0.0; n];
        task.system.step(0, x, u, phi, &mut next);
        let cost = task.system.stage_cost(0, x, u, phi, &mut scratch);
        let (linear, quadratic) = (&f * &z, 0.5 * (z.transpose() * &l * &z)[(0, 0)]);
        let sizes = f.abs() * z.abs();
        let bulk = 0.5 * (z.abs().transpose() * l.abs() * z.abs())[(0, 0)];
        let close = |found: f64, expected: f64, bulk: f64| (found - expected).abs() <= ROUNDING * bulk;
        (0..n).all(|i| close(next[i], linear[i], sizes[i])) && close(cost, quadratic, bulk)
    })
}

/// What the design's own sensors give and save in the steady state; none where their filter has none.
///
/// # Errors
/// Where `V` is not positive definite.
pub(super) fn steady(problem: &Stationary, state: &TaskState) -> Result<Option<Steady>, Error> {
    let (knots, noise) = (&state.plan.knots, &state.noise);
    let (a, w) = (dense(&problem.dynamics, 0), dense(&problem.process, 0));
    let (c, v) = (dense(&knots.measurement, 0), dense(&noise.measurement, 0));
    let indefinite = Error::NotPositiveDefinite { what: "the measurement covariance", step: 0 };
    let of_noise = v.clone().cholesky().ok_or(indefinite)?;
    // Not from X_0: what is known at first and never driven may still grow.
    let mut predicted = dense(&noise.initial, 0);
    let mean = (predicted.trace() + w.trace()) / a.nrows() as f64;
    for i in 0..a.nrows() {
        predicted[(i, i)] += if mean > 0.0 { mean } else { 1.0 };
    }
    let filter = Filter { a: &a, w: &w, c: &c, v: &v };
    let settled = match filter.settle(predicted.clone())? {
        None => {
            // Modes that are close to the unit circle take their time. Where noise drives nothing, doubling may lose one.
            let precision = symmetric(c.transpose() * of_noise.solve(&c));
            let far = doubling(&a.transpose(), precision, &w, &predicted, 0.0);
            let found = far.map_or(Ok(None), |far| filter.settle(far))?;
            found.filter(|step| {
                let closed = &a * (Dense::identity(a.nrows(), a.nrows()) - &step.gain * &c);
                closed.complex_eigenvalues().iter().all(|root| root.norm() <= 1.0 + STABLE)
            })
        }
        found => found,
    };
    let Some(Step { next, corrected, innovation, .. }) = settled else { return Ok(None) };
    let log = |factor: &Dense| factor.diagonal().iter().map(|pivot| pivot.ln()).sum::<f64>();
    Ok(Some(Steady {
        price: dense(&problem.price, 0).dot(&corrected).max(0.0),
        measurement_nats: log(innovation.l_dirty()) - log(of_noise.l_dirty()),
        control_nats: control_nats(problem, state, &next)?,
    }))
}

/// A filter of a system that does not change.
struct Filter<'a> {
    a: &'a Dense,
    w: &'a Dense,
    c: &'a Dense,
    v: &'a Dense,
}

/// A step of it.
struct Step {
    /// The covariance that is predicted next.
    next: Dense,
    /// The covariance once measured.
    corrected: Dense,
    gain: Dense,
    /// The factor of the innovation's covariance.
    innovation: Cholesky<f64, Dyn>,
}

impl Filter<'_> {
    /// The step at which it settles from a predicted covariance; none where it does not within [`MOST_STEPS`].
    fn settle(&self, mut predicted: Dense) -> Result<Option<Step>, Error> {
        for _ in 0..MOST_STEPS {
            let step = self.step(&predicted)?;
            if !step.next.norm().is_finite() {
                return Ok(None);
            }
            let change = (&step.next - &predicted).norm();
            if change <= STEADY * step.next.norm() {
                return Ok(Some(step));
            }
            predicted = step.next;
        }
        Ok(None)
    }

    fn step(&self, predicted: &Dense) -> Result<Step, Error> {
        let Self { a, w, c, v } = self;
        let indefinite = || Error::NotPositiveDefinite { what: "the measurement covariance", step: 0 };
        let innovation = symmetric(*c * predicted * c.transpose() + *v).cholesky().ok_or_else(indefinite)?;
        let gain = innovation.solve(&(*c * predicted)).transpose();
        let kept = Dense::identity(a.nrows(), a.nrows()) - &gain * *c;
        let corrected = symmetric(&kept * predicted * kept.transpose() + &gain * *v * gain.transpose());
        Ok(Step { next: symmetric(*a * &corrected * a.transpose() + *w), corrected, gain, innovation })
    }
}

/// `DI(x -> u)` per step: that of ever longer horizons with the steady filter and regulator, at their end, until it settles.
fn control_nats(problem: &Stationary, state: &TaskState, predicted: &Dense) -> Result<Option<f64>, Error> {
    let size = state.plan.knots.dimensions;
    let (f, l) = (dense(&state.plan.knots.dynamics, 0), dense(&state.plan.knots.cost, 0));
    let (n, m, joint) = (size.states, size.controls, size.joint());
    let (a, b) = (f.columns(0, n).into_owned(), f.columns(n, m).into_owned());
    let l = l.view((0, 0), (joint, joint)).into_owned();
    let (s, _) = regulator(&a, &b, &l)?;
    let curvature = symmetric(l.view((n, n), (m, m)) + b.transpose() * &s * &b);
    let Some(factor) = curvature.cholesky() else { return Ok(None) };
    let feedback = -factor.solve(&(l.view((n, 0), (m, n)) + b.transpose() * s * a));
    let mut initial = Matrices::constant(n, n);
    store(&mut initial, 0, predicted);
    let noise = Noise {
        initial,
        process: problem.process.clone(),
        measurement: first(&state.noise.measurement, size.measurements, size.measurements),
    };
    let c = dense(&state.plan.knots.measurement, 0);
    let mut steps = CONTROL_STEPS[0];
    while steps <= CONTROL_STEPS[1] {
        let (mut knots, mut policy) = (Knots::zeros(size, steps), Policy::zeros(size, steps));
        for t in 0..=steps {
            store(&mut knots.measurement, t, &c);
            if t < steps {
                store(&mut knots.dynamics, t, &f);
                store(&mut policy.feedback, t, &feedback);
            }
        }
        let mut belief = Belief::zeros(n, size.measurements, steps);
        kalman(&knots, &noise, &mut belief)?;
        let nats = control_information(&knots, &policy, &belief, &noise)?;
        let (half, last) = (nats[steps / 2], nats[steps - 1]);
        if (half - last).abs() <= 1e-9 * (1.0 + last.abs()) {
            return Ok(Some(last));
        }
        steps *= 4;
    }
    Ok(None)
}
