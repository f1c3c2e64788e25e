//! Limits of the controls that plans keep: against a quadratic program over the whole horizon, on the door, in gradients
//! and in closed loop; and where there is nothing to keep.

use supple::cost::Cost;
use supple::design::best_plan;
use supple::lqg::ControlBounds;
use supple::noise::{Covariance, NoiseModel};
use supple::pipeline::TaskState;
use supple::plan::bounds_of;
use supple::plan::{PlanSettings, PlanStatus};
use supple::quantity::{Control, State};
use supple::simulate::{Rollouts, monte_carlo};
use supple::system::{Authored, ExcessVariation, Points, System, Times};
use supple::{Dimensions, EvaluateOptions, Limit, Matrices, Model, Point, Problem, Scalar, Scratch, Task, Value};

use crate::common::reference::differences::total_gradient_errors;
use crate::common::reference::finger::{self, BOUNDS, scales};
use crate::common::reference::{evaluated, numbers, relative_error, task};
use crate::common::repository;
use crate::robot::arm::{Description, arm, cost, servo};
use crate::robot::bad_tasks::error_of;

const KEY: &str = "enforce_effort_limits = true\n";

/// A mass of 1 kg on a line, pushed by a force of at most 1 N.
struct Mass;

const TIME_STEP: f64 = 0.05;
const STEPS: usize = 60;
const START: [f64; 2] = [1.0, 0.2];
const FORCE_WEIGHT: f64 = 1e-2;

impl Model for Mass {
    fn dimensions(&self) -> Dimensions {
        Dimensions { states: 2, controls: 1, measurements: 1 }
    }
    fn step<S: Scalar>(&self, at: &Point<S>, next: &mut [S]) {
        next[1] = at.x[1] + at.time_step * at.u[0];
        next[0] = at.x[0] + at.time_step * next[1];
    }
    fn observe<S: Scalar>(&self, at: &Point<S>, y: &mut [S]) {
        y[0] = at.x[0];
    }
    fn limits(&self) -> Vec<Limit> {
        let control = |upper| Limit::control("force".into(), 0, -1.0, upper);
        vec![control(f64::INFINITY), Limit::state("position".into(), 0, -0.1, 0.1), control(1.0)]
    }
}

/// Weights of position and velocity: of each step and of the end.
const WEIGHTS: [[f64; 2]; 2] = [[1.0, 0.01], [50.0, 20.0]];

/// Brings the mass to rest at 0.
fn stop() -> Task {
    let cost = |state: usize| Cost::new(State::new([state]), WEIGHTS[0][state]).with_final_weight(WEIGHTS[1][state]);
    let costs = vec![cost(0), cost(1), Cost::new(Control::all(1), FORCE_WEIGHT)];
    let small = || Covariance::diagonal([1e-8, 1e-8]);
    let noise = NoiseModel {
        initial: small(),
        process: small(),
        measurement: Covariance::diagonal([1e-6]),
        varying: Vec::new(),
    };
    let system = Authored::new(Mass, costs, Value::Number(TIME_STEP), 0);
    let control_bounds = bounds_of(&system.limits(), 1);
    Task { control_bounds, ..task(system, STEPS, numbers(&START), &[0.0], noise) }
}

