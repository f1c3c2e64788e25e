//! Which sensors to buy: the best set of a catalogue, what every sensor is worth, and a certificate.
//!
//! # A choice among the measurements of a task
//!
//! ```
//! use supple_study::sensors::{Search, SensorGoal, SensorMethod, SensorsOptions, SetBy, run};
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
//! let options = SensorsOptions {
//!     count: Some(1),
//!     goal: SensorGoal::Information,
//!     method: SensorMethod::Exhaustive,
//!     ..SensorsOptions::default()
//! };
//! let study = run(&task, &options, Watch::default())?;
//! assert_eq!(study.chosen.sensors, ["y1"]);
//! assert!(study.sensors[0].chosen && study.sensors[0].bits_alone > 0.0);
//! assert_eq!((study.none.by, study.certificate.search), (SetBy::Given, Some(Search::Exhaustive)));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use supple::plan::PlanMode;
use supple::sensors::{Candidate, Chosen, Goal, Selected, Selection, every_measurement, select};
use supple::{Named, lqg};
use supple_file::{ReadOptions, WithSensors};

mod options;
mod report;

pub use options::{SensorGoal, SensorMethod, SensorsOptions};
pub use report::{Certificate, Search, SensorSet, SensorValue, Sensors, SetBy};
use report::{Searched, value_of};

use crate::{LoadedTask, Source, StudyError, Watch};

/// Candidates of an exhaustive search; beyond them, branch and bound.
const EXHAUSTIVE: usize = 15;

/// Regions of branch and bound, where it may give up.
const REGIONS: usize = 2000;

/// Chooses sensors from the catalogue of a task; without one, from its own measurements, each of which is a candidate
/// without a price. Where a bound on the cost asks for the cheapest set and nothing has a price, each costs 1.
///
/// # Errors
/// Where something asked for cannot be, a plan or covariance cannot be computed, no set is good enough, or it is told
/// to stop.
///
/// Example: the [module](crate::sensors).
pub fn run(task: &LoadedTask, options: &SensorsOptions, watch: Watch) -> Result<Sensors, StudyError> {
    options.check()?;
    let (Selected { mut selection, plans }, kinds) = selection(task, options.task.as_deref())?;
    if options.cost.is_some() && selection.candidates.iter().all(|candidate| candidate.price == 0.0) {
        // With unit prices, the cheapest set is the smallest.
        selection.candidates.iter_mut().for_each(|candidate| candidate.price = 1.0);
    }
    let (goal, limits) = (options.goal(), options.limits());
    let none = selection.worth(&vec![false; selection.candidates.len()]);
    let all: Vec<usize> = (0..selection.candidates.len()).collect();
    let greedy = selection.greedy(goal, limits);
    if watch.is_stopped() {
        return Err(StudyError::Stopped);
    }
    let greedy = match greedy {
        // A search of all sets may find one.
        Err(lqg::Error::NoSensorsSuffice { .. } | lqg::Error::NoSensorsFound { .. })
            if options.method != SensorMethod::Greedy =>
        {
            None
        }
        found => Some(found?),
    };
    let relaxed = selection.bound(goal, limits)?;
    let searched = search(&selection, options, watch)?;
    let best = searched.as_ref().map(|found| found.chosen.clone());
    let Some(chosen) = better(goal, greedy.clone(), best) else {
        return Err(StudyError::usage("no set of sensors was found"));
    };
    let certificate = Certificate::of(goal, none, greedy.as_ref(), &relaxed, searched.as_ref());
    let considered = |name: &String| options.task.as_ref().is_none_or(|only| only == name);
    let tasks = task.problem.tasks.iter().map(|task| task.name.clone()).filter(considered);
    Ok(Sensors {
        options: options.clone(),
        parameters: Named::new(&task.problem.parameters, &task.phi),
        tasks: tasks.collect(),
        catalogue: task.problem.catalogue.is_some(),
        none: SensorSet::of(&selection, &[], SetBy::Given),
        all: SensorSet::of(&selection, &all, SetBy::Given),
        greedy: greedy.map(|chosen| SensorSet::of(&selection, &chosen.sensors, SetBy::of(chosen.rule))),
        best: searched.map(|found| SensorSet::of(&selection, &found.chosen.sensors, SetBy::Search)),
        chosen: SensorSet::of(&selection, &chosen.sensors, SetBy::of(chosen.rule)),
        certificate,
        sensors: report::values(&selection, &kinds, &chosen.sensors, &relaxed.weights),
        plans,
        remarks: remarks(task, options, &selection),
    })
}

