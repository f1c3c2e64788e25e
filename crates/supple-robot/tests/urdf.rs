//! URDF files: what is read, in which order, and what is said of the rest.
#![allow(clippy::unwrap_used, clippy::expect_used)]

#[path = "data/random_trees.rs"]
mod random_trees;

use std::path::{Path, PathBuf};

use supple_robot::{
    Inertia, Joint, JointKind, Limits, LoadOptions, LockedJoint, Mesh, Mimic, Narrowed, Pose, Robot, load, parse,
};

/// The robot in a text.
fn read(text: &str) -> Robot {
    parse(text, "robot.urdf", &LoadOptions::default()).unwrap()
}

/// A robot of the links `a` and `b`, with `link` in `b` and `joint` in the joint between them.
fn pair(link: &str, kind: &str, joint: &str) -> String {
    let ends = "<parent link='a'/><child link='b'/>";
    format!(
        "<robot name='r'>\n<link name='a'/>\n<link name='b'>{link}</link>\n<joint name='j' type='{kind}'>{ends}{joint}</joint>\n</robot>"
    )
}

/// The folder of the files that the tests read.
fn data() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data")
}

#[test]
fn an_arm_is_read_whole() {
    let options = LoadOptions { package_roots: vec![data()], ..LoadOptions::default() };
    let robot = load(data().join("arm/arm.urdf"), &options).unwrap();
    assert_eq!((robot.name.as_str(), robot.gravity, robot.frames.len()), ("arm", None, 0));
    let links: Vec<_> = robot.links.iter().map(|link| (link.name.as_str(), link.line)).collect();
    let expected =
        [("base", 5), ("upper arm", 8), ("forearm", 37), ("left finger", 43), ("right finger", 49), ("tip", 68)];
    assert_eq!(links, expected);
    let joints: Vec<_> = robot.joints.iter().map(|joint| (joint.name.as_str(), joint.parent, joint.line)).collect();
    let expected = [("shoulder", 0, 22), ("elbow", 1, 32), ("left grip", 2, 55), ("right grip", 2, 61), ("tip", 2, 69)];
    assert_eq!(joints, expected);
    let kinds: Vec<_> = robot.joints.iter().map(|joint| joint.kind).collect();
    let (slides, fixed) = (JointKind::Prismatic, JointKind::Fixed);
    assert_eq!(kinds, [JointKind::Revolute, JointKind::Continuous, slides, slides, fixed]);
    let ignored = ["element `material` is ignored (line 4)", "element `calibration` is ignored (line 27)"];
    let more = [
        "element `safety_controller` is ignored (line 30)",
        "`transmission` elements are ignored (2 of them, first at line 74)",
    ];
    assert_eq!(robot.warnings, [&ignored[..], &more, &["element `gazebo` is ignored (line 76)"]].concat());
}

#[test]
fn an_arm_has_its_numbers() {
    let options = LoadOptions { package_roots: vec![data()], ..LoadOptions::default() };
    let robot = load(data().join("arm/arm.urdf"), &options).unwrap();
    let [shoulder, elbow, left, right, tip] = robot.joints.as_slice() else { panic!("five joints") };
    assert_eq!(
        shoulder.origin,
        Pose { rotation: [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]], position: [0.0, 0.0, 0.3] }
    );
    assert_eq!((shoulder.axis, shoulder.damping, shoulder.friction), ([0.0, 0.0, 1.0], 0.5, 0.1));
    assert_eq!((shoulder.armature, shoulder.stiffness, shoulder.rest, shoulder.reference), (0.0, 0.0, 0.0, 0.0));
    assert_eq!((shoulder.child_pose, shoulder.mimic), (Pose::IDENTITY, None));
    assert_eq!(shoulder.limits, Limits { lower: -1.5, upper: 2.0, velocity: 4.0, effort: 30.0 });
    assert_eq!((elbow.axis, elbow.limits), ([1.0, 0.0, 0.0], Limits::default()));
    assert_eq!((left.limits.upper, left.mimic), (0.04, None));
    assert_eq!(right.mimic, Some(Mimic { joint: 2, ratio: -1.0, offset: 0.001 }));
    assert_eq!(tip.origin.rotation, [[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]]);
    // A quarter turn about x: y to z, and z to -y.
    let moment = [[0.1, -0.02, 0.01], [-0.02, 0.25, -0.03], [0.01, -0.03, 0.2]];
    assert_eq!(robot.links[1].inertia, Some(Inertia { mass: 2.5, center: [0.0, 0.1, 0.2], moment }));
    assert_eq!((robot.links[0].inertia, robot.links[5].inertia), (None, None));
    let base = Mesh { path: data().join("arm/meshes/base.stl"), pose: Pose::IDENTITY, scale: [1.0; 3] };
    assert_eq!(robot.links[0].meshes, [base]);
    let upper = Mesh { path: data().join("arm/meshes/upper.stl"), pose: Pose::at([0.0, 0.0, 0.1]), scale: [0.001; 3] };
    assert_eq!(robot.links[1].meshes, [upper]);
}

