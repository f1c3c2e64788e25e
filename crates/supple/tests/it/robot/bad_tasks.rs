//! Wrong robots in task files: every error names file, line and key, what was found, and what is valid.

use crate::robot::arm::{Description, arm, compliance, cost, sensor};

/// The error of a task file, without its folder.
pub fn error_of(text: &str) -> String {
    match supple_file::parse(text, "tests/data/task.toml") {
        Ok(_) => panic!("no error in\n{text}"),
        Err(error) => error.to_string().replace("tests/data/", ""),
    }
}

/// Each wrong task file, and what is said of it.
pub fn assert_errors(cases: Vec<(Description, &str)>) {
    let mut wrong = Vec::new();
    for (description, expected) in cases {
        let found = error_of(&description.text());
        if found != expected {
            wrong.push(format!("{found}\n    instead of\n{expected}"));
        }
    }
    assert!(wrong.is_empty(), "\n{}", wrong.join("\n\n"));
}

fn spring(keys: &str) -> String {
    compliance("spring", "return", keys)
}

/// The arm with an elastic shoulder.
pub fn elastic() -> Description {
    let keys = "joint = \"shoulder\"\nstiffness = 30.0\nmotor_inertia = 0.05";
    arm().with(&compliance("elastic_joint", "flexible", keys))
}

pub fn contact(keys: &str) -> Description {
    let keys = format!("frame = \"tool\"\nstiffness = 1e4\nsmoothing = 1e-3\n{keys}");
    arm().with(&compliance("contact", "wall", &keys))
}

fn robot(file: &str) -> Description {
    let mut description = arm();
    description.model = format!("file = \"{file}\"\n");
    description
}

/// Two joints, of which the second moves a hand without inertia.
fn massless() -> Description {
    let mut description =
        robot("massless.urdf").sensing(&sensor("joint_position", "select = [\"first\"]\nvariance = 1.0"));
    description.start = String::new();
    description.costing(&cost("control", "weight = 1.0"))
}

#[test]
fn robot_files() {
    assert_errors(vec![
        (
            robot("arn.urdf"),
            "task.toml:3:8: model.file: arn.urdf: cannot be read: No such file or directory (os error 2)",
        ),
        (
            robot("broken.urdf"),
            "broken.urdf:3:29: joint `first`: type `hinge` is not a type of joint; valid: `fixed`, \
             `revolute`, `continuous`, `prismatic`",
        ),
        (robot("fixed.urdf"), "task.toml:3:8: model.file: the robot has no joint that moves"),
        (
            massless(),
            "task.toml:3:8: model.file: joint `second` moves no inertia, so its acceleration is undefined (write `locked = [\"second\"]` in [model] to take them out, or give their drives a \
             `rotor_inertia`)",
        ),
        (
            arm().with("[model.links.tip]\nmass = 0.0\ninertia_scale = 0.0\n"),
            "task.toml:3:8: model.file: joint `slide` moves no inertia, so its acceleration is undefined (write `locked = [\"slide\"]` in [model] to take them out, or give their drives a \
             `rotor_inertia`)",
        ),
        (Description { model: String::new(), ..arm() }, "task.toml:1:1: model.file: is missing"),
        (
            robot("arm.urdf\"\nfolder = \"x"),
            "task.toml:4:1: model.folder: unknown key `folder`; valid: `file`, `package_roots`, \
             `independent_mimic`, `gravity`, `actuated`, `locked`, `insert`, `file_actuators`, `drives`, `links`, `joints`, `frames`, \
             `friction_smoothing`, `integrator`, `substeps`, `compliance`, `sensors` (did you mean `file`?)",
        ),
    ]);
}

/// What moves no link may still move its motor.
#[test]
fn inertia_of_a_rotor_is_inertia() {
    let _ = massless().with("[model.drives.second]\ngear = 10.0\nrotor_inertia = 1e-4\n").problem();
    let _ = massless().with("[model.joints.second]\narmature = 1e-2\n").problem();
}

