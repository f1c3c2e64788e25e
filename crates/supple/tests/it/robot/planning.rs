//! Plans without a first guess, of robots that are hard to plan for.

use std::fmt::Write;

use supple::design::best_plan;
use supple::pipeline::TaskState;
use supple::plan::PlanStatus;
use supple::system::{Points, System, Times};
use supple::{EvaluateOptions, Matrices, Problem, Scratch, TaskEvaluation};

use crate::common::repository;
use crate::robot::arm::{Description, arm, compliance, cost, sensor};

fn evaluate(problem: &Problem) -> TaskEvaluation {
    let phi = problem.parameters.initial();
    problem.evaluate(&phi, &EvaluateOptions::default()).unwrap().tasks.remove(0)
}

/// Without a guess the controls carry the weight: one step from rest moves nothing.
#[test]
fn weights_are_carried() {
    let mut description = arm();
    description.start = "\"q.shoulder\" = 0.3\n\"q.elbow\" = -0.4\n\"q.slide\" = 0.1\n".into();
    let problem = description.problem();
    let task = &problem.tasks[0];
    let guess = task.guess(&[], 1.0);
    assert!(guess.vector(0).iter().any(|u| u.abs() > 1.0), "gravity has to be carried: {:?}", guess.vector(0));
    let x: Vec<f64> = task.initial_state.iter().map(|value| value.resolve(&[])).collect();
    let mut next = vec![0.0; x.len()];
    task.system.step(0, &x, guess.vector(0), &[], &mut next);
    let drift = next.iter().zip(&x).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(drift < 1e-12, "{drift}");
}

/// A disc far from a wall, from which 5 N are wanted.
fn apart(clearance: f64, smoothing: f64) -> Description {
    let keys = format!(
        "frame = \"disc\"\nnormal = [0.0, 1.0, 0.0]\nradius = 0.1\nstiffness = 2e3\nsmoothing = {smoothing:?}\n\
         dissipation = 0.5"
    );
    Description {
        model: "file = \"disc.urdf\"\ngravity = [0.0, 0.0, 0.0]\n".into(),
        sensors: sensor("joint_position", "select = [\"x\", \"y\", \"turn\"]\nvariance = 1e-4"),
        steps: 200,
        time_step: "5e-3".into(),
        start: format!("\"q.y\" = {:?}\n", 0.1 + clearance),
        costs: cost("contact_force", "contact = \"wall\"\ntarget = 5.0\nsmoothing = 0.5\nweight = 0.1")
            + &cost("joint_velocity", "weight = 0.1")
            + &cost("control", "weight = 1e-3"),
        ..arm()
    }
    .with(&compliance("contact", "wall", &keys))
}

#[test]
fn contacts_are_found_from_afar() {
    for (clearance, smoothing) in [(0.02, 1e-3), (0.1, 1e-3), (0.3, 5e-3), (0.05, 1e-4)] {
        let task = evaluate(&apart(clearance, smoothing).problem());
        let contact = &task.contacts[0];
        assert!(task.status.is_converged() && contact.touches, "{clearance} m, {smoothing} m: {:?}", task.warnings);
        assert!(contact.first_s.unwrap() < 0.5 && contact.greatest_force_apart == 0.0, "{contact:?}");
        assert!((contact.mean_force - 5.0).abs() < 1.0, "{contact:?}");
    }
}

/// An arm before a wall at some distances, where a search that makes contacts narrower loses this one: the cheapest plans
/// found, from plans at nearer walls, cost no less.
#[test]
fn contacts_that_are_lost_on_the_way_are_found_again() {
    let path = repository("tasks").join("wiping_arm.toml");
    let text = std::fs::read_to_string(&path).unwrap();
    for (place, cost) in [("0.68", 224.0), ("0.70", 251.7), ("0.72", 281.9)] {
        let wall =
            text.replace("point = [0.55, ", &format!("point = [{place}, ")).replace("bound = 84.0", "bound = 1e6");
        let task = evaluate(&supple_file::parse(&wall, path.to_str().unwrap()).unwrap());
        assert!(task.status.is_converged() && task.contacts[0].touches, "{place}: {:?}", task.warnings);
        assert!(task.cost.parts.nominal < 1.001 * cost, "{place}: {}", task.cost.parts.nominal);
    }
}

