//! Joints that follow others, and the key that makes them joints of their own.

use crate::robot::arm::{Description, accelerations, arm, cost, observe, sensor};
use crate::robot::assert_close;
use crate::robot::bad_tasks::error_of;

/// A gripper whose right finger follows the left one: `right = 0.01 - left / 2`.
fn gripper(keys: &str, sensors: &str) -> Description {
    Description {
        model: format!("file = \"gripper.urdf\"\n{keys}"),
        sensors: sensors.into(),
        start: String::new(),
        costs: cost("control", "weight = 1.0"),
        time_step: "1.0".into(),
        ..arm()
    }
}

#[test]
fn a_follower_has_no_state_and_adds_its_inertia() {
    let sensors = sensor("frame_point", "frame = \"right_finger\"\nvariance = 1.0")
        + &sensor("frame_point", "frame = \"left_finger\"\nvariance = 1.0");
    let problem = gripper("", &sensors).problem();
    assert_eq!(problem.tasks[0].system.state_names(), ["q.left", "v.left"]);
    assert_eq!(observe(&problem, &[0.06, 0.0], &[]), [0.0, 0.01 - 0.03, 0.0, 0.0, 0.06, 0.0]);
    // The follower moves at half the speed: a quarter of its mass is felt.
    let found = accelerations(&problem, &[0.06, 0.3], &[2.0], &[], 1);
    assert_close("acceleration", &found, &[2.0 / (0.3 + 0.25 * 0.4)], 1e-13);
}

#[test]
fn independent_followers_are_joints_of_their_own() {
    let sensors = sensor("joint_position", "select = [\"right\", \"left\"]\nvariance = 1.0");
    let problem = gripper("independent_mimic = true\n", &sensors).problem();
    assert_eq!(problem.tasks[0].system.state_names(), ["q.left", "q.right", "v.left", "v.right"]);
    assert_eq!(observe(&problem, &[0.06, 0.02, 0.0, 0.0], &[]), [0.02, 0.06]);
    let found = accelerations(&problem, &[0.06, 0.02, 0.0, 0.0], &[2.0, -1.0], &[], 2);
    assert_close("accelerations", &found, &[2.0 / 0.3, -1.0 / 0.4], 1e-13);
}

#[test]
fn followers_where_joints_are_asked_for_name_their_leader() {
    let sensors = sensor("joint_position", "select = [\"left\"]\nvariance = 1.0");
    let of_follower = sensor("joint_position", "select = [\"right\"]\nvariance = 1.0");
    let started = Description { start: "\"q.right\" = 0.01\n".into(), ..gripper("", &sensors) };
    for description in [gripper("", &of_follower), gripper("actuated = [\"right\"]\n", &sensors), started] {
        let error = error_of(&description.text());
        assert!(error.contains("joint `right` follows joint `left` and does not move on its own"), "{error}");
        assert!(error.contains("(use `left`, which moves both)"), "{error}");
    }
}

#[test]
fn limits_of_a_follower_limit_its_leader() {
    let sensors = sensor("joint_position", "select = [\"left\"]\nvariance = 1.0");
    let limits = gripper("", &sensors).problem().tasks[0].system.limits();
    let named: Vec<_> = limits.iter().map(|limit| (limit.name.as_str(), limit.upper)).collect();
    // right = 0.01 - left / 2 is at least -0.03 m; its speed, 1 m/s, is not stricter.
    let position = "position of joint `left` (from the limits of `right`, which follows it)";
    assert_eq!(named[..2], [(position, 0.08), ("velocity of joint `left`", 1.0)]);
    let free = gripper("independent_mimic = true\n", &sensors).problem().tasks[0].system.limits();
    assert_eq!((free[0].name.as_str(), free[0].upper), ("position of joint `left`", 0.1));
}
