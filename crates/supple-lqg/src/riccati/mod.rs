//! The Riccati sweep: gains and cost-to-go, step by step from the end.

mod along;
mod bounds;
mod box_qp;
mod follow;
mod limits;
mod lq;
mod minimise;
mod policy;
mod products;
mod quadratic;
mod rooted;
mod rounding;

use supple_kernels::rows::{Rows, fetch, fetch_lower};
use supple_kernels::{Job, Lanes, Matrices, dispatch};

pub use self::along::solve_lq;
pub use self::bounds::ControlBounds;
use self::follow::Follow;
pub use self::limits::Limits;
pub use self::lq::{Decrease, Lq, Regularisation};
use self::minimise::minimise;
pub use self::policy::Policy;
use self::quadratic::{Knot, form};
pub use self::rooted::Rooted;
pub use self::rounding::least_cost_rounding;
use crate::Error;
use crate::carried::Carried;
use crate::shape::{Shape, by_length};

/// The Riccati sweep over knots (theory, equation P.2), joint in `z = (x, u)` with `F = [A B]`:
///
/// ```text
/// Q = l_zz + F' S_{t+1} F     Q_z = l_z + F' J_x,{t+1}     k = -Q_uu^-1 Q_u     K = -Q_uu^-1 Q_ux
/// S = [I K'] Q [I; K]         J_x = [I K'] (Q [0; k] + Q_z)         Xi = K' Q_uu K
/// ```
///
/// `cost` is `[l_zz | l_z]`, (n + m) x (n + m + 1). The regularisation affects the gains only.
///
/// # Errors
/// Where `Q_uu` is not positive definite or a number is not finite; if arrays do not fit each other, or there is no control.
///
/// ```
/// use supple_lqg::{Knots, LinearQuadratic, Policy, Regularisation, solve_riccati};
///
/// // x+ = x + u with the cost (x^2 + u^2) / 2 per step: the curvature of the cost-to-go tends to the golden ratio.
/// let plant = LinearQuadratic { a: &[[1.0]], b: &[[1.0]], c: &[[1.0]], q: &[[1.0]], r: &[[1.0]] };
/// let knots = Knots::linear(50, plant)?;
/// let mut policy = Policy::zeros(knots.dimensions, knots.steps());
/// let decrease = solve_riccati(&knots.dynamics, &knots.cost, Regularisation::default(), &mut policy)?;
/// assert!((policy.curvature.get(0, 0, 0) - (1.0 + 5f64.sqrt()) / 2.0).abs() < 1e-12);
/// assert_eq!(decrease.linear, 0.0, "x = 0 is already optimal");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn solve_riccati(
    dynamics: &Matrices,
    cost: &Matrices,
    regularisation: Regularisation,
    policy: &mut Policy,
) -> Result<Decrease, Error> {
    solve_limited(Lq { dynamics, cost, regularisation, limits: None, with_value: true }, policy)
}

/// As [`solve_riccati`], under limits of the controls (theory, equation P.7).
///
/// # Errors
/// Where `Q_uu` is not positive definite on the controls that are free, or a number is not finite; if arrays do not fit each
/// other, or there is no control.
///
/// ```
/// use supple_lqg::{ControlBounds, Knots, Limits, LinearQuadratic, Lq, Matrices, Policy, Regularisation, solve_limited};
///
/// // One step of x+ = x + u about 0, where the cost has the slope 4 in u: the minimum, u = -2, violates a bound.
/// let plant = LinearQuadratic { a: &[[1.0]], b: &[[1.0]], c: &[[1.0]], q: &[[1.0]], r: &[[1.0]] };
/// let mut knots = Knots::linear(1, plant)?;
/// knots.cost.set(0, 1, 2, 4.0);
/// let (bounds, controls) = (ControlBounds::new(&[[-1.0, 1.0]]), Matrices::vectors(1, 1));
/// let lq = Lq {
///     dynamics: &knots.dynamics,
///     cost: &knots.cost,
///     regularisation: Regularisation::default(),
///     limits: Some(Limits::Bounds(&bounds, &controls)),
///     with_value: true,
/// };
/// let mut policy = Policy::zeros(knots.dimensions, 1);
/// solve_limited(lq, &mut policy)?;
/// assert_eq!((policy.feedforward.get(0, 0, 0), policy.clamped[0]), (-1.0, true));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn solve_limited(lq: Lq, policy: &mut Policy) -> Result<Decrease, Error> {
    lq.check_shapes(policy)?;
    let swept = dispatch(Sweep { lq, policy: &mut *policy });
    // A number that is not finite stays so to the first step, or makes a factorisation fail.
    match swept {
        Ok(found) if found.is_finite() && policy.starts_finite() => Ok(found),
        Ok(_) => Err(lq.not_finite(0).unwrap_or_else(|| policy.not_finite())),
        Err(step) => {
            let indefinite = Error::NotPositiveDefinite { what: "the control's curvature", step };
            Err(lq.not_finite(step).unwrap_or(indefinite))
        }
    }
}

/// Number of states from which exploiting the position-rate structure pays off.
const LEAST: usize = 12;
/// Number of states from which the matrices of a horizon exceed a core's cache.
const LARGE: usize = 24;

struct Sweep<'a> {
    lq: Lq<'a>,
    policy: &'a mut Policy,
}

impl Job for Sweep<'_> {
    type Output = Result<Decrease, usize>;

    #[inline(always)]
    fn run<L: Lanes>(self) -> Self::Output {
        let Self { lq, policy } = self;
        if lq.limits.is_none() {
            policy.clamped.fill(false);
        }
        by_length!(policy.dimensions(), |R| sweep::<L, R>(lq, policy))
    }
}

#[inline(always)]
fn sweep<L: Lanes, R: Rows>(lq: Lq, policy: &mut Policy) -> Result<Decrease, usize> {
    let Lq { dynamics, cost, .. } = lq;
    let (steps, shape) = (dynamics.count(), Shape::<R>::of(policy.dimensions()));
    let (n, joint, stride, narrow) = (shape.n, shape.joint(), shape.full(), shape.narrow());
    let (curvature, slope) = (policy.curvature.at_mut(steps), policy.slope.vector_mut(steps));
    let rows = cost.at(steps).chunks_exact(stride).zip(curvature.chunks_exact_mut(narrow));
    for ((from, to), slope) in rows.zip(slope) {
        to[..n].copy_from_slice(&from[..n]);
        *slope = from[joint];
    }
    let suggested = if !R::CALLED { None } else { Carried::suggested(dynamics, LEAST) };
    let follows = lq.limits.is_some() || lq.regularisation != Regularisation::default();
    let mut total = Decrease::default();
    for t in (0..steps).rev() {
        let knot = Knot { dynamics: dynamics.at(t), cost: cost.at(t) };
        let carried = Carried::at_step::<L>(suggested, knot.dynamics, shape.wide());
        form::<L, R>(shape, knot, carried, t + 1, policy);
        if n >= LARGE && t > 0 {
            fetch(dynamics.at(t - 1));
            fetch_lower(cost.at(t - 1), stride);
        }
        let decrease = if follows {
            shape.part::<L, _>(Follow { shape, t, lq, policy })
        } else {
            minimise::<L, R>(shape, t, lq.with_value, policy)
        };
        let decrease = decrease.map_err(|()| t)?;
        total.linear += decrease.linear;
        total.quadratic += decrease.quadratic;
    }
    Ok(total)
}
