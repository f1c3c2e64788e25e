//! Whether a time step is too large for the stiff parts of a model (theory, equation R.19).

use nalgebra::DMatrix;
use nalgebra::linalg::{Schur, balancing::balance_parlett_reinsch};
use supple_kernels::{Matrices, Scratch, math};
use supple_lqg::Knots;
use supple_lqg::spectral_radius;
use supple_model::Trajectory;
use supple_model::system::{Points, Times};

use crate::Error;
use crate::problem::Task;
use crate::stability::Stability;

/// Maximum number of steps examined.
const LOOKED_AT: usize = 20;
/// Above this number of states, fewer steps are examined, using matrix powers instead of eigenvalues.
const LARGE: usize = 32;
/// Threshold of `ln rho` per time step below which no warning is issued: at this rate, doubling takes 70 steps. What does
/// not move, such as positions without springs, has `rho = 1`, and rounding of such multiple eigenvalues stays far below.
const SLOW: f64 = 1e-2;
/// Growth in one time step that a suggested time step may have in addition to that of the physics.
const SUGGESTED: f64 = 1e-3;
/// How many times faster than the physics the numerical solution may grow. With Euler's methods, unstable physics grows no
/// faster than it really does.
const FASTER: f64 = 2.0;
/// Number of ever shorter time steps, by powers of 1/8, from which the growth rate of the physics is estimated.
const SHORTER: i32 = 7;
/// A time step is divided into powers of so many parts, up to this power, until the growth in it changes by no more than this
/// share.
const PARTS: usize = 8;
const MOST_POWERS: u32 = 4;
const AGREE: f64 = 0.3;
/// A suggested time step is this fraction of the limit found.
const MARGIN: f64 = 0.95;
/// Maximum number of sub-steps suggested or advised: the most that task files may request.
pub(crate) const MOST_SUBSTEPS: usize = 1000;

/// Whether the time step is short enough for a plan, by its knots.
///
/// ```
/// use supple::pipeline::TaskState;
/// use supple::stability;
/// # let task = r#"
/// #     model = { kind = "linear", A = [[1.0, 0.1], [0.1, 1.0]], B = [[0.0], [0.1]], C = [[1.0, 0.0]] }
/// #     parameters.variance = { initial = 1e-4, bounds = [1e-6, 1e-2], scale = "log", unit = "m^2" }
/// #     [[tasks]]
/// #     name = "balance"
/// #     steps = 50
/// #     time_step = 0.1
/// #     bound = 15.0
/// #     initial_state = [1.0, 0.0]
/// #     noise = { initial = [1e-2, 1e-2], process = [0.0, 1e-3], measurement = ["variance"] }
/// #     costs = [{ kind = "quadratic", Q = [[1.0, 0.0], [0.0, 0.1]], R = [[0.1]] }]
/// # "#;
///
/// // The task of the front page.
/// let problem = supple_file::parse(task, "balance.toml")?;
/// let (task, phi) = (&problem.tasks[0], problem.parameters.initial());
/// let mut state = TaskState::new(task);
/// state.evaluate(task, &phi, &problem.planning, None)?;
/// assert!(!stability(task, &phi, &state.plan.trajectory, &state.plan.knots).numerically_unstable);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[must_use]
pub fn stability(task: &Task, phi: &[f64], trajectory: &Trajectory, knots: &Knots) -> Stability {
    Looker { task, phi }.look(trajectory, &knots.dynamics, &spread(trajectory.steps(), knots.dynamics.rows()))
}

