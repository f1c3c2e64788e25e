//! Task files that `supple new` writes for robots: they run, converge, and touch what they should.
#![allow(clippy::unwrap_used)]

mod common;

use common::{Folder, repository};
use serde_json::Value;

const TEMPLATES: [&str; 6] = ["press", "wipe", "insert", "reach", "hold", "handle"];
const ARM: &str = include_str!("../templates/arm.urdf");

/// Writes a task and evaluates it: its text, and the result.
fn written(folder: &Folder, name: &str, words: &[&str]) -> (String, Value) {
    let run = folder.run(&[&["new", name][..], words].concat());
    assert_eq!(run.code, Some(0), "{words:?}: {}", run.stderr);
    let file = format!("{name}.toml");
    let run = folder.run(&["evaluate", &file, "--json", "--rollouts", "0"]);
    let text = std::fs::read_to_string(folder.path(&file)).unwrap();
    assert_eq!(run.code, Some(0), "{}\n{text}", run.stderr);
    (text, serde_json::from_str(&run.stdout).unwrap())
}

fn assert_good(text: &str, found: &Value) {
    let task = &found["tasks"][0];
    assert_eq!(task["status"], "converged", "{text}");
    assert_eq!(found["feasible"], true, "{text}");
    for contact in task["contacts"].as_array().unwrap() {
        assert_eq!(contact["touches"], true, "{contact}\n{text}");
    }
    // Below what the task costs without the sensor, so that the sensor is needed.
    let (bound, [precise, coarse]) = (task["cost"]["bound"].as_f64().unwrap(), common::costs(text));
    assert!(precise < bound && bound < coarse.max(1.02 * precise), "{bound} between {precise} and {coarse}");
}

#[test]
fn every_template_runs_for_the_shipped_arm() {
    for template in TEMPLATES {
        let folder = Folder::new();
        std::fs::write(folder.path("arm.urdf"), ARM).unwrap();
        let (text, found) = written(&folder, template, &["--robot", "arm.urdf", "--template", template]);
        assert_good(&text, &found);
        assert!(text.contains("frame = \"tool0\"") && text.contains("[[model.insert]]"), "{text}");
        let count = found["tasks"][0]["contacts"].as_array().unwrap().len();
        assert_eq!(count, usize::from(["press", "wipe", "insert", "hold"].contains(&template)));
    }
}

/// The search ends with a requirement for the sensor, and not where the parameter may go no further.
#[test]
fn designed_sensors_end_within_their_bounds() {
    for template in TEMPLATES {
        let folder = Folder::new();
        std::fs::write(folder.path("arm.urdf"), ARM).unwrap();
        assert_eq!(folder.run(&["new", "task", "--robot", "arm.urdf", "--template", template]).code, Some(0));
        let table: toml::Value = toml::from_str(&std::fs::read_to_string(folder.path("task.toml")).unwrap()).unwrap();
        let found = folder.run(&["design", "task.toml", "--starts", "1", "--json"]).json(0);
        let optimum = &found["optimum"];
        assert_ne!(optimum["tasks"][0]["trust"]["verdict"], "broken", "{template}: {optimum}");
        let name = if template == "reach" { "joint_noise" } else { "force_noise" };
        let bounds = table["parameters"][name]["bounds"].as_array().unwrap();
        let [lower, upper] = [0, 1].map(|end: usize| bounds[end].as_float().unwrap());
        let noise = optimum["parameters"][name].as_f64().unwrap();
        assert!(1.01 * lower < noise && noise < 0.99 * upper, "{template}: {noise} in [{lower}, {upper}]");
    }
}

#[test]
fn shipped_robots_have_tasks() {
    for (file, frame, template) in [
        ("iiwa14_door.urdf", "iiwa_link_7", "press"),
        ("iiwa14_door.urdf", "iiwa_link_7", "wipe"),
        ("iiwa14_door.urdf", "iiwa_link_7", "handle"),
        ("wiping_arm.sdf", "hand", "reach"),
        ("peg_on_wall.urdf", "gripper", "press"),
    ] {
        let folder = Folder::new();
        let robot = repository("models").join(file).display().to_string();
        let words = ["--robot", &robot, "--template", template, "--frame", frame];
        let (text, found) = written(&folder, "task", &words);
        assert_good(&text, &found);
    }
}

