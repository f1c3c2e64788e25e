use rayon::prelude::*;

use super::visited::{PriceVisit, TaskVisit, Visit, plans_of};
use super::{Aim, DesignSettings, GradientKind};
use crate::Error;
use crate::aims::{Limit, Unmeasured, first_price, information_within, without_measurements};
use crate::continuation::{Continuation, Neighbour, Scaling};
use crate::gradient::FrozenGradient;
use crate::growth::explain;
use crate::pipeline::TaskState;
use crate::problem::{Problem, TaskAt};
use crate::settings::InformationWeights;
use crate::touching::misses_contact;

/// Computing time of a total gradient, in planning iterations.
const GRADIENT_EFFORT: usize = 3;

/// Factor by which continuation steps are refined if a plan seems to have left its branch.
const FINER: usize = 8;

/// What is minimised.
#[derive(Clone, Debug)]
pub(crate) struct Weighed {
    pub weights: InformationWeights,
    /// Whether each task must stay within its bound without measurements: where a search finds that it needs no information,
    /// it may continue among designs for which that holds.
    pub needs_nothing: Vec<bool>,
}

impl Weighed {
    fn of(&self, task: usize, aim: Aim) -> TaskWeights {
        let Self { weights, ref needs_nothing } = *self;
        match aim {
            Aim::Information { .. } if needs_nothing[task] => TaskWeights {
                weights: InformationWeights { needed: 0.0, ..weights },
                needs_nothing: Some(weights.needed),
            },
            _ => TaskWeights { weights, needs_nothing: needs_nothing[task].then_some(0.0) },
        }
    }
}

/// What is minimised of one task.
struct TaskWeights {
    weights: InformationWeights,
    /// What needed information would count, if the task must need none.
    needs_nothing: Option<f64>,
}

/// A cost without measurements up to this far above the bound, relative to it, is near the kink of needed information.
const KINK: f64 = 1e-3;

/// Results of a task at a design whose plan is in `state`, with gradients of the given kind.
fn task_visit(
    TaskAt { task, phi }: TaskAt,
    kind: GradientKind,
    aim: Aim,
    TaskWeights { weights, needs_nothing }: TaskWeights,
    state: &mut TaskState,
) -> Result<TaskVisit, Error> {
    let (mut information_gradient, mut cost_gradient) = (Vec::new(), Vec::new());
    let bound = task.bound.as_ref().zip(aim.factor()).map(|(bound, factor)| Limit::of(bound, factor, phi));
    let (mut information, mut information_by_limit) = (state.information.total, 0.0);
    match kind {
        GradientKind::Total => {
            (information, information_by_limit) =
                information_within(task.at(phi), weights, bound.as_ref(), state, &mut information_gradient)?;
            state.cost_gradient(task, phi, &mut cost_gradient)?;
        }
        GradientKind::Frozen => {
            let mut frozen = FrozenGradient::default();
            state.frozen_gradient(task, phi, &mut frozen);
            information_gradient = frozen.information;
            cost_gradient = frozen.belief_cost;
        }
    }
    let without = needs_nothing.filter(|_| bound.is_some() && kind == GradientKind::Total);
    let unmeasured = without.map(|_| without_measurements(task.at(phi), state)).transpose()?;
    let mut visit = TaskVisit {
        unmeasured,
        first_price: f64::INFINITY,
        plan: Neighbour::of(&state.plan),
        information,
        information_gradient,
        information_by_limit,
        cost: state.cost.expected(),
        cost_gradient,
        bound: bound.as_ref().map(|bound| bound.value),
        bound_slopes: bound.map_or_else(Vec::new, |bound| bound.slopes),
        converged: state.plan.status.is_converged(),
        misses_contact: misses_contact(task, phi, &state.plan.trajectory),
    };
    if let (Some(needed), Some(Unmeasured { cost, .. })) = (without, &visit.unmeasured)
        && needed > 0.0
        && visit.unmeasured_violation().is_some_and(|violation| violation.abs() <= KINK)
    {
        visit.first_price = needed * first_price(*cost, state)?;
    }
    Ok(visit)
}

