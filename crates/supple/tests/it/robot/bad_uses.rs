//! Wrong sensors, states, noise and costs of a robot in task files.

use crate::robot::arm::{Description, arm, cost, sensor};
use crate::robot::bad_tasks::{assert_errors, contact, elastic, error_of};
use crate::robot::examples;

#[test]
fn sensors() {
    let position = |keys: &str| arm().sensing(&sensor("joint_position", keys));
    assert_errors(vec![
        (arm().sensing(""), "task.toml:1:1: model.sensors: is missing"),
        (
            arm().sensing(&sensor("joint_angle", "select = [\"elbow\"]\nvariance = 1.0")),
            "task.toml:5:8: model.sensors[0].kind: must be one of `center_of_mass`, `clearance`, \
             `contact_force`, `control`, `coupling_deflection`, `coupling_force`, `drive_effort`, `file`, `frame_point`, `frame_pose`, \
             `frame_turn`, `frame_velocity`, `joint_acceleration`, `joint_position`, `joint_torque`, `joint_velocity`, \
             `penetration`, `power`, `signal`, `state`, `state_and_control`; found `joint_angle` (did you mean \
             `joint_torque`?)",
        ),
        (
            position("select = [\"elbos\"]\nvariance = 1.0"),
            "task.toml:6:10: model.sensors[0].select: the robot has no moving joint `elbos`: it has `shoulder`, \
             `elbow`, `slide` (did you mean `elbow`?)",
        ),
        (position("select = []\nvariance = 1.0"), "task.toml:6:10: model.sensors[0].select: name at least one joint"),
        (
            position("select = [\"elbow\", \"slide\"]\nvariance = [1.0, 2.0, 3.0]"),
            "task.toml:7:12: model.sensors[0].variance: must be one number, or 2 of them, one for each entry; \
             found 3",
        ),
        (
            position("select = [\"elbow\"]\nvariance = 0.0"),
            "task.toml:7:12: model.sensors[0].variance: must be above 0: sensor noise is required; found 0",
        ),
        (
            position("select = [\"elbow\"]\nvariance = \"v\"").where_(&[("v", 0.0)]),
            "task.toml:10:12: model.sensors[0].variance: must be above 0: sensor noise is required; its parameter can be as low as -0.1",
        ),
        (
            position("select = [\"elbow\"]\nside = \"motor\"\nvariance = 1.0"),
            "task.toml:7:8: model.sensors[0].side: joint `elbow` has no separate motor: the joint is rigid",
        ),
        (
            position("select = [\"elbow\"]\nside = \"drive\"\nvariance = 1.0"),
            "task.toml:7:8: model.sensors[0].side: must be one of `link`, `motor`; found `drive`",
        ),
        (position("select = [\"elbow\"]"), "task.toml:4:1: model.sensors[0].variance: is missing"),
        (
            arm().sensing(&sensor("joint_torque", "select = [\"elbow\"]\nvariance = 1.0")),
            "task.toml:6:10: model.sensors[0].select: the torque of joint `elbow` cannot be measured: the joint is rigid (add compliance of kind \"elastic_joint\" to it)",
        ),
        (
            arm().sensing(&sensor("frame_point", "frame = \"tol\"\nvariance = 1.0")),
            "task.toml:6:9: model.sensors[0].frame: the model has no link or frame `tol`: it has `base`, \
             `upper`, `fore`, `tip`, `tool` (did you mean `tool`?)",
        ),
        (
            elastic().sensing(&sensor("coupling_force", "coupling = \"flexibel\"\nvariance = 1.0")),
            "task.toml:12:12: model.sensors[0].coupling: the model has no compliance `flexibel`: it has \
             `flexible` (did you mean `flexible`?)",
        ),
        (
            arm().sensing(&sensor("coupling_force", "coupling = \"gripper\"\nvariance = 1.0")),
            "task.toml:6:12: model.sensors[0].coupling: the model has no compliance `gripper`: none are defined",
        ),
        (
            contact("normal = [1.0, 0.0, 0.0]")
                .sensing(&sensor("coupling_deflection", "coupling = \"wall\"\nvariance = 1.0")),
            "task.toml:13:12: model.sensors[0].coupling: `wall` is a contact and has no deflection; use the quantity `clearance`",
        ),
        (
            contact("normal = [1.0, 0.0, 0.0]")
                .sensing(&sensor("contact_force", "contact = \"wall\"\nsmoothing = -0.5\nvariance = 1.0")),
            "task.toml:14:13: model.sensors[0].smoothing: must be above 0 N, or left out for the force as it is; found -0.5",
        ),
        (
            arm().sensing(&sensor("power", "variance = 0.0")),
            "task.toml:6:12: model.sensors[0].variance: must be above 0: sensor noise is required; found 0",
        ),
        (
            arm().sensing(&sensor("frame_velocity", "frame = \"tool\"\nselect = [\"v\"]\nvariance = 1.0")),
            "task.toml:7:10: model.sensors[0].select: unknown velocity component `v`: it has `vx`, `vy`, `vz`, `wx`, `wy`, `wz` \
             (did you mean `vz`?)",
        ),
        (
            arm().sensing(&sensor("center_of_mass", "axis = [\"x\"]\nvariance = 1.0")),
            "task.toml:6:1: model.sensors[0].axis: unknown key `axis`; valid: `axes`, `variance`, `deviation` (did you \
             mean `axes`?)",
        ),
        (
            arm().sensing(&sensor("file", "select = [\"angle\"]\nvariance = 1.0")),
            "task.toml:6:10: model.sensors[0].select: the robot file has no sensor `angle`: none are defined",
        ),
        (
            elastic()
                .sensing(&sensor("coupling_force", "coupling = \"flexible\"\nselect = [\"torque_x\"]\nvariance = 1.0")),
            "task.toml:13:10: model.sensors[0].select: `flexible` has no `torque_x`: it has `torque` (did you mean `torque`?)",
        ),
        (
            elastic().sensing(&sensor("coupling_force", "coupling = \"flexible\"\nselect = []\nvariance = 1.0")),
            "task.toml:13:10: model.sensors[0].select: name at least one",
        ),
    ]);
}

