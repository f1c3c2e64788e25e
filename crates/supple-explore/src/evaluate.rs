//! The design on screen: information, costs and plan.

use std::panic::resume_unwind;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};

use serde_json::{Value, json};
use supple::{EvaluateOptions, Matrices, Problem, Task, TaskEvaluation, Verdict, violation};

use crate::knobs::Turned;

/// A design with the numbers of all its tasks.
pub struct Evaluated {
    /// The problem with cost limits and noise as set by the sliders.
    pub problem: Problem,
    /// All parameters.
    pub phi: Vec<f64>,
    /// Each task; that which is shown has its trajectory.
    pub tasks: Vec<TaskEvaluation>,
    /// The task that is shown.
    pub shown: usize,
    /// Whether every task meets its limit and the price the budget.
    pub feasible: bool,
}

/// The problem with one of its tasks alone.
pub fn alone(problem: &Problem, task: usize) -> Problem {
    let tasks = problem.tasks.get(task).cloned().into_iter().collect();
    Problem { tasks, ..problem.clone() }
}

impl Evaluated {
    /// Evaluates all tasks at once, as `supple evaluate` does, the shown one with its trajectory; `None` if stopped.
    ///
    /// # Errors
    /// Where a task cannot be evaluated: why.
    pub fn of(
        Turned { problem, phi }: Turned,
        shown: usize,
        options: &EvaluateOptions,
        stop: &AtomicBool,
    ) -> Result<Option<Self>, String> {
        let one = |index: usize| {
            let controls = options.controls.as_ref().and_then(|all| all.get(index)).map(|one| vec![one.clone()]);
            let trajectories = options.trajectories && index == shown;
            alone(&problem, index).evaluate(&phi, &EvaluateOptions { trajectories, controls, ..options.clone() })
        };
        let count = problem.tasks.len();
        // The task with the trajectory takes longest.
        let order = (0..count).filter(|&index| index == shown).chain((0..count).filter(|&index| index != shown));
        let waiting = Mutex::new(order.collect::<Vec<_>>().into_iter());
        let work = || {
            let mut done = Vec::new();
            while !stop.load(Ordering::Relaxed) {
                let next = waiting.lock().unwrap_or_else(PoisonError::into_inner).next();
                let Some(index) = next else { break };
                done.push((index, one(index)));
            }
            done
        };
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        let mut found = std::thread::scope(|scope| {
            let others: Vec<_> = (1..cores.min(count)).map(|_| scope.spawn(work)).collect();
            let mut found = work();
            for other in others {
                match other.join() {
                    Ok(done) => found.extend(done),
                    Err(panic) => resume_unwind(panic),
                }
            }
            found
        });
        if found.len() < count {
            return Ok(None);
        }
        found.sort_by_key(|(index, _)| *index);
        let mut tasks = Vec::with_capacity(count);
        let mut feasible = true;
        for (_, one) in found {
            let one = one.map_err(|error| error.to_string())?;
            feasible &= one.feasible;
            tasks.extend(one.tasks);
        }
        Ok(Some(Self { problem, phi, tasks, shown, feasible }))
    }

    /// The task that is shown, and its evaluation.
    pub fn shown(&self) -> Option<(&Task, &TaskEvaluation)> {
        self.problem.tasks.get(self.shown).zip(self.tasks.get(self.shown))
    }

    /// Whether every plan converged.
    pub fn is_planned(&self) -> bool {
        self.tasks.iter().all(|task| task.status.is_converged())
    }

    /// How far a task is above its limit, relative to it; `None` if it has none.
    fn excess(task: &TaskEvaluation) -> Option<f64> {
        task.cost.bound.map(|bound| violation(task.cost.expected, bound))
    }

    /// The weighted sums over all tasks, bits: measured, and used.
    pub fn bits(&self) -> [f64; 2] {
        let weights = self.problem.tasks.iter().map(|task| task.information_weight);
        weights.zip(&self.tasks).fold([0.0; 2], |[measured, used], (weight, task)| {
            let control = task.information.used.as_ref().map_or(f64::NAN, |used| used.total_bits);
            [measured + weight * task.information.total_bits, used + weight * control]
        })
    }

