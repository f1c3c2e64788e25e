use supple::design::InformationWeights;
use supple::parameters::Parameter;
use supple::{Contact, Task};

use super::options::SweepOptions;
use crate::{Column, LoadedTask, StudyError};

/// The unit and description of a column that counts or names something.
const PLAIN: &str = "";

/// The columns of a sweep: all parameters, then results.
///
/// # Errors
/// Where a parameter or task is named as a column of results is.
pub(super) fn columns(task: &LoadedTask, options: &SweepOptions) -> Result<Vec<Column>, StudyError> {
    let parameter = |parameter: &Parameter| {
        let on_axis = options.axes.iter().any(|axis| axis.parameter == parameter.name);
        let designed = options.starts > 0 && parameter.role == supple::parameters::Role::Design;
        let description = match (on_axis, designed) {
            (true, _) => "parameter on an axis",
            (false, true) => "parameter, designed at every point",
            (false, false) => "parameter, the same at every point",
        };
        column(parameter.name.clone(), &parameter.unit, description)
    };
    let mut columns: Vec<Column> = task.problem.parameters.iter().map(parameter).collect();
    let overall = [
        ("information_nats", "nat", "directed information from state to measurements, weighted sum over tasks"),
        ("information_bits", "bit", "the same in bits"),
        ("feasible", PLAIN, FEASIBLE),
    ];
    columns.extend(overall.map(|(name, unit, description)| column(name.into(), unit, description)));
    let aim = task.problem.design.information;
    if aim != InformationWeights::MEASURED {
        let what = format!("what a design minimises, weighted sum over tasks: information {aim}");
        columns.push(column("minimised_nats".into(), "nat", &what));
    }
    if options.starts > 0 {
        columns.push(column("design_status".into(), PLAIN, DESIGN_ENDED));
        columns.push(column("design_evaluations".into(), PLAIN, DESIGNS));
    }
    for task in &task.problem.tasks {
        let name = &task.name;
        let results = [
            ("status", PLAIN, PLAN_ENDED),
            ("information_nats", "nat", "directed information from state to measurements"),
            ("bits_per_second", "bit/s", "directed information per measurement, divided by the time step"),
            ("expected_cost", PLAIN, "expected cost in closed loop"),
            ("nominal_cost", PLAIN, "cost of the plan without noise"),
            ("iterations", PLAIN, ITERATIONS),
        ];
        let sampled = [
            ("sampled_cost_mean", PLAIN, "mean cost of roll-outs in closed loop"),
            ("sampled_cost_standard_error", PLAIN, "standard error of that mean"),
        ];
        let results = results.into_iter().chain(sampled.into_iter().filter(|_| options.rollouts > 0));
        columns.extend(results.map(|(result, unit, what)| column(format!("{name}.{result}"), unit, what)));
        columns.extend(of_contacts(task));
    }
    columns.push(column("error".into(), PLAIN, NO_RESULT));
    let mut names: Vec<&str> = columns.iter().map(|column| &*column.name).collect();
    names.sort_unstable();
    match names.windows(2).find(|pair| pair[0] == pair[1]) {
        Some(pair) => Err(StudyError::usage(format!(
            "two columns of the table would be named `{}`; rename the parameter or task",
            pair[0]
        ))),
        None => Ok(columns),
    }
}

/// The columns of what the plan of a task touches; empty if its model has no contacts.
fn of_contacts(task: &Task) -> Vec<Column> {
    let (name, contacts) = (&task.name, task.system.contacts());
    let two = |contact: &Contact| {
        let column_of = |result, unit, what| column(format!("{name}.{}.{result}", contact.name), unit, what);
        [
            column_of("share_of_time", PLAIN, "share of the plan's steps at which the contact touches"),
            column_of(
                "peak_force_N",
                "N",
                "greatest normal force of the contact along the plan; 0 if it never touches",
            ),
        ]
    };
    let whole = column(format!("{name}.{MISSES_CONTACT}"), PLAIN, MISSES);
    contacts.iter().flat_map(two).chain((!contacts.is_empty()).then_some(whole)).collect()
}

/// The last part of the name of a task's column that says whether its plan never touches a contact from which a cost
/// wants a force.
const MISSES_CONTACT: &str = "misses_contact";

/// The task that a column is of that says whether its plan misses a contact.
///
/// Example: the [module](crate::sweep).
#[must_use]
pub fn misses_contact(column: &Column) -> Option<&str> {
    column.name.strip_suffix(MISSES_CONTACT)?.strip_suffix('.')
}

/// What a column of a sweep holds.
///
/// Example: the [module](crate::sweep).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Holds {
    /// Numbers.
    Numbers,
    /// Whole numbers.
    Counts,
    /// 1 for true, 0 for false.
    Truths,
    /// Texts.
    Texts,
}

impl Holds {
    /// What a column holds. It is told by its description, since a parameter may have any name.
    #[must_use]
    pub fn of(column: &Column) -> Self {
        match &*column.description {
            PLAN_ENDED | DESIGN_ENDED | NO_RESULT => Self::Texts,
            FEASIBLE | MISSES => Self::Truths,
            DESIGNS | ITERATIONS => Self::Counts,
            _ => Self::Numbers,
        }
    }
}

/// Descriptions of columns with texts.
const PLAN_ENDED: &str = "how the plan ended";
const DESIGN_ENDED: &str = "how the design search ended";
const NO_RESULT: &str = "why the point could not be evaluated";

/// Descriptions of columns that say whether something is so.
const FEASIBLE: &str = "1 if every plan converged and every task is within its cost limit, otherwise 0";
const MISSES: &str = "1 if the plan never makes a contact whose force a cost tracks, otherwise 0";

/// Descriptions of columns that count.
const DESIGNS: &str = "designs that the search evaluated";
const ITERATIONS: &str = "iterations of the plan, over all guesses that were tried";

fn column(name: String, unit: &str, description: &str) -> Column {
    Column { name, unit: unit.to_owned(), description: description.to_owned() }
}
