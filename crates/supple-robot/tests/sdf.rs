//! SDF files: one robot written in several ways, and what is read of each element.
#![allow(clippy::unwrap_used, clippy::expect_used)]

use supple_robot::*;

/// Largest error of what is composed from other numbers.
const TOLERANCE: f64 = 1e-14;

/// A file of the tests.
fn file(name: &str) -> Robot {
    let path = format!("{}/tests/data_sdf_mjcf/{name}", env!("CARGO_MANIFEST_DIR"));
    load(path, &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"))
}

/// The robot in a text.
fn read(text: &str) -> Robot {
    parse(text, "robot.sdf", &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"))
}

/// A robot of version 1.9 whose model has `text` in it.
fn model(text: &str) -> Robot {
    read(&format!("<sdf version='1.9'><model name='m'>{text}</model></sdf>"))
}

/// A link without anything that matters.
fn link(name: &str, text: &str) -> String {
    format!("<link name='{name}'><inertial/>{text}</link>")
}

/// Links `a` and `b`, with `text` in the joint between them.
fn pair(kind: &str, text: &str) -> Robot {
    let joint = format!("<joint name='j' type='{kind}'><parent>a</parent><child>b</child>{text}</joint>");
    model(&(link("a", "") + &link("b", "") + &joint))
}

#[track_caller]
fn assert_close(found: impl IntoIterator<Item = f64>, expected: impl IntoIterator<Item = f64>) {
    let (found, expected): (Vec<f64>, Vec<f64>) = (found.into_iter().collect(), expected.into_iter().collect());
    assert_eq!(found.len(), expected.len());
    for (a, b) in found.iter().zip(&expected) {
        assert!((a - b).abs() <= TOLERANCE, "{found:?} instead of {expected:?}");
    }
}

fn entries(pose: &Pose) -> impl Iterator<Item = f64> {
    pose.rotation.into_iter().flatten().chain(pose.position)
}

/// Where the base of the arm is in the world where a file gives it a place, as `convert.py` prints it.
const BASE: Pose = Pose {
    rotation: [
        [0.966933601251816, -0.14986233274948813, 0.20635089530475914],
        [0.25484592234475234, 0.5983842332673581, -0.759598489493817],
        [-0.009641920682440167, 0.7870689871923031, 0.6167896260197927],
    ],
    position: [1.4643747640017821, 2.1026866970614795, 3.271682757651076],
};

#[test]
fn an_arm_is_the_same_in_urdf_and_sdf() {
    let expected = file("arm.urdf");
    let tree = Tree::new(&expected);
    let numbers = Numbers::<f64>::of(&expected, [0.0, 0.0, -9.8]);
    for (name, base) in [("arm_in_model.sdf", BASE), ("arm_relative.sdf", BASE), ("arm_at_base.sdf", Pose::IDENTITY)] {
        let robot = file(name);
        let own_tree = Tree::new(&robot);
        let own = Numbers::<f64>::of(&robot, base.rotate([0.0, 0.0, -9.8]));
        assert_eq!((robot.name.as_str(), own_tree.dofs()), ("arm", 3), "{name}");
        let place: Vec<_> =
            tree.joints().iter().map(|joint| own_tree.joints().iter().position(|own| own == joint).unwrap()).collect();
        for step in 0..3 {
            let q = [0.3, -0.7, 0.02].map(|position| position * f64::from(step));
            let v = [0.5, 0.6, -0.7].map(|velocity| velocity * f64::from(step));
            let (mut own_q, mut own_v) = (q, v);
            place.iter().enumerate().for_each(|(i, &place)| (own_q[place], own_v[place]) = (q[i], v[i]));
            let kinematics = Kinematics::of(&tree, &numbers, &q, &v);
            let own_kinematics = Kinematics::of(&own_tree, &own, &own_q, &own_v);
            for (link, pose) in expected.links.iter().zip(kinematics.poses()) {
                let own = robot.link(&link.name).unwrap();
                assert_close(entries(&own_kinematics.poses()[own]), entries(&base.compose(pose)));
                assert_close(
                    robot.links[own].inertia.unwrap().moment.into_iter().flatten(),
                    link.inertia.unwrap().moment.into_iter().flatten(),
                );
                assert_eq!(robot.links[own].inertia.unwrap().mass, link.inertia.unwrap().mass);
                assert_eq!(robot.links[own].inertia.unwrap().center, link.inertia.unwrap().center);
            }
            let mass = mass_matrix(&tree, &numbers, &kinematics);
            let own_mass = mass_matrix(&own_tree, &own, &own_kinematics);
            let place = &place;
            let own_mass = place.iter().flat_map(|&i| place.iter().map(move |&j| (i, j))).map(|(i, j)| own_mass[i][j]);
            assert_close(own_mass, mass.into_iter().flatten());
            let force = bias(&tree, &numbers, &kinematics, &q, &v, 0.1);
            let own_force = bias(&own_tree, &own, &own_kinematics, &own_q, &own_v, 0.1);
            let largest = force.iter().fold(1.0, |largest: f64, force| largest.max(force.abs()));
            assert_close(place.iter().map(|&i| own_force[i] / largest), force.iter().map(|force| force / largest));
        }
        for joint in &expected.joints {
            let own = &robot.joints[robot.joint(&joint.name).unwrap()];
            assert_eq!((own.kind, own.limits), (joint.kind, joint.limits), "{name}, {}", joint.name);
            assert_eq!((own.damping, own.friction), (joint.damping, joint.friction));
            if let (Some(own), Some(mimic)) = (own.mimic, joint.mimic) {
                assert_eq!(robot.joints[own.joint].name, expected.joints[mimic.joint].name);
                assert_close([own.ratio, own.offset], [mimic.ratio, mimic.offset]);
            } else {
                assert!(own.mimic.is_none() && joint.mimic.is_none());
            }
        }
    }
}

#[test]
fn a_model_that_nothing_attaches_is_fixed_in_the_world() {
    let robot = file("arm_at_base.sdf");
    assert_eq!(robot.links[0].name, "base");
    let said = "link `base`: no joint attaches it to anything; it is treated as fixed to the world (line 3)";
    assert_eq!(robot.warnings, [said]);

    let robot = file("arm_relative.sdf");
    assert_eq!((robot.links[0].name.as_str(), robot.joints[0].name.as_str()), ("world", "world/base"));
    assert_eq!(robot.gravity, Some([0.0, 0.0, -9.8]));
    assert_eq!(robot.warnings.len(), 2, "{:?}", robot.warnings);

    let robot = file("arm_in_model.sdf");
    assert_eq!((robot.links[0].name.as_str(), robot.joints[0].name.as_str()), ("world", "world/base"));
    assert_eq!((robot.gravity, robot.warnings), (None, vec![]));

    let two = model(&(link("a", "") + &link("b", "<pose>1 2 3 0 0 0</pose>") + "<static>1</static>"));
    let names: Vec<_> = two.joints.iter().map(|joint| joint.name.as_str()).collect();
    assert_eq!(names, ["world/a", "world/b"]);
    assert_eq!(two.joints[1].origin, Pose::at([1.0, 2.0, 3.0]));
    assert_eq!(two.warnings.len(), 2, "only those of the empty `inertial`s: {:?}", two.warnings);
}

#[test]
fn frames_are_on_the_links_that_they_move_with() {
    let robot = file("arm_relative.sdf");
    let frames: Vec<_> =
        robot.frames.iter().map(|frame| (frame.name.as_str(), robot.links[frame.link].name.as_str())).collect();
    assert_eq!(frames, [("mount", "base"), ("on_elbow", "lower"), ("tool", "lower")]);
    // At positions 0, the tool is half a metre from the nail.
    let tree = Tree::new(&robot);
    let kinematics = Kinematics::at_rest(&tree, &Numbers::<f64>::of(&robot, [0.0; 3]), &[0.0; 3]);
    let (link, pose) = robot.frame("tool").unwrap();
    let tool = kinematics.poses()[link].compose(&pose);
    let nail = kinematics.poses()[robot.link("nail").unwrap()];
    assert_close(entries(&tool), entries(&nail.compose(&Pose::at([0.0, 0.0, 0.5]))));
}

#[test]
fn places_are_relative_to_what_the_version_says() {
    let text = |version: &str| {
        let links = link("a", "<pose>1 0 0 0 0 0</pose>") + &link("b", "<pose frame='a'>0 1 0 0 0 0</pose>");
        let joint = "<joint name='j' type='fixed'><pose>0 0 1 0 0 0</pose><parent>a</parent><child>b</child></joint>";
        read(&format!("<sdf version='{version}'><model name='m'>{links}{joint}</model></sdf>"))
    };
    // A joint is placed in its child, in all versions.
    let old = text("1.6");
    assert_eq!(old.joints[1].child_pose, Pose::at([0.0, 0.0, -1.0]));
    assert_eq!(old.joints[1].origin, Pose::at([0.0, 1.0, 1.0]));
    // The attribute `frame` has no meaning from 1.7 on.
    let new = text("1.7");
    assert_eq!(new.joints[1].origin, Pose::at([-1.0, 1.0, 1.0]));
    assert!(new.warnings.contains(&"attribute `frame` of `pose` is ignored (line 1)".to_owned()));
}

#[test]
fn axes_are_in_the_frame_that_is_said() {
    let turned = "<pose>0 0 0 0 0 1.5707963267948966</pose>";
    let joint = |version: &str, xyz: &str| {
        let links = link("a", "") + &link("b", turned);
        let joint = "<joint name='j' type='revolute'><parent>a</parent><child>b</child><axis>";
        let text = format!("<sdf version='{version}'><model name='m'>{links}{joint}{xyz}</axis></joint></model></sdf>");
        read(&text).joints[0].axis
    };
    let x = "<xyz>1 0 0</xyz>";
    assert_eq!(joint("1.6", x), [1.0, 0.0, 0.0]);
    assert_eq!(joint("1.6", &format!("{x}<use_parent_model_frame>0</use_parent_model_frame>")), [1.0, 0.0, 0.0]);
    assert_eq!(joint("1.6", &format!("{x}<use_parent_model_frame>true</use_parent_model_frame>")), [0.0, -1.0, 0.0]);
    assert_eq!(joint("1.4", x), [0.0, -1.0, 0.0]);
    assert_eq!(joint("1.7", "<xyz expressed_in='__model__'>0 2 0</xyz>"), [1.0, 0.0, 0.0]);
    assert_eq!(joint("1.7", "<xyz expressed_in='a'>0 2 0</xyz>"), [1.0, 0.0, 0.0]);
    assert_eq!(joint("1.7", "<xyz expressed_in='b'>0 2 0</xyz>"), [0.0, 1.0, 0.0]);
    assert_eq!(joint("1.7", "<xyz expressed_in=''>0 2 0</xyz>"), [0.0, 1.0, 0.0]);
}

#[test]
fn limits_springs_and_losses_are_read() {
    let axis = |text: &str| format!("<axis><xyz>0 0 2</xyz>{text}</axis>");
    let robot = pair(
        "prismatic",
        &axis(
            "<limit><lower>-1</lower><upper>2</upper><effort>3</effort><velocity>4</velocity></limit><dynamics>\
             <damping>5</damping><friction>6</friction><spring_stiffness>7</spring_stiffness>\
             <spring_reference>0.5</spring_reference></dynamics>",
        ),
    );
    let joint = &robot.joints[0];
    assert_eq!((joint.kind, joint.axis), (JointKind::Prismatic, [0.0, 0.0, 1.0]));
    assert_eq!(joint.limits, Limits { lower: -1.0, upper: 2.0, effort: 3.0, velocity: 4.0 });
    assert_eq!((joint.damping, joint.friction, joint.stiffness, joint.rest), (5.0, 6.0, 7.0, 0.5));

    // What SDF writes for a limit that is none.
    for none in [
        "",
        "<limit/>",
        "<limit><lower>-1e16</lower><upper>1e16</upper><effort>-1</effort><velocity>-1</velocity></limit>",
        "<limit><lower>-inf</lower><upper>inf</upper><effort>inf</effort><velocity>inf</velocity></limit>",
        "<limit><lower>-1.79769e+308</lower><upper>1.79769e+308</upper></limit>",
    ] {
        let joint = &pair("revolute", &axis(none)).joints[0];
        assert_eq!((joint.kind, joint.limits), (JointKind::Continuous, Limits::default()), "{none}");
    }
    let half = pair("revolute", &axis("<limit><lower>0</lower></limit>"));
    assert_eq!((half.joints[0].kind, half.joints[0].limits.lower), (JointKind::Revolute, 0.0));
    let free = pair("continuous", &axis("<limit><lower>0</lower><upper>1</upper></limit>"));
    assert_eq!(free.joints[0].limits, Limits::default());
    assert!(free.warnings.iter().any(|warning| warning.contains("they are ignored")), "{:?}", free.warnings);
}

#[test]
fn inertia_that_is_not_given_is_that_of_the_format() {
    let robot = model("<link name='a'/><link name='b'><inertial><mass>2</mass></inertial></link>");
    let unit = Pose::IDENTITY.rotation;
    let inertia = |mass| Some(Inertia { mass, center: [0.0; 3], moment: unit });
    assert_eq!(robot.links[1].inertia, inertia(1.0));
    assert_eq!(robot.links[2].inertia, inertia(2.0));
    let said = "link `a`: it has no `inertial`; the SDF default is used: 1 kg and 1 kg m^2 about each axis (line 1)";
    assert!(robot.warnings.contains(&said.to_owned()), "{:?}", robot.warnings);
    let said = "inertial of link `b`: it has no `inertia`; the SDF default is used: 1 kg m^2 about each axis (line 1)";
    assert!(robot.warnings.contains(&said.to_owned()), "{:?}", robot.warnings);

    // Axes turned by a right angle about z: x and y change places.
    let turned = "<inertial><pose>1 2 3 0 0 1.5707963267948966</pose><mass>1</mass>\
                  <inertia><ixx>2</ixx><iyy>3</iyy><izz>4</izz><ixy>0.1</ixy></inertia></inertial>";
    let robot = model(&format!("<link name='a'>{turned}</link>"));
    let inertia = robot.links[0].inertia.unwrap();
    assert_eq!(inertia.center, [1.0, 2.0, 3.0]);
    assert_eq!(inertia.moment, [[3.0, -0.1, 0.0], [-0.1, 2.0, 0.0], [0.0, 0.0, 4.0]]);
}

#[test]
fn what_is_not_modelled_is_listed_once() {
    let robot = read(
        "<sdf version='1.6' xmlns:x='http://example.com/x'>\n<world name='w'><light/><gravity>0 0 -1.6</gravity><physics/>\n<model name='m'>\n\
         <link name='a'><inertial><mass>1</mass><inertia/></inertial><collision/><sensor/><sensor/>\n\
         <gravity>0</gravity><kinematic>1</kinematic><visual/><velocity_decay/><x:own/></link>\n\
         <plugin/><lnik name='b'/>\n<joint name='j' type='fixed'><parent>world</parent><child>a</child><physics/></joint>\n\
         </model></world></sdf>",
    );
    assert_eq!(robot.gravity, Some([0.0, 0.0, -1.6]));
    let expected = [
        "element `light` is ignored (line 2)",
        "`physics` elements are ignored (2 of them, first at line 2)",
        "element `plugin` is ignored (line 6)",
        "unknown `lnik` in `model` is ignored; did you mean `link`? (line 6)",
        "`sensor` elements are ignored (2 of them, first at line 4)",
        "element `velocity_decay` is ignored (line 5)",
        "element `x:own` is ignored (line 5)",
        "link `a`: gravity is applied although the file disables it (line 4)",
        "link `a`: treated as dynamic although the file says kinematic (line 4)",
    ];
    assert_eq!(robot.warnings, expected);
}

#[test]
fn meshes_of_visuals_are_found() {
    let visual = |uri: &str, more: &str| {
        let mesh = format!("<geometry><mesh><uri>{uri}</uri>{more}</mesh></geometry>");
        format!(
            "<link name='a'><inertial><mass>1</mass><inertia/></inertial><visual name='v'><pose>1 0 0 0 0 0</pose>{mesh}</visual></link>"
        )
    };
    let robot = model(&visual("meshes/a.dae", "<scale>1 2 3</scale>"));
    let expected = Mesh { path: "meshes/a.dae".into(), pose: Pose::at([1.0, 0.0, 0.0]), scale: [1.0, 2.0, 3.0] };
    assert_eq!(robot.links[0].meshes, [expected]);
    let robot = model(&visual("model://somewhere/a.dae", ""));
    assert_eq!(robot.links[0].meshes, []);
    assert!(robot.warnings.iter().any(|warning| warning.contains("somewhere")), "{:?}", robot.warnings);
}

#[test]
fn versions_that_are_not_known_are_warned_of() {
    let text =
        |version| format!("<sdf version='{version}'><model name='m'><static>1</static>{}</model></sdf>", link("a", ""));
    let first = |version| read(&text(version)).warnings[0].clone();
    assert_eq!(first("1.5"), "sdf: version 1.5 is older than 1.6: it is read as 1.6, with axes as in 1.5 (line 1)");
    assert_eq!(first("2.0"), "sdf: version 2.0 is newer than 1.12, and is read as if it were 1.12 (line 1)");
    assert!(!first("1.12").contains("version"));
}

/// Converters call the first link `world`: it is that link of the robot.
#[test]
fn a_link_may_be_called_world() {
    let joint =
        "<joint name='j' type='revolute'><parent>world</parent><child>b</child><axis><xyz>0 0 1</xyz></axis></joint>";
    let robot = model(&(link("world", "") + &link("b", "<pose>0 0 1 0 0 0</pose>") + joint));
    assert_eq!((robot.links.len(), robot.links[0].name.as_str(), robot.joints[0].parent), (2, "world", 0));
    let said = "link `world`: `world` is the name of the world frame; here a link of the robot has this name (line 1)";
    assert!(robot.warnings.contains(&said.to_owned()), "{:?}", robot.warnings);
    // Placed elsewhere, it needs a world with another name.
    let robot = model(&(link("world", "<pose>1 0 0 0 0 0</pose>") + &link("b", "") + joint));
    let links: Vec<_> = robot.links.iter().map(|link| link.name.as_str()).collect();
    assert_eq!((links, robot.joints[0].origin.position), (vec!["__world__", "world", "b"], [1.0, 0.0, 0.0]));
}

#[test]
fn poses_in_degrees_are_doubted() {
    let joint = |pose: &str| pair("revolute", &format!("{pose}<axis><xyz>0 0 1</xyz></axis>")).warnings;
    let doubts = |pose: &str| joint(pose).into_iter().filter(|warning| warning.contains("degrees")).count();
    let warnings = joint("<pose>0 0 0 0 90 0</pose>");
    let says = "pose of joint `j`: the angles 0 90 0 are rad, but look like degrees; for those, set `degrees=\"true\"`";
    assert!(warnings.iter().any(|warning| warning.starts_with(says)), "{warnings:?}");
    assert_eq!(doubts("<pose>0 0 0 0 1.5 0</pose>") + doubts("<pose degrees='true'>0 0 0 0 90 0</pose>"), 0);
}