/// Plans lifted the handle, or pushed it down, with up to 440 N: no cost counted the force along the hinge.
#[test]
fn a_door_is_opened_without_force_along_its_hinge() {
    for (robot, frame) in [("arm.urdf", "tool0"), ("iiwa14_door.urdf", "iiwa_link_7")] {
        let folder = Folder::new();
        std::fs::write(folder.path("arm.urdf"), ARM).unwrap();
        let iiwa = std::fs::read(repository("models/iiwa14_door.urdf")).unwrap();
        std::fs::write(folder.path("iiwa14_door.urdf"), iiwa).unwrap();
        let words = ["--robot", robot, "--template", "handle", "--frame", frame];
        let (text, _) = written(&folder, "door", &words);
        let run = folder.run(&["evaluate", "door.toml", "--rollouts", "0", "--out", "out"]);
        assert_eq!(run.code, Some(0), "{}", run.stderr);
        let result: Value = serde_json::from_slice(&std::fs::read(folder.path("out/result.json")).unwrap()).unwrap();
        let evaluation = &result["result"]["evaluation"];
        let stiffness = evaluation["parameters"]["k"].as_f64().unwrap();
        let along = &evaluation["tasks"][0]["trajectory"];
        let names = along["state_names"].as_array().unwrap();
        for axis in ["q.mount_x", "q.mount_y"] {
            let place = names.iter().position(|name| name == axis).unwrap();
            let states = along["states"].as_array().unwrap().iter();
            let forces: Vec<f64> = states.map(|state| stiffness * state[place].as_f64().unwrap()).collect();
            let most = forces.iter().fold(0.0, |most: f64, force| most.max((force - forces[0]).abs()));
            assert!(most < 5.0, "{robot}, {axis}: {most} N where 10 N open the door\n{text}");
        }
    }
}

#[test]
fn numbers_can_be_set_and_wrong_ones_are_refused() {
    let folder = Folder::new();
    std::fs::write(folder.path("arm.urdf"), ARM).unwrap();
    let base = ["--robot", "arm.urdf", "--template", "press"];
    let words = [&base[..], &["--set", "force=5", "--wall", "-x", "--set", "margin=0.5"]].concat();
    let (text, _) = written(&folder, "five", &words);
    assert!(text.contains("\ntarget = 5.0 ") && text.contains("normal = [-1.0, 0.0, 0.0]"), "{text}");
    for (words, message) in [
        (vec!["--set", "forse=5"], "--set forse=5: templates have the numbers `force`, `travel`"),
        (vec!["--set", "force=-1"], "--set force=-1: must be above 0; found -1"),
        (vec!["--set", "force"], "--set force: write NAME=VALUE"),
        (vec!["--set", "margin=1.2"], "--set margin=1.2: must be above 0 and below 1; found 1.2"),
        (vec!["--set", "force=1e9"], "N, ten times what the drives sustain; found 1000000000"),
        (vec!["--set", "time=1e6"], "--set time: must be at most 1000 s; found 1000000"),
        (vec!["--set", "wall_sd=10"], "m, the reach of the limb; found 10"),
        (vec!["--frame", "tool"], "--frame tool: arm.urdf has no such link or frame"),
        (vec!["--frame", "base"], "--frame base: no joint moves it"),
        (vec!["--wall", "up"], "--wall up: write +x, -x, +y, -y, +z, -z or three numbers"),
        (vec!["--at", "1,2"], "--at 1,2: write three numbers, x,y,z"),
        (vec!["--at", "1,two,3,4"], "--at 1,two,3,4: write three numbers, x,y,z"),
        (vec!["--at", "9,9,9"], "--at: the tool cannot reach this point"),
    ] {
        let run = folder.run(&[&["new", "wrong"][..], &base, &words].concat());
        assert!(run.error().contains(message), "{}", run.stderr);
        assert!(!folder.path("wrong.toml").exists());
    }
}

#[test]
fn every_kind_of_model_is_offered() {
    let run = Folder::new().run(&["schema"]);
    let schema: Value = serde_json::from_str(&run.stdout).unwrap();
    let kinds = schema["properties"]["model"]["oneOf"].as_array().unwrap();
    for kind in kinds.iter().map(|kind| kind["properties"]["kind"]["const"].as_str().unwrap()) {
        let folder = Folder::new();
        let run = folder.run(&["new", "task", "--model", kind]);
        assert_eq!(run.code, Some(0), "{kind}: {}", run.stderr);
        let text = std::fs::read_to_string(folder.path("task.toml")).unwrap();
        assert!(text.contains(&format!("kind = \"{kind}\"")), "{text}");
        assert_eq!(folder.run(&["evaluate", "task.toml", "--rollouts", "0"]).code, Some(0), "{kind}");
    }
}