#[test]
fn an_arm_at_a_door_has_its_numbers() {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../../models/iiwa14_door.urdf");
    let robot = load(file, &LoadOptions::default()).unwrap();
    assert_eq!((robot.links.len(), robot.joints.len(), robot.warnings.len()), (10, 9, 0));
    let parents: Vec<_> = robot.joints.iter().map(|joint| joint.parent).collect();
    assert_eq!(parents, [0, 1, 2, 3, 4, 5, 6, 0, 8]);
    let masses: f64 = robot.links.iter().filter_map(|link| link.inertia).map(|inertia| inertia.mass).sum();
    assert!((masses - 26.61).abs() < 1e-12);
    let third = &robot.joints[2];
    assert_eq!(third.origin.position, [0.0, 0.2045, 0.0]);
    // Rolled by a quarter turn, yawed by a half.
    assert_eq!(third.origin.rotation, [[-1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]]);
    let hinge = &robot.joints[robot.joint("right_door_hinge").unwrap()];
    assert_eq!((hinge.damping, hinge.limits.effort, hinge.limits.lower), (0.1, 0.0, -3.0));
    let handle = &robot.joints[robot.joint("handle_joint").unwrap()];
    assert_eq!((handle.kind, handle.origin.position), (JointKind::Fixed, [0.05, -0.234, 0.1]));
    // Not quite a half turn: -3.1415.
    let pitch = -31_415.0_f64 / 10_000.0;
    assert_eq!(handle.origin.rotation[0], [pitch.cos(), 0.0, pitch.sin()]);
}

#[test]
fn an_inertia_is_turned_into_the_axes_of_its_link() {
    let inertia = "<inertia ixx='0.1' ixy='0.01' ixz='0.02' iyy='0.2' iyz='0.03' izz='0.25'/>";
    let inertial = format!("<inertial><origin xyz='1 2 3' rpy='0.3 -0.4 0.5'/><mass value='2'/>{inertia}</inertial>");
    let robot = read(&pair(&inertial, "continuous", ""));
    let Inertia { mass, center, moment } = robot.links[1].inertia.unwrap();
    assert_eq!((mass, center), (2.0, [1.0, 2.0, 3.0]));
    // From an independent program.
    let expected = [
        [0.12755786744026973, -0.03349642177952844, -0.04306418993550083],
        [-0.03349642177952844, 0.16869680600067088, -0.01073820038537572],
        [-0.04306418993550083, -0.01073820038537572, 0.25374532655905946],
    ];
    for (row, expected) in moment.iter().zip(&expected) {
        for (entry, expected) in row.iter().zip(expected) {
            assert!((entry - expected).abs() < 1e-15, "{moment:?}");
        }
    }
    assert!((0..3).all(|i| (0..3).all(|j| moment[i][j] == moment[j][i])));
}

/// A star of continuous joints `j0`, `j1`, ... with `inside[i]` in the joint `i`.
fn star(inside: &[&str]) -> String {
    let joint = |(i, inside): (usize, &&str)| {
        let ends = format!("<parent link='base'/><child link='l{i}'/>");
        format!("<link name='l{i}'/>\n<joint name='j{i}' type='continuous'>{ends}{inside}</joint>\n")
    };
    format!(
        "<robot name='r'>\n<link name='base'/>\n{}</robot>",
        inside.iter().enumerate().map(joint).collect::<String>()
    )
}