#[test]
fn tasks() {
    let start = |start: &str| Description { start: start.into(), ..arm() };
    let noise = |noise: &str| Description { noise: noise.into(), ..arm() };
    assert_errors(vec![
        (
            start("\"q.elbo\" = 0.1\n"),
            "task.toml:13:12: tasks[0].initial_state.\"q.elbo\": no state is `q.elbo`; states: `q.shoulder`, \
             `q.elbow`, `q.slide`, `v.shoulder`, `v.elbow`, `v.slide` (did you mean `q.elbow`?)",
        ),
        (
            start("\"q.*elbow*s\" = 0.1\n"),
            "task.toml:13:16: tasks[0].initial_state.\"q.*elbow*s\": no state fits `q.*elbow*s`; states: `q.shoulder`, `q.elbow`, `q.slide`, `v.shoulder`, `v.elbow`, `v.slide` (did you mean `q.elbow`?)",
        ),
        (
            start("\"q.elbow\" = \"far\"\n"),
            "task.toml:13:13: tasks[0].initial_state.\"q.elbow\": parameter `far` is not declared: add a table \
             [parameters.far]",
        ),
        // A key below the header of a table, where one of the task was meant.
        (
            start("per = \"second\"\n"),
            "task.toml:13:7: tasks[0].initial_state.per: `per` is a key of [[tasks]]: write it there, above the headers of the tables in it",
        ),
        (
            start("bound = 5.0\n"),
            "task.toml:13:9: tasks[0].initial_state.bound: `bound` is a key of [[tasks]]: write it there, above the headers of the tables in it",
        ),
        (
            noise("initial = { \"*\" = 1e-3 }\n[tasks.noise.process]\n\"*\" = 1e-4\nmeasurement = [1e-3]\n"),
            "task.toml:23:15: tasks[0].noise.process.measurement: `measurement` is a key of [tasks.noise]: write it there, above the headers of the tables in it",
        ),
        (
            noise("initial = { \"q.arm*\" = 1e-3 }\nprocess = { \"*\" = 1e-4 }\n"),
            "task.toml:20:24: tasks[0].noise.initial.\"q.arm*\": no state fits `q.arm*`; states: `q.shoulder`, `q.elbow`, `q.slide`, `v.shoulder`, `v.elbow`, `v.slide`",
        ),
        (
            noise("initial = { \"*\" = 1e-3 }\nprocess = { \"v.*\" = -1e-4 }\n"),
            "task.toml:21:21: tasks[0].noise.process.\"v.*\": must be at least 0, as a variance; found -0.0001",
        ),
        (
            noise("initial = { \"*\" = 1e-3 }\nprocess = { }\nmeasurement = { elbow = 1e-3 }\n"),
            "task.toml:22:15: tasks[0].noise.measurement: must be a list of numbers, or a list of rows of \
             numbers: measurements have no names",
        ),
        (
            noise("initial = { \"*\" = 1e-3 }\nprocess = { }\nmeasurement = [1e-3, 1e-3]\n"),
            "task.toml:22:15: tasks[0].noise.measurement: must have 3 variances; found 2",
        ),
        (noise("initial = { \"*\" = 1e-3 }\n"), "task.toml:19:1: tasks[0].noise.process: is missing"),
    ]);
}

#[test]
fn lists_of_states() {
    let short = Description { start: String::new(), ..arm() };
    let text = short.text().replace("[tasks.initial_state]\n", "initial_state = [0.1, 0.2]\n");
    assert_eq!(
        error_of(&text),
        "task.toml:12:17: tasks[0].initial_state: must have 6 entries (`q.shoulder`, `q.elbow`, `q.slide`, \
         `v.shoulder`, `v.elbow`, `v.slide`); found 2"
    );
}