/// The same by brute force: the cost as a function of all forces, its gradient by running the mass forwards and the
/// adjoint back, and accelerated projected gradient steps until none moves a force by more than 1e-15.
fn forces_of_the_whole_horizon() -> Vec<f64> {
    let gradient = |forces: &[f64]| {
        let mut states = vec![START];
        for force in forces {
            let [x, v] = states[states.len() - 1];
            let v = v + TIME_STEP * force;
            states.push([x + TIME_STEP * v, v]);
        }
        let slope = |t: usize, i: usize| 2.0 * WEIGHTS[usize::from(t == STEPS)][i] * states[t][i];
        let mut adjoint = [slope(STEPS, 0), slope(STEPS, 1)];
        let mut gradient = vec![0.0; STEPS];
        for t in (0..STEPS).rev() {
            let [by_x, by_v] = adjoint;
            let by_v = by_v + TIME_STEP * by_x;
            gradient[t] = 2.0 * FORCE_WEIGHT * forces[t] + TIME_STEP * by_v;
            adjoint = [by_x + slope(t, 0), by_v + slope(t, 1)];
        }
        gradient
    };
    // Power iteration for the largest curvature.
    let origin = gradient(&[0.0; STEPS]);
    let (mut direction, mut most) = (vec![1.0; STEPS], 0.0);
    for _ in 0..200 {
        let product: Vec<f64> = gradient(&direction).iter().zip(&origin).map(|(a, b)| a - b).collect();
        most = product.iter().map(|p| p * p).sum::<f64>().sqrt();
        direction = product.iter().map(|p| p / most).collect();
    }
    let (mut forces, mut ahead, mut momentum) = (vec![0.0; STEPS], vec![0.0; STEPS], 1.0f64);
    for _ in 0..200_000 {
        let slope = gradient(&ahead);
        let next: Vec<f64> = ahead.iter().zip(&slope).map(|(u, g)| (u - g / (1.01 * most)).clamp(-1.0, 1.0)).collect();
        let moved: Vec<f64> = next.iter().zip(&forces).map(|(a, b)| a - b).collect();
        let uphill: f64 = slope.iter().zip(&moved).map(|(g, d)| g * d).sum();
        let after = if uphill > 0.0 { 1.0 } else { 0.5 * (1.0 + (1.0 + 4.0 * momentum * momentum).sqrt()) };
        let share = if uphill > 0.0 { 0.0 } else { (momentum - 1.0) / after };
        ahead = next.iter().zip(&moved).map(|(u, d)| u + share * d).collect();
        (forces, momentum) = (next, after);
        let own = gradient(&forces);
        let residual = forces.iter().zip(own).map(|(u, g)| (u - (u - g / most).clamp(-1.0, 1.0)).abs());
        if residual.fold(0.0, f64::max) < 1e-15 {
            break;
        }
    }
    forces
}

/// With `--nocapture` it says what is reached.
#[test]
#[allow(clippy::print_stderr)]
fn the_plan_is_the_solution_of_the_quadratic_program() {
    let state = evaluated(&stop(), &[]);
    let expected = forces_of_the_whole_horizon();
    let found: Vec<f64> = (0..STEPS).map(|t| state.plan.trajectory.controls.vector(t)[0]).collect();
    let error = relative_error(&found, &expected);
    let held = state.plan.policy.clamped.iter().filter(|&&held| held).count();
    eprintln!("{held} of {STEPS} forces at a bound, {} iterations, off by {error:.1e}", state.plan.iterations);
    assert!(held > STEPS / 4 && found.contains(&-1.0) && found.contains(&1.0), "{found:?}");
    assert!(error < 1e-9, "{found:?} instead of {expected:?}, off by {error:.1e}");
    for (t, force) in found.iter().enumerate() {
        let feedback = &state.plan.policy.feedback.at(t)[..2];
        assert_eq!(state.plan.policy.clamped[t], force.abs() == 1.0, "step {t}");
        assert_eq!(state.plan.policy.clamped[t], feedback == [0.0, 0.0], "step {t}: {feedback:?}");
    }
}

/// The noise is small beside the bounds: the clamped law costs what its linearisation says.
#[test]
fn closed_loop_runs_keep_the_limits() {
    let task = stop();
    let state = evaluated(&task, &[]);
    let runs =
        monte_carlo(&task, &[], &state.plan, &state.noise, state.cost.expected(), Rollouts { count: 2000, seed: 1 })
            .unwrap();
    let off = (runs.difference / runs.cost_standard_error).abs();
    assert!(off < 4.0, "{off} standard errors: {} instead of {}", runs.cost_mean, state.cost.expected());
    // The same law without bounds pushes harder, and so costs something else.
    let free = Task { control_bounds: None, ..stop() };
    let unbounded =
        monte_carlo(&free, &[], &state.plan, &state.noise, state.cost.expected(), Rollouts { count: 2000, seed: 1 })
            .unwrap();
    assert_ne!(runs.cost_mean, unbounded.cost_mean);
}

