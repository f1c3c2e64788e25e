//! Plans keep the limits that tasks ask them to keep, and designs move along them.

use crate::common::{shipped, shipped_with};
use nalgebra::{DMatrix, DVector};
use supple::check::check;
use supple::design::{Aim, Control, DesignSettings, DesignStatus, Searcher, design};
use supple::pipeline::TaskState;
use supple::plan::{PlanSettings, PlanStatus};
use supple::{EvaluateOptions, Problem, TaskEvaluation};

fn evaluated(problem: &Problem) -> TaskEvaluation {
    let options = EvaluateOptions { trajectories: true, ..Default::default() };
    problem.evaluate(&problem.parameters.initial(), &options).unwrap().tasks.remove(0)
}

/// A limit in a task file that plans keep.
fn kept(lines: &str) -> String {
    format!("[[tasks.limits]]\n{lines}\nenforce = true\n")
}

fn plan_of(problem: &Problem) -> TaskState {
    let mut state = TaskState::new(&problem.tasks[0]);
    state.evaluate(&problem.tasks[0], &problem.parameters.initial(), &problem.planning, None).unwrap();
    state
}

/// One of each kind on the shipped tasks, with what the plan without it does: all of them are exceeded there.
const LIMITS: [(&str, &str); 6] = [
    ("two_mass.toml", "kind = \"state\"\nselect = [\"v2\"]\nupper = 0.8"),
    ("two_mass.toml", "kind = \"state\"\nselect = [\"v1\", \"v2\"]\nupper = 0.85"),
    ("wiping_arm.toml", "kind = \"joint_velocity\"\nselect = [\"shoulder\"]\nupper = 1.2"),
    ("wiping_arm.toml", "kind = \"contact_force\"\ncontact = \"wall\"\nupper = 5.3"),
    ("soft_gripper.toml", "kind = \"joint_velocity\"\nselect = [\"left\"]\nlower = -0.25\nupper = 0.25"),
    ("peg_on_wall.toml", "kind = \"joint_velocity\"\nselect = [\"stage_z\"]\nlower = -0.25"),
];

#[test]
fn plans_keep_limits_and_say_which_they_are_held_at() {
    for (name, limit) in LIMITS {
        let free = evaluated(&shipped_with(name, &format!("[[tasks.limits]]\n{limit}\n")));
        assert!(!free.limits_violated.is_empty(), "{name}: {limit}: the plan without it keeps it");
        assert!(free.limits_reached.is_empty());
        let at = evaluated(&shipped_with(name, &kept(limit)));
        assert_eq!(at.status, PlanStatus::Converged, "{name}: {limit}");
        assert!(at.limits_violated.iter().all(|found| free.limits_violated[0].name != found.name), "{name}: {limit}");
        assert!(!at.limits_reached.is_empty(), "{name}: {limit}");
        assert!(at.cost.parts.nominal > free.cost.parts.nominal, "{name}: {limit}");
        assert!(at.relative_stationarity <= 1e-8, "{name}: {}", at.relative_stationarity);
    }
}

#[test]
fn a_limit_that_is_not_reached_changes_no_bit() {
    for (name, limit) in LIMITS {
        let wide = limit.replace("upper = ", "upper = 100").replace("lower = -", "lower = -100");
        let (free, kept) = (evaluated(&shipped(name)), evaluated(&shipped_with(name, &kept(&wide))));
        let numbers = |task: &TaskEvaluation| {
            let parts = task.cost.parts;
            [parts.nominal, parts.belief, parts.process, parts.initial, task.information.total_nats].map(f64::to_bits)
        };
        assert_eq!(numbers(&free), numbers(&kept), "{name}: {wide}");
        assert_eq!(free.iterations, kept.iterations);
    }
}

