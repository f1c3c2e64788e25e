//! The information that given sensors and the optimal controller use in steady state.

use supple_kernels::{Matrices, halt, math};

use super::horizon::Stationary;
use super::regulator::regulator;
use super::settle::settled;
use super::subspace::{GROWTH, complement, invariant_hull, observed, unstable};
use crate::Error;
use crate::belief::{Belief, Correction, kalman_to_the_end};
use crate::dense::{Dense, congruence, dense, eigenvalues, first, store, symmetric};
use crate::given::MEASUREMENT;
use crate::information::control_information;
use crate::knots::Knots;
use crate::noise::Noise;
use crate::riccati::Policy;

/// Maximum number of filter steps; after that the filter counts as having no steady state.
const MOST_STEPS: usize = 100_000;

/// The tolerance by which eigenvalues of a filter found by doubling may lie outside the unit circle.
const STABLE: f64 = 1e-9;

/// The filter is steady when a step changes the covariance by less than this, relatively.
const STEADY: f64 = 1e-14;

/// Steps over which the information in the controls is checked for a steady value: the first number, and the maximum.
const CONTROL_STEPS: [usize; 2] = [256, 16_384];

/// The design's own sensors and controller in steady state.
///
/// Example: [`own_rates`].
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub struct OwnRates {
    /// `Tr(Theta Sigma)`: the cost of state uncertainty per step.
    pub price: f64,
    /// `DI(x -> y)`, `1/2 log |C P C' + V| / |V|`, nats per step.
    pub measurement_nats: f64,
    /// `DI(x -> u)`, nats per step; `None` if it does not settle.
    pub control_nats: Option<f64>,
}

/// The information of the design's own sensors and controller in steady state; `None` if their filter has none.
///
/// # Errors
/// Where `V` is not positive definite.
///
/// ```
/// use supple_lqg::bound::{Stationary, own_rates, regulator_distance};
/// use supple_lqg::{Knots, LinearQuadratic, Noise, constant};
///
/// // x+ = x + u + w and y = x + v, with the cost (x^2 + u^2) / 2 per step.
/// let (dynamics, cost, one) = (constant(&[[1.0, 1.0]]), constant(&[[1.0, 0.0], [0.0, 1.0]]), constant(&[[1.0]]));
/// let plant = Stationary::new(&dynamics, &one, &cost)?;
/// assert!(regulator_distance(&plant, &dynamics, &cost)? < 1e-8, "its regulator is exact but for rounding");
///
/// // With W = 1 and V = 2 the variance before each measurement is 2: 1/2 ln((2 + 2) / 2).
/// let linear = LinearQuadratic { a: &[[1.0]], b: &[[1.0]], c: &[[1.0]], q: &[[1.0]], r: &[[1.0]] };
/// let knots = Knots::linear(2, linear)?;
/// let noise = Noise { initial: one.clone(), process: one, measurement: constant(&[[2.0]]) };
/// let own = own_rates(&plant, &knots, &noise)?.ok_or("the filter has no steady state")?;
/// assert!((own.measurement_nats - 0.5 * 2f64.ln()).abs() < 1e-9);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn own_rates(problem: &Stationary, knots: &Knots, noise: &Noise) -> Result<Option<OwnRates>, Error> {
    let (a, w) = (dense(&problem.dynamics, 0), dense(&problem.process, 0));
    let (c, v) = (dense(&knots.measurement, 0), dense(&noise.measurement, 0));
    let indefinite = Error::NotPositiveDefinite { what: MEASUREMENT, step: 0 };
    let of_noise = v.clone().cholesky().ok_or(indefinite)?;
    // States that no noise drives become known as 1/t: the filter would never settle.
    let uncertain = uncertain(&a, &w, &c);
    let (a, w, c) = (among(&uncertain, &a), symmetric(among(&uncertain, &w)), c * &uncertain);
    // Does not start from X_0: initial knowledge of an undriven state may still be lost as the state grows.
    let mut predicted = symmetric(among(&uncertain, &dense(&noise.initial, 0)));
    let mean = (predicted.trace() + w.trace()) / a.nrows().max(1) as f64;
    for i in 0..a.nrows() {
        predicted[(i, i)] += if mean > 0.0 { mean } else { 1.0 };
    }
    let filter = Filter { a: &a, w: &w, c: &c, v: &v };
    let steady = match filter.settle(predicted.clone())? {
        None => {
            // Modes close to the unit circle converge slowly.
            let precision = symmetric(c.transpose() * of_noise.solve(&c));
            let far = settled(&a, &precision, &w, &predicted);
            let found = far.map_or(Ok(None), |far| filter.settle(far))?;
            found.filter(|step| {
                let closed = &a * (Dense::identity(a.nrows(), a.nrows()) - &step.correction.gain * &c);
                eigenvalues(&closed).is_some_and(|roots| roots.iter().all(|root| root.norm() <= 1.0 + STABLE))
            })
        }
        found => found,
    };
    let Some(Step { next, correction }) = steady else { return Ok(None) };
    let log = |factor: &Dense| factor.diagonal().iter().map(|pivot| math::ln(*pivot)).sum::<f64>();
    Ok(Some(OwnRates {
        price: dense(&problem.price, 0).dot(&congruence(&uncertain, &correction.corrected)).max(0.0),
        // Rounding of a state that is known must not become less than no information.
        measurement_nats: (log(&correction.innovation_factor) - log(of_noise.l_dirty())).max(0.0),
        control_nats: control_nats(problem, knots, noise, &congruence(&uncertain, &next))?,
    }))
}