/// Total gradients by all parameters of the finger, whose two controls are held at times.
#[test]
#[allow(clippy::print_stderr)]
fn gradients_are_those_of_the_task_planned_anew() {
    let phi: Vec<f64> = BOUNDS.iter().map(|[lower, upper]| lower + 0.6 * (upper - lower)).collect();
    for bounds in [[[-0.1, 0.9], [-0.25, 0.3]], [[0.1, 0.6], [-1.0, 0.2]]] {
        let task = Task { control_bounds: Some(ControlBounds::new(&bounds)), ..finger::task(25) };
        let mut state = evaluated(&task, &phi);
        let held = state.plan.policy.clamped.iter().filter(|&&held| held).count();
        assert!(held > 5 && held < 45, "{held} of 50 controls are held");
        for (name, error) in total_gradient_errors(&task, &mut state, &phi, &scales()) {
            eprintln!("{bounds:?}, {held} of 50 held, {name}: off by {error:.1e}");
            assert!(error < 1e-5, "{name} with {bounds:?}: off by {error:.1e}");
        }
    }
}

/// The door task, with a key added to its tasks.
fn door(key: &str) -> Problem {
    let path = repository("tasks/iiwa_door.toml");
    let text = std::fs::read_to_string(&path).unwrap().replace("\nsteps = 500\n", &format!("\nsteps = 500\n{key}"));
    supple_file::parse(&text, &path.display().to_string()).unwrap_or_else(|error| panic!("{error}"))
}

fn planned(problem: &Problem, index: usize, phi: &[f64]) -> TaskState {
    let mut state = TaskState::new(&problem.tasks[index]);
    best_plan(problem, &problem.tasks[index], phi, None, &mut state).unwrap();
    assert_eq!(state.plan.status, PlanStatus::Converged);
    state
}

fn peak(state: &TaskState) -> f64 {
    let controls = &state.plan.trajectory.controls;
    (0..controls.count()).flat_map(|t| controls.vector(t)).fold(0.0, |peak: f64, torque| peak.max(torque.abs()))
}

#[test]
#[allow(clippy::print_stderr)]
fn the_door_opens_within_300_newton_metres() {
    let (limited, free) = (door(KEY), door(""));
    let phi = limited.parameters.initial();
    let (with, without) = (planned(&limited, 0, &phi), planned(&free, 0, &phi));
    let held = with.plan.policy.clamped.iter().filter(|&&held| held).count();
    let [cost, least] = [&with, &without].map(|state| state.cost.nominal);
    eprintln!(
        "{held} torques held, {} iterations, stationary to {:.1e}; cost {cost} instead of {least}, peak {} instead of {}",
        with.plan.iterations,
        with.plan.relative_stationarity,
        peak(&with),
        peak(&without)
    );
    assert!(peak(&without) > 311.0);
    assert_eq!(peak(&with), 300.0);
    assert!(held > 0);
    assert!(cost > least && cost < 1.001 * least, "{cost} instead of {least}");
}

/// Errors by `log k` at a gripper for which torques are held.
#[test]
#[allow(clippy::print_stderr)]
fn gradients_of_the_limited_door_are_those_of_differences() {
    let problem = door(KEY);
    let task = &problem.tasks[0];
    let phi = [1e6, 1e5, 3e5];
    let mut state = planned(&problem, 0, &phi);
    assert!(state.plan.policy.clamped.contains(&true));
    let scales: Vec<f64> = phi.iter().map(|k| 100.0 * k).collect();
    for (name, error) in total_gradient_errors(task, &mut state, &phi, &scales) {
        eprintln!("{name}: off by {error:.1e}");
        assert!(error < 1e-5, "{name}: off by {error:.1e}");
    }
}

