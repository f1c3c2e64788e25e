//! MJCF files: robots against what MuJoCo makes of them, and what is read of each element.
#![allow(clippy::unwrap_used, clippy::expect_used)]

use serde_json::Value;
use supple_robot::*;

/// Largest error, relative to the largest number compared.
const TOLERANCE: f64 = 1e-12;

/// The robot in a text.
fn read(text: &str) -> Robot {
    parse(text, "robot.xml", &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"))
}

/// A robot whose world has `text` in it.
fn world(text: &str) -> Robot {
    read(&format!("<mujoco><worldbody>{text}</worldbody></mujoco>"))
}

/// An inertia for bodies whose inertia does not matter.
const INERTIAL: &str = "<inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/>";

fn numbers(value: &Value) -> Vec<f64> {
    match value {
        Value::Array(entries) => entries.iter().flat_map(numbers).collect(),
        number => vec![number.as_f64().unwrap()],
    }
}

#[track_caller]
fn assert_close(what: &str, found: impl IntoIterator<Item = f64>, expected: &[f64]) {
    let found: Vec<f64> = found.into_iter().collect();
    assert_eq!(found.len(), expected.len(), "{what}");
    let largest = expected.iter().fold(1.0, |largest: f64, entry| largest.max(entry.abs()));
    for (a, b) in found.iter().zip(expected) {
        assert!((a - b).abs() <= TOLERANCE * largest, "{what}: {found:?} instead of {expected:?}");
    }
}

/// The robot of a file, each joint by itself, and what MuJoCo makes of it.
fn robot(name: &str) -> (Robot, Value) {
    let folder = format!("{}/tests/data_sdf_mjcf", env!("CARGO_MANIFEST_DIR"));
    let options = LoadOptions { independent_mimic: true, ..LoadOptions::default() };
    let robot = load(format!("{folder}/{name}.xml"), &options).unwrap_or_else(|error| panic!("{error}"));
    let golden = std::fs::read_to_string(format!("{folder}/{name}.json")).unwrap();
    (robot, serde_json::from_str(&golden).unwrap())
}

const ROBOTS: [&str; 5] = ["arm", "joints", "orientations", "shapes", "bounds"];

#[test]
fn bodies_have_the_inertia_that_mujoco_gives_them() {
    for name in ROBOTS {
        let (robot, golden) = robot(name);
        for golden in golden["inertias"].as_array().unwrap() {
            let link = &robot.links[robot.link(golden["body"].as_str().unwrap()).unwrap()];
            let what = format!("{name}, {}", link.name);
            let none = Inertia { mass: 0.0, center: [0.0; 3], moment: [[0.0; 3]; 3] };
            let inertia = link.inertia.unwrap_or(none);
            assert_close(&what, [inertia.mass], &numbers(&golden["mass"]));
            assert_close(&what, inertia.center, &numbers(&golden["center"]));
            assert_close(&what, inertia.moment.into_iter().flatten(), &numbers(&golden["moment"]));
        }
    }
}

#[test]
fn joints_have_the_numbers_that_mujoco_gives_them() {
    for name in ROBOTS {
        let (robot, golden) = robot(name);
        assert_eq!(robot.gravity.unwrap().to_vec(), numbers(&golden["gravity"]));
        let moving = robot.joints.iter().filter(|joint| joint.kind != JointKind::Fixed).count();
        let golden = golden["joints"].as_array().unwrap();
        assert_eq!(moving, golden.len());
        for golden in golden {
            let joint = &robot.joints[robot.joint(golden["joint"].as_str().unwrap()).unwrap()];
            let what = format!("{name}, {}", joint.name);
            let limited = golden["limited"].as_bool().unwrap();
            let kind = match (golden["slide"].as_bool().unwrap(), limited) {
                (true, _) => JointKind::Prismatic,
                (false, true) => JointKind::Revolute,
                (false, false) => JointKind::Continuous,
            };
            assert_eq!(joint.kind, kind, "{what}");
            let limits = [joint.limits.lower, joint.limits.upper];
            match limited {
                true => assert_close(&what, limits, &numbers(&golden["range"])),
                false => assert_eq!(limits, [f64::NEG_INFINITY, f64::INFINITY]),
            }
            let effort = golden["effort"].get(1).map_or(f64::INFINITY, |effort| effort.as_f64().unwrap());
            assert_eq!(joint.limits.effort, effort, "{what}");
            let found = [joint.reference, joint.rest, joint.stiffness, joint.damping, joint.armature, joint.friction];
            let expected = ["ref", "rest", "stiffness", "damping", "armature", "friction"];
            assert_close(&what, found, &expected.map(|name| golden[name].as_f64().unwrap()));
        }
    }
}

#[test]
fn robots_stand_and_move_as_in_mujoco() {
    for name in ROBOTS {
        let (robot, golden) = robot(name);
        let tree = Tree::new(&robot);
        let model = Numbers::<f64>::of(&robot, robot.gravity.unwrap());
        let order: Vec<_> =
            golden["joints"].as_array().unwrap().iter().map(|joint| joint["joint"].as_str().unwrap()).collect();
        let place: Vec<_> =
            order.iter().map(|name| tree.joints().iter().position(|joint| joint == name).unwrap()).collect();
        assert_eq!(place.len(), tree.dofs());
        let ours = |golden: &Value| {
            let mut ours = vec![0.0; tree.dofs()];
            place.iter().zip(numbers(golden)).for_each(|(&place, number)| ours[place] = number);
            ours
        };
        for case in golden["cases"].as_array().unwrap() {
            let (q, v) = (ours(&case["q"]), ours(&case["v"]));
            let kinematics = Kinematics::of(&tree, &model, &q, &v);
            let found = |link: usize, pose: &Pose| kinematics.poses()[link].compose(pose);
            for golden in case["bodies"].as_array().unwrap() {
                let link = robot.link(golden["body"].as_str().unwrap()).unwrap();
                let pose = found(link, &Pose::IDENTITY);
                let what = format!("{name}, {}", robot.links[link].name);
                assert_close(&what, pose.position, &numbers(&golden["position"]));
                assert_close(&what, pose.rotation.into_iter().flatten(), &numbers(&golden["rotation"]));
            }
            for golden in case["sites"].as_array().unwrap() {
                let site = golden["site"].as_str().unwrap();
                let (link, pose) = robot.frame(site).unwrap();
                let pose = found(link, &pose);
                assert_close(site, pose.position, &numbers(&golden["position"]));
                assert_close(site, pose.rotation.into_iter().flatten(), &numbers(&golden["rotation"]));
            }
            let mass = mass_matrix(&tree, &model, &kinematics);
            let mass = place.iter().flat_map(|&i| place.iter().map(move |&j| (i, j))).map(|(i, j)| mass[i][j]);
            assert_close(&format!("{name}, mass matrix"), mass, &numbers(&case["mass_matrix"]));
            let mut frictionless = model.clone();
            frictionless.joints.iter_mut().for_each(|joint| joint.friction = 0.0);
            let force = bias(&tree, &frictionless, &kinematics, &q, &v, 1.0);
            assert_close(&format!("{name}, bias"), place.iter().map(|&i| force[i]), &numbers(&case["bias"]));
        }
    }
}

#[test]
fn the_arm_is_read_whole() {
    let path = format!("{}/tests/data_sdf_mjcf/arm.xml", env!("CARGO_MANIFEST_DIR"));
    let robot = load(path, &LoadOptions::default()).unwrap();
    assert_eq!(robot.name, "arm");
    let links: Vec<_> = robot.links.iter().map(|link| (link.name.as_str(), link.line)).collect();
    let expected = [
        ("world", 22),
        ("base", 26),
        ("upper", 28),
        ("lower/lift", 33),
        ("lower", 32),
        ("hand", 38),
        ("left", 41),
        ("right", 45),
    ];
    assert_eq!(links, expected);
    let joints: Vec<_> = robot.joints.iter().map(|joint| (joint.name.as_str(), joint.parent)).collect();
    let expected =
        [("base/fixed", 0), ("pan", 1), ("lift", 2), ("roll", 3), ("hand/fixed", 4), ("left", 5), ("right", 5)];
    assert_eq!(joints, expected);
    let frames: Vec<_> = robot.frames.iter().map(|frame| (frame.name.as_str(), frame.link)).collect();
    assert_eq!(frames, [("corner", 0), ("shoulder", 2), ("elbow", 4), ("grip", 5)]);
    assert_eq!(robot.joints[6].mimic, Some(Mimic { joint: 5, ratio: 0.9, offset: 0.002 }));
    assert_eq!(robot.warnings, ["element `actuator` is ignored (line 56)", "element `light` is ignored (line 23)"]);
}
