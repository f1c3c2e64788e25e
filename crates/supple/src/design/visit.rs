use rayon::prelude::*;
use supple_kernels::Matrices;

use super::{Aim, DesignSettings, GradientKind};
use crate::Error;
use crate::aims::{Limit, information_within};
use crate::continuation::{Scaling, continue_plan, largest_difference};
use crate::gradient::FrozenGradient;
use crate::growth::explain;
use crate::pipeline::TaskState;
use crate::problem::{Problem, Task};
use crate::settings::InformationWeights;
use crate::touching::misses_contact;
use crate::violation;

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
    /// Its derivative by each parameter that it depends on.
    pub bound_slopes: Vec<(usize, f64)>,
    /// Whether its plan converged.
    pub converged: bool,
    /// Whether its plan never touches a contact from which a cost wants a force.
    pub misses_contact: bool,
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
        self.budget.map(|budget| violation(self.total, budget))
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

    /// Whether any plan never touches a contact from which a cost wants a force.
    pub fn misses_contact(&self) -> bool {
        self.tasks.iter().any(|task| task.misses_contact)
    }

    /// Whether every plan converged, to numbers that are finite.
    pub fn is_planned(&self) -> bool {
        self.tasks.iter().all(|task| task.converged && task.cost.is_finite() && task.information.is_finite())
    }
}

impl TaskVisit {
    /// Whether the cost at a design is so far above what the slopes there and at this one tell that its plan seems to
    /// be on another branch.
    fn leads_up_to(&self, other: &Self, scaling: &Scaling, (from, to): (&[f64], &[f64])) -> bool {
        let (start, end) = (scaling.scaled(from), scaling.scaled(to));
        let along = |at: &[f64], gradient: &[f64]| scaling.slope_along((&start, &end), at, gradient);
        let (first, last) = (along(from, &self.cost_gradient), along(to, &other.cost_gradient));
        let surprise = other.cost - self.cost - 0.5 * (first + last);
        largest_difference(&start, &end) <= NEAR
            && surprise > SURPRISE * (first.abs() + last.abs()) + 1e-3 * self.cost.abs()
    }

    /// `(J - D) / |D|`
    pub fn violation(&self) -> Option<f64> {
        self.bound.map(|bound| violation(self.cost, bound))
    }

