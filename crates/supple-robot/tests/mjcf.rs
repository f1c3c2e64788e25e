//! MJCF files: robots against what MuJoCo makes of them, and what is read of each element.
#![allow(clippy::unwrap_used, clippy::expect_used)]

use serde_json::Value;
use supple_robot::*;

/// Largest error, relative to the largest number compared.
const TOLERANCE: f64 = 1e-12;

/// The robot in a text.
fn read(text: &str) -> Robot {
    parse(text, "robot.xml", &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"))
}

/// A robot whose world has `text` in it.
fn world(text: &str) -> Robot {
    read(&format!("<mujoco><worldbody>{text}</worldbody></mujoco>"))
}

/// An inertia for bodies whose inertia does not matter.
const INERTIAL: &str = "<inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/>";

fn numbers(value: &Value) -> Vec<f64> {
    match value {
        Value::Array(entries) => entries.iter().flat_map(numbers).collect(),
        number => vec![number.as_f64().unwrap()],
    }
}

#[track_caller]
fn assert_close(what: &str, found: impl IntoIterator<Item = f64>, expected: &[f64]) {
    let found: Vec<f64> = found.into_iter().collect();
    assert_eq!(found.len(), expected.len(), "{what}");
    let largest = expected.iter().fold(1.0, |largest: f64, entry| largest.max(entry.abs()));
    for (a, b) in found.iter().zip(expected) {
        assert!((a - b).abs() <= TOLERANCE * largest, "{what}: {found:?} instead of {expected:?}");
    }
}

/// The robot of a file, each joint by itself, and what MuJoCo makes of it.
fn robot(name: &str) -> (Robot, Value) {
    let folder = format!("{}/tests/data_sdf_mjcf", env!("CARGO_MANIFEST_DIR"));
    let options = LoadOptions { independent_mimic: true, ..LoadOptions::default() };
    let robot = load(format!("{folder}/{name}.xml"), &options).unwrap_or_else(|error| panic!("{error}"));
    let golden = std::fs::read_to_string(format!("{folder}/{name}.json")).unwrap();
    (robot, serde_json::from_str(&golden).unwrap())
}

const ROBOTS: [&str; 5] = ["arm", "joints", "orientations", "shapes", "bounds"];

#[test]
fn bodies_have_the_inertia_that_mujoco_gives_them() {
    for name in ROBOTS {
        let (robot, golden) = robot(name);
        for golden in golden["inertias"].as_array().unwrap() {
            let link = &robot.links[robot.link(golden["body"].as_str().unwrap()).unwrap()];
            let what = format!("{name}, {}", link.name);
            let none = Inertia { mass: 0.0, center: [0.0; 3], moment: [[0.0; 3]; 3] };
            let inertia = link.inertia.unwrap_or(none);
            assert_close(&what, [inertia.mass], &numbers(&golden["mass"]));
            if inertia.mass > 0.0 {
                assert_close(&what, inertia.center, &numbers(&golden["center"]));
            }
            assert_close(&what, inertia.moment.into_iter().flatten(), &numbers(&golden["moment"]));
        }
    }
}

#[test]
fn joints_have_the_numbers_that_mujoco_gives_them() {
    for name in ROBOTS {
        let (robot, golden) = robot(name);
        assert_eq!(robot.gravity.unwrap().to_vec(), numbers(&golden["gravity"]));
        let moving = robot.joints.iter().filter(|joint| joint.kind != JointKind::Fixed).count();
        let golden = golden["joints"].as_array().unwrap();
        assert_eq!(moving, golden.len());
        for golden in golden {
            let joint = &robot.joints[robot.joint(golden["joint"].as_str().unwrap()).unwrap()];
            let what = format!("{name}, {}", joint.name);
            let limited = golden["limited"].as_bool().unwrap();
            let kind = match (golden["slide"].as_bool().unwrap(), limited) {
                (true, _) => JointKind::Prismatic,
                (false, true) => JointKind::Revolute,
                (false, false) => JointKind::Continuous,
            };
            assert_eq!(joint.kind, kind, "{what}");
            let limits = [joint.limits.lower, joint.limits.upper];
            match limited {
                true => assert_close(&what, limits, &numbers(&golden["range"])),
                false => assert_eq!(limits, [f64::NEG_INFINITY, f64::INFINITY]),
            }
            let effort = golden["effort"].get(1).map_or(f64::INFINITY, |effort| effort.as_f64().unwrap());
            assert_eq!(joint.limits.effort, effort, "{what}");
            let found = [joint.reference, joint.rest, joint.stiffness, joint.damping, joint.armature, joint.friction];
            let expected = ["ref", "rest", "stiffness", "damping", "armature", "friction"];
            assert_close(&what, found, &expected.map(|name| golden[name].as_f64().unwrap()));
        }
    }
}

#[test]
fn robots_stand_and_move_as_in_mujoco() {
    for name in ROBOTS {
        let (robot, golden) = robot(name);
        let tree = Tree::new(&robot);
        let model = Numbers::<f64>::of(&robot, robot.gravity.unwrap());
        let order: Vec<_> =
            golden["joints"].as_array().unwrap().iter().map(|joint| joint["joint"].as_str().unwrap()).collect();
        let place: Vec<_> =
            order.iter().map(|name| tree.joints().iter().position(|joint| joint == name).unwrap()).collect();
        assert_eq!(place.len(), tree.dofs());
        let ours = |golden: &Value| {
            let mut ours = vec![0.0; tree.dofs()];
            place.iter().zip(numbers(golden)).for_each(|(&place, number)| ours[place] = number);
            ours
        };
        for case in golden["cases"].as_array().unwrap() {
            let (q, v) = (ours(&case["q"]), ours(&case["v"]));
            let kinematics = Kinematics::of(&tree, &model, &q, &v);
            let found = |link: usize, pose: &Pose| kinematics.poses()[link].compose(pose);
            for golden in case["bodies"].as_array().unwrap() {
                let link = robot.link(golden["body"].as_str().unwrap()).unwrap();
                let pose = found(link, &Pose::IDENTITY);
                let what = format!("{name}, {}", robot.links[link].name);
                assert_close(&what, pose.position, &numbers(&golden["position"]));
                assert_close(&what, pose.rotation.into_iter().flatten(), &numbers(&golden["rotation"]));
            }
            for golden in case["sites"].as_array().unwrap() {
                let site = golden["site"].as_str().unwrap();
                let (link, pose) = robot.frame(site).unwrap();
                let pose = found(link, &pose);
                assert_close(site, pose.position, &numbers(&golden["position"]));
                assert_close(site, pose.rotation.into_iter().flatten(), &numbers(&golden["rotation"]));
            }
            let mass = mass_matrix(&tree, &model, &kinematics);
            let mass = place.iter().flat_map(|&i| place.iter().map(move |&j| (i, j))).map(|(i, j)| mass[i][j]);
            assert_close(&format!("{name}, mass matrix"), mass, &numbers(&case["mass_matrix"]));
            let mut frictionless = model.clone();
            frictionless.joints.iter_mut().for_each(|joint| joint.friction = 0.0);
            let force = bias(&tree, &frictionless, &kinematics, &q, &v, 1.0);
            assert_close(&format!("{name}, bias"), place.iter().map(|&i| force[i]), &numbers(&case["bias"]));
        }
    }
}

#[test]
fn the_arm_is_read_whole() {
    let path = format!("{}/tests/data_sdf_mjcf/arm.xml", env!("CARGO_MANIFEST_DIR"));
    let robot = load(path, &LoadOptions::default()).unwrap();
    assert_eq!(robot.name, "arm");
    let links: Vec<_> = robot.links.iter().map(|link| (link.name.as_str(), link.line)).collect();
    let expected = [
        ("world", 20),
        ("base", 24),
        ("upper", 26),
        ("lower/lift", 31),
        ("lower", 30),
        ("hand", 36),
        ("left", 39),
        ("right", 43),
    ];
    assert_eq!(links, expected);
    let joints: Vec<_> = robot.joints.iter().map(|joint| (joint.name.as_str(), joint.parent)).collect();
    let expected =
        [("base/fixed", 0), ("pan", 1), ("lift", 2), ("roll", 3), ("hand/fixed", 4), ("left", 5), ("right", 5)];
    assert_eq!(joints, expected);
    let frames: Vec<_> = robot.frames.iter().map(|frame| (frame.name.as_str(), frame.link)).collect();
    assert_eq!(frames, [("corner", 0), ("shoulder", 2), ("elbow", 4), ("grip", 5)]);
    assert_eq!(robot.joints[6].mimic, Some(Mimic { joint: 5, ratio: 0.9, offset: 0.002 }));
    assert_eq!(robot.warnings, ["element `light` is ignored (line 21)"]);
    let actuators: Vec<_> = robot.actuators.iter().map(|actuator| (actuator.name.as_str(), actuator.law)).collect();
    assert_eq!(actuators, [("pan", Law::Motor { gain: 1.0 })]);
}

#[test]
fn a_site_with_the_name_of_a_body_is_warned_of() {
    let robot = world("<body name='a'><site name='a' pos='1 0 0'/></body>");
    assert_eq!(robot.frame("a"), Some((1, Pose::IDENTITY)));
    let said = "site `a`: a body has the same name; references use the body (line 1)";
    assert_eq!(robot.warnings, [said]);
}

/// The joints of a world with one body, which has `text` in it, under `sections`.
fn joints(sections: &str, text: &str) -> Vec<Joint> {
    let body = format!("<worldbody><body>{INERTIAL}{text}</body></worldbody>");
    read(&format!("<mujoco>{sections}{body}</mujoco>")).joints
}

#[test]
fn angles_are_in_degrees_unless_the_compiler_says_radian() {
    use std::f64::consts::{FRAC_PI_2, PI};
    let class = "<default><joint range='-90 180'/><default class='slider'><joint type='slide'/></default></default>";
    let both = "<joint ref='90' springref='180'/><joint class='slider' ref='90' springref='180'/>";
    let joints_of_both = joints(class, both);
    let (hinge, slide) = (&joints_of_both[0], &joints_of_both[1]);
    assert_eq!((hinge.limits.lower, hinge.limits.upper), (-FRAC_PI_2, PI));
    assert_eq!((hinge.reference, hinge.rest), (FRAC_PI_2, PI));
    assert_eq!((slide.limits.lower, slide.limits.upper), (-90.0, 180.0));
    assert_eq!((slide.reference, slide.rest), (90.0, 180.0));
    assert_eq!((hinge.neutral(), slide.neutral()), (FRAC_PI_2, 90.0), "they start where the file draws them");
    // The last compiler section holds for the whole file, wherever it stands.
    let radian = format!("{class}<compiler angle='degree'/><compiler angle='radian'/>");
    let hinge = &joints(&radian, "<joint ref='2' springref='3'/>")[0];
    assert_eq!((hinge.limits.lower, hinge.limits.upper, hinge.reference, hinge.rest), (-90.0, 180.0, 2.0, 3.0));
}

#[test]
fn classes_inherit_what_they_do_not_say() {
    let classes = "<default><default class='a'><default class='b'><joint damping='3'/></default></default>\
                   <joint damping='1' armature='2' axis='1 0 0'/></default>\
                   <default><joint stiffness='4'/><default class='c'/></default>";
    let joint = |text| {
        let joint = joints(classes, text).remove(0);
        (joint.damping, joint.armature, joint.stiffness, joint.axis)
    };
    let x = [1.0, 0.0, 0.0];
    assert_eq!(joint("<joint/>"), (1.0, 2.0, 4.0, x));
    assert_eq!(joint("<joint class='main'/>"), (1.0, 2.0, 4.0, x));
    // Classes are as their parents were when they were made: before the second section.
    assert_eq!(joint("<joint class='a'/>"), (1.0, 2.0, 0.0, x));
    assert_eq!(joint("<joint class='b' armature='9'/>"), (3.0, 9.0, 0.0, x));
    assert_eq!(joint("<joint class='c'/>"), (1.0, 2.0, 4.0, x));
    assert_eq!(joint("<frame childclass='b'><joint/></frame>"), (3.0, 2.0, 0.0, x));
}

#[test]
fn what_limits_is_inferred_unless_the_compiler_says_not() {
    let kind = |sections, text| joints(sections, text)[0].kind;
    assert_eq!(kind("", "<joint range='0 90'/>"), JointKind::Revolute);
    assert_eq!(kind("", "<joint range='0 0'/>"), JointKind::Continuous);
    assert_eq!(kind("", "<joint range='0 90' limited='false'/>"), JointKind::Continuous);
    assert_eq!(kind("", "<joint range='0 90' limited='auto'/>"), JointKind::Revolute);
    let off = "<compiler autolimits='false'/>";
    assert_eq!(kind(off, "<joint range='0 90' limited='true'/>"), JointKind::Revolute);
    assert_eq!(kind(off, "<joint/>"), JointKind::Continuous);
    let effort = |text: &str| joints("", text)[0].limits.effort;
    assert_eq!(effort("<joint actuatorfrcrange='-3 3'/>"), 3.0);
    assert_eq!(effort("<joint actuatorfrcrange='-3 2'/>"), 3.0);
    assert_eq!(effort("<joint actuatorfrcrange='-3 2' actuatorfrclimited='false'/>"), f64::INFINITY);
}

#[test]
fn what_has_no_name_gets_one() {
    let named = format!("<body name='body1'>{INERTIAL}<joint name='joint1'/><joint/></body>");
    let robot = world(&format!("<body>{named}</body><body>{INERTIAL}<joint/></body>"));
    let links: Vec<_> = robot.links.iter().map(|link| link.name.as_str()).collect();
    assert_eq!(links, ["world", "body1_", "body1/joint1", "body1", "body3"]);
    let joints: Vec<_> = robot.joints.iter().map(|joint| joint.name.as_str()).collect();
    assert_eq!(joints, ["body1_/fixed", "joint1", "joint1_", "joint2"]);
}

#[test]
fn gravity_is_that_of_mujoco_unless_the_file_says_else() {
    let gravity = |option: &str| read(&format!("<mujoco>{option}<worldbody/></mujoco>")).gravity.unwrap();
    assert_eq!(gravity(""), [0.0, 0.0, -9.81]);
    assert_eq!(gravity("<option timestep='0.1'/><option gravity='0 1 0'/><option/>"), [0.0, 1.0, 0.0]);
    assert_eq!(gravity("<option gravity='0 1 0'><flag gravity='disable'/></option>"), [0.0; 3]);
}

#[test]
fn joints_follow_others_about_their_references() {
    let file = |equality: &str| {
        let body = |(name, reference)| {
            format!("<body name='{name}'><joint name='{name}' ref='{reference}'/>{INERTIAL}</body>")
        };
        let bodies = [("a", 90), ("b", 180), ("c", 0)].map(body).concat();
        read(&format!(
            "<mujoco><default><default class='off'><equality active='false'/></default></default>\
             <worldbody>{bodies}</worldbody><equality>{equality}</equality></mujoco>"
        ))
    };
    // q_a - pi / 2 = 0.25 + 2 (q_b - pi)
    let robot = file("<joint joint1='a' joint2='b' polycoef='0.25 2'/><connect active='false' body1='a'/>");
    let mimic = robot.joints[0].mimic.unwrap();
    assert_eq!((mimic.joint, mimic.ratio), (1, 2.0));
    assert!((mimic.offset - (0.25 - 1.5 * std::f64::consts::PI)).abs() < 1e-15);
    assert_eq!(robot.warnings, ["connect: `connect` that is not active is ignored (line 1)"]);
    assert_eq!(file("<joint joint1='b' joint2='c' class='off'/>").joints[1].mimic, None);
    // Chains lead to the joint that follows none.
    let robot = file("<joint joint1='c' joint2='b' polycoef='0 3'/><joint joint1='b' joint2='a' polycoef='0 -1'/>");
    assert_eq!(robot.joints[2].mimic.unwrap().joint, 0);
    assert_eq!(robot.joints[2].mimic.unwrap().ratio, -3.0);
}

#[test]
fn inertia_comes_from_where_the_compiler_says() {
    let body = "<worldbody><body name='a'><joint/><inertial pos='1 0 0' mass='5' diaginertia='1 1 1'/>\
                <geom size='1' mass='2'/></body>\
                <body name='b'><joint armature='1'/><geom size='1' mass='3'/></body></worldbody>";
    let masses = |compiler: &str| {
        let robot = read(&format!("<mujoco><compiler {compiler}/>{body}</mujoco>"));
        [1, 2].map(|link| robot.links[link].inertia.map(|inertia| inertia.mass))
    };
    assert_eq!(masses(""), [Some(5.0), Some(3.0)]);
    assert_eq!(masses("inertiafromgeom='true'"), [Some(2.0), Some(3.0)]);
    assert_eq!(masses("inertiafromgeom='false'"), [Some(5.0), None]);
    assert_eq!(masses("inertiafromgeom='false' boundmass='4'"), [Some(5.0), Some(4.0)]);
    // Nothing is said of meshes whose inertia has no meaning: in bodies that cannot move, and without mass.
    let asset = "<asset><mesh name='m' file='m.obj'/></asset>";
    let still = "<body name='a'><geom type='mesh' mesh='m'/></body>";
    let light = "<body><joint armature='1'/><geom mesh='m' type='mesh' mass='0'/></body>";
    let robot = read(&format!("<mujoco>{asset}<worldbody>{still}{light}</worldbody></mujoco>"));
    assert_eq!((robot.links[1].inertia, robot.links[2].inertia), (None, None));
}

#[test]
fn meshes_that_are_shown_are_found() {
    let file = |compiler: &str, geom: &str| {
        let meshes = "<mesh file='sub/m.obj'/><mesh name='n' class='main' file='n.stl' scale='1 2 3' refpos='1 1 1'/>\
                      <mesh name='turned' file='n.stl' refpos='1 0 0' refquat='1 0 0 1'/>\
                      <mesh name='inline' vertex='0 0 0'/>";
        let mut robot = read(&format!(
            "<mujoco><compiler meshdir='assets' {compiler}/><default><mesh scale='2 2 2'/></default>\
             <asset>{meshes}</asset><worldbody><geom pos='1 0 0' type='mesh' {geom}/></worldbody></mujoco>"
        ));
        robot.links.remove(0).meshes
    };
    let shifted = Pose::at([1.0, 0.0, 0.0]);
    let mesh = |path: &str, pose, scale| vec![Mesh { path: path.into(), pose, scale }];
    assert_eq!(file("", "mesh='m'"), mesh("assets/sub/m.obj", shifted, [2.0; 3]));
    assert_eq!(file("strippath='true'", "mesh='m'"), mesh("assets/m.obj", shifted, [2.0; 3]));
    assert_eq!(file("", "mesh='n'"), mesh("assets/n.stl", Pose::at([0.0, -2.0, -3.0]), [1.0, 2.0, 3.0]));
    // The vertex v = (3, 3, 3) is at R' (2 v - 2 p) in the geom.
    let turned = &file("", "mesh='turned'")[0];
    let vertex = turned.pose.apply([6.0; 3]);
    for (entry, expected) in vertex.into_iter().zip([1.0 + 6.0, -(6.0 - 2.0), 6.0]) {
        assert!((entry - expected).abs() < 1e-14, "{vertex:?}");
    }
    // Shapes for contact, fitted shapes and meshes without a file are not shown.
    assert_eq!(file("", "mesh='m' group='3'"), []);
    assert_eq!(file("", "mesh='inline'"), []);
    // Nor are those that lead out of the folder.
    let far = "<mujoco><asset><mesh name='m' file='../../m.obj'/></asset><worldbody><geom type='mesh' mesh='m'/></worldbody></mujoco>";
    let robot = parse(far, "robot.xml", &LoadOptions::default()).unwrap();
    assert_eq!(robot.links[0].meshes, []);
    let why = "is outside the robot file's folder and all package roots";
    assert_eq!(robot.warnings, [format!("mesh `../../m.obj` is left out: it {why} (line 1)")]);
}

#[test]
fn what_is_not_modelled_is_listed_once() {
    let robot = read(
        "<mujoco>\n<compiler fusestatic='true'/>\n\
         <option density='1.2'><flag spring='disable'/></option>\n\
         <size/><statistic/><visual><map/></visual><custom/><sesnor/>\n\
         <asset><texture/><material/><texture/></asset><default><motor/><jiont/></default>\n\
         <worldbody><camera/><light/><body name='a' gravcomp='1' mocap='false'>\n\
         <joint actuatorfrcrange='-1 2' rnage='1 2'/><inertial pos='0 0 0' mass='1'/><geom size='1' cocon='1'/>\n\
         <site/><camera/><plugin/><jiont/></body></worldbody>\n\
         <tendon/><contact/>\n</mujoco>",
    );
    let expected = [
        "unknown `sesnor` in `mujoco` is ignored; did you mean `sensor`? (line 4)",
        "element `tendon` is ignored (line 9)",
        "element `contact` is ignored (line 9)",
        "`density` of `option` is left out: no medium slows the robot down (line 3)",
        "`spring` of `flag` is left out: what it disables acts nonetheless (line 3)",
        "unknown `jiont` in `default` is ignored; did you mean `joint`? (line 5)",
        "`texture` elements are ignored (2 of them, first at line 5)",
        "element `material` is ignored (line 5)",
        "`camera` elements are ignored (2 of them, first at line 6)",
        "element `light` is ignored (line 6)",
        "`gravcomp` of bodies is left out: gravity acts on them (line 6)",
        "element `plugin` is ignored (line 8)",
        "unknown `jiont` in `body` is ignored; did you mean `joint`? (line 8)",
        "joint of body `a`: attribute `rnage` is not known and is ignored; did you mean `range`? (line 7)",
        "joint of body `a`: its `actuatorfrcrange` is not symmetric; the greater bound is taken for both directions \
         (line 7)",
        "inertial of body `a`: it has neither `diaginertia` nor `fullinertia`, and is taken as a point (line 7)",
        "geom of body `a`: attribute `cocon` is not known and is ignored; did you mean `condim`? (line 7)",
    ];
    assert_eq!(robot.warnings, expected);
}

#[test]
fn cutoffs_of_sensors_are_told() {
    let robot = read(
        "<mujoco>\n<worldbody><body><joint name='j' type='hinge'/><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/></body>\n\
         </worldbody>\n<sensor><jointpos name='angle' joint='j' cutoff='0.1'/></sensor>\n</mujoco>",
    );
    assert_eq!(robot.sensors.len(), 1);
    assert_eq!(robot.warnings, ["jointpos `angle`: its `cutoff` is left out (line 4)"]);
}

/// Tendons are left out; those that exert forces, of their own or by a default, change the motion.
#[test]
fn tendons_that_exert_forces_are_told() {
    let with = |default: &str, tendon: &str| {
        let text = format!(
            "<mujoco>\n<default><tendon {default}/></default>\n<worldbody><body><joint name='j' type='hinge'/>\n\
             <inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/></body></worldbody>\n\
             <tendon><fixed name='spr' {tendon}><joint joint='j' coef='1'/></fixed></tendon>\n</mujoco>"
        );
        read(&text).left_out_forces
    };
    let said = |means: &str| vec![format!("tendon `spr` is left out, with its {means} (line 5)")];
    assert_eq!(with("", "stiffness='200' springlength='0.9'"), said("spring (`stiffness`)"));
    assert_eq!(with("damping='1'", ""), said("damper (`damping`)"));
    assert_eq!(with("", "range='0 0.3'"), said("limit (`range`)"));
    assert_eq!(with("range='0 0.3'", "limited='false'"), Vec::<String>::new());
    for still in ["", "range='0 0.3' limited='false'", "stiffness='0' damping='0 0 0'"] {
        assert_eq!(with("", still), Vec::<String>::new(), "{still}");
    }
}

/// Meshes are only drawn: the first of one name is, and that is said.
#[test]
fn the_first_mesh_of_a_name_is_drawn() {
    let robot = read(&format!(
        "<mujoco><asset><mesh file='a/m.obj'/>\n<mesh file='b/m.stl'/></asset><worldbody><body name='b'>{INERTIAL}\
         <geom type='mesh' mesh='m' mass='0'/></body></worldbody></mujoco>"
    ));
    assert!(robot.links.iter().flat_map(|link| &link.meshes).all(|mesh| mesh.path.ends_with("a/m.obj")));
    let said = "mesh: it is ignored: there is another mesh `m`, at line 1 (line 2)";
    assert!(robot.warnings.contains(&said.to_owned()), "{:?}", robot.warnings);
}

/// What motors exert on their joints: the range of the control, by gain and gear, within that of the force and the joint's.
#[test]
fn motors_limit_the_efforts_of_their_joints() {
    let body = |name: &str, joint: &str| format!("<body name='{name}'><joint name='{name}' {joint}/>{INERTIAL}</body>");
    let bodies: String = [
        ("a", ""),
        ("b", ""),
        ("c", ""),
        ("d", "actuatorfrcrange='-3 3'"),
        ("e", ""),
        ("f", "actuatorfrcrange='-7 7'"),
    ]
    .map(|(name, joint)| body(name, joint))
    .concat();
    let robot = read(&format!(
        "<mujoco><worldbody>{bodies}</worldbody><actuator>\
         <motor joint='a' gear='10' ctrlrange='-2 1'/>\
         <motor joint='b' gear='-2' ctrlrange='-8 8' forcerange='-5 5'/>\
         <motor joint='c' ctrlrange='-1 1'/><motor name='two' joint='c' ctrlrange='-2 2'/>\
         <motor joint='d' gear='4' ctrlrange='-1 1'/>\
         <position joint='e' kp='9' ctrlrange='-1 1'/></actuator></mujoco>"
    ));
    let efforts: Vec<f64> = (0..6).map(|joint| robot.greatest_effort(joint)).collect();
    assert_eq!(efforts, [20.0, 10.0, 3.0, 3.0, f64::INFINITY, 7.0]);
}

#[test]
fn angles_in_another_unit_than_the_file_says_are_doubted() {
    let warnings = |unit: &str, ranges: &[&str], euler: &str| {
        let joint = |(i, range): (usize, &&str)| {
            format!("<body name='b{i}' euler='{euler}'><joint name='j{i}' range='{range}'/>{INERTIAL}</body>")
        };
        let bodies: String = ranges.iter().enumerate().map(joint).collect();
        let compiler = format!("<compiler angle='{unit}'/>");
        read(&format!("<mujoco>\n{compiler}\n<worldbody>\n{bodies}</worldbody></mujoco>")).warnings
    };
    let degrees = warnings("radian", &["-90 90", "-1.5 1.5"], "0 90 0");
    let says = [
        "joint `j0`: `range` = -90 90 is rad, but looks like degrees (line 4)",
        "body `b1`: `euler` = 0 90 0 is rad, but looks like degrees (line 4, and 1 more)",
    ];
    assert_eq!(degrees, says);
    assert_eq!(warnings("radian", &["-1.5 3", "-12.566 12.566"], "0 3.1416 0"), [""; 0]);
    let radians = warnings("degree", &["-1.5 1.5", "0 2.5"], "0 90 0");
    let says = "joint `j0`: `range` = -1.5 1.5 is in degrees, but looks like rad, as do the ranges of all hinges; files in \
                radians need `<compiler angle=\"radian\"/>` (line 4)";
    assert_eq!(radians, [says]);
    assert_eq!(warnings("degree", &["-1.57 1.57"], "0 0 0").len(), 1);
    // Ranges of degrees, of flexures, and a single one that is wider than any in radians.
    for ranges in [&["-1.5 1.5", "-90 90"][..], &["-5 5", "-2.5 2.5"], &["-5.5 5.5"], &["0 90"]] {
        assert_eq!(warnings("degree", ranges, "0 90 0"), [""; 0], "{ranges:?}");
    }
}

#[test]
fn limits_of_followers_of_equalities_limit_their_leaders() {
    let bodies: String = [("a", ""), ("b", "range='-30 60'")]
        .map(|(name, range)| format!("<body><joint name='{name}' {range}/>{INERTIAL}</body>"))
        .concat();
    let equality = "<equality><joint joint1='b' joint2='a' polycoef='0 -2'/></equality>";
    let robot = read(&format!("<mujoco><worldbody>{bodies}</worldbody>{equality}</mujoco>"));
    let limits = robot.joints[0].limits;
    assert_close("limits", [limits.lower, limits.upper], &[-30f64.to_radians(), 15f64.to_radians()]);
    assert_eq!(
        (robot.joints[0].kind, &*robot.joints[0].narrowed.position),
        (JointKind::Revolute, &["b".to_owned()][..])
    );
}
