//! The problem of a design search as optimisers see it: numbers in a box, an objective, and constraints.

use super::Aim;
use super::search::Search;
use super::visited::Visit;
use crate::Error;

/// An optimiser of designs. It only accesses an [`OuterProblem`].
pub trait Optimiser: Send + Sync {
    /// Searches from the problem's [first point](OuterProblem::first).
    fn minimise(&self, problem: &mut OuterProblem) -> Ending;

    /// The units in which it is given the problem.
    fn units(&self) -> Units {
        Units::Scaled
    }

    /// Whether its result is the last evaluated point rather than the best one.
    fn keeps_last(&self) -> bool {
        false
    }

    /// Maximum number of runs, each from the best point so far, until it is an optimum.
    fn runs(&self) -> usize {
        1
    }

    /// Whether it continues with shorter steps when a point cannot be evaluated (its objective is infinite), rather
    /// than ending there.
    fn steps_back(&self) -> bool {
        false
    }
}

/// How an optimiser ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ending {
    /// Converged according to its own criterion.
    Converged,
    /// Reached the maximum number of evaluations.
    MaxEvaluations,
    /// It found no further progress.
    Stalled,
    /// Stopped on request.
    Stopped,
}

/// Units of an [`OuterProblem`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Units {
    /// Variables from 0 to 1, linearly or in the logarithm, as each parameter has it; objective and constraints
    /// relative to their size at the first point.
    Scaled,
    /// Parameters in their units, the objective in nats, constraints in units of cost and price.
    Natural,
}

/// What is known at a point.
#[derive(Clone, Debug)]
pub struct OuterPoint {
    /// The variables at which it was evaluated.
    pub variables: Vec<f64>,
    /// The objective; infinite if the point could not be evaluated; the other fields are then those of the last valid point.
    pub objective: f64,
    /// Its gradient, one number per variable.
    pub gradient: Vec<f64>,
    /// The constraints, which must be at most 0.
    pub constraints: Vec<f64>,
    /// Their gradients.
    pub jacobian: Vec<Vec<f64>>,
}

/// A design search as an optimiser sees it: the least objective within a box, where no constraint is above 0 (theory,
/// equation D.2).
///
/// The variables are the design parameters; a search for the least cost has one more, which is at least every
/// `J_i / D_i` and is minimised. There is one constraint per task with a bound, then one for a budget of prices, then one
/// per task whose cost without measurements is to stay within its bound.
pub struct OuterProblem<'s, 'a, 'b> {
    search: &'s mut Search<'a, 'b>,
    units: Units,
    first: Visit,
    /// Tasks with bounds, and the scales by which their constraints are divided.
    bounded: Vec<(usize, f64)>,
    /// The scale by which the objective is divided.
    scale: f64,
    /// Number of evaluations before the last point was requested.
    known: usize,
    failures: Failures,
    /// Whether the evaluation of a point was stopped.
    stopped: bool,
}

/// Points that could not be evaluated, since the last one that could.
struct Failures {
    /// The last such point, in coordinates from 0 to 1, and its error.
    last: Option<(Vec<f64>, Error)>,
    count: usize,
    /// The number of failures that ends the search.
    most: usize,
}

/// Number of consecutive failed points after which a search that retries with shorter steps ends.
const FAILURES: usize = 6;

impl<'s, 'a, 'b> OuterProblem<'s, 'a, 'b> {
    pub(super) fn new(search: &'s mut Search<'a, 'b>, optimiser: &dyn Optimiser, first: Visit) -> Self {
        let (problem, units) = (search.problem(), optimiser.units());
        let scale = match (units, search.aim()) {
            (Units::Natural, _) => 1.0,
            (_, Aim::Information { .. }) => first.objective(problem).abs().max(1e-12),
            (_, Aim::Cost) => (1.0 + first.violation()).max(1e-12),
        };
        let size = |bound: f64| if units == Units::Natural { 1.0 } else { bound.abs().max(1e-12) };
        let bounds = first.tasks.iter().enumerate();
        let bounded = bounds.filter_map(|(task, at)| at.bound.map(|bound| (task, size(bound)))).collect();
        let known = search.evaluations;
        let failures = Failures { last: None, count: 0, most: if optimiser.steps_back() { FAILURES } else { 1 } };
        Self { search, units, first, bounded, scale, known, failures, stopped: false }
    }

