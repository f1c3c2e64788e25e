//! The problem of a design search as optimisers see it: numbers in a box, an objective, and constraints.

use super::entries::{Entry, Units, constraints, has_auxiliary, objective};
use super::search::Search;
use super::visited::Visit;
use crate::Error;
use crate::continuation::largest_difference;

/// An optimiser of designs. It only accesses an [`OuterProblem`].
///
/// ```
/// use supple::design::{Aim, Control, DesignSettings, Ending, Optimiser, OuterPoint, OuterProblem, Searcher, Units};
///
/// /// Tries the greatest values, and nothing else.
/// struct Greatest;
///
/// impl Optimiser for Greatest {
///     fn minimise(&self, problem: &mut OuterProblem) -> Ending {
///         let greatest: Vec<f64> = problem.bounds().iter().map(|[_, upper]| *upper).collect();
///         let Some(OuterPoint { constraints, .. }) = problem.at(&greatest) else { return Ending::Stalled };
///         if constraints.iter().all(|constraint| *constraint <= 0.0) {
///             problem.step_to(&greatest, false);
///         }
///         Ending::Converged
///     }
///     fn units(&self) -> Units {
///         Units::Natural
///     }
/// }
/// # let task = r#"
/// #     model = { kind = "linear", A = [[1.0, 0.1], [0.1, 1.0]], B = [[0.0], [0.1]], C = [[1.0, 0.0]] }
/// #     parameters.variance = { initial = 1e-4, bounds = [1e-6, 1e-2], scale = "log", unit = "m^2" }
/// #     [[tasks]]
/// #     name = "balance"
/// #     steps = 50
/// #     time_step = 0.1
/// #     bound = 15.0
/// #     initial_state = [1.0, 0.0]
/// #     noise = { initial = [1e-2, 1e-2], process = [0.0, 1e-3], measurement = ["variance"] }
/// #     costs = [{ kind = "quadratic", Q = [[1.0, 0.0], [0.0, 0.1]], R = [[0.1]] }]
/// # "#;
///
/// // The task of the front page.
/// let problem = supple_file::parse(task, "balance.toml")?;
/// let settings = DesignSettings { starts: 1, rounds: 1, ..problem.design.clone() };
/// let searcher = Searcher::new(&problem, &settings, Aim::default(), Control::default());
/// let found = searcher.with_optimiser(&Greatest).search(&problem.parameters.initial())?;
/// assert!((found.starts[found.best].to[0] / 1e-2 - 1.0).abs() < 1e-9);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
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
///
/// Example: [`Optimiser`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
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

/// What is known at a point.
///
/// Example: [`Optimiser`].
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
///
/// Example: [`Optimiser`].
pub struct OuterProblem<'s, 'a, 'b> {
    search: &'s mut Search<'a, 'b>,
    units: Units,
    first: Visit,
    objective: Entry,
    constraints: Vec<Entry>,
    /// Whether the last variable is the auxiliary one.
    has_auxiliary: bool,
    /// How far scaled coordinates may be from the first point.
    radius: f64,
    /// Number of evaluations before the last point was requested.
    known: usize,
    failures: Failures,
    /// Points close to the best one that are no better; `None` if the optimiser's last point is its result.
    close: Option<Close>,
    /// Whether the evaluation of a point was stopped.
    stopped: bool,
}

/// Points in a row that were close to the best one, and no better.
struct Close {
    /// Scaled coordinates of the best one.
    at: Vec<f64>,
    /// Its merit.
    merit: (bool, f64),
    count: usize,
}

