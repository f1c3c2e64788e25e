//! Elastic joints: their limit of a stiff spring, their energy, and sensors on both sides.

use supple::Problem;

use crate::robot::arm::{Description, accelerations, arm, compliance, observe, sensor, step, steps};
use crate::robot::assert_close;

/// The arm with a motor of inertia 0.08 kg m^2 behind a spring in its shoulder.
fn elastic(stiffness: f64, damping: f64) -> Description {
    let keys = format!("joint = \"shoulder\"\nstiffness = {stiffness:?}\ndamping = {damping:?}\nmotor_inertia = 0.08");
    arm().with(&compliance("elastic_joint", "flexible", &keys))
}

fn with_time_step(mut description: Description, time_step: f64) -> Problem {
    description.time_step = format!("{time_step:?}");
    description.problem()
}

const Q: [f64; 3] = [0.3, -0.4, 0.1];
const V: [f64; 3] = [0.5, -0.3, 0.2];
const U: [f64; 3] = [3.0, -1.0, 4.0];

/// `[q, s, q', s']` with the motor where the joint is.
fn together() -> Vec<f64> {
    [&Q[..], &[Q[0]], &V, &[V[0]]].concat()
}

/// As the spring gets stiffer, link and motor move as one joint with the motor's inertia, ten times closer for ten
/// times the stiffness.
#[test]
fn stiff_elastic_joint_is_a_rigid_one_with_the_motors_inertia() {
    let (dt, count) = (2e-5, 1000);
    let rigid = with_time_step(arm().with("[model.joints.shoulder]\narmature = 0.08\n"), dt);
    let expected = steps(&rigid, &[Q, V].concat(), &U, &[], count);
    let errors = [1e3, 1e4, 1e5].map(|stiffness: f64| {
        // Damped such that the spring comes to rest soon.
        let problem = with_time_step(elastic(stiffness, 0.5 * stiffness.sqrt()), dt);
        let x = steps(&problem, &together(), &U, &[], count);
        let error = (0..3).map(|i| (x[i] - expected[i]).abs()).fold(0.0, f64::max);
        assert!((x[3] - x[0]).abs() < 20.0 / stiffness, "the spring is stretched by {}", x[3] - x[0]);
        error
    });
    assert!(errors[1] < 0.2 * errors[0] && errors[2] < 0.2 * errors[1] && errors[2] < 1e-4, "{errors:?}");
}

/// One arm on one elastic joint, about a vertical axis through its centre of mass: a mass on a spring.
fn rotor(stiffness: f64, damping: f64) -> Description {
    let keys = format!(
        "joint = \"turn\"\nstiffness = {stiffness:?}\ndamping = {damping:?}\nmotor_inertia = 0.1\nmotor_damping = 0.0"
    );
    Description {
        model: "file = \"disc.urdf\"\nintegrator = \"semi_implicit\"\nactuated = [\"turn\"]\n".into(),
        sensors: sensor("joint_torque", "select = [\"turn\"]\nvariance = 1.0"),
        start: String::new(),
        costs: crate::robot::arm::cost("control", "weight = 1.0"),
        time_step: "1e-4".into(),
        ..arm()
    }
    .with(&compliance("elastic_joint", "flexible", &keys))
}

/// `[x, y, turn, motor]` and their velocities, of which only the last two of each move.
fn turned(turn: f64, motor: f64, turn_rate: f64, motor_rate: f64) -> Vec<f64> {
    vec![0.0, 0.0, turn, motor, 0.0, 0.0, turn_rate, motor_rate]
}

