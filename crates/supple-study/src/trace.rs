//! Traces: the designs that searches visit on their way.
//!
//! # The path of one search
//!
//! ```
//! use supple::design::{GradientKind, Method};
//! use supple_study::trace::{TraceOptions, run};
//! use supple_study::{LoadedTask, Source, Watch};
//! # let text = r#"
//! #     model = { kind = "linear", A = [[1.0]], B = [[1.0]], C = [[1.0]] }
//! #     parameters.variance = { initial = 1e-2, bounds = [1e-4, 1.0] }
//! #     [[tasks]]
//! #     name = "hold"
//! #     steps = 20
//! #     time_step = 0.1
//! #     initial_state = [1.0]
//! #     noise = { initial = [1e-2], process = [1e-3], measurement = ["variance"] }
//! #     costs = [{ kind = "quadratic", Q = [[1.0]], R = [[1.0]] }]
//! # "#;
//! # let source = Source { path: "hold.toml".to_owned(), text: text.to_owned() };
//!
//! // The task of the front page.
//! let task = LoadedTask::restore(&[source])?;
//! let options =
//!     TraceOptions { starts: 1, methods: vec![Method::Sqp], gradients: vec![GradientKind::Total], seed: 0 };
//! let trace = run(&task, &options, None, Watch::default())?;
//! let search = &trace.runs[0];
//! assert!(search.is_within() && trace.best() == Some(search));
//! assert!(!search.path.is_empty() && search.stepped().count() >= 1);
//! assert!(search.end.information_nats < search.path[0].information_nats);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use std::fmt::Write;
use std::path::Path;
use std::sync::{Mutex, MutexGuard, PoisonError};

use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use supple::design::{
    Aim, Control, DesignSettings, DesignStatus, Event, GradientKind, Method, Observer, Searcher, StartSummary,
};
use supple::parameters::Parameters;
use supple::{Named, Problem};

use crate::design::check_designable;
use crate::journal::{Identity, Parts};
use crate::{LoadedTask, StudyError, Watch};

/// What a study of traces does.
///
/// Example: the [module](crate::trace).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TraceOptions {
    /// Starts: the initial values, then seeded random ones.
    pub starts: usize,
    /// Optimisers to compare.
    pub methods: Vec<Method>,
    /// Gradients to compare.
    pub gradients: Vec<GradientKind>,
    /// Seed of starts.
    pub seed: u64,
}

/// The paths of searches.
///
/// Example: the [module](crate::trace).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Trace {
    /// What was asked for.
    pub options: TraceOptions,
    /// One run per method, gradient and start, in this order of nesting; of a study that was stopped, those that had begun.
    pub runs: Vec<TraceRun>,
    /// Whether it was stopped before all searches had ended.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub stopped: bool,
}

/// One search from one start.
///
/// Example: the [module](crate::trace).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TraceRun {
    /// Optimiser.
    pub method: Method,
    /// Gradient.
    pub gradient: GradientKind,
    /// Number of the start.
    pub start: usize,
    /// How it ended.
    pub status: DesignStatus,
    /// Designs in the order in which they were visited.
    pub path: Vec<TracePoint>,
    /// Places in `path` of the designs that the optimiser stepped to, in order; the others are trials of its line
    /// searches.
    #[serde(default)]
    pub steps: Vec<usize>,
    /// Where it ended: the best design.
    pub end: TracePoint,
    /// Why it ended early, where it did.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub error: Option<String>,
}

/// A visited design.
///
/// Example: the [module](crate::trace).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TracePoint {
    /// All parameters.
    pub parameters: Named,
    /// Information, nats.
    #[serde(deserialize_with = "supple::or_nan")]
    pub information_nats: f64,
    /// Expected cost of each task.
    pub costs: Vec<f64>,
}