#[test]
fn limits_that_are_not_reached_change_nothing() {
    let (mut limited, free) = (door(KEY), door(""));
    let phi = [1e4, 1e4, 1e4];
    for task in &mut limited.tasks {
        task.control_bounds = Some(ControlBounds::new(&[[-350.0, 350.0]; 7]));
    }
    for index in 0..2 {
        let (with, without) = (planned(&limited, index, &phi), planned(&free, index, &phi));
        assert!(peak(&without) < 350.0, "{}", peak(&without));
        assert!(!with.plan.policy.clamped.contains(&true));
        let all = |state: &TaskState| {
            let cost = state.cost;
            [cost.nominal, cost.belief, cost.process, cost.initial, state.information.total]
        };
        for (found, expected) in all(&with).into_iter().zip(all(&without)) {
            assert!((found - expected).abs() <= 1e-12 * expected, "{found} instead of {expected}");
        }
        let [found, expected] = [&with, &without].map(|state| state.plan.trajectory.controls.as_slice());
        assert!(relative_error(found, expected) < 1e-12);
    }
}

/// Even where the guess is far outside.
#[test]
fn guesses_are_moved_inside() {
    let mut task = stop();
    task.initial_control = vec![numbers(&[100.0])];
    let mut state = TaskState::new(&task);
    let settings = PlanSettings { max_iterations: 1, ..Default::default() };
    state.evaluate(&task, &[], &settings, None).unwrap();
    assert!(state.plan.trajectory.controls.as_slice().iter().all(|force| force.abs() <= 1.0));
    assert!(evaluated(&task, &[]).plan.nominal_cost < state.plan.nominal_cost);
}

fn with_key(description: &Description) -> String {
    description.text().replace("steps = ", &format!("{KEY}steps = "))
}

#[test]
fn robots_keep_the_efforts_of_their_file() {
    let text = with_key(&arm().with("[model.drives.elbow]\ngear = -10.0\n"));
    let problem = supple_file::parse(&text, "tests/data/task.toml").unwrap();
    let bounds = problem.tasks[0].control_bounds.as_ref().unwrap();
    assert_eq!((bounds.lower(), bounds.upper()), (&[-50.0, -3.0, -100.0][..], &[50.0, 3.0, 100.0][..]));
    assert_eq!(arm().problem().tasks[0].control_bounds, None);
}

/// A position drive's control is no torque, but its torque is limited by the joint all the same, and by the actuator.
#[test]
fn position_drives_keep_the_efforts_of_their_joints() {
    let costs = cost("joint_position", "target = [0.4, -0.3, 0.1]\nweight = 1e3") + &cost("control", "weight = 1e-3");
    let drives = "[model.drives]\nshoulder = { kp = 4000.0, kv = 80.0 }\nslide = { kv = 900.0 }\n";
    let text = Description { steps: 40, ..arm().with(drives).costing(&costs) }.text();
    let limited = |text: &str| {
        let problem = supple_file::parse(text, "tests/data/task.toml").unwrap();
        let options = EvaluateOptions { trajectories: true, rollouts: 0, ..Default::default() };
        let at = problem.evaluate(&problem.parameters.initial(), &options).unwrap();
        assert!(at.tasks[0].status.is_converged(), "{:?}", at.tasks[0].warnings);
        let efforts = at.tasks[0].trajectory.as_ref().unwrap().quantities.clone();
        let efforts = efforts.into_iter().filter(|quantity| quantity.name.starts_with("effort of"));
        let exceeded = at.tasks[0].limits_violated.iter().map(|limit| limit.name.clone()).collect::<Vec<_>>();
        (efforts.collect::<Vec<_>>(), exceeded)
    };
    let (efforts, exceeded) = limited(&text);
    let said: Vec<_> = efforts.iter().map(|effort| (&*effort.name, &*effort.unit, &*effort.of, effort.upper)).collect();
    assert_eq!(
        said,
        [("effort of shoulder", "N m", "robot", Some(50.0)), ("effort of slide", "N", "robot", Some(100.0))]
    );
    let most = |values: &[f64]| values.iter().fold(0.0_f64, |most, value| most.max(value.abs()));
    assert!(most(&efforts[0].values) > 60.0 && exceeded.contains(&"effort of shoulder".to_owned()), "{exceeded:?}");
    let (efforts, exceeded) = limited(&text.replace("steps = ", &format!("{KEY}steps = ")));
    assert!(most(&efforts[0].values) < 50.0 * (1.0 + 1e-6) && most(&efforts[0].values) > 49.0, "{:?}", efforts[0]);
    assert!(exceeded.iter().all(|name| !name.starts_with("effort")), "{exceeded:?}");
    // The range of an actuator's force, times its gear.
    let servo = servo().problem();
    let drives = servo.tasks[0].system.followed(&[]);
    let of_servo = drives.iter().find(|number| number.channel.name == "effort of servo").unwrap();
    assert_eq!((of_servo.limits, &*of_servo.of), ([-135.0, 135.0], "robot"));
}

