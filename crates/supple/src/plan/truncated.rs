//! Newton steps whose second derivatives are only multiplied with vectors (theory, section "Newton steps of large systems").

use std::convert::Infallible;

use supple_kernels::{Matrices, Scratch, rows};
use supple_lqg::{Decrease, Rooted};
use supple_model::system::{Curvature, CurvatureProducts};

use super::conjugate_gradients::{Found, Goal, Operator, Solved, conjugate_gradients};
use super::{NominalProblem, Plan};

/// Products with the Hessian in one step at most.
const PRODUCTS: usize = 60;
/// Two second derivatives whose difference is below this share of their sizes are equal up to rounding.
const ROUNDING: f64 = 1e-13;

/// A step towards the minimum of Newton's model.
pub(super) struct Truncated {
    /// The feedforward of the step.
    pub feedforward: Matrices,
    /// The decrease that the model predicts.
    pub decrease: Decrease,
    /// How long it is.
    pub length: f64,
    /// Whether it ends before the minimum: at the trust radius, or along negative curvature.
    pub ends: bool,
}

/// Newton's step (theory, equation P.5c) from a plan whose policy, like the slope, is that of a Gauss-Newton sweep with
/// its roots; no longer than a radius, by default than the sweep's own step. `None` if there is no such step. `exact`
/// is memory for the curvature of the cost.
pub(super) fn truncated_newton(
    problem: NominalProblem,
    plan: &Plan,
    slope: &[f64],
    radius: Option<f64>,
    exact: &mut Matrices,
    scratch: &mut Scratch,
) -> Option<Truncated> {
    let (at, phi) = (plan.trajectory.points(), problem.phi);
    exact.clear();
    problem.system.cost_quadratics(at, phi, Curvature::Exact, exact, scratch);
    let products = problem.system.curvature_products(at, phi, &plan.costates, scratch)?;
    let rooted = Rooted::of(&plan.knots.dynamics, &plan.policy)?;
    let vectors = || Matrices::vectors(at.count(), exact.rows());
    let (joint, changed) = (vectors(), vectors());
    let cost = difference(exact, &plan.knots.cost);
    let mut model = NewtonModel { rooted, cost, products, joint, changed, scratch };

    let down: Vec<f64> = slope.iter().map(|g| -g).collect();
    let radius = radius.unwrap_or_else(|| rows::dot(&down, &down).sqrt());
    // Solve more precisely the closer the plan is to stationary: convergence is quadratic up to rounding.
    let relative = plan.relative_stationarity.sqrt().clamp(1e-6, 0.1);
    let (goal, mut found) = (Goal { relative, products: PRODUCTS, radius }, Found::default());
    let Ok(solved) = conjugate_gradients(&mut model, &down, goal, &mut found);
    let Found { x, residual } = found;
    // 1/2 x' H x
    let curved = x.iter().zip(down.iter().zip(&residual)).map(|(x, (b, r))| x * (b - r)).sum::<f64>();
    let decrease = Decrease { linear: -rows::dot(&down, &x), quadratic: 0.5 * curved };
    let mut feedforward = Matrices::vectors(at.stages, plan.policy.feedforward.cols());
    rooted.feed_forward(&x, &mut feedforward);
    let ends = matches!(solved, Solved::Border | Solved::NegativeCurvature);
    let length = rows::dot(&x, &x).sqrt();
    (decrease.linear < 0.0 && length.is_finite()).then_some(Truncated { feedforward, decrease, length, ends })
}

/// An entry of a matrix at a knot.
struct Entry {
    knot: usize,
    row: usize,
    column: usize,
    value: f64,
}

/// In which entries, and by how much, the curvature of the cost differs from another.
fn difference(exact: &Matrices, other: &Matrices) -> Vec<Entry> {
    let (size, stride) = (exact.rows(), exact.stride());
    let mut entries = Vec::new();
    for knot in 0..exact.count() {
        let rows = exact.at(knot).chunks_exact(stride).zip(other.at(knot).chunks_exact(stride));
        for (row, (exact, other)) in rows.enumerate() {
            for (column, (exact, other)) in exact[..size].iter().zip(&other[..size]).enumerate() {
                let value = exact - other;
                if value.abs() > ROUNDING * (exact.abs() + other.abs()) {
                    entries.push(Entry { knot, row, column, value });
                }
            }
        }
    }
    entries
}

/// The Hessian of the nominal cost in the coordinates of a Gauss-Newton sweep: the identity, and what the sweep left out.
struct NewtonModel<'a> {
    rooted: Rooted<'a>,
    cost: Vec<Entry>,
    products: CurvatureProducts<'a>,
    joint: Matrices,
    changed: Matrices,
    scratch: &'a mut Scratch,
}

impl Operator for NewtonModel<'_> {
    type Error = Infallible;

    fn times(&mut self, w: &[f64]) -> Result<Vec<f64>, Infallible> {
        let Self { rooted, cost, products, joint, changed, scratch } = self;
        rooted.along(w, joint);
        changed.clear();
        products.add(joint, changed, scratch);
        for &Entry { knot, row, column, value } in &*cost {
            changed.vector_mut(knot)[row] += value * joint.vector(knot)[column];
        }
        let mut product = w.to_vec();
        rooted.add_gradient(changed, &mut product);
        Ok(product)
    }
}
