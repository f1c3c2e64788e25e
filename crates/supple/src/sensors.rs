//! Sensors of tasks whose plans are made: candidates, and [`Selection`] of the best sets of them (theory, section N).

use supple_lqg::Noise;

pub use supple_lqg::sensors::{
    Candidate, Chosen, Goal, Limits, Plant, Relaxation, Rule, Searched, Selection, Worth, join_correlated,
};

use crate::Error;
use crate::candidates::best_plan;
use crate::evaluation::PlanCheck;
use crate::pipeline::TaskState;
use crate::problem::{Problem, Task};

/// Candidates along plans.
///
/// Example: [`select`].
#[derive(Clone, Debug)]
pub struct Selected {
    /// The candidates, to choose from.
    pub selection: Selection,
    /// What speaks against the plan of each task.
    pub plans: Vec<PlanCheck>,
}

/// Candidates for the tasks of a problem, whose measurements must include all of them, at the design `phi`. Measurements
/// that belong to no candidate are always made. With a task's name, only that task is considered.
///
/// A plan that takes noise into account is made with all candidates, and kept.
///
/// ```
/// use supple::sensors::{Goal, Limits, Selected, every_measurement, select};
/// # let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tasks/two_mass.toml");
/// let problem = supple_file::load(file)?;
/// let phi = problem.parameters.initial();
/// let Selected { selection, plans } = select(&problem, &phi, every_measurement(&problem, &phi)?, None)?;
/// assert!(plans[0].is_passed());
/// let one = Limits { count: Some(1), ..Limits::default() };
/// let best = selection.exhaustive(Goal::LeastCost, one, &mut || true)?;
/// assert_eq!(selection.candidates[best.sensors[0]].name, "position of m1");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// Where `phi` has the wrong length, no task has that name, a plan or covariance cannot be computed, or candidates share
/// noise.
pub fn select(
    problem: &Problem,
    phi: &[f64],
    candidates: Vec<Candidate>,
    task: Option<&str>,
) -> Result<Selected, Error> {
    problem.check_design(phi)?;
    let chosen: Vec<&Task> = problem.tasks.iter().filter(|one| task.is_none_or(|name| one.name == name)).collect();
    if chosen.is_empty() {
        let names: Vec<&str> = problem.tasks.iter().map(|task| task.name.as_str()).collect();
        let valid = supple_text::quoted(&names);
        return Err(Error::Unknown { what: "task", name: task.unwrap_or_default().to_owned(), valid });
    }
    let planned = chosen.iter().map(|task| {
        let mut state = TaskState::new(task);
        best_plan(problem, task, phi, None, &mut state)?;
        Ok(state)
    });
    let planned = planned.collect::<Result<Vec<_>, Error>>()?;
    let both = chosen.iter().zip(&planned);
    let plans = both.map(|(task, state)| PlanCheck::of(problem, task, phi, state, 1.0)).collect::<Result<_, _>>()?;
    // Tasks are weighed against one another only.
    let is_alone = chosen.len() == 1;
    let plants = chosen.iter().zip(&planned).map(|(task, state)| Plant {
        knots: &state.plan.knots,
        noise: &state.noise,
        value: &state.plan.policy.value_of_information,
        fixed: state.cost.nominal + state.cost.process + state.cost.initial,
        weight: if is_alone { 1.0 } else { task.information_weight },
    });
    Ok(Selected { selection: Selection::new(candidates, &plants.collect::<Vec<_>>())?, plans })
}

/// Every measurement of a problem as a candidate, without prices; measurements whose noise is correlated together.
///
/// # Errors
/// Where `phi` has the wrong length, or a covariance cannot be computed.
///
/// Example: [`select`].
pub fn every_measurement(problem: &Problem, phi: &[f64]) -> Result<Vec<Candidate>, Error> {
    problem.check_design(phi)?;
    let Some(first) = problem.tasks.first() else { return Ok(Vec::new()) };
    let size = first.system.dimensions();
    let mut noise = Noise::zeros(size.states, size.measurements);
    let mut candidates: Vec<Candidate> = Vec::new();
    for (row, channel) in first.system.channels().measurements.into_iter().enumerate() {
        candidates.push(Candidate { name: channel.name, price: 0.0, rows: vec![row] });
    }
    for task in &problem.tasks {
        task.noise.resolve(phi, &mut noise)?;
        join_correlated(&mut candidates, &noise.measurement);
    }
    Ok(candidates)
}