#[test]
fn chains_of_followers_lead_to_a_joint_that_follows_none() {
    let text = star(&[
        "<mimic joint='j1' multiplier='2' offset='1'/>",
        "<mimic joint='j2' multiplier='-3' offset='0.5'/>",
        "",
        "<mimic joint='j2'/>",
    ]);
    let mimics: Vec<_> = read(&text).joints.iter().map(|joint| joint.mimic).collect();
    // 2 (-3 x + 0.5) + 1
    let first = Some(Mimic { joint: 2, ratio: -6.0, offset: 2.0 });
    let second = Some(Mimic { joint: 2, ratio: -3.0, offset: 0.5 });
    assert_eq!(mimics, [first, second, None, Some(Mimic { joint: 2, ratio: 1.0, offset: 0.0 })]);
    let options = LoadOptions { independent_mimic: true, ..LoadOptions::default() };
    let free = parse(&text, "robot.urdf", &options).unwrap();
    assert!(free.joints.iter().all(|joint| joint.mimic.is_none()));
}

#[test]
fn origins_in_degrees_are_doubted() {
    let warnings = |rpy: &str| {
        let body = inertial(1.0, [1.0; 3]).replace("<mass", &format!("<origin rpy='{rpy}'/><mass"));
        read(&pair(&body, "continuous", &format!("<origin rpy='{rpy}'/>"))).warnings
    };
    let says = "origin of link `b`: `rpy` = 0 90 0 is rad, but looks like degrees (line 3, and 1 more)";
    assert_eq!(warnings("0 90 0"), [says]);
    assert_eq!(warnings("3.1416 -6.283186 0"), [""; 0]);
}

#[test]
fn limits_of_followers_limit_what_they_follow() {
    let limit = |lower: f64, upper: f64, velocity: f64| {
        format!("<limit lower='{lower}' upper='{upper}' velocity='{velocity}' effort='1'/>")
    };
    let robot = |followed: &str, follower: &str| read(&star(&[followed, follower]).replace("continuous", "prismatic"));
    let follows = "<mimic joint='j0' multiplier='-2' offset='0.01'/>";
    // j1 = 0.01 - 2 j0 within 0 to 0.05: j0 within -0.02 to 0.005.
    let narrow = robot(&limit(0.0, 0.05, 0.3), &(limit(0.0, 0.05, 0.3) + follows));
    let Limits { lower, upper, velocity, .. } = narrow.joints[0].limits;
    assert_eq!((lower, upper, velocity), (0.0, 0.005, 0.15));
    let by = vec!["j1".to_owned()];
    assert_eq!(narrow.joints[0].narrowed, Narrowed { position: by.clone(), velocity: by });
    assert_eq!(narrow.joints[1].limits.upper, 0.05, "its own, as in the file");
    // Limits that are less strict change nothing, and those that leave no range are not applied.
    let wide = robot(&limit(0.0, 0.05, 0.3), &(limit(-1.0, 1.0, 1.0) + follows));
    assert_eq!((wide.joints[0].limits.upper, wide.joints[0].limits.velocity), (0.05, 0.3));
    assert_eq!(wide.joints[0].narrowed, Narrowed::default());
    let none = robot(&limit(0.01, 0.05, 0.3), &(limit(0.0, 0.05, 1.0) + follows));
    assert_eq!((none.joints[0].limits.lower, none.joints[0].limits.upper), (0.01, 0.05));
    assert!(none.warnings.iter().any(|warning| warning.contains("its range is ignored")), "{:?}", none.warnings);
    // A joint that is locked loses them.
    let locked = narrow.locked(&[LockedJoint { joint: 0, position: 0.0 }]);
    assert_eq!(locked.joints[0].narrowed, Narrowed::default());
}