/// Under implicit integration, the torque of a position drive is that at the end of each step: `kp (u - q) - kv q'` of the
/// state that the step leads to. A limit that is kept at the beginning of steps alone was exceeded twofold by their ends.
#[test]
fn position_drives_keep_their_limits_at_the_ends_of_steps() {
    let costs = cost("joint_position", "target = [0.4, -0.3, 0.1]\nweight = 1e3") + &cost("control", "weight = 1e-3");
    let drives = "[model.drives]\nshoulder = { kp = 4000.0, kv = 80.0 }\nelbow = { kp = 4000.0, kv = 80.0 }\n";
    let text = Description { steps: 40, ..arm().with(drives).costing(&costs) }.text();
    let limit = "limits = [{ kind = \"drive_effort\", select = [\"shoulder\"], lower = -30.0, upper = 30.0, enforce = true }]\n";
    let text = text.replace("steps = ", &format!("{limit}steps = "));
    let problem = supple_file::parse(&text, "tests/data/task.toml").unwrap();
    let options = EvaluateOptions { trajectories: true, rollouts: 0, ..Default::default() };
    let at = problem.evaluate(&problem.parameters.initial(), &options).unwrap();
    assert!(at.tasks[0].status.is_converged(), "{:?}", at.tasks[0].warnings);
    let trajectory = at.tasks[0].trajectory.as_ref().unwrap();
    let place = |name: &str| trajectory.state_names.iter().position(|other| other == name).unwrap();
    let (q, v) = (place("q.shoulder"), place("v.shoulder"));
    let control = trajectory.control_names.iter().position(|name| name.ends_with("shoulder")).unwrap();
    let torque = |step: usize| {
        let end = &trajectory.states[step + 1];
        4000.0 * (trajectory.controls[step][control] - end[q]) - 80.0 * end[v]
    };
    let torques: Vec<f64> = (0..trajectory.controls.len()).map(torque).collect();
    let most = torques.iter().fold(0.0_f64, |most, torque| most.max(torque.abs()));
    assert!(most > 29.9 && most < 30.0 * (1.0 + 1e-6), "{most}");
    let shown = trajectory.quantities.iter().find(|quantity| quantity.name == "effort of shoulder").unwrap();
    assert!(relative_error(&shown.values, &torques) < 1e-9, "{:?} {torques:?}", shown.values);
}