/// An orthonormal basis of the states that a filter stays uncertain of, by columns: all but those that no noise drives,
/// that do not grow, and that the sensors see or that vanish by themselves.
fn uncertain(a: &Dense, w: &Dense, c: &Dense) -> Dense {
    let all = Dense::identity(a.nrows(), a.nrows());
    // An orthonormal basis of the modes within some states that outgrow a factor per step.
    let outgrowing = |states: &Dense, factor: f64| match states.ncols() {
        0 => Some(states.clone()),
        _ => unstable(&among(states, a), factor).map(|growing| states * growing),
    };
    let undriven = complement(&invariant_hull(a, w.clone()));
    let Some(growing) = outgrowing(&undriven, 1.0 + GROWTH) else { return all };
    let known = &undriven * complement(&(undriven.transpose() * growing));
    // What neither vanishes nor is seen stays as uncertain as at first.
    let unseen = complement(&observed(a, &(c.transpose() * c)));
    match outgrowing(&unseen, 1.0 - GROWTH) {
        Some(lasting) if (known.transpose() * &lasting).norm() <= STABLE => complement(&known),
        _ => all,
    }
}

/// `T' A T`: a map among some states, `T` an orthonormal basis of them.
fn among(states: &Dense, a: &Dense) -> Dense {
    states.transpose() * a * states
}

/// A Kalman filter of a time-invariant system.
struct Filter<'a> {
    a: &'a Dense,
    w: &'a Dense,
    c: &'a Dense,
    v: &'a Dense,
}

/// A step of the filter.
struct Step {
    /// The next predicted covariance.
    next: Dense,
    correction: Correction,
}

impl Filter<'_> {
    /// The step at which the filter settles, starting from a predicted covariance; `None` if not within [`MOST_STEPS`].
    fn settle(&self, mut predicted: Dense) -> Result<Option<Step>, Error> {
        for _ in 0..MOST_STEPS {
            if halt::is_requested() {
                return Err(Error::Stopped);
            }
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
        let indefinite = || Error::NotPositiveDefinite { what: MEASUREMENT, step: 0 };
        let correction = Correction::of(predicted, c, v).ok_or_else(indefinite)?;
        Ok(Step { next: symmetric(*a * &correction.corrected * a.transpose() + *w), correction })
    }
}

/// `DI(x -> u)` per step: from the end of ever longer horizons with the steady filter and regulator, until it settles.
fn control_nats(problem: &Stationary, knots: &Knots, given: &Noise, predicted: &Dense) -> Result<Option<f64>, Error> {
    let size = knots.dimensions;
    let (f, l) = (dense(&knots.dynamics, 0), dense(&knots.cost, 0));
    let (n, m, joint) = (size.states, size.controls, size.joint());
    let (a, b) = (f.columns(0, n).into_owned(), f.columns(n, m).into_owned());
    let l = l.view((0, 0), (joint, joint)).into_owned();
    let s = regulator(&f.columns(0, joint).into_owned(), &l, &dense(&problem.process, 0))?.s;
    let curvature = symmetric(l.view((n, n), (m, m)) + b.transpose() * &s * &b);
    let Some(factor) = curvature.cholesky() else { return Ok(None) };
    let feedback = -factor.solve(&(l.view((n, 0), (m, n)) + b.transpose() * s * a));
    let mut initial = Matrices::constant(n, n);
    store(&mut initial, 0, predicted);
    let noise = Noise {
        initial,
        process: problem.process.clone(),
        measurement: first(&given.measurement, size.measurements, size.measurements),
    };
    let c = dense(&knots.measurement, 0);
    let mut steps = CONTROL_STEPS[0];
    while steps <= CONTROL_STEPS[1] {
        if halt::is_requested() {
            return Err(Error::Stopped);
        }
        let (mut knots, mut policy) = (Knots::zeros(size, steps), Policy::zeros(size, steps));
        for t in 0..=steps {
            store(&mut knots.measurement, t, &c);
            if t < steps {
                store(&mut knots.dynamics, t, &f);
                store(&mut policy.feedback, t, &feedback);
            }
        }
        let mut belief = Belief::zeros(n, size.measurements, steps);
        // Rounding may have made the covariance indefinite where a state is known.
        kalman_to_the_end(&knots, &noise, &mut belief)?;
        let nats = control_information(&knots, &policy, &belief, &noise)?;
        let (half, last) = (nats[steps / 2], nats[steps - 1]);
        if (half - last).abs() <= 1e-9 * (1.0 + last.abs()) {
            return Ok(Some(last));
        }
        steps *= 4;
    }
    Ok(None)
}
