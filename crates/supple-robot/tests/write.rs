//! Robots written as MJCF and read again are the same robots.

#![allow(clippy::unwrap_used, clippy::expect_used)]

use std::path::{Path, PathBuf};

use supple_robot::*;

/// Largest difference, relative to the largest entry.
const TOLERANCE: f64 = 1e-9;

/// All robot files of the repository that are read without an error.
fn shipped() -> Vec<(PathBuf, Robot)> {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let folders = ["../../models", "tests/data_sdf_mjcf", "tests/data_equipment", "tests/data/arm"];
    let entries = folders.iter().flat_map(|folder| std::fs::read_dir(here.join(folder)).into_iter().flatten());
    let mut paths: Vec<_> = entries.map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    let known = |path: &Path| path.extension().is_some_and(|end| ["urdf", "sdf", "xml"].iter().any(|one| end == *one));
    let read = |path: PathBuf| load(&path, &LoadOptions::default()).ok().map(|robot| (path, robot));
    paths.into_iter().filter(|path| known(path)).filter_map(read).collect()
}

/// Boxes, balls and the like are the same from all formats, but for those that a viewer hides, and written again.
#[test]
fn visual_shapes_are_read_and_written() {
    let urdf = "<robot name='m'><link name='a'>\
        <visual><origin xyz='1 2 3'/><geometry><box size='.2 .4 .6'/></geometry></visual>\
        <visual><geometry><sphere radius='.1'/></geometry></visual>\
        <visual><geometry><cylinder radius='.1' length='.4'/></geometry></visual>\
        <visual><origin rpy='0 0 .5'/><geometry><capsule radius='.1' length='.4'/></geometry></visual></link></robot>";
    let shape = |shape: &str, pose: &str| format!("<visual name='v'>{pose}<geometry>{shape}</geometry></visual>");
    let size = "<radius>.1</radius><length>.4</length>";
    let sdf = format!(
        "<sdf version='1.9'><model name='m'><static>1</static><link name='a'>\
         {}{}{}{}<visual name='p'><geometry><plane/></geometry></visual></link></model></sdf>",
        shape("<box><size>.2 .4 .6</size></box>", "<pose>1 2 3 0 0 0</pose>"),
        shape("<sphere><radius>.1</radius></sphere>", ""),
        shape(&format!("<cylinder>{size}</cylinder>"), ""),
        shape(&format!("<capsule>{size}</capsule>"), "<pose>0 0 0 0 0 .5</pose>"),
    );
    let xml = "<mujoco><compiler angle='radian'/><worldbody><body name='a'>\
        <geom type='box' size='.1 .2 .3' pos='1 2 3'/><geom size='.1'/><geom type='cylinder' size='.1 .2'/>\
        <geom type='capsule' size='.1 .2' euler='0 0 .5'/>\
        <geom size='.3' group='3'/><geom size='.3' rgba='1 0 0 0'/><geom type='plane' size='1 1 1'/>\
        </body></worldbody></mujoco>";
    let expected = [
        (Solid::Box { size: [0.2, 0.4, 0.6] }, Pose::at([1.0, 2.0, 3.0])),
        (Solid::Sphere { radius: 0.1 }, Pose::IDENTITY),
        (Solid::Cylinder { radius: 0.1, length: 0.4 }, Pose::IDENTITY),
        (Solid::Capsule { radius: 0.1, length: 0.4 }, Pose::from_rpy([0.0; 3], [0.0, 0.0, 0.5])),
    ];
    for (name, text) in [("m.urdf", urdf), ("m.sdf", &sdf), ("m.xml", xml)] {
        let robot = parse(text, name, &LoadOptions::default()).unwrap();
        for robot in [again(&robot), robot] {
            let link = robot.links.iter().find(|link| link.name == "a").unwrap();
            assert_eq!(link.primitives.len(), expected.len(), "{name}");
            for (found, (solid, pose)) in link.primitives.iter().zip(expected) {
                assert_eq!(found.solid, solid, "{name}");
                let off = |p: [f64; 3]| (0..3).map(|i| (found.pose.apply(p)[i] - pose.apply(p)[i]).abs()).sum::<f64>();
                assert!(off([1.0, 0.0, 0.0]) < 1e-14 && off([0.0, 1.0, 1.0]) < 1e-14, "{name}: {found:?}");
            }
        }
    }
}