/// With sub-steps, efforts of position drives keep their limits in the first of them too, where a change of the control has
/// its greatest effect: by steps of a robot whose time step is that of a sub-step.
#[test]
fn position_drives_keep_their_limits_in_the_first_sub_step() {
    let drives = "[model.drives]\nshoulder = { kp = 4000.0, kv = 80.0 }\nelbow = { kp = 4000.0, kv = 80.0 }\n";
    let costs = cost("joint_position", "target = [0.4, -0.3, 0.1]\nweight = 1e3") + &cost("control", "weight = 1e-3");
    let plain = Description { steps: 40, ..arm().with(drives).costing(&costs) };
    let short = Description { time_step: "0.0025".into(), ..plain.clone() }.problem();
    let mut divided = plain;
    divided.model.insert_str(0, "substeps = 8\n");
    let limit = |enforce: bool| {
        let keys = "kind = \"drive_effort\", select = [\"shoulder\"], lower = -30.0, upper = 30.0";
        let text = divided.text();
        let text = text.replace("steps = 40", &format!("limits = [{{ {keys}, enforce = {enforce} }}]\nsteps = 40"));
        supple_file::parse(&text, "tests/data/task.toml").unwrap()
    };
    let (kept, free) = (limit(true), limit(false));
    let efforts = |problem: &Problem| {
        let options = EvaluateOptions { trajectories: true, rollouts: 0, ..Default::default() };
        let task = problem.evaluate(&problem.parameters.initial(), &options).unwrap().tasks.remove(0);
        assert!(task.status.is_converged(), "{:?}", task.warnings);
        let trajectory = task.trajectory.unwrap();
        let place = |name: &str| trajectory.state_names.iter().position(|other| other == name).unwrap();
        let (q, v) = (place("q.shoulder"), place("v.shoulder"));
        let control = trajectory.control_names.iter().position(|name| name.ends_with("shoulder")).unwrap();
        let phi = problem.parameters.initial();
        let of_step = |step: usize| {
            let (mut x, u) = (trajectory.states[step].clone(), &trajectory.controls[step]);
            let of_substep = |_| {
                x = crate::robot::arm::step(&short, &x, u, &phi);
                4000.0 * (u[control] - x[q]) - 80.0 * x[v]
            };
            (0..8).map(of_substep).collect::<Vec<f64>>()
        };
        let all: Vec<Vec<f64>> = (0..trajectory.controls.len()).map(of_step).collect();
        (all, task.limits_violated, trajectory.quantities)
    };
    let most = |all: &[Vec<f64>], place: usize| all.iter().map(|of| of[place].abs()).fold(0.0, f64::max);
    let (all, violated, shown) = efforts(&kept);
    let (first, last) = (most(&all, 0), most(&all, 7));
    assert!(first < 30.0 * (1.0 + 1e-6) && last < 30.0 * (1.0 + 1e-6) && first > 29.9, "{first} {last}");
    assert!(violated.iter().all(|limit| !limit.name.starts_with("effort of shoulder")), "{violated:?}");
    let early = shown.iter().find(|quantity| quantity.name == "effort of shoulder in the first sub-step").unwrap();
    let own: Vec<f64> = all.iter().map(|of| of[0]).collect();
    assert!(relative_error(&early.values, &own) < 1e-9, "{:?} {own:?}", early.values);
    // Without, the first sub-step is far beyond the limit, which the last one hides.
    let (all, violated, _) = efforts(&free);
    assert!(most(&all, 0) > 60.0, "{}", most(&all, 0));
    assert!(violated.iter().any(|limit| limit.name == "effort of shoulder in the first sub-step"), "{violated:?}");
}

#[test]
fn limits_must_be_known() {
    let drives = "[model.drives.shoulder]\ngear = \"g\"\n[model.drives.elbow]\ngear = \"g\"\n\
                  [model.drives.slide]\ngear = \"g\"\n";
    let text = with_key(&arm().with(drives).where_(&[("g", 2.0)]));
    let expected = |text: &str, said: &str| {
        let line = text.lines().position(|line| line.starts_with("enforce")).unwrap() + 1;
        format!("task.toml:{line}:25: tasks[0].enforce_effort_limits: {said}")
    };
    let assert_says = |text: &str, said: &str| {
        let found = error_of(text);
        assert!(found.starts_with(&expected(text, said)), "{found}");
    };
    let said = "must be false: the model has no control limits; found true";
    assert_says(&text, said);
    let wrong = with_key(&arm()).replace("limits = true", "limits = 1");
    assert_says(&wrong, "must be `true` or `false`; found 1");
    let whole = supple_file::parse(&text, "tests/data/task.toml").err().unwrap();
    assert!(whole.help.unwrap().contains("whose gears are numbers"));
    let linear = format!(
        "[model]\nkind = \"linear\"\nA = [[1.0]]\nB = [[0.1]]\nC = [[1.0]]\n[[tasks]]\nname = \"hold\"\n{KEY}steps = 5\n\
         time_step = 0.1\ninitial_state = [1.0]\nnoise = {{ initial = [1.0], process = [1.0], measurement = [1.0] }}\n\
         [[tasks.costs]]\nkind = \"control\"\nweight = 1.0\n"
    );
    assert_says(&linear, said);
}