    /// Why points could not be evaluated, if that ended the search.
    pub(super) fn into_error(self) -> Option<Error> {
        let Failures { last, count, most } = self.failures;
        last.filter(|_| count >= most).map(|(_, error)| error)
    }

    fn has_auxiliary(&self) -> bool {
        self.search.aim() == Aim::Cost
    }

    /// The point at which the search begins.
    pub fn first(&self) -> Vec<f64> {
        let mut variables = match self.units {
            Units::Scaled => self.first.scaled.clone(),
            Units::Natural => self.search.visitor.scaling.indices.iter().map(|&index| self.first.phi[index]).collect(),
        };
        // The auxiliary variable: 1 where the search begins.
        variables.extend(self.has_auxiliary().then_some(1.0));
        variables
    }

    /// The least and the greatest value of each variable.
    pub fn bounds(&self) -> Vec<[f64; 2]> {
        let parameters = &self.search.problem().parameters;
        let bounds = self.search.visitor.scaling.indices.iter().map(|&index| match self.units {
            Units::Scaled => [0.0, 1.0],
            Units::Natural => parameters.get(index).bounds,
        });
        bounds.chain(self.has_auxiliary().then_some([0.0, 2.0])).collect()
    }

    /// How many constraints there are.
    pub fn constraints(&self) -> usize {
        let unmeasured = self.first.tasks.iter().filter(|task| task.unmeasured.is_some()).count();
        self.bounded.len() + usize::from(self.search.settings().budget.is_some()) + unmeasured
    }

    /// How many points may be evaluated.
    pub fn max_evaluations(&self) -> usize {
        self.search.settings().max_evaluations
    }

    /// Relative changes below this end the search.
    pub fn tolerance(&self) -> f64 {
        self.search.settings().tolerance
    }

    /// Whether to stop: the user asked for it, or points could not be evaluated.
    pub fn is_stopped(&self) -> bool {
        self.interrupted().is_some()
    }

    /// How the search has to end if it was interrupted; `None` if it may continue.
    pub fn interrupted(&self) -> Option<Ending> {
        match (self.failures.count >= self.failures.most, self.stopped || self.search.control.is_stopped()) {
            (true, _) => Some(Ending::Stalled),
            (false, true) => Some(Ending::Stopped),
            (false, false) => None,
        }
    }

    /// The design at a point, if it can be evaluated.
    fn visit(&mut self, variables: &[f64]) -> Option<Visit> {
        if !self.is_stopped() {
            let design = &variables[..self.search.visitor.scaling.indices.len()];
            let scaled: Vec<f64> = match self.units {
                Units::Scaled => design.iter().map(|s| s.clamp(0.0, 1.0)).collect(),
                Units::Natural => {
                    let mut phi = self.first.phi.clone();
                    let indices = &self.search.visitor.scaling.indices;
                    indices.iter().zip(design).for_each(|(&index, &value)| phi[index] = value);
                    self.search.visitor.scaling.scaled(&phi)
                }
            };
            self.known = self.search.evaluations;
            if self.failures.last.as_ref().is_some_and(|(last, _)| *last == scaled) {
                return None;
            }
            match self.search.visit(&scaled) {
                Ok(visit) => {
                    (self.failures.last, self.failures.count) = (None, 0);
                    return Some(visit);
                }
                Err(Error::Stopped) => self.stopped = true,
                Err(error) => {
                    self.failures.last = Some((scaled, error));
                    self.failures.count += 1;
                }
            }
        }
        None
    }

