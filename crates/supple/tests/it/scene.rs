//! Scenes show what the numbers say.

use crate::common::{repository, shipped};
use supple::scene::{Body, Connection, MOST_FRAMES, Pose, Scene, Solid, Track, quaternion, turned_to};
use supple::{EvaluateOptions, Problem, TaskEvaluation, TrajectoryReport};
use supple_robot::vector::{add, dot, scale, sub};
use supple_robot::{JointKind, Kinematics, LoadOptions, Numbers, Tree, frame_jacobian};

const TASKS: [&str; 7] = [
    "two_mass.toml",
    "two_mass_small.toml",
    "elastic_elbow.toml",
    "iiwa_door.toml",
    "peg_on_wall.toml",
    "soft_gripper.toml",
    "wiping_arm.toml",
];

fn evaluated(problem: &Problem) -> Vec<TaskEvaluation> {
    let options = EvaluateOptions { trajectories: true, ..EvaluateOptions::default() };
    problem.evaluate(&problem.parameters.initial(), &options).unwrap().tasks
}

fn film(file: &str) -> (Problem, TrajectoryReport, Scene) {
    let problem = shipped(file);
    let trajectory = evaluated(&problem).remove(0).trajectory.unwrap();
    let scene = trajectory.scene.clone().unwrap();
    (problem, trajectory, scene)
}

/// The step of the plan that a frame shows.
fn step(trajectory: &TrajectoryReport, scene: &Scene, frame: usize) -> usize {
    let time = scene.time.at(frame).unwrap()[0];
    trajectory.time.iter().position(|other| (other - time).abs() < 1e-6).unwrap()
}

fn close(found: &[f64], expected: &[f64], tolerance: f64) {
    assert_eq!(found.len(), expected.len());
    for (a, b) in found.iter().zip(expected) {
        assert!((a - b).abs() <= tolerance, "{found:?} in place of {expected:?}");
    }
}

/// The matrix of a quaternion, column by column turned.
fn turned([w, x, y, z]: [f64; 4], v: [f64; 3]) -> [f64; 3] {
    Pose::from_quaternion([0.0; 3], [w, x, y, z]).unwrap().rotate(v)
}

fn connection<'a>(scene: &'a Scene, name: &str) -> &'a Connection {
    scene.connections.iter().find(|connection| connection.name == name).unwrap()
}

/// The signal of a task's system by name is not public; what is drawn is compared with forces worked out here.
fn value(problem: &Problem, name: &str) -> f64 {
    problem.parameters.initial()[problem.parameters.iter().position(|p| p.name == name).unwrap()]
}

#[test]
fn every_shipped_task_can_be_seen() {
    for file in TASKS {
        let problem = shipped(file);
        for task in evaluated(&problem) {
            let trajectory = task.trajectory.unwrap();
            let scene = trajectory.scene.unwrap();
            let frames = scene.time.0.len();
            assert!((2..=MOST_FRAMES).contains(&frames), "{file}: {frames} frames");
            assert_eq!(scene.time.at(frames - 1).unwrap()[0], *trajectory.time.last().unwrap(), "{file}");
            assert!(scene.size > 0.0 && scene.size < 3.0, "{file}: size {}", scene.size);
            assert!(scene.bodies.iter().any(|body| !body.position.is_fixed()), "{file}: nothing moves");
            assert!(scene.bodies.iter().any(|body| !body.shapes.is_empty()), "{file}: nothing to see");
            assert!(!scene.connections.is_empty() && !scene.beliefs.is_empty(), "{file}");
            let text = serde_json::to_string(&scene).unwrap();
            assert!(!text.contains("null"), "{file}: a number is not finite");
            assert!(text.len() < 150_000, "{file}: {} bytes", text.len());
            for track in scene.bodies.iter().map(|body| &body.position) {
                assert!([1, frames].contains(&track.0.len()), "{file}: {} rows", track.0.len());
            }
            let read: Scene = serde_json::from_str(&text).unwrap();
            assert_eq!(read, scene, "{file}");
        }
    }
}

