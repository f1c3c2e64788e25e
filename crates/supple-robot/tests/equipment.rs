//! Actuators, sensors, keyframes and walls of MJCF files, and files that include others: against what MuJoCo makes of
//! them, and what is left out with which reason.
#![allow(clippy::unwrap_used, clippy::expect_used)]

use std::path::{Path, PathBuf};

use serde_json::Value;
use supple_robot::*;

const TOLERANCE: f64 = 1e-12;

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data_equipment")
}

fn arm(independent_mimic: bool) -> (Robot, Value) {
    let options = LoadOptions { independent_mimic, ..LoadOptions::default() };
    let robot = load(folder().join("arm.xml"), &options).unwrap_or_else(|error| panic!("{error}"));
    let golden = std::fs::read_to_string(folder().join("arm.json")).unwrap();
    (robot, serde_json::from_str(&golden).unwrap())
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|entry| entry.as_f64().unwrap()).collect()
}

#[track_caller]
fn assert_close(what: &str, found: &[f64], expected: &[f64]) {
    assert_eq!(found.len(), expected.len(), "{what}");
    let largest = expected.iter().fold(1.0, |largest: f64, entry| largest.max(entry.abs()));
    for (a, b) in found.iter().zip(expected) {
        assert!((a - b).abs() <= TOLERANCE * largest, "{what}: {found:?} instead of {expected:?}");
    }
}

/// Names of the actuators that are kept, each with its place in the file, and those without a name with that of their
/// joint or their number.
const KEPT: [(&str, usize); 10] = [
    ("shoulder_motor", 0),
    ("elbow_servo", 1),
    ("elbow_stiff", 2),
    ("slide", 3),
    ("affine", 4),
    ("servo_too", 5),
    ("inherits", 6),
    ("actuator7", 7),
    ("plain", 8),
    ("by_ratio", 12),
];

fn force(law: Law, u: f64, length: f64, rate: f64) -> f64 {
    match law {
        Law::Motor { gain } => gain * u,
        Law::Position { kp, kv } => kp * (u - length) - kv * rate,
        Law::Velocity { kv } => kv * (u - rate),
        Law::Affine { gain, offset, kp, kv } => gain * u + offset - kp * length - kv * rate,
    }
}

#[test]
fn actuators_exert_the_forces_that_mujoco_computes() {
    let (robot, golden) = arm(false);
    let names: Vec<_> = robot.actuators.iter().map(|actuator| actuator.name.as_str()).collect();
    assert_eq!(names, KEPT.map(|(name, _)| name));
    let joints: Vec<_> = golden["joints"].as_array().unwrap().iter().map(|name| name.as_str().unwrap()).collect();
    for (actuator, (name, place)) in robot.actuators.iter().zip(KEPT) {
        let expected = &golden["actuators"][place];
        let joint = &robot.joints[actuator.joint].name;
        assert_eq!(joint, expected["joint"].as_str().unwrap(), "{name}");
        assert_eq!(actuator.gear, expected["gear"].as_f64().unwrap(), "{name}");
        for (range, key) in [(actuator.control, "control"), (actuator.force, "force")] {
            match &expected[key] {
                Value::Null => assert_eq!(range, [f64::NEG_INFINITY, f64::INFINITY], "{name}, {key}"),
                found => assert_close(name, &range, &numbers(found)),
            }
        }
        let at = joints.iter().position(|other| other == joint).unwrap();
        for case in golden["cases"].as_array().unwrap() {
            let [q, v, u] = [("q", at), ("v", at), ("u", place)].map(|(key, i)| case[key][i].as_f64().unwrap());
            let u = u.clamp(actuator.control[0], actuator.control[1]);
            let found = force(actuator.law, u, actuator.gear * q, actuator.gear * v);
            let found = found.clamp(actuator.force[0], actuator.force[1]);
            assert_close(name, &[found], &[case["force"][place].as_f64().unwrap()]);
        }
    }
}

#[test]
fn general_actuators_are_the_simplest_kind_that_they_can_be() {
    let (robot, _) = arm(false);
    let kind = |name: &str| robot.actuator(name).unwrap().law;
    assert_eq!(kind("servo_too"), Law::Position { kp: 20.0, kv: 2.0 });
    assert_eq!(kind("affine"), Law::Affine { gain: 4.0, offset: 0.5, kp: 3.0, kv: 0.25 });
    assert_eq!(kind("slide"), Law::Velocity { kv: 7.0 });
    assert_eq!(kind("actuator7"), Law::Motor { gain: 1.0 });
}

