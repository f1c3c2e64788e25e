//! Stationary tasks: linear time-invariant systems and the information per step of their sensors.

use std::ops::Range;

use supple_kernels::math;
use supple_kernels::{Matrices, Scratch};
use supple_lqg::bound::{Stationary, regulator_distance};
use supple_lqg::dense::{Dense, dense, first};

use crate::Error;
use crate::pipeline::TaskState;
use crate::problem::Task;

/// Values of a linear model may differ from `A x + B u` by this, relatively, because of rounding.
const ROUNDING: f64 = 1e-9;

/// The stationary problem of a task with known plan and noise, and how far its cost is from one for which the
/// regulator is exactly optimal.
///
/// # Errors
/// If the system varies over time or is not linear, its cost is not `1/2 z' L z` with `z = (x, u)`, or no regulator
/// keeps the cost finite.
pub(super) fn stationary(
    task: &Task,
    phi: &[f64],
    state: &TaskState,
) -> Result<(Stationary, Result<f64, String>), Error> {
    let (knots, noise) = (&state.plan.knots, &state.noise);
    let (n, joint) = (knots.dimensions.states, knots.dimensions.joint());
    let (stages, all) = (0..task.steps, 0..=task.steps);
    let all = *all.start()..all.end() + 1;
    let changes = [
        ("its dynamics differ from step to step", &knots.dynamics, stages.clone(), joint),
        ("its process noise differs from step to step", &noise.process, stages.clone(), n),
        ("the curvature of its costs differs from step to step", &knots.cost, stages, joint),
        ("its sensors differ from step to step", &knots.measurement, all.clone(), n),
        ("the noise of its sensors differs from step to step", &noise.measurement, all, noise.measurement.cols()),
    ];
    let change = changes.into_iter().find(|(_, matrices, range, cols)| !is_same(matrices, range.clone(), *cols));
    let other = "its model is not `A x + B u`, or its costs are not `x'Qx + u'Ru`";
    let what = change.map(|(what, ..)| what).or_else(|| (!is_quadratic(task, phi, state)).then_some(other));
    if let Some(what) = what {
        return Err(Error::no_bound(
            format!("task `{}` has no steady state: {what}", task.name),
            "compute the bounds over its horizon instead, without `stationary`; steady-state bounds require a linear time-invariant model with cost `x'Qx + u'Ru`",
        ));
    }
    let (dynamics, cost) = (first(&knots.dynamics, n, joint), first(&knots.cost, joint, joint));
    let system = Stationary::new(&dynamics, &first(&noise.process, n, n), &cost)?;
    let distance = regulator_distance(&system, &dynamics, &cost).map_err(|unproved| unproved.reason);
    Error::check_stop()?;
    Ok((system, distance))
}

/// Whether the first `cols` columns, and at most `cols` rows, are the same at every step.
fn is_same(matrices: &Matrices, range: Range<usize>, cols: usize) -> bool {
    let rows = if matrices.rows() > cols { cols } else { matrices.rows() };
    let scale = |i: usize, j: usize| matrices.get(0, i, j).abs();
    matrices.is_constant()
        || range.into_iter().all(|t| {
            let mut entries = (0..rows).flat_map(|i| (0..cols).map(move |j| (i, j)));
            entries.all(|(i, j)| (matrices.get(t, i, j) - matrices.get(0, i, j)).abs() <= ROUNDING * scale(i, j))
        })
}

/// Whether the model is `A x + B u` and the stage cost `1/2 z' L z`, judged by their values at small and large points.
fn is_quadratic(task: &Task, phi: &[f64], state: &TaskState) -> bool {
    let knots = &state.plan.knots;
    let (n, joint) = (knots.dimensions.states, knots.dimensions.joint());
    let (f, l) = (dense(&knots.dynamics, 0), dense(&knots.cost, 0).view((0, 0), (joint, joint)).into_owned());
    let mut scratch = Scratch::new();
    [0.0, 1e-2, 1.0, 30.0].into_iter().all(|size| {
        let z = Dense::from_fn(joint, 1, |i, _| size * math::sin(1.7 * (i as f64 + 1.0) + size));
        let (x, u) = z.as_slice().split_at(n);
        let mut next = vec![0.0; n];
        task.system.step(0, x, u, phi, &mut next);
        let cost = task.system.stage_cost(0, x, u, phi, &mut scratch);
        let (linear, quadratic) = (&f * &z, 0.5 * (z.transpose() * &l * &z)[(0, 0)]);
        let sizes = f.abs() * z.abs();
        let bulk = 0.5 * (z.abs().transpose() * l.abs() * z.abs())[(0, 0)];
        let close = |found: f64, expected: f64, bulk: f64| (found - expected).abs() <= ROUNDING * bulk;
        (0..n).all(|i| close(next[i], linear[i], sizes[i])) && close(cost, quadratic, bulk)
    })
}
