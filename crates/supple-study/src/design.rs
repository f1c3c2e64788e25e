//! Designs: the search, and the report of what it found.
//!
//! # A search from one start
//!
//! ```
//! use supple::design::{Control, DesignSettings};
//! use supple_study::design::{combine, run, run_start};
//! use supple_study::{LoadedTask, Source, Watch};
//! # let text = r#"
//! #     model = { kind = "linear", A = [[1.0]], B = [[1.0]], C = [[1.0]] }
//! #     parameters.variance = { initial = 1e-2, bounds = [1e-4, 1.0] }
//! #     [[tasks]]
//! #     name = "hold"
//! #     steps = 20
//! #     time_step = 0.1
//! #     bound = 2.0
//! #     initial_state = [1.0]
//! #     noise = { initial = [1e-2], process = [1e-3], measurement = ["variance"] }
//! #     costs = [{ kind = "quadratic", Q = [[1.0]], R = [[1.0]] }]
//! # "#;
//! # let source = Source { path: "hold.toml".to_owned(), text: text.to_owned() };
//!
//! // The task of the front page with a cost limit of 2.
//! let task = LoadedTask::restore(&[source])?;
//! let settings = DesignSettings { starts: 1, ..task.problem.design.clone() };
//! let report = run(&task, &settings, None, Watch::default())?;
//! assert!(report.status.meets_bounds() && report.starts.len() == 1);
//! assert!(report.optimum.objective.information_bits < report.start.objective.information_bits);
//! assert_eq!(report.bound_prices[0].task, "hold");
//!
//! // The same by parts, which may run in different processes.
//! let start = run_start(&task, &settings, 0, Control::default())?;
//! let again = combine(&task, &settings, vec![start], 0.0, Control::default())?;
//! assert_eq!(again.optimum.parameters, report.optimum.parameters);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use supple::design::{
    Aim, Change, Control, Design, DesignSettings, DesignStatus, GradientKind, InformationWeights, KeptCombinations,
    Method, Observer, Searcher, Split, StartSummary,
};
use supple::pipeline::TaskState;
use supple::{
    EvaluateOptions, Evaluation, Matrices, Named, Problem, Task, contact_reports, contact_warnings, halt,
    number_warnings, plan_warnings,
};
use supple_text::short;

pub use crate::catalogue::{CatalogueReport, ChosenEntry, CombinationReport, ContinuousOptimum};
use crate::journal::{Identity, Parts};
use crate::watch::{Progress, Searching, Silent};
use crate::{About, LoadedTask, StudyError, Watch};

/// What `supple design --json` prints.
///
/// Example: the [module](crate::design).
#[derive(Clone, Debug, Serialize, Deserialize)]
#[non_exhaustive]
pub struct DesignReport {
    /// How the search ended.
    pub status: DesignStatus,
    /// Optimiser.
    pub method: Method,
    /// Gradient it followed.
    pub gradient: GradientKind,
    /// Seed of starts and branch searches.
    pub seed: u64,
    /// All settings of the search.
    pub settings: DesignSettings,
    /// The design that the first start began from.
    pub start: Evaluation,
    /// The best design.
    pub optimum: Evaluation,
    /// Which bounds are active there, by task.
    pub active_bounds: Vec<String>,
    /// Shadow prices: nats that one more unit of cost limit would save, by task.
    pub bound_prices: Vec<TaskPrice>,
    /// Nats that a unit more of budget would save; 0 where there is none or it is not used up.
    #[serde(default)]
    pub budget_nats_per_unit: f64,
    /// Different local minima of the plans seen at the best design, of the task that has most.
    pub branches: usize,
    /// The entries of catalogues that were chosen, where parameters have catalogues.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub catalogue: Option<CatalogueReport>,
    /// Causes of the change in each task's measured information from the start; empty in results of versions that did
    /// not compute it, and if plans have no total gradient.
    #[serde(default)]
    pub split: Vec<Split>,
    /// Every start; starts take no notice of catalogues.
    pub starts: Vec<StartReport>,
    /// Designs evaluated.
    pub evaluations: usize,
    /// Of these, how many have a plan that never makes a contact whose force a cost tracks; 0 in results of
    /// versions that did not count them.
    #[serde(default)]
    pub evaluations_without_contact: usize,
    /// Wall time of the search, s.
    pub seconds: f64,
    /// Wall time of evaluating start and optimum for this report, s; 0 in results of versions that did not measure it.
    #[serde(default)]
    pub report_seconds: f64,
}