/// The arm with dry friction in its joints, moving to targets in 0.6 s.
fn rubbing_arm() -> Description {
    let friction = ["shoulder", "elbow", "slide"].map(|joint| format!("[model.joints.{joint}]\nfriction = 2.0\n"));
    Description {
        model: format!("file = \"arm.urdf\"\nfriction_smoothing = 0.01\n{}", friction.concat()),
        steps: 600,
        time_step: "1e-3".into(),
        costs: cost("joint_position", "target = [0.3, -0.3, 0.05]\nweight = 1.0\nfinal_weight = 1000.0")
            + &cost("joint_velocity", "weight = 0.1\nfinal_weight = 10.0")
            + &cost("control", "weight = 1e-4"),
        ..arm()
    }
}

/// A system of wider friction is the system itself at the end of its continuation, and a longer step of it moves about as
/// far as the steps that it stands for, and costs as many times more.
#[test]
fn friction_is_nearly_the_same_over_longer_steps() {
    let problem = rubbing_arm().problem();
    let system = &*problem.tasks[0].system;
    let wide = system.widened().unwrap();
    assert!(system.endures_longer_steps() && !apart(0.1, 1e-3).problem().tasks[0].system.endures_longer_steps());
    let start = [0.3, -0.4, 0.05, 0.2, -0.004, 0.001];
    let u = [8.0, -5.0, 3.0];
    let (mut x, mut next, mut scratch) = (start.to_vec(), vec![0.0; 6], Scratch::new());
    wide.step(0, &start, &u, &[0.0, 0.0, 1.0], &mut next);
    let cost = 4.0 * system.stage_cost(0, &start, &u, &[], &mut scratch);
    for i in 0..4 {
        let mut after = vec![0.0; 6];
        system.step(i, &x, &u, &[], &mut after);
        x = after;
        assert!(i > 0 || x.iter().zip(&next).all(|(a, b)| (a - b).abs() < 1e-14), "{x:?} and {next:?}");
    }
    let long = wide.advance(0, &start, &u, &[0.0, 0.0, 4.0], &mut next, &mut scratch);
    assert!((long / cost - 1.0).abs() < 1e-12, "{long} for {cost}");
    let moved = x.iter().zip(&start).fold(0.0, |most: f64, (x, start)| most.max((x - start).abs()));
    let error = x.iter().zip(&next).fold(0.0, |most: f64, (x, next)| most.max((x - next).abs()));
    assert!(error < 0.1 * moved, "{error} of {moved}: {next:?} for {x:?}");
}

/// Where joints stop is found over longer steps first: over all of them it takes few iterations.
#[test]
fn long_plans_with_friction_converge() {
    let task = evaluate(&rubbing_arm().problem());
    assert!(task.status.is_converged() && task.iterations < 60, "{:?} after {}", task.status, task.iterations);
}

/// Plans stop at the time limit, and say so.
#[test]
fn a_time_limit_ends_planning() {
    let mut problem = arm().problem();
    problem.planning.time_limit = Some(1e-9);
    let task = evaluate(&problem);
    assert_eq!(task.status, PlanStatus::TimeLimit);
    assert!(task.warnings[0].contains("time_limit"), "{:?}", task.warnings);
}

/// An arm behind springs that Gauss-Newton steps overshoot at. The least cost moves smoothly with the motor's inertia.
#[test]
fn elastic_arms_are_planned_on_one_branch() {
    let elastic = |inertia: f64| {
        let joint = |joint: &str| {
            let keys = format!("joint = \"{joint}\"\nstiffness = 25.0\ndamping = 0.05\nmotor_inertia = {inertia:?}");
            compliance("elastic_joint", &format!("flexible_{joint}"), &keys)
        };
        Description {
            steps: 150,
            time_step: "0.01".into(),
            start: "\"q.shoulder\" = 0.3\n\"q.elbow\" = -0.4\n\"q.slide\" = 0.1\n\"q.flexible_shoulder\" = 0.3\n\
                    \"q.flexible_elbow\" = -0.4\n"
                .into(),
            costs: cost("joint_position", "target = [-1.5, 1.4, 0.05]\nweight = 1.0\nfinal_weight = 500.0")
                + &cost("joint_velocity", "weight = 0.01\nfinal_weight = 20.0")
                + &cost("control", "weight = 1e-4"),
            ..arm()
        }
        .with(&joint("shoulder"))
        .with(&joint("elbow"))
    };
    let mut last: Option<f64> = None;
    for i in 0..9 {
        let inertia = 0.01 * 1.4_f64.powi(i);
        let task = evaluate(&elastic(inertia).problem());
        assert!(task.status.is_converged(), "{inertia}: {:?}", task.warnings);
        let cost = task.cost.parts.nominal;
        if let Some(last) = last.replace(cost) {
            assert!((cost / last - 1.0).abs() < 0.15, "from {last} to {cost} at an inertia of {inertia}");
        }
    }
}

