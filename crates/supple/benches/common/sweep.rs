//! The Riccati sweep as searches for plans make it: without the value of information.

use supple::lqg::{Decrease, Knots, Lq, Policy, Regularisation, solve_limited};

#[allow(missing_docs, clippy::unwrap_used)]
pub fn sweep(knots: &Knots, policy: &mut Policy) -> Decrease {
    let (dynamics, cost, regularisation) = (&knots.dynamics, &knots.cost, Regularisation::default());
    solve_limited(Lq { dynamics, cost, regularisation, limits: None, with_value: false }, policy).unwrap()
}