/// The error with the task's name and, if a plan cannot be computed because the time step is too large, with advice.
/// The trajectory is the attempted one, up to where it is no longer finite.
pub(crate) fn explain(task: &Task, phi: &[f64], error: Error, trajectory: &Trajectory) -> Error {
    if !matches!(
        error,
        Error::NotFinite { .. }
            | Error::Lqg(supple_lqg::Error::NotFinite { .. } | supple_lqg::Error::NotPositiveDefinite { .. })
    ) {
        return error;
    }
    // Failures at very large states reveal nothing about where the instability began.
    let size = |t: usize| trajectory.states.vector(t).iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    let modest =
        |t: &usize| trajectory.states.vector(*t).iter().all(|x| x.is_finite()) && size(*t) <= 1e3 * (1.0 + size(0));
    let steps = (0..trajectory.steps()).take_while(modest).count();
    let of_task = |error: Error| Error::InTask { task: task.name.clone(), error: Box::new(error) };
    if steps == 0 {
        return of_task(error);
    }
    let size = task.system.dimensions();
    let mut dynamics = Matrices::zeros(steps, size.states, size.joint());
    let points = Points { stages: steps, has_end: false, ..trajectory.points() };
    task.system.dynamics_jacobians(points, phi, &mut dynamics, &mut Scratch::new());
    // The instability began at the first unstable step; later states belong to no plan.
    let mut looks =
        spread(steps, size.states).into_iter().map(|t| Looker { task, phi }.look(trajectory, &dynamics, &[t]));
    match looks.find(|found| found.numerically_unstable) {
        Some(stability) => Error::TimeStep { task: task.name.clone(), error: Box::new(error), stability },
        None => of_task(error),
    }
}

/// The first, the last and some other steps of a system with `states` states: fewer steps if there are many states, as
/// the time for eigenvalues grows with the cube of their number.
fn spread(steps: usize, states: usize) -> Vec<usize> {
    let count = steps.min((LOOKED_AT * LARGE * LARGE / states.max(LARGE).pow(2)).max(2));
    (0..count).map(|i| i * (steps - 1) / (count - 1).max(1)).collect()
}

/// The square part of matrix `t` of `[A B]`.
fn square(dynamics: &Matrices, t: usize) -> DMatrix<f64> {
    DMatrix::from_fn(dynamics.rows(), dynamics.rows(), |i, j| dynamics.get(t, i, j))
}

/// `ln rho` of a matrix; `None` if it is not finite.
fn growth(a: DMatrix<f64>) -> Option<f64> {
    let n = a.nrows();
    // Squares of entries must be finite too.
    if a.iter().any(|entry| entry.is_nan() || entry.abs() > 1e100) {
        return None;
    }
    if n > LARGE {
        return Some(math::ln(spectral_radius(a)));
    }
    // Of A - I, whose eigenvalues keep their digits over short time steps.
    let mut change = &a - DMatrix::identity(n, n);
    balance_parlett_reinsch(&mut change);
    let Some(schur) = Schur::try_new(change, f64::EPSILON, 100 * n) else { return Some(math::ln(spectral_radius(a))) };
    let growth = |re: f64, im: f64| 0.5 * math::ln_1p(re * (2.0 + re) + im * im);
    Some(schur.complex_eigenvalues().iter().map(|value| growth(value.re, value.im)).fold(f64::NEG_INFINITY, f64::max))
}

/// A task at a design, to be examined.
struct Looker<'a> {
    task: &'a Task,
    phi: &'a [f64],
}

impl Looker<'_> {
    /// Examines some steps of a trajectory with the linearisation `dynamics`.
    fn look(&self, trajectory: &Trajectory, dynamics: &Matrices, steps: &[usize]) -> Stability {
        let time_step: f64 = self.task.time_step.resolve(self.phi);
        let mut seen: Vec<(f64, usize)> =
            steps.iter().filter_map(|&t| Some((growth(square(dynamics, t))?, t))).collect();
        seen.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut found = Stability {
            time_step,
            spectral_radius: seen.first().map_or(f64::NAN, |(growth, _)| math::exp(*growth)),
            step: seen.first().map_or(0, |&(_, step)| step),
            numerically_unstable: false,
            suggested_time_step: None,
            suggested_substeps: None,
        };
        let mut limit = time_step;
        for (growth, step) in seen.into_iter().filter(|&(growth, _)| growth > SLOW) {
            let (x, u) = (trajectory.states.vector(step), trajectory.controls.vector(step));
            let at = Step { looker: self, t: step, x, u };
            let exceeds = |rate: &f64| growth > FASTER * rate * time_step + SLOW;
            let Some(rate) = at.rate(time_step).filter(exceeds) else { continue };
            // The physics may grow faster later in the step than at first.
            let Some(rate) = Some(at.rate_over(time_step).map_or(rate, |over| rate.max(over))).filter(exceeds) else {
                continue;
            };
            if !found.numerically_unstable {
                (found.spectral_radius, found.step, found.numerically_unstable) = (math::exp(growth), step, true);
            }
            limit = at.longest(limit, rate).unwrap_or(limit);
        }
        if limit < time_step {
            let suggested = two_digits(MARGIN * limit);
            let substeps = |now: usize| (now as f64 * time_step / suggested).ceil() as usize;
            found.suggested_time_step = Some(suggested);
            found.suggested_substeps =
                self.task.system.substeps().map(substeps).filter(|&substeps| substeps <= MOST_SUBSTEPS);
        }
        found
    }
}