/// The price of a limit is how much the cost of the best plan falls where the limit is wider.
#[test]
fn prices_are_slopes_of_the_cost_by_the_limit() {
    let cost = |most: f64| {
        let problem =
            shipped_with("two_mass.toml", &kept(&format!("kind = \"state\"\nselect = [\"v2\"]\nupper = {most:?}")));
        let state = plan_of(&problem);
        assert_eq!(state.plan.status, PlanStatus::Converged);
        (state.plan.nominal_cost, state.plan.multipliers.as_slice().iter().sum::<f64>())
    };
    // A plan keeps its limits to about 1e-9, which is a 1e-5th of the longer step; extrapolated, as the slope is curved.
    let slope = |step: f64| (cost(0.8 - step).0 - cost(0.8 + step).0) / (2.0 * step);
    let (price, slope) = (cost(0.8).1, (9.0 * slope(1e-4) - slope(3e-4)) / 8.0);
    assert!((price / slope - 1.0).abs() < 3e-6, "price {price}, slope {slope}");
}

const LINEAR: &str = r#"
title = "A cart, to the origin"
[model]
kind = "linear"
A = [[1.0, 0.1], [0.0, 1.0]]
B = [[0.005], ["gain"]]
C = [[1.0, 0.0]]
[parameters.gain]
initial = 0.1
bounds = [0.05, 0.2]
[[tasks]]
name = "stop"
steps = 30
time_step = 0.1
initial_state = [1.0, 0.0]
noise = { initial = [1e-2, 1e-2], process = [[1e-4, 0.0], [0.0, 1e-4]], measurement = [1e-3] }
[[tasks.costs]]
kind = "state"
select = ["x1", "x2"]
target = [0.0, 0.0]
norm = "quadratic"
weight = 1.0
final_weight = 50.0
[[tasks.costs]]
kind = "control"
norm = "quadratic"
weight = 0.01
[[tasks.limits]]
kind = "state"
select = ["x2"]
lower = -0.5
upper = 0.5
enforce = true
"#;

/// The plan of a linear problem meets the conditions of its quadratic program, which is set up here as dense matrices.
#[test]
fn the_plan_of_a_linear_problem_solves_its_quadratic_program() {
    let problem = supple_file::parse(LINEAR, "linear.toml").unwrap();
    let state = plan_of(&problem);
    assert_eq!(state.plan.status, PlanStatus::Converged);
    let (steps, a, b) = (30, [[1.0, 0.1], [0.0, 1.0]], [0.005, 0.1]);
    // x_t = free_t + sum over s of response_{t - s} u_s
    let apply = |x: [f64; 2]| [a[0][0] * x[0] + a[0][1] * x[1], a[1][0] * x[0] + a[1][1] * x[1]];
    let (mut free, mut response) = (vec![[1.0, 0.0]], vec![b]);
    for t in 0..steps {
        free.push(apply(free[t]));
        response.push(apply(response[t]));
    }
    let u = DVector::from_fn(steps, |t, _| state.plan.trajectory.controls.vector(t)[0]);
    let row = |t: usize, i: usize| DVector::from_fn(steps, |s, _| if s < t { response[t - 1 - s][i] } else { 0.0 });
    let mut hessian = DMatrix::identity(steps, steps) * 0.02;
    let mut slope = DVector::zeros(steps);
    for (t, free) in free.iter().enumerate() {
        let weight = if t == steps { 100.0 } else { 2.0 };
        for (i, free) in free.iter().enumerate() {
            let row = row(t, i);
            hessian += weight * &row * row.transpose();
            slope += weight * free * row;
        }
    }
    let mut residual = &hessian * &u + slope;
    let mut held = 0;
    for (t, free) in free.iter().enumerate().skip(1) {
        let row = row(t, 1);
        let speed = free[1] + row.dot(&u);
        let [upper, lower] = [0, 1].map(|end| state.plan.multipliers.vector(t)[end]);
        assert!(speed.abs() <= 0.5 + 1e-9, "speed {speed} at step {t}");
        assert!(upper * (speed - 0.5) >= -1e-7 && lower * (-0.5 - speed) >= -1e-7, "multipliers inside of the limits");
        held += usize::from(upper + lower > 0.0);
        residual += (upper - lower) * row;
    }
    assert!(held >= 5, "{held}");
    assert!(residual.amax() < 1e-8, "{}", residual.amax());
}