/// A cost is at its limit up to this share of it.
const AT_LIMIT: f64 = 1e-3;

impl DesignReport {
    /// Whether the cost of a task is at its limit. Needed information is that at the limit, whatever the design costs: the limit may
    /// then have a price although the cost is below it.
    #[must_use]
    pub fn is_at_limit(&self, task: usize) -> bool {
        let cost = self.optimum.tasks.get(task).map(|task| &task.cost);
        let ends = cost.and_then(|cost| Some((cost.expected, cost.bound?)));
        ends.is_some_and(|(expected, bound)| expected >= bound - AT_LIMIT * bound.abs())
    }

    /// What the cost limit of a task saves, if it has a price: `limit active; +1 in cost saves 2.7 bits`, with numbers as `number`
    /// writes them.
    #[must_use]
    pub fn priced_limit(&self, task: usize, number: impl Fn(f64) -> String) -> Option<String> {
        let price = self.bound_prices.get(task).filter(|price| price.nats_per_unit > 0.0)?;
        let (rate, all) = (price.nats_per_unit / std::f64::consts::LN_2, self.optimum.objective.information_bits);
        Some(match self.is_at_limit(task) {
            true => format!("limit active; {}", supple_text::saves("cost", rate, all, number)),
            false => format!("met; what is needed depends on it: {}", supple_text::saves("limit", rate, all, number)),
        })
    }

    /// How many starts converged to the best design that any found, and how many to worse optima. Starts take no notice of
    /// catalogues.
    pub fn agreement(&self) -> (usize, usize) {
        let objective = |start: &StartReport| start.information_nats + self.settings.price_weight * start.price;
        let converged = self.starts.iter().filter(|start| start.status == DesignStatus::Converged);
        let ends: Vec<f64> = converged.map(objective).collect();
        let best = ends.iter().copied().fold(f64::INFINITY, f64::min);
        let same = ends.iter().filter(|&&end| (end - best).abs() <= 1e-4 * best.abs()).count();
        (same, ends.len() - same)
    }

    /// What to do where only one start found the best design, and others worse ones.
    #[must_use]
    pub fn advice(&self) -> &'static str {
        match self.agreement() {
            (1, 1..) => " Other starts ended at worse optima; more starts (`--starts`) may find a better one.",
            _ => "",
        }
    }

    /// The reduction of measured information that was predicted, if roll-outs at the start and at the optimum surely differ
    /// by less than half of it; `None` too if another information was minimised, or roll-outs did not measure it.
    #[must_use]
    pub fn unconfirmed(&self, about: &About) -> Option<Unconfirmed> {
        if self.settings.information != InformationWeights::MEASURED {
            return None;
        }
        let weights = || about.tasks.iter().map(|task| task.information_weight);
        let predicted = [&self.start, &self.optimum].map(|at| {
            at.tasks.iter().zip(weights()).map(|(task, weight)| weight * task.information.total_bits).sum::<f64>()
        });
        let (mut sampled, mut variance) = ([0.0; 2], 0.0);
        for (sum, at) in sampled.iter_mut().zip([&self.start, &self.optimum]) {
            for (task, weight) in at.tasks.iter().zip(weights()) {
                let bits = task.monte_carlo.as_ref()?.realised_bits?;
                *sum += weight * bits.mean;
                variance += (weight * bits.standard_error).powi(2);
            }
        }
        let [fall, found] = [predicted, sampled].map(|[from, to]| from - to);
        // Three standard errors, as in the verdicts on roll-outs.
        let surely = found + 3.0 * variance.sqrt() < 0.5 * fall;
        (fall > LEAST_FALL * predicted[0] && surely).then_some(Unconfirmed {
            predicted,
            sampled,
            standard_error: variance.sqrt(),
        })
    }

    /// That the optimum has more of what is minimised than a start within all limits, in words; `None` if it has not. A plan may
    /// change to another local minimum on the way, which is cheaper and needs more information.
    #[must_use]
    pub fn rises(&self) -> Option<String> {
        let [from, to] = [&self.start, &self.optimum].map(|at| at.objective.information_bits);
        let rises = self.start.feasible && to > from + LEAST_FALL * from.abs() && to.is_finite();
        rises.then(|| {
            format!(
                "the optimum has more information than the start, {} bits for {}, although the start is within all limits: its \
                 plans are at other local minima, so that designs are not compared alike. `supple evaluate --branches 24` finds \
                 what the start has there",
                short(to, 4),
                short(from, 4)
            )
        })
    }
}

