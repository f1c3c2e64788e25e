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
//! let task = LoadedTask::restore(&[source], &[])?;
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

use serde::{Deserialize, Serialize};
use supple::Named;
use supple::plan::PlanMode;
use supple::sensors::{Candidate, Chosen, Goal, Limits, Selection, Worth, every_measurement, select};
use supple_file::{ReadOptions, WithSensors};
use supple_text::digits;

mod report;

pub use report::{Certificate, Search, SensorSet, SensorValue, Sensors, SetBy};

use crate::{LoadedTask, Source, StudyError, Watch};

/// What a set of sensors is chosen for.
///
/// Example: the [module](crate::sensors).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum SensorGoal {
    /// The least expected cost within budget and count; or, with a bound on the cost, the least price.
    #[default]
    Cost,
    /// The most information within budget and count.
    Information,
}

/// How a set of sensors is searched for.
///
/// Example: the [module](crate::sensors).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum SensorMethod {
    /// One sensor after the other.
    Greedy,
    /// All sets; beyond 15 candidates by branch and bound, until the best one is proved.
    Exhaustive,
    /// Both; branch and bound gives up after 2,000 regions.
    #[default]
    Both,
}

/// What is asked for.
///
/// Example: the [module](crate::sensors).
#[derive(Clone, Debug, Default, PartialEq, Deserialize, Serialize)]
#[serde(default, deny_unknown_fields)]
pub struct SensorsOptions {
    /// Prices of all together at most.
    pub budget: Option<f64>,
    /// Sensors at most.
    pub count: Option<usize>,
    /// Limit on the expected cost: selects the cheapest set within it, or the smallest set if no sensor has a
    /// price.
    pub cost: Option<f64>,
    /// What is chosen for.
    pub goal: SensorGoal,
    /// How.
    pub method: SensorMethod,
    /// The only task that is looked at; default: all of them.
    pub task: Option<String>,
}

impl SensorsOptions {
    fn check(&self) -> Result<(), StudyError> {
        let wrong = |what: &str, value: f64| {
            Err(StudyError::usage(format!("{what} must be at least 0; found {}", digits(value))))
        };
        match self {
            Self { budget: Some(budget), .. } if !(*budget >= 0.0 && budget.is_finite()) => {
                wrong("the budget", *budget)
            }
            Self { cost: Some(cost), .. } if !(*cost >= 0.0 && cost.is_finite()) => {
                wrong("the bound on the expected cost", *cost)
            }
            Self { cost: Some(_), goal: SensorGoal::Information, .. } => Err(StudyError::usage(
                "--cost selects the cheapest set and cannot be combined with --for information; remove one of them",
            )),
            _ => Ok(()),
        }
    }

    fn goal(&self) -> Goal {
        match (self.cost, self.goal) {
            (Some(cost), _) => Goal::LeastPrice { cost },
            (None, SensorGoal::Cost) => Goal::LeastCost,
            (None, SensorGoal::Information) => Goal::MostInformation,
        }
    }

    fn limits(&self) -> Limits {
        Limits { budget: self.budget, count: self.count }
    }
}

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
    if task.problem.planning.plan != PlanMode::Nominal {
        watch.progress.say(
            "all sets of sensors are compared along the plan that is made with every sensor, but this kind of plan depends on \
             the sensors: evaluate the task with the sets that matter",
        );
    }
    let (mut selection, kinds) = selection(task, options.task.as_deref())?;
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
    if greedy.is_none() && options.method == SensorMethod::Greedy {
        return Err(selection.not_found(goal).into());
    }
    let relaxed = selection.bound(goal, limits);
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
    })
}

/// The candidates, with what kind each is.
fn selection(task: &LoadedTask, only: Option<&str>) -> Result<(Selection, Vec<String>), StudyError> {
    let LoadedTask { problem, phi, sources, kinds } = task;
    let (Some(_), Some(first)) = (&problem.catalogue, sources.first()) else {
        let selection = select(problem, phi, every_measurement(problem, phi)?, only)?;
        let kinds = vec!["measurement".to_owned(); selection.candidates.len()];
        return Ok((selection, kinds));
    };
    // The task as it was read has the chosen sensors only.
    let files = Source::files(sources);
    let options = ReadOptions { kinds: kinds.clone(), sensors: WithSensors::All, files };
    let problem = supple_file::parse_with(&first.text, &first.path, options)?;
    let sensors = problem.catalogue.clone().unwrap_or_default();
    let kinds = sensors.iter().map(|sensor| sensor.kind.clone()).collect();
    let candidates =
        sensors.into_iter().map(|sensor| Candidate { name: sensor.name, price: sensor.price, rows: sensor.rows });
    Ok((select(&problem, phi, candidates.collect(), only)?, kinds))
}

/// What a search of all sets found.
struct Searched {
    chosen: Chosen,
    kind: Search,
    /// In units of the goal.
    bound: f64,
    proved: bool,
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
        let Some(chosen) = selection.exhaustive(goal, limits, &mut going)? else {
            return Err(StudyError::Stopped);
        };
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

/// Expected cost, information in nats, or price of a set, by the goal.
fn value_of(goal: Goal, chosen: &Chosen) -> f64 {
    match goal {
        Goal::LeastCost => chosen.worth.cost,
        Goal::MostInformation => chosen.worth.information,
        Goal::LeastPrice { .. } => chosen.price,
    }
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

/// What a set gains over no candidate at all: cost saved, or nats.
fn gain(goal: Goal, none: Worth, worth: Worth) -> f64 {
    match goal {
        Goal::MostInformation => worth.information - none.information,
        _ => none.cost - worth.cost,
    }
}
