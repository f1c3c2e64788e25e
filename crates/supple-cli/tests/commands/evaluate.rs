use serde_json::{Value, json};

use crate::common::{Folder, LINEAR, TWO_MASS, edited};
use crate::{assert_close, assert_form, evaluation_form, keys, number, two_mass};

#[test]
fn evaluate_prints_one_object_of_the_published_form() {
    let folder = Folder::with_task(TWO_MASS);
    let arguments = ["evaluate", "task.toml", "--json", "--gradient", "both", "--rollouts", "20", "--seed", "3"];
    let found = folder.run(&arguments).json(0);
    let gradient = json!({ "k1": 0.5, "k2": 0.5 });
    let mut form = evaluation_form();
    form["tasks"][0]["gradient"] = json!({
        "total": {
            "information_nats": gradient, "expected_cost": gradient, "nominal_cost": gradient,
            "belief_cost": gradient, "process_cost": gradient, "initial_cost": gradient
        },
        "frozen": { "information_nats": gradient, "belief_cost": gradient }
    });
    form["tasks"][0]["monte_carlo"] = json!({ "rollouts": 20, "cost_mean": 0.5, "cost_standard_error": 0.5 });
    assert_form(&found, &form, "");
    assert_eq!(keys(&found), ["feasibility", "feasible", "objective", "parameters", "tasks"]);
    assert_eq!(keys(&found["parameters"]), ["k1", "k2"]);
    assert_eq!(found["tasks"][0]["status"], "converged");
    assert_eq!(found["tasks"][0]["monte_carlo"]["rollouts"], 20);

    let (cost, information) = (&found["tasks"][0]["cost"], &found["tasks"][0]["information"]);
    let parts = ["nominal", "belief", "process", "initial"].map(|part| number(&cost[part]));
    assert_close(number(&cost["expected"]), parts.iter().sum());
    let per_step = information["per_step_nats"].as_array().unwrap();
    assert_eq!(per_step.len(), 126);
    assert_close(number(&information["total_nats"]), per_step.iter().map(number).sum());
    let bits = number(&information["total_nats"]) / std::f64::consts::LN_2;
    assert_close(number(&information["total_bits"]), bits);
    assert_close(number(&information["bits_per_step"]), bits / 126.0);
    assert_close(number(&information["bits_per_second"]), bits / 126.0 / 0.02);
    assert_close(number(&found["objective"]["information_bits"]), bits);
    assert_eq!(folder.names(), ["task.toml"]);
}

#[test]
fn evaluate_prints_what_was_asked_for_and_no_more() {
    let folder = Folder::with_task(TWO_MASS);
    let task =
        |more: &[&str]| folder.run(&[&["evaluate", "task.toml", "--json"], more].concat()).json(0)["tasks"][0].clone();
    let plain = task(&[]);
    assert_eq!(plain.get("gradient"), None);
    assert_eq!((&plain["monte_carlo"]["rollouts"], &plain["trust"]["verdict"]), (&json!(256), &json!("holds")));
    assert!(
        number(&plain["information"]["needed"]["total_bits"]) >= number(&plain["information"]["needed"]["lower_bits"])
    );
    let without = task(&["--rollouts", "0"]);
    assert_eq!((without.get("monte_carlo"), without.get("trust")), (None, None));
    assert_eq!(keys(&task(&["--gradient", "total"])["gradient"]), ["total"]);
    assert_eq!(keys(&task(&["--gradient", "frozen"])["gradient"]), ["frozen"]);
    assert_eq!(keys(&task(&["--gradient", "both"])["gradient"]), ["frozen", "total"]);
    assert_eq!(task(&["--gradient", "none"]), plain);
    let sampled = task(&["--rollouts", "1"]);
    assert_eq!(sampled["monte_carlo"]["cost_standard_error"], Value::Null);
}

#[test]
fn evaluate_prints_a_page_for_people() {
    let run = Folder::with_task(TWO_MASS).run(&["evaluate", "task.toml"]);
    let (code, page) = run.quiet();
    assert_eq!(code, Some(0));
    for part in ["Two small masses", "k1 = 60 N/m", "press: converged", "bits/s", "within the cost limit 25"] {
        assert!(page.contains(part), "{part} is not in\n{page}");
    }
}