/// A smaller share of the information at the start is not worth a word.
const LEAST_FALL: f64 = 0.02;

/// A reduction of information that roll-outs do not confirm: bits at the start and at the optimum, weighted as in the
/// objective.
///
/// ```
/// use supple_study::design::Unconfirmed;
///
/// let found = Unconfirmed { predicted: [16.0, 12.0], sampled: [20.0, 22.0], standard_error: 1.0 };
/// assert!(found.to_string().starts_with("roll-outs do not confirm the reduction: they measure 20 bits at the start and 22"));
/// assert!(!found.is_contradicted() && Unconfirmed { standard_error: 0.5, ..found }.is_contradicted());
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unconfirmed {
    /// As predicted.
    pub predicted: [f64; 2],
    /// In roll-outs.
    pub sampled: [f64; 2],
    /// Standard error of the difference of the latter.
    pub standard_error: f64,
}

impl Unconfirmed {
    /// Whether roll-outs surely measure more at the optimum than at the start, by three standard errors.
    #[must_use]
    pub fn is_contradicted(&self) -> bool {
        let [from, to] = self.sampled;
        to - from > 3.0 * self.standard_error
    }
}

impl std::fmt::Display for Unconfirmed {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        let [from, to] = self.sampled.map(|bits| short(bits, 4));
        let [start, optimum] = self.predicted.map(|bits| short(bits, 4));
        let verb = if self.is_contradicted() { "contradict" } else { "do not confirm" };
        write!(
            f,
            "roll-outs {verb} the reduction: they measure {from} bits at the start and {to} at the optimum, where {start} and \
             {optimum} are predicted"
        )
    }
}

/// What a task's bound is worth.
///
/// Example: the [module](crate::design).
#[derive(Clone, Debug, Serialize, Deserialize)]
#[non_exhaustive]
pub struct TaskPrice {
    /// The task.
    pub task: String,
    /// Nats that a unit more of bound would save.
    pub nats_per_unit: f64,
}

/// One start.
///
/// Example: the [module](crate::design).
#[derive(Clone, Debug, Serialize, Deserialize)]
#[non_exhaustive]
pub struct StartReport {
    /// How it ended.
    pub status: DesignStatus,
    /// Where it began.
    pub from: Named,
    /// Where it ended.
    pub to: Named,
    /// How often the minimised information reached zero and the search switched to the next kind of information.
    #[serde(default)]
    pub passed: usize,
    /// The information there, of the kind minimised last, nats; NaN where nothing could be evaluated.
    #[serde(deserialize_with = "supple::or_nan")]
    pub information_nats: f64,
    /// The sum of the parameters' prices there; 0 where none has one.
    #[serde(default, deserialize_with = "supple::or_nan")]
    pub price: f64,
    /// Expected cost of each task there.
    pub expected_costs: Vec<f64>,
    /// How far the worst task is above its bound, or the price above the budget where that is farther, relative to it.
    #[serde(deserialize_with = "supple::or_nan")]
    pub violation: f64,
    /// First-order optimality.
    #[serde(deserialize_with = "supple::or_nan")]
    pub optimality: f64,
    /// Different local minima of the plans seen at the end, of the task that has most.
    pub branches: usize,
    /// Designs evaluated.
    pub evaluations: usize,
    /// Of these, how many have a plan that never touches a contact from which a cost wants a force.
    #[serde(default)]
    pub evaluations_without_contact: usize,
    /// Whether it ended on request before it was done, whatever its status.
    #[serde(default)]
    pub interrupted: bool,
    /// Why it ended early, where it did.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub error: Option<String>,
}

/// Searches for a design, chooses from the catalogues that parameters have, and evaluates where it began and ended, with
/// trajectories. With a folder, a journal there keeps the starts that ended, and the same search resumes from it.
///
/// # Errors
/// Where there is nothing to design, or not even the first start can be evaluated; where the journal cannot be written, is
/// damaged, or belongs to another search.
///
/// Example: the [module](crate::design).
pub fn run(
    task: &LoadedTask,
    settings: &DesignSettings,
    folder: Option<&Path>,
    watch: Watch,
) -> Result<DesignReport, StudyError> {
    run_observed(task, settings, &Searching::new(watch.progress, settings.feasibility), folder, watch)
}

