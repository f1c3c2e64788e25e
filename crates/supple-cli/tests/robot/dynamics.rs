//! Dynamics as JSON.

use serde_json::{Value, json};

use crate::common::repository;
use crate::{assert_close, gripper, numbers, robot, shipped};

/// Numbers between commas, with all digits.
fn list(numbers: &[f64]) -> String {
    numbers.iter().map(f64::to_string).collect::<Vec<_>>().join(",")
}

/// `M a + bias`
fn forces(dynamics: &Value) -> Vec<f64> {
    let (a, bias) = (numbers(&dynamics["acceleration"]), numbers(&dynamics["bias"]));
    let rows = dynamics["mass_matrix"].as_array().unwrap().iter().map(numbers);
    let product = rows.map(|row| row.iter().zip(&a).map(|(entry, a)| entry * a).sum::<f64>());
    product.zip(bias).map(|(force, bias)| force + bias).collect()
}

#[test]
fn the_arm_and_the_door_move_as_another_program_says() {
    let golden = std::fs::read_to_string(repository("crates/supple-robot/tests/golden/iiwa14_door.json")).unwrap();
    let golden: Value = serde_json::from_str(&golden).unwrap();
    let cases: Vec<_> = golden["cases"].as_array().unwrap().iter().filter(|case| case["kind"] == "free").collect();
    assert_eq!(cases.len(), 8);
    for (index, case) in cases.into_iter().enumerate() {
        let [q, v, tau] = ["q", "v", "tau"].map(|name| list(&numbers(&case[name])));
        let gravity = list(&[0.0, 0.0, -case["gravity"].as_f64().unwrap()]);
        let state = ["--q", &q, "--v", &v, "--tau", &tau, "--gravity", &gravity, "--json"];
        // Without --json and the default gravity, it prints the same.
        let arguments = if case["gravity"] == 9.81 && index % 2 == 0 { &state[..6] } else { &state[..] };
        let found = shipped("models/iiwa14_door.urdf", arguments).json(0);
        assert_eq!(found["joints"], golden["joints"]);
        let hand = &found["frames"]["iiwa_link_7"];
        for (found, name) in [
            (&found["mass_matrix"], "mass_matrix"),
            (&found["acceleration"], "acceleration"),
            (&hand["position"], "link7_position"),
            (&hand["rotation"], "link7_rotation"),
            (&found["frames"]["handle"]["position"], "handle_position"),
        ] {
            assert_close(name, &numbers(found), &numbers(&case[name]));
        }
        assert_close("forces", &forces(&found), &numbers(&case["tau"]));
    }
}