#[test]
fn a_folder_is_not_overwritten_by_a_result_of_another_kind() {
    let folder = Folder::with_task(common::TWO_MASS);
    assert_eq!(folder.run(&["evaluate", "task.toml", "--rollouts", "0", "--out", "out"]).code, Some(0));
    let before = std::fs::read_to_string(folder.path("out/result.json")).unwrap();
    let run = folder.run(&["sweep", "task.toml", "--out", "out", "--grid", "k1=50,60"]);
    let message = "out contains a result of `supple evaluate` and would be overwritten by `supple sweep`";
    assert!(run.error().contains(message), "{}", run.stderr);
    assert_eq!(std::fs::read_to_string(folder.path("out/result.json")).unwrap(), before);
    // What was found of the last result is not of the next one.
    std::fs::write(folder.path("out/validation.json"), "{}").unwrap();
    assert_eq!(folder.run(&["evaluate", "task.toml", "--rollouts", "0", "--out", "out"]).code, Some(0));
    assert!(!folder.path("out/validation.json").exists());
}

#[test]
fn pages_end_with_what_to_try_next() {
    let folder = Folder::with_task(common::TWO_MASS);
    let page = folder.run(&["evaluate", "task.toml", "--rollouts", "0"]).stdout;
    let last = page.lines().last().unwrap();
    assert!(last.starts_with("Next: `supple design` minimises the information over k1"), "{page}");
    let page = folder.run(&["design", "task.toml", "--starts", "1", "--rollouts", "0"]).stdout;
    let last = page.lines().last().unwrap();
    assert!(
        last.starts_with("Next: ") && !last.contains("more starts"),
        "a search along one parameter converged: {page}"
    );
}

/// A finger of a gripper that slides, and one that turns; the other joints of the gripper stay where they are.
const GRIPPER: &str = r#"<robot name="gripper">
  <link name="palm"/>
  <link name="slider"><inertial><mass value="0.05"/><inertia ixx="1e-5" iyy="1e-5" izz="1e-5" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="slider_tip"/>
  <link name="hook"><inertial><origin xyz="0 0 0.03"/><mass value="0.05"/><inertia ixx="2e-5" iyy="2e-5" izz="1e-5" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="hook_tip"/>
  <joint name="slide" type="prismatic"><parent link="palm"/><child link="slider"/><origin xyz="0 0.02 0.05"/><axis xyz="0 1 0"/><limit lower="0" upper="0.04" effort="20" velocity="0.2"/><dynamics damping="5"/></joint>
  <joint name="slider_end" type="fixed"><parent link="slider"/><child link="slider_tip"/><origin xyz="0 0 0.04"/></joint>
  <joint name="turn" type="revolute"><parent link="palm"/><child link="hook"/><origin xyz="0 -0.02 0.05"/><axis xyz="1 0 0"/><limit lower="-0.2" upper="1.4" effort="2" velocity="6"/><dynamics damping="0.05"/></joint>
  <joint name="hook_end" type="fixed"><parent link="hook"/><child link="hook_tip"/><origin xyz="0 0 0.06"/></joint>
</robot>"#;

/// Templates that one joint can do run; the others say what would do.
#[test]
fn limbs_of_a_single_joint_have_tasks() {
    let elbow = std::fs::read_to_string(repository("models/elastic_elbow.urdf")).unwrap();
    for (file, text, frame, joint) in [
        ("gripper.urdf", GRIPPER, "slider_tip", "slide"),
        ("gripper.urdf", GRIPPER, "hook_tip", "turn"),
        ("elbow.urdf", &*elbow, "fingertip", "elbow"),
    ] {
        for template in TEMPLATES {
            let folder = Folder::new();
            std::fs::write(folder.path(file), text).unwrap();
            let words = ["--robot", file, "--template", template, "--frame", frame];
            if ["press", "hold", "reach"].contains(&template) {
                let (text, found) = written(&folder, "task", &words);
                assert_good(&text, &found);
                assert!(text.contains(&format!("\"q.{joint}\" = ")) && !text.contains("pose = "), "{text}");
                continue;
            }
            let run = folder.run(&[&["new", "task"][..], &words].concat());
            let error =
                format!("requires at least 2 joints, but `{frame}` is moved by 1; try --template press, hold or reach");
            assert!(run.error().contains(&error), "{template}: {}", run.stderr);
            assert!(!folder.path("task.toml").exists());
        }
    }
}