#[test]
fn what_is_followed_is_found_wherever_it_goes() {
    // In the file: j1 on l0, which j0 carries, which stands after it.
    let text = "<robot name='r'><link name='l1'/><link name='l0'/><link name='base'/>
        <joint name='j1' type='continuous'><parent link='l0'/><child link='l1'/><mimic joint='j0'/></joint>
        <joint name='j0' type='continuous'><parent link='base'/><child link='l0'/></joint></robot>";
    let robot = read(text);
    let links: Vec<_> = robot.links.iter().map(|link| link.name.as_str()).collect();
    assert_eq!(links, ["base", "l0", "l1"]);
    assert_eq!((robot.joints[0].name.as_str(), robot.joints[1].mimic.unwrap().joint), ("j0", 0));
}

#[test]
fn what_is_not_given_is_as_urdf_has_it() {
    let robot = read(&pair("", "revolute", "<limit lower='-1'/>"));
    let joint = &robot.joints[0];
    assert_eq!((joint.axis, joint.origin), ([1.0, 0.0, 0.0], Pose::IDENTITY));
    assert_eq!(joint.limits, Limits { lower: -1.0, upper: 0.0, ..Limits::default() });
    // A continuous joint has no range, and a fixed one nothing at all.
    let robot = read(&pair("", "continuous", "<limit lower='2' upper='1' effort='3' velocity='4'/>"));
    assert_eq!(robot.joints[0].limits, Limits { effort: 3.0, velocity: 4.0, ..Limits::default() });
    let robot = read(&pair("", "fixed", "<axis xyz='0 0 0'/><dynamics damping='1'/><limit effort='2'/>"));
    let Joint { axis, damping, limits, .. } = &robot.joints[0];
    assert_eq!((axis, damping, limits), (&[1.0, 0.0, 0.0], &0.0, &Limits::default()));
    // Axes of any length, also one whose square is beyond all numbers.
    for axis in ["0 3 4", "0 3e200 4e200", "0 3e-8 4e-8"] {
        let robot = read(&pair("", "continuous", &format!("<axis xyz='{axis}'/>")));
        let [x, y, z] = robot.joints[0].axis;
        assert!(x == 0.0 && (y - 0.6).abs() < 1e-15 && (z - 0.8).abs() < 1e-15, "{axis}");
    }
}

/// An `inertial` with a mass and principal moments.
fn inertial(mass: f64, [xx, yy, zz]: [f64; 3]) -> String {
    let inertia = format!("<inertia ixx='{xx}' ixy='0' ixz='0' iyy='{yy}' iyz='0' izz='{zz}'/>");
    format!("<inertial><mass value='{mass}'/>{inertia}</inertial>")
}

#[test]
fn what_looks_like_a_mistake_is_said_once() {
    let one = |text: &str, expected: &str| assert_eq!(read(text).warnings, [expected]);
    let body = inertial(1.0, [1.0; 3]);
    one(
        &pair(&inertial(1.0, [1.0, 2.0, 4.0]), "continuous", ""),
        "inertial of link `b`: the principal moments of inertia 1, 2 and 4 are impossible: each must be at most the sum of the other two (line 3)",
    );
    one(
        &pair(&inertial(0.01, [9e-8, -3.5e-8, 8e-8]), "continuous", ""),
        "inertial of link `b`: the principal moments of inertia must be at least 0, and are -3.5e-8, 8e-8 and 9e-8; they are used as they are (line 3)",
    );
    one(
        &pair(&inertial(0.0, [1.0; 3]), "continuous", ""),
        "inertial of link `b`: it has moments of inertia but no mass (line 3)",
    );
    one(
        &pair("", "prismatic", "<limit lower='0' upper='1' effort='1' velocity='1'/>"),
        "joint `j`: it moves link `b` and the links attached to it, none of which has inertia (line 4)",
    );
    one(
        &pair(&inertial(0.0, [0.0; 3]), "continuous", ""),
        "joint `j`: it moves link `b` and the links attached to it, none of which has inertia (line 4)",
    );
    one(
        &pair(&body, "continuous", "<limit velocity='1'/>"),
        "limit of joint `j`: `effort` is missing; unlimited is assumed (line 4)",
    );
    one(
        &pair(&body, "revolute", "<limit velocity='1' effort='2'/>"),
        "limit of joint `j`: `lower` and `upper` are missing: the joint can only be at 0 (line 4)",
    );
    one(
        &pair(&body, "revolute", "<limit lower='-90' upper='135' velocity='1' effort='2'/>"),
        "limit of joint `j`: `lower` = -90 and `upper` = 135 are rad, but look like degrees (line 4)",
    );
    one(
        &pair(&body.replace("inertial>", "inertail>"), "fixed", ""),
        "unknown `inertail` in `link` is ignored; did you mean `inertial`? (line 3)",
    );
    one(
        &pair(&body, "continuous", "<limits/>"),
        "unknown `limits` in `joint` is ignored; did you mean `limit`? (line 4)",
    );
    // A joint without inertia that follows another, or turns a drive, is no mistake.
    assert_eq!(read(&pair(&inertial(1.0, [0.0; 3]), "continuous", "")).warnings, [""; 0]);
    let robot = read(&pair(&inertial(0.01, [9e-8, -3.5e-8, 8e-8]), "continuous", ""));
    assert_eq!(robot.links[1].inertia.map(|inertia| inertia.moment[1]), Some([0.0, -3.5e-8, 0.0]));
    // Rounding in a file: a thin plate, and a rod.
    assert_eq!(read(&pair(&inertial(1.0, [0.0123, 0.0456, 0.0580]), "fixed", "")).warnings, [""; 0]);
    assert_eq!(read(&pair(&inertial(1.0, [-1e-20, 0.0, 1e-20]), "fixed", "")).warnings.len(), 1);
}

