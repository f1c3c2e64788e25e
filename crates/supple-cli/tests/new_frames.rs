//! Where `supple new` mounts the tool, or which place reaches the point.
#![allow(clippy::unwrap_used)]

mod common;

use common::Folder;

/// A planar arm of rods of 0.2 m, with these links and joints, and more elements.
fn arm(names: &[&str], joints: &[&str], more: &str) -> String {
    let mut text = "<robot name=\"arm\"><link name=\"base\"/>".to_owned();
    let mut before = "base";
    for (name, joint) in names.iter().zip(joints) {
        text += &format!(
            "<link name=\"{name}\"><inertial><origin xyz=\"0.1 0 0\"/><mass value=\"1\"/>\
             <inertia ixx=\"0\" iyy=\"0.00333333333333\" izz=\"0.00333333333333\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial></link>\
             <joint name=\"{joint}\" type=\"revolute\"><parent link=\"{before}\"/><child link=\"{name}\"/>\
             <origin xyz=\"0.2 0 0\"/><axis xyz=\"0 1 0\"/>\
             <limit lower=\"-2\" upper=\"2\" effort=\"40\" velocity=\"3\"/></joint>"
        );
        before = name;
    }
    text + more + "</robot>"
}

/// A link fixed to another, beyond its origin.
fn fixed(name: &str, on: &str, x: f64) -> String {
    format!(
        "<link name=\"{name}\"/><joint name=\"{name}_fixed\" type=\"fixed\"><parent link=\"{on}\"/><child link=\"{name}\"/>\
         <origin xyz=\"{x} 0 0\"/></joint>"
    )
}

/// A jaw on the link `carrier`.
const JAW: &str = "<link name=\"jaw\"><inertial><origin xyz=\"0.01 0 0\"/><mass value=\"0.1\"/>\
    <inertia ixx=\"1e-5\" iyy=\"1e-5\" izz=\"1e-5\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial></link>\
    <joint name=\"grip\" type=\"revolute\"><parent link=\"carrier\"/><child link=\"jaw\"/><axis xyz=\"0 1 0\"/>\
    <limit lower=\"0\" upper=\"1\" effort=\"4\" velocity=\"3\"/></joint>";

#[test]
fn tools_are_beyond_the_last_joint() {
    let (links, joints) = (["one", "two"], ["a", "b"]);
    let camera = fixed("camera_link", "two", 0.3);
    let cases: [(&str, String, &str); 10] = [
        // A usual name, whatever else is there.
        ("named", arm(&links, &joints, &(camera.clone() + &fixed("Tip", "two", 0.2))), "Tip"),
        ("words", arm(&links, &joints, &fixed("arm_ee_link", "two", 0.2)), "arm_ee_link"),
        // A flange may be at the last joint; a hand there is what the tool is on, not where.
        ("flange", arm(&links, &joints, &fixed("flange", "two", 0.0)), "flange"),
        ("hand", arm(&["one", "hand"], &joints, &fixed("nail", "hand", 0.2)), "nail"),
        // What is farthest, but no sensor.
        ("farthest", arm(&links, &joints, &(camera.clone() + &fixed("m", "two", 0.1) + &fixed("n", "two", 0.2))), "n"),
        // A frame that the task adds, where the file has none.
        ("added", arm(&links, &joints, ""), "tip"),
        ("sensor", arm(&links, &joints, &camera), "tip"),
        // The jaw of a gripper carries no tool, but a hand of fingers alone does.
        ("jaw", arm(&["i", "ii", "iii", "moving_jaw"], &["a", "b", "c", "gripper"], &fixed("tcp", "iii", 0.1)), "tcp"),
        // What carries a jaw is beyond a sensor of force that is called after a tool.
        (
            "carrier",
            arm(
                &["i", "ii", "iii"],
                &["a", "b", "c"],
                &(fixed("ft_tool", "iii", 0.1) + &fixed("carrier", "iii", 0.2) + JAW),
            ),
            "carrier",
        ),
        ("finger", arm(&["finger_1", "finger_2"], &["finger_a", "finger_b"], ""), "tip"),
    ];
    for (name, robot, frame) in cases {
        let folder = Folder::new();
        std::fs::write(folder.path("arm.urdf"), robot).unwrap();
        let run = folder.run(&["new", "task", "--robot", "arm.urdf"]);
        assert_eq!(run.code, Some(0), "{name}: {}", run.stderr);
        assert!(run.stdout.contains(&format!("the point is reached by `{frame}`, moved by")), "{name}: {}", run.stdout);
        let text = std::fs::read_to_string(folder.path("task.toml")).unwrap();
        assert!(text.contains(&format!("frame = {frame:?}")), "{name}: {text}");
        let added = "[model.frames.tip]\non = ";
        assert_eq!(text.contains(added), frame == "tip", "{name}: {text}");
        assert_eq!(folder.run(&["evaluate", "task.toml", "--rollouts", "0"]).code, Some(0), "{name}: {text}");
    }
}