/// Speeds and efforts of the robot file are limits of the task, and the force is a curve.
#[test]
fn templates_have_limits_and_curves() {
    let folder = Folder::new();
    std::fs::write(folder.path("arm.urdf"), ARM).unwrap();
    let (text, _) = written(&folder, "press", &["--robot", "arm.urdf", "--template", "press"]);
    let table: toml::Value = toml::from_str(&text).unwrap();
    let task = &table["tasks"][0];
    let list =
        |value: &toml::Value| value.as_array().unwrap().iter().map(|v| v.as_float().unwrap()).collect::<Vec<_>>();
    let limits = task["limits"].as_array().unwrap();
    assert_eq!(limits[0]["kind"].as_str(), Some("joint_velocity"));
    assert_eq!(list(&limits[0]["upper"]), [3.0, 3.0, 3.0, 4.0, 4.0, 4.0]);
    assert_eq!(list(&limits[0]["lower"]), [-3.0, -3.0, -3.0, -4.0, -4.0, -4.0]);
    // Controls are commands, and what the drives exert is limited beside them.
    assert_eq!((limits[1]["kind"].as_str(), list(&limits[1]["upper"])[2]), (Some("drive_effort"), 60.0));
    assert_eq!(limits.len(), 2);
    let (reach, _) = written(&folder, "reach", &["--robot", "arm.urdf", "--template", "reach"]);
    let reach: toml::Value = toml::from_str(&reach).unwrap();
    let torques = &reach["tasks"][0]["limits"][1];
    assert_eq!((torques["kind"].as_str(), list(&torques["upper"])[2]), (Some("control"), 60.0));
    let kinds: Vec<_> =
        task["curves"].as_array().unwrap().iter().map(|curve| curve["kind"].as_str().unwrap()).collect();
    assert_eq!(kinds, ["contact_force", "frame_point", "coupling_deflection"]);
    // A limit that is lowered below what the plan does is reported with its name.
    let lowered =
        text.replace("upper = [3.0, 3.0, 3.0, 4.0, 4.0, 4.0]", "upper = [1e-3, 1e-3, 1e-3, 1e-3, 1e-3, 1e-3]");
    std::fs::write(folder.path("press.toml"), lowered).unwrap();
    let run = folder.run(&["evaluate", "press.toml", "--json", "--rollouts", "0"]);
    let found: Value = serde_json::from_str(&run.stdout).unwrap();
    assert!(!found["tasks"][0]["limits_violated"].as_array().unwrap().is_empty(), "{}", run.stdout);
}

/// One joint that moves along the wall presses on nothing: that is said instead of a file.
#[test]
fn a_tool_that_cannot_reach_its_wall_is_told() {
    let folder = Folder::new();
    let robot = repository("models/elastic_elbow.urdf").display().to_string();
    let words = ["new", "task", "--robot", &robot, "--template", "press", "--frame", "fingertip", "--wall", "+z"];
    let run = folder.run(&words);
    assert!(run.error().contains("cannot move the tool towards this wall: omit --wall"), "{}", run.stderr);
    // A tool on the axis of its joint, as on the rotor of a drone, moves nowhere: no --wall was given that could be omitted.
    let rotor = include_str!("../../../models/elastic_elbow.urdf").replace("xyz=\"0.4 0 0\"", "xyz=\"0 0 0\"");
    std::fs::write(folder.path("rotor.urdf"), rotor).unwrap();
    let run = folder.run(&["new", "task", "--robot", "rotor.urdf", "--template", "press", "--frame", "fingertip"]);
    let message = "no joint of this limb moves a tool at `fingertip`, whose origin lies on";
    assert!(run.error().contains(message), "{}", run.stderr);
}

#[test]
fn a_task_in_a_missing_folder_is_refused() {
    let folder = Folder::new();
    let run = folder.run(&["new", "missing/task"]);
    let message = "missing/task.toml: there is no folder missing; create it first, or choose another NAME";
    assert!(run.error().contains(message), "{}", run.stderr);
}

