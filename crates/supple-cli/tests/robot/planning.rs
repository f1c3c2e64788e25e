//! What `supple robot` says of plans with a robot, and the tasks that `supple new --robot` writes.

use crate::common::Folder;
use crate::{INERTIAL, folder, gripper, robot};

/// The section about plans.
fn section(page: &str) -> Vec<String> {
    let section = page.split("\nPlanning with this robot\n").nth(1).unwrap_or_else(|| panic!("no section in\n{page}"));
    section.lines().take_while(|line| line.starts_with("- ")).map(|line| line[2..].to_owned()).collect()
}

/// A chain of joints about x, each with a link whose inside is given.
fn chain(insides: &[&str], limits: &str) -> String {
    let mut text = "<robot name='chain'><link name='l0'/>\n".to_owned();
    for (i, inside) in insides.iter().enumerate() {
        let kind = if limits.is_empty() { "continuous" } else { "revolute" };
        text += &format!(
            "<link name='l{}'>{inside}</link><joint name='j{}' type='{kind}'><parent link='l{i}'/><child link='l{}'/>\
             <origin xyz='0 0 0.2'/><axis xyz='1 0 0'/>{limits}</joint>\n",
            i + 1,
            i + 1,
            i + 1
        );
    }
    text + "</robot>"
}

/// Writes a task for `robot.urdf` and evaluates it; the task, and the result.
fn planned(folder: &Folder) -> (String, serde_json::Value) {
    let run = folder.run(&["new", "reach", "--robot", "robot.urdf"]);
    // What the robot's file warns of is on standard error.
    assert_eq!(run.code, Some(0), "{}", run.stderr);
    let [first, chosen, last] = run.stdout.lines().collect::<Vec<_>>()[..] else { panic!("{}", run.stdout) };
    assert_eq!((first, last), ("wrote reach.toml", "Next: supple evaluate reach.toml"));
    assert!(chosen.starts_with("the point is reached by `"), "{chosen}");
    let text = std::fs::read_to_string(folder.path("reach.toml")).unwrap();
    let run = folder.run(&["evaluate", "reach.toml", "--json"]);
    assert_eq!(run.code, Some(0), "{}", run.stderr);
    let found: serde_json::Value = serde_json::from_str(&run.stdout).unwrap();
    assert_eq!(found["tasks"][0]["status"], "converged", "{text}");
    (text, found)
}

#[test]
fn a_robot_that_can_be_planned_is_ready() {
    let text = gripper();
    let found = section(&robot(&text, &[]).stdout);
    assert_eq!(found[0], "ready: `supple new NAME --robot FILE` writes a task file that runs");
    assert!(found.contains(&"no effort limit: `swing`; plans may use any torque".to_owned()), "{found:?}");
    let (task, _) = planned(&folder(&text));
    assert!(task.contains("file = \"robot.urdf\"\n") && !task.contains("locked"), "{task}");
}

#[test]
fn joints_that_move_nothing_are_locked() {
    let text = chain(&[INERTIAL, INERTIAL, "", ""], "");
    let found = section(&robot(&text, &[]).stdout);
    let said = "lock joints that move no inertia: write `locked = [\"j3\", \"j4\"]` in [model], as `supple new \
                NAME --robot FILE` does";
    assert_eq!(found[0], said);
    let (task, _) = planned(&folder(&text));
    assert!(task.contains("\nlocked = [\"j3\", \"j4\"]   # "), "{task}");
}

#[test]
fn a_robot_without_moving_inertia_cannot_be_planned() {
    let one = format!("<robot name='r'><link name='body'>{INERTIAL}</link></robot>");
    for (text, why) in [
        (one.as_str(), "no joint moves, so there is nothing to control"),
        (&chain(&["", ""], ""), "no joint moves a link with inertia; add `inertial` elements to the links"),
        (
            &chain(&[INERTIAL; 301], ""),
            "301 joints are too many; `locked` in [model] removes those that do not have to move",
        ),
    ] {
        let folder = folder(text);
        let page = folder.run(&["robot", "robot.urdf"]);
        assert_eq!(section(&page.stdout)[0], format!("not possible: {why}"));
        let run = folder.run(&["new", "reach", "--robot", "robot.urdf"]);
        assert_eq!(run.error(), format!("error: --robot robot.urdf: {why}"));
        assert!(!folder.path("reach.toml").exists());
    }
    let root = section(&robot(&one, &[]).stdout);
    assert!(root[1].starts_with("link `body` of 1 kg is fixed in the world"), "{root:?}");
}

#[test]
fn limits_are_told() {
    let limits = "<limit lower='0.5' upper='1.5' effort='0' velocity='1'/>";
    let found = section(&robot(chain(&[INERTIAL], limits), &[]).stdout);
    assert_eq!(
        found[1..],
        [
            "no effort limit: `j1`; plans may use any torque",
            "starts at the middle of its range, which excludes 0: `j1` at 1",
        ]
    );
}

