//! Actuators, sensors and walls that a robot's MJCF file has: against MuJoCo, and what tasks may say of them.

use serde_json::Value as Json;
use supple::{Channel, Problem};

use crate::robot::arm::{Description, accelerations, arm, compliance, cost, observe, sensor, servo, step};
use crate::robot::assert_close;
use crate::robot::bad_tasks::assert_errors;

fn golden() -> Json {
    serde_json::from_str(include_str!("../../data/servo.json")).unwrap()
}

fn list(value: &Json) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|entry| entry.as_f64().unwrap()).collect()
}

fn controls(problem: &Problem) -> Vec<Channel> {
    problem.tasks[0].system.channels().controls
}

fn named(channels: &[Channel]) -> Vec<(&str, &str)> {
    channels.iter().map(|channel| (channel.name.as_str(), channel.unit.as_str())).collect()
}

#[test]
fn accelerations_are_those_of_mujoco() {
    let problem = Description { time_step: "1.0".into(), ..servo() }.explicit().problem();
    for case in golden()["cases"].as_array().unwrap() {
        let [x, u, a] = ["x", "u", "a"].map(|key| list(&case[key]));
        assert_close("accelerations", &accelerations(&problem, &x, &u, &[], 3), &a, 1e-10);
    }
}

#[test]
fn controls_are_the_actuators_in_the_order_of_the_file() {
    let expected = [("ctrl.motor", "N m"), ("ctrl.servo", "rad"), ("ctrl.speed", "m/s"), ("ctrl.affine", "")];
    assert_eq!(named(&controls(&servo().problem())), expected);
}

#[test]
fn a_task_chooses_among_actuators_and_plain_drives() {
    let chosen = servo().with("actuated = [\"slide\", \"servo\", \"shoulder\"]\n").problem();
    assert_eq!(named(&controls(&chosen)), [("tau.slide", "N"), ("ctrl.servo", "rad"), ("tau.shoulder", "N m")]);
    let plain = servo().with("file_actuators = false\n").problem();
    assert_eq!(named(&controls(&plain)), [("tau.shoulder", "N m"), ("tau.elbow", "N m"), ("tau.slide", "N")]);
}

/// A servo is a force that the task could compute itself: kp and kv of the task, not of the file, are in it.
#[test]
fn a_servo_is_a_force_of_position_and_rate() {
    let numbers = "[model.drives.servo]\nkp = \"kp\"\nkv = 0.5\ngear = 2.0\n";
    let servo_only =
        servo().explicit().with("actuated = [\"servo\"]\n").with(numbers).where_(&[("kp", 25.0)]).problem();
    let plain = servo().explicit().with("actuated = [\"elbow\"]\n").problem();
    let x = [0.3, -0.4, 0.1, 0.5, -0.7, 0.2];
    for u in [0.0, 0.8, -1.3] {
        let torque = 2.0 * (25.0 * (u - 2.0 * x[1]) - 0.5 * 2.0 * x[4]);
        let [found, expected] = [(&servo_only, u, &[25.0][..]), (&plain, torque, &[])]
            .map(|(problem, u, phi)| step(problem, &x, &[u], phi));
        assert_close("state", &found, &expected, 1e-12);
    }
}