/// Evaluates designs near one another on one branch, and remembers all of them.
pub(crate) struct Visitor<'a> {
    pub problem: &'a Problem,
    pub settings: &'a DesignSettings,
    pub aim: Aim,
    /// What is minimised now.
    pub weighed: Weighed,
    pub scaling: Scaling,
    /// All visits, in their order.
    pub visits: Vec<Visit>,
    states: Vec<TaskState>,
}

impl<'a> Visitor<'a> {
    pub fn new(problem: &'a Problem, settings: &'a DesignSettings, aim: Aim) -> Self {
        let scaling = Scaling::of(&problem.parameters);
        let states = problem.tasks.iter().map(TaskState::new).collect();
        let needs_nothing = vec![aim == Aim::UnmeasuredCost; problem.tasks.len()];
        let weighed = Weighed { weights: settings.information, needs_nothing };
        Self { problem, settings, aim, weighed, scaling, visits: Vec::new(), states }
    }

    /// Computing effort so far, in planning iterations; each gradient counts as several.
    pub fn effort(&self) -> usize {
        let plans: usize = self.states.iter().map(|state| state.effort).sum();
        plans + GRADIENT_EFFORT * self.visits.len() * self.states.len()
    }

    /// Forgets all visits and starts anew from a design with given plans.
    pub fn restart(&mut self, phi: &[f64], plans: &[Neighbour]) -> Result<&Visit, Error> {
        self.visits.clear();
        self.visit_from(phi.to_vec(), phi, plans.iter().collect(), None)
    }

    /// Starts anew from a design, and from now on stays where tasks need no information that need none there, or hardly any.
    /// Returns what was minimised and visited before; `None`, and nothing changes, if there are no such tasks that it does not
    /// stay with already.
    pub fn stay_where_nothing_is_needed(&mut self, at: &Visit) -> Result<Option<(Weighed, Vec<Visit>)>, Error> {
        let minimised = matches!(self.aim, Aim::Information { .. }) && self.weighed.weights.needed > 0.0;
        if !(minimised && self.settings.gradient == GradientKind::Total) {
            return Ok(None);
        }
        let plans = plans_of(at);
        let before = (self.weighed.clone(), std::mem::take(&mut self.visits));
        self.weighed.needs_nothing.fill(true);
        let stays = self.restart(&at.phi, &plans).map(|visit| {
            let excess = visit.tasks.iter().map(TaskVisit::unmeasured_violation);
            excess.map(|excess| excess.is_some_and(|excess| excess <= KINK)).collect::<Vec<_>>()
        });
        let stays = stays.and_then(|stays| {
            let stays: Vec<bool> =
                stays.iter().zip(&before.0.needs_nothing).map(|(near, held)| *near || *held).collect();
            self.weighed.needs_nothing.clone_from(&stays);
            self.restart(&at.phi, &plans).map(|_| stays)
        });
        match stays {
            Ok(stays) if stays != before.0.needs_nothing => Ok(Some(before)),
            stays => {
                (self.weighed, self.visits) = before;
                stays.map(|_| None)
            }
        }
    }

    /// Lets tasks need information again where needed information is minimised.
    pub fn stay_nowhere(&mut self) {
        if self.aim != Aim::UnmeasuredCost && self.weighed.weights.needed > 0.0 {
            self.weighed.needs_nothing.fill(false);
        }
    }

    /// Visits scaled coordinates, continuing the plans of the nearest design visited before.
    pub fn visit(&mut self, scaled: &[f64]) -> Result<&Visit, Error> {
        if let Some(known) = self.visits.iter().position(|visit| visit.scaled == scaled) {
            return Ok(&self.visits[known]);
        }
        let distance = |visit: &Visit| visit.scaled.iter().zip(scaled).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
        // Among equally near visits take the latest, whose plan is on the current branch.
        let Some(nearest) = self.visits.iter().rev().min_by(|a, b| distance(a).total_cmp(&distance(b))) else {
            return Err(Error::NotFinite { what: "the first design" });
        };
        let phi = self.scaling.unscaled(&nearest.phi, scaled);
        // Coordinates that rounding, or bounds, make the same design.
        if let Some(same) = self.visits.iter().rev().find(|visit| visit.phi == phi) {
            let same = Visit { scaled: scaled.to_vec(), ..same.clone() };
            self.visits.push(same);
            return Ok(&self.visits[self.visits.len() - 1]);
        }
        let nearest = nearest.clone();
        let plans = nearest.tasks.iter().map(|task| &task.plan).collect();
        self.visit_from(phi, &nearest.phi, plans, Some(&nearest))?;
        // Clamping may move the coordinates by rounding; keep the requested ones.
        let last = self.visits.len() - 1;
        self.visits[last].scaled = scaled.to_vec();
        Ok(&self.visits[last])
    }