    /// A gradient with respect to the variables, divided by a scale, from one with respect to all parameters.
    fn gradient(&self, visit: &Visit, by_parameter: &[f64], (scale, auxiliary): (f64, f64)) -> Vec<f64> {
        let scaling = &self.search.visitor.scaling;
        let own: Vec<f64> = match self.units {
            Units::Scaled => scaling.gradient(&visit.phi, by_parameter),
            Units::Natural => scaling.indices.iter().map(|&index| by_parameter[index]).collect(),
        };
        own.into_iter().map(|slope| slope / scale).chain(self.has_auxiliary().then_some(auxiliary)).collect()
    }

    /// The values at a point; `None` if nothing was ever evaluated. If the point cannot be evaluated, or once
    /// the search [is stopped](Self::is_stopped), those of the last point; in the former case with an infinite objective.
    pub fn at(&mut self, variables: &[f64]) -> Option<OuterPoint> {
        if let Some(visit) = self.visit(variables) {
            return Some(self.known_of(&visit, variables));
        }
        let last = self.search.visitor.visits.last().cloned()?;
        let known = self.known_of(&last, variables);
        let objective = if self.is_stopped() { known.objective } else { f64::INFINITY };
        Some(OuterPoint { objective, ..known })
    }

    /// The values at a visit, with the auxiliary variable of the requested point.
    fn known_of(&self, visit: &Visit, variables: &[f64]) -> OuterPoint {
        let problem = self.search.problem();
        let auxiliary = self.has_auxiliary().then(|| variables[variables.len() - 1]);
        let (objective, gradient) = match auxiliary {
            Some(auxiliary) => {
                let mut gradient = vec![0.0; variables.len()];
                gradient[variables.len() - 1] = 1.0;
                (auxiliary, gradient)
            }
            None => {
                let gradient = self.gradient(visit, &visit.objective_gradient(problem), (self.scale, 0.0));
                (visit.objective(problem) / self.scale, gradient)
            }
        };
        let (mut constraints, mut jacobian) = (Vec::new(), Vec::new());
        for &(task, size) in &self.bounded {
            let at = &visit.tasks[task];
            let (value, by_parameter, by) = match auxiliary {
                // `J / D` divided by its value at the start, minus the auxiliary variable.
                Some(auxiliary) => {
                    let by_parameter = at.violation_gradient().unwrap_or_else(|| vec![0.0; visit.phi.len()]);
                    let value = at.violation().map(|violation| (1.0 + violation) / self.scale - auxiliary);
                    (value, by_parameter, (self.scale, -1.0))
                }
                // `J - D`
                None => (at.bound.map(|bound| (at.cost - bound) / size), at.excess_gradient(1.0), (size, 0.0)),
            };
            constraints.push(value.unwrap_or(-1.0));
            jacobian.push(self.gradient(visit, &by_parameter, by));
        }
        if self.search.settings().budget.is_some() {
            let budget = visit.price.budget.unwrap_or(f64::INFINITY);
            let (value, scale) = match self.units {
                Units::Scaled => (visit.price.violation().unwrap_or(-1.0), budget),
                Units::Natural => (visit.price.total - budget, 1.0),
            };
            constraints.push(value);
            jacobian.push(self.gradient(visit, &visit.price.gradient, (scale, 0.0)));
        }
        for &(task, size) in &self.bounded {
            let at = &visit.tasks[task];
            if let (Some((cost, _)), Some(bound), Some(gradient)) = (&at.unmeasured, at.bound, at.unmeasured_gradient())
            {
                constraints.push((cost - bound) / size);
                jacobian.push(self.gradient(visit, &gradient, (size, 0.0)));
            }
        }
        let mut at = match self.units {
            Units::Scaled => visit.scaled.clone(),
            Units::Natural => self.search.visitor.scaling.indices.iter().map(|&index| visit.phi[index]).collect(),
        };
        at.extend(auxiliary);
        OuterPoint { variables: at, objective, gradient, constraints, jacobian }
    }

    /// Notifies observers of a step; `is_trial` marks a line-search trial.
    pub fn step_to(&mut self, variables: &[f64], is_trial: bool) {
        if let Some(visit) = self.visit(variables) {
            self.search.step_to(&visit, is_trial);
        }
    }

    /// Whether the last requested point was new.
    pub fn is_new(&self) -> bool {
        self.search.evaluations > self.known
    }
}