#[test]
fn joints_without_effort_have_no_drive_where_others_have() {
    let passive = "type='continuous'><limit effort='0' velocity='1'/><parent link='l1'/>";
    let text = chain(&[INERTIAL, INERTIAL], "").replacen("type='continuous'><parent link='l1'/>", passive, 1);
    let (task, found) = planned(&folder(&text));
    assert!(task.contains("\nactuated = [\"j1\"]   # "), "{task}");
    assert_eq!(found["tasks"].as_array().unwrap().len(), 1);
}

#[test]
fn one_limb_of_a_large_robot_moves() {
    // The limb has at most seven joints, those nearest its end.
    let text = chain(&[INERTIAL; 12], "");
    let (task, _) = planned(&folder(&text));
    assert!(task.contains("locked = [\"j1\", \"j2\", \"j3\", \"j4\", \"j5\"]"), "{task}");
    assert!(task.contains("frame = \"l12\""), "{task}");
}

#[test]
fn every_warning_is_printed_where_it_is_asked_for() {
    let mesh = |name: &str| format!("<visual><geometry><mesh filename='{name}'/></geometry></visual>");
    let visuals: String = ["/far/a.stl", "/far/b.stl", "near/c.stl", "near/d.stl"].map(mesh).concat();
    let text = gripper().replacen("<link name='base'/>", &format!("<link name='base'>{visuals}</link>"), 1);
    let short = robot(&text, &[]).stdout;
    let why = "is outside the robot file's folder and all package roots";
    assert!(short.contains(&format!("- 2 meshes are ignored, because each {why}: ")), "{short}");
    assert!(short.contains("- 2 meshes not found: near/c.stl, near/d.stl\n"), "{short}");
    let long = robot(&text, &["--verbose"]).stdout;
    assert!(long.contains(&format!("- mesh `/far/b.stl` is left out: it {why} (line 2)\n")), "{long}");
    assert!(long.contains("- mesh not found: near/d.stl\n"), "{long}");
    let json = robot(&text, &["--json"]);
    let warnings: serde_json::Value = serde_json::from_str(&json.stdout).unwrap();
    assert_eq!(warnings["warnings"].as_array().unwrap().len(), 2, "{}", json.stdout);
    let folder = folder(&text);
    folder.run(&["new", "reach", "--robot", "robot.urdf"]);
    let count = |arguments: &[&str]| folder.run(arguments).stderr.matches("is left out: it").count();
    assert_eq!(count(&["evaluate", "reach.toml"]), 0);
    assert_eq!(count(&["evaluate", "reach.toml", "--verbose"]), 2);
}

/// A joint whose range is a single position was planned, and every plan left its range.
#[test]
fn joints_with_a_single_position_are_locked_there() {
    let text = chain(&[INERTIAL; 3], "<limit lower='-1' upper='1' effort='50' velocity='1'/>");
    let (before, rest) = text.split_once("<link name='l2'>").unwrap();
    let text =
        format!("{before}<link name='l2'>{}", rest.replacen("lower='-1' upper='1'", "lower='0.5' upper='0.5'", 1));
    let found = section(&robot(&text, &[]).stdout);
    let said = "lock a joint whose range is a single position: write `locked = [\"j2\"]` in [model], as `supple new NAME \
                --robot FILE` does";
    assert_eq!(found[0], said);
    let folder = folder(&text);
    for more in [&[][..], &["--template", "reach"]] {
        let run = folder.run(&[&["new", "reach", "--robot", "robot.urdf"], more].concat());
        let warned = "warning: the task locks joint `j2`, as the range in the robot file is a single position; where that is \
                      wrong, correct `lower` and `upper` there";
        assert!(run.code == Some(0) && run.stderr.lines().any(|line| line == warned), "{}", run.stderr);
        let task = std::fs::read_to_string(folder.path("reach.toml")).unwrap();
        assert!(task.contains("\nlocked = [\"j2\"]"), "{task}");
        let run = folder.run(&["evaluate", "reach.toml", "--json"]);
        let found: serde_json::Value = serde_json::from_str(&run.stdout).unwrap();
        assert_eq!(found["tasks"][0]["limits_violated"], serde_json::json!([]), "{task}");
        std::fs::remove_file(folder.path("reach.toml")).unwrap();
    }
    let still = text.replace("lower='-1' upper='1'", "lower='0' upper='0'");
    let found = section(&robot(&still, &[]).stdout);
    let said = "not possible: the range of every joint that moves a link with inertia is a single position: correct `lower` and \
                `upper` of `j1`, `j2`, `j3`";
    assert_eq!(found[0], said);
}