#[test]
fn costs() {
    let all = |keys: &str| format!("{keys}\nweight = 1.0");
    let one = |kind: &str, keys: &str| arm().costing(&cost(kind, &all(keys)));
    let equipped = examples::of_compliance().remove(2);
    let force = |keys: &str| equipped.clone().costing(&cost("coupling_force", &all(keys)));
    assert_errors(vec![
        (
            one("joint_position", "select = [\"elbo\"]"),
            "task.toml:24:10: tasks[0].costs[0].select: the robot has no moving joint `elbo`: it has \
             `shoulder`, `elbow`, `slide` (did you mean `elbow`?)",
        ),
        (
            one("joint_position", "target = [1.0]"),
            "task.toml:24:10: tasks[0].costs[0].target: must be 3 numbers, one for each entry; found 1",
        ),
        (one("joint_velocity", "select = []"), "task.toml:24:10: tasks[0].costs[0].select: name at least one joint"),
        (
            one("state", "select = [\"elbow\"]"),
            "task.toml:24:10: tasks[0].costs[0].select: the model has no state `elbow`: it has `q.shoulder`, \
             `q.elbow`, `q.slide`, `v.shoulder`, `v.elbow`, `v.slide` (did you mean `v.elbow`?)",
        ),
        (
            one("frame_point", "frame = \"tol\"\ntarget = [0.0, 0.0, 0.0]"),
            "task.toml:24:9: tasks[0].costs[0].frame: the model has no link or frame `tol`: it has `base`, \
             `upper`, `fore`, `tip`, `tool` (did you mean `tool`?)",
        ),
        (
            one("frame_point", "frame = \"tool\"\naxes = [\"x\"]\ntarget = [0.0, 0.0, 0.0]"),
            "task.toml:26:10: tasks[0].costs[0].target: must be one number; found 3",
        ),
        (
            one("frame_point", "frame = \"tool\"\naxes = [\"u\"]\ntarget = [0.0]"),
            "task.toml:25:9: tasks[0].costs[0].axes[0]: must be one of `x`, `y`, `z`; found `u`",
        ),
        (
            one("frame_pose", "frame = \"tool\"\nposition = [0.0, 0.0, 0.0]\nrpy = [0.0, 0.0]\nlever = 1.0"),
            "task.toml:26:7: tasks[0].costs[0].rpy: must be a list of 3; found 2",
        ),
        (
            one("contact_force", "contact = \"wall\"\ntarget = 1.0\nsmoothing = 0.1"),
            "task.toml:24:11: tasks[0].costs[0].contact: the model has no contact `wall`: none are defined",
        ),
        (
            contact("normal = [1.0, 0.0, 0.0]")
                .costing(&cost("contact_force", &all("contact = \"wal\"\ntarget = 1.0\nsmoothing = 0.1"))),
            "task.toml:31:11: tasks[0].costs[0].contact: the model has no contact `wal`: it has `wall` (did you \
             mean `wall`?)",
        ),
        (
            contact("normal = [1.0, 0.0, 0.0]").costing(&cost("penetration", &all("target = 1e-3"))),
            "task.toml:29:1: tasks[0].costs[0].contact: is missing: the model has `wall` (name the contact)",
        ),
        (
            one("penetration", "target = 1.0"),
            "task.toml:23:8: tasks[0].costs[0].kind: the model has no contact: it has no signal `penetration`",
        ),
        (
            force("coupling = \"griper\"\nselect = [\"force_x\"]"),
            "task.toml:91:12: tasks[0].costs[0].coupling: the model has no compliance `griper`: it has \
             `gripper` (did you mean `gripper`?)",
        ),
        (
            equipped.clone().costing(&cost("signal", &all("select = [\"grip.force\"]\ntarget = 0.0"))),
            "task.toml:91:10: tasks[0].costs[0].select: the model has no signal `grip.force`; the nearest of its 129 \
             signals are `gripper.force_x`, `gripper.force_y`, `gripper.force_z`, `gripper.deflection_yaw`, \
             `gripper.deflection_roll`, `gripper.deflection_pitch`; the others begin with `base.`, `upper.`, `fore.`, \
             `tip.`, `tool.`, `anchor.`, `gripper.`, `effort_shoulder`, `power_shoulder`, `effort_elbow`, \
             `power_elbow`, `effort_slide`, `power_slide`, `center_of_mass_x`, `center_of_mass_y`, \
             `center_of_mass_z`",
        ),
        (
            force("coupling = \"tool\"\nselect = [\"x\"]"),
            "task.toml:91:12: tasks[0].costs[0].coupling: the model has no compliance `tool`: it has `gripper`",
        ),
        (
            one("coupling_force", "coupling = \"tool\"\nselect = [\"x\"]"),
            "task.toml:24:12: tasks[0].costs[0].coupling: the model has no compliance `tool`: none are defined",
        ),
        (
            force("coupling = \"gripper\"\nselect = [\"force\"]"),
            "task.toml:92:10: tasks[0].costs[0].select: `gripper` has no `force`: it has `torque_x`, \
             `torque_y`, `torque_z`, `force_x`, `force_y`, `force_z` (did you mean `force_z`?)",
        ),
        (force("coupling = \"gripper\"\nselect = []"), "task.toml:92:10: tasks[0].costs[0].select: name at least one"),
    ]);
}