    /// Its numbers, without curves.
    pub fn numbers(&self) -> Value {
        let [measured, used] = self.bits();
        let tasks: Vec<Value> = self.tasks.iter().map(task_numbers).collect();
        json!({
            "measured": measured,
            "used": used,
            "feasible": self.feasible,
            "planned": self.is_planned(),
            "price": self.problem.parameters.have_prices().then(|| self.problem.parameters.price(&self.phi)),
            "budget": self.problem.design.budget,
            "tasks": tasks,
        })
    }
}

fn task_numbers(task: &TaskEvaluation) -> Value {
    let parts = &task.cost.parts;
    json!({
        "name": task.name,
        "status": task.status.to_string(),
        "converged": task.status.is_converged(),
        "iterations": task.iterations,
        "measured": task.information.total_bits,
        "used": task.information.used.as_ref().map(|used| used.total_bits),
        "expected": task.cost.expected,
        "parts": {
            "nominal": parts.nominal, "belief": parts.belief, "process": parts.process, "initial": parts.initial,
        },
        "bound": task.cost.bound,
        "excess": Evaluated::excess(task),
        "warnings": task.warnings,
        "limits": task.limits_violated,
        "contacts": task.contacts,
    })
}

/// What takes longer: the information needed, gradients of all tasks, and what roll-outs say. `controls` warm-start the
/// plans, by task.
///
/// # Errors
/// Where a task cannot be evaluated: why.
pub fn details(at: Turned, controls: Option<Vec<Matrices>>, stop: &AtomicBool) -> Result<Option<Value>, String> {
    let rollouts = at.problem.rollouts(None);
    let options = EvaluateOptions { total_gradient: true, needed: true, rollouts, controls, ..Default::default() };
    let Some(found) = Evaluated::of(at, 0, &options, stop)? else { return Ok(None) };
    let names: Vec<String> = found.problem.parameters.names();
    let bits = |nats: f64| nats / std::f64::consts::LN_2;
    let tasks: Vec<Value> = found
        .tasks
        .iter()
        .map(|task| {
            let total = task.gradient.as_ref().and_then(|gradient| gradient.total.as_ref());
            let slopes = |of: fn(&supple::TotalReport) -> &supple::Named, scale: f64| {
                total.map(|total| of(total).0.iter().map(|(_, slope)| scale * slope).collect::<Vec<f64>>())
            };
            json!({
                "needed": task.information.needed.as_ref().map(|needed| needed.total_bits),
                "needed_cost": task.information.needed.as_ref().map(|needed| needed.cost),
                "needed_takes_long": task.information.needed_takes_long,
                "valid": total.map(|total| total.valid),
                "rollouts": task.trust.as_ref().filter(|trust| trust.verdict != Verdict::Holds).map(ToString::to_string),
                "broken": task.is_broken(),
                "information_slopes": slopes(|total| &total.information_nats, bits(1.0)),
                "cost_slopes": slopes(|total| &total.expected_cost, 1.0),
            })
        })
        .collect();
    Ok(Some(json!({ "parameters": names, "tasks": tasks, "price_bits_per_cost": shadow_price(&found) })))
}

/// What one more in cost saves at the cost limit of the worst task, bits, by least squares over the design parameters
/// in scaled coordinates: `-<g_I, g_J> / <g_J, g_J>`. Exact at an optimum whose only active limit is that one.
pub fn shadow_price(found: &Evaluated) -> Option<f64> {
    let parameters = &found.problem.parameters;
    let scaled = |index: usize, slope: f64| {
        let parameter = parameters.get(index);
        parameter.scale.slope(parameter.bounds, found.phi[index], slope)
    };
    let worst = (0..found.tasks.len()).filter(|&task| found.tasks[task].cost.bound.is_some()).max_by(|&a, &b| {
        let excess = |task: usize| Evaluated::excess(&found.tasks[task]).unwrap_or(f64::NEG_INFINITY);
        excess(a).total_cmp(&excess(b))
    });
    let total = |task: &TaskEvaluation| task.gradient.clone()?.total;
    let cost = total(found.tasks.get(worst.unwrap_or(0))?)?.expected_cost;
    let (mut along, mut size) = (0.0, 0.0);
    for index in parameters.design() {
        let slope = scaled(index, cost.0.get(index)?.1);
        let mut information = 0.0;
        for (task, weight) in found.tasks.iter().zip(found.problem.tasks.iter().map(|task| task.information_weight)) {
            information += weight * scaled(index, total(task)?.information_nats.0.get(index)?.1);
        }
        along += information * slope;
        size += slope * slope;
    }
    (size > 0.0).then(|| -along / size / std::f64::consts::LN_2)
}
