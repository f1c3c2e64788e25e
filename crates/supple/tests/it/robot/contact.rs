//! Contacts with a wall: what they push, and what they do not.

use supple::Problem;

use crate::robot::arm::{Description, accelerations, arm, compliance, cost, observe, sensor, stage_cost, step};
use crate::robot::assert_close;

const STIFFNESS: f64 = 1000.0;
const SMOOTHING: f64 = 0.001;
const DISSIPATION: f64 = 0.8;
const FRICTION: f64 = 0.5;
const SLIP: f64 = 0.05;

/// A disc that slides along x and y and turns about z, in the positive half-space of a wall at y = 0.2.
fn disc(radius: f64, more: &str) -> Description {
    let keys = format!(
        "frame = \"disc\"\nnormal = [0.0, 2.0, 0.0]\npoint = [5.0, 0.2, -3.0]\nradius = {radius:?}\n\
         stiffness = {STIFFNESS:?}\nsmoothing = {SMOOTHING:?}\n{more}"
    );
    Description {
        model: "file = \"disc.urdf\"\nintegrator = \"semi_implicit\"\n".into(),
        sensors: sensor("coupling_force", "coupling = \"wall\"\nvariance = 1.0"),
        start: String::new(),
        costs: cost("penetration", "contact = \"wall\"\nweight = 1.0"),
        time_step: "1.0".into(),
        ..arm()
    }
    .with(&compliance("contact", "wall", &keys))
}

fn rough(radius: f64) -> Problem {
    disc(radius, &format!("dissipation = {DISSIPATION:?}\nfriction = {FRICTION:?}\nslip = {SLIP:?}\n")).problem()
}

/// `[x, y, turn]`, velocities, and how far the wall is out of its place.
fn state(y: f64, velocity: [f64; 3], wall: f64) -> Vec<f64> {
    [vec![0.7, y, 0.4], velocity.to_vec(), vec![wall]].concat()
}

/// The positive part, rounded off over `smoothing`: the integral twice of the bump `15/16 (1 - s^2)^2`, by Simpson's rule.
fn positive(value: f64, smoothing: f64) -> f64 {
    let end = (value / smoothing).min(1.0);
    if end <= -1.0 {
        return 0.0;
    }
    let count = 2000;
    let width = (end + 1.0) / f64::from(count);
    let bump = |s: f64| 15.0 / 16.0 * (1.0 - s * s).powi(2) * (end - s);
    let weight = |i: u32| if i == 0 || i == count { 1.0 } else { f64::from(2 + 2 * (i % 2)) };
    let sum: f64 = (0..=count).map(|i| weight(i) * bump(f64::from(i).mul_add(width, -1.0))).sum();
    smoothing * sum * width / 3.0 + (value - smoothing).max(0.0)
}

/// Normal force and the one along x, by the formulas of the documentation: the rim, at `(0, -radius)` from the centre,
/// moves by `vx + radius turn` along the wall.
fn forces(radius: f64, depth: f64, [vx, vy, turn]: [f64; 3]) -> (f64, f64) {
    let rim = vx + radius * turn;
    let force = STIFFNESS * positive(depth, SMOOTHING) * positive(1.0 - DISSIPATION * vy, 0.5);
    (force, -FRICTION * force * rim / (rim * rim + SLIP * SLIP).sqrt())
}

#[test]
fn forces_and_depth_are_those_of_the_formulas() {
    let problem = rough(0.1);
    for (y, velocity, wall) in [
        (0.29, [0.3, 0.1, 2.0], 0.0),
        (0.297, [-0.02, -0.4, 1.0], 0.004),
        (0.3003, [0.0, -0.2, 0.0], 0.0),
        (0.3, [0.1, 1.1, 0.0], 4e-4),
        (0.29, [0.1, 2.0, 0.0], 0.0),
    ] {
        let x = state(y, velocity, wall);
        let depth = wall - (y - 0.2) + 0.1;
        let (normal, along) = forces(0.1, depth, velocity);
        assert_close("forces", &observe(&problem, &x, &[]), &[normal, along, normal, 0.0], 1e-12);
        assert_close("depth squared", &[stage_cost(&problem, &x, &[0.0; 3], &[])], &[depth * depth], 1e-12);
    }
}

/// A disc that rolls along the wall feels no friction, and one that turns in its place is driven along it.
#[test]
fn friction_is_that_of_the_point_that_touches() {
    let problem = rough(0.1);
    let along = |velocity| observe(&problem, &state(0.29, velocity, 0.0), &[])[1];
    assert!(along([0.2, 0.0, -2.0]).abs() < 1e-12);
    assert!(along([0.0, 0.0, 2.0]) < -1.0);
    assert_eq!(along([0.0, 0.0, 2.0]), along([0.2, 0.0, 0.0]));
}