/// A shape that cannot be drawn is left out of the picture, not of the robot.
#[test]
fn visual_shapes_without_sizes_are_warned_of() {
    for (shape, why) in [
        ("<box size='1 0 1'/>", "its sizes must be positive"),
        ("<cylinder radius='.1'/>", "attribute `length` is missing"),
        ("<sphere radius='wide'/>", "`wide`"),
    ] {
        let text =
            format!("<robot name='m'><link name='a'><visual><geometry>{shape}</geometry></visual></link></robot>");
        let robot = parse(&text, "m.urdf", &LoadOptions::default()).unwrap();
        assert_eq!(robot.links[0].primitives, []);
        let [warning] = &robot.warnings[..] else { panic!("{:?}", robot.warnings) };
        assert!(warning.contains(": it is not drawn: ") && warning.contains(why), "{warning}");
    }
}

fn again(robot: &Robot) -> Robot {
    parse(&mjcf(robot).text, "again.xml", &LoadOptions::default()).unwrap()
}

/// Numbers from -1 to 1 that look random.
fn scattered(count: usize, seed: usize) -> Vec<f64> {
    (0..count).map(|i| ((i * 7919 + seed * 104_729 + 13) as f64 * 0.618_033_988_75).fract() * 2.0 - 1.0).collect()
}

/// Mass matrix and bias, by the names of joints in the order of `names`.
fn dynamics(robot: &Robot, names: &[String], seed: usize) -> Vec<f64> {
    let tree = Tree::new(robot);
    let place = |name: &String| names.iter().position(|known| known == name).expect("the same joints");
    let places: Vec<usize> = tree.joints().iter().map(place).collect();
    assert_eq!(places.len(), names.len());
    let (all_q, all_v) = (scattered(names.len(), seed), scattered(names.len(), seed + 1));
    let q: Vec<f64> = places.iter().map(|&place| all_q[place]).collect();
    let v: Vec<f64> = places.iter().map(|&place| all_v[place]).collect();
    let numbers = Numbers::of(robot, [0.3, -0.2, -9.81]);
    let kinematics = Kinematics::of(&tree, &numbers, &q, &v);
    let (mass, bias) = (mass_matrix(&tree, &numbers, &kinematics), bias(&tree, &numbers, &kinematics, &q, &v, 1e-2));
    let mut found = vec![0.0; names.len() * (names.len() + 1)];
    for (i, &row) in places.iter().enumerate() {
        for (j, &column) in places.iter().enumerate() {
            found[row * names.len() + column] = mass[i][j];
        }
        found[names.len() * names.len() + row] = bias[i];
    }
    found
}

fn assert_close(what: &str, found: &[f64], expected: &[f64]) {
    assert_eq!(found.len(), expected.len(), "{what}");
    let largest = expected.iter().fold(1e-12, |largest: f64, entry| largest.max(entry.abs()));
    for (found, expected) in found.iter().zip(expected) {
        assert!((found - expected).abs() <= TOLERANCE * largest, "{what}: {found} instead of {expected}");
    }
}

#[test]
fn what_is_written_and_read_again_has_the_same_dynamics() {
    let robots = shipped();
    assert!(robots.len() >= 10, "{} robots", robots.len());
    for (path, robot) in &robots {
        let (names, read) = (Tree::new(robot).joints().to_vec(), again(robot));
        for seed in 0..3 {
            let what = format!("{} at {seed}", path.display());
            assert_close(&what, &dynamics(&read, &names, seed), &dynamics(robot, &names, seed));
        }
    }
}

#[test]
fn frames_limits_and_losses_are_read_again() {
    for (path, robot) in shipped() {
        let read = again(&robot);
        for joint in robot.joints.iter().filter(|joint| joint.kind != JointKind::Fixed) {
            let found = &read.joints[read.joint(&joint.name).unwrap()];
            let numbers = |joint: &Joint| {
                [joint.damping, joint.friction, joint.armature, joint.stiffness, joint.rest, joint.reference]
            };
            assert_eq!(numbers(found), numbers(joint), "{}: {}", path.display(), joint.name);
            if joint.limits.lower.is_finite() && joint.limits.upper.is_finite() {
                assert_eq!((found.limits.lower, found.limits.upper), (joint.limits.lower, joint.limits.upper));
            }
            // MJCF takes a range without width for none, which is a warning.
            let left_out = mjcf(&robot).warnings.iter().any(|one| one.contains("limit of force of 0"));
            assert!(joint.limits.effort > 0.0 || left_out, "{}", joint.name);
            let effort = if joint.limits.effort > 0.0 { joint.limits.effort } else { f64::INFINITY };
            assert_eq!(found.limits.effort, effort);
        }
        for frame in &robot.frames {
            let (_, pose) = read.frame(&frame.name).unwrap();
            assert_close(&frame.name, &pose.position, &frame.pose.position);
            assert_close(&frame.name, &pose.rotation.concat(), &frame.pose.rotation.concat());
        }
    }
}

