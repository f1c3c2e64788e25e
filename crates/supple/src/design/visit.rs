use rayon::prelude::*;
use supple_kernels::Matrices;

use super::{Aim, DesignSettings, GradientKind};
use crate::Error;
use crate::gradient::{FrozenGradient, Functional};
use crate::parameters::{Parameters, Scale};
use crate::pipeline::TaskState;
use crate::problem::{Problem, Task};
use crate::stability::explain;

/// The design parameters as the search moves them: each from 0 at its lower bound to 1 at its upper one, linearly or
/// in the logarithm.
#[derive(Clone, Debug)]
pub(crate) struct Scaling {
    /// Indices of the design parameters.
    pub indices: Vec<usize>,
    list: Vec<(Scale, [f64; 2])>,
}

impl Scaling {
    pub fn of(parameters: &Parameters) -> Self {
        let indices = parameters.design();
        let list = indices.iter().map(|&i| (parameters.get(i).scale, parameters.get(i).bounds)).collect();
        Self { indices, list }
    }

    /// Scaled coordinates of the design parameters in `phi`.
    pub fn scaled(&self, phi: &[f64]) -> Vec<f64> {
        let one = |(&index, (scale, [lower, upper])): (&usize, &(Scale, [f64; 2]))| match scale {
            Scale::Linear => (phi[index] - lower) / (upper - lower),
            Scale::Log => (phi[index] / lower).ln() / (upper / lower).ln(),
        };
        self.indices.iter().zip(&self.list).map(one).collect()
    }

    /// `phi` with the design parameters at scaled coordinates, cut to their bounds.
    pub fn unscaled(&self, phi: &[f64], scaled: &[f64]) -> Vec<f64> {
        let mut phi = phi.to_vec();
        for ((&index, (scale, [lower, upper])), &s) in self.indices.iter().zip(&self.list).zip(scaled) {
            let value = match scale {
                Scale::Linear => lower + s * (upper - lower),
                Scale::Log => lower * (upper / lower).powf(s),
            };
            phi[index] = value.clamp(*lower, *upper);
        }
        phi
    }

    /// A gradient by the scaled coordinates, from one by all parameters at `phi`.
    pub fn gradient(&self, phi: &[f64], by_parameter: &[f64]) -> Vec<f64> {
        let one = |(&index, (scale, [lower, upper])): (&usize, &(Scale, [f64; 2]))| match scale {
            Scale::Linear => by_parameter[index] * (upper - lower),
            Scale::Log => by_parameter[index] * phi[index] * (upper / lower).ln(),
        };
        self.indices.iter().zip(&self.list).map(one).collect()
    }
}

/// What is known of one task at a visited design.
#[derive(Clone, Debug)]
pub(crate) struct TaskVisit {
    /// Controls of its plan, to warm-start from.
    pub controls: Matrices,
    /// Its directed information, nats, and gradient by all parameters.
    pub information: f64,
    pub information_gradient: Vec<f64>,
    /// Its expected cost, and gradient by all parameters.
    pub cost: f64,
    pub cost_gradient: Vec<f64>,
    /// Its bound, where it has one.
    pub bound: Option<f64>,
    /// The parameter that the bound is a multiple of, and that multiple, where there is one.
    pub bound_gradient: Option<(usize, f64)>,
    /// Whether its plan converged.
    pub converged: bool,
}

/// What the parameters of a visited design cost.
#[derive(Clone, Debug)]
pub(crate) struct PriceVisit {
    /// The sum of their prices, and gradient by all parameters.
    pub total: f64,
    pub gradient: Vec<f64>,
    /// Nats that a unit counts as.
    pub weight: f64,
    /// What the sum may be at most.
    pub budget: Option<f64>,
}

impl PriceVisit {
    fn of(problem: &Problem, settings: &DesignSettings, phi: &[f64]) -> Self {
        let Problem { parameters, .. } = problem;
        let (total, gradient) = (parameters.price_in_search(phi), parameters.price_gradient(phi));
        Self { total, gradient, weight: settings.price_weight, budget: settings.budget }
    }

    /// How far the sum is above the budget, relative to it.
    pub fn violation(&self) -> Option<f64> {
        self.budget.map(|budget| (self.total - budget) / budget)
    }
}

/// A visited design.
#[derive(Clone, Debug)]
pub(crate) struct Visit {
    /// Scaled coordinates of the design parameters.
    pub scaled: Vec<f64>,
    /// All parameters.
    pub phi: Vec<f64>,
    pub tasks: Vec<TaskVisit>,
    pub price: PriceVisit,
}

impl Visit {
    /// The weighted sum of the tasks' information, nats.
    pub fn information(&self, problem: &Problem) -> f64 {
        self.tasks.iter().zip(&problem.tasks).map(|(visit, task)| task.information_weight * visit.information).sum()
    }

