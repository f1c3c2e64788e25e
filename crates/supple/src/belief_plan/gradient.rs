use supple_kernels::{Matrices, Scratch, rows};

use super::Memory;
use super::hessian::Around;
use crate::Error;
use crate::gradient::{Quantity, slope_by_controls};
use crate::plan::{Found, Goal, Plan, Solved};
use crate::problem::TaskAt;

/// Relative residual of the linear solve, and maximum number of products with the Hessian.
const RESIDUAL: f64 = 1e-9;
const PRODUCTS: usize = 2000;

/// The total gradient of a quantity along a belief-space plan (theory, equation G.8). The plan moves with the parameters so
/// that its expected cost stays minimal: with the Hessian `H` of the expected cost `J` and the gradient `g`
/// of the quantity, both with respect to the controls,
///
/// ```text
/// H w = g      dF/dphi = F_phi - (d/dv J_phi) w
/// ```
///
/// at fixed `v`, where `u = ubar + v + K (x - xbar)`. The solve is by conjugate gradients, with products by central
/// differences of `J`'s gradient; the last term is one more. Neither takes longer with more parameters. The expected
/// cost itself needs neither, as `g` = 0.
///
/// # Errors
/// If the plan is not a strict local minimum of the expected cost, or the solve does not converge.
pub(crate) fn belief_plan_gradient(
    TaskAt { task, phi }: TaskAt,
    plan: &Plan,
    quantity: Quantity,
    memory: &mut Memory,
    scratch: &mut Scratch,
    out: &mut Vec<f64>,
) -> Result<(), Error> {
    memory.set_curvature(plan.curvature);
    let Memory { centre, trial, hessian, gradient } = memory;
    centre.plan.trajectory.clone_from(&plan.trajectory);
    centre.plan.nominal_cost = plan.nominal_cost;
    centre.assess(task, phi, scratch)?;
    hessian.prepare(task.at(phi), centre, &plan.costates, 0.0, scratch)?;
    let mut slope = vec![0.0; task.steps * task.system.dimensions().controls];
    let feedback: Matrices = hessian.law.feedback.clone();
    let along = centre.gradient(task, phi);
    slope_by_controls(&along, quantity, Some(&feedback), gradient, scratch, &mut slope, Some(&mut *out));
    // The plan minimises the expected cost, so the cost has no first-order change with the controls.
    if quantity == Quantity::EXPECTED_COST || slope.iter().all(|&slope| slope == 0.0) {
        return Ok(());
    }
    let mut around = Around { task, phi, centre, trial, gradient, scratch };
    let mut found = Found::default();
    match hessian.solve(&slope, Goal::free(RESIDUAL, PRODUCTS), &mut around, &mut found)? {
        Solved::Converged | Solved::Border => {}
        Solved::NegativeCurvature => {
            return Err(Error::not_definite("the Hessian of the expected cost", 0));
        }
        Solved::MaxProducts => {
            return Err(Error::Planning {
                plan: "belief",
                problem: format!("has no gradient here: its linear solve did not converge in {PRODUCTS} products"),
                advice: "use the gradient `frozen`",
            });
        }
    }
    let w = found.x;
    if rows::dot(&w, &w) == 0.0 {
        return Ok(());
    }
    let moved = hessian.difference(&w, &mut around, |hessian, around| {
        let (mut slope, mut by_parameters) = (vec![0.0; w.len()], Vec::new());
        let Around { task, phi, trial, gradient, scratch, .. } = around;
        let (task, feedback, cost) = (trial.gradient(task, phi), Some(&hessian.law.feedback), Quantity::EXPECTED_COST);
        slope_by_controls(&task, cost, feedback, gradient, scratch, &mut slope, Some(&mut by_parameters));
        by_parameters
    })?;
    out.iter_mut().zip(&moved).for_each(|(out, moved)| *out -= moved);
    Ok(())
}