#[test]
fn set_changes_parameters_of_either_role() {
    let folder = Folder::with_task(LINEAR);
    let page = folder.run(&["evaluate", "task.toml"]).stdout;
    assert!(page.contains("stiffness = -0.2    gain = 0.1 m/(N s)   sensor-noise = 0.1    allowance = 50"), "{page}");
    let run = |more: &[&str]| folder.run(&[&["evaluate", "task.toml", "--json"], more].concat()).json(0);
    let found = run(&["--set", "gain=0.5", "--set=allowance=60", "--set", " sensor-noise = 2e-1 "]);
    let expected = json!({ "stiffness": -0.2, "gain": 0.5, "sensor-noise": 0.2, "allowance": 60.0 });
    assert_eq!(found["parameters"], expected);
    assert_eq!(found["tasks"][0]["cost"]["bound"], 60.0);
    assert_ne!(found["tasks"][0]["information"], run(&[])["tasks"][0]["information"]);
    assert_eq!(run(&["--set", "gain=0.3", "--set", "gain=0.5"])["parameters"]["gain"], 0.5, "the last one holds");
}

#[test]
fn a_missed_bound_is_a_shortfall_and_says_by_how_much() {
    let folder = two_mass("bound = 25.0", "bound = 20.0");
    let run = folder.run(&["evaluate", "task.toml"]);
    assert_eq!(run.quiet().0, Some(1));
    assert!(run.stdout.contains("exceeds the cost limit 20 by 0.29"), "{}", run.stdout);
    let found = folder.run(&["evaluate", "task.toml", "--json"]).json(1);
    assert_eq!((&found["feasible"], &found["tasks"][0]["status"]), (&json!(false), &json!("converged")));
    let none = two_mass("bound = 25.0", "bound = 0").run(&["evaluate", "task.toml"]);
    assert_eq!(none.quiet().0, Some(1));
    assert!(
        none.stdout.contains("exceeds the cost limit 0 by 20.29") && !none.stdout.contains("by 20.2919 ("),
        "{}",
        none.stdout
    );
}

#[test]
fn a_hint_names_every_limit_that_is_exceeded() {
    let (head, press) = TWO_MASS.split_once("[[tasks]]").unwrap();
    let task = |name: &str, bound: &str| {
        let named = press.replace("name = \"press\"", &format!("name = \"{name}\""));
        format!("[[tasks]]{}\n", named.replace("bound = 25.0", &format!("bound = {bound}")))
    };
    let text = format!("{head}{}{}{}", task("press", "20.0"), task("again", "30.0"), task("once more", "10.0"));
    let run = Folder::with_task(&text).run(&["evaluate", "task.toml"]);
    assert_eq!(run.quiet().0, Some(1));
    let said =
        "raise the `bound` of press to 20.2919 and the `bound` of once more to 20.2919: no sensors meet the limit";
    assert!(run.stdout.contains(said), "{}", run.stdout);
}

#[test]
fn a_plan_that_does_not_converge_is_a_shortfall() {
    let folder = two_mass("title =", "planning.max_iterations = 2\ntitle =");
    let found = folder.run(&["evaluate", "task.toml", "--json"]).json(1);
    assert_eq!((&found["feasible"], &found["tasks"][0]["status"]), (&json!(false), &json!("max_iterations")));
    let run = folder.run(&["evaluate", "task.toml"]);
    assert_eq!(run.quiet().0, Some(1));
    assert!(run.stdout.contains("max_iterations"), "{}", run.stdout);
}

#[test]
fn files_of_every_form_are_read() {
    let evaluate = |text: &str| Folder::with_task(text).run(&["evaluate", "task.toml", "--json"]).json(0);
    let plain = evaluate(TWO_MASS);
    assert_eq!(evaluate(&TWO_MASS.replace('\n', "\r\n")), plain, "lines that end in CR LF");
    assert_eq!(evaluate(&format!("\u{feff}{TWO_MASS}")), plain, "a byte order mark");
    assert_eq!(evaluate(&edited(TWO_MASS, "= 25.0", "= 25")), plain, "a whole number");
    assert_eq!(evaluate(&edited(TWO_MASS, "[10.0]", "[[10.0]]")), plain, "one row of controls");
    let renamed = TWO_MASS.replace("[parameters.k1]", "[parameters.'k-\u{e4}.1']").replace("\"k1\"", "\"k-\u{e4}.1\"");
    let renamed = evaluate(&renamed);
    assert_eq!(keys(&renamed["parameters"]), ["k-\u{e4}.1", "k2"]);
    assert_eq!(renamed["tasks"], plain["tasks"], "names in any script");
    let full = edited(TWO_MASS, "[5e-3, 5e-2]", "[[5e-3, 0.0], [0.0, 5e-2]]");
    assert_eq!(evaluate(&full)["tasks"][0]["cost"], plain["tasks"][0]["cost"], "a full covariance");
    let free = evaluate(&edited(TWO_MASS, "bound = 25.0", ""));
    assert_eq!((&free["feasible"], &free["tasks"][0]["cost"]["bound"]), (&json!(true), &Value::Null), "no bound");
}

