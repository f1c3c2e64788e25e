//! The problem of a design search as optimisers see it: numbers in a box, an objective, and constraints.

use super::Aim;
use super::search::Search;
use super::visited::Visit;
use crate::Error;

/// An optimiser of designs. It sees an [`OuterProblem`] and nothing else.
pub trait Optimiser: Send + Sync {
    /// Searches from the problem's [first point](OuterProblem::first).
    fn minimise(&self, problem: &mut OuterProblem) -> Ending;

    /// In which units it sees the problem.
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
    /// The variables, as they were evaluated.
    pub variables: Vec<f64>,
    /// The objective.
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
    /// Tasks with bounds, and what their constraints are divided by.
    bounded: Vec<(usize, f64)>,
    /// What the objective is divided by.
    scale: f64,
    /// Evaluations before the last point was asked for.
    known: usize,
    error: Option<Error>,
    /// Whether the evaluation of a point was stopped.
    stopped: bool,
}

impl<'s, 'a, 'b> OuterProblem<'s, 'a, 'b> {
    pub(super) fn new(search: &'s mut Search<'a, 'b>, units: Units, first: Visit) -> Self {
        let problem = search.problem();
        let scale = match (units, search.aim()) {
            (Units::Natural, _) => 1.0,
            (_, Aim::Information { .. }) => first.objective(problem).abs().max(1e-12),
            (_, Aim::Cost) => (1.0 + first.violation()).max(1e-12),
        };
        let size = |bound: f64| if units == Units::Natural { 1.0 } else { bound.abs().max(1e-12) };
        let bounds = first.tasks.iter().enumerate();
        let bounded = bounds.filter_map(|(task, at)| at.bound.map(|bound| (task, size(bound)))).collect();
        let known = search.evaluations;
        Self { search, units, first, bounded, scale, known, error: None, stopped: false }
    }

    /// Why a point could not be evaluated, where that ended the search.
    pub(super) fn into_error(self) -> Option<Error> {
        self.error
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

    /// Whether to stop: the user asked for it, or a point could not be evaluated.
    pub fn is_stopped(&self) -> bool {
        self.interrupted().is_some()
    }

    /// How a search ends that ends now, where it was not its own decision.
    pub fn interrupted(&self) -> Option<Ending> {
        match (&self.error, self.stopped || self.search.control.is_stopped()) {
            (Some(_), _) => Some(Ending::Stalled),
            (None, true) => Some(Ending::Stopped),
            (None, false) => None,
        }
    }

    /// The design at a point; the last one once the search [is stopped](Self::is_stopped).
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
            match self.search.visit(&scaled) {
                Ok(visit) => return Some(visit),
                Err(Error::Stopped) => self.stopped = true,
                Err(error) => self.error = Some(error),
            }
        }
        self.search.visitor.visits.last().cloned()
    }

    /// A gradient by all parameters over a scale, and by the auxiliary variable where there is one.
    fn gradient(&self, visit: &Visit, by_parameter: &[f64], (scale, auxiliary): (f64, f64)) -> Vec<f64> {
        let scaling = &self.search.visitor.scaling;
        let own: Vec<f64> = match self.units {
            Units::Scaled => scaling.gradient(&visit.phi, by_parameter),
            Units::Natural => scaling.indices.iter().map(|&index| by_parameter[index]).collect(),
        };
        own.into_iter().map(|slope| slope / scale).chain(self.has_auxiliary().then_some(auxiliary)).collect()
    }

    /// What is known at a point; none where nothing was ever evaluated. Once the search [is stopped](Self::is_stopped),
    /// that of the last point.
    pub fn at(&mut self, variables: &[f64]) -> Option<OuterPoint> {
        let visit = self.visit(variables)?;
        let problem = self.search.problem();
        let auxiliary = self.has_auxiliary().then(|| variables[variables.len() - 1]);
        let (objective, gradient) = match auxiliary {
            Some(auxiliary) => {
                let mut gradient = vec![0.0; variables.len()];
                gradient[variables.len() - 1] = 1.0;
                (auxiliary, gradient)
            }
            None => {
                let gradient = self.gradient(&visit, &visit.objective_gradient(problem), (self.scale, 0.0));
                (visit.objective(problem) / self.scale, gradient)
            }
        };
        let (mut constraints, mut jacobian) = (Vec::new(), Vec::new());
        for &(task, size) in &self.bounded {
            let at = &visit.tasks[task];
            let (value, by_parameter, by) = match auxiliary {
                // `J / D` over its size at the start, less the auxiliary variable.
                Some(auxiliary) => {
                    let by_parameter = at.violation_gradient().unwrap_or_else(|| vec![0.0; visit.phi.len()]);
                    let value = at.violation().map(|violation| (1.0 + violation) / self.scale - auxiliary);
                    (value, by_parameter, (self.scale, -1.0))
                }
                // `J - D`
                None => (at.bound.map(|bound| (at.cost - bound) / size), at.excess_gradient(1.0), (size, 0.0)),
            };
            constraints.push(value.unwrap_or(-1.0));
            jacobian.push(self.gradient(&visit, &by_parameter, by));
        }
        if self.search.settings().budget.is_some() {
            let budget = visit.price.budget.unwrap_or(f64::INFINITY);
            let (value, scale) = match self.units {
                Units::Scaled => (visit.price.violation().unwrap_or(-1.0), budget),
                Units::Natural => (visit.price.total - budget, 1.0),
            };
            constraints.push(value);
            jacobian.push(self.gradient(&visit, &visit.price.gradient, (scale, 0.0)));
        }
        for &(task, size) in &self.bounded {
            let at = &visit.tasks[task];
            if let (Some((cost, _)), Some(bound), Some(gradient)) = (&at.unmeasured, at.bound, at.unmeasured_gradient())
            {
                constraints.push((cost - bound) / size);
                jacobian.push(self.gradient(&visit, &gradient, (size, 0.0)));
            }
        }
        let mut at = match self.units {
            Units::Scaled => visit.scaled.clone(),
            Units::Natural => self.search.visitor.scaling.indices.iter().map(|&index| visit.phi[index]).collect(),
        };
        at.extend(auxiliary);
        Some(OuterPoint { variables: at, objective, gradient, constraints, jacobian })
    }

    /// Notifies observers of a step; `is_trial` marks a line-search trial.
    pub fn step_to(&mut self, variables: &[f64], is_trial: bool) {
        if let Some(visit) = self.visit(variables) {
            self.search.step_to(&visit, is_trial);
        }
    }

    /// Whether the point asked for last was new.
    pub fn is_new(&self) -> bool {
        self.search.evaluations > self.known
    }
}