/// Armature and damping of an actuator act at its joint, and the total mass scales masses: both are in the mass matrix.
#[test]
fn inertia_of_actuators_and_the_total_mass_are_those_of_mujoco() {
    let (robot, golden) = arm(true);
    let mass: f64 = robot.links.iter().filter_map(|link| link.inertia).map(|inertia| inertia.mass).sum();
    assert_close("total mass", &[mass], &[golden["total_mass"].as_f64().unwrap()]);
    let tree = Tree::new(&robot);
    assert_eq!(tree.joints(), ["shoulder", "elbow", "slide", "follower"]);
    let numbers_of = Numbers::of(&robot, [0.0, 0.0, -9.81]);
    let q: Vec<f64> = robot.keys[2].q(&tree);
    let kinematics = Kinematics::of(&tree, &numbers_of, &q, &[0.0; 4]);
    let expected: Vec<f64> = golden["mass"].as_array().unwrap().iter().flat_map(numbers).collect();
    assert_close("mass matrix", &mass_matrix(&tree, &numbers_of, &kinematics).concat(), &expected);
    assert_close("damping", &[robot.joints[robot.joint("slide").unwrap()].damping], &[9.0 * 0.05]);
}

#[test]
fn what_cannot_be_modelled_is_left_out_with_its_reason() {
    let (robot, _) = arm(false);
    let found: Vec<_> = robot
        .omitted
        .iter()
        .map(|left| format!("{} {}, line {}: {}", left.what, left.name, left.line, left.why))
        .collect();
    let expected = [
        "actuator cable, line 31: it acts on a tendon, `cable`; only actuators of joints are supported",
        "actuator integrated, line 32: actuators of kind `intvelocity` are not supported",
        "actuator filtered, line 33: its control is filtered: only actuators whose force follows the control at once are supported",
        "actuator follower, line 35: its joint `follower` follows `elbow`: drive that one",
        "sensor geared, line 41: the gear of actuator `shoulder_motor` is not 1: measure its joint",
        "sensor upper_center, line 45: it is about the body's centre of mass and principal axes; `objtype` \"xbody\" or \"site\" is supported",
        "sensor tip_from_table, line 46: it measures relative to `table`; only measurements in the world frame are supported",
        "sensor touch, line 47: sensors of kind `touch` are not supported",
        "sensor sensor10, line 48: sensors of kind `touch` are not supported",
        "sensor gyro, line 49: sensors of kind `gyro` are not supported",
    ];
    assert_eq!(found, expected);
    for (warning, count) in [
        (
            "actuator `cable` is left out: it acts on a tendon, `cable`; only actuators of joints are supported (line 31)",
            1,
        ),
        ("`touch` elements are ignored (2 of them, first at line 47)", 1),
        ("element `gyro` is ignored (line 49)", 1),
    ] {
        let found = robot.warnings.iter().filter(|found| found.ends_with(warning)).count();
        assert_eq!(found, count, "{warning} in {:?}", robot.warnings);
    }
}

#[test]
fn sensors_are_those_of_joints_and_frames() {
    let (robot, _) = arm(false);
    let joint = |name: &str| robot.joint(name).unwrap();
    let site = robot.links.len() + robot.frames.iter().position(|frame| frame.name == "tip").unwrap();
    let expected = [
        ("elbow_angle", Measured::JointPosition(joint("elbow")), 0.01),
        ("elbow_rate", Measured::JointVelocity(joint("elbow")), 0.0),
        ("slide_place", Measured::JointPosition(joint("slide")), 0.0),
        ("elbow_torque", Measured::JointTorque(joint("elbow")), 0.0),
        ("tip_place", Measured::FramePosition(site), 0.0),
        ("fore_turn", Measured::FrameOrientation(robot.link("fore").unwrap()), 0.0),
    ];
    let found: Vec<_> =
        robot.sensors.iter().map(|sensor| (sensor.name.as_str(), sensor.measures, sensor.noise)).collect();
    assert_eq!(found, expected);
}