impl Trace {
    /// The search that ended at the best design within all bounds; `None` if none did.
    #[must_use]
    pub fn best(&self) -> Option<&TraceRun> {
        let within = self.runs.iter().filter(|run| run.is_within());
        within.min_by(|a, b| a.end.information_nats.total_cmp(&b.end.information_nats))
    }
}

impl TraceRun {
    /// Whether it ended at a design that meets every bound.
    #[must_use]
    pub fn is_within(&self) -> bool {
        self.status.meets_bounds() && self.end.information_nats.is_finite()
    }

    /// The designs that the optimiser stepped to, and where it ended.
    pub fn stepped(&self) -> impl Iterator<Item = &TracePoint> + Clone {
        self.steps.iter().filter_map(|&step| self.path.get(step)).chain(std::iter::once(&self.end))
    }
}

/// Runs every search and keeps what it visits. All methods and gradients begin from the same starts, and all other
/// settings are those of the task. What was visited until it is stopped is kept; with a folder, a journal there keeps the
/// searches that ended, and the same study resumes from it.
///
/// # Errors
/// Where there is nothing to design, a method or gradient is named twice, or not even one start can be evaluated; where it
/// is told to stop before any search has visited a design; where the journal cannot be written, is damaged, or belongs to
/// another study.
///
/// Example: the [module](crate::trace).
pub fn run(
    task: &LoadedTask,
    options: &TraceOptions,
    folder: Option<&Path>,
    watch: Watch,
) -> Result<Trace, StudyError> {
    let TraceOptions { starts, methods, gradients, .. } = options;
    check_designable(task)?;
    check_list("method", methods)?;
    check_list("gradient", gradients)?;
    let kinds: Vec<(Method, GradientKind)> =
        methods.iter().flat_map(|&method| gradients.iter().map(move |&gradient| (method, gradient))).collect();
    let parts = Parts::open(folder, &identity(task, options))?;
    watch.progress.begin("searches", 0, (kinds.len() * starts) as u64);
    let search =
        |&(method, gradient): &(Method, GradientKind)| searches(task, options, method, gradient, &parts, watch);
    let runs = kinds.par_iter().map(search).collect::<Result<Vec<_>, _>>()?.concat();
    if runs.is_empty() {
        return Err(StudyError::Stopped);
    }
    let ended = runs.iter().filter(|run| run.status != DesignStatus::Stopped).count();
    Ok(Trace { options: options.clone(), runs, stopped: ended < kinds.len() * starts && watch.is_stopped() })
}

/// What a study of traces is.
fn identity(task: &LoadedTask, options: &TraceOptions) -> Identity {
    let TraceOptions { starts, methods, gradients, seed } = options;
    let mut text = format!("starts {starts}\nseed {seed}\n");
    for method in methods {
        let _ = writeln!(text, "method {method}");
    }
    for gradient in gradients {
        let _ = writeln!(text, "gradient {gradient}");
    }
    Identity::of("study of traces", task, &text, &[])
}

fn check_list<T: PartialEq + std::fmt::Display>(what: &str, list: &[T]) -> Result<(), StudyError> {
    if list.is_empty() {
        return Err(StudyError::usage(format!("no {what} is named; name at least one")));
    }
    match list.iter().enumerate().find(|(i, item)| list[..*i].contains(item)) {
        Some((_, item)) => Err(StudyError::usage(format!("the {what} {item} is named twice; name each one once"))),
        None => Ok(()),
    }
}