#[test]
fn scenes_stay_on_few_lines_of_indented_files() {
    let (_, _, scene) = film("iiwa_door.toml");
    let text = serde_json::to_string_pretty(&scene).unwrap();
    assert!(text.len() < 250_000, "{} bytes", text.len());
    assert!(text.lines().count() < 2500, "{} lines", text.lines().count());
}

#[test]
fn linear_models_have_no_scene() {
    let linear = "[model]\nkind = \"linear\"\nA = [[1.0]]\nB = [[1.0]]\nC = [[1.0]]\n\n[[tasks]]\nname = \"hold\"\n\
                  steps = 3\ntime_step = 0.1\ninitial_state = [1.0]\n\n[tasks.noise]\ninitial = [1.0]\nprocess = [1.0]\n\
                  measurement = [1.0]\n\n[[tasks.costs]]\nkind = \"state\"\nselect = [\"x1\"]\nweight = 1.0\n\n[[tasks.costs]]\n\
                  kind = \"control\"\nweight = 1.0\n";
    let problem = supple_file::parse(linear, "linear.toml").unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(evaluated(&problem)[0].trajectory.as_ref().unwrap().scene, None);
}

#[test]
fn two_masses_are_where_they_should_be() {
    let (problem, trajectory, scene) = film("two_mass.toml");
    let [k1, k2] = ["k1", "k2"].map(|name| value(&problem, name));
    let [first, second] = [0, 1].map(|body: usize| &scene.bodies[body].position);
    let apart = second.at(0).unwrap()[0] - first.at(0).unwrap()[0];
    for frame in 0..scene.time.0.len() {
        let x = &trajectory.states[step(&trajectory, &scene, frame)];
        close(second.at(frame).unwrap(), &[x[2], 0.0, 0.0], 1e-6);
        close(first.at(frame).unwrap(), &[x[0] - apart, 0.0, 0.0], 1e-6);
        close(connection(&scene, "spring").force.at(frame).unwrap(), &[k1 * (x[0] - x[2]), 0.0, 0.0], 1e-4);
        let depth = x[2] - x[4];
        let pressed = 0.5 * (depth.hypot(0.01) + depth);
        close(connection(&scene, "wall").force.at(frame).unwrap(), &[-k2 * pressed, 0.0, 0.0], 1e-4);
        // Sigma of x2 and of xw: the second mass and the wall are on the line.
        let t = step(&trajectory, &scene, frame);
        let variance = trajectory.deviations[t][2].powi(2);
        close(scene.beliefs[0].covariance.at(frame).unwrap(), &[variance, 0.0, 0.0, 0.0, 0.0, 0.0], 1e-6 * 1e-3);
        close(scene.walls[0].deviation.at(frame).unwrap(), &[trajectory.deviations[t][4]], 1e-7);
        close(scene.walls[0].position.at(frame).unwrap(), &[0.75, 0.0, 0.0], 1e-9);
    }
    close(&turned(scene.walls[0].rotation, [0.0, 0.0, 1.0]), &[-1.0, 0.0, 0.0], 1e-6);
}

