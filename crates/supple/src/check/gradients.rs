use supple_kernels::Scratch;

use super::compare::{Row, Worst, derivative};
use crate::Error;
use crate::belief::{Belief, kalman};
use crate::gradient::{FrozenGradient, Functional};
use crate::information::{Information, information};
use crate::knots::Knots;
use crate::noise::Noise;
use crate::pipeline::TaskState;
use crate::problem::{Problem, Task};
use crate::system::Curvature;

const TOLERANCE: f64 = 1e-5;

/// Frozen and total gradients of a task, at the plan in `state`.
pub(super) fn rows(problem: &Problem, task: &Task, phi: &[f64], state: &mut TaskState) -> Result<Vec<Row>, Error> {
    if phi.is_empty() {
        return Ok(Vec::new());
    }
    let mut rows = frozen(problem, task, phi, state)?;
    if state.plan.mode.has_total_gradient() {
        rows.extend(total(problem, task, phi, state)?);
    }
    Ok(rows)
}

fn worst(problem: &Problem, analytic: &[f64], numeric: impl Fn(usize) -> f64) -> Worst {
    let mut worst = Worst::new();
    for (index, parameter) in problem.parameters.iter().enumerate() {
        worst.add(analytic[index], numeric(index), || parameter.name.clone());
    }
    worst
}

/// A step for a parameter that stays within its bounds' order of magnitude.
fn step(problem: &Problem, phi: &[f64], index: usize) -> f64 {
    let [lower, upper] = problem.parameters.get(index).bounds;
    1e-4 * phi[index].abs().max(1e-3 * (upper - lower))
}

/// With trajectory, gains and value of information held fixed.
fn frozen(problem: &Problem, task: &Task, phi: &[f64], state: &mut TaskState) -> Result<Vec<Row>, Error> {
    let mut analytic = FrozenGradient::default();
    state.frozen_gradient(task, phi, &mut analytic);
    let size = task.system.dimensions();
    let mut scratch = Scratch::new();
    let mut at = |phi: &[f64]| -> Result<Vec<f64>, Error> {
        let mut noise = Noise::zeros(size.states, size.measurements);
        task.noise.resolve_along(phi, &state.plan.trajectory.states, &mut noise)?;
        let mut knots = Knots::zeros(size, task.steps);
        let points = state.plan.trajectory.points();
        knots.linearise_plan(&*task.system, points, phi, Curvature::Exact, &mut scratch);
        knots.linearise_measurement(&*task.system, points, phi, &mut scratch);
        let mut belief = Belief::zeros(size.states, size.measurements, task.steps);
        kalman(&knots, &noise, &mut belief)?;
        let mut found = Information::default();
        information(&belief, &noise, &mut found)?;
        let xi = &state.plan.policy.value_of_information;
        let traces =
            (0..task.steps).map(|t| xi.at(t).iter().zip(belief.corrected.at(t)).map(|(a, b)| a * b).sum::<f64>());
        Ok(vec![found.total, 0.5 * traces.sum::<f64>()])
    };
    let numeric = differences(problem, phi, &mut at)?;
    Ok(vec![
        worst(problem, &analytic.information, |i| numeric[i][0]).row("frozen gradient, information", TOLERANCE),
        worst(problem, &analytic.belief_cost, |i| numeric[i][1]).row("frozen gradient, belief cost", TOLERANCE),
    ])
}

/// A function of all parameters with several values.
type Function<'a> = dyn FnMut(&[f64]) -> Result<Vec<f64>, Error> + 'a;

/// Extrapolated central differences of several values by every parameter.
fn differences(problem: &Problem, phi: &[f64], at: &mut Function) -> Result<Vec<Vec<f64>>, Error> {
    let mut failed = None;
    let all = (0..phi.len()).map(|index| {
        derivative(step(problem, phi, index), |h| {
            let mut phi = phi.to_vec();
            phi[index] += h;
            at(&phi).unwrap_or_else(|error| {
                failed.get_or_insert(error);
                Vec::new()
            })
        })
    });
    let all = all.collect();
    failed.map_or(Ok(all), Err)
}

/// With everything moving: the problem is solved again at every step, from the same plan.
fn total(problem: &Problem, task: &Task, phi: &[f64], state: &mut TaskState) -> Result<Vec<Row>, Error> {
    let named = [
        ("information", Some(Functional::INFORMATION)),
        ("belief cost", Some(Functional::BELIEF)),
        ("process cost", Some(Functional::PROCESS)),
        ("initial cost", Some(Functional::INITIAL)),
        ("nominal cost", None),
    ];
    let mut analytic = Vec::new();
    for (_, functional) in named {
        let mut out = Vec::new();
        match functional {
            Some(functional) => state.total_gradient(task, phi, functional, &mut out)?,
            None => state.nominal_gradient(task, phi, &mut out)?,
        }
        analytic.push(out);
    }
    let controls = state.plan.trajectory.controls.clone();
    let mut again = TaskState::new(task);
    let mut at = |phi: &[f64]| -> Result<Vec<f64>, Error> {
        again.evaluate(task, phi, &problem.planning, Some(&controls))?;
        let cost = &again.cost;
        Ok(vec![again.information.total, cost.belief, cost.process, cost.initial, cost.nominal])
    };
    let numeric = differences(problem, phi, &mut at)?;
    let rows = named.iter().zip(&analytic).enumerate().map(|(part, ((name, _), analytic))| {
        worst(problem, analytic, |i| numeric[i][part]).row(format!("total gradient, {name}"), TOLERANCE)
    });
    Ok(rows.collect())
}