/// Points in scaled coordinates are close up to this distance.
const CLOSE: f64 = 1e-7;
/// What is better by less than this share is no better.
const BETTER: f64 = 1e-10;
/// After so many points in a row that are close and no better, there is nothing to find. Line searches of optimisers that
/// cannot meet their constraints would shrink their steps down to rounding.
const MOST_CLOSE: usize = 4;

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
        let (problem, settings, aim, units) = (search.problem(), search.settings(), search.aim(), optimiser.units());
        let objective = objective(problem, aim, units, &first);
        let constraints = constraints(settings, aim, units, &first).into_iter().map(|(_, entry)| entry).collect();
        let has_auxiliary = has_auxiliary(aim);
        let known = search.evaluations;
        let failures = Failures { last: None, count: 0, most: if optimiser.steps_back() { FAILURES } else { 1 } };
        let close = (!optimiser.keeps_last()).then(|| Close {
            at: first.scaled.clone(),
            merit: search.merit(&first),
            count: 0,
        });
        Self {
            search,
            units,
            first,
            objective,
            constraints,
            has_auxiliary,
            known,
            failures,
            close,
            stopped: false,
            radius: f64::INFINITY,
        }
    }

    /// The same search, but scaled coordinates stay this close to the first point.
    pub(super) fn within(self, radius: f64) -> Self {
        Self { radius, ..self }
    }

    /// Why points could not be evaluated, if that ended the search.
    pub(super) fn into_error(self) -> Option<Error> {
        let Failures { last, count, most } = self.failures;
        last.filter(|_| count >= most).map(|(_, error)| error)
    }

    /// The point at which the search begins.
    #[must_use]
    pub fn first(&self) -> Vec<f64> {
        let mut variables = match self.units {
            Units::Scaled => self.first.scaled.clone(),
            Units::Natural => self.search.visitor.scaling.indices.iter().map(|&index| self.first.phi[index]).collect(),
        };
        // The auxiliary variable: 1 where the search begins.
        variables.extend(self.has_auxiliary.then_some(1.0));
        variables
    }

    /// The least and the greatest value of each variable.
    #[must_use]
    pub fn bounds(&self) -> Vec<[f64; 2]> {
        let parameters = &self.search.problem().parameters;
        let indices = self.search.visitor.scaling.indices.iter();
        let bounds = indices.zip(&self.first.scaled).map(|(&index, s)| match self.units {
            Units::Scaled => [(s - self.radius).max(0.0), (s + self.radius).min(1.0)],
            Units::Natural => parameters.get(index).bounds,
        });
        bounds.chain(self.has_auxiliary.then_some([0.0, 2.0])).collect()
    }

    /// How many constraints there are.
    #[must_use]
    pub fn constraints(&self) -> usize {
        self.constraints.len()
    }

    /// How many points may be evaluated.
    #[must_use]
    pub fn max_evaluations(&self) -> usize {
        self.search.settings().max_evaluations
    }

    /// Relative changes below this end the search.
    #[must_use]
    pub fn tolerance(&self) -> f64 {
        self.search.settings().tolerance
    }

    /// Whether to stop: the user asked for it, or points could not be evaluated.
    #[must_use]
    pub fn is_stopped(&self) -> bool {
        self.interrupted().is_some()
    }

    /// How the search has to end if it was interrupted; `None` if it may continue.
    #[must_use]
    pub fn interrupted(&self) -> Option<Ending> {
        match (self.failures.count >= self.failures.most, self.stopped || self.search.control.is_stopped()) {
            (true, _) => Some(Ending::Stalled),
            (false, true) => Some(Ending::Stopped),
            (false, false) => self.close.as_ref().filter(|close| close.count >= MOST_CLOSE).map(|_| Ending::Converged),
        }
    }

    /// Notes how a new point compares with the best one.
    fn compare(&mut self, visit: &Visit) {
        let Some(Close { at, merit: best, count }) = &mut self.close else { return };
        let (merit, (missed, least)) = (self.search.merit(visit), *best);
        let is_better = merit < (missed, least - BETTER * least.abs());
        *count = if !is_better && largest_difference(&visit.scaled, at) <= CLOSE { *count + 1 } else { 0 };
        if merit < *best {
            (*best, *at) = (merit, visit.scaled.clone());
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
            // An optimiser that has lost itself.
            if scaled.iter().any(|s| !s.is_finite()) {
                self.failures.count += 1;
                return None;
            }
            self.known = self.search.evaluations;
            if self.failures.last.as_ref().is_some_and(|(last, _)| *last == scaled) {
                return None;
            }
            match self.search.visit(&scaled) {
                Ok(visit) => {
                    (self.failures.last, self.failures.count) = (None, 0);
                    if self.is_new() {
                        self.compare(&visit);
                    }
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

    /// An entry at a visit, and its gradient with respect to the variables.
    fn value(&self, entry: &Entry, visit: &Visit, auxiliary: Option<f64>) -> (f64, Vec<f64>) {
        let (value, by_parameter) = entry.at(self.search.problem(), visit);
        let scaling = &self.search.visitor.scaling;
        let own: Vec<f64> = match self.units {
            Units::Scaled => scaling.gradient(&visit.phi, &by_parameter),
            Units::Natural => scaling.indices.iter().map(|&index| by_parameter[index]).collect(),
        };
        let gradient = own.into_iter().map(|slope| slope / entry.scale);
        let gradient = gradient.chain(auxiliary.map(|_| entry.auxiliary)).collect();
        (value / entry.scale + entry.auxiliary * auxiliary.unwrap_or(0.0), gradient)
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
        let auxiliary = self.has_auxiliary.then(|| variables[variables.len() - 1]);
        let (objective, gradient) = self.value(&self.objective, visit, auxiliary);
        let all = self.constraints.iter().map(|entry| self.value(entry, visit, auxiliary));
        let (constraints, jacobian) = all.unzip();
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
    #[must_use]
    pub fn is_new(&self) -> bool {
        self.search.evaluations > self.known
    }
}
