//! Where searches start that are given no controls.

use supple_kernels::{Matrices, Scratch, math};
use supple_lqg::Regularisation;
use supple_model::Trajectory;
use supple_model::system::{Curvature, RollOut};

use super::sweeps::{roll_out, sweep};
use super::{NominalProblem, Plan, PlanWorkspace};
use crate::Error;
use crate::knots::Linearise as _;

/// Adds cosine half waves, or a constant for none, of an amplitude to a control over the steps.
pub(crate) fn add_wave(controls: &mut Matrices, control: usize, waves: usize, amplitude: f64) {
    let steps = controls.count();
    for t in 0..steps {
        let angle = std::f64::consts::PI * waves as f64 * (t as f64 + 0.5) / steps as f64;
        controls.vector_mut(t)[control] += amplitude * math::cos(angle);
    }
}

/// Shares of the feedforward that are tried: with 0, feedback alone keeps the system where it is.
const SHARES: [f64; 5] = [1.0, 0.5, 0.25, 0.1, 0.0];

/// Cost and controls of the cheapest of some motions from the first state (theory, equation P.3b): under constant controls, which
/// are given in the plan's trajectory and hold the first state as well as they can; without controls; and under the control
/// law of the linear-quadratic problem about the first state, as if it were held there.
///
/// Constant controls do not hold a system with fewer drives than joints, or with springs that are not in equilibrium: they
/// set it whirling, and the search ends in a local minimum of such motions. The law keeps it near its first state.
pub(crate) fn first_guess(
    problem: NominalProblem,
    plan: &mut Plan,
    work: &mut PlanWorkspace,
    scratch: &mut Scratch,
) -> (f64, Matrices) {
    let NominalProblem { system, phi, bounds } = problem;
    let mut least = if roll_out(problem, plan, scratch).is_ok() { plan.nominal_cost } else { f64::INFINITY };
    let mut best = plan.trajectory.controls.clone();
    let mut compare = |cost: f64, candidate: &Trajectory| {
        if cost < least {
            (least, best) = (cost, candidate.controls.clone());
        }
    };
    let candidate = &mut work.candidate;
    candidate.states.vector_mut(0).copy_from_slice(plan.trajectory.states.vector(0));
    candidate.controls.clear();
    if let Some(bounds) = bounds {
        bounds.clamp_all(&mut candidate.controls);
    }
    let cost = system.roll_out(RollOut::Controls, phi, candidate, scratch);
    compare(cost, candidate);
    by_law(problem, plan, candidate, scratch, compare);
    (least, best)
}

/// Rolls out the controls in the plan's trajectory; if their cost overflows, as that of an unstable system does over a long
/// horizon, with the law of the linear-quadratic problem about the first state added to them. Keeps the cheapest motion.
///
/// # Errors
/// If the cost of all of these is not finite.
pub(super) fn start_fed_back(
    problem: NominalProblem,
    plan: &mut Plan,
    work: &mut PlanWorkspace,
    scratch: &mut Scratch,
) -> Result<(), Error> {
    if roll_out(problem, plan, scratch).is_ok() {
        return Ok(());
    }
    let mut best: Option<(f64, Trajectory)> = None;
    work.candidate.states.vector_mut(0).copy_from_slice(plan.trajectory.states.vector(0));
    by_law(problem, plan, &mut work.candidate, scratch, |cost, candidate| {
        if cost.is_finite() && best.as_ref().is_none_or(|(least, _)| cost < *least) {
            best = Some((cost, candidate.clone()));
        }
    });
    plan.policy.feedback.as_mut_slice().fill(0.0);
    let found = best.ok_or(Error::NotFinite { what: "the cost of the first guess" })?;
    (plan.nominal_cost, plan.trajectory) = found;
    Ok(())
}

/// Shows costs and trajectories of some shares of the law of the linear-quadratic problem about the first state, as if it were
/// held there by the controls in the plan's trajectory. `candidate` starts from that state.
fn by_law(
    problem: NominalProblem,
    plan: &mut Plan,
    candidate: &mut Trajectory,
    scratch: &mut Scratch,
    mut show: impl FnMut(f64, &Trajectory),
) {
    let NominalProblem { system, phi, bounds } = problem;
    let first = plan.trajectory.states.vector(0).to_vec();
    for t in 1..=plan.trajectory.steps() {
        plan.trajectory.states.vector_mut(t).copy_from_slice(&first);
    }
    plan.knots.linearise_plan(system, plan.trajectory.points(), phi, Curvature::GaussNewton, scratch);
    if plan.knots.check_finite().is_ok() && sweep(problem, Regularisation::default(), None, plan).is_ok() {
        for step in SHARES {
            let law = RollOut::Law { reference: &plan.trajectory, policy: &plan.policy, step, bounds };
            let cost = system.roll_out(law, phi, candidate, scratch);
            show(cost, candidate);
        }
    }
}