/// Drives of joints that the task gives a stiffness or a damping follow positions or velocities.
#[test]
fn plain_drives_become_position_and_velocity_drives() {
    let drives = "[model.drives]\nshoulder = { kp = \"kp\", kv = 0.5, gear = 2.0 }\nslide = { kv = 7.0 }\n";
    let servos = arm().explicit().with(drives).where_(&[("kp", 25.0)]).problem();
    assert_eq!(named(&controls(&servos)), [("ctrl.shoulder", "rad"), ("tau.elbow", "N m"), ("ctrl.slide", "m/s")]);
    let plain = arm().explicit().problem();
    let x = [0.3, -0.4, 0.1, 0.5, -0.7, 0.2];
    for u in [[0.0, 0.3, 0.0], [0.8, -0.2, -0.4]] {
        let shoulder = 2.0 * (25.0 * (u[0] - 2.0 * x[0]) - 0.5 * 2.0 * x[3]);
        let [found, expected] = [(&servos, u, &[25.0][..]), (&plain, [shoulder, u[1], 7.0 * (u[2] - x[5])], &[])]
            .map(|(problem, u, phi)| step(problem, &x, &u, phi));
        assert_close("state", &found, &expected, 1e-12);
    }
    // Efforts limit torques: of these controls only that of the elbow.
    let limits = servos.tasks[0].system.limits();
    let of_controls: Vec<_> = limits.iter().filter(|limit| limit.name.contains("effort")).collect();
    assert_eq!(of_controls.len(), 1, "{limits:?}");
    // Without the actuators of the file, its joints take drives of the task.
    let own = servo().with("file_actuators = false\n[model.drives]\nelbow = { kp = 3.0 }\n").problem();
    assert_eq!(named(&controls(&own)), [("tau.shoulder", "N m"), ("ctrl.elbow", "rad"), ("tau.slide", "N")]);
    assert_errors(vec![(
        arm().with("[model.drives.slide]\nkp = -1.0\n"),
        "task.toml:5:6: model.drives.slide.kp: must be at least 0; found -1",
    )]);
}

/// A servo at an elastic joint holds the motor, and not the link.
#[test]
fn a_servo_of_an_elastic_joint_drives_its_motor() {
    let keys = "joint = \"elbow\"\nstiffness = 30.0\nmotor_inertia = 0.05";
    let elastic = |actuated: &str| {
        let mut description = Description { time_step: "1.0".into(), ..servo() }.explicit();
        description.model += &format!("actuated = [\"{actuated}\"]\n");
        description = description.with(&compliance("elastic_joint", "flexible", keys));
        description.problem()
    };
    let x = [0.3, -0.4, 0.1, -0.2, 0.5, -0.7, 0.2, 0.9];
    let (u, torque) = (0.8, 1.5 * (40.0 * (0.8 - 1.5 * x[3]) - 2.0 * 1.5 * x[7]));
    let [found, expected] =
        [("servo", u), ("elbow", torque)].map(|(name, u)| accelerations(&elastic(name), &x, &[u], &[], 4));
    assert_close("accelerations", &found, &expected, 1e-12);
}

#[test]
fn ranges_are_limits_of_the_controls() {
    let limits = servo().problem().tasks[0].system.limits();
    let found: Vec<_> = limits.iter().map(|limit| (limit.name.as_str(), limit.lower, limit.upper)).collect();
    let expected = [
        ("control of actuator `motor`", -3.0, 4.0),
        ("force of actuator `motor`", -2.0, 6.0),
        ("control of actuator `servo`", -2.0, 2.0),
    ];
    assert_eq!(found, expected);
}

/// A plan keeps the tighter of both ranges where the task asks for it: of the motor -2 to 4.
#[test]
fn plans_keep_the_ranges_where_the_task_asks_for_it() {
    let mut description = servo().with("actuated = [\"motor\"]\n");
    description.costs =
        cost("joint_position", "target = [2.0, 0.0, 0.0]\nweight = 500.0") + &cost("control", "weight = 1e-4");
    description.time_step = "0.02\nenforce_effort_limits = true".into();
    let problem = description.problem();
    let bounds = problem.tasks[0].control_bounds.as_ref().unwrap();
    assert_eq!((bounds.lower(), bounds.upper()), (&[-2.0][..], &[4.0][..]));
}