#[test]
fn numbers_of_the_robot() {
    assert_errors(vec![
        (arm().with("substeps = 0\n"), "task.toml:4:12: model.substeps: must be from 1 to 1000; found 0"),
        (arm().with("substeps = 2000\n"), "task.toml:4:12: model.substeps: must be from 1 to 1000; found 2000"),
        (arm().with("gravity = [0.0, -9.81]\n"), "task.toml:4:11: model.gravity: must be a list of 3; found 2"),
        (
            arm().with("friction_smoothing = 0.0\n"),
            "task.toml:4:22: model.friction_smoothing: must be above 0; found 0",
        ),
        (
            arm().with("[model.links.for]\nmass = 1.0\n"),
            "task.toml:4:1: model.links.for: the robot has no link `for`: it has `base`, `upper`, `fore`, \
             `tip`, `tool` (did you mean `fore`?)",
        ),
        (
            arm().with("[model.links.fore]\nmass = -1.0\n"),
            "task.toml:5:8: model.links.fore.mass: must be at least 0; found -1",
        ),
        (
            arm().with("[model.links.fore]\nmas = 1.0\n"),
            "task.toml:5:1: model.links.fore.mas: unknown key `mas`; valid: `mass`, `inertia_scale`, \
             `center` (did you mean `mass`?)",
        ),
        (
            arm().with("[model.joints.elbo]\ndamping = 1.0\n"),
            "task.toml:4:1: model.joints.elbo: the robot has no joint `elbo`: it has `shoulder`, `elbow`, \
             `slide`, `flange` (did you mean `elbow`?)",
        ),
        (
            arm().with("[model.joints.elbow]\nlength_scale = -1.0\n"),
            "task.toml:5:16: model.joints.elbow.length_scale: must be at least 0; found -1",
        ),
        (
            arm().with("[model.joints.elbow]\nstiffness = \"k\"\n"),
            "task.toml:5:13: model.joints.elbow.stiffness: parameter `k` is not declared: add a table \
             [parameters.k]",
        ),
        (
            arm().with("[model.frames.tool]\non = \"tip\"\n"),
            "task.toml:4:1: model.frames.tool: the robot already has a link or frame `tool`",
        ),
        (
            arm().with("[model.frames.grip]\non = \"tips\"\n"),
            "task.toml:5:6: model.frames.grip.on: the robot has no link or frame `tips`: it has `base`, \
             `upper`, `fore`, `tip`, `tool` (did you mean `tip`?)",
        ),
    ]);
}

#[test]
fn drives() {
    assert_errors(vec![
        (
            arm().with("actuated = [\"elbow\", \"elbow\"]\n"),
            "task.toml:4:12: model.actuated: joint `elbow` occurs twice",
        ),
        (
            arm().with("actuated = [\"elbow\", \"flange\"]\n"),
            "task.toml:4:12: model.actuated: the robot has no moving joint `flange`: it has `shoulder`, \
             `elbow`, `slide`",
        ),
        (
            arm().with("actuated = []\n"),
            "task.toml:4:12: model.actuated: name at least one joint: there must be a control",
        ),
        (
            arm().with("actuated = [\"elbow\"]\n[model.drives.slide]\ngear = 2.0\n"),
            "task.toml:5:1: model.drives.slide: joint `slide` is not actuated; actuated: `elbow`",
        ),
        (
            arm().with("[model.drives.slid]\ngear = 2.0\n"),
            "task.toml:4:1: model.drives.slid: the robot has no moving joint `slid`: it has `shoulder`, \
             `elbow`, `slide` (did you mean `slide`?)",
        ),
        (
            arm().with("[model.drives.slide]\ngear = 0.0\n"),
            "task.toml:5:8: model.drives.slide.gear: must not be 0: the drive would have no effect",
        ),
        (
            arm().with("[model.drives.slide]\nrotor_inertia = -0.1\n"),
            "task.toml:5:17: model.drives.slide.rotor_inertia: must be at least 0; found -0.1",
        ),
        (
            arm().with("[model.drives.slide]\nratio = 2.0\n"),
            "task.toml:5:1: model.drives.slide.ratio: unknown key `ratio`; valid: `gear`, `rotor_inertia`, `kp`, `kv`",
        ),
    ]);
}

