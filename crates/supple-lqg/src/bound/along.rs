//! Horizons along linearised plans.

use supple_kernels::{Matrices, halt, rows};

use super::horizon::Horizon;
use super::verify::{Along, AlongStep, Interval, Matrix, law};
use crate::Error;
use crate::knots::Knots;
use crate::noise::Noise;
use crate::riccati::Policy;

impl Horizon {
    /// The horizon along knots, with the prices of a policy and the cost of the plan itself.
    ///
    /// # Errors
    /// If knots, policy and noise do not fit each other.
    pub fn along(knots: &Knots, policy: &Policy, noise: &Noise, nominal_cost: f64) -> Result<Self, Error> {
        let (n, steps) = (knots.dimensions.states, knots.steps());
        knots.check_shapes()?;
        policy.check_shapes(knots.dimensions, steps)?;
        noise.check_shapes(knots.dimensions, steps)?;
        let mut dynamics = Matrices::zeros(steps, n, n);
        let mut prices = Matrices::zeros(steps, n, n);
        for t in 0..steps {
            for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
                dynamics.set(t, i, j, knots.dynamics.get(t, i, j));
                prices.set(t, i, j, 0.5 * policy.value_of_information.get(t, i, j));
            }
        }
        let (s, traced) = (&policy.curvature, |a: &Matrices, b: &Matrices, t, k| rows::dot(a.at(t), b.at(k)));
        let known: f64 = (0..steps).map(|t| traced(s, &noise.process, t + 1, t)).sum();
        let base_cost = nominal_cost + 0.5 * (known + traced(s, &noise.initial, 0, 0));
        Ok(Self { dynamics, process: noise.process.clone(), initial: noise.initial.clone(), prices, base_cost })
    }
}

/// How far a horizon may differ from the problem that it was derived from.
///
/// Example: [`minimum_information_within`](crate::bound::minimum_information_within).
#[derive(Clone, Debug, Default)]
pub struct Spread {
    /// By how much the least cost may be below `base_cost`, and by how much above.
    pub least: [f64; 2],
    /// The possible error of each entry of the prices; `None` if they are exact.
    pub prices: Option<Matrices>,
    /// The relative distance of the costs for which this is proved from those given.
    pub distance: f64,
}

impl Horizon {
    /// The horizon along knots with the control law of least expected cost, computed and proved in as many digits as needed,
    /// and its possible error. Controls that the policy holds at a limit stay there. The true cost of the plan is within
    /// `rounding` of `nominal_cost`.
    ///
    /// # Errors
    /// The reason why it could not be proved.
    pub fn proved(
        knots: &Knots,
        policy: &Policy,
        noise: &Noise,
        nominal_cost: f64,
        rounding: f64,
    ) -> Result<(Self, Spread), String> {
        if !(nominal_cost.is_finite() && rounding.is_finite()) {
            return Err("rounding leaves the cost of the plan unknown".into());
        }
        let (n, joint, steps) = (knots.dimensions.states, knots.dimensions.joint(), knots.steps());
        let is_held = |t: usize, i: usize| i >= n && policy.clamped[t * (joint - n) + i - n];
        let of =
            |from: &Matrices, t: usize, rows: usize, cols: usize| Matrix::from_fn(rows, cols, |i, j| from.get(t, i, j));
        // A control that is held has no effect and no cost.
        let free = |from: &Matrices, t: usize, rows: usize| {
            let moves = |i: usize, j: usize| !is_held(t, i) && !is_held(t, j);
            Matrix::from_fn(rows, joint, |i, j| if moves(i, j) { from.get(t, i, j) } else { 0.0 })
        };
        let step = |t: usize| AlongStep {
            dynamics: free(&knots.dynamics, t, n),
            cost: free(&knots.cost, t, joint),
            process: of(&noise.process, t, n, n),
        };
        let along = Along {
            steps: (0..steps).map(step).collect(),
            last: of(&knots.cost, steps, n, n),
            initial: of(&noise.initial, 0, n, n),
            nominal: Interval::point(nominal_cost) + Interval { low: -rounding, high: rounding },
        };
        let found = law(&along, &halt::is_requested)?;
        let mut dynamics = Matrices::zeros(steps, n, n);
        let (mut prices, mut radii) = (dynamics.clone(), dynamics.clone());
        for (t, (i, j)) in (0..steps).flat_map(|t| (0..n * n).map(move |k| (t, (k / n, k % n)))) {
            dynamics.set(t, i, j, knots.dynamics.get(t, i, j));
            prices.set(t, i, j, found.prices[t].at(i, j));
            radii.set(t, i, j, found.radii[t].at(i, j));
        }
        let base_cost = found.least.middle();
        let least = [(base_cost - found.least.low).next_up(), (found.least.high - base_cost).next_up()];
        let horizon =
            Self { dynamics, process: noise.process.clone(), initial: noise.initial.clone(), prices, base_cost };
        Ok((horizon, Spread { least, prices: Some(radii), distance: found.distance }))
    }
}