#[test]
fn sensors_of_the_file_measure_what_mujoco_measures() {
    let keys = "select = [\"angle\", \"rate\", \"place\", \"turn\"]\nvariance = 1e-3";
    let problem = servo().sensing(&sensor("file", keys)).problem();
    let golden = golden();
    let reference = list(&golden["tip"]);
    for case in golden["cases"].as_array().unwrap() {
        let y = observe(&problem, &list(&case["x"]), &[]);
        assert_close("angle, rate and place", &y[..5], &list(&case["sensors"]), 1e-12);
        // Axis times angle of the rotation from the orientation in the file's own initial state.
        let tip = list(&case["tip"]);
        let entry = |i: usize, j: usize| (0..3).map(|k| reference[3 * k + i] * tip[3 * k + j]).sum::<f64>();
        let sines = [(2, 1), (0, 2), (1, 0)].map(|(i, j)| 0.5 * (entry(i, j) - entry(j, i)));
        let (sine, cosine) =
            (sines.iter().map(|s| s * s).sum::<f64>().sqrt(), 0.5 * (0..3).map(|i| entry(i, i)).sum::<f64>() - 0.5);
        let turn = sines.map(|s| s * if sine > 0.0 { sine.atan2(cosine) / sine } else { 1.0 });
        assert_close("turn", &y[5..], &turn, 1e-12);
    }
    let names: Vec<_> =
        problem.tasks[0].system.channels().measurements.into_iter().map(|channel| channel.name).collect();
    assert_eq!(names[..3], ["q.elbow", "v.slide", "x of tip"]);
}

#[test]
fn torque_of_the_file_is_measured_at_an_elastic_joint() {
    let keys = "joint = \"elbow\"\nstiffness = 30.0\nmotor_inertia = 0.05";
    let both = sensor("file", "select = [\"torque\"]\nvariance = 1e-3")
        + &sensor("joint_torque", "select = [\"elbow\"]\nvariance = 1e-3");
    let problem = servo().with(&compliance("elastic_joint", "flexible", keys)).sensing(&both).problem();
    let y = observe(&problem, &[0.3, -0.4, 0.1, -0.2, 0.5, -0.7, 0.2, 0.9], &[]);
    assert_eq!(y[0], y[1]);
    assert_close("torque", &y[..1], &[30.0 * (-0.2 + 0.4)], 1e-12);
}

/// The tip against a wall.
fn touching(wall: &str) -> Description {
    let keys = format!("frame = \"tip\"\nradius = 0.5\nstiffness = 100.0\nsmoothing = 0.01\nfriction = 0.3\n{wall}");
    servo().with(&compliance("contact", "wall", &keys))
}

/// A wall by name is the one by normal and point, which are written here from the numbers of the file.
#[test]
fn geoms_of_the_file_are_walls() {
    let (sin, cos) = 0.3_f64.sin_cos();
    let plane = format!("normal = [{sin:?}, 0.0, {cos:?}]\npoint = [0.1, 0.0, -0.2]");
    // The table is turned by 0.2 about x and then by 0.4 about the new z.
    let ((sx, cx), (sz, cz)) = (0.2_f64.sin_cos(), 0.4_f64.sin_cos());
    let top = format!("normal = [0.0, {:?}, {cx:?}]\npoint = [0.6, 0.1, 0.0]", -sx);
    let axis = [cz, cx * sz, sx * sz];
    let down = [0.0, -sx, cx];
    let at = [0.6, 0.1, 0.0];
    let point: Vec<f64> = (0..3).map(|i| at[i] - 0.1 * down[i] - 0.3 * axis[i]).collect();
    let side = format!("normal = [{:?}, {:?}, {:?}]\npoint = {point:?}", -axis[0], -axis[1], -axis[2]);
    let x = [0.3, -0.4, 0.1, 0.5, -0.7, 0.2, 0.5];
    for (geom, written) in [
        ("geom = \"floor\"", plane.clone()),
        ("geom = \"floor\"\nface = \"+z\"", plane),
        ("geom = \"block\"\nface = \"+z\"", top),
        ("geom = \"block\"\nface = \"-x\"", side),
    ] {
        let [found, expected] =
            [geom, &written].map(|wall| step(&touching(wall).problem(), &x, &[0.1, 0.2, 0.3, 0.4], &[]));
        assert_close(geom, &found, &expected, 1e-12);
        let free = step(&servo().problem(), &x[..6], &[0.1, 0.2, 0.3, 0.4], &[]);
        assert_ne!(found[..6], free[..], "{geom} does not touch");
    }
}