/// A planar arm: links of 0.3 m whose joints turn about z, on a lift; fingers at its end.
fn planar(lift: f64, speed: f64) -> String {
    let link = |name: &str, mass: f64| {
        format!(
            "<link name=\"{name}\"><inertial><origin xyz=\"0.15 0 0\"/><mass value=\"{mass}\"/><inertia ixx=\"0.01\" \
             iyy=\"0.01\" izz=\"0.01\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial></link>\n"
        )
    };
    let joint = |kind: &str, [parent, child]: [&str; 2], [at, axis]: [&str; 2], limit: String| {
        format!(
            "<joint name=\"to_{child}\" type=\"{kind}\"><parent link=\"{parent}\"/><child link=\"{child}\"/><origin \
             xyz=\"{at}\"/><axis xyz=\"{axis}\"/><limit {limit}/></joint>\n"
        )
    };
    let turns = || format!("lower=\"-2.5\" upper=\"2.5\" effort=\"60\" velocity=\"{speed}\"");
    let slides = |upper: f64, speed: f64| format!("lower=\"0\" upper=\"{upper}\" effort=\"500\" velocity=\"{speed}\"");
    let mut text = String::from("<robot name=\"planar\"><link name=\"base\"/>\n");
    for (name, mass) in
        [("post", 2.0), ("a", 2.0), ("b", 1.5), ("c", 1.0), ("d", 0.5), ("e", 0.3), ("f", 0.2), ("palm", 0.1)]
    {
        text += &link(name, mass);
    }
    text += &link("left", 0.02);
    text += &link("right", 0.02);
    text += &joint("prismatic", ["base", "post"], ["0 0 0.5", "0 0 1"], slides(0.4, lift));
    text += &joint("revolute", ["post", "a"], ["0 0 0", "0 0 1"], turns());
    let axes = ["0 1 0", "0 0 1", "0 1 0", "1 0 0", "0 1 0", "1 0 0"];
    for (pair, axis) in
        [["a", "b"], ["b", "c"], ["c", "d"], ["d", "e"], ["e", "f"], ["f", "palm"]].into_iter().zip(axes)
    {
        text += &joint("revolute", pair, ["0.2 0 0", axis], turns());
    }
    text += &joint("prismatic", ["palm", "left"], ["0.1 0.02 0", "0 1 0"], slides(0.03, 0.1));
    text += &joint("prismatic", ["palm", "right"], ["0.1 -0.02 0", "0 -1 0"], slides(0.03, 0.1));
    text + "</robot>"
}

/// The tool is mounted on the palm and not on a finger; the lift, which exceeds the number of joints of a limb, is locked.
#[test]
fn tools_are_mounted_before_fingers() {
    let folder = Folder::new();
    std::fs::write(folder.path("planar.urdf"), planar(0.05, 2.0)).unwrap();
    let (text, found) = written(&folder, "task", &["--robot", "planar.urdf", "--template", "press"]);
    assert_good(&text, &found);
    assert!(
        text.contains("frame = \"palm\"") && text.contains("locked = [\"to_left\", \"to_right\", \"to_post\"]")
            || text.contains("locked = [\"to_post\", \"to_left\", \"to_right\"]"),
        "{text}"
    );
    // The point of a tool on it, named after the arm, is likelier.
    let point = "<link name=\"arm_tcp\"/><joint name=\"to_tcp\" type=\"fixed\"><parent link=\"palm\"/>\
                 <child link=\"arm_tcp\"/><origin xyz=\"0 0 0.05\"/></joint></robot>";
    std::fs::write(folder.path("tcp.urdf"), planar(0.05, 2.0).replace("</robot>", point)).unwrap();
    let (text, _) = written(&folder, "tcp", &["--robot", "tcp.urdf", "--template", "press"]);
    assert!(text.contains("frame = \"arm_tcp\""), "{text}");
}

/// A lift with a telescope and a wrist, whose tool cannot be turned at will although it has six joints, or whose tool stays
/// in a plane: no posture was found for either.
#[test]
fn telescopes_have_tasks() {
    let telescope = |slides: usize, wrist: &[[&str; 2]]| {
        let joints = [("prismatic", "0 0 0", "0 0 1", 1.0)].into_iter();
        let joints = joints.chain((0..slides).map(|_| ("prismatic", "0 0 0", "0 1 0", 0.52 / slides as f64)));
        let joints = joints.chain(wrist.iter().map(|[at, axis]| ("revolute", *at, *axis, 1.5)));
        let mut text = "<robot name=\"telescope\"><link name=\"l0\"/>".to_owned();
        let mut last = 0;
        for (index, (kind, at, axis, upper)) in joints.enumerate() {
            last = index + 1;
            let lower = if kind == "revolute" { -upper } else { 0.0 };
            text += &format!(
                "<link name=\"l{last}\"><inertial><origin xyz=\"0 0 0.02\"/><mass value=\"1\"/><inertia ixx=\"0.01\" iyy=\"0.01\" \
                 izz=\"0.01\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial></link><joint name=\"j{last}\" type=\"{kind}\"><parent \
                 link=\"l{index}\"/><child link=\"l{last}\"/><origin xyz=\"{at}\"/><axis xyz=\"{axis}\"/><limit lower=\"{lower}\" \
                 upper=\"{upper}\" effort=\"100\" velocity=\"1\"/></joint>"
            );
        }
        text + &format!(
            "<link name=\"tool\"/><joint name=\"to_tool\" type=\"fixed\"><parent link=\"l{last}\"/><child link=\"tool\"/>\
             <origin xyz=\"0 0 0.1\"/></joint></robot>"
        )
    };
    let wrist = [["0 0 0", "0 0 1"], ["0.1 0 0", "1 0 0"], ["0 0 0.05", "0 0 1"]];
    for (slides, wrist) in [(2, &wrist[..]), (4, &[["0.037 0 0.003", "0 0 1"]][..])] {
        let folder = Folder::new();
        std::fs::write(folder.path("telescope.urdf"), telescope(slides, wrist)).unwrap();
        let (text, found) = written(&folder, "task", &["--robot", "telescope.urdf", "--template", "press"]);
        assert_good(&text, &found);
    }
}

