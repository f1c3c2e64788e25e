//! Local minima of the nominal problem: contact makes many, one for each order of bounces.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use rayon::prelude::*;
use supple_kernels::Matrices;

use super::visit::{Failed, Scaling, continue_plan};
use crate::pipeline::TaskState;
use crate::problem::{Problem, Task};
use crate::stability::explain;
use crate::{Error, Value};

/// Factors by which a constant first guess is scaled to find the plan of least cost.
const GUESS_FACTORS: [f64; 5] = [1.0, 1.4, 2.0, 2.8, 4.0];

/// Plans a task from its first guess, and where that is one constant row, from multiples of it too; keeps the
/// converged plan of least nominal cost. Leaves it in `state`, with the iterations of all of them.
///
/// # Errors
/// Where no guess leads to a finite plan.
pub(crate) fn best_of_guesses(problem: &Problem, task: &Task, phi: &[f64], state: &mut TaskState) -> Result<(), Error> {
    best_plan((problem, task), phi, None, state)
}

/// Plans and assesses a task at a design as [`Problem::evaluate`] does, from its first guess, and where that is one
/// constant row, from multiples of it too; and from the controls of a `neighbour` where they are given, such as those
/// of the plan at a design nearby. Keeps the converged plan of least nominal cost; that from the neighbour only where
/// it is on another, cheaper branch, so that rounding does not decide. Leaves it in `state`, with the iterations of all.
///
/// # Errors
/// Where nothing leads to a finite plan, or a covariance is indefinite.
pub fn best_plan(
    (problem, task): (&Problem, &Task),
    phi: &[f64],
    neighbour: Option<&Matrices>,
    state: &mut TaskState,
) -> Result<(), Error> {
    let is_zero = |row: &Vec<Value>| row.iter().all(|value| value.is_zero());
    let constant = task.initial_control.len() == 1 && task.steps > 1 && !is_zero(&task.initial_control[0]);
    let factors = if constant { &GUESS_FACTORS[..] } else { &GUESS_FACTORS[..1] };
    let guesses = factors.iter().map(|&factor| (task.guess(phi, factor), 0.0));
    let mut best: Option<(bool, f64, Matrices)> = None;
    let mut first_error = None;
    let mut iterations = 0;
    for (guess, margin) in guesses.chain(neighbour.map(|controls| (controls.clone(), SAME_BRANCH))) {
        if let Err(error) = state.plan_only(task, phi, &problem.planning, Some(&guess)) {
            first_error.get_or_insert(error);
            continue;
        }
        iterations += state.plan.iterations;
        let found = (!state.plan.status.is_converged(), state.plan.objective);
        let better = |(unconverged, cost, _): &(bool, f64, Matrices)| {
            (found.0, found.1 + margin * (1.0 + cost.abs())) < (*unconverged, *cost)
        };
        if best.as_ref().is_none_or(better) {
            best = Some((found.0, found.1, state.plan.trajectory.controls.clone()));
        }
    }
    match (best, first_error) {
        (Some((.., controls)), _) => {
            let planned = state.plan_only(task, phi, &problem.planning, Some(&controls));
            state.plan.iterations += iterations;
            let assessed = planned.and_then(|()| state.assess(task, phi));
            assessed.map_err(|error| explain(task, phi, error, &state.plan.trajectory))
        }
        (None, Some(error)) => Err(explain(task, phi, error, &state.plan.trajectory)),
        (None, None) => Err(Error::NotFinite { what: "the first guess", step: 0 }),
    }
}

/// Plans a task at a design: from given controls, or else from the best of its first guesses; then, with attempts to
/// find other local minima, on the cheapest branch seen. Returns how many were seen, where they were searched for.
///
/// # Errors
/// Where no guess leads to a finite plan.
pub fn plan_at(
    (problem, task): (&Problem, &Task),
    phi: &[f64],
    controls: Option<&Matrices>,
    (seed, attempts): (u64, usize),
    state: &mut TaskState,
) -> Result<Option<usize>, Error> {
    match controls {
        Some(controls) => {
            let planned = state.evaluate(task, phi, &problem.planning, Some(controls));
            planned.map_err(|error| explain(task, phi, error, &state.plan.trajectory))?;
        }
        None => best_of_guesses(problem, task, phi, state)?,
    }
    if attempts == 0 {
        return Ok(None);
    }
    let given = (&state.plan.trajectory.controls, state.cost.expected());
    let found = search_branches((problem, task), phi, given, (seed, attempts));
    state.evaluate(task, phi, &problem.planning, Some(&found.controls))?;
    Ok(Some(found.count))
}

/// What a branch search found for one task.
pub(crate) struct Branches {
    /// How many different local minima were seen, the given one included.
    pub count: usize,
    /// Controls of the one with the least expected cost.
    pub controls: Matrices,
    /// Its expected cost.
    pub cost: f64,
}

/// Searches for other local minima of a task's nominal problem at a design, by continuation: plans at random designs
/// from random multiples of the first guess, each continued to the design in small steps. Deterministic in the seed,
/// whatever the number of threads.
pub(crate) fn search_branches(
    (problem, task): (&Problem, &Task),
    phi: &[f64],
    given: (&Matrices, f64),
    (seed, attempts): (u64, usize),
) -> Branches {
    let scaling = Scaling::of(&problem.parameters);
    let found: Vec<Option<(f64, Matrices)>> = (0..attempts)
        .into_par_iter()
        .map_init(
            || TaskState::new(task),
            |state, attempt| {
                let mut random = ChaCha8Rng::seed_from_u64(seed);
                random.set_stream(attempt as u64 + 1);
                attempt_branch((problem, task), &scaling, phi, &mut random, state).ok().flatten()
            },
        )
        .collect();
    let mut branches = Branches { count: 1, controls: given.0.clone(), cost: given.1 };
    let mut seen = vec![given.1];
    for (cost, controls) in found.into_iter().flatten() {
        if seen.iter().all(|other: &f64| (cost - other).abs() > SAME_BRANCH * (1.0 + other.abs())) {
            seen.push(cost);
        }
        if cost < branches.cost - SAME_BRANCH * (1.0 + branches.cost.abs()) {
            branches.controls = controls;
            branches.cost = cost;
        }
    }
    branches.count = seen.len();
    branches
}

/// Costs closer than this, relatively, belong to one branch.
const SAME_BRANCH: f64 = 1e-7;

/// A number in [0, 1).
pub(crate) fn uniform(random: &mut ChaCha8Rng) -> f64 {
    (random.next_u64() >> 11) as f64 / (1u64 << 53) as f64
}

fn attempt_branch(
    (problem, task): (&Problem, &Task),
    scaling: &Scaling,
    phi: &[f64],
    random: &mut ChaCha8Rng,
    state: &mut TaskState,
) -> Result<Option<(f64, Matrices)>, Error> {
    // A design within a third of the box around this one, in scaled coordinates.
    let source: Vec<f64> =
        scaling.scaled(phi).iter().map(|s| (s + (uniform(random) - 0.5) * 2.0 / 3.0).clamp(0.0, 1.0)).collect();
    let source = scaling.unscaled(phi, &source);
    let factor = (uniform(random) * 1.8).exp();
    let guess = task.guess(&source, factor);
    state.plan_only(task, &source, &problem.planning, Some(&guess))?;
    let controls = state.plan.trajectory.controls.clone();
    continue_plan((problem, task), scaling, (&source, phi), (&controls, 1), state).map_err(Failed::error)?;
    let converged = state.plan.status.is_converged();
    Ok(converged.then(|| (state.cost.expected(), state.plan.trajectory.controls.clone())))
}
