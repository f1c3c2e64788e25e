//! What plans touch: reports of contacts, warnings of those that are missed, and every shipped task.

use crate::common::{repository, shipped, task_files};
use supple::design::{Control, DesignSettings, design};
use supple::settings::{PlanMode, PlanSettings};
use supple::{EvaluateOptions, Evaluation, Problem, Task, TaskEvaluation};
use supple_file::{Files, ReadOptions};

fn evaluated(problem: &Problem) -> Evaluation {
    let options = EvaluateOptions { trajectories: true, ..Default::default() };
    problem.evaluate(&problem.parameters.initial(), &options).unwrap()
}

/// The two masses with other texts in their task file.
fn two_mass(edits: &[(&str, &str)]) -> Problem {
    let mut text = std::fs::read_to_string(repository("tasks/two_mass.toml")).unwrap();
    for (from, to) in edits {
        assert!(text.contains(from), "{from}");
        text = text.replace(from, to);
    }
    supple_file::parse(&text, "two_mass.toml").unwrap()
}

/// The weight of the force on the wall so small that the plan stays where it is.
const IDLE: [(&str, &str); 2] = [("weight = 0.05", "weight = 1e-12"), ("[57.0]", "[0.0]")];

/// Of the masses the force is that which moves them, `k2 (x2 - xw)_+`, computed here from the states.
#[test]
fn the_report_of_the_two_masses_is_that_of_their_states() {
    let problem = shipped("two_mass.toml");
    let found = evaluated(&problem);
    let (task, dt, stiffness, smoothing) = (&found.tasks[0], 0.02, 500.0, 0.01);
    let [report] = &task.contacts[..] else { panic!("{:?}", task.contacts) };
    let clearances: Vec<f64> =
        task.trajectory.as_ref().unwrap().states.iter().map(|state| state[4] - state[2]).collect();
    let force = |clearance: f64| stiffness * 0.5 * (clearance.hypot(smoothing) - clearance);
    let touching: Vec<usize> = (0..clearances.len()).filter(|&t| clearances[t] < smoothing).collect();
    let (first, last) = (touching[0], touching[touching.len() - 1]);
    assert!(first > 5 && last == 125, "the plan reaches the wall and stays: {touching:?}");
    assert_eq!(report.name, "wall");
    assert!(report.touches);
    assert_eq!((report.first_s, report.last_s), (Some(first as f64 * dt), Some(last as f64 * dt)));
    assert_eq!(report.share_of_time, touching.len() as f64 / 126.0);
    let close = |found: f64, expected: f64| assert!((found - expected).abs() < 1e-9, "{found} is not {expected}");
    let forces: Vec<f64> = touching.iter().map(|&t| force(clearances[t])).collect();
    close(report.peak_force, forces.iter().copied().fold(0.0, f64::max));
    close(report.mean_force, forces.iter().sum::<f64>() / forces.len() as f64);
    close(report.least_clearance_m, clearances.iter().copied().fold(f64::INFINITY, f64::min));
    let apart = clearances.iter().filter(|&&clearance| clearance > smoothing).map(|&clearance| force(clearance));
    close(report.greatest_force_apart, apart.fold(0.0, f64::max));
    assert!(task.warnings.is_empty(), "{:?}", task.warnings);
}

/// A body that rests on the ground is as deep inside it as its weight asks for: 2 kg on 1000 N/m by 19.62 mm.
#[test]
fn a_contact_that_carries_a_weight_is_no_mistake() {
    let robot = r#"<robot name="body"><link name="ground"/>
        <joint name="up" type="prismatic"><parent link="ground"/><child link="body"/><axis xyz="0 0 1"/>
            <limit lower="-1" upper="1" effort="100" velocity="10"/></joint>
        <link name="body"><inertial><mass value="2"/>
            <inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link></robot>"#;
    let task = r#"
        [model]
        kind = "robot"
        file = "body.urdf"
        gravity = [0.0, 0.0, -9.81]
        [[model.compliance]]
        kind = "contact"
        name = "floor"
        frame = "body"
        normal = [0, 0, 1]
        stiffness = 1000
        smoothing = 1e-3
        [[model.sensors]]
        kind = "joint_position"
        select = ["up"]
        variance = 1e-6
        [[tasks]]
        name = "rest"
        steps = 100
        time_step = 0.005
        initial_state = { "q.up" = -0.01962 }
        noise = { initial = { "q.*" = 1e-6, "v.*" = 1e-6, "c.*" = 0.0 }, process = { "v.*" = 1e-6 } }
        costs = [{ kind = "control", weight = 1.0 }, { kind = "joint_velocity", weight = 1.0 }]
    "#;
    let warnings = |start: &str| {
        let files = Files::given([("body.urdf".to_owned(), robot.to_owned())]);
        let text = task.replace("-0.01962", start);
        let problem = supple_file::parse_with(&text, "rest.toml", ReadOptions { files, ..Default::default() }).unwrap();
        evaluated(&problem).tasks.remove(0).warnings
    };
    assert_eq!(warnings("-0.01962"), [] as [&str; 0]);
    let deep = warnings("-0.2");
    assert!(deep.iter().any(|warning| warning.contains("`floor` is 0.2 m inside its wall")), "{deep:?}");
}