/// Efforts at the ends of steps take the next state: their derivatives, composed from those of sub-steps, are those of
/// differences, at the points that have multipliers.
#[test]
fn derivatives_of_limits_that_take_the_next_state_are_those_of_differences() {
    for substeps in [1, 3] {
        let drives = "[model.drives]\nshoulder = { kp = \"kp\", kv = 80.0 }\nelbow = { kp = 400.0, kv = \"kv\" }\n";
        let costs = cost("joint_position", "weight = 1.0") + &cost("control", "weight = 1e-3");
        let mut divided = Description {
            steps: 12,
            parameters: vec![("kp", 900.0), ("kv", 30.0)],
            ..arm().with(drives).costing(&costs)
        };
        divided.model.insert_str(0, &format!("substeps = {substeps}\n"));
        let limits = "[{ kind = \"drive_effort\", select = [\"shoulder\", \"elbow\"], lower = -30.0, upper = 30.0, enforce = true },\n\
                      { kind = \"joint_acceleration\", select = [\"slide\"], upper = 3.0, enforce = true }]";
        let text = divided.text().replace("steps = 12", &format!("limits = {limits}\nsteps = 12"));
        let problem = supple_file::parse(&text, "tests/data/task.toml").unwrap();
        let (system, phi) = (&*problem.tasks[0].system, problem.parameters.initial());
        let limits = system.constraints().unwrap();
        let (size, ends) = (system.dimensions(), limits.bounds(&phi).len());
        let (n, joint) = (size.states, size.joint());
        let mut scratch = Scratch::new();
        let wave = |i: usize, j: usize, size: f64| size * (1.3 * i as f64 + 2.1 * j as f64 + 0.4).sin();
        let rows = |count: usize, len: usize, size: f64| {
            let rows: Vec<Vec<f64>> = (0..count).map(|i| (0..len).map(|j| wave(i, j, size)).collect()).collect();
            Matrices::of_rows(&rows, len)
        };
        let (stages, z) = (12, rows(12, joint, 0.3));
        let mut multipliers = rows(stages, ends, 1.0);
        let mut moved = rows(stages, ends, 0.7);
        for idle in [0, 1, 2, 3, 4, 5, 6, 7, 8, 10] {
            multipliers.vector_mut(idle).fill(0.0);
            moved.vector_mut(idle).fill(0.0);
        }
        let split = |z: &Matrices| {
            let part = |from: usize, to: usize| {
                let rows: Vec<Vec<f64>> = (0..stages).map(|i| z.vector(i)[from..to].to_vec()).collect();
                Matrices::of_rows(&rows, to - from)
            };
            [part(0, n), part(n, joint)]
        };
        let mut excesses = |z: &Matrices, phi: &[f64]| {
            let [states, controls] = split(z);
            let at = Points { states: &states, controls: &controls, stages, has_end: false, times: Times::From(1) };
            let mut out = Matrices::vectors(stages, ends);
            limits.excesses(at, phi, &mut out, &mut scratch);
            out
        };
        // Derivatives by one coordinate of all points at once.
        let step = 1e-6;
        let shifted = |j: usize, by: f64| {
            let mut z = z.clone();
            (0..stages).for_each(|i| z.vector_mut(i)[j] += by);
            z
        };
        let difference = |ahead: &Matrices, back: &Matrices| {
            let pairs = ahead.as_slice().iter().zip(back.as_slice());
            pairs.map(|(ahead, back)| (ahead - back) / (2.0 * step)).collect::<Vec<f64>>()
        };
        let numeric: Vec<Vec<f64>> = (0..joint)
            .map(|j| difference(&excesses(&shifted(j, step), &phi), &excesses(&shifted(j, -step), &phi)))
            .collect();
        let mut scratch = Scratch::new();
        let mut jacobian = |z: &Matrices, phi: &[f64]| {
            let [states, controls] = split(z);
            let at = Points { states: &states, controls: &controls, stages, has_end: false, times: Times::From(1) };
            let mut out = Matrices::zeros(stages, ends, joint);
            limits.excess_jacobians(at, phi, &multipliers, &mut out, &mut scratch);
            out
        };
        let exact = jacobian(&z, &phi);
        let width = Matrices::vectors(1, ends).stride();
        for (i, j, end) in [9, 11].iter().flat_map(|&i| (0..joint).flat_map(move |j| (0..ends).map(move |e| (i, j, e))))
        {
            let (found, expected) = (exact.get(i, end, j), numeric[j][i * width + end]);
            assert!((found - expected).abs() < 1e-6 * (1.0 + expected.abs()), "{substeps} {i} {j}: {found} {expected}");
        }
        assert!((0..9).all(|i| exact.at(i).iter().all(|entry| *entry == 0.0)), "points without multipliers");
        // Second derivatives, by differences of the first ones, weighed by multipliers.
        let weighed = |jacobians: &Matrices, i: usize, a: usize| -> f64 {
            (0..ends).map(|end| multipliers.vector(i)[end] * jacobians.get(i, end, a)).sum()
        };
        let mut curvature = Matrices::zeros(stages, joint, joint + 1);
        let [states, controls] = split(&z);
        let at = Points { states: &states, controls: &controls, stages, has_end: false, times: Times::From(1) };
        limits.add_excess_curvature(at, &phi, &multipliers, &mut curvature, &mut Scratch::new());
        for j in 0..joint {
            let (ahead, back) = (jacobian(&shifted(j, step), &phi), jacobian(&shifted(j, -step), &phi));
            for (i, a) in [9, 11].iter().flat_map(|&i| (0..joint).map(move |a| (i, a))) {
                let expected = (weighed(&ahead, i, a) - weighed(&back, i, a)) / (2.0 * step);
                let found = curvature.get(i, a, j);
                assert!(
                    (found - expected).abs() < 1e-5 * (1.0 + expected.abs()),
                    "{substeps} {a} {j}: {found} {expected}"
                );
            }
        }
        // By the parameters, and along a variation of points and multipliers.
        let variation = rows(stages, joint, 0.2);
        let gradient = |z: &Matrices, multipliers: &Matrices, along: Option<ExcessVariation>| {
            let [states, controls] = split(z);
            let at = Points { states: &states, controls: &controls, stages, has_end: false, times: Times::From(1) };
            let mut out = vec![0.0; phi.len()];
            limits.add_excess_parameter_gradient(at, &phi, multipliers, along, &mut out, &mut Scratch::new());
            out
        };
        let total = |excesses: &Matrices| -> f64 {
            excesses.as_slice().iter().zip(multipliers.as_slice()).map(|(excess, mu)| excess * mu).sum()
        };
        let found = gradient(&z, &multipliers, None);
        for (index, found) in found.iter().enumerate() {
            let mut at = |by: f64| {
                let mut phi = phi.clone();
                phi[index] += by;
                total(&excesses(&z, &phi))
            };
            let expected = (at(1e-3) - at(-1e-3)) / 2e-3;
            assert!((found - expected).abs() < 1e-6 * (1.0 + expected.abs()), "{substeps}: {found} {expected}");
        }
        let along = |by: f64| {
            let add = |to: &Matrices, more: &Matrices| {
                let mut sum = to.clone();
                sum.as_mut_slice().iter_mut().zip(more.as_slice()).for_each(|(to, more)| *to += by * more);
                sum
            };
            gradient(&add(&z, &variation), &add(&multipliers, &moved), None)
        };
        let (ahead, back) = (along(1e-4), along(-1e-4));
        let moving = ExcessVariation { joint: &variation, multipliers: &moved };
        for (index, found) in gradient(&z, &multipliers, Some(moving)).iter().enumerate() {
            let expected = (ahead[index] - back[index]) / 2e-4;
            assert!((found - expected).abs() < 1e-5 * (1.0 + expected.abs()), "{substeps}: {found} {expected}");
        }
    }
}