/// A mass that must not be faster than a limit, so that none of its first steps is free to vary.
const FAST: &str = r#"
    parameters.k = { initial = 1.6, bounds = [0.05, 6.0] }
    parameters.d = { initial = 0.6, bounds = [-0.5, 3.0] }
    parameters.fastest = { initial = 0.58, bounds = [0.1, 3.0] }
    [model]
    kind = "linear"
    A = [[1.0, 0.2], ["-0.2 * k", "1 - 0.2 * d"]]
    B = [[0.0], [0.2]]
    C = [[1.0, 0.0]]
    [[tasks]]
    name = "haul"
    steps = 5
    time_step = 0.1
    initial_state = [-1.02, -0.06]
    noise = { initial = [0.1, 0.05], process = [1e-4, 1e-3], measurement = [0.05] }
    costs = [{ kind = "quadratic", Q = [[1.86, 0.0], [0.0, 0.23]], R = [[0.048]], final = [[4.77, 0.0], [0.0, 3.3]] }]
    limits = [
        { kind = "control", lower = -2.8, upper = 2.8, enforce = true },
        { kind = "state", select = ["x2"], lower = "-fastest", upper = "fastest", enforce = true },
    ]
"#;

/// Every gradient against differences of plans that are made anew, which keep the limits too.
#[test]
fn gradients_move_along_limits() {
    let linear = supple_file::parse(LINEAR, "linear.toml").unwrap();
    let fast = supple_file::parse(FAST, "fast.toml").unwrap();
    let others = LIMITS.map(|(name, limit)| shipped_with(name, &kept(limit)));
    // Its bound moves with a parameter.
    let moving = "kind = \"state\"\nselect = [\"v2\"]\nupper = \"0.8 * sqrt(k1 / 500)\"";
    let moving = shipped_with("two_mass.toml", &kept(moving));
    for problem in [linear, fast, moving].iter().chain(&others) {
        let phi = problem.parameters.initial();
        assert!(!evaluated(problem).limits_reached.is_empty(), "{}", problem.title);
        let report = check(problem, &phi).unwrap();
        for row in report.tasks.iter().flat_map(|task| &task.rows) {
            assert!(row.passed, "{}: {row:?}", problem.title);
        }
        assert!(
            report.tasks.iter().all(|task| task.left_out.is_empty()),
            "{}: {:?}",
            problem.title,
            report.tasks[0].left_out
        );
    }
}

#[test]
fn a_limit_that_no_plan_keeps_is_named() {
    // The wall is 0.75 m away: who stays at 0.2 m never presses on it, which is possible; who moves forward at 1 m/s from
    // the first step on would need an infinite force.
    let problem = shipped_with("two_mass.toml", &kept("kind = \"state\"\nselect = [\"x1\"]\nlower = 0.5"));
    let at = problem.evaluate(&problem.parameters.initial(), &EvaluateOptions::default()).unwrap();
    assert_ne!(at.tasks[0].status, PlanStatus::Converged);
    assert!(!at.feasible && !at.tasks[0].limits_violated.is_empty());
    assert!(at.warnings().any(|warning| warning.contains("exceeds an enforced limit")));
}

