//! Tasks that set parameters for themselves: one robot and one spring, with and without a load.

use crate::common::repository;
use supple::check::check;
use supple::{EvaluateOptions, Problem};

/// The elastic elbow with a payload: reached with that of the parameter, and with another one.
fn text(set: &str, payload: &str) -> String {
    let text = std::fs::read_to_string(repository("tasks/elastic_elbow.toml")).unwrap();
    let text = text.replace("../models", repository("models").to_str().unwrap());
    let (head, task) = text.split_at(text.find("[[tasks]]").unwrap());
    let renamed = task.replacen("name = \"press\"", "name = \"loaded\"", 1);
    assert_ne!(renamed, task);
    let (top, rest) = renamed.split_at(renamed.find("bound").unwrap());
    let loaded = format!("{top}{set}\n{rest}");
    let parameter = format!(
        "[parameters.payload]\ninitial = {payload}\nbounds = [0.5, 4.0]\nrole = \"study\"\n\n[model.links.forearm]\nmass = \"2 * payload / 2\"\n\n"
    );
    format!("{head}{parameter}{task}\n{loaded}")
}

fn parsed(set: &str, payload: &str) -> Result<Problem, String> {
    supple_file::parse(&text(set, payload), "elbow.toml").map_err(|error| error.to_string())
}

#[test]
fn a_task_that_sets_a_parameter_is_that_task_with_another_value() {
    let options = EvaluateOptions { total_gradient: true, ..EvaluateOptions::default() };
    let evaluated = |problem: &Problem| problem.evaluate(&problem.parameters.initial(), &options).unwrap();
    let both = parsed("set = { payload = 3.0 }", "1.5").unwrap();
    let heavy = parsed("", "3.0").unwrap();
    let (both, heavy) = (evaluated(&both), evaluated(&heavy));
    let light = evaluated(&parsed("", "1.5").unwrap());
    let of = |task: &supple::TaskEvaluation| [task.information.total_nats, task.cost.expected];
    assert_eq!(of(&both.tasks[0]), of(&light.tasks[0]));
    let (set, declared) = (of(&both.tasks[1]), of(&heavy.tasks[1]));
    // Numbers are folded where parameters are read: equal up to rounding.
    assert!(
        set.iter().zip(declared).all(|(set, declared)| (set - declared).abs() < 1e-11 * declared),
        "{set:?}, {declared:?}"
    );
    assert!((set[0] - of(&both.tasks[0])[0]).abs() > 1e-3 * set[0]);
    assert_eq!((both.tasks[0].set.is_empty(), both.tasks[1].set.get("payload")), (true, Some(3.0)));
    let slope = |task: &supple::TaskEvaluation, name: &str| {
        let total = task.gradient.as_ref().and_then(|gradient| gradient.total.as_ref()).unwrap();
        total.information_nats.get(name).unwrap()
    };
    assert_eq!(slope(&both.tasks[1], "payload"), 0.0, "it is a number there");
    assert!(slope(&both.tasks[0], "payload") != 0.0);
    let (set, declared) = (slope(&both.tasks[1], "k"), slope(&heavy.tasks[1], "k"));
    assert!((set - declared).abs() < 1e-9 * declared.abs(), "{set}, {declared}");
}

#[test]
fn derivatives_of_tasks_that_set_parameters_are_those_of_differences() {
    let both = parsed("set = { payload = 3.0 }", "1.5").unwrap();
    let report = check(&both, &both.parameters.initial()).unwrap();
    assert!(report.passed, "{report:?}");
}

/// What may be 0 as a parameter may be set to 0.
#[test]
fn numbers_that_tasks_set_are_checked_as_parameters_are() {
    let rough = "dissipation = 2.0                # s/m\nfriction = \"mu\"\nslip = 0.05\n";
    let text = text("set = { payload = 3.0, mu = 0.0 }", "1.5");
    let text = text.replacen("dissipation = 2.0                # s/m\n", rough, 1);
    let text = text + "\n[parameters.mu]\ninitial = 0.3\nbounds = [0.0, 0.5]\nrole = \"study\"\n";
    let problem = supple_file::parse(&text, "elbow.toml").unwrap();
    assert_eq!(problem.tasks[1].set.get("mu"), Some(0.0));
    assert!(
        !problem.is_set_by_all_tasks("mu")
            && problem.is_set_by_all_tasks("mu") == problem.is_set_by_all_tasks("payload")
    );
}

#[test]
fn parameters_that_a_task_cannot_set_are_refused() {
    for (set, told) in [
        ("set = { paylod = 3.0 }", "no parameter is named `paylod`; those with role = \"study\": `payload`"),
        ("set = { k = 30.0 }", "`k` is shared by all tasks: a task may only set parameters with role = \"study\""),
        ("set = { payload = 30.0 }", "must be within the bounds [0.5, 4] of `payload`; found 30"),
        ("set = { payload = \"3\" }", "must be a number; found \"3\""),
    ] {
        let found = parsed(set, "1.5").err().unwrap_or_default();
        assert!(found.contains(told) && found.contains("set"), "{set}: {found}");
    }
}