#[test]
fn energy_goes_back_and_forth_between_link_motor_and_spring() {
    let (stiffness, inertia, motor) = (40.0, 0.3, 0.1);
    let problem = rotor(stiffness, 0.0).problem();
    let energy =
        |x: &[f64]| 0.5 * inertia * x[6] * x[6] + 0.5 * motor * x[7] * x[7] + 0.5 * stiffness * (x[3] - x[2]).powi(2);
    let mut x = turned(0.1, -0.05, 0.3, 0.0);
    // The springs of the disc's slides carry nothing: gravity does not act along them.
    let before = energy(&x);
    let mut share = [f64::INFINITY, 0.0_f64];
    for _ in 0..20_000 {
        x = step(&problem, &x, &[0.0], &[]);
        let now = energy(&x);
        assert!((now - before).abs() < 2e-3 * before, "energy {now} instead of {before}");
        let spring = 0.5 * stiffness * (x[3] - x[2]).powi(2) / now;
        share = [share[0].min(spring), share[1].max(spring)];
    }
    assert!(share[0] < 0.01 && share[1] > 0.5, "the spring's share of the energy goes from {share:?}");
    assert!((x[6] * inertia + x[7] * motor - 0.3 * inertia).abs() < 1e-12, "momentum stays");
}

#[test]
fn drive_acts_on_the_motor_and_the_spring_on_both() {
    let mut description = rotor(40.0, 2.0);
    description.time_step = "1.0".into();
    let problem = description.problem();
    let torque = 40.0 * (0.2 - 0.1) + 2.0 * (-0.3 - 0.5);
    let found = accelerations(&problem, &turned(0.1, 0.2, 0.5, -0.3), &[1.7], &[], 4);
    assert_close("accelerations", &found, &[0.0, 0.0, torque / 0.3, (1.7 - torque) / 0.1], 1e-13);
}

#[test]
fn motor_damping_gear_and_rotor_are_on_the_motors_side() {
    let mut description = rotor(40.0, 0.0);
    description.model = description.model.replace("motor_damping = 0.0", "motor_damping = 0.5");
    description.time_step = "1.0".into();
    let problem = description.with("[model.drives.turn]\ngear = 3.0\nrotor_inertia = 0.02\n").problem();
    let torque = 40.0 * (0.2 - 0.1);
    let found = accelerations(&problem, &turned(0.1, 0.2, 0.5, -0.3), &[1.7], &[], 4);
    let motor = (3.0 * 1.7 - torque + 0.5 * 0.3) / (0.1 + 9.0 * 0.02);
    assert_close("accelerations", &found, &[0.0, 0.0, torque / 0.3, motor], 1e-13);
}

#[test]
fn sensors_see_the_spring_and_both_sides() {
    let sensors = sensor("joint_torque", "select = [\"shoulder\"]\nvariance = 1.0")
        + &sensor("joint_position", "select = [\"shoulder\", \"slide\"]\nvariance = 1.0")
        + &sensor("joint_position", "select = [\"shoulder\"]\nside = \"motor\"\nvariance = 1.0")
        + &sensor("joint_velocity", "select = [\"shoulder\"]\nside = \"link\"\nvariance = 1.0")
        + &sensor("joint_velocity", "select = [\"shoulder\"]\nside = \"motor\"\nvariance = 1.0")
        + &sensor("coupling_force", "coupling = \"flexible\"\nvariance = 1.0");
    let problem = elastic(50.0, 2.0).sensing(&sensors).problem();
    assert_eq!(
        problem.tasks[0].system.state_names(),
        ["q.shoulder", "q.elbow", "q.slide", "q.flexible", "v.shoulder", "v.elbow", "v.slide", "v.flexible"]
    );
    let x = [0.3, -0.4, 0.1, 0.35, 0.5, -0.3, 0.2, -0.2];
    let torque = 50.0 * (0.35 - 0.3) + 2.0 * (-0.2 - 0.5);
    let expected = [torque, 0.3, 0.1, 0.35, 0.5, -0.2, torque];
    assert_close("measurement", &observe(&problem, &x, &[]), &expected, 1e-14);
}

/// Without a spring, and with a motor that stands still, the link moves as if there was no drive.
#[test]
fn link_and_motor_without_a_spring_do_not_feel_each_other() {
    let free = with_time_step(elastic(0.0, 0.0), 1.0);
    let rigid = with_time_step(arm(), 1.0);
    let x = together();
    let undriven = accelerations(&rigid, &[Q, V].concat(), &[0.0, U[1], U[2]], &[], 3);
    let found = accelerations(&free, &x, &U, &[], 4);
    assert_close("link", &found[..3], &undriven, 1e-12);
    assert_close("motor", &found[3..], &[U[0] / 0.08], 1e-13);
}