#[test]
fn a_plan_that_never_touches_what_it_should_press_is_warned_of() {
    let found = evaluated(&two_mass(&IDLE));
    let task = &found.tasks[0];
    assert!(task.status.is_converged(), "{}", task.status);
    let report = &task.contacts[0];
    assert!(!report.touches && report.first_s.is_none() && report.last_s.is_none());
    assert_eq!((report.share_of_time, report.peak_force, report.mean_force), (0.0, 0.0, 0.0));
    let [warning] = &task.warnings[..] else { panic!("{:?}", task.warnings) };
    let clearance = format!("{:.3}", report.least_clearance_m).trim_end_matches('0').to_owned();
    let expected = format!(
        "task `press`: the plan never makes contact with `wall`, but cost 1 (contact_force) tracks a force of 10 N there; the minimum clearance is {clearance} m; "
    );
    assert!(warning.starts_with(&expected), "{warning}\n{expected}");
    assert_eq!(found.warnings().collect::<Vec<_>>(), [warning]);
}

/// A cost without a target, or without weight, wants nothing.
#[test]
fn costs_that_want_no_force_give_no_warning() {
    for more in [("target = 10.0", "target = 0.0"), ("weight = 1e-12", "weight = 0.0")] {
        let problem = two_mass(&[IDLE[0], IDLE[1], more]);
        let found = evaluated(&problem);
        assert!(!found.tasks[0].contacts[0].touches);
        assert!(found.tasks[0].warnings.is_empty(), "{:?}", found.tasks[0].warnings);
    }
}

fn without_contact(problem: &Problem) -> (usize, usize) {
    let settings = DesignSettings { starts: 1, max_evaluations: 5, ..problem.design.clone() };
    let control = Control::default();
    let found = design(problem, &problem.parameters.initial(), &settings, control).unwrap();
    assert_eq!(found.without_contact, found.starts[0].without_contact);
    (found.without_contact, found.evaluations)
}

#[test]
fn a_search_counts_the_designs_that_never_touch() {
    let (missed, evaluations) = without_contact(&two_mass(&IDLE));
    assert!(evaluations > 0 && missed == evaluations, "{missed} of {evaluations}");
    assert_eq!(without_contact(&shipped("two_mass.toml")).0, 0);
}

/// Models without contacts report none.
#[test]
fn models_without_contacts_have_no_reports() {
    for name in ["light_dark.toml", "iiwa_door.toml"] {
        let found = evaluated(&shipped(name));
        assert!(found.tasks.iter().all(|task| task.contacts.is_empty() && task.warnings.is_empty()), "{name}");
    }
}

/// `stiffness smoothing` of every contact of a task.
fn scales(task: &Task, phi: &[f64]) -> Vec<f64> {
    let start: Vec<f64> = task.initial_state.iter().map(|value| value.resolve(phi)).collect();
    task.system.contact_states(&start, phi).iter().map(|state| state.stiffness * state.smoothing).collect()
}