#[test]
fn keyframes_are_those_of_mujoco() {
    for independent in [false, true] {
        let (robot, golden) = arm(independent);
        let joints: Vec<_> = golden["joints"].as_array().unwrap().iter().map(|name| name.as_str().unwrap()).collect();
        let names: Vec<_> = robot.keys.iter().map(|key| key.name.as_str()).collect();
        assert_eq!(names, ["home", "key1", "rest"]);
        for (key, expected) in robot.keys.iter().zip(golden["keys"].as_array().unwrap()) {
            let [q, v, u] = ["q", "v", "u"].map(|name| numbers(&expected[name]));
            for (place, joint) in joints.iter().enumerate() {
                let at = robot.joint(joint).unwrap();
                assert_close(joint, &[key.positions[at], key.velocities[at]], &[q[place], v[place]]);
            }
            // The follower of the other joint has an actuator that is kept only where it follows none.
            let kept = KEPT.into_iter().map(|(_, place)| place).chain(independent.then_some(13));
            let expected: Vec<_> = kept.map(|place| u[place]).collect();
            assert_close(&key.name, &key.controls, &expected);
        }
        let tree = Tree::new(&robot);
        let home = robot.key("home").unwrap();
        let count = if independent { 4 } else { 3 };
        assert_eq!(home.q(&tree), [0.1, -0.2, 0.35, 0.4][..count]);
        assert_eq!(home.v(&tree), [1.0, 2.0, 3.0, 4.0][..count]);
    }
}

#[test]
fn walls_are_where_mujoco_has_them() {
    let (robot, golden) = arm(false);
    let names: Vec<_> = robot.walls.iter().map(|wall| wall.name.as_str()).collect();
    assert_eq!(names, ["floor", "top", "post"]);
    for expected in golden["walls"].as_array().unwrap() {
        let name = expected["name"].as_str().unwrap();
        let wall = robot.wall(name).unwrap();
        assert_close(name, &wall.pose.position, &numbers(&expected["position"]));
        assert_close(name, &wall.pose.rotation.concat(), &numbers(&expected["rotation"]));
        match wall.shape {
            WallShape::Plane => assert_eq!(name, "floor"),
            WallShape::Box(halves) => assert_close(name, &halves, &numbers(&expected["size"])),
        }
    }
}

#[test]
fn faces_are_on_the_outside() {
    let (robot, _) = arm(false);
    let floor = robot.wall("floor").unwrap();
    let up = floor.pose.rotation.map(|row| row[2]);
    assert_eq!(floor.face(2, false), Some((up, floor.pose.position)));
    assert_eq!(floor.face(2, true), None);
    assert_eq!(floor.face(0, false), None);
    let top = robot.wall("top").unwrap();
    for (axis, half) in [(0, 0.3), (1, 0.2), (2, 0.02)] {
        for (negative, sign) in [(false, 1.0), (true, -1.0)] {
            let (normal, point) = top.face(axis, negative).unwrap();
            let mut local = [0.0; 3];
            local[axis] = sign * half;
            assert_close("point", &point, &top.pose.apply(local));
            local[axis] = sign;
            assert_close("normal", &normal, &top.pose.rotate(local));
        }
    }
    assert_eq!(top.face(3, false), None);
}

#[test]
fn included_files_are_listed_and_named_in_errors_and_warnings() {
    let (robot, _) = arm(false);
    let files = ["parts/settings.xml", "parts/links.xml", "parts/fore.xml"];
    assert_eq!(robot.included, files.map(|file| folder().join(file)));
}

/// A folder of files for one test, removed at the end.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str, files: &[(&str, &str)]) -> Self {
        let path = std::env::temp_dir().join(format!("supple-include-{name}-{}", std::process::id()));
        for (file, text) in files {
            let file = path.join(file);
            std::fs::create_dir_all(file.parent().unwrap()).unwrap();
            std::fs::write(file, text).unwrap();
        }
        Self(path)
    }

    /// The robot in `robot.xml`, or the error without the folder.
    fn load(&self, roots: &[&str]) -> Result<Robot, String> {
        let package_roots = roots.iter().map(|root| self.0.join(root)).collect();
        let options = LoadOptions { package_roots, ..LoadOptions::default() };
        let text = |text: String| text.replace(&format!("{}/", self.0.display()), "");
        load(self.0.join("robot.xml"), &options)
            .map_err(|error| text(error.to_string()))
            .map(|robot| Robot { warnings: robot.warnings.into_iter().map(text).collect(), ..robot })
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        drop(std::fs::remove_dir_all(&self.0));
    }
}

