//! Joints that a task takes out of its robot.

use crate::robot::arm::{Description, arm, compliance, cost, sensor, step};
use crate::robot::bad_tasks::assert_errors;

/// The arm with `locked` as given, without what names its joints.
fn locked(list: &str) -> Description {
    let mut description = arm()
        .with(&format!("locked = {list}\n"))
        .sensing(&sensor("joint_position", "select = [\"shoulder\"]\nvariance = 1e-3"))
        .costing(&cost("control", "weight = 0.01"));
    description.start = String::new();
    description
}

#[test]
fn a_locked_joint_is_no_state_and_no_control() {
    let problem = locked("[\"elbow\"]").problem();
    let size = problem.tasks[0].system.dimensions();
    assert_eq!((size.states, size.controls), (4, 2));
    let names: Vec<_> = problem.tasks[0].system.channels().states.into_iter().map(|channel| channel.name).collect();
    assert_eq!(names, ["q.shoulder", "q.slide", "v.shoulder", "v.slide"]);
}

/// The whole arm whose elbow is held by a spring that hardly yields moves as the arm whose elbow is locked.
#[test]
fn a_locked_joint_is_one_held_by_a_stiff_spring() {
    let locked = locked("{ elbow = 0.7 }").explicit().problem();
    let spring = compliance("spring", "hold", "joint = \"elbow\"\nstiffness = 1e9\nrest = 0.7");
    let mut held = arm().explicit().with(&spring);
    held.time_step = "1e-6".into();
    let held = held.problem();
    let tau = [3.0, -2.0];
    let own = step(&locked, &[0.2, 0.05, 0.4, 0.1], &tau, &[]);
    let dt = 0.02;
    let accelerations = [(own[2] - 0.4) / dt, (own[3] - 0.1) / dt];
    // Averaged over many periods of the spring, the elbow does not accelerate.
    let (mut x, count) = (vec![0.2, 0.7, 0.05, 0.4, 0.0, 0.1], 2000);
    for _ in 0..count {
        x = step(&held, &x, &[tau[0], 0.0, tau[1]], &[]);
    }
    let time = count as f64 * 1e-6;
    for (found, expected) in [(x[3] - 0.4) / time, (x[5] - 0.1) / time].into_iter().zip(accelerations) {
        assert!((found - expected).abs() < 0.02 * expected.abs().max(1.0), "{found} and {expected}");
    }
}

#[test]
fn a_list_locks_joints_where_they_start() {
    let mut description = locked("[\"elbow\", \"slide\"]");
    description.model = description.model.replace("arm.urdf", "stops.urdf");
    let (listed, mut tabled) = (description.problem(), description);
    tabled.model = tabled.model.replace("[\"elbow\", \"slide\"]", "{ elbow = 1.5, slide = 0.2 }");
    let x = [0.3, 0.5];
    assert_eq!(step(&listed, &x, &[2.0], &[]), step(&tabled.problem(), &x, &[2.0], &[]));
}

#[test]
fn lists_that_cannot_be() {
    assert_errors(vec![
        (
            locked("[\"elbo\"]"),
            "task.toml:4:11: model.locked[0]: the robot has no moving joint `elbo`: it has `shoulder`, `elbow`, `slide` \
             (did you mean `elbow`?)",
        ),
        (locked("[\"elbow\", \"elbow\"]"), "task.toml:4:20: model.locked[1]: joint `elbow` occurs twice"),
        (
            locked("[\"flange\"]"),
            "task.toml:4:11: model.locked[0]: joint `flange` is fixed in the robot's file (take it out of `locked`)",
        ),
        (
            locked("[\"shoulder\", \"elbow\", \"slide\"]"),
            "task.toml:4:10: model.locked: all moving joints are locked; there is nothing to control (leave out one of \
             `shoulder`, `elbow`, `slide`)",
        ),
        (
            locked("{ elbow = inf }"),
            "task.toml:4:20: model.locked.elbow: must be a finite position, rad or m; found inf",
        ),
        (
            locked("\"elbow\""),
            "task.toml:4:10: model.locked: must be a list of joints, or a table of their positions by name; found \
             \"elbow\"",
        ),
        (
            locked("{ elbow = \"bent\" }").where_(&[("bent", 0.5)]),
            "task.toml:7:20: model.locked.elbow: must be a number; found \"bent\"",
        ),
    ]);
}