/// A chain of links that hang on one another, as a file of the system's temporary folder.
fn chain(links: usize) -> (Problem, std::path::PathBuf) {
    let mut urdf = "<robot name=\"chain\">\n<link name=\"link0\"/>\n".to_owned();
    for i in 1..=links {
        let parent = i - 1;
        let axis = ["1 0 0", "0 1 0"][i % 2];
        writeln!(
            urdf,
            "<link name=\"link{i}\"><inertial><origin xyz=\"0 0.01 -0.1\"/><mass value=\"0.5\"/><inertia ixx=\"2e-3\" \
             iyy=\"2e-3\" izz=\"1e-3\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial></link>\n<joint name=\"joint{i}\" \
             type=\"continuous\"><parent link=\"link{parent}\"/><child link=\"link{i}\"/><origin xyz=\"0 0 -0.2\"/><axis \
             xyz=\"{axis}\"/><dynamics damping=\"0.1\" friction=\"0.05\"/></joint>"
        )
        .unwrap();
    }
    urdf += "</robot>\n";
    let folder = std::env::temp_dir().join(format!("supple-chain-{}-{links}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(folder.join("chain.urdf"), urdf).unwrap();
    let text = "[model]\nkind = \"robot\"\nfile = \"chain.urdf\"\n[[model.sensors]]\nkind = \"joint_position\"\n\
                select = [\"joint1\"]\nvariance = 1e-3\n[[tasks]]\nname = \"swing\"\nsteps = 3\ntime_step = 0.01\n\
                [tasks.initial_state]\n[tasks.noise]\ninitial = { \"*\" = 1e-4 }\nprocess = { \"*\" = 1e-5 }\n\
                [[tasks.costs]]\nkind = \"control\"\nweight = 1.0\n";
    (supple_file::parse(text, &folder.join("task.toml").display().to_string()).unwrap(), folder)
}

/// Where products with second derivatives are offered, they are those of all of them.
fn compare_products(system: &dyn System, at: Points, costates: &Matrices, all: &Matrices) {
    let mut scratch = Scratch::new();
    let Some(mut products) = system.curvature_products(at, &[], costates, &mut scratch) else {
        return assert!(!system.has_costly_curvature());
    };
    assert!(system.has_costly_curvature());
    let joint = system.dimensions().joint();
    let (mut variation, mut out) = (Matrices::vectors(2, joint), Matrices::vectors(2, joint));
    (0..joint).for_each(|i| variation.vector_mut(0)[i] = (0.7 * i as f64).cos());
    out.vector_mut(0).fill(1.0);
    products.add(&variation, &mut out, &mut scratch);
    for a in 0..joint {
        let row = (0..joint).map(|b| all.get(0, a, b) * variation.vector(0)[b]);
        let (expected, size) = (row.clone().sum::<f64>(), row.map(f64::abs).sum::<f64>());
        let error = (out.vector(0)[a] - 1.0 - expected).abs();
        assert!(error < 1e-12 * (1.0 + size), "{a}: {} for {expected}", out.vector(0)[a] - 1.0);
    }
    assert!(out.vector(1).iter().all(|&end| end == 0.0));
}

/// Second derivatives of dynamics with few and with many unknowns, which are found in two ways, against differences of the
/// first ones.
#[test]
fn second_derivatives_of_chains_of_any_length() {
    for links in [5, 18] {
        let (problem, folder) = chain(links);
        std::fs::remove_dir_all(folder).unwrap();
        let system = &problem.tasks[0].system;
        let size = system.dimensions();
        let (n, joint) = (size.states, size.joint());
        let value = |i: usize, scale: f64| scale * (1.3 * i as f64 + 0.4).sin();
        let z: Vec<f64> = (0..joint).map(|i| value(i, 0.4)).collect();
        let gradient = |z: &[f64]| -> Vec<f64> {
            let (mut states, mut controls) = (Matrices::vectors(1, n), Matrices::vectors(1, size.controls));
            states.vector_mut(0).copy_from_slice(&z[..n]);
            controls.vector_mut(0).copy_from_slice(&z[n..]);
            let at = Points { states: &states, controls: &controls, stages: 1, has_end: false, times: Times::From(0) };
            let mut jacobian = Matrices::zeros(1, n, joint);
            system.dynamics_jacobians(at, &[], &mut jacobian, &mut Scratch::new());
            (0..joint).map(|j| (0..n).map(|i| value(i + 7, 1.0) * jacobian.get(0, i, j)).sum()).collect()
        };
        let (mut states, mut controls) = (Matrices::vectors(2, n), Matrices::vectors(1, size.controls));
        states.vector_mut(0).copy_from_slice(&z[..n]);
        controls.vector_mut(0).copy_from_slice(&z[n..]);
        let mut costates = Matrices::vectors(2, n);
        (0..n).for_each(|i| costates.vector_mut(1)[i] = value(i + 7, 1.0));
        let at = Points { states: &states, controls: &controls, stages: 1, has_end: true, times: Times::From(0) };
        let mut found = Matrices::zeros(2, joint, joint + 1);
        system.add_dynamics_curvature(at, &[], &costates, &mut found, &mut Scratch::new());
        compare_products(&**system, at, &costates, &found);
        let largest = (0..joint).flat_map(|a| (0..joint).map(move |b| (a, b)));
        let largest = largest.fold(0.0, |most: f64, (a, b)| most.max(found.get(0, a, b).abs()));
        for b in 0..joint {
            let moved = |h: f64| {
                let mut z = z.clone();
                z[b] += h;
                gradient(&z)
            };
            let (above, below) = (moved(1e-5), moved(-1e-5));
            for a in 0..joint {
                let numeric = (above[a] - below[a]) / 2e-5;
                let error = (found.get(0, a, b) - numeric).abs();
                assert!(error < 1e-6 * largest, "{links} links, {a}, {b}: {} for {numeric}", found.get(0, a, b));
            }
        }
    }
}

/// Without a guess, constant controls set robots whirling whose springs are not in equilibrium, or that have fewer drives
/// than joints: the plans that were found cost a hundred and thirty times as much as those of feedback about the first state.
#[test]
fn robots_that_constant_controls_do_not_hold_do_not_whirl() {
    let reach = |target: &str| {
        cost(
            "frame_point",
            &format!("frame = \"tip\"\naxes = [\"x\", \"z\"]\ntarget = {target}\nweight = 1.0\nfinal_weight = 300.0"),
        ) + &cost("joint_velocity", "weight = 1e-3\nfinal_weight = 0.5")
            + &cost("control", "weight = 1e-4")
    };
    let elastic = Description {
        model: "file = \"elastic_arm.urdf\"\nfriction_smoothing = 0.05\n".into(),
        sensors: sensor("joint_position", "select = [\"shoulder\"]\nvariance = 1e-6"),
        steps: 200,
        time_step: "0.005".into(),
        start: "\"q.shoulder\" = -0.5\n\"q.elbow\" = 0.8\n".into(),
        noise: "initial = { \"*\" = 1e-6 }\nprocess = { \"v.*\" = 1e-4 }\n".into(),
        ..arm()
    }
    .with(&compliance(
        "elastic_joint",
        "sea",
        "joint = \"elbow\"\nstiffness = 80.0\ndamping = 0.3\nmotor_inertia = 0.08\nmotor_damping = 0.5",
    ));
    let hanging = Description {
        model: "file = \"hanging.xml\"\n".into(),
        sensors: sensor("joint_position", "select = [\"first\"]\nvariance = 1e-6"),
        steps: 150,
        time_step: "0.01".into(),
        start: String::new(),
        noise: "initial = { \"*\" = 1e-6 }\nprocess = { \"v.*\" = 1e-4 }\n".into(),
        costs: cost(
            "frame_point",
            "frame = \"end\"\naxes = [\"x\"]\ntarget = [0.3]\nweight = 1.0\nfinal_weight = 200.0",
        ) + &cost("joint_velocity", "weight = 1e-3\nfinal_weight = 1.0")
            + &cost("control", "weight = 5e-3"),
        ..arm()
    };
    for (what, description, most) in [
        ("near", elastic.clone().costing(&reach("[0.45, 0.45]")), 1.0),
        ("far", elastic.costing(&reach("[0.30, 0.75]")), 4.0),
        ("hanging", hanging, 3.0),
    ] {
        let task = evaluate(&description.problem());
        assert!(task.status.is_converged() && task.cost.expected < most, "{what}: {}", task.cost.expected);
    }
}

/// A pole on a cart, and what to do with it.
fn cartpole(start: &str, weight: &str) -> Description {
    Description {
        model: "file = \"cartpole.xml\"\n".into(),
        sensors: sensor("joint_position", "variance = 1e-5"),
        steps: 300,
        time_step: "0.01".into(),
        start: start.into(),
        costs: cost("joint_position", "select = [\"x\"]\nweight = 1.0\nfinal_weight = 50.0")
            + &cost("frame_point", &format!("frame = \"top\"\naxes = [\"z\"]\ntarget = [0.5]\n{weight}"))
            + &cost("joint_velocity", "weight = 0.01\nfinal_weight = 1.0")
            + &cost("control", "weight = 0.01"),
        ..arm()
    }
}

/// Under the zero controls of a first guess a pole falls over, and a search from there ends in a whirl that costs 5311.
#[test]
fn a_guess_under_which_a_pole_falls_over_does_no_harm() {
    let upright = cartpole("\"q.x\" = 0.3\n\"q.th\" = 0.1\n", "weight = 100.0\nfinal_weight = 1000.0").problem();
    let mut guessed = upright.clone();
    guessed.tasks[0].initial_control = vec![vec![0.0.into()]];
    let [free, guessed] = [&upright, &guessed].map(evaluate);
    assert!(free.status.is_converged() && guessed.status.is_converged());
    assert!((guessed.cost.expected / free.cost.expected - 1.0).abs() < 1e-9, "{}", guessed.cost.expected);
    let (cost, iterations) = (guessed.cost.parts.nominal, guessed.iterations);
    assert!(cost < 15.0 && iterations < 12, "{cost} {iterations}");
}

/// A pole that hangs still is where the cost of standing has a saddle: nothing changes it to first order.
#[test]
fn a_pole_that_hangs_still_is_swung_up() {
    for guess in [None, Some(0.0)] {
        let mut problem = cartpole("\"q.th\" = 3.141592653589793\n", "weight = 1.0\nfinal_weight = 1000.0").problem();
        problem.tasks[0].initial_control = guess.map(|u: f64| vec![vec![u.into()]]).unwrap_or_default();
        let found = evaluate(&problem);
        assert!(found.status.is_converged(), "{guess:?}: {}", found.status);
        // To hang still costs 650.
        assert!(found.cost.parts.nominal < 400.0, "{guess:?}: {}", found.cost.parts.nominal);
    }
}

/// From the controls of hanging still, which are stationary, the plan stays there: a saddle of the cost, which has no total
/// gradient. The rest of the result is there, and says so.
#[test]
fn a_saddle_has_no_total_gradient() {
    let problem = cartpole("\"q.th\" = 3.141592653589793\n", "weight = 1.0\nfinal_weight = 1000.0").problem();
    let controls = Some(vec![Matrices::vectors(problem.tasks[0].steps, 1)]);
    let options = EvaluateOptions { total_gradient: true, frozen_gradient: true, ..EvaluateOptions::default() };
    let found = problem.evaluate(&[], &EvaluateOptions { controls, ..options.clone() }).unwrap().tasks.remove(0);
    assert_eq!(found.status, PlanStatus::Indefinite);
    let gradient = found.gradient.unwrap();
    assert!(gradient.total.is_none() && gradient.frozen.is_some());
    assert!(
        found.warnings.iter().any(|warning| warning.contains("no strict minimum: some other controls from step")),
        "{:?}",
        found.warnings
    );
    let free = problem.evaluate(&[], &options).unwrap().tasks.remove(0);
    assert!(free.status.is_converged() && free.gradient.unwrap().total.is_some());
}

/// The plan at a design is the same whatever was planned before, and no costlier for a neighbour's plan to start from.
#[test]
fn plans_do_not_depend_on_what_was_planned_before() {
    let mut problem = cartpole("\"q.th\" = 3.141592653589793\n", "weight = 1.0\nfinal_weight = 1000.0").problem();
    let [mut fresh, mut used] = [0; 2].map(|_| TaskState::new(&problem.tasks[0]));
    best_plan(&problem, &problem.tasks[0], &[], None, &mut fresh).unwrap();
    let alone = fresh.cost.expected();
    // Another task first, in the same memory, whose plan then is the neighbour's.
    let start = std::mem::replace(&mut problem.tasks[0].initial_state[1], 0.3.into());
    best_plan(&problem, &problem.tasks[0], &[], None, &mut used).unwrap();
    let neighbour = used.plan.trajectory.controls.clone();
    problem.tasks[0].initial_state[1] = start;
    best_plan(&problem, &problem.tasks[0], &[], None, &mut used).unwrap();
    assert_eq!(used.cost.expected(), alone);
    best_plan(&problem, &problem.tasks[0], &[], Some(&neighbour), &mut used).unwrap();
    assert!(used.cost.expected() <= alone * (1.0 + 1e-9), "{} {alone}", used.cost.expected());
}

/// A pole that hangs on a cart with little force, on a rail that ends at a distance to each side.
fn on_a_rail(guess: &str, end: f64) -> Problem {
    let rail = format!("select = [\"x\"]\nlower = -{end}\nupper = {end}\nenforce = true\n");
    Description {
        model: "file = \"rail.xml\"\nsubsteps = 4\n[model.links.pole]\nmass = 0.3\n".into(),
        sensors: sensor("joint_position", "variance = 1e-4"),
        steps: 120,
        time_step: format!("0.025\nenforce_effort_limits = true\n{guess}"),
        start: String::new(),
        noise: "initial = { \"*\" = 1e-6 }\nprocess = { \"v.*\" = 1e-5 }\n".into(),
        costs: cost("frame_point", "frame = \"tip\"\ntarget = [0.0, 0.0, 0.8]\nweight = 0.05\nfinal_weight = 200.0")
            + &cost("joint_velocity", "weight = 0.001\nfinal_weight = 10.0")
            + &cost("control", "weight = 0.001")
            + &format!("[[tasks.limits]]\nkind = \"joint_position\"\n{rail}"),
        ..arm()
    }
    .problem()
}

/// A swing-up that needs a longer rail costs far less than to hang: limits that are narrowed step by step lead from one to one
/// that keeps them.
#[test]
fn a_swing_up_is_found_on_a_short_rail() {
    for (end, most) in [(0.3, 14.5), (0.25, 14.5), (0.2, 50.0)] {
        let found = evaluate(&on_a_rail("", end));
        assert!(found.status.is_converged() && found.warnings.is_empty(), "{end}: {:?}", found.warnings);
        // To hang costs 527.
        assert!(found.cost.expected < most, "{end}: {}", found.cost.expected);
        assert!(found.limits_violated.is_empty() && !found.limits_reached.is_empty());
    }
}

/// To swing it up from no force takes another guess. Branches from a guess of nothing went nowhere, as multiples of nothing
/// are nothing.
#[test]
fn branches_from_no_force_find_the_swing_up() {
    let problem = on_a_rail("initial_control = [0.0]", 0.4);
    let options = EvaluateOptions { branches: 16, ..EvaluateOptions::default() };
    let found = problem.evaluate(&[], &options).unwrap().tasks.remove(0);
    assert!(found.status.is_converged() && found.cost.expected < 15.0, "{}", found.cost.expected);
    assert!(found.branches.is_some_and(|count| count > 1), "{:?}", found.branches);
}

/// With weights at the end alone, searches that regularise controls creep: this one is not done after 1000 iterations.
#[test]
fn a_search_that_creeps_regularises_states() {
    let text = r#"
        [model]
        kind = "robot"
        file = "iiwa14_door.urdf"
        sensors = [{ kind = "joint_position", variance = 1e-6 }]
        [[tasks]]
        name = "reach"
        steps = 50
        time_step = 0.02
        noise = { initial = { "q.*" = 1e-6, "v.*" = 1e-6 }, process = { "q.*" = 1e-10, "v.*" = 1e-6 } }
        costs = [
            { kind = "joint_position", target = 0.5, weight = 0.0, final_weight = 1e5 },
            { kind = "joint_velocity", weight = 0.0, final_weight = 1e3 },
            { kind = "control", weight = 1e-3 },
        ]
    "#;
    let path = repository("models/task.toml");
    let problem = supple_file::parse(text, path.to_str().unwrap()).unwrap();
    let task = problem.evaluate(&[], &EvaluateOptions::default()).unwrap().tasks.remove(0);
    assert!(task.status.is_converged() && task.iterations < 400, "{:?}, {}", task.status, task.iterations);
    let mut state = TaskState::new(&problem.tasks[0]);
    state.evaluate(&problem.tasks[0], &[], &problem.planning, None).unwrap();
    assert_eq!(state.plan.status, PlanStatus::MaxIterations);
}