/// The same, with an observer of every design that is evaluated.
///
/// # Errors
/// As [`run`].
///
/// Example of an observer: [`Observer`].
pub fn run_observed(
    task: &LoadedTask,
    settings: &DesignSettings,
    observer: &dyn Observer,
    folder: Option<&Path>,
    watch: Watch,
) -> Result<DesignReport, StudyError> {
    let LoadedTask { problem, phi, .. } = task;
    check_designable(task)?;
    let searcher = searcher(task, settings, Control { observer, stop: watch.stop });
    let parts = Parts::open(folder, &identity(task, settings)?)?;
    watch.progress.begin("starts", 0, settings.starts as u64);
    let clock = Instant::now();
    let search = |start: usize| {
        let name = format!("start {start}");
        if let Some(found) = parts.find::<StartSummary>(&name)? {
            watch.progress.advance(1);
            return Ok(Some(checked(found, problem)?));
        }
        // The first start is always made: it is what there is to show.
        if start > 0 && watch.is_stopped() {
            return Ok(None);
        }
        let summary = searcher.search_start(phi, start)?;
        if !summary.interrupted {
            parts.keep(&name, &summary)?;
            watch.progress.advance(1);
        }
        Ok(Some(summary))
    };
    let starts: Vec<_> = (0..settings.starts).into_par_iter().map(search).collect::<Result<_, StudyError>>()?;
    let starts = starts.into_iter().flatten().collect();
    let kept = CombinationParts { parts: &parts, problem, error: Mutex::new(None) };
    let found = searcher.choose_kept(searcher.combine(starts, clock.elapsed().as_secs_f64())?, &kept)?;
    if let Some(error) = kept.error.into_inner().unwrap_or_else(PoisonError::into_inner) {
        return Err(error);
    }
    report(phi, &searcher, &found, watch.progress)
}

/// The designs of combinations of catalogue entries, as parts of a journal.
struct CombinationParts<'a> {
    parts: &'a Parts,
    problem: &'a Problem,
    /// Why one could not be read or kept.
    error: Mutex<Option<StudyError>>,
}

impl CombinationParts<'_> {
    fn name(entries: &[usize]) -> String {
        let entries: Vec<String> = entries.iter().map(ToString::to_string).collect();
        format!("combination {}", entries.join(" "))
    }

    fn note<T>(&self, done: Result<T, StudyError>) -> Option<T> {
        match done {
            Ok(done) => Some(done),
            Err(error) => {
                self.error.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
                None
            }
        }
    }
}

impl KeptCombinations for CombinationParts<'_> {
    fn find(&self, entries: &[usize]) -> Option<StartSummary> {
        let found = self.note(self.parts.find::<StartSummary>(&Self::name(entries))).flatten()?;
        self.note(checked(found, self.problem))
    }

    fn keep(&self, entries: &[usize], found: &StartSummary) {
        self.note(self.parts.keep(&Self::name(entries), found));
    }
}

/// What a search is.
fn identity(task: &LoadedTask, settings: &DesignSettings) -> Result<Identity, StudyError> {
    let text = serde_json::to_string_pretty(settings).map_err(|error| StudyError::usage(error.to_string()))?;
    Ok(Identity::of("design search", task, &(text + "\n"), &[]))
}

/// Does one start of the same search, for [`combine`]: what it found, for another process to read.
///
/// # Errors
/// Where there is nothing to design, total gradients are asked for along sampled plans, or it is stopped.
///
/// Example: the [module](crate::design).
pub fn run_start(
    task: &LoadedTask,
    settings: &DesignSettings,
    start: usize,
    control: Control,
) -> Result<StartSummary, StudyError> {
    check_designable(task)?;
    let summary = searcher(task, settings, control).search_start(&task.phi, start)?;
    if control.is_stopped() { Err(StudyError::Stopped) } else { Ok(summary) }
}

/// The report of starts that were searched from elsewhere, all of them and in their order: the same, to the last bit,
/// as that of [`run`], but for the wall times.
///
/// # Errors
/// Where a start is not of this task, or not even the first start can be evaluated.
///
/// Example: the [module](crate::design).
pub fn combine(
    task: &LoadedTask,
    settings: &DesignSettings,
    starts: Vec<StartSummary>,
    seconds: f64,
    control: Control,
) -> Result<DesignReport, StudyError> {
    let found = best_of(task, settings, starts, seconds, control)?;
    report(&task.phi, &searcher(task, settings, control), &found, &Silent)
}

