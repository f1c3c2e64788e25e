//! Accelerations of the arm with the door, free and through the gripper, against Drake's.

use serde_json::Value as Json;
use supple::Problem;

use crate::common::reference::relative_error;
use crate::common::{numbers, repository};
use crate::robot::arm::accelerations;
use crate::robot::assert_close;

const JOINTS: usize = 8;

/// The arm with drives in its seven joints and a time step of 1 s.
fn problem(gravity: f64, bushing: &str) -> Problem {
    let arm: Vec<String> = (1..=7).map(|i| format!("\"iiwa_joint_{i}\"")).collect();
    let arm = arm.join(", ");
    let text = format!(
        "[model]\nkind = \"robot\"\nfile = \"iiwa14_door.urdf\"\nintegrator = \"semi_implicit\"\ngravity = [0.0, 0.0, {}]\nactuated = [{arm}]\n\
         {bushing}[[model.sensors]]\nkind = \"joint_position\"\nselect = [{arm}]\nvariance = 1.0\n\
         [[tasks]]\nname = \"step\"\nsteps = 1\ntime_step = 1.0\ninitial_state = {{}}\n\
         [tasks.noise]\ninitial = {{}}\nprocess = {{}}\n[[tasks.costs]]\nkind = \"control\"\nweight = 1.0\n",
        -gravity
    );
    let name = repository("models").join("golden.toml");
    supple_file::parse(&text, &name.display().to_string()).unwrap_or_else(|error| panic!("{error}\n{text}"))
}

fn bushing(case: &Json) -> String {
    let list =
        |key: &str| numbers(&case[key]).iter().map(|number| format!("{number:?}")).collect::<Vec<_>>().join(", ");
    format!(
        "[[model.compliance]]\nkind = \"bushing\"\nname = \"gripper\"\nframe_a = \"iiwa_link_7\"\n\
         frame_c = \"handle\"\n\
         stiffness = [{}]\ndamping = [{}]\ntorsional_stiffness = [{}]\ntorsional_damping = [{}]\n",
        list("linear_stiffness"),
        list("linear_damping"),
        list("torsional_stiffness"),
        list("torsional_damping"),
    )
}

/// Compares the accelerations of all cases of one kind; returns how many there were. With `--nocapture` it says what is
/// reached.
#[allow(clippy::print_stderr)]
fn compare(golden: &Json, kind: &str, tolerance: f64) -> usize {
    let cases: Vec<&Json> = golden["cases"].as_array().unwrap().iter().filter(|case| case["kind"] == kind).collect();
    let mut worst = 0.0_f64;
    for (index, case) in cases.iter().enumerate() {
        let bushing = if kind == "bushing" { bushing(case) } else { String::new() };
        let problem = problem(case["gravity"].as_f64().unwrap(), &bushing);
        let [q, v, tau] = ["q", "v", "tau"].map(|key| numbers(&case[key]));
        let found = accelerations(&problem, &[q, v].concat(), &tau[..7], &[], JOINTS);
        let expected = numbers(&case["acceleration"]);
        assert_close(&format!("{kind} {index}"), &found, &expected, tolerance);
        worst = worst.max(relative_error(&found, &expected));
    }
    eprintln!("{kind}: off by {worst:.1e}");
    cases.len()
}

#[test]
fn free_accelerations_are_drakes() {
    let text = std::fs::read_to_string(repository("crates/supple-robot/tests/golden/iiwa14_door.json")).unwrap();
    assert_eq!(compare(&serde_json::from_str(&text).unwrap(), "free", 1e-10), 8);
}

#[test]
fn accelerations_through_the_bushing_are_drakes() {
    let golden = serde_json::from_str(include_str!("../../golden/iiwa14_bushing.json")).unwrap();
    assert_eq!(compare(&golden, "bushing", 1e-8), 12);
}