#[test]
fn elements_of_compliance() {
    let plain = "joint = \"slide\"\nstiffness = 10.0";
    let bushing = "frame_a = \"base\"\nframe_c = \"tol\"\nstiffness = [1.0, 1.0, 1.0]\ndamping = [1.0, 1.0, 1.0]\n\
                   torsional_stiffness = [1.0, 1.0, 1.0]\ntorsional_damping = [1.0, 1.0, 1.0]";
    let mut soft = arm().with(&spring("joint = \"slide\"\nstiffness = \"k\""));
    soft.parameters = vec![("k", 0.0)];
    assert_errors(vec![
        (
            arm().with(&compliance("sprung", "return", plain)),
            "task.toml:5:8: model.compliance[0].kind: must be one of `bushing`, `contact`, `elastic_joint`, \
             `spring`; found `sprung` (did you mean `spring`?)",
        ),
        (
            arm().with(&format!("[[model.compliance]]\nkind = \"spring\"\n{plain}\n")),
            "task.toml:4:1: model.compliance[0].name: is missing",
        ),
        (
            arm().with(&spring("joint = \"slid\"\nstiffness = 10.0")),
            "task.toml:7:9: model.compliance[0].joint: the robot has no moving joint `slid`: it has `shoulder`, \
             `elbow`, `slide` (did you mean `slide`?)",
        ),
        (
            arm().with(&spring(plain)).with(&spring(plain)),
            "task.toml:11:8: model.compliance[1].name: the name `return` is already in use by another table of `compliance`",
        ),
        (
            arm().with(&compliance("spring", "tool", plain)),
            "task.toml:6:8: model.compliance[0].name: the name `tool` is already in use by a frame of the robot (choose \
             another, such as `tool_spring`)",
        ),
        (
            arm().with(&spring("joint = \"slide\"\nstiffness = -10.0")),
            "task.toml:8:13: model.compliance[0].stiffness: must be at least 0; found -10",
        ),
        (
            soft,
            "task.toml:11:13: model.compliance[0].stiffness: must be at least 0; its parameter can be as low as -0.1",
        ),
        (
            arm().with(&spring("joint = \"flange\"\nstiffness = 10.0")),
            "task.toml:7:9: model.compliance[0].joint: the robot has no moving joint `flange`: it has \
             `shoulder`, `elbow`, `slide`",
        ),
        (
            arm().with(&compliance("bushing", "gripper", bushing)),
            "task.toml:8:11: model.compliance[0].frame_c: the robot has no link or frame `tol`: it has `base`, \
             `upper`, `fore`, `tip`, `tool` (did you mean `tool`?)",
        ),
        (
            arm().with(&compliance(
                "bushing",
                "gripper",
                &bushing.replace("tol", "tool").replacen("[1.0, 1.0, 1.0]", "[1.0, 1.0]", 1),
            )),
            "task.toml:9:13: model.compliance[0].stiffness: must be a list of 3; found 2",
        ),
        (
            elastic().with(&compliance(
                "elastic_joint",
                "second",
                "joint = \"shoulder\"\nstiffness = 1.0\nmotor_inertia = 0.1",
            )),
            "task.toml:13:9: model.compliance[1].joint: joint `flexible` is already elastic (`shoulder`)",
        ),
        (
            arm().with(&compliance(
                "elastic_joint",
                "flexible",
                "joint = \"elbow\"\nstiffness = 1.0\nmotor_inertia = 0.0",
            )),
            "task.toml:9:17: model.compliance[0].motor_inertia: must be above 0; found 0",
        ),
        (
            contact("normal = [0.0, 0.0, 0.0]"),
            "task.toml:10:10: model.compliance[0].normal: must be non-zero; found [0.0, 0.0, 0.0]",
        ),
        (
            contact("normal = [0.0, 0.0, 1.0]\nradius = -0.1"),
            "task.toml:11:10: model.compliance[0].radius: must be at least 0; found -0.1",
        ),
        (
            contact("normal = [0.0, 0.0, 1.0]\nslip = 0.1"),
            "task.toml:11:8: model.compliance[0].slip: has no effect without friction (give `friction`, or leave out `slip`)",
        ),
        (
            contact("normal = [0.0, 0.0, 1.0]\nslip = 0.0\nfriction = 0.1"),
            "task.toml:11:8: model.compliance[0].slip: must be above 0; found 0 (the speed over which friction builds up, m/s: \
             such as 0.01, the default)",
        ),
        (
            contact("normal = [0.0, \"n\", 1.0]").where_(&[("n", 1.0)]),
            "task.toml:13:16: model.compliance[0].normal[1]: must be a number; found \"n\"",
        ),
        (
            contact(""),
            "task.toml:4:1: model.compliance[0].normal: is missing: give `normal`, or name a `geom` of the robot file",
        ),
    ]);
}