#[test]
fn equipment_is_read_again() {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let robot = load(here.join("tests/data_equipment/arm.xml"), &LoadOptions::default()).unwrap();
    assert!(!robot.actuators.is_empty() && !robot.sensors.is_empty() && !robot.keys.is_empty());
    let read = again(&robot);
    let joint = |robot: &Robot, index: usize| robot.joints[index].name.clone();
    let actuators = |robot: &Robot| {
        let all = robot.actuators.iter();
        all.map(|one| (one.name.clone(), joint(robot, one.joint), one.gear, one.law, one.control)).collect::<Vec<_>>()
    };
    assert_eq!(actuators(&read), actuators(&robot));
    let sensors = |robot: &Robot| {
        robot.sensors.iter().map(|one| (one.name.clone(), one.measures.name(), one.noise)).collect::<Vec<_>>()
    };
    assert_eq!(sensors(&read), sensors(&robot));
    for (key, expected) in read.keys.iter().zip(&robot.keys) {
        assert_eq!((&key.name, &key.controls), (&expected.name, &expected.controls));
        for (index, one) in robot.joints.iter().enumerate().filter(|(_, one)| one.kind != JointKind::Fixed) {
            let place = read.joint(&one.name).unwrap();
            assert_eq!(key.positions[place], expected.positions[index], "{}", one.name);
            assert_eq!(key.velocities[place], expected.velocities[index], "{}", one.name);
        }
    }
    let walls = |robot: &Robot| robot.walls.iter().map(|wall| (wall.name.clone(), wall.shape)).collect::<Vec<_>>();
    assert_eq!(walls(&read), walls(&robot));
}

#[test]
fn what_cannot_be_written_is_named() {
    let text = "<robot name='r'><link name='base'/><link name='arm &lt;1&gt;'><inertial><mass value='1'/>\
        <inertia ixx='1' iyy='1' izz='1' ixy='0' ixz='0' iyz='0'/></inertial></link><link name='bare'/>\
        <joint name='a' type='revolute'><parent link='base'/><child link='arm &lt;1&gt;'/>\
        <limit lower='-1' upper='1' effort='5' velocity='2'/></joint>\
        <joint name='b' type='continuous'><parent link='arm &lt;1&gt;'/><child link='bare'/></joint></robot>";
    let robot = parse(text, "r.urdf", &LoadOptions::default()).unwrap();
    let written = mjcf(&robot);
    assert!(written.text.contains("name=\"arm &lt;1&gt;\""), "{}", written.text);
    let warnings = written.warnings.join("\n");
    assert!(warnings.contains("joint `a`: MJCF has no speed limit; 2 is left out"), "{warnings}");
    assert!(warnings.contains("link `bare` moves and has no mass and no moments of inertia"), "{warnings}");
    assert!(written.text.contains("mass=\"1e-9\" diaginertia=\"1e-12 1e-12 1e-12\""), "{}", written.text);
    assert_eq!(again(&robot).link("arm <1>").map(|link| link > 0), Some(true));
}

/// Of impossible moments of inertia the nearest possible ones are written, by their principal axes.
#[test]
fn impossible_inertias_are_mended() {
    let link = |numbers: &str| {
        format!(
            "<robot name='r'><link name='base'/><link name='arm'><inertial><mass value='1'/><inertia {numbers}/></inertial>\
             </link><joint name='a' type='continuous'><parent link='base'/><child link='arm'/></joint></robot>"
        )
    };
    for (numbers, expected) in [
        ("ixx='1' iyy='2' izz='6' ixy='0' ixz='0' iyz='0'", [2.0, 3.0, 5.0]),
        ("ixx='1' iyy='4' izz='4' ixy='0' ixz='0' iyz='2'", [2.0, 3.0, 5.0]),
        ("ixx='0' iyy='2' izz='2' ixy='0' ixz='0' iyz='0'", [1e-12, 2.0, 2.0]),
        ("ixx='1' iyy='2' izz='3' ixy='0' ixz='0' iyz='0'", [1.0, 2.0, 3.0]),
    ] {
        let robot = parse(&link(numbers), "r.urdf", &LoadOptions::default()).unwrap();
        let written = mjcf(&robot);
        let read = again(&robot);
        let moment = |robot: &Robot| robot.links[robot.link("arm").unwrap()].inertia.unwrap().moment;
        let found = moment(&read);
        assert_close("trace", &[found[0][0] + found[1][1] + found[2][2]], &[expected.iter().sum()]);
        let changed = (0..9).any(|i| (found[i / 3][i % 3] - moment(&robot)[i / 3][i % 3]).abs() > 0.0);
        assert_eq!(written.text.contains("<!--"), changed, "{}", written.text);
        assert_eq!(written.warnings.iter().any(|one| one.contains("link `arm`")), changed);
    }
}