#[test]
fn positions_out_of_range_are_warned_of() {
    for (list, warning) in [
        (
            "{ elbow = 2.6 }",
            Some("task.toml:4:20: model.locked.elbow: joint `elbow` is locked at 2.6, outside its range [-2.5, 2.5]"),
        ),
        (
            "{ elbow = 90 }",
            Some(
                "task.toml:4:20: model.locked.elbow: joint `elbow` is locked at 90, outside its range [-2.5, 2.5] (angles \
                 are in rad: 90 degrees are 1.5708 rad)",
            ),
        ),
        (
            "{ slide = 50 }",
            Some("task.toml:4:20: model.locked.slide: joint `slide` is locked at 50, outside its range [-0.2, 0.3]"),
        ),
        ("{ elbow = 2.5 }", None),
        ("[\"elbow\"]", None),
    ] {
        let problem = locked(list).problem();
        let found: Vec<_> =
            problem.warnings.iter().filter(|text| text.contains("locked")).map(String::as_str).collect();
        let found: Vec<_> = found.iter().map(|text| text.trim_start_matches("tests/data/")).collect();
        assert_eq!(found, warning.into_iter().collect::<Vec<_>>(), "{list}");
    }
}

#[test]
fn uses_of_a_locked_joint() {
    let said = |place: &str| {
        format!(
            "task.toml:{place}: joint `elbow` is locked: it does not move (take `elbow` out of `locked` in [model])"
        )
    };
    let cases = [
        (locked("[\"elbow\"]").with("actuated = [\"elbow\"]\n"), "5:12: model.actuated"),
        (locked("[\"elbow\"]").with("[model.drives.elbow]\ngear = 2.0\n"), "5:1: model.drives.elbow"),
        (
            locked("[\"elbow\"]").with(&compliance("spring", "return", "joint = \"elbow\"\nstiffness = 1.0")),
            "8:9: model.compliance[0].joint",
        ),
        (
            locked("[\"elbow\"]").sensing(&sensor("joint_position", "select = [\"elbow\"]\nvariance = 1.0")),
            "7:10: model.sensors[0].select",
        ),
        (
            locked("[\"elbow\"]").costing(&cost("joint_position", "select = [\"elbow\"]\nweight = 1.0")),
            "19:10: tasks[0].costs[0].select",
        ),
        (
            locked("[\"elbow\"]").costing(&cost("state", "select = [\"v.elbow\"]\nweight = 1.0")),
            "19:10: tasks[0].costs[0].select",
        ),
        (
            Description { start: "\"q.elbow\" = 0.1\n".into(), ..locked("[\"elbow\"]") },
            "14:13: tasks[0].initial_state.\"q.elbow\"",
        ),
    ];
    let cases: Vec<_> = cases.into_iter().map(|(description, place)| (description, said(place))).collect();
    assert_errors(cases.iter().map(|(description, said)| (description.clone(), said.as_str())).collect());
}

#[test]
fn locked_joints_that_move_nothing_make_a_robot_that_can_be_planned() {
    let mut description =
        locked("[\"second\"]").sensing(&sensor("joint_position", "select = [\"first\"]\nvariance = 1.0"));
    description.model = description.model.replace("arm.urdf", "massless.urdf");
    assert_eq!(description.problem().tasks[0].system.dimensions().states, 2);
    // The advice keeps what is locked already.
    let list = arm().with("locked = [\"elbow\"]\n[model.links.tip]\nmass = 0.0\ninertia_scale = 0.0\n");
    let table = arm().with("locked = { elbow = 0.5 }\n[model.links.tip]\nmass = 0.0\ninertia_scale = 0.0\n");
    let said = |line: &str| {
        format!(
            "task.toml:3:8: model.file: joint `slide` moves no inertia, so its acceleration is undefined (write `{line}` in [model] to take them out, or give their drives a `rotor_inertia`)"
        )
    };
    let only_shoulder = sensor("joint_position", "select = [\"shoulder\"]\nvariance = 1e-3");
    assert_errors(vec![
        (list.sensing(&only_shoulder), &said("locked = [\"elbow\", \"slide\"]")),
        (table.sensing(&only_shoulder), &said("locked = { elbow = 0.5, slide = 0.0 }")),
    ]);
}

#[test]
fn elements_that_could_do_nothing() {
    let zeros = "stiffness = [1.0, 1.0, 1.0]\ndamping = [1.0, 1.0, 1.0]\ntorsional_stiffness = [1.0, 1.0, 1.0]\n\
                 torsional_damping = [1.0, 1.0, 1.0]";
    let bushing = |a: &str, c: &str| {
        arm().with(&compliance("bushing", "soft", &format!("frame_a = \"{a}\"\nframe_c = \"{c}\"\n{zeros}")))
    };
    let contact =
        compliance("contact", "wall", "frame = \"base\"\nnormal = [0.0, 0.0, 1.0]\nstiffness = 1e4\nsmoothing = 1e-3");
    assert_errors(vec![
        (
            bushing("tip", "tool"),
            "task.toml:8:11: model.compliance[0].frame_c: frames `tip` and `tool` cannot move relative to each other: no moving joint lies between them (choose frames on opposite sides of a joint)",
        ),
        (
            arm().with(&contact),
            "task.toml:7:9: model.compliance[0].frame: frame `base` cannot move: it is fixed to the world (name a frame \
             that a joint moves)",
        ),
    ]);
    let _ = bushing("base", "tool").problem();
}