/// Speeds of joints that slide, m/s, do not limit those of joints that turn, rad/s.
#[test]
fn a_slow_lift_does_not_slow_an_arm() {
    let folder = Folder::new();
    std::fs::write(folder.path("planar.urdf"), planar(0.02, 3.0)).unwrap();
    let (text, found) = written(&folder, "task", &["--robot", "planar.urdf", "--template", "wipe", "--frame", "f"]);
    assert_good(&text, &found);
    assert!(text.contains("# tolerance 0.01 m/s") && !text.contains("tolerance 0.01 rad/s"), "{text}");
}

/// Where a slower task does not keep the speeds of the robot file, the plan is made to.
#[test]
fn plans_keep_the_speeds_of_the_robot() {
    let folder = Folder::new();
    std::fs::write(
        folder.path("slow.urdf"),
        ARM.replace("velocity=\"3\"", "velocity=\"0.25\"").replace("velocity=\"4\"", "velocity=\"0.25\""),
    )
    .unwrap();
    let (text, found) = written(&folder, "task", &["--robot", "slow.urdf", "--template", "insert"]);
    assert_good(&text, &found);
    assert_eq!(found["tasks"][0]["limits_violated"], serde_json::json!([]), "{text}");
}

/// A finger that turns in a plane presses on a wall that no axis of the world is normal to: the cost of its position does
/// not pull it off the wall.
#[test]
fn oblique_walls_are_pressed_without_a_conflict() {
    let folder = Folder::new();
    std::fs::write(folder.path("arm.urdf"), ARM).unwrap();
    let words = ["--robot", "arm.urdf", "--template", "press", "--wall=-1,0.3,0.2"];
    let (text, found) = written(&folder, "task", &words);
    assert_good(&text, &found);
    let cost = found["tasks"][0]["cost"]["nominal"].as_f64().unwrap();
    assert!(cost < 5.0, "{cost}\n{text}");
}

/// A robot that falls is refused, with the joints that let it.
#[test]
fn robots_that_fall_are_refused() {
    let folder = Folder::new();
    let robot = r#"<mujoco><worldbody><body name="torso" pos="0 0 1"><joint name="lift" type="slide" axis="0 0 1"/>
        <geom type="sphere" size="0.1" mass="3"/><body name="thigh"><joint name="hip" axis="0 1 0" range="-2 2"/>
        <geom type="capsule" fromto="0 0 0 0.2 0 0" size="0.03" mass="1"/><body name="shin" pos="0.2 0 0">
        <joint name="knee" axis="0 1 0" range="-2 2"/><geom type="capsule" fromto="0 0 0 0.2 0 0" size="0.03" mass="1"/>
        </body></body></body></worldbody><actuator><motor joint="hip"/><motor joint="knee"/></actuator></mujoco>"#;
    std::fs::write(folder.path("hopper.xml"), robot.replace("<mujoco>", "<mujoco><compiler angle=\"radian\"/>"))
        .unwrap();
    let run = folder.run(&["new", "task", "--robot", "hopper.xml", "--template", "press"]);
    assert!(
        run.error().contains("gravity moves joints `lift`, for which the robot file has no drive"),
        "{}",
        run.stderr
    );
    assert!(!folder.path("task.toml").exists());
}