/// A number rounded down to two digits.
fn two_digits(value: f64) -> f64 {
    let exponent = math::log10(value).floor() as i32;
    let digits = (value * 10f64.powi(1 - exponent)).floor();
    // Via its decimal form, so that no digits from rounding show.
    format!("{digits}e{}", exponent - 1).parse().unwrap_or(value)
}

/// One step of a plan.
struct Step<'a> {
    looker: &'a Looker<'a>,
    t: usize,
    x: &'a [f64],
    u: &'a [f64],
}

impl Step<'_> {
    /// `ln rho(A)` over a time step.
    fn growth(&self, time_step: f64) -> Option<f64> {
        let Looker { task, phi } = self.looker;
        growth(square(&task.system.dynamics_jacobian_with(self.t, self.x, self.u, phi, time_step)?, 0))
    }

    /// `ln rho(A)` over a time step in so many parts, each from where the one before leads.
    fn growth_in(&self, parts: usize) -> Option<f64> {
        let Looker { task, phi } = self.looker;
        let [states, controls] = [self.x, self.u].map(|vector| Matrices::of_rows(&[vector.to_vec()], vector.len()));
        let at = Points { states: &states, controls: &controls, stages: 1, has_end: false, times: Times::At(self.t) };
        let mut found = Matrices::zeros(1, self.x.len(), self.x.len() + self.u.len());
        task.system.dynamics_jacobians_in(parts, at, phi, &mut found, &mut Scratch::new());
        growth(square(&found, 0))
    }

    /// Growth rate of the physics over a time step as a whole, 1/s, of which more and more parts are looked at until three
    /// numbers of them agree: an unstable integration may agree with itself twice.
    fn rate_over(&self, time_step: f64) -> Option<f64> {
        let agree = |a: f64, b: f64| (a - b).abs() <= AGREE * b.abs();
        let mut before = [self.growth_in(1)?, self.growth_in(PARTS)?];
        for power in 2..=MOST_POWERS {
            let fine = self.growth_in(PARTS.pow(power))?;
            if agree(before[0], before[1]) && agree(before[1], fine) {
                return Some(fine / time_step);
            }
            before = [before[1], fine];
        }
        None
    }

    /// Growth rate of the physics, 1/s: the least over several shorter time steps, and at least 0.
    ///
    /// With Euler's methods, unstable physics grows more slowly over longer steps, so the least is not below the rate
    /// over the present step; and numerical growth vanishes once the time step is short enough. For large systems, only
    /// every other time step is tried.
    fn rate(&self, time_step: f64) -> Option<f64> {
        let stride = if self.x.len() > LARGE { 2 } else { 1 };
        let rates = (1..=SHORTER).step_by(stride).map(|power| {
            let shorter = time_step * 8f64.powi(-power);
            Some((self.growth(shorter)? / shorter).max(0.0))
        });
        rates.collect::<Option<Vec<_>>>()?.into_iter().reduce(f64::min)
    }

    /// The longest time step, at most `most`, that is stable apart from the growth of the physics.
    fn longest(&self, most: f64, rate: f64) -> Option<f64> {
        let is_stable = |h: f64| self.growth(h).is_some_and(|growth| growth <= FASTER * rate * h + SUGGESTED);
        if is_stable(most) {
            return Some(most);
        }
        let mut stable = (1..3 * SHORTER).map(|power| most * 0.5f64.powi(power)).find(|&h| is_stable(h))?;
        let mut unstable = 2.0 * stable;
        for _ in 0..12 {
            let middle = 0.5 * (stable + unstable);
            *(if is_stable(middle) { &mut stable } else { &mut unstable }) = middle;
        }
        Some(stable)
    }
}