/// The design that starts found together.
pub(crate) fn best_of(
    task: &LoadedTask,
    settings: &DesignSettings,
    starts: Vec<StartSummary>,
    seconds: f64,
    control: Control,
) -> Result<Design, StudyError> {
    let (found, wanted) = (starts.len(), settings.starts);
    if found != wanted {
        return Err(StudyError::Usage(format!("a search from {wanted} starts cannot end with {found} of them")));
    }
    let starts = starts.into_iter().map(|start| checked(start, &task.problem)).collect::<Result<_, _>>()?;
    let searcher = searcher(task, settings, control);
    Ok(searcher.choose(searcher.combine(starts, seconds)?)?)
}

/// What a start found, if it may be of this problem.
///
/// # Errors
/// Where it does not fit to the problem.
pub(crate) fn checked(start: StartSummary, problem: &Problem) -> Result<StartSummary, StudyError> {
    let count = problem.parameters.len();
    let is_plan = |(controls, task): (&Matrices, &Task)| {
        (controls.count(), controls.cols()) == (task.steps, task.system.dimensions().controls)
    };
    let planned = start.controls.len() == problem.tasks.len();
    let fits = start.from.len() == count
        && start.to.len() == count
        && (start.controls.is_empty() || planned && start.controls.iter().zip(&problem.tasks).all(is_plan));
    fits.then_some(start).ok_or_else(|| StudyError::usage("the result of a start does not match this task"))
}

fn searcher<'a>(task: &'a LoadedTask, settings: &'a DesignSettings, control: Control<'a>) -> Searcher<'a> {
    Searcher::new(&task.problem, settings, Aim::default(), control)
}

/// Checks that a task has something to design.
pub(crate) fn check_designable(task: &LoadedTask) -> Result<(), StudyError> {
    if task.problem.parameters.design().is_empty() {
        let name = task.sources.first().map_or("the task", |source| &source.path);
        let message = format!("{name} has no parameter with role = \"design\": there is nothing to design");
        return Err(StudyError::Usage(message));
    }
    Ok(())
}

/// Why the numbers of a plan cannot be trusted: how it ended, and contacts that it misses.
pub(crate) fn warnings_of(task: &Task, phi: &[f64], state: &TaskState) -> Vec<String> {
    let contacts = contact_reports(task, phi, &state.plan.trajectory);
    [
        task.distrust(),
        plan_warnings(task, phi, &state.plan),
        contact_warnings(task, phi, &contacts),
        number_warnings(task, state, None),
    ]
    .concat()
}

/// Evaluates both ends of a search, each on a thread of its own, and finds where the change between them comes from. Once
/// the search is stopped, leaves out what takes long.
fn report(
    phi: &[f64],
    searcher: &Searcher,
    found: &Design,
    progress: &dyn Progress,
) -> Result<DesignReport, StudyError> {
    let (problem, settings, best) = (searcher.problem, searcher.settings, found.found());
    let clock = Instant::now();
    let ends = Ends { searcher, phi, best, progress };
    let mut cut_short = searcher.control.is_stopped();
    let full = if cut_short { Err(supple::Error::Stopped) } else { ends.evaluate(false) };
    let (start, optimum) = match full {
        Err(supple::Error::Stopped) => {
            // All starts have ended; clear the stop request, so that the report can be computed.
            halt::request(false);
            cut_short = true;
            ends.evaluate(true)?
        }
        full => full?,
    };
    let split = match settings.gradient {
        GradientKind::Total if !cut_short => ends.split(&start).unwrap_or_else(|| {
            cut_short = true;
            Vec::new()
        }),
        GradientKind::Total | GradientKind::Frozen => Vec::new(),
    };
    let active = |(task, price): (&Task, &f64)| (*price > 0.0).then(|| task.name.clone());
    let price = |(task, &nats_per_unit): (&Task, &f64)| TaskPrice { task: task.name.clone(), nats_per_unit };
    Ok(DesignReport {
        status: if cut_short { DesignStatus::Stopped } else { found.status },
        method: settings.method,
        gradient: settings.gradient,
        seed: settings.seed,
        settings: settings.clone(),
        start,
        optimum,
        active_bounds: problem.tasks.iter().zip(&best.multipliers).filter_map(active).collect(),
        bound_prices: problem.tasks.iter().zip(&best.multipliers).map(price).collect(),
        budget_nats_per_unit: best.budget_multiplier,
        branches: best.branches,
        catalogue: CatalogueReport::of(searcher, found),
        split,
        starts: found.starts.iter().map(|summary| start_report(problem, summary)).collect(),
        evaluations: found.evaluations,
        evaluations_without_contact: found.without_contact,
        seconds: found.seconds,
        report_seconds: clock.elapsed().as_secs_f64(),
    })
}

