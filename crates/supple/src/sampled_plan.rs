use supple_kernels::Scratch;
use supple_lqg::Noise;
use supple_model::Trajectory;
use supple_model::system::Curvature;

use crate::Error;
use crate::plan::{Plan, PlanMode, PlanSettings, PlanStatus, finish, linearise, roll_out, sweep};
use crate::problem::{Task, TaskAt};
use crate::simulate::{ClosedLoop, LoopSetting, NoiseFactors, Record, Truth, World};

/// Finds a plan as the paper does (theory, equation P.6): each iteration rolls out once with noise and an extended
/// Kalman filter in the loop, and moves the reference by the share alpha towards estimates and controls of that run:
///
/// ```text
/// xbar <- alpha mu + (1 - alpha) xbar      ubar <- alpha u + (1 - alpha) ubar
/// ```
///
/// `noise` is the noise at `phi`, except for parts that vary with the state: runs evaluate these at their own states.
///
/// Iteration i draws from stream i of the seed. The reference ends as an average of noisy runs: close to a local
/// optimum, never stationary to a tight tolerance.
///
/// # Errors
/// Where something is not finite or a covariance is indefinite.
pub(crate) fn plan_sampled(
    TaskAt { task, phi }: TaskAt,
    noise: &Noise,
    settings: &PlanSettings,
    plan: &mut Plan,
    scratch: &mut Scratch,
) -> Result<(), Error> {
    let problem = task.nominal(phi);
    let sampled = &settings.sampled;
    roll_out(problem, plan, scratch)?;
    let factors = NoiseFactors::of(noise)?;
    let size = task.system.dimensions();
    let mut closed = ClosedLoop::new(size, 1);
    let mut record = Record::new(size, task.steps);
    let mut mu: f64 = 0.0;
    let mut status = PlanStatus::MaxIterations;
    while plan.iterations < sampled.iterations {
        linearise(problem, plan, Curvature::GaussNewton, scratch);
        plan.iterations += 1;
        let regularisation = settings.regularisation.of(mu);
        if sweep(problem, regularisation, None, plan).is_err() {
            plan.regularised += 1;
            mu = (10.0 * mu).max(1e-9);
            if mu > 1e12 {
                status = PlanStatus::Indefinite;
                break;
            }
            continue;
        }
        mu *= 0.5;
        let truth = Truth::of(task, phi);
        let setting = LoopSetting {
            task,
            plan,
            believed: World { phi, noise },
            truth,
            factors: &factors,
            along: None,
            watch: None,
        };
        closed.run(setting, sampled.seed, plan.iterations as u64, Some(&mut record))?;
        let change = average(&mut plan.trajectory, &record.run, sampled.averaging);
        if !change.is_finite() {
            return Err(Error::NotFinite { what: "the reference trajectory" });
        }
        if change <= sampled.tolerance {
            status = PlanStatus::Converged;
            break;
        }
    }
    plan.nominal_cost = cost_of(task, phi, &plan.trajectory, scratch);
    finish(problem, settings.curvature, plan, status, scratch)?;
    plan.mode = PlanMode::Sampled;
    Ok(())
}

/// Moves the reference by a fraction towards a run; returns the relative change of the controls (root mean square).
fn average(reference: &mut Trajectory, run: &Trajectory, share: f64) -> f64 {
    let (mut moved, mut size) = (0.0, 0.0);
    for (ubar, u) in reference.controls.as_mut_slice().iter_mut().zip(run.controls.as_slice()) {
        let step = share * (u - *ubar);
        *ubar += step;
        moved += step * step;
        size += *ubar * *ubar;
    }
    for (xbar, x) in reference.states.as_mut_slice().iter_mut().zip(run.states.as_slice()) {
        *xbar += share * (x - *xbar);
    }
    (moved / size.max(1e-300)).sqrt()
}

/// The cost of the reference itself, which need not obey the dynamics.
fn cost_of(task: &Task, phi: &[f64], reference: &Trajectory, scratch: &mut Scratch) -> f64 {
    let mut stages = vec![0.0; task.steps];
    task.system.stage_costs(reference.points(), phi, &mut stages, scratch);
    stages.iter().sum::<f64>() + task.system.final_cost(reference.states.vector(task.steps), phi, scratch)
}
