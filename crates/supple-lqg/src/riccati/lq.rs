use supple_kernels::Matrices;

use super::limits::Limits;
use super::policy::Policy;
use crate::Error;
use crate::dense::are_finite;
use crate::given::{COST, DYNAMICS, Given, check_count, check_some};
use crate::knots::Dimensions;

/// The problem of a sweep.
///
/// Example: [`solve_limited`](crate::solve_limited).
#[derive(Clone, Copy)]
pub struct Lq<'a> {
    /// `[A B]`, n x (n + m), N of them.
    pub dynamics: &'a Matrices,
    /// `[l_zz | l_z]`, (n + m) x (n + m + 1), N + 1 of them; `l_zz` is symmetric, and sweeps read its lower triangle.
    pub cost: &'a Matrices,
    /// Regularisation of the gains.
    pub regularisation: Regularisation,
    /// Limits of the controls.
    pub limits: Option<Limits<'a>>,
    /// Whether to compute the value of information, which searches do not need.
    pub with_value: bool,
}

impl Lq<'_> {
    /// Whether the arrays fit each other and the policy that is to be found.
    pub(super) fn check_shapes(&self, policy: &Policy) -> Result<(), Error> {
        let (n, joint, steps) = (self.dynamics.rows(), self.dynamics.cols(), self.dynamics.count());
        check_some("the state", n)?;
        check_some("the control", joint.saturating_sub(n))?;
        Given { what: COST, array: self.cost, shape: (joint, joint + 1), count: steps + 1 }.check_shape()?;
        policy.check_shapes(Dimensions { states: n, controls: joint - n, measurements: 0 }, steps)?;
        match self.limits {
            None => Ok(()),
            Some(Limits::Held(held)) => check_count("the list of held controls", held.len(), steps * (joint - n)),
            Some(Limits::Bounds(bounds, controls)) => {
                check_count("the list of bounds of the controls", bounds.lower().len(), joint - n)?;
                Given { what: "the controls", array: controls, shape: (1, joint - n), count: steps }.check_shape()
            }
        }
    }

    /// The first array that is not finite at a step from this one on, as an error.
    #[cold]
    pub(super) fn not_finite(&self, first: usize) -> Option<Error> {
        let steps = self.dynamics.count();
        (first..=steps).find_map(|step| {
            let what = if step < steps && !are_finite(self.dynamics.at(step)) {
                DYNAMICS
            } else if !are_finite(self.cost.at(step)) {
                COST
            } else {
                return None;
            };
            Some(Error::NotFinite { what, step })
        })
    }
}

/// Levenberg-Marquardt terms in the gains (theory, equation P.2d): each entry of the diagonal of `Q_uu` and of `S_{t+1}`
/// grows by a share of its size.
///
/// Example: [`solve_riccati`](crate::solve_riccati).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Regularisation {
    /// `mu_u`, the share of the diagonal of `Q_uu`.
    pub control: f64,
    /// `mu_x`, the share of the diagonal of `S_{t+1}`.
    pub state: f64,
}

/// The predicted cost change of a step `alpha` along the search direction: `alpha linear + alpha^2 quadratic`.
///
/// Example: [`solve_riccati`](crate::solve_riccati).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Decrease {
    /// `sum k' Q_u`, negative.
    pub linear: f64,
    /// `1/2 sum k' Q_uu k`.
    pub quadratic: f64,
}

impl Decrease {
    pub(super) fn is_finite(self) -> bool {
        self.linear.is_finite() && self.quadratic.is_finite()
    }
}