#[test]
fn added_frames_are_part_of_templates() {
    let folder = Folder::new();
    std::fs::write(folder.path("arm.urdf"), arm(&["one", "two", "three"], &["a", "b", "c"], "")).unwrap();
    let run = folder.run(&["new", "task", "--robot", "arm.urdf", "--template", "press"]);
    assert_eq!(run.code, Some(0), "{}", run.stderr);
    assert!(run.stdout.contains("the tool is on `tip`, moved by `a`, `b`, `c`"), "{}", run.stdout);
    let text = std::fs::read_to_string(folder.path("task.toml")).unwrap();
    assert!(text.contains("[model.frames.tip]\non = \"three\"\nposition = [0.2, 0.0, 0.0]"), "{text}");
    assert_eq!(folder.run(&["evaluate", "task.toml", "--rollouts", "0"]).code, Some(0), "{text}");
}

/// The end of a rod, of a bob, and of a link whose counterweight is on the other side of its joint.
#[test]
fn added_frames_are_where_links_end() {
    let rod = "0.00333333333333";
    for (center, inertia, end) in [("0.1 0 0", rod, 0.2), ("0.1 0 0", "1e-6", 0.1017), ("-0.05 0 0", "0.02", 0.1949)] {
        let folder = Folder::new();
        let last = arm(&["one", "two"], &["a", "b"], "");
        let (first, second) = last.split_at(last.find("<link name=\"two\">").unwrap());
        let second = second.replace("xyz=\"0.1 0 0\"", &format!("xyz=\"{center}\"")).replace(rod, inertia);
        std::fs::write(folder.path("arm.urdf"), format!("{first}{second}")).unwrap();
        assert_eq!(folder.run(&["new", "task", "--robot", "arm.urdf"]).code, Some(0));
        let text = std::fs::read_to_string(folder.path("task.toml")).unwrap();
        assert!(text.contains(&format!("on = \"two\"\nposition = [{end:?}, 0.0, 0.0]")), "{center}, {inertia}: {text}");
    }
}

/// The end of a link whose file says what it looks like.
#[test]
fn added_frames_are_where_visual_shapes_end() {
    // On the line from the joint through the centre of mass, and beside it.
    for (aside, end) in [("0", "0.0"), ("0.2", "0.2")] {
        let folder = Folder::new();
        let shape = format!(
            "<visual><origin xyz=\"0.15 {aside} 0\"/><geometry><box size=\"0.3 0.1 0.1\"/></geometry></visual>"
        );
        let text = arm(&["one", "two"], &["a", "b"], "")
            .replace("<link name=\"two\">", &format!("<link name=\"two\">{shape}"));
        std::fs::write(folder.path("arm.urdf"), text).unwrap();
        assert_eq!(folder.run(&["new", "task", "--robot", "arm.urdf"]).code, Some(0));
        let text = std::fs::read_to_string(folder.path("task.toml")).unwrap();
        assert!(text.contains("this one is where the link's shape ends.\n[model.frames.tip]\non = \"two\""), "{text}");
        assert!(text.contains(&format!("position = [0.3, {end}, 0.0]")), "{text}");
    }
}

/// Joints with springs and without drives start where these hold them, however stiff.
#[test]
fn series_elastic_arms_have_tasks() {
    for (stiffness, gravity) in [("12", "-9.81"), ("1200", "-9.81"), ("120", "0")] {
        let folder = Folder::new();
        let robot = include_str!("data/series_elastic.xml").replace("STIFFNESS", stiffness).replace("GRAVITY", gravity);
        std::fs::write(folder.path("arm.xml"), robot).unwrap();
        let run = folder.run(&["new", "task", "--robot", "arm.xml", "--template", "press"]);
        assert_eq!(run.code, Some(0), "{stiffness}: {}", run.stderr);
        let found = folder.run(&["evaluate", "task.toml", "--rollouts", "0", "--json"]).json(0);
        assert_eq!(found["tasks"][0]["contacts"][0]["touches"], true, "{stiffness}");
    }
}

#[test]
fn the_place_that_reaches_a_point_can_be_chosen() {
    let folder = Folder::new();
    std::fs::write(folder.path("arm.urdf"), arm(&["one", "two", "three"], &["a", "b", "c"], "")).unwrap();
    let run = folder.run(&["new", "task", "--robot", "arm.urdf", "--frame", "three"]);
    assert_eq!(run.code, Some(0), "{}", run.stderr);
    let text = std::fs::read_to_string(folder.path("task.toml")).unwrap();
    assert!(text.contains("frame = \"three\"") && !text.contains("model.frames"), "{text}");
    let run = folder.run(&["new", "other", "--robot", "arm.urdf", "--frame", "thre"]);
    assert!(run.error().contains("--frame thre: arm.urdf has no such link or frame"), "{}", run.stderr);
    assert!(!folder.path("other.toml").exists());
}