/// The searches of one method and gradient, from all starts.
fn searches(
    task: &LoadedTask,
    options: &TraceOptions,
    method: Method,
    gradient: GradientKind,
    parts: &Parts,
    watch: Watch,
) -> Result<Vec<TraceRun>, StudyError> {
    let LoadedTask { problem, phi, .. } = task;
    let TraceOptions { starts, seed, .. } = *options;
    let settings = DesignSettings { method, gradient, starts, seed, ..problem.design.clone() };
    settings.check().map_err(|unfit| StudyError::usage(unfit.to_string()))?;
    let recorder =
        Recorder { parameters: &problem.parameters, paths: (0..starts).map(|_| Mutex::<Visited>::default()).collect() };
    let control = Control { observer: &recorder, stop: watch.stop };
    let searcher = Searcher::new(problem, &settings, Aim::default(), control);
    let search = |start: usize| {
        let name = format!("{method} {gradient} {start}");
        let mut found = parts.find::<Search>(&name)?;
        if found.is_none() && !watch.is_stopped() {
            let summary = searcher.search_start(phi, start)?;
            let visited = std::mem::take(&mut *recorder.of(start));
            let search = Search::new(problem, method, gradient, start, summary, visited);
            // What was under way when it was told to stop may be cut short.
            if !watch.is_stopped() {
                parts.keep(&name, &search)?;
            }
            found = Some(search);
        }
        if found.is_some() {
            watch.progress.advance(1);
        }
        Ok(found)
    };
    let found: Vec<Option<Search>> = (0..starts).into_par_iter().map(search).collect::<Result<_, StudyError>>()?;
    let found: Vec<Search> = found.into_iter().flatten().collect();
    if let [first, ..] = &found[..]
        && found.iter().all(|search| search.is_empty)
        && let Some(error) = &first.run.error
        && !watch.is_stopped()
    {
        return Err(first.cause.clone().unwrap_or_else(|| supple::Error::Elsewhere(error.clone())).into());
    }
    // Runs that were stopped before they visited a design have nothing to show.
    let begun = |run: &TraceRun| run.status != DesignStatus::Stopped || !run.path.is_empty();
    Ok(found.into_iter().map(|search| search.run).filter(begun).collect())
}

/// A search, as the journal keeps it.
#[derive(Serialize, Deserialize)]
struct Search {
    run: TraceRun,
    /// Whether no design could be evaluated.
    is_empty: bool,
    /// The error of the run; only of a search of this process.
    #[serde(skip)]
    cause: Option<supple::Error>,
}

impl Search {
    fn new(
        problem: &Problem,
        method: Method,
        gradient: GradientKind,
        start: usize,
        summary: StartSummary,
        visited: Visited,
    ) -> Self {
        let is_empty = summary.controls.is_empty();
        let run = TraceRun {
            method,
            gradient,
            start,
            status: summary.status,
            path: visited.points,
            steps: visited.steps,
            end: TracePoint {
                parameters: Named::new(&problem.parameters, &summary.to),
                information_nats: summary.information,
                costs: summary.costs,
            },
            error: summary.error.as_ref().map(ToString::to_string),
        };
        Self { run, is_empty, cause: summary.error }
    }
}

/// What a start has visited until now.
#[derive(Default)]
struct Visited {
    points: Vec<TracePoint>,
    steps: Vec<usize>,
    /// Whether the last step may still be taken back.
    on_trial: bool,
}

/// Keeps the designs that each start visits.
struct Recorder<'a> {
    parameters: &'a Parameters,
    paths: Vec<Mutex<Visited>>,
}

impl Recorder<'_> {
    /// What a start has visited.
    fn of(&self, start: usize) -> MutexGuard<'_, Visited> {
        self.paths[start].lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Observer for Recorder<'_> {
    fn observe(&self, event: Event) {
        match event {
            Event::Evaluated { start, design, information, costs, .. } => {
                let point = TracePoint {
                    parameters: Named::new(self.parameters, design),
                    information_nats: information,
                    costs: costs.to_vec(),
                };
                self.of(start).points.push(point);
            }
            Event::Stepped { start, design, is_trial } => {
                let mut path = self.of(start);
                let named = Named::new(self.parameters, design);
                let place = path.points.iter().rposition(|point| point.parameters == named);
                if let Some(place) = place.filter(|place| path.steps.last() != Some(place)) {
                    if path.on_trial && !is_trial {
                        path.steps.pop();
                    }
                    path.steps.push(place);
                    path.on_trial = is_trial;
                }
            }
            _ => {}
        }
    }
}
