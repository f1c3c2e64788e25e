use supple::Stop;
use supple::aims::weighted_information;
use supple::design::{Attempts, Control, InformationWeights, best_plan, cheapest_of, design, plan_at};
use supple::pipeline::TaskState;
use supple::simulate::{Rollouts, monte_carlo};
use supple::{
    Error, Matrices, ParameterHandle, Problem, Task, Trajectory, contact_reports, meets, misses_contact,
    number_warnings,
};

use super::grid::Grid;
use super::options::SweepOptions;
use crate::{Cell, LoadedTask, StudyError};

/// Controls of the last plan of each task in a segment, to continue from; none before the first one.
pub(super) type Neighbour = Vec<Option<Matrices>>;

/// What there is to evaluate at every point.
pub(super) struct Study {
    /// The problem, with the parameters on axes held.
    pub problem: Problem,
    /// All parameters, as set.
    pub phi: Vec<f64>,
    pub options: SweepOptions,
    pub grid: Grid,
}

impl Study {
    /// # Errors
    /// Where something is wrong with the grid, or there is nothing to design.
    pub fn new(task: &LoadedTask, options: &SweepOptions) -> Result<Self, StudyError> {
        let grid = Grid::new(task, options)?;
        let problem = if options.starts > 0 { held(task, &grid)? } else { task.problem.clone() };
        Ok(Self { problem, phi: task.phi.clone(), options: options.clone(), grid })
    }
}

/// The problem with the parameters on axes held, for design searches.
fn held(task: &LoadedTask, grid: &Grid) -> Result<Problem, StudyError> {
    let on_axes = grid.indices.iter().copied().map(ParameterHandle::at);
    let problem = Problem { parameters: task.problem.parameters.held(on_axes), ..task.problem.clone() };
    if problem.parameters.design().is_empty() {
        let message =
            "there is nothing to design: every parameter with role = \"design\" is on an axis; leave --starts out";
        return Err(StudyError::usage(message));
    }
    Ok(problem)
}

/// Evaluates one point after the other.
pub(super) struct Evaluator<'a> {
    study: &'a Study,
    stop: Stop<'a>,
    states: Vec<TaskState>,
}

/// One task at a point.
struct Outcome {
    cells: Vec<Cell>,
    nats: f64,
    /// What a design minimises, nats; `None` if that is the information measured, or was not found.
    minimised: Option<f64>,
    feasible: bool,
    /// Why its numbers cannot be trusted.
    trouble: Option<String>,
}

impl<'a> Evaluator<'a> {
    pub fn new(study: &'a Study, stop: Stop<'a>) -> Self {
        Self { study, stop, states: study.problem.tasks.iter().map(TaskState::new).collect() }
    }

    /// Whether it is to stop.
    pub fn is_stopped(&self) -> bool {
        self.stop.is_requested()
    }

    /// What it evaluates.
    pub fn study(&self) -> &'a Study {
        self.study
    }

    /// The row of a point. It depends on nothing but the point and its neighbour, which becomes that of the next one.
    pub fn evaluate(&mut self, point: usize, neighbour: &mut Neighbour) -> Vec<Cell> {
        let Study { problem, phi, options, grid } = self.study;
        let mut phi = phi.to_vec();
        grid.write_point(point, &mut phi);
        let mut failure = None;
        let mut designed = [Cell::Missing, Cell::Missing];
        let mut outcomes: Vec<Option<Outcome>> = problem.tasks.iter().map(|_| None).collect();
        let found = if options.starts > 0 { Some(self.design(&mut phi, neighbour)) } else { None };
        match found.transpose() {
            Err(error) => failure = Some(error.to_string()),
            Ok(cells) => {
                designed = cells.unwrap_or(designed);
                for (i, task) in problem.tasks.iter().enumerate() {
                    let (neighbour, state) = (&mut neighbour[i], &mut self.states[i]);
                    match evaluate_task(problem, task, &phi, options, neighbour, state) {
                        Ok(mut outcome) => {
                            failure = failure.or(outcome.trouble.take());
                            outcomes[i] = Some(outcome);
                        }
                        Err(error) => {
                            failure.get_or_insert_with(|| message(task, &error));
                        }
                    }
                }
            }
        }
        let mut row: Vec<Cell> = phi.iter().map(|&value| Cell::number(value)).collect();
        row.extend(overall(problem, &outcomes));
        if options.starts > 0 {
            row.extend(designed);
        }
        for (outcome, task) in outcomes.into_iter().zip(&problem.tasks) {
            row.extend(
                outcome.map_or_else(|| vec![Cell::Missing; task_columns(task, options)], |outcome| outcome.cells),
            );
        }
        row.push(failure.map_or(Cell::Missing, Cell::Text));
        row
    }

    /// Optimises the parameters that are not on an axis, and stores the plans found as `neighbour`.
    fn design(&self, phi: &mut Vec<f64>, neighbour: &mut Neighbour) -> Result<[Cell; 2], Error> {
        let Study { problem, options, .. } = self.study;
        let mut settings = problem.design.clone();
        (settings.starts, settings.seed) = (options.starts, options.seed);
        let found = design(problem, phi, &settings, Control { stop: self.stop, ..Control::default() })?;
        let best = found.found();
        phi.clone_from(&best.to);
        *neighbour = best.controls.iter().cloned().map(Some).collect();
        Ok([Cell::Text(found.status.to_string()), Cell::number(found.evaluations as f64)])
    }
}