/// How far each of several tasks is.
struct Shares {
    of_tasks: Mutex<Vec<f64>>,
    told: AtomicU64,
}

impl Shares {
    /// By how many percent all tasks together are further now that one is at a share of its own.
    fn more(&self, task: usize, share: f64) -> u64 {
        let Ok(mut shares) = self.of_tasks.lock() else { return 0 };
        shares[task] = share;
        let percent = (100.0 * shares.iter().sum::<f64>() / shares.len() as f64).floor() as u64;
        percent.saturating_sub(self.told.fetch_max(percent, Ordering::Relaxed))
    }
}

/// Where a search began and ended.
struct Ends<'a> {
    searcher: &'a Searcher<'a>,
    phi: &'a [f64],
    best: &'a StartSummary,
    progress: &'a dyn Progress,
}

impl Ends<'_> {
    /// The causes of the change of information between both ends, by task; `None` if it is stopped.
    fn split(&self, start: &Evaluation) -> Option<Vec<Split>> {
        let Self { phi, best, progress, .. } = self;
        let problem = self.searcher.problem;
        let nats: Vec<f64> = start.tasks.iter().map(|task| task.information.total_nats).collect();
        progress.begin("causes of the change of information, percent", 0, 100);
        let shares = Shares { of_tasks: Mutex::new(vec![0.0; nats.len()]), told: AtomicU64::new(0) };
        let tell = |task: usize, share: f64| progress.advance(shares.more(task, share));
        let change = Change { from: phi, from_nats: &nats, to: &best.to, to_controls: &best.controls };
        match problem.split_watched(change, &tell) {
            Err(supple::Error::Stopped) => None,
            // Intermediate plans may be missing even if both ends have them.
            split => Some(split.unwrap_or_default()),
        }
    }

    /// Evaluates both designs with trajectories; if `brief`, without roll-outs and the information needed, unless that
    /// is minimised.
    fn evaluate(&self, brief: bool) -> Result<(Evaluation, Evaluation), supple::Error> {
        let Searcher { problem, settings, .. } = *self.searcher;
        let wanted = EvaluateOptions {
            total_gradient: true,
            needed: !brief,
            rollouts: if brief { 0 } else { problem.rollouts(settings.rollouts) },
            seed: settings.seed,
            trajectories: true,
            information: Some(settings.information),
            feasibility: Some(settings.feasibility),
            ..Default::default()
        };
        self.progress.begin("evaluation of start and optimum", 0, 2);
        let evaluate = |phi: &[f64], controls: Option<Vec<Matrices>>| {
            let wanted = EvaluateOptions { controls, ..wanted.clone() };
            let evaluated = problem.evaluate(phi, &wanted).or_else(|error| match error {
                supple::Error::Stopped => Err(error),
                // A plan that has no gradient is a result all the same.
                _ => problem.evaluate(phi, &EvaluateOptions { total_gradient: false, ..wanted }).map_err(|_| error),
            });
            self.progress.advance(1);
            evaluated
        };
        let (start, optimum) =
            rayon::join(|| evaluate(self.phi, None), || evaluate(&self.best.to, Some(self.best.controls.clone())));
        Ok((start?, optimum?))
    }
}

fn start_report(problem: &Problem, summary: &StartSummary) -> StartReport {
    StartReport {
        status: summary.status,
        from: Named::new(&problem.parameters, &summary.from),
        to: Named::new(&problem.parameters, &summary.to),
        passed: summary.passed,
        information_nats: summary.information,
        price: summary.price,
        expected_costs: summary.costs.clone(),
        violation: summary.violation.max(summary.overspent),
        optimality: summary.optimality,
        branches: summary.branches,
        evaluations: summary.evaluations,
        evaluations_without_contact: summary.without_contact,
        interrupted: summary.interrupted,
        error: summary.error.as_ref().map(ToString::to_string),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tasks_at_work_together_advance_by_whole_percents_of_all() {
        let shares = Shares { of_tasks: Mutex::new(vec![0.0; 2]), told: AtomicU64::new(0) };
        let told = [(0, 0.5), (1, 0.011), (1, 0.5), (0, 0.5), (1, 1.0), (0, 1.0)];
        assert_eq!(told.map(|(task, share)| shares.more(task, share)), [25, 0, 25, 0, 25, 25]);
    }
}