#[test]
fn a_plan_that_begins_outside_a_limit_does_not_keep_it() {
    // All later states could keep it, but nothing is searched for that no plan can keep.
    let problem = shipped_with("two_mass.toml", &kept("kind = \"state\"\nselect = [\"v1\"]\nlower = 1e-3"));
    let at = problem.evaluate(&problem.parameters.initial(), &EvaluateOptions::default()).unwrap();
    let task = &at.tasks[0];
    assert_eq!((task.status, at.feasible), (PlanStatus::LimitsExceeded, false));
    let free = evaluated(&shipped("two_mass.toml"));
    assert_eq!((task.iterations, task.cost.parts.nominal), (free.iterations, free.cost.parts.nominal));
    assert_eq!(task.limits_violated.len(), 1);
    let said = "at step 0 (0.0000 s) `v1` is 0.001 m/s below its lower limit, 0.001: the initial state exceeds it";
    assert!(at.warnings().any(|warning| warning.contains(said)), "{:?}", at.warnings().collect::<Vec<_>>());
}

/// A slide of 2 kg under gravity whose drive is too weak for it, and which may not fall.
const LIFT: &str = r#"
[model]
kind = "robot"
file = "lift.urdf"
gravity = [0.0, 0.0, -9.81]
[[model.sensors]]
kind = "joint_position"
variance = 1e-4
[[tasks]]
name = "lift"
steps = 50
time_step = 0.01
noise = { initial = [1e-4, 1e-4], process = [1e-6, 1e-6] }
costs = [{ kind = "joint_position", target = [0.1], weight = 1.0 }, { kind = "control", weight = 1e-3 }]
[[tasks.limits]]
kind = "drive_effort"
lower = -5.0
upper = 5.0
enforce = true
[[tasks.limits]]
kind = "joint_velocity"
lower = -0.1
enforce = true
"#;

/// Drives that cannot hold the weight that they start with are named, with what it takes.
#[test]
fn limits_below_what_the_first_state_takes_are_named() {
    let robot = r#"<robot name="lift"><link name="base"/>
        <joint name="slide" type="prismatic"><parent link="base"/><child link="load"/><axis xyz="0 0 1"/>
            <limit lower="-1" upper="1" effort="100" velocity="10"/></joint>
        <link name="load"><inertial><mass value="2"/>
            <inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link></robot>"#;
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR"));
    std::fs::write(folder.join("lift.urdf"), robot).unwrap();
    let problem = supple_file::parse(LIFT, folder.join("lift.toml").to_str().unwrap()).unwrap();
    let at = problem.evaluate(&[], &EvaluateOptions::default()).unwrap();
    assert!(!at.tasks[0].status.is_converged());
    let said = "; holding the initial state takes 19.62 N of `effort of slide`, whose enforced limit is 5";
    assert!(at.warnings().any(|warning| warning.ends_with(said)), "{:?}", at.warnings().collect::<Vec<_>>());
}

#[test]
fn plans_of_other_kinds_refuse_limits() {
    let problem = shipped_with("two_mass.toml", &kept(LIMITS[0].1));
    for plan in ["belief", "risk", "sampled"] {
        let plan: supple::plan::PlanMode = serde_json::from_str(&format!("{plan:?}")).unwrap();
        let settings = PlanSettings { plan, ..problem.planning.clone() };
        let mut state = TaskState::new(&problem.tasks[0]);
        let refused = state.evaluate(&problem.tasks[0], &problem.parameters.initial(), &settings, None).unwrap_err();
        assert!(refused.to_string().contains("leave out `enforce`"), "{refused}");
    }
}

#[test]
fn a_design_within_a_limit_of_speed_meets_limit_and_bound() {
    let mut problem = shipped_with("two_mass.toml", &kept(LIMITS[0].1));
    problem.tasks[0].bound = Some(330.0.into());
    let settings = DesignSettings { starts: 1, ..problem.design.clone() };
    let phi = problem.parameters.initial();
    let found = design(&problem, &phi, &settings, Control::default()).unwrap();
    assert_eq!(found.status, DesignStatus::Converged);
    let best = found.found();
    let at = problem.evaluate(&best.to, &EvaluateOptions::default()).unwrap();
    let task = &at.tasks[0];
    assert!(at.feasible, "{:?}, cost {}", task.status, task.cost.expected);
    assert!(task.limits_violated.is_empty() && !task.limits_reached.is_empty());
    let rest = problem.evaluate(&phi, &EvaluateOptions::default()).unwrap();
    assert!(at.objective.information_bits < rest.objective.information_bits);
}