/// Friction acts at the rim, and turns the disc; the normal force passes through its centre. All of it is divided by
/// what it moves: 2 kg along x, 1.5 kg along y, 0.3 kg m^2 about z.
#[test]
fn forces_act_where_the_sphere_touches() {
    for radius in [0.0, 0.1, 0.5] {
        let problem = rough(radius);
        let velocity = [0.3, -0.1, 2.0];
        let x = state(0.2 + radius - 0.004, velocity, 0.0);
        let (normal, along) = forces(radius, 0.004, velocity);
        let expected = [along / 2.0, normal / 1.5, radius * along / 0.3];
        assert_close("accelerations", &accelerations(&problem, &x, &[0.0; 3], &[], 3), &expected, 1e-11);
    }
}

#[test]
fn walls_never_pull_and_friction_opposes_motion_within_its_cone() {
    let problem = rough(0.1);
    for depth in [-1.0, -0.01, -1e-3, 0.0, 1e-3, 0.02] {
        for vy in [-30.0, -1.0, 0.0, 1.0, 30.0] {
            for vx in [-2.0, -0.01, 0.0, 0.01, 2.0] {
                // The rim moves by vx: the centre and the turn of 4 rad/s make it up.
                let y = observe(&problem, &state(0.3 - depth, [vx - 0.4, vy, 4.0], 0.0), &[]);
                let [normal, along] = [y[0], y[1]];
                assert!(normal >= 0.0, "depth {depth}, approach {vy}: {normal}");
                assert!(along * vx <= 0.0 && (vx != 0.0 || along.abs() < 1e-9), "{along} along a motion of {vx}");
                assert!(along.abs() <= FRICTION * normal + 1e-12);
            }
        }
    }
}

/// Beyond one smoothing of clearance there is nothing at all, at any speed; from one smoothing of depth the spring alone.
#[test]
fn apart_there_is_nothing() {
    let problem = rough(0.1);
    for vy in [-1e3, -1.0, 0.0, 1.0, 1e3] {
        for clearance in [1.0 + 1e-9, 1.5, 1e3, 1e6].map(|count| count * SMOOTHING) {
            let y = observe(&problem, &state(0.3 + clearance, [1.0, vy, 3.0], 0.0), &[]);
            assert!(y.iter().all(|&force| force == 0.0), "{clearance} m, {vy} m/s: {y:?}");
        }
    }
    let deep = observe(&problem, &state(0.3 - SMOOTHING, [0.0; 3], 0.0), &[])[0];
    assert!((deep - STIFFNESS * SMOOTHING).abs() < 1e-12 * STIFFNESS);
}

/// A wall `c` further along its normal is a disc `c` deeper; the wall stays where it is.
#[test]
fn place_of_the_wall_is_a_state_that_stays() {
    let problem = rough(0.1);
    assert_eq!(problem.tasks[0].system.state_names().last().unwrap(), "c.wall");
    let velocity = [0.3, -0.1, 2.0];
    let [moved, deeper] = [state(0.3, velocity, 0.01), state(0.29, velocity, 0.0)];
    assert_close("forces", &observe(&problem, &moved, &[]), &observe(&problem, &deeper, &[]), 1e-12);
    assert_eq!(step(&problem, &moved, &[1.0, 2.0, 3.0], &[])[6], 0.01);
}

/// Contacts of earlier versions had a damping, which pushed at a distance.
#[test]
fn the_damping_of_earlier_contacts_is_told_what_takes_its_place() {
    let error =
        supple_file::parse(&disc(0.1, "damping = 5.0\n").text(), "tests/data/task.toml").err().unwrap().to_string();
    assert!(error.contains("unknown key `damping`"), "{error}");
    assert!(error.contains("(`dissipation`, s/m, takes its place"), "{error}");
}

/// Dropped on the wall, the disc comes to rest where the spring carries it.
#[test]
fn a_disc_comes_to_rest_on_the_wall() {
    let mut description = disc(0.1, "dissipation = 2.0\n").with("");
    description.model.insert_str(0, "gravity = [0.0, -9.81, 0.0]\n");
    description.time_step = "1e-3".into();
    let problem = description.problem();
    let mut x = state(0.32, [0.0; 3], 0.0);
    for _ in 0..5000 {
        x = step(&problem, &x, &[0.0; 3], &[]);
    }
    let weight = 1.5 * 9.81;
    assert!((observe(&problem, &x, &[])[0] - weight).abs() < 1e-6 * weight);
    assert!(x[4].abs() < 1e-9 && (x[1] - (0.3 - weight / STIFFNESS)).abs() < 1e-3);
}
