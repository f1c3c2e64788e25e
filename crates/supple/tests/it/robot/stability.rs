//! Time steps that are too large for the stiff parts of a model, told from systems that are unstable themselves.

use supple::{Error, EvaluateOptions, Stability};

use crate::common::shipped;
use crate::robot::arm::{Description, arm, compliance, cost, sensor};

/// A disc of 0.3 kg m^2 on a spring with the frequency `omega` and the damping ratio `zeta`.
fn spring(omega: f64, zeta: f64, time_step: f64) -> Description {
    let keys =
        format!("joint = \"turn\"\nstiffness = {:?}\ndamping = {:?}", 0.3 * omega * omega, 0.3 * 2.0 * zeta * omega);
    Description {
        model: "file = \"disc.urdf\"\nintegrator = \"semi_implicit\"\nactuated = [\"turn\"]\n".into(),
        sensors: sensor("joint_position", "select = [\"turn\"]\nvariance = 1.0"),
        start: String::new(),
        costs: cost("joint_position", "select = [\"turn\"]\nweight = 1.0") + &cost("control", "weight = 1.0"),
        time_step: format!("{time_step:?}"),
        ..arm()
    }
    .with(&compliance("spring", "stiff", &keys))
}

/// Of the plan, or of what stood in its way.
fn stability(description: &Description) -> Stability {
    match description.problem().evaluate(&[], &EvaluateOptions::default()) {
        Ok(at) => at.tasks[0].stability,
        Err(Error::TimeStep { stability, .. }) => stability,
        Err(error) => panic!("{error}"),
    }
}

const OMEGA: f64 = 200.0;

/// The longest stable time step (theory, equation R.6).
fn limit(zeta: f64) -> f64 {
    2.0 * ((1.0 + zeta * zeta).sqrt() - zeta) / OMEGA
}

#[test]
fn spring_is_flagged_just_above_its_limit_and_not_just_below() {
    for zeta in [0.0, 0.1, 0.5, 1.0, 3.0] {
        let limit = limit(zeta);
        let below = stability(&spring(OMEGA, zeta, 0.99 * limit));
        assert!(!below.numerically_unstable && below.suggested_time_step.is_none(), "{zeta}: {below:?}");
        assert!((below.spectral_radius - 1.0).abs() < 1e-6, "{zeta}: {below:?}");
        let above = stability(&spring(OMEGA, zeta, 1.01 * limit));
        assert!(above.numerically_unstable && above.spectral_radius > 1.01, "{zeta}: {above:?}");
    }
}

#[test]
fn suggestions_are_stable_and_not_much_shorter_than_needed() {
    for (zeta, factor) in [(0.0, 1.1), (0.3, 3.0), (2.0, 30.0), (0.0, 5e3), (1.0, 5e5)] {
        let limit = limit(zeta);
        let found = stability(&spring(OMEGA, zeta, factor * limit));
        let suggested = found.suggested_time_step.unwrap();
        assert!(suggested <= limit && suggested > 0.85 * limit, "{suggested} s with a limit of {limit} s");
        assert!(!stability(&spring(OMEGA, zeta, suggested)).numerically_unstable);
        let Some(substeps) = found.suggested_substeps else {
            assert!(factor > 800.0);
            continue;
        };
        let mut divided = spring(OMEGA, zeta, factor * limit);
        divided.model.insert_str(0, &format!("substeps = {substeps}\n"));
        let divided = stability(&divided);
        assert!(!divided.numerically_unstable, "{divided:?}");
    }
}

/// Where there are sub-steps already, more of them are suggested.
#[test]
fn substeps_multiply() {
    let mut description = spring(OMEGA, 0.1, 9.0 * limit(0.1));
    description.model.insert_str(0, "substeps = 3\n");
    let found = stability(&description);
    assert!(found.suggested_time_step.unwrap() > 2.5 * limit(0.1), "{found:?}");
    assert!((10..=12).contains(&found.suggested_substeps.unwrap()), "{found:?}");
}

/// An arm above its joints falls over, whatever the time step.
#[test]
fn unstable_physics_is_not_flagged() {
    for time_step in [1e-4, 1e-3, 0.02, 0.05] {
        let mut description = arm();
        description.time_step = format!("{time_step:?}");
        let found = stability(&description);
        assert!(!found.numerically_unstable, "{time_step} s: {found:?}");
        assert!(found.spectral_radius > 1.0 + time_step, "{time_step} s: {found:?}");
    }
}

/// A pendulum that swings from where it is stable to where it falls over, within one step: its growth over the step is not that of
/// the first instant, which is none. With few sub-steps, it is rough.
#[test]
fn physics_that_becomes_unstable_within_a_step_is_not_flagged() {
    for (substeps, speed) in [(4, 9.0), (8, 9.0), (32, 9.0), (8, 12.0)] {
        let mut description = Description {
            model: format!("file = \"arm.urdf\"\nsubsteps = {substeps}\nlocked = [\"elbow\"]\n"),
            sensors: sensor("joint_position", "variance = 1e-4"),
            start: format!("\"q.shoulder\" = -0.4\n\"v.shoulder\" = {speed:?}\n"),
            costs: cost("joint_velocity", "weight = 1.0") + &cost("control", "weight = 1.0"),
            time_step: "0.1".into(),
            ..arm()
        };
        description.steps = 3;
        let found = stability(&description);
        assert!(found.spectral_radius > 1.02, "{substeps}: {found:?}");
        assert!(!found.numerically_unstable, "{substeps}: {found:?}");
    }
}

#[test]
fn shipped_tasks_are_stable() {
    let names =
        ["elastic_elbow", "iiwa_door", "peg_on_wall", "soft_gripper", "two_mass", "two_mass_small", "wiping_arm"];
    for name in names {
        let problem = shipped(&format!("{name}.toml"));
        let at = problem.evaluate(&problem.parameters.initial(), &EvaluateOptions::default()).unwrap();
        for task in &at.tasks {
            assert!(!task.stability.numerically_unstable, "{name}: {:?}", task.stability);
        }
    }
}

#[test]
fn plan_that_cannot_be_computed_says_which_time_step_would_do() {
    let mut description = spring(OMEGA, 0.0, 0.03);
    description.steps = 400;
    description.start = "\"q.turn\" = 0.1\n".into();
    description.time_step += "\ninitial_control = [0.0]";
    let error = description.problem().evaluate(&[], &EvaluateOptions::default()).unwrap_err();
    let Error::TimeStep { stability, .. } = &error else { panic!("{error}") };
    assert_eq!((stability.step, stability.suggested_time_step), (0, Some(0.0094)));
    assert_eq!(
        error.to_string(),
        "task `task`: the cost of the first guess is not finite: time_step = 0.03 s is too large for the \
         stiff parts of the model: the spectral radius of A is 33.971 at step 0; use at most 0.0094 s, or substeps = 4"
    );
}

/// A plan that fails for another reason is not blamed on the time step.
#[test]
fn other_failures_keep_their_message() {
    let mut description = spring(OMEGA, 0.1, 1e-3);
    description.start = "\"q.turn\" = 1e200\n".into();
    let error = description.problem().evaluate(&[], &EvaluateOptions::default()).unwrap_err();
    assert_eq!(error.to_string(), "task `task`: the cost of the first guess is not finite");
}