/// How many columns a task has.
fn task_columns(task: &Task, options: &SweepOptions) -> usize {
    let of_contacts = match task.system.contacts().len() {
        0 => 0,
        contacts => 2 * contacts + 1,
    };
    of_contacts + if options.rollouts > 0 { 8 } else { 6 }
}

/// What a plan touches: of every contact the share of time and the greatest force, and whether a contact is missed from
/// which a cost wants a force.
fn of_contacts(task: &Task, phi: &[f64], trajectory: &Trajectory) -> Vec<Cell> {
    let reports = contact_reports(task, phi, trajectory);
    let missed = f64::from(u8::from(misses_contact(task, phi, trajectory)));
    let numbers = reports.iter().flat_map(|report| [report.share_of_time, report.peak_force]);
    numbers.chain((!reports.is_empty()).then_some(missed)).map(Cell::number).collect()
}

/// Information in nats and bits, whether every bound is met, and what a design minimises where that is another
/// information; nothing where a task could not be evaluated.
fn overall(problem: &Problem, outcomes: &[Option<Outcome>]) -> Vec<Cell> {
    let has_aim = problem.design.information != InformationWeights::MEASURED;
    let (mut nats, mut minimised) = (0.0, Some(0.0));
    for (outcome, task) in outcomes.iter().zip(&problem.tasks) {
        match outcome {
            Some(outcome) => {
                nats += task.information_weight * outcome.nats;
                let of_task = outcome.minimised.map(|minimised| task.information_weight * minimised);
                minimised = minimised.zip(of_task).map(|(sum, of_task)| sum + of_task);
            }
            None => return vec![Cell::Missing; if has_aim { 4 } else { 3 }],
        }
    }
    let feasible = outcomes.iter().flatten().all(|outcome| outcome.feasible);
    let numbers = [nats, nats / std::f64::consts::LN_2, f64::from(u8::from(feasible))];
    let minimised = has_aim.then(|| minimised.map_or(Cell::Missing, Cell::number));
    numbers.into_iter().map(Cell::number).chain(minimised).collect()
}

/// Why a task could not be evaluated, with its name.
fn message(task: &Task, error: &Error) -> String {
    match error {
        Error::TimeStep { .. } | Error::InTask { .. } => error.to_string(),
        _ => format!("task `{}`: {error}", task.name),
    }
}

/// The plan of least expected cost of those from the task's guess, from the neighbour's, and of a search for others.
fn cheapest_branch(
    problem: &Problem,
    task: &Task,
    phi: &[f64],
    options: &SweepOptions,
    neighbour: Option<&Matrices>,
    state: &mut TaskState,
) -> Result<(), Error> {
    best_plan(problem, task, phi, None, state)?;
    let mut known = state.plan.trajectory.controls.clone();
    if let Some(controls) = neighbour {
        cheapest_of(problem, task, phi, &[known, controls.clone()], state)?;
        known = state.plan.trajectory.controls.clone();
    }
    let attempts = Attempts { count: options.branches, seed: options.seed };
    plan_at(problem, task, phi, Some(&known), attempts, state).map(|_| ())
}

fn evaluate_task(
    problem: &Problem,
    task: &Task,
    phi: &[f64],
    options: &SweepOptions,
    neighbour: &mut Option<Matrices>,
    state: &mut TaskState,
) -> Result<Outcome, Error> {
    match neighbour {
        // The plans found by the design search are already those of this point.
        Some(controls) if options.starts > 0 => state.evaluate(task, phi, &problem.planning, Some(controls))?,
        _ if options.branches > 0 => cheapest_branch(problem, task, phi, options, neighbour.as_ref(), state)?,
        _ => best_plan(problem, task, phi, neighbour.as_ref(), state)?,
    }
    let (nats, cost) = (state.information.total, state.cost.expected());
    if !(nats.is_finite() && cost.is_finite()) {
        return Err(Error::NotFinite { what: "information or expected cost" });
    }
    let rate = nats / std::f64::consts::LN_2 / (task.steps + 1) as f64 / task.time_step.resolve::<f64>(phi);
    let numbers = [nats, rate, cost, state.plan.nominal_cost, state.plan.iterations as f64];
    let mut cells = vec![Cell::Text(state.plan.status.to_string())];
    let mut trouble = None;
    cells.extend(numbers.map(Cell::number));
    if options.rollouts > 0 {
        let rollouts = Rollouts { count: options.rollouts, seed: options.seed };
        let sampled = monte_carlo(task, phi, &state.plan, &state.noise, cost, rollouts)?;
        cells.extend([sampled.cost_mean, sampled.cost_standard_error].map(Cell::number));
        trouble = number_warnings(task, state, Some(&sampled)).into_iter().next();
    }
    cells.extend(of_contacts(task, phi, &state.plan.trajectory));
    let bound = task.bound.as_ref().map(|bound| bound.resolve(phi));
    let converged = state.plan.status.is_converged();
    match neighbour {
        Some(controls) => controls.copy_from(&state.plan.trajectory.controls),
        None => *neighbour = Some(state.plan.trajectory.controls.clone()),
    }
    let aim = problem.design.information;
    let minimised = match aim == InformationWeights::MEASURED {
        true => None,
        false => match weighted_information(task, phi, aim, state, &mut Vec::new()) {
            Err(Error::Stopped) => return Err(Error::Stopped),
            found => found.ok(),
        },
    };
    Ok(Outcome {
        cells,
        nats,
        minimised,
        feasible: converged && meets(cost, bound, problem.design.feasibility),
        trouble,
    })
}
