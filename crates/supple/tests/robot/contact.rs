//! Contacts with a wall: what they push, and what they do not.

use supple::Problem;

use crate::arm::{Description, accelerations, arm, compliance, cost, observe, sensor, stage_cost, step};
use crate::assert_close;

const STIFFNESS: f64 = 1000.0;
const SMOOTHING: f64 = 0.001;
const DAMPING: f64 = 20.0;
const FRICTION: f64 = 0.5;
const SLIP: f64 = 0.05;

/// A disc that slides along x and y and turns about z, in the positive half-space of a wall at y = 0.2.
fn disc(radius: f64, more: &str) -> Description {
    let keys = format!(
        "frame = \"disc\"\nnormal = [0.0, 2.0, 0.0]\npoint = [5.0, 0.2, -3.0]\nradius = {radius:?}\n\
         stiffness = {STIFFNESS:?}\nsmoothing = {SMOOTHING:?}\n{more}"
    );
    Description {
        model: "file = \"disc.urdf\"\n".into(),
        sensors: sensor("coupling_force", "coupling = \"wall\"\nvariance = 1.0"),
        start: String::new(),
        costs: cost("penetration", "contact = \"wall\"\nweight = 1.0"),
        time_step: "1.0".into(),
        ..arm()
    }
    .with(&compliance("contact", "wall", &keys))
}

fn rough(radius: f64) -> Problem {
    disc(radius, &format!("damping = {DAMPING:?}\nfriction = {FRICTION:?}\nslip = {SLIP:?}\n")).problem()
}

/// `[x, y, turn]`, velocities, and how far the wall is out of its place.
fn state(y: f64, velocity: [f64; 3], wall: f64) -> Vec<f64> {
    [vec![0.7, y, 0.4], velocity.to_vec(), vec![wall]].concat()
}

/// The smooth positive part.
fn positive(value: f64, smoothing: f64) -> f64 {
    0.5 * ((value * value + smoothing * smoothing).sqrt() + value)
}

/// Normal force and the one along x, by the formulas of the documentation: the rim, at `(0, -radius)` from the centre,
/// moves by `vx + radius turn` along the wall.
fn forces(radius: f64, depth: f64, [vx, vy, turn]: [f64; 3]) -> (f64, f64) {
    let rim = vx + radius * turn;
    let slope = 0.5 * (1.0 + depth / (depth * depth + SMOOTHING * SMOOTHING).sqrt());
    let raw = STIFFNESS * positive(depth, SMOOTHING) - DAMPING * vy * slope;
    let force = positive(raw, STIFFNESS * SMOOTHING);
    (force, -FRICTION * force * rim / (rim * rim + SLIP * SLIP).sqrt())
}

#[test]
fn forces_and_depth_are_those_of_the_formulas() {
    let problem = rough(0.1);
    for (y, velocity, wall) in
        [(0.29, [0.3, 0.1, 2.0], 0.0), (0.297, [-0.02, -0.4, 1.0], 0.004), (0.305, [0.0, -0.2, 0.0], -0.001)]
    {
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

#[test]
fn far_from_the_wall_there_is_next_to_nothing() {
    let problem = disc(0.1, "").problem();
    let force = |y: f64| observe(&problem, &state(y, [1.0, -1.0, 3.0], 0.0), &[])[0];
    // A quarter of stiffness smoothing^2 over the distance.
    assert!((force(1.3) - 0.25 * STIFFNESS * SMOOTHING * SMOOTHING).abs() < 1e-8);
    assert!(force(100.3) < 1e-5);
    // Deep inside it is the spring alone.
    assert!((force(0.1) - STIFFNESS * 0.2).abs() < 1e-2);
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

/// Dropped on the wall, the disc comes to rest where the spring carries it.
#[test]
fn a_disc_comes_to_rest_on_the_wall() {
    let mut description = disc(0.1, "damping = 20.0\n").with("");
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