/// The door's arm by forward kinematics of the robot's file.
#[test]
fn links_are_where_kinematics_puts_them() {
    let (_, trajectory, scene) = film("iiwa_door.toml");
    let robot = supple_robot::load(repository("models/iiwa14_door.urdf"), &LoadOptions::default()).unwrap();
    let (tree, numbers) = (Tree::new(&robot), Numbers::of(&robot, [0.0; 3]));
    assert_eq!(scene.bodies.len(), robot.links.len());
    for frame in (0..scene.time.0.len()).step_by(10) {
        let x = &trajectory.states[step(&trajectory, &scene, frame)];
        let now = Kinematics::of(&tree, &numbers, &x[..8], &x[8..16]);
        for (body, pose) in scene.bodies.iter().zip(now.poses()) {
            close(body.position.at(frame).unwrap(), &pose.position, 1e-6);
            for axis in 0..3 {
                let mut unit = [0.0; 3];
                unit[axis] = 1.0;
                close(&turned(*body.rotation.at(frame).unwrap(), unit), &pose.rotate(unit), 3e-6);
            }
        }
        // The bushing pulls the handle to the hand at rest: K p, by the half-way frame, which is that of both here.
        let bushing = connection(&scene, "gripper");
        close(bushing.from.at(frame).unwrap(), &now.poses()[robot.link("iiwa_link_7").unwrap()].position, 1e-6);
        close(bushing.to.at(frame).unwrap(), &now.poses()[robot.link("handle").unwrap()].position, 1e-6);
    }
}

/// Both ends of each line of a body at a frame, in the world, with its radius.
fn lines(body: &Body, frame: usize) -> Vec<([[f64; 3]; 2], f64)> {
    let (at, rotation) = (*body.position.at(frame).unwrap(), *body.rotation.at(frame).unwrap());
    let line = |shape: &supple::scene::Shape| {
        let Solid::Capsule { radius, length } = shape.solid else { return None };
        let half = turned(shape.rotation, [0.0, 0.0, 0.5 * length]);
        let ends = [-1.0, 1.0].map(|side| add(at, turned(rotation, add(shape.position, scale(side, half)))));
        Some((ends, radius))
    };
    body.shapes.iter().filter_map(line).collect()
}

#[test]
fn robots_without_meshes_are_lines_between_their_joints() {
    for (file, robot) in [
        ("iiwa_door.toml", "iiwa14_door.urdf"),
        ("wiping_arm.toml", "wiping_arm.sdf"),
        ("soft_gripper.toml", "soft_gripper.xml"),
        ("peg_on_wall.toml", "peg_on_wall.urdf"),
    ] {
        let (_, _, scene) = film(file);
        let robot = supple_robot::load(repository(&format!("models/{robot}")), &LoadOptions::default()).unwrap();
        let far = |a: [f64; 3], b: [f64; 3]| dot(sub(a, b), sub(a, b)).sqrt();
        let body = |name: &str| scene.bodies.iter().find(|body| body.name == name).unwrap();
        let mut joined = 0;
        for (joint, child) in robot.joints.iter().zip(&robot.links[1..]) {
            let (parent, child) = (body(&robot.links[joint.parent].name), body(&child.name));
            let marks = child.shapes.iter().filter(|shape| !matches!(shape.solid, Solid::Capsule { .. })).count();
            assert!(joint.kind == JointKind::Fixed || marks == 1, "{file}: {} has {marks} marks", joint.name);
            for frame in 0..scene.time.0.len() {
                let place = add(
                    *child.position.at(frame).unwrap(),
                    turned(*child.rotation.at(frame).unwrap(), joint.child_pose.inverse().position),
                );
                let ends: Vec<([[f64; 3]; 2], f64)> = lines(parent, frame);
                assert!(ends.iter().all(|(_, radius)| *radius < 0.01 * scene.size), "{file}: a thick line");
                // A joint is on a line of its parent: at its end, or on the rail that it slides along; or where that begins.
                let on =
                    |[from, to]: [[f64; 3]; 2]| far(from, place) + far(place, to) - far(from, to) < 1e-5 * scene.size;
                let own = *parent.position.at(frame).unwrap();
                joined += usize::from(ends.iter().any(|(ends, _)| on(*ends)));
                assert!(
                    ends.iter().any(|(ends, _)| on(*ends)) || far(own, place) < 0.03 * scene.size,
                    "{file}: {} hangs in the air",
                    joint.name
                );
            }
        }
        assert!(joined > scene.time.0.len(), "{file}: {joined}");
        // Every last link that moves reaches somewhere or is a joint.
        assert!(scene.bodies.iter().all(|body| !body.shapes.is_empty()), "{file}");
    }
}