#[test]
fn a_problem_needs_no_parameters() {
    let (before, rest) = TWO_MASS.split_once("[parameters.k1]").unwrap();
    let (_, after) = rest.split_once("[[tasks]]").unwrap();
    let text = edited(&format!("{before}[[tasks]]{after}"), "[\"k1\", \"k2\"]", "[60, 30]");
    let folder = Folder::with_task(text);
    let found = folder.run(&["evaluate", "task.toml", "--json", "--gradient", "total"]).json(0);
    assert_eq!(found["parameters"], json!({}));
    let plain = Folder::with_task(TWO_MASS).run(&["evaluate", "task.toml", "--json"]).json(0);
    // What is known when the model is recorded is computed once, in another order.
    let (found, plain) = (&found["tasks"][0]["cost"], &plain["tasks"][0]["cost"]);
    assert_eq!(keys(found), keys(plain));
    for key in ["expected", "bound", "nominal", "belief", "process", "initial"] {
        assert_close(number(&found[key]), number(&plain[key]));
    }
    assert!(folder.run(&["design", "task.toml"]).error().contains("nothing to design"));
}

#[test]
fn controls_may_be_given_per_step() {
    let rows = vec!["[10.0]"; 125].join(", ");
    let flat = vec!["10.0"; 125].join(", ");
    let evaluate = |guess: &str| {
        let folder = two_mass("initial_control = [10.0]", &format!("initial_control = [{guess}]"));
        folder.run(&["evaluate", "task.toml", "--json"]).json(0)
    };
    assert_eq!(evaluate(&rows), evaluate(&flat));
}

#[test]
fn the_bits_of_several_tasks_are_not_said_to_be_minimised() {
    let page = Folder::with_task(LINEAR).run(&["evaluate", "task.toml", "--rollouts", "0"]).stdout;
    assert!(page.contains("\nall tasks together: ") && !page.contains("bits minimised"), "{page}");
    assert!(page.contains(" bits, weighted by `information_weight`\n"), "{page}");
}

#[test]
fn tasks_share_parameters_and_add_up() {
    let found = Folder::with_task(LINEAR).run(&["evaluate", "task.toml", "--json", "--gradient", "total"]).json(0);
    let tasks = found["tasks"].as_array().unwrap();
    let nats = |task: usize| number(&tasks[task]["information"]["total_nats"]);
    assert_eq!((tasks.len(), &tasks[0]["name"], &tasks[1]["name"]), (2, &json!("reach"), &json!("hold")));
    assert_close(number(&found["objective"]["information_nats"]), nats(0) + 2.0 * nats(1));
    assert_eq!(number(&tasks[0]["gradient"]["total"]["expected_cost"]["allowance"]), 0.0);
}

/// Equal eigenvalues kept an eigenvalue iteration from ending.
#[test]
fn many_equal_states_have_a_frozen_gradient() {
    let row = |i: usize| (0..8).map(|j| if i == j { "0.9" } else { "0.000125" }).collect::<Vec<_>>().join(", ");
    let rows: Vec<_> = (0..8).map(|i| format!("[{}]", row(i))).collect();
    let all = |value: &str| [value; 8].join(", ");
    let text = format!(
        "model = {{ kind = \"linear\", A = [{}], B = [{}], C = [[{}]] }}\n[[tasks]]\nname = \"rest\"\nsteps = 10\n\
         time_step = 0.1\ninitial_state = [{}]\ninitial_control = [0.0]\n\
         noise = {{ initial = [{}], process = [{}], measurement = [0.1] }}\n\
         costs = [{{ kind = \"state\", select = [\"x1\", \"x8\"], weight = 1 }}, {{ kind = \"control\", weight = 0.1 }}]\n",
        rows.join(", "),
        all("[1.0]"),
        all("1.0"),
        all("1.0"),
        all("0.1"),
        all("0.01")
    );
    let folder = Folder::with_task(text);
    let found = folder.run(&["evaluate", "task.toml", "--gradient", "frozen", "--json"]).json(0);
    let radius = number(&found["tasks"][0]["gradient"]["frozen"]["recursion_spectral_radius"]);
    assert!((0.9..1.0).contains(&radius), "{radius}");
}