const BODY: &str = "<body name='a'><joint name='j'/><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/></body>";

#[test]
fn errors_and_warnings_of_an_included_file_name_it() {
    let main = "<mujoco><worldbody>\n<include file='in/b.xml'/></worldbody></mujoco>";
    let wrong = Folder::new("wrong", &[("robot.xml", main), ("in/b.xml", "<x>\n<body name='b' pos='1 2'/></x>")]);
    assert_eq!(wrong.load(&[]).unwrap_err(), "in/b.xml:2:21: body `b`: `pos` must be 3 numbers, but has 2: `1 2`");
    let broken = Folder::new("broken", &[("robot.xml", main), ("in/b.xml", "<x>\n<body></x>")]);
    let error = broken.load(&[]).unwrap_err();
    assert!(error.starts_with("in/b.xml:2:"), "{error}");
    let twice = format!("<x>\n{BODY}{BODY}</x>");
    let twice = Folder::new("names", &[("robot.xml", main), ("in/b.xml", &twice)]);
    let error = twice.load(&[]).unwrap_err();
    assert!(error.starts_with("in/b.xml:2:") && error.contains("at line 2 of `"), "{error}");
    let odd = format!("<x>\n{BODY}<camera/></x>");
    let odd = Folder::new("warning", &[("robot.xml", main), ("in/b.xml", &odd)]);
    assert_eq!(odd.load(&[]).unwrap().warnings, ["element `camera` is ignored (line 2 of `in/b.xml`)"]);
}

#[test]
fn files_are_included_once_and_within_the_folder() {
    let main = |file: &str| format!("<mujoco><worldbody>\n<include file='{file}'/></worldbody></mujoco>");
    let circle =
        Folder::new("circle", &[("robot.xml", &main("b.xml")), ("b.xml", "<x>\n<include file='robot.xml'/></x>")]);
    assert_eq!(
        circle.load(&[]).unwrap_err(),
        "b.xml:2:16: include: file `robot.xml` is included twice; each may be included once"
    );
    let missing = Folder::new("missing", &[("robot.xml", &main("b.xml"))]);
    assert_eq!(
        missing.load(&[]).unwrap_err(),
        "robot.xml:2:16: include: the included file `b.xml` does not exist (files are looked for in the folder of the \
         outermost file, and in that of the file that includes them)"
    );
    let text = format!("<x>{BODY}</x>");
    let out =
        Folder::new("outside", &[("robot.xml", "<mujoco/>"), ("b.xml", &text), ("in/robot.xml", &main("../b.xml"))]);
    let inner = Folder(out.0.join("in"));
    assert_eq!(
        inner.load(&[]).unwrap_err(),
        "robot.xml:2:16: include: the included file `../b.xml` leads out of the robot file's folder (name a folder that \
         holds all files as a package root: `package_roots`)"
    );
    assert_eq!(inner.load(&[".."]).unwrap().joints.len(), 1);
    let nested = Folder::new(
        "nested",
        &[("robot.xml", &main("in/b.xml")), ("in/b.xml", "<x><include file='c.xml'/></x>"), ("in/c.xml", &text)],
    );
    assert_eq!(nested.load(&[]).unwrap().joints[0].name, "j");
}

#[test]
fn files_inside_files_end() {
    let mut files = vec![("robot.xml".to_owned(), "<mujoco><worldbody/><include file='f0.xml'/></mujoco>".to_owned())];
    files.extend((0..60).map(|i| (format!("f{i}.xml"), format!("<x><include file='f{}.xml'/></x>", i + 1))));
    files.push(("f60.xml".to_owned(), "<x/>".to_owned()));
    let files: Vec<_> = files.iter().map(|(name, text)| (name.as_str(), text.as_str())).collect();
    let error = Folder::new("deep", &files).load(&[]).unwrap_err();
    assert!(error.ends_with("at most 1000 files are included, and at most 50 inside one another"), "{error}");
}