/// Rails show where something can slide, be it far from where it does: views may cut them off.
#[test]
fn rails_are_guides_and_nothing_else_is() {
    for (file, rails) in [("soft_gripper.toml", 4), ("peg_on_wall.toml", 4), ("iiwa_door.toml", 0)] {
        let (_, _, scene) = film(file);
        let shapes = || scene.bodies.iter().flat_map(|body| &body.shapes);
        assert_eq!(shapes().filter(|shape| shape.guide).count(), rails, "{file}");
        assert!(shapes().all(|shape| !shape.guide || matches!(shape.solid, Solid::Capsule { .. })), "{file}");
        assert!(shapes().any(|shape| !shape.guide), "{file}");
    }
}

/// `J Sigma J'` by the Jacobian of rigid-body kinematics. The covariance of the state is known by its diagonal only; at
/// the start it is diagonal but for what the first measurement adds, which is little.
#[test]
fn beliefs_follow_from_the_jacobian() {
    let (_, trajectory, scene) = film("iiwa_door.toml");
    let robot = supple_robot::load(repository("models/iiwa14_door.urdf"), &LoadOptions::default()).unwrap();
    let (tree, numbers) = (Tree::new(&robot), Numbers::of(&robot, [0.0; 3]));
    let now = Kinematics::at_rest(&tree, &numbers, &trajectory.states[0][..8]);
    for name in ["iiwa_link_7", "handle"] {
        let belief = scene.beliefs.iter().find(|belief| belief.name == name).unwrap();
        let jacobian = frame_jacobian(&tree, &now, robot.link(name).unwrap(), [0.0; 3]);
        let entry = |a: usize, b: usize| -> f64 {
            (0..8).map(|i| jacobian[3 + a][i] * trajectory.deviations[0][i].powi(2) * jacobian[3 + b][i]).sum()
        };
        let expected = [entry(0, 0), entry(0, 1), entry(0, 2), entry(1, 1), entry(1, 2), entry(2, 2)];
        // Tracks have seven digits of their largest number.
        let largest = |numbers: &[f64]| numbers.iter().fold(0.0_f64, |most, entry| most.max(entry.abs()));
        let digit = 1e-6 * largest(belief.covariance.0.as_flattened());
        close(belief.covariance.at(0).unwrap(), &expected, digit);
        assert!(largest(&expected) > 100.0 * digit, "{name}: too little to compare");
    }
}

#[test]
fn torques_of_springs_beside_joints_are_about_the_axis() {
    let (problem, trajectory, scene) = film("wiping_arm.toml");
    let [k, d, rest] = ["k", "d", "rest"].map(|name| value(&problem, name));
    let spring = connection(&scene, "wrist_spring");
    for frame in 0..scene.time.0.len() {
        let x = &trajectory.states[step(&trajectory, &scene, frame)];
        let torque = -(k * (x[2] - rest) + d * x[5]);
        close(spring.torque.at(frame).unwrap(), &[0.0, 0.0, torque], 1e-5);
        close(spring.force.at(frame).unwrap(), &[0.0; 3], 0.0);
    }
}

#[test]
fn springs_of_slides_push_along_them() {
    let (problem, trajectory, scene) = film("soft_gripper.toml");
    let [k, d] = ["k", "d"].map(|name| value(&problem, name));
    let place = |name: &str| trajectory.state_names.iter().position(|other| other == name).unwrap();
    let [q, v] = ["q.right_push", "v.right_push"].map(place);
    for frame in 0..scene.time.0.len() {
        let x = &trajectory.states[step(&trajectory, &scene, frame)];
        let pushed = -(k * x[q] + d * x[v]);
        // The pad of the right finger slides along -y.
        close(connection(&scene, "right_spring").force.at(frame).unwrap(), &[0.0, -pushed, 0.0], 1e-5);
    }
}