#[test]
fn wrong_actuators() {
    let actuated = |name: &str| servo().with(&format!("actuated = [\"{name}\"]\n"));
    let drive = |text: &str| servo().with(&format!("[model.drives.{text}\n"));
    assert_errors(vec![
        (
            actuated("cable"),
            "task.toml:4:12: model.actuated: actuator `cable` of the robot's file (line 30) is not supported: it acts on a \
             tendon, `cable`; only actuators of joints are supported (list the joints to be driven instead)",
        ),
        (
            actuated("sero"),
            "task.toml:4:12: model.actuated: the robot has no moving joint `sero`: it has `shoulder`, `elbow`, `slide`; its \
             file has the actuators `motor`, `servo`, `speed`, `affine`",
        ),
        (
            servo().with("actuated = [\"servo\", \"servo\"]\n"),
            "task.toml:4:12: model.actuated: actuator `servo` occurs twice",
        ),
        (
            drive("motor]\nkp = 3.0"),
            "task.toml:5:6: model.drives.motor.kp: only position actuators have it; `motor` is an actuator of kind motor",
        ),
        (
            drive("affine]\nkv = 3.0"),
            "task.toml:5:6: model.drives.affine.kv: only position and velocity actuators have it; `affine` is an actuator \
             of kind affine",
        ),
        (drive("servo]\nkp = -3.0"), "task.toml:5:6: model.drives.servo.kp: must be at least 0; found -3"),
        (
            drive("servo]\ngear = 0.0"),
            "task.toml:5:8: model.drives.servo.gear: must not be 0: the drive would have no effect",
        ),
        (
            drive("elbow]\ngear = 2.0"),
            "task.toml:4:1: model.drives.elbow: joint `elbow` is driven by the actuator `servo`: use `[model.drives.servo]`",
        ),
    ]);
}

#[test]
fn wrong_sensors_of_the_file() {
    let file = |name: &str| servo().sensing(&sensor("file", &format!("select = [{name}]\nvariance = 1.0")));
    assert_errors(vec![
        (
            file("\"angel\""),
            "task.toml:6:10: model.sensors[0].select: the robot file has no sensor `angel`: it has `angle`, `rate`, \
             `place`, `turn`, `torque` (did you mean `angle`?)",
        ),
        (
            file("\"touch\""),
            "task.toml:6:10: model.sensors[0].select: sensor `touch` of the robot's file (line 38) is not supported: sensors \
             of kind `touch` are not supported (supported sensors: it has `angle`, `rate`, `place`, `turn`, `torque`)",
        ),
        (
            file("\"torque\""),
            "task.toml:6:10: model.sensors[0].select: the torque of joint `elbow` cannot be measured: the joint is rigid \
             (add compliance of kind \"elastic_joint\" to it)",
        ),
        (file(""), "task.toml:6:10: model.sensors[0].select: name at least one"),
    ]);
}

#[test]
fn wrong_walls() {
    assert_errors(vec![
        (
            touching(""),
            "task.toml:4:1: model.compliance[0].normal: is missing: give `normal`, or name a `geom` of the robot file",
        ),
        (
            touching("geom = \"flor\""),
            "task.toml:12:8: model.compliance[0].geom: the robot has no fixed plane or box `flor`: it has \
             `floor`, `block` (did you mean `floor`?)",
        ),
        (
            touching("geom = \"floor\"\nnormal = [0.0, 0.0, 1.0]"),
            "task.toml:13:10: model.compliance[0].normal: the wall is already defined by `geom = floor` (remove `normal` or `geom`)",
        ),
        (
            touching("point = [0.0, 0.0, 1.0]\ngeom = \"floor\""),
            "task.toml:12:9: model.compliance[0].point: the wall is already defined by `geom = floor` (remove `point` or `geom`)",
        ),
        (
            touching("geom = \"block\""),
            "task.toml:4:1: model.compliance[0].face: is missing: `block` is a box; valid: `+x`, `-x`, `+y`, `-y`, `+z`, \
             `-z` (the face in contact with the robot, in the box frame)",
        ),
        (
            touching("geom = \"floor\"\nface = \"-z\""),
            "task.toml:13:8: model.compliance[0].face: `floor` is a plane; its only face is `+z`",
        ),
        (
            touching("normal = [0.0, 0.0, 1.0]\nface = \"-z\""),
            "task.toml:13:8: model.compliance[0].face: requires `geom`, a box of the robot file",
        ),
    ]);
}