/// What a reader should know of the choice.
fn remarks(task: &LoadedTask, options: &SensorsOptions, selection: &Selection) -> Vec<String> {
    let is_free = selection.candidates.iter().all(|candidate| candidate.price == 0.0);
    let of_budget = (options.budget.is_some() && is_free).then(|| {
        "no sensor has a price, so that the budget limits nothing: give prices in a catalogue, or `--count`".to_owned()
    });
    let of_plan = (task.problem.planning.plan != PlanMode::Nominal).then(|| {
        "all sets of sensors are compared along the plan that is made with every sensor, but this kind of plan depends on the \
         sensors: evaluate the task with the sets that matter"
            .to_owned()
    });
    let joined = if task.problem.catalogue.is_some() { Vec::new() } else { report::joined(selection) };
    of_plan.into_iter().chain(of_budget).chain(joined).collect()
}

/// The candidates, with what kind each is.
fn selection(task: &LoadedTask, only: Option<&str>) -> Result<(Selected, Vec<String>), StudyError> {
    let LoadedTask { problem, phi, sources, kinds } = task;
    let (Some(_), Some(first)) = (&problem.catalogue, sources.first()) else {
        let selected = select(problem, phi, every_measurement(problem, phi)?, only)?;
        let kinds = vec!["measurement".to_owned(); selected.selection.candidates.len()];
        return Ok((selected, kinds));
    };
    // The task as it was read has the chosen sensors only.
    let files = Source::files(sources);
    let options = ReadOptions { kinds: kinds.clone(), sensors: WithSensors::All, files };
    let mut whole = supple_file::parse_with(&first.text, &first.path, options)?;
    for (task, chosen) in whole.tasks.iter_mut().zip(&problem.tasks) {
        task.known_controls.clone_from(&chosen.known_controls);
    }
    let sensors = whole.catalogue.clone().unwrap_or_default();
    let kinds = sensors.iter().map(|sensor| sensor.kind.clone()).collect();
    let candidates =
        sensors.into_iter().map(|sensor| Candidate { name: sensor.name, price: sensor.price, rows: sensor.rows });
    Ok((select(&whole, phi, candidates.collect(), only)?, kinds))
}

/// Searches all sets, where that is asked for.
fn search(selection: &Selection, options: &SensorsOptions, watch: Watch) -> Result<Option<Searched>, StudyError> {
    let (goal, limits) = (options.goal(), options.limits());
    if options.method == SensorMethod::Greedy {
        return Ok(None);
    }
    if selection.candidates.len() <= EXHAUSTIVE {
        let rounds = selection.exhaustive_rounds(goal, limits) as u64;
        watch.progress.begin("rounds of sets of sensors", 0, rounds);
        let mut first = true;
        let mut going = || {
            watch.progress.advance(u64::from(!std::mem::take(&mut first)));
            !watch.is_stopped()
        };
        let chosen = selection.exhaustive(goal, limits, &mut going)?;
        let bound = value_of(goal, &chosen);
        return Ok(Some(Searched { chosen, kind: Search::Exhaustive, bound, proved: true }));
    }
    let most = if options.method == SensorMethod::Exhaustive { usize::MAX } else { REGIONS };
    watch.progress.begin("regions of sets of sensors", 0, 0);
    let mut going = || {
        watch.progress.advance(1);
        !watch.is_stopped()
    };
    let found = selection.branch_and_bound(goal, limits, most, &mut going)?;
    if watch.is_stopped() {
        return Err(StudyError::Stopped);
    }
    let (bound, proved) = (found.bound, found.proved);
    Ok(Some(Searched { chosen: found.chosen, kind: Search::BranchAndBound, bound, proved }))
}

/// The better of two sets; the first where they are as good.
fn better(goal: Goal, first: Option<Chosen>, second: Option<Chosen>) -> Option<Chosen> {
    let (Some(first), Some(second)) = (&first, &second) else { return first.or(second) };
    let [a, b] = [first, second].map(|chosen| match goal {
        Goal::MostInformation => -value_of(goal, chosen),
        _ => value_of(goal, chosen),
    });
    let margin = 1e-9 * a.abs();
    Some(if b < a - margin { second.clone() } else { first.clone() })
}
