//! The arm and the door against numbers of an independent program; see `golden/README.md`.

#![allow(clippy::unwrap_used, clippy::expect_used)]

use serde_json::Value;
use supple_robot::*;

/// Largest error, relative to the largest entry.
const TOLERANCE: f64 = 1e-10;

fn numbers(value: &Value) -> Vec<f64> {
    match value {
        Value::Array(entries) => entries.iter().flat_map(numbers).collect(),
        number => vec![number.as_f64().unwrap()],
    }
}

fn assert_close(what: &str, found: impl IntoIterator<Item = f64>, golden: &Value) {
    let (found, golden): (Vec<f64>, _) = (found.into_iter().collect(), numbers(golden));
    assert_eq!(found.len(), golden.len(), "{what}");
    let largest = golden.iter().fold(0.0, |largest: f64, entry| largest.max(entry.abs()));
    for (found, golden) in found.iter().zip(&golden) {
        assert!((found - golden).abs() <= TOLERANCE * largest, "{what}: {found} instead of {golden}");
    }
}

#[test]
fn the_arm_and_the_door_move_as_another_program_says() {
    let folder = env!("CARGO_MANIFEST_DIR");
    let robot = load(format!("{folder}/../../models/iiwa14_door.urdf"), &LoadOptions::default()).unwrap();
    let golden = std::fs::read_to_string(format!("{folder}/tests/golden/iiwa14_door.json")).unwrap();
    let golden: Value = serde_json::from_str(&golden).unwrap();
    let tree = Tree::new(&robot);
    assert_eq!(Value::from(tree.joints()), golden["joints"]);
    let (hand, handle) = (robot.link("iiwa_link_7").unwrap(), robot.link("handle").unwrap());

    let cases = golden["cases"].as_array().unwrap().iter().filter(|case| case["kind"] == "free");
    let mut compared = 0;
    for case in cases {
        let model = Numbers::of(&robot, [0.0, 0.0, -case["gravity"].as_f64().unwrap()]);
        let [q, v, mut tau] = ["q", "v", "tau"].map(|name| numbers(&case[name]));
        let kinematics = Kinematics::of(&tree, &model, &q, &v);
        for (tau, passive) in tau.iter_mut().zip(passive_forces(&tree, &model, &q, &v, 1e-3)) {
            *tau += passive;
        }
        let acceleration = forward_dynamics(&tree, &model, &kinematics, &tau, &[]);
        assert_close("acceleration", acceleration, &case["acceleration"]);
        let mass = mass_matrix(&tree, &model, &kinematics);
        assert_close("mass matrix", mass.into_iter().flatten(), &case["mass_matrix"]);
        let (pose, door) = (kinematics.poses()[hand], kinematics.poses()[handle]);
        assert_close("position", pose.position, &case["link7_position"]);
        assert_close("rotation", pose.rotation.into_iter().flatten(), &case["link7_rotation"]);
        assert_close("handle", door.position, &case["handle_position"]);
        let jacobian = frame_jacobian(&tree, &kinematics, hand, [0.0; 3]);
        let golden = &case["link7_jacobian_angular_then_linear_world"];
        assert_close("Jacobian", jacobian.into_iter().flatten(), golden);
        compared += 1;
    }
    assert_eq!(compared, 8);
}