    /// The gradient of `J - share D` by all parameters.
    pub fn excess_gradient(&self, share: f64) -> Vec<f64> {
        let mut gradient = self.cost_gradient.clone();
        // A bound that is itself a parameter moves too.
        for &(parameter, slope) in &self.bound_slopes {
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

/// How many iterations of a plan a total gradient takes as long as.
const GRADIENT_EFFORT: usize = 3;

/// By how much finer steps are where a plan seems to have left its branch.
const FINER: usize = 8;

/// A cost above that of the mean slope by more than this share of the slopes is on another branch: a parabola is not
/// above it at all.
const SURPRISE: f64 = 0.25;

/// Beyond this distance in scaled coordinates, slopes cannot detect branch changes.
const NEAR: f64 = 0.25;

/// Everything known of a task at a design whose plan is in `state`, with gradients of the given kind.
fn task_visit(
    task: &Task,
    phi: &[f64],
    (kind, aim, weights): (GradientKind, Aim, InformationWeights),
    state: &mut TaskState,
) -> Result<TaskVisit, Error> {
    let (mut information_gradient, mut cost_gradient) = (Vec::new(), Vec::new());
    let bound = task.bound.zip(aim.factor()).map(|(bound, factor)| Limit::of(bound, factor, phi));
    let mut information = state.information.total;
    match kind {
        GradientKind::Total => {
            information = information_within((task, phi), (weights, bound.as_ref()), state, &mut information_gradient)?;
            state.cost_gradient(task, phi, &mut cost_gradient)?;
        }
        GradientKind::Frozen => {
            let mut frozen = FrozenGradient::default();
            state.frozen_gradient(task, phi, &mut frozen);
            information_gradient = frozen.information;
            cost_gradient = frozen.belief_cost;
        }
    }
    Ok(TaskVisit {
        controls: state.plan.trajectory.controls.clone(),
        information,
        information_gradient,
        cost: state.cost.expected(),
        cost_gradient,
        bound: bound.as_ref().map(|bound| bound.value),
        bound_slopes: bound.map_or_else(Vec::new, |bound| bound.slopes),
        converged: state.plan.status.is_converged(),
        misses_contact: misses_contact(task, phi, &state.plan.trajectory),
    })
}

/// Evaluates designs near one another on one branch, and remembers all of them.
pub(crate) struct Visitor<'a> {
    pub problem: &'a Problem,
    pub settings: &'a DesignSettings,
    pub aim: Aim,
    /// What is minimised now.
    pub weights: InformationWeights,
    pub scaling: Scaling,
    /// All visits, in their order.
    pub visits: Vec<Visit>,
    states: Vec<TaskState>,
}

impl<'a> Visitor<'a> {
    pub fn new(problem: &'a Problem, settings: &'a DesignSettings, aim: Aim) -> Self {
        let scaling = Scaling::of(&problem.parameters);
        let states = problem.tasks.iter().map(TaskState::new).collect();
        Self { problem, settings, aim, weights: settings.information, scaling, visits: Vec::new(), states }
    }

    /// Iterations of all plans so far, a gradient counting as much as some of them.
    pub fn effort(&self) -> usize {
        let plans: usize = self.states.iter().map(|state| state.effort).sum();
        plans + GRADIENT_EFFORT * self.visits.len() * self.states.len()
    }

    /// Forgets all visits and starts anew from a design with given plans.
    pub fn restart(&mut self, phi: &[f64], controls: &[Matrices]) -> Result<&Visit, Error> {
        self.visits.clear();
        self.visit_from(phi.to_vec(), (phi, controls.iter().collect()), None)
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
        let nearest = nearest.clone();
        let controls = nearest.tasks.iter().map(|task| &task.controls).collect();
        self.visit_from(phi, (&nearest.phi, controls), Some(&nearest))?;
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
        let Self { problem, aim, weights, states, .. } = self;
        let tasks = problem.tasks.iter().zip(states.iter_mut()).zip(&visit.tasks);
        let tasks = tasks.map(|((task, state), known)| {
            state.evaluate(task, &visit.phi, &problem.planning, Some(&known.controls))?;
            task_visit(task, &visit.phi, (GradientKind::Total, *aim, *weights), state)
        });
        Ok(Visit { tasks: tasks.collect::<Result<_, _>>()?, ..visit.clone() })
    }

    /// Visits a design, continuing plans of another, of which more may be known.
    fn visit_from(
        &mut self,
        phi: Vec<f64>,
        (from, controls): (&[f64], Vec<&Matrices>),
        known: Option<&Visit>,
    ) -> Result<&Visit, Error> {
        let Self { problem, settings, aim, weights, scaling, states, .. } = self;
        let tasks = problem.tasks.par_iter().zip(states.par_iter_mut()).zip(controls).enumerate();
        let tasks = tasks.map(|(index, ((task, state), controls))| {
            let visit = |finer: usize, state: &mut TaskState| {
                continue_plan((problem, task), scaling, (from, &phi), (controls, finer), state)
                    .map_err(|failed| failed.explain(task, state))?;
                task_visit(task, &phi, (settings.gradient, *aim, *weights), state)
                    .map_err(|error| explain(task, &phi, error, &state.plan.trajectory))
            };
            let found = visit(1, state)?;
            let total = settings.gradient == GradientKind::Total;
            let leaves = |known: &Visit| known.tasks[index].leads_up_to(&found, scaling, (from, &phi));
            if !(total && known.is_some_and(leaves)) {
                return Ok::<_, Error>(found);
            }
            // A worse branch than the one it came from: carefully once more, and the better of both.
            Ok(match visit(FINER, &mut TaskState::new(task)) {
                Ok(finer) if finer.converged && finer.cost < found.cost => finer,
                _ => found,
            })
        });
        let tasks: Result<Vec<_>, _> = tasks.collect();
        // What was cut short is no visit.
        Error::check_stop()?;
        let tasks = tasks?;
        let price = PriceVisit::of(problem, settings, &phi);
        self.visits.push(Visit { scaled: self.scaling.scaled(&phi), phi, tasks, price });
        Ok(&self.visits[self.visits.len() - 1])
    }
}

/// The controls of all plans of a visit.
pub(crate) fn controls_of(visit: &Visit) -> Vec<Matrices> {
    visit.tasks.iter().map(|task| task.controls.clone()).collect()
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use supple_model::cost::Cost;
    use supple_model::noise::{Covariance, NoiseModel};
    use supple_model::parameters::{Parameter, Parameters, Role, Scale};
    use supple_model::quantity::{ContactForce, Control as Effort, State};
    use supple_model::system::Authored;
    use supple_model::{TwoMass, Value};

    use super::*;
    use crate::branches::best_of_guesses;
    use crate::settings::PlanSettings;

    fn diagonal(variances: &[f64]) -> Covariance {
        Covariance::Diagonal(variances.iter().map(|&variance| Value::Number(variance)).collect())
    }

    /// Two masses that press on a wall, with stiffnesses to design and cheap, poor sensors.
    fn two_masses() -> Problem {
        let number = Value::Number;
        let parameter = |name: &str, initial: f64, bounds: [f64; 2]| Parameter {
            name: name.to_owned(),
            initial,
            bounds,
            scale: Scale::Log,
            unit: "N/m".to_owned(),
            role: Role::Design,
            price: None,
            catalogue: Vec::new(),
        };
        let model = TwoMass {
            mass: [0.8, 0.4].map(number),
            damping: [60.0, 35.0].map(number),
            stiffness: [Value::Parameter(0), Value::Parameter(1)],
            contact_smoothing: number(0.01),
        };
        // The force is the model's first signal.
        let force = ContactForce::new(0).with_smoothing(number(0.1));
        let costs = vec![
            Cost::new(force, 0.05).with_targets([10.0]),
            Cost::new(State::new([1, 3]), 0.1),
            Cost::new(Effort::all(1), 1e-4),
        ];
        let task = Task {
            name: "press".to_owned(),
            steps: 125,
            time_step: number(0.02),
            bound: Some(number(301.0)),
            information_weight: 1.0,
            initial_state: [0.0, 0.0, 0.0, 0.0, 0.75].map(number).to_vec(),
            initial_control: vec![vec![number(60.0)]],
            control_bounds: None,
            noise: NoiseModel {
                initial: diagonal(&[1e-3, 1e-3, 1e-3, 1e-3, 3e-2]),
                process: diagonal(&[1e-7, 5e-3, 1e-7, 1e-2, 0.0]),
                measurement: diagonal(&[0.1, 1.0]),
                varying: Vec::new(),
            },
            system: Arc::new(Authored::new(model, costs, number(0.02), 2)),
        };
        Problem {
            title: String::new(),
            parameters: Parameters::new(vec![
                parameter("k1", 550.0, [50.0, 600.0]),
                parameter("k2", 100.0, [100.0, 600.0]),
            ]),
            tasks: vec![task],
            planning: PlanSettings::default(),
            design: DesignSettings::default(),
            files: Vec::new(),
            catalogue: None,
            warnings: Vec::new(),
            every_warning: Vec::new(),
        }
    }

    /// A plan taken over from 355 N/m to 384 N/m at once falls to a worse branch, of a cost of some 310.
    #[test]
    fn a_plan_that_falls_off_its_branch_is_led_there_in_finer_steps() {
        let problem = two_masses();
        let task = &problem.tasks[0];
        let mut visitor = Visitor::new(&problem, &problem.design, Aim::default());
        let mut state = TaskState::new(task);
        let scaling = Scaling::of(&problem.parameters);
        let [near, far] = [355.056, 383.755].map(|k1| vec![k1, 100.0]);
        best_of_guesses(&problem, task, &near, &mut state).unwrap();
        let near = visitor.restart(&near, &[state.plan.trajectory.controls.clone()]).unwrap().clone();
        assert!((near.tasks[0].cost - 306.631).abs() < 0.01, "{}", near.tasks[0].cost);

        continue_plan((&problem, task), &scaling, (&near.phi, &far), (&near.tasks[0].controls, 1), &mut state)
            .ok()
            .unwrap();
        assert!(state.cost.expected() > 305.0, "{}", state.cost.expected());
        let visit = visitor.visit(&scaling.scaled(&far)).unwrap();
        assert!((visit.tasks[0].cost - 300.22).abs() < 0.05, "{}", visit.tasks[0].cost);
    }
}