/// In every shipped task no contact pushes at a distance, and what is to be pressed is touched early.
#[test]
fn shipped_plans_touch_what_they_press_and_nothing_pushes_at_a_distance() {
    let (mut faults, mut contacts, mut wanted) = (Vec::new(), 0, 0);
    for file in task_files() {
        let problem = shipped(&file);
        let text = std::fs::read_to_string(repository("tasks").join(&file)).unwrap();
        let masses = text.contains("kind = \"two_mass\"");
        let phi = problem.parameters.initial();
        let found = evaluated(&problem);
        for (task, at) in problem.tasks.iter().zip(&found.tasks) {
            let place = |name: &str| format!("{file}, task `{}`, contact `{name}`", task.name);
            let scales = scales(task, &phi);
            assert_eq!([at.contacts.len(), scales.len()], [task.system.contacts().len(); 2], "{file}");
            for (report, scale) in at.contacts.iter().zip(scales) {
                contacts += 1;
                let apart = report.greatest_force_apart;
                // The two masses have a law of their own, that of the paper.
                if !(masses || scale > 0.0 && apart < 1e-9 * scale) {
                    faults.push(format!("{}: {apart} N at a distance", place(&report.name)));
                }
            }
            let duration = task.steps as f64 * task.time_step.resolve::<f64>(&phi);
            for force in task.system.wanted_forces(&phi) {
                wanted += 1;
                let report = &at.contacts[force.contact];
                if !report.first_s.is_some_and(|first| first <= 0.5 * duration) {
                    let (name, cost) = (place(&report.name), force.cost + 1);
                    faults.push(format!(
                        "{name}: cost {cost} wants {} N, first touch {:?}",
                        force.target, report.first_s
                    ));
                }
            }
        }
    }
    assert!(contacts >= 9 && wanted >= 8, "{contacts} contacts, {wanted} forces wanted of them");
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// A cost that asks for the surface, or for a place inside, of a wall that the plan never reaches is warned of; one that asks for a
/// distance is not.
#[test]
fn depths_that_a_plan_never_reaches_are_warned_of() {
    let asked = [
        ("penetration", "0.0", true),
        ("penetration", "0.002", true),
        ("clearance", "0.0", true),
        ("clearance", "0.1", false),
    ];
    for (kind, target, is_told) in asked {
        let cost = format!("[[tasks.costs]]\nkind = \"{kind}\"\ntarget = [{target}]\nweight = 1e-9\n");
        let text = std::fs::read_to_string(repository("tasks/two_mass.toml")).unwrap();
        let (head, costs) = text.split_at(text.find("[[tasks.costs]]").unwrap());
        let control = costs.find("kind = \"control\"").unwrap();
        let control = costs[..control].rfind("[[tasks.costs]]").unwrap();
        let head = head.replace("[57.0]", "[0.0]");
        let problem = supple_file::parse(&format!("{head}{cost}{}", &costs[control..]), "two_mass.toml").unwrap();
        let warnings = evaluated(&problem).tasks.remove(0).warnings;
        let about = warnings.iter().find(|warning| warning.contains("never makes contact with `wall`"));
        assert_eq!(about.is_some(), is_told, "{kind} {target}: {warnings:?}");
        assert!(about.is_none_or(|about| about.contains(&format!("({kind}) asks for a place"))), "{about:?}");
    }
}

/// Plans that account for uncertainty converge on the contacts of the nominal plan, at nearly its cost: also where exact second
/// derivatives would let noise lower the cost.
#[test]
fn plans_that_weigh_uncertainty_keep_the_contacts_of_nominal_ones() {
    let kinds = [(PlanMode::Belief, 0.0), (PlanMode::Risk, 1e-3), (PlanMode::Risk, -1e-3)];
    let (mut faults, mut checked) = (Vec::new(), 0);
    for file in task_files() {
        let mut problem = shipped(&file);
        let phi = problem.parameters.initial();
        let is_limited = |task: &Task| task.control_bounds.is_some() || task.system.constraints().is_some();
        let presses = |task: &Task| !task.system.wanted_forces(&phi).is_empty();
        if problem.planning.plan != PlanMode::Nominal
            || problem.tasks.iter().any(|task| is_limited(task) || !presses(task))
        {
            continue;
        }
        let nominal = evaluated(&problem);
        for (plan, risk_sensitivity) in kinds {
            problem.planning = PlanSettings { plan, risk_sensitivity, ..problem.planning.clone() };
            let found = evaluated(&problem);
            for (at, nominal) in found.tasks.iter().zip(&nominal.tasks) {
                checked += 1;
                let touched =
                    |of: &TaskEvaluation| of.contacts.iter().map(|contact| contact.touches).collect::<Vec<_>>();
                let is_near = at.cost.expected < 1.02 * nominal.cost.expected;
                if !at.status.is_converged() || touched(at) != touched(nominal) || !is_near || !at.warnings.is_empty() {
                    let (cost, before, status) = (at.cost.expected, nominal.cost.expected, at.status);
                    faults.push(format!(
                        "{file}, {}, {plan} {risk_sensitivity}: {status}, cost {cost} of {before}, {:?}",
                        at.name, at.warnings
                    ));
                }
            }
        }
    }
    assert!(checked >= 18, "{checked} plans");
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}