/// The mesh of a link, or the error and the warnings.
fn mesh(name: &str, roots: &[PathBuf]) -> Result<PathBuf, Vec<String>> {
    let visual = format!("<visual><geometry><mesh filename='{name}'/></geometry></visual>");
    let options = LoadOptions { package_roots: roots.to_vec(), ..LoadOptions::default() };
    let file = data().join("arm/arm.urdf");
    let robot = parse(&pair(&visual, "fixed", ""), &file.display().to_string(), &options);
    let robot = robot.map_err(|error| vec![error.message])?;
    robot.links[1].meshes.first().map(|mesh| mesh.path.clone()).ok_or(robot.warnings)
}

#[test]
fn meshes_are_found_beside_the_file_and_in_packages() {
    let (roots, arm) = ([data()], data().join("arm"));
    let base = arm.join("meshes/base.stl");
    for name in ["meshes/base.stl", "./meshes/../meshes/base.stl", "file://meshes/base.stl", "meshes\\base.stl"] {
        assert_eq!(mesh(name, &[]).as_ref(), Ok(&base), "{name}");
    }
    assert_eq!(mesh(&base.display().to_string(), &[]).as_ref(), Ok(&base));
    for name in ["package://arm/meshes/base.stl", "model://arm/meshes/base.stl", "package:///arm//meshes/base.stl"] {
        assert_eq!(mesh(name, &roots).as_ref(), Ok(&base), "{name}");
    }
    // Beside the folder, where a package root holds both.
    assert_eq!(mesh("../other/a.stl", &roots), Ok(data().join("other/a.stl")));
    let out = "mesh `package://arm/../hostile/a.stl` is left out: it is outside its package (line 3)";
    assert_eq!(mesh("package://arm/../hostile/a.stl", &roots), Err(vec![out.to_owned()]));
    let absent = "mesh of link `b`: package `leg` is in no declared package root; its meshes are left out (line 3)";
    assert_eq!(mesh("package://leg/a.stl", &roots), Err(vec![absent.to_owned()]));
    assert_eq!(mesh("package://leg/a.stl", &[]), Err(vec![absent.to_owned()]));
}

#[test]
fn what_xacro_makes_of_macros_alone_is_no_robot() {
    let text = "<!-- autogenerated by xacro -->\n<robot xmlns:xacro='http://wiki.ros.org/xacro'>\n</robot>";
    let error = parse(text, "ur3.urdf", &LoadOptions::default()).unwrap_err().to_string();
    let said = "ur3.urdf:2:1: robot: the robot has no links (generated by xacro from a file that only defines macros; expand the file that uses them)";
    assert_eq!(error, said);
}

#[test]
fn a_file_in_the_working_folder_has_its_meshes_there() {
    let visual = "<visual><geometry><mesh filename='meshes/a.stl'/></geometry></visual>";
    let robot = read(&pair(visual, "fixed", ""));
    assert_eq!(robot.links[1].meshes[0].path, Path::new("meshes/a.stl"));
}