/// A start that no step brings closer to its limits is not left by ever smaller ones.
#[test]
fn a_start_that_misses_its_limit_the_least_takes_few_designs() {
    let mut problem = shipped_with("two_mass.toml", &kept(LIMITS[0].1));
    let settings = DesignSettings { starts: 1, rounds: 1, ..problem.design.clone() };
    let least = Searcher::new(&problem, &settings, Aim::Cost, Control::default());
    let least = least.search(&problem.parameters.initial()).unwrap();
    let best = least.found().clone();
    problem.tasks[0].bound = Some((0.999 * best.costs[0]).into());
    let searcher = Searcher::new(&problem, &settings, Aim::default(), Control::default());
    let found = searcher.search_from(&best.to, &best.controls, 0).unwrap();
    assert_eq!(found.status, DesignStatus::BoundViolated);
    assert!(found.evaluations < 60, "{}", found.evaluations);
    assert!((found.costs[0] / best.costs[0] - 1.0).abs() < 1e-6);
}

/// They are bounds, which the control law keeps too; their price is that of any limit.
#[test]
fn limits_of_controls_bound_the_law() {
    let greatest = |state: &TaskState| state.plan.trajectory.controls.as_slice().iter().copied().fold(0.0, f64::max);
    let most = 0.9 * greatest(&plan_of(&shipped("two_mass.toml")));
    let with = |upper: f64| shipped_with("two_mass.toml", &kept(&format!("kind = \"control\"\nupper = {upper:?}")));
    let problem = with(most);
    assert!(problem.tasks[0].control_bounds.is_some() && problem.tasks[0].system.constraints().is_none());
    let state = plan_of(&problem);
    assert_eq!((state.plan.status, greatest(&state)), (PlanStatus::Converged, most));
    let held = (0..problem.tasks[0].steps).find(|&t| state.plan.policy.clamped[t]).unwrap();
    assert!(state.plan.policy.feedback.at(held).iter().all(|gain| *gain == 0.0));
    let at = evaluated(&problem);
    let [reached] = &at.limits_reached[..] else { panic!("{:?}", at.limits_reached) };
    assert_eq!((reached.limit, reached.upper, reached.step), (most, true, held));
    assert!(at.limits_violated.is_empty());
    let cost = |upper: f64| plan_of(&with(upper)).plan.nominal_cost;
    let slope = |step: f64| (cost(most - step) - cost(most + step)) / (2.0 * step);
    let slope = (4.0 * slope(5e-4) - slope(1e-3)) / 3.0;
    assert!((reached.price / slope - 1.0).abs() < 1e-5, "price {}, slope {slope}", reached.price);
}

#[test]
fn controls_that_cannot_be_within_their_limits_exceed_them() {
    let limits = [("lower", 30.0), ("upper", 20.0)];
    let limits = limits.map(|(end, limit)| kept(&format!("kind = \"control\"\n{end} = {limit:?}"))).concat();
    let problem = shipped_with("two_mass.toml", &limits);
    assert!(problem.tasks[0].control_bounds.is_none());
    let at = evaluated(&problem);
    assert!(!at.status.is_converged() && !at.limits_violated.is_empty(), "{}", at.status);
}

/// A control that may have one value only is held at the end beyond which the cost would fall.
#[test]
fn a_fixed_control_is_held_at_one_end_at_a_time() {
    let fixed = evaluated(&shipped_with("two_mass.toml", &kept("kind = \"control\"\nlower = 60.0\nupper = 60.0")));
    let steps: usize = fixed.limits_reached.iter().map(|reached| reached.steps).sum();
    assert!(
        steps <= 125 && fixed.limits_reached.iter().all(|reached| reached.price > 0.0),
        "{:?}",
        fixed.limits_reached
    );
}