    /// The same visit with total gradients, whatever the settings; unchanged if its kind of plan has none.
    pub fn with_total_gradient(&mut self, visit: &Visit) -> Result<Visit, Error> {
        let has_one = self.problem.planning.plan.has_total_gradient();
        if self.settings.gradient == GradientKind::Total || !has_one {
            return Ok(visit.clone());
        }
        let Self { problem, aim, weighed, states, .. } = self;
        let tasks = problem.tasks.iter().zip(states.iter_mut()).zip(&visit.tasks);
        let tasks = tasks.enumerate().map(|(index, ((task, state), known))| {
            state.evaluate(task, &visit.phi, &problem.planning, Some(&known.plan.controls))?;
            task_visit(task.at(&visit.phi), GradientKind::Total, *aim, weighed.of(index, *aim), state)
        });
        Ok(Visit { tasks: tasks.collect::<Result<_, _>>()?, ..visit.clone() })
    }

    /// Visits a design, continuing the plans of another one, whose visit may be given too.
    fn visit_from(
        &mut self,
        phi: Vec<f64>,
        from: &[f64],
        plans: Vec<&Neighbour>,
        known: Option<&Visit>,
    ) -> Result<&Visit, Error> {
        let Self { problem, settings, aim, weighed, scaling, states, .. } = self;
        let tasks = problem.tasks.par_iter().zip(states.par_iter_mut()).zip(plans).enumerate();
        let tasks = tasks.map(|(index, ((task, state), plan))| {
            let visit = |finer: usize, state: &mut TaskState| {
                let line = Continuation { settings: &problem.planning, task, scaling, from, to: &phi, finer };
                line.plan(plan, state).map_err(|failed| failed.explain(task, state))?;
                task_visit(task.at(&phi), settings.gradient, *aim, weighed.of(index, *aim), state)
                    .map_err(|error| explain(task, &phi, error, &state.plan.trajectory))
            };
            let found = visit(1, state)?;
            let total = settings.gradient == GradientKind::Total;
            let leaves = |known: &Visit| known.tasks[index].leads_up_to(&found, scaling, from, &phi);
            if !(total && known.is_some_and(leaves)) {
                return Ok::<_, Error>(found);
            }
            // The plan jumped to a worse branch: retry with finer steps, and keep the better plan.
            Ok(match visit(FINER, &mut TaskState::new(task)) {
                Ok(finer) if finer.converged && finer.cost < found.cost => finer,
                _ => found,
            })
        });
        let tasks: Result<Vec<_>, _> = tasks.collect();
        // An interrupted evaluation is not a visit.
        Error::check_stop()?;
        let tasks = tasks?;
        let price = PriceVisit::of(problem, settings, &phi);
        self.visits.push(Visit { scaled: self.scaling.scaled(&phi), phi, tasks, price });
        Ok(&self.visits[self.visits.len() - 1])
    }
}

#[cfg(test)]
mod tests {
    use supple_model::cost::Cost;
    use supple_model::followed::Followed;
    use supple_model::noise::{Covariance, NoiseModel};
    use supple_model::parameters::{Parameter, Parameters, Scale};
    use supple_model::quantity::{ContactForce, Control as Effort, State};
    use supple_model::system::Authored;
    use supple_model::{TwoMass, Value};

    use super::*;
    use crate::candidates::best_of_guesses;
    use crate::plan::Plan;
    use crate::problem::Task;

