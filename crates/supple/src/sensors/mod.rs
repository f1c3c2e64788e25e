//! Which sensors to buy: sets of candidates, what they are worth, and how far from the best set one can be (theory,
//! section N).
//!
//! A plan without noise does not depend on the sensors, so that one linearisation serves every set: sensors are rows of
//! `C` with their noise. A plan that takes noise into account is made with all candidates, and kept.

mod branch;
mod candidates;
mod choose;
mod relax;
mod sight;

pub use branch::Searched;
pub use candidates::Candidate;
pub use choose::{Chosen, Goal, Limits, Rule};
pub use relax::Relaxation;
pub use sight::Worth;

use sight::{Memory, Sight, Weights};
use supple_lqg::Noise;

use crate::Error;
use crate::branches::best_plan;
use crate::pipeline::TaskState;
use crate::problem::{Problem, Task};

/// Candidates for the sensors of tasks whose plans are made.
///
/// ```
/// use supple::sensors::{Goal, Limits, Selection};
/// # let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tasks/two_mass.toml");
/// let problem = supple_file::load(file)?;
/// let phi = problem.parameters.initial();
/// let selection = Selection::of_measurements(&problem, &phi, None)?;
/// let one = Limits { count: Some(1), ..Limits::default() };
/// let best = selection.exhaustive(Goal::LeastCost, one, &mut || true)?.ok_or("stopped")?;
/// assert_eq!(selection.candidates[best.sensors[0]].name, "position of m1");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Selection {
    /// The candidates.
    pub candidates: Vec<Candidate>,
    /// The tasks that are considered, by name.
    pub tasks: Vec<String>,
    sights: Vec<Sight>,
    /// Weight of each task's information.
    weights: Vec<f64>,
}

impl Selection {
    /// Candidates for the tasks of a problem, whose measurements must include all of them, at the design `phi`. Measurements
    /// that belong to no candidate are always made. With a task's name, only that task is considered.
    ///
    /// # Errors
    /// Where `phi` has the wrong length, no task has that name, a plan or covariance cannot be computed, or candidates
    /// share noise.
    pub fn new(problem: &Problem, phi: &[f64], candidates: Vec<Candidate>, task: Option<&str>) -> Result<Self, Error> {
        problem.check_design(phi)?;
        let chosen: Vec<&Task> = problem.tasks.iter().filter(|one| task.is_none_or(|name| one.name == name)).collect();
        if chosen.is_empty() {
            let names: Vec<&str> = problem.tasks.iter().map(|task| task.name.as_str()).collect();
            let valid = supple_text::quoted(&names);
            return Err(Error::Unknown { what: "task", name: task.unwrap_or_default().to_owned(), valid });
        }
        let sights = chosen.iter().map(|task| {
            let mut state = TaskState::new(task);
            best_plan(problem, task, phi, None, &mut state)?;
            let mut owners = vec![Some(None); task.system.dimensions().measurements];
            for (index, candidate) in candidates.iter().enumerate() {
                candidate.rows.iter().for_each(|&row| owners[row] = Some(Some(index)));
            }
            Sight::new(&state, &owners)
        });
        let sights = sights.collect::<Result<Vec<_>, _>>()?;
        let tasks = chosen.iter().map(|task| task.name.clone()).collect();
        let weights = chosen.iter().map(|task| task.information_weight).collect();
        let selection = Self { candidates, tasks, sights, weights };
        let none = selection.worth(&vec![false; selection.candidates.len()]);
        match none.cost.is_finite() && none.information.is_finite() {
            true => Ok(selection),
            false => Err(Error::not_finite("the expected cost without the candidate sensors", 0)),
        }
    }

    /// Every measurement of a problem as a candidate, without prices; measurements whose noise is correlated together.
    ///
    /// # Errors
    /// As of [`new`](Self::new).
    pub fn of_measurements(problem: &Problem, phi: &[f64], task: Option<&str>) -> Result<Self, Error> {
        problem.check_design(phi)?;
        let Some(first) = problem.tasks.first() else { return Self::new(problem, phi, Vec::new(), task) };
        let size = first.system.dimensions();
        let mut noise = Noise::zeros(size.states, size.measurements);
        let mut candidates: Vec<Candidate> = Vec::new();
        for (row, channel) in first.system.channels().measurements.into_iter().enumerate() {
            candidates.push(Candidate { name: channel.name, price: 0.0, rows: vec![row] });
        }
        for task in &problem.tasks {
            task.noise.resolve(phi, &mut noise)?;
            candidates::join_correlated(&mut candidates, &noise.measurement);
        }
        Self::new(problem, phi, candidates, task)
    }

    /// What a set of candidates is worth, in addition to the sensors that are always there: the sum of the tasks' expected
    /// costs, and the weighted sum of their information. `chosen` has one entry per candidate.
    #[must_use]
    pub fn worth(&self, chosen: &[bool]) -> Worth {
        let z: Vec<f64> = chosen.iter().map(|&one| f64::from(u8::from(one))).collect();
        self.worth_with(&z, &mut self.memory(false))
    }

    /// The same with weights from 0 to 1, and its derivatives by them: a candidate with the weight `z` has `1 / z` times
    /// its noise. Both expected cost and information are returned, the derivatives in this order.
    #[must_use]
    pub fn relaxed(&self, z: &[f64]) -> (Worth, [Vec<f64>; 2]) {
        let mut memory = self.memory(true);
        let mut worth = Worth::default();
        let gradients = [(1.0, 0.0), (0.0, 1.0)].map(|(cost, information)| {
            let mut gradient = vec![0.0; z.len()];
            worth = self.gradient(z, Weights { cost, information }, &mut memory, &mut gradient);
            gradient
        });
        (worth, gradients)
    }

    fn memory(&self, gradients: bool) -> Vec<Memory> {
        self.sights.iter().map(|sight| sight.memory(gradients)).collect()
    }

    fn worth_with(&self, z: &[f64], memory: &mut [Memory]) -> Worth {
        let each = self.sights.iter().zip(memory).map(|(sight, memory)| sight.worth(z, memory));
        self.sum(each)
    }

    fn sum(&self, each: impl Iterator<Item = Worth>) -> Worth {
        let zero = Worth::default();
        each.zip(&self.weights).fold(zero, |sum, (worth, weight)| Worth {
            cost: sum.cost + worth.cost,
            information: sum.information + weight * worth.information,
        })
    }

    /// Adds the gradient of `of.cost` times the cost and `of.information` times the information.
    fn gradient(&self, z: &[f64], of: Weights, memory: &mut [Memory], gradient: &mut [f64]) -> Worth {
        let tasks = self.sights.iter().zip(memory).zip(&self.weights);
        let each = tasks.map(|((sight, memory), weight)| {
            let of = Weights { cost: of.cost, information: weight * of.information };
            sight.gradient(z, of, memory, gradient)
        });
        self.sum(each)
    }

    /// Total price of the candidates in a set.
    #[must_use]
    pub fn price(&self, sensors: &[usize]) -> f64 {
        sensors.iter().fold(0.0, |sum, &one| sum + self.candidates[one].price)
    }
}