    /// The gradient of the weighted sum of the tasks' information by all parameters.
    pub fn information_gradient(&self, problem: &Problem) -> Vec<f64> {
        let mut sum = vec![0.0; self.phi.len()];
        for (visit, task) in self.tasks.iter().zip(&problem.tasks) {
            for (sum, gradient) in sum.iter_mut().zip(&visit.information_gradient) {
                *sum += task.information_weight * gradient;
            }
        }
        sum
    }

    /// The objective: information, and price with its weight, nats.
    pub fn objective(&self, problem: &Problem) -> f64 {
        self.information(problem) + self.price.weight * self.price.total
    }

    /// The objective's gradient by all parameters.
    pub fn objective_gradient(&self, problem: &Problem) -> Vec<f64> {
        let mut sum = self.information_gradient(problem);
        for (sum, slope) in sum.iter_mut().zip(&self.price.gradient) {
            *sum += self.price.weight * slope;
        }
        sum
    }

    /// How far the worst task is above its bound, relative to the bound; negative where all are below.
    pub fn violation(&self) -> f64 {
        self.tasks.iter().filter_map(TaskVisit::violation).fold(f64::NEG_INFINITY, f64::max)
    }

    /// How far the design is above the worst bound of a task or the budget, relative to that.
    pub fn excess(&self) -> f64 {
        self.violation().max(self.price.violation().unwrap_or(f64::NEG_INFINITY))
    }

    /// Whether every task meets its bound and the design the budget within `feasibility`, and every plan converged.
    pub fn is_feasible(&self, feasibility: f64) -> bool {
        self.excess() <= feasibility && self.is_planned()
    }

    /// Whether the design meets the budget within `feasibility`.
    pub fn is_affordable(&self, feasibility: f64) -> bool {
        self.price.violation().is_none_or(|violation| violation <= feasibility)
    }

    /// Whether every plan converged.
    pub fn is_planned(&self) -> bool {
        self.tasks.iter().all(|task| task.converged)
    }
}

impl TaskVisit {
    /// `(J - D) / |D|`
    pub fn violation(&self) -> Option<f64> {
        self.bound.map(|bound| (self.cost - bound) / bound.abs().max(1e-300))
    }

    /// The gradient of `J - share D` by all parameters.
    pub fn excess_gradient(&self, share: f64) -> Vec<f64> {
        let mut gradient = self.cost_gradient.clone();
        // A bound that is itself a parameter moves too.
        if let Some((parameter, slope)) = self.bound_gradient {
            gradient[parameter] -= share * slope;
        }
        gradient
    }

    /// The gradient of [`violation`](Self::violation) by all parameters.
    pub fn violation_gradient(&self) -> Option<Vec<f64>> {
        let size = self.bound?.abs().max(1e-300);
        let mut gradient = self.excess_gradient(self.cost / size);
        gradient.iter_mut().for_each(|entry| *entry /= size);
        Some(gradient)
    }
}

/// Continuation steps are at most this long in scaled coordinates, so that a plan stays on its branch.
const CONTINUATION_STEP: f64 = 0.04;

/// A plan that could not be made on the way to a design.
pub(crate) struct Failed {
    /// All parameters where it failed.
    phi: Vec<f64>,
    error: Error,
}

impl Failed {
    /// Why, with what to do about it where the time step is too large.
    pub fn explain(self, task: &Task, state: &TaskState) -> Error {
        explain(task, &self.phi, self.error, &state.plan.trajectory)
    }

    /// Why, as quickly as can be told.
    pub fn error(self) -> Error {
        self.error
    }
}

/// Plans a task along the straight line between two designs, each plan starting from the one before; the state is
/// left at the second design.
pub(crate) fn continue_plan(
    (problem, task): (&Problem, &Task),
    scaling: &Scaling,
    (from, to): (&[f64], &[f64]),
    controls: &Matrices,
    state: &mut TaskState,
) -> Result<(), Failed> {
    let (start, end) = (scaling.scaled(from), scaling.scaled(to));
    let distance = start.iter().zip(&end).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    let steps = (distance / CONTINUATION_STEP).ceil().max(1.0) as usize;
    let mut controls = controls.clone();
    for step in 1..=steps {
        let share = step as f64 / steps as f64;
        let between: Vec<f64> = start.iter().zip(&end).map(|(a, b)| a + share * (b - a)).collect();
        let phi = if step == steps { to.to_vec() } else { scaling.unscaled(to, &between) };
        if let Err(error) = state.plan_only(task, &phi, &problem.planning, Some(&controls)) {
            return Err(Failed { phi, error });
        }
        controls.copy_from(&state.plan.trajectory.controls);
    }
    state.assess(task, to).map_err(|error| Failed { phi: to.to_vec(), error })
}