#[test]
fn contacts_press_out_of_the_wall_by_stiffness_times_depth() {
    let (_, trajectory, scene) = film("soft_gripper.toml");
    let last = scene.time.0.len() - 1;
    for (name, normal) in [("left_side", [0.0, -1.0, 0.0]), ("right_side", [0.0, 1.0, 0.0])] {
        let contact = connection(&scene, name);
        let depth = dot(sub(*contact.from.at(last).unwrap(), *contact.to.at(last).unwrap()), normal);
        let force = dot(*contact.force.at(last).unwrap(), normal);
        // At the end nothing moves much: dissipation gives little.
        let t = (1.0 + depth / 2e-3).clamp(0.0, 2.0);
        let expected = 5000.0 * (2e-3 * t.powi(4) * (t * t - 6.0 * t + 10.0) / 32.0 + (depth - 2e-3).max(0.0));
        assert!((force - expected).abs() < 0.05 * expected && force > 1.0, "{name}: {force} N, not {expected} N");
        let wall = scene.walls.iter().find(|wall| wall.name == name).unwrap();
        close(&turned(wall.rotation, [0.0, 0.0, 1.0]), &normal, 1e-6);
        let out = dot(sub(*wall.position.at(last).unwrap(), *contact.from.at(last).unwrap()), normal);
        assert!(out.abs() < 1e-6, "{name}: the plate is {out} m out of the wall");
        let place = trajectory.state_names.iter().position(|state| *state == format!("c.{name}")).unwrap();
        let deviation = trajectory.deviations[step(&trajectory, &scene, last)][place];
        // Scenes keep five digits.
        close(wall.deviation.at(last).unwrap(), &[deviation], 6e-5 * deviation);
    }
}

#[test]
fn tracks_are_short_where_nothing_changes() {
    assert_eq!(Track::new(vec![[1.0, 2.0]; 5]).0.len(), 1);
    let track = Track::new(vec![[1.0 / 3.0], [200.0 / 3.0], [0.0]]);
    assert_eq!(track.0, [[0.33333], [66.66667], [0.0]]);
    assert_eq!(serde_json::to_string(&track).unwrap(), "[0.33333,66.66667,0.0]");
    let gap = Track(vec![[1.0, f64::NAN, 2.0]]);
    assert_eq!(serde_json::to_string(&gap).unwrap(), "[[1.0,null,2.0]]");
    let read: Track<3> = serde_json::from_str("[[1.0,null,2.0]]").unwrap();
    assert!(read.0[0][1].is_nan() && read.0[0][2] == 2.0);
    let error = serde_json::from_str::<Track<3>>("[[1.0, 2.0]]").unwrap_err();
    assert!(error.to_string().contains("a row has 2 numbers instead of 3"), "{error}");
}

#[test]
fn quaternions_turn_as_their_matrices() {
    let angles =
        [[0.0, 0.0, 0.0], [3.1, 0.2, 0.1], [0.1, 3.1, -0.2], [0.3, -0.2, 3.1], [1.0, -1.2, 2.5], [-2.9, 1.5, 0.4]];
    for rpy in angles {
        let pose = Pose::from_rpy([0.0; 3], rpy);
        let quaternion = quaternion(&pose.rotation);
        assert!(quaternion[0] >= 0.0);
        close(&[quaternion.iter().map(|entry| entry * entry).sum::<f64>()], &[1.0], 1e-14);
        close(&turned(quaternion, [0.3, -0.4, 0.5]), &pose.rotate([0.3, -0.4, 0.5]), 1e-14);
    }
    let rotation = turned_to([0.0, -3.0, 4.0]);
    close(&rotation.map(|row| row[2]), &[0.0, -0.6, 0.8], 1e-15);
    assert_eq!(turned_to([0.0; 3]), Pose::IDENTITY.rotation);
}