/// Two joints with motors, and slides without that carry a target, as in reachers of gymnasium and dm_control.
const REACHER: &str = r#"<mujoco><compiler angle="radian"/><option gravity="0 0 0"/><worldbody>
  <body name="upper"><inertial pos="0.05 0 0" mass="0.2" diaginertia="1e-3 1e-3 1e-3"/><joint name="shoulder" axis="0 0 1"/>
    <body name="fore" pos="0.1 0 0"><inertial pos="0.05 0 0" mass="0.2" diaginertia="1e-3 1e-3 1e-3"/>
      <joint name="elbow" axis="0 0 1" range="-3 3"/>
      <body name="fingertip" pos="0.11 0 0"><inertial pos="0 0 0" mass="0.01" diaginertia="1e-6 1e-6 1e-6"/></body></body></body>
  <body name="goal" pos="0.1 -0.1 0"><inertial pos="0 0 0" mass="0.1" diaginertia="1e-4 1e-4 1e-4"/>
    <joint name="goal_x" type="slide" axis="1 0 0" range="-0.27 0.27"/><joint name="goal_y" type="slide" axis="0 1 0" range="-0.27 0.27"/></body>
  </worldbody><actuator><motor joint="shoulder" gear="20" ctrlrange="-1 1"/><motor joint="elbow" gear="15" ctrlrange="-1 0.5"/></actuator></mujoco>"#;

/// The tool is on what motors move, and not on the target that nothing drives; the choice is printed.
#[test]
fn tools_are_on_joints_with_motors() {
    let folder = Folder::new();
    std::fs::write(folder.path("reacher.xml"), REACHER).unwrap();
    let run = folder.run(&["new", "task", "--robot", "reacher.xml", "--template", "reach"]);
    assert_eq!(run.code, Some(0), "{}", run.stderr);
    let said = "the tool is on `fingertip`, moved by `shoulder`, `elbow`; --frame chooses another place\n";
    assert!(run.stdout.contains(said), "{}", run.stdout);
    let text = std::fs::read_to_string(folder.path("task.toml")).unwrap();
    let table: toml::Value = toml::from_str(&text).unwrap();
    let locked: Vec<_> = table["model"]["locked"].as_array().unwrap().iter().map(|one| one.as_str().unwrap()).collect();
    assert_eq!(locked, ["goal_x", "goal_y"], "{text}");
    // What the motors exert at most is a limit of the torques.
    let limits = table["tasks"][0]["limits"].as_array().unwrap();
    let torques = limits.iter().find(|limit| limit["kind"].as_str() == Some("control")).unwrap();
    let upper: Vec<f64> = torques["upper"].as_array().unwrap().iter().map(|one| one.as_float().unwrap()).collect();
    assert_eq!(upper, [20.0, 15.0], "{text}");
    // With position control they are limits too, and the file does not say that there are none.
    let run = folder.run(&["new", "press", "--robot", "reacher.xml", "--template", "press"]);
    assert_eq!(run.code, Some(0), "{}", run.stderr);
    let text = std::fs::read_to_string(folder.path("press.toml")).unwrap();
    let efforts = "kind = \"drive_effort\"\nselect = [\"shoulder\", \"elbow\"]\nlower = [-20.0, -15.0]";
    assert!(text.contains(efforts) && text.contains("upper = [20.0, 15.0]"), "{text}");
    assert!(text.contains("specifies no speed limits") && !text.contains("no speed or effort limits"), "{text}");
}

/// Limits of 0, where nobody entered any, are none: tasks were slowed down and their plans exceeded all of them.
#[test]
fn limits_of_zero_are_none() {
    let folder = Folder::new();
    let mut text = ARM.to_owned();
    for name in ["velocity", "effort"] {
        let parts: Vec<&str> = text.split(&format!("{name}=\"")).collect();
        let rest = parts[1..].iter().map(|part| format!("{name}=\"0{}", &part[part.find('"').unwrap()..]));
        text = std::iter::once(parts[0].to_owned()).chain(rest).collect();
    }
    std::fs::write(folder.path("zero.urdf"), text).unwrap();
    for template in ["press", "reach"] {
        let run = folder.run(&["new", template, "--robot", "zero.urdf", "--template", template]);
        assert_eq!(run.code, Some(0), "{}", run.stderr);
        assert!(!run.stderr.contains("limit 0") && !run.stderr.contains("exceeds"), "{}", run.stderr);
        let text = std::fs::read_to_string(folder.path(&format!("{template}.toml"))).unwrap();
        assert!(text.contains("specifies no speed or effort limits"), "{text}");
        let run = folder.run(&["evaluate", &format!("{template}.toml"), "--rollouts", "0", "--json"]);
        let said = "limits of 0 are treated as not set: `velocity` of joints ";
        assert_eq!(run.stderr.matches(said).count(), 1, "{}", run.stderr);
        let found: Value = serde_json::from_str(&run.stdout).unwrap();
        assert_eq!(found["tasks"][0]["limits_violated"], serde_json::json!([]));
    }
}