#[test]
fn what_is_left_out_is_zero() {
    let run = |arguments: &[&str]| shipped("models/iiwa14_door.urdf", arguments).json(0);
    let rest = run(&["--json"]);
    assert_eq!(rest, run(&["--q", "0"]));
    assert_eq!(rest, run(&["--tau", ""]));
    assert_eq!(rest, run(&["--v", "0,0", "--gravity", "0,0,-9.81"]));
    assert_eq!(rest, run(&["--q=-0", "--json"]));
    let keys: Vec<_> = rest.as_object().unwrap().keys().collect();
    assert_eq!(keys, ["acceleration", "bias", "frames", "joints", "mass_matrix", "warnings"]);
    assert_eq!(rest["frames"].as_object().unwrap().len(), 10);
    assert_eq!(rest["frames"]["iiwa_link_1"]["position"], json!([0.0, 0.0, 0.1575]));
    assert_eq!(rest["frames"]["iiwa_link_1"]["rotation"], json!([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]));

    let state = run(&["--q", "-0.5, 1e-1 ,+.25", "--v", "-1,2", "--tau", "-3"]);
    let full = run(&["--q", "-0.5,0.1,0.25,0,0,0,0,0", "--v=-1,2,0,0,0,0,0,0", "--tau", "-3,0,0,0,0,0,0,-0"]);
    assert_eq!(state, full);
    assert_close("forces", &forces(&state), &[-3.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    let floating = run(&["--json", "--gravity", "0,0,0"]);
    assert_eq!(numbers(&floating["bias"]), [0.0; 8]);
    assert_eq!(numbers(&floating["acceleration"]), [0.0; 8]);
}

#[test]
fn followers_share_the_coordinate_of_what_they_follow() {
    let (q, v, a) = ([0.7, 0.02], [-1.5, 0.3], "1.5,-2");
    let reduced = robot(gripper(), &["--q", &list(&q), "--v", &list(&v), "--tau", a]).json(0);
    assert_eq!(reduced["joints"], json!(["swing", "left"]));
    let (right, rate) = (-2.0 * q[1] + 0.01, -2.0 * v[1]);
    let [q, v] = [list(&[q[0], q[1], right]), list(&[v[0], v[1], rate])];
    let free = robot(gripper(), &["--q", &q, "--v", &v, "--independent-mimic"]).json(0);
    assert_eq!(free["joints"], json!(["swing", "left", "right"]));
    for link in ["base", "hand", "left_finger", "right_finger"] {
        for part in ["position", "rotation"] {
            let [a, b] = [&reduced, &free].map(|dynamics| numbers(&dynamics["frames"][link][part]));
            assert_close(link, &a, &b);
        }
    }
    // G' M G and G' bias with the rows of G (1, 0), (0, 1), (0, -2)
    let m = numbers(&free["mass_matrix"]);
    let (across, own) = (m[1] - 2.0 * m[2], m[4] - 4.0 * m[5] + 4.0 * m[8]);
    assert_close("mass matrix", &numbers(&reduced["mass_matrix"]), &[m[0], across, across, own]);
    let bias = numbers(&free["bias"]);
    assert_close("bias", &numbers(&reduced["bias"]), &[bias[0], bias[1] - 2.0 * bias[2]]);
    assert_close("forces", &forces(&reduced), &[1.5, -2.0]);
    assert_close("forces", &forces(&free), &[0.0; 3]);
}

#[test]
fn the_bias_holds_damping_and_smoothed_friction() {
    let bias = |v: &str| numbers(&robot(gripper(), &["--v", v, "--gravity", "0,0,0"]).json(0)["bias"]);
    // Of the finger, and of its follower at twice the speed.
    let passive = |v: f64| 3.0 * v + 0.5 * v / v.hypot(1e-2);
    assert_close("bias", &bias("0,0.02"), &[0.0, passive(0.02) + 2.0 * passive(0.04)]);
}

#[test]
fn accelerations_are_null_where_nothing_resists() {
    let text = gripper().replacen("<link name='left_finger'>", "<link name='light'>", 1);
    let text = text.replacen("<child link='left_finger'/>", "<child link='tip'/>", 1);
    let text = text.replacen("<link name='base'/>", "<link name='base'/><link name='tip'/>", 1);
    let text = text.replacen(
        "</robot>",
        "<joint name='weld' type='fixed'><parent link='base'/><child link='light'/></joint></robot>",
        1,
    );
    let run = robot(&text, &["--q", "0.1", "--independent-mimic"]);
    assert_eq!(run.code, Some(0));
    let lines: Vec<_> = run.stderr.lines().collect();
    assert_eq!(lines.len(), 2, "{}", run.stderr);
    assert!(lines[0].starts_with("warning: joint `left`: it moves link `tip`"), "{}", run.stderr);
    assert!(
        lines[1].starts_with("warning: the mass matrix is singular: joint `left` moves no inertia"),
        "{}",
        run.stderr
    );
    let found: Value = serde_json::from_str(&run.stdout).unwrap();
    assert_eq!(found["acceleration"], Value::Null);
    let mass = numbers(&found["mass_matrix"]);
    assert_eq!((mass.len(), mass[4]), (9, 0.0));
    assert_eq!(numbers(&found["bias"]).len(), 3);
    assert_eq!(numbers(&found["frames"]["tip"]["position"]).len(), 3);
    // The follower moves inertia, and so does what it follows.
    let followed = robot(&text, &["--q", "0.1"]);
    assert!(followed.stdout.contains("\"acceleration\": ["), "{}", followed.stderr);
}

#[test]
fn a_robot_that_does_not_move_has_no_dynamics_but_frames() {
    let text = "<robot name='r'><link name='a'/><link name='b'/>\
        <joint name='j' type='fixed'><origin xyz='1 2 3'/><parent link='a'/><child link='b'/></joint></robot>";
    let found = robot(text, &["--json"]).json(0);
    assert_eq!(found["joints"], json!([]));
    assert_eq!(found["mass_matrix"], json!([]));
    assert_eq!(found["acceleration"], json!([]));
    assert_eq!(found["frames"]["b"]["position"], json!([1.0, 2.0, 3.0]));
}

#[test]
fn gravity_is_that_of_the_file() {
    let path = "crates/supple-robot/tests/data_sdf_mjcf/arm.xml";
    let of_file = shipped(path, &["--json"]);
    assert!(!of_file.stderr.contains("gravity"), "{}", of_file.stderr);
    assert_eq!(of_file.stdout, shipped(path, &["--json", "--gravity", "0.1,0,-9.7"]).stdout);
    assert_ne!(of_file.stdout, shipped(path, &["--json", "--gravity", "0,0,-9.81"]).stdout);
}