    /// Two masses that press on a wall, with stiffnesses to design and inaccurate sensors.
    fn two_masses(limits: Vec<Followed>) -> Problem {
        let number = Value::Number;
        let mut parameters = Parameters::default();
        let stiffness = [("k1", 550.0, 50.0), ("k2", 100.0, 100.0)].map(|(name, initial, least)| {
            let parameter = Parameter::new(name, initial, [least, 600.0]).with_scale(Scale::Log).with_unit("N/m");
            parameters.declare(parameter).into()
        });
        let model = TwoMass {
            mass: [0.8, 0.4].map(number),
            damping: [60.0, 35.0].map(number),
            stiffness,
            contact_smoothing: number(0.01),
        };
        // The force is the model's first signal.
        let force = ContactForce::new(0).with_smoothing(0.1);
        let costs = vec![
            Cost::new(force, 0.05).with_targets([10.0]),
            Cost::new(State::new([1, 3]), 0.1),
            Cost::new(Effort::all(1), 1e-4),
        ];
        let noise = NoiseModel::new(
            Covariance::diagonal([1e-3, 1e-3, 1e-3, 1e-3, 3e-2]),
            Covariance::diagonal([1e-7, 5e-3, 1e-7, 1e-2, 0.0]),
            Covariance::diagonal([0.1, 1.0]),
        );
        let system = Authored::new(model, costs, 0.02, parameters.len()).following(limits);
        let task = Task::new("press", system, noise, 125, 0.02)
            .starting_at([0.0, 0.0, 0.0, 0.0, 0.75])
            .guessing([60.0])
            .within_cost(301.0);
        Problem::new("", parameters, vec![task])
    }

    /// A plan continued from 355 N/m to 384 N/m in one step jumps to a worse branch, with a cost of about 310.
    #[test]
    fn a_plan_that_falls_off_its_branch_is_led_there_in_finer_steps() {
        let problem = two_masses(Vec::new());
        let task = &problem.tasks[0];
        let mut visitor = Visitor::new(&problem, &problem.design, Aim::default());
        let mut state = TaskState::new(task);
        let scaling = Scaling::of(&problem.parameters);
        let [near, far] = [355.056, 383.755].map(|k1| vec![k1, 100.0]);
        best_of_guesses(&problem, task, &near, &mut state).unwrap();
        let near = visitor.restart(&near, &[Neighbour::of(&state.plan)]).unwrap().clone();
        assert!((near.tasks[0].cost - 306.631).abs() < 0.01, "{}", near.tasks[0].cost);

        let (settings, scaling) = (&problem.planning, &scaling);
        let line = Continuation { settings, task, scaling, from: &near.phi, to: &far, finer: 1 };
        line.plan(&near.tasks[0].plan, &mut state).ok().unwrap();
        assert!(state.cost.expected() > 305.0, "{}", state.cost.expected());
        let visit = visitor.visit(&scaling.scaled(&far)).unwrap();
        assert!((visit.tasks[0].cost - 300.22).abs() < 0.05, "{}", visit.tasks[0].cost);
    }

    /// Multipliers and penalties that a plan passes on save most of the iterations to the next one, which is the same.
    #[test]
    fn a_plan_held_at_a_limit_continues_from_its_multipliers() {
        let problem = two_masses(vec![Followed::limit(State::new([3]), -1.0, 0.8).enforced()]);
        let (task, scaling) = (&problem.tasks[0], Scaling::of(&problem.parameters));
        let [near, far] = [450.0, 460.0].map(|k1| vec![k1, 100.0]);
        let mut state = TaskState::new(task);
        best_of_guesses(&problem, task, &near, &mut state).unwrap();
        assert!(state.plan.is_at_limits());
        let held = Neighbour::of(&state.plan);
        let (settings, scaling) = (&problem.planning, &scaling);
        let line = Continuation { settings, task, scaling, from: &near, to: &far, finer: 1 };
        let mut continued = |from: &Neighbour| {
            line.plan(from, &mut state).ok().unwrap();
            assert!(state.plan.status.is_converged() && state.plan.is_at_limits());
            state.plan.clone()
        };
        let (short, long) = (continued(&held), continued(&Neighbour::with(&held.controls)));
        assert!(2 * short.iterations <= long.iterations, "{} of {}", short.iterations, long.iterations);
        assert!((short.nominal_cost / long.nominal_cost - 1.0).abs() < 1e-10);
        let price = |plan: &Plan| plan.multipliers.as_slice().iter().sum::<f64>();
        assert!((price(&short) / price(&long) - 1.0).abs() < 1e-6, "{} and {}", price(&short), price(&long));
    }
}