/// Everything known of a task at a design whose plan is in `state`, with gradients of the given kind.
fn task_visit(
    task: &Task,
    phi: &[f64],
    (kind, aim): (GradientKind, Aim),
    state: &mut TaskState,
) -> Result<TaskVisit, Error> {
    let (mut information_gradient, mut cost_gradient) = (Vec::new(), Vec::new());
    match kind {
        GradientKind::Total => {
            state.total_gradient(task, phi, Functional::INFORMATION, &mut information_gradient)?;
            state.cost_gradient(task, phi, &mut cost_gradient)?;
        }
        GradientKind::Frozen => {
            let mut frozen = FrozenGradient::default();
            state.frozen_gradient(task, phi, &mut frozen);
            information_gradient = frozen.information;
            cost_gradient = frozen.belief_cost;
        }
    }
    let bound = task.bound.zip(aim.factor());
    Ok(TaskVisit {
        controls: state.plan.trajectory.controls.clone(),
        information: state.information.total,
        information_gradient,
        cost: state.cost.expected(),
        cost_gradient,
        bound: bound.map(|(bound, factor)| factor * bound.resolve::<f64>(phi)),
        bound_gradient: bound.and_then(|(bound, factor)| bound.parameter().map(|parameter| (parameter, factor))),
        converged: state.plan.status.is_converged(),
    })
}

/// Evaluates designs near one another on one branch, and remembers all of them.
pub(crate) struct Visitor<'a> {
    pub problem: &'a Problem,
    pub settings: &'a DesignSettings,
    pub aim: Aim,
    pub scaling: Scaling,
    /// All visits, in their order.
    pub visits: Vec<Visit>,
    states: Vec<TaskState>,
}

impl<'a> Visitor<'a> {
    pub fn new(problem: &'a Problem, settings: &'a DesignSettings, aim: Aim) -> Self {
        let scaling = Scaling::of(&problem.parameters);
        let states = problem.tasks.iter().map(TaskState::new).collect();
        Self { problem, settings, aim, scaling, visits: Vec::new(), states }
    }

    /// Forgets all visits and starts anew from a design with given plans.
    pub fn restart(&mut self, phi: &[f64], controls: &[Matrices]) -> Result<&Visit, Error> {
        self.visits.clear();
        self.visit_from(phi.to_vec(), (phi, controls))
    }

    /// Visits scaled coordinates, continuing the plans of the nearest design visited before.
    pub fn visit(&mut self, scaled: &[f64]) -> Result<&Visit, Error> {
        if let Some(known) = self.visits.iter().position(|visit| visit.scaled == scaled) {
            return Ok(&self.visits[known]);
        }
        let distance = |visit: &Visit| visit.scaled.iter().zip(scaled).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
        // Of equally near ones the latest, whose plan is on the branch in use.
        let Some(nearest) = self.visits.iter().rev().min_by(|a, b| distance(a).total_cmp(&distance(b))) else {
            return Err(Error::NotFinite { what: "the first design", step: 0 });
        };
        let phi = self.scaling.unscaled(&nearest.phi, scaled);
        let (from, controls) = (nearest.phi.clone(), controls_of(nearest));
        self.visit_from(phi, (&from, &controls))?;
        // Clamping may move the coordinates by rounding; keep those asked for.
        let last = self.visits.len() - 1;
        self.visits[last].scaled = scaled.to_vec();
        Ok(&self.visits[last])
    }

    /// The same visit with total gradients, whatever the settings ask for; some kinds of plans have none.
    pub fn with_total_gradient(&mut self, visit: &Visit) -> Result<Visit, Error> {
        let has_one = self.problem.planning.plan.has_total_gradient();
        if self.settings.gradient == GradientKind::Total || !has_one {
            return Ok(visit.clone());
        }
        let Self { problem, aim, states, .. } = self;
        let tasks = problem.tasks.iter().zip(states.iter_mut()).zip(&visit.tasks);
        let tasks = tasks.map(|((task, state), known)| {
            state.evaluate(task, &visit.phi, &problem.planning, Some(&known.controls))?;
            task_visit(task, &visit.phi, (GradientKind::Total, *aim), state)
        });
        Ok(Visit { tasks: tasks.collect::<Result<_, _>>()?, ..visit.clone() })
    }

    fn visit_from(&mut self, phi: Vec<f64>, (from, controls): (&[f64], &[Matrices])) -> Result<&Visit, Error> {
        let Self { problem, settings, aim, scaling, states, .. } = self;
        let tasks = problem.tasks.par_iter().zip(states.par_iter_mut()).zip(controls.par_iter());
        let tasks = tasks.map(|((task, state), controls)| {
            continue_plan((problem, task), scaling, (from, &phi), controls, state)
                .map_err(|failed| failed.explain(task, state))?;
            task_visit(task, &phi, (settings.gradient, *aim), state)
                .map_err(|error| explain(task, &phi, error, &state.plan.trajectory))
        });
        let tasks = tasks.collect::<Result<Vec<_>, _>>()?;
        let price = PriceVisit::of(problem, settings, &phi);
        self.visits.push(Visit { scaled: self.scaling.scaled(&phi), phi, tasks, price });
        Ok(&self.visits[self.visits.len() - 1])
    }
}

/// The controls of all plans of a visit.
pub(crate) fn controls_of(visit: &Visit) -> Vec<Matrices> {
    visit.tasks.iter().map(|task| task.controls.clone()).collect()
}