/// The hook pulled with 123 N at the start, and with up to 1962 N on soft mounts: the tool hung lower than the handle.
#[test]
fn the_hook_of_a_door_carries_nothing_at_the_start() {
    let folder = Folder::new();
    std::fs::write(folder.path("arm.urdf"), ARM).unwrap();
    let words = ["new", "door", "--robot", "arm.urdf", "--template", "handle", "--frame", "tool0", "--set", "mass=1"];
    let run = folder.run(&words);
    assert_eq!(run.code, Some(0), "{}", run.stderr);
    let text = std::fs::read_to_string(folder.path("door.toml")).unwrap();
    let table: toml::Value = toml::from_str(&text).unwrap();
    let bounds = table["parameters"]["k"]["bounds"].as_array().unwrap();
    let initial = table["parameters"]["k"]["initial"].as_float().unwrap();
    // The weight of 1 kg makes the softest mount sag by 2 cm at most.
    assert!(9.81 / bounds[0].as_float().unwrap() < 0.0201, "{text}");
    for k in [initial, bounds[0].as_float().unwrap(), bounds[1].as_float().unwrap()] {
        let set = text.replacen(&format!("initial = {initial:?} "), &format!("initial = {k:?} "), 1);
        std::fs::write(folder.path("door.toml"), set).unwrap();
        let run = folder.run(&["evaluate", "door.toml", "--rollouts", "0", "--out", "out"]);
        let result = std::fs::read(folder.path("out/result.json"));
        let result: Value = serde_json::from_slice(&result.unwrap_or_else(|_| panic!("{}", run.stderr))).unwrap();
        let quantities = &result["result"]["evaluation"]["tasks"][0]["trajectory"]["quantities"];
        let hook =
            quantities.as_array().unwrap().iter().filter(|q| q["name"].as_str().unwrap().starts_with("hook.force_"));
        let forces: Vec<f64> = hook.map(|q| q["values"][0].as_f64().unwrap()).collect();
        assert_eq!(forces.len(), 3, "{quantities}");
        // What acts on a slide is a force, and its way a length: both had no unit, and the first was called a torque.
        let unit = |name: &str| {
            let mut found = quantities.as_array().unwrap().iter().filter(|q| q["name"] == name);
            found.next().unwrap_or_else(|| panic!("no {name} in {quantities}"))["unit"].as_str().unwrap().to_owned()
        };
        assert_eq!([unit("mount_x.force"), unit("mount_z.deflection")], ["N", "m"]);
        // The pose of the tool has four decimals.
        assert!(forces.iter().all(|force| force.abs() < 0.1), "{k}: {forces:?}\n{text}");
        std::fs::remove_dir_all(folder.path("out")).unwrap();
    }
}

/// Sizes of contacts do not follow the length of a rail or the mass of a large robot: smoothings were up to 0.7 m long, and
/// tools of 50 kg hung on springs of 50 N/m.
#[test]
fn sizes_of_large_robots_are_sensible() {
    let rail = ARM.replacen("<link name=\"base\"/>", "<link name=\"ground\"/><link name=\"base\"><inertial><mass value=\"500\"/>\
        <inertia ixx=\"9\" iyy=\"9\" izz=\"9\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial></link><joint name=\"rail\" type=\"prismatic\">\
        <parent link=\"ground\"/><child link=\"base\"/><axis xyz=\"1 0 0\"/><limit lower=\"-20\" upper=\"20\" effort=\"9000\" \
        velocity=\"2\"/></joint>", 1);
    assert_ne!(rail, ARM);
    let folder = Folder::new();
    std::fs::write(folder.path("rail.urdf"), rail).unwrap();
    let (text, found) = written(&folder, "task", &["--robot", "rail.urdf", "--template", "press", "--wall", "+z"]);
    assert_good(&text, &found);
    let table: toml::Value = toml::from_str(&text).unwrap();
    let wall = &table["model"]["compliance"][0];
    assert!(wall["smoothing"].as_float().unwrap() <= 0.035, "{text}");
    let mass = table["model"]["insert"][0]["mass"].as_float().unwrap();
    let soft = table["parameters"]["k"]["bounds"][0].as_float().unwrap();
    assert!(mass <= 5.0 && mass * 9.81 / soft < 0.0201, "{text}");
}