/// Files of robots have limits of 0 where nobody entered a number: an arm of six such joints could not move at all.
#[test]
fn limits_of_zero_are_none() {
    let joint = |limit: &str| read(&pair(&inertial(1.0, [1.0; 3]), "revolute", limit));
    let robot = joint("<limit lower='-1' upper='1' effort='0' velocity='0'/>");
    assert_eq!(robot.joints[0].limits, Limits { lower: -1.0, upper: 1.0, ..Limits::default() });
    let said = "limits of 0 are treated as not set: `velocity` of joint `j`, `effort` of joint `j` (line 4)";
    assert_eq!(robot.warnings, [said]);
    // Where other joints have an effort, one without it has no drive.
    let [first, second] = ["effort='5' velocity='0'", "effort='0' velocity='0'"]
        .map(|limits| format!("<limit lower='-1' upper='1' {limits}/>"));
    let more = format!(
        "<link name='c'>{}</link><joint name='k' type='revolute'><parent link='b'/><child link='c'/>{second}</joint></robot>",
        inertial(1.0, [1.0; 3])
    );
    let robot = read(&pair(&inertial(1.0, [1.0; 3]), "revolute", &first).replace("</robot>", &more));
    let efforts: Vec<f64> = robot.joints.iter().map(|joint| joint.limits.effort).collect();
    assert_eq!(efforts, [5.0, 0.0]);
    assert!(robot.joints.iter().all(|joint| joint.limits.velocity.is_infinite()));
    assert_eq!(robot.warnings, ["limits of 0 are treated as not set: `velocity` of joints `j`, `k` (line 4)"]);
}

/// What is around the root element changes nothing; a second element does.
#[test]
fn what_stands_around_the_robot_is_passed_over() {
    let robot = "<robot name='r'>\n<link name='a'/>\n</robot>";
    let declared = "the XML declaration should come first (line 2)";
    let behind = "text after the root element is ignored (line 4)";
    for (text, said) in [
        (format!("{robot}\n\0"), vec![behind]),
        (format!("{robot}\nmore\u{e9}"), vec![behind]),
        (format!("\n<?xml version='1.0'?>{robot}"), vec![declared]),
        (format!("<!-- made by hand -->\n<?xml version='1.0'?>{robot}"), vec![declared]),
        (format!("\u{feff}\n<?xml version='1.0'?>{robot}"), vec![declared]),
        (format!("\u{feff}<?xml version='1.0'?>{robot}\n"), vec![]),
    ] {
        let found = read(&text);
        assert_eq!((found.links.len(), &found.warnings), (1, &found.every_warning), "{text:?}");
        assert_eq!(found.warnings, said, "{text:?}");
    }
    // Lines stay where they are.
    let wrong = parse(
        "<!-- a -->\n<?xml version='1.0'?>\n<robot name='r'>\n<link/></robot>",
        "r.urdf",
        &LoadOptions::default(),
    );
    assert!(wrong.unwrap_err().to_string().starts_with("r.urdf:4:1: "));
    for text in [format!("{robot}<robot name='s'/>"), format!("{robot}\n<?xml version='1.0'?>")] {
        assert!(parse(&text, "r.urdf", &LoadOptions::default()).is_err(), "{text}");
    }
}

/// A mesh that is only drawn does not keep a robot from being read.
#[test]
fn scales_of_other_than_three_numbers_are_told() {
    for (scale, used) in [("1 2 3 4", [1.0, 2.0, 3.0]), ("0.5", [0.5; 3]), ("2 3", [2.0; 3]), ("", [1.0; 3])] {
        let visual = format!("<visual><geometry><mesh filename='b.stl' scale='{scale}'/></geometry></visual>");
        let robot = read(&pair(&(visual + &inertial(1.0, [1.0; 3])), "continuous", ""));
        assert_eq!(robot.links[1].meshes[0].scale, used);
        let count = scale.split_whitespace().count();
        let said = format!(
            "mesh of link `b`: `scale` must have 3 numbers; found {count}: the mesh is drawn with the first one (line 3)"
        );
        assert_eq!(robot.warnings, [said]);
    }
}
