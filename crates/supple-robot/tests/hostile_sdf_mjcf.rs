//! Broken and hostile SDF and MJCF files: each has its error, and none makes the reader panic or hang.
#![allow(clippy::unwrap_used, clippy::expect_used)]

#[path = "data_sdf_mjcf/broken_mjcf.rs"]
mod broken_mjcf;
#[path = "data_sdf_mjcf/broken_sdf.rs"]
mod broken_sdf;

use std::fmt::Write;
use std::time::{Duration, Instant};

use proptest::prelude::*;
use supple_robot::{LoadOptions, Robot, parse};

/// The robot, or the error as one line.
fn read(text: &str) -> Result<Robot, String> {
    parse(text, "robot.xml", &LoadOptions::default()).map_err(|error| error.to_string())
}

/// The robot or the error, within far more time than is needed, and far less than what grows with the square of the
/// size.
fn soon(text: &str) -> Result<Robot, String> {
    let start = Instant::now();
    let read = read(text);
    let took = start.elapsed();
    assert!(took < Duration::from_secs(5), "took {took:?}");
    read
}

fn check(cases: &[(&str, &str, &str)]) {
    let mut wrong = String::new();
    for (what, text, expected) in cases {
        let found = match read(text) {
            Ok(_) => "it loads".to_owned(),
            Err(error) => error,
        };
        if found != *expected {
            writeln!(wrong, "@{what}@{found}@{expected}").unwrap();
        }
    }
    assert!(wrong.is_empty(), "case, error and what it should be:\n{wrong}");
}

#[test]
fn every_broken_sdf_file_has_its_error() {
    check(broken_sdf::SDF);
}

#[test]
fn every_broken_mjcf_file_has_its_error() {
    check(broken_mjcf::MJCF);
}

/// An inertia for bodies whose inertia does not matter.
const INERTIAL: &str = "<inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/>";

#[test]
fn bodies_are_nested_up_to_the_limit() {
    let nested = |depth: usize| {
        let open: String = (0..depth).map(|i| format!("<body name='b{i}'><joint/>{INERTIAL}")).collect();
        format!("<mujoco><worldbody>{open}{}</worldbody></mujoco>", "</body>".repeat(depth))
    };
    assert_eq!(soon(&nested(250)).unwrap().links.len(), 251);
    let error = soon(&nested(10_000)).unwrap_err();
    assert!(error.ends_with("elements are nested more than 256 deep"), "{error}");
    let frames =
        format!("<mujoco><worldbody>{}<site/>{}</worldbody></mujoco>", "<frame>".repeat(250), "</frame>".repeat(250));
    assert_eq!(soon(&frames).unwrap().links.len(), 1);
    let classes: String = (0..250).map(|i| format!("<default class='c{i}'>")).collect();
    let classes = format!("<mujoco><default>{classes}{}</default><worldbody/></mujoco>", "</default>".repeat(250));
    assert_eq!(soon(&classes).unwrap().links.len(), 1);
}

#[test]
fn wide_mjcf_files_are_read_soon() {
    let body = |text: &str, times: usize| {
        format!("<mujoco><worldbody><body>{INERTIAL}{}</body></worldbody></mujoco>", text.repeat(times))
    };
    assert_eq!(soon(&body("<joint/>", 10_000)).unwrap().joints.len(), 10_000);
    assert_eq!(soon(&body("<geom size='1'/>", 100_000)).unwrap().links.len(), 2);
    assert_eq!(soon(&body(&format!("<body>{INERTIAL}</body>"), 10_000)).unwrap().links.len(), 10_002);
    let error = soon(&body("<joint/>", 20_001)).unwrap_err();
    assert!(error.ends_with("a robot has at most 20000 links"), "{error}");
    // Names that are taken already.
    let taken: String = (0..5_000).map(|i| format!("<site name='s{i}'/><body name='body{i}'/><body/>")).collect();
    assert_eq!(soon(&format!("<mujoco><worldbody>{taken}</worldbody></mujoco>")).unwrap().frames.len(), 5_000);

    let classes = |count: usize| {
        let classes: String =
            (0..count).map(|i| format!("<default class='c{i}'><joint damping='{i}'/></default>")).collect();
        format!("<mujoco><default><geom rgba='1' size='1 1 1'/>{classes}</default><worldbody/></mujoco>")
    };
    assert!(soon(&classes(9_999)).is_ok());
    let error = soon(&classes(10_000)).unwrap_err();
    assert!(error.ends_with("a file has at most 10000 classes"), "{error}");
    let sections = "<default><joint damping='1' armature='2'/><geom size='1'/></default>".repeat(100_000);
    assert!(soon(&format!("<mujoco>{sections}<worldbody/></mujoco>")).is_ok());

    let bodies: String = (0..5_000).map(|i| format!("<body><joint name='j{i}'/>{INERTIAL}</body>")).collect();
    let follow: String = (1..5_000).map(|i| format!("<joint joint1='j{i}' joint2='j{}'/>", i - 1)).collect();
    let robot =
        soon(&format!("<mujoco><worldbody>{bodies}</worldbody><equality>{follow}</equality></mujoco>")).unwrap();
    assert!(robot.joints[1..].iter().all(|joint| joint.mimic.unwrap().joint == 0));
}

/// A model of `count` links, each but the first in a joint to the one before and placed relative to `to(i)`.
fn chain(count: usize, to: impl Fn(usize) -> String) -> String {
    let mut text = "<sdf version='1.9'><model name='m'>\n".to_owned();
    for i in (0..count).rev() {
        writeln!(text, "<link name='l{i}'><pose relative_to='{}'>0 0 1 0 0 0</pose></link>", to(i)).unwrap();
        if i > 0 {
            let ends = format!("<parent>l{}</parent><child>l{i}</child>", i - 1);
            writeln!(text, "<joint name='j{i}' type='fixed'>{ends}</joint>").unwrap();
        }
    }
    text + "</model></sdf>"
}

#[test]
fn long_sdf_models_are_read_soon() {
    let before = |i: usize| if i == 0 { "__model__".to_owned() } else { format!("l{}", i - 1) };
    let robot = soon(&chain(10_000, before)).unwrap();
    assert!(robot.joints.iter().skip(1).all(|joint| joint.origin.position == [0.0, 0.0, 1.0]));
    // Joints between links whose places have nothing to do with each other.
    let far = |i: usize| {
        if i == 0 {
            "__model__".to_owned()
        } else if i == 9_999 {
            "l0".to_owned()
        } else if i.is_multiple_of(2) {
            format!("l{}", i + 1)
        } else {
            format!("l{}", (i + 2).min(9_999))
        }
    };
    soon(&chain(10_000, far)).unwrap();
    let error = soon(&chain(10_000, |i| format!("l{}", (i + 1) % 10_000))).unwrap_err();
    assert!(error.contains("frames are placed relative to each other in a cycle: `l"), "{error}");
    let error = soon(&chain(20_001, before)).unwrap_err();
    assert!(error.ends_with("a robot has at most 20000 links"), "{error}");
    let frames: String = (0..50_000).map(|i| format!("<frame name='f{i}' attached_to='f{}'/>\n", i + 1)).collect();
    let text =
        format!("<sdf version='1.9'><model name='m'>{frames}<frame name='f50000'/><link name='l'/></model></sdf>");
    assert_eq!(soon(&text).unwrap().frames.len(), 50_001);
    let visuals = "<visual name='v'><geometry/></visual>".repeat(100_000);
    assert!(soon(&format!("<sdf version='1.9'><model name='m'><link name='l'>{visuals}</link></model></sdf>")).is_ok());
    let deep = format!("<sdf version='1.9'>{}{}</sdf>", "<model name='m'>".repeat(10_000), "</model>".repeat(10_000));
    assert!(soon(&deep).unwrap_err().ends_with("elements are nested more than 256 deep"));
}

/// Valid robots with nearly everything that is read.
const FULL: [&str; 5] = [
    include_str!("data_sdf_mjcf/arm.xml"),
    include_str!("data_sdf_mjcf/joints.xml"),
    include_str!("data_sdf_mjcf/orientations.xml"),
    include_str!("data_sdf_mjcf/arm_in_model.sdf"),
    include_str!("data_sdf_mjcf/arm_relative.sdf"),
];

/// What is read is finite, and the error of what is not is within the file.
fn holds(text: &str) -> Result<(), TestCaseError> {
    match parse(text, "robot.xml", &LoadOptions::default()) {
        Ok(robot) => {
            let poses = robot.joints.iter().flat_map(|joint| [joint.origin, joint.child_pose]);
            let poses = poses.chain(robot.frames.iter().map(|frame| frame.pose));
            for pose in poses {
                prop_assert!(pose.rotation.iter().flatten().chain(&pose.position).all(|entry| entry.is_finite()));
            }
            for inertia in robot.links.iter().filter_map(|link| link.inertia) {
                let numbers = inertia.moment.iter().flatten().chain(&inertia.center).chain([&inertia.mass]);
                prop_assert!(numbers.into_iter().all(|entry| entry.is_finite()));
            }
        }
        Err(error) => {
            let lines = text.matches('\n').count() + 1;
            prop_assert!((1..=lines).contains(&error.line), "{error}");
            prop_assert!(error.span.end <= error.text.len(), "{error}");
            prop_assert!(!error.message.is_empty() && error.to_string().len() < 2_000, "{error}");
        }
    }
    Ok(())
}

/// Ways to change a text: what is done, where, to how many bytes, and with which bits.
type Mutations = Vec<(u8, prop::sample::Index, usize, u8)>;

proptest! {
    #![proptest_config(ProptestConfig { cases: 2_000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn a_mutated_robot_is_read_or_refused(
        file in 0..FULL.len(),
        mutations in prop::collection::vec((0..4_u8, any::<prop::sample::Index>(), 0..200_usize, any::<u8>()), 1..6),
    ) {
        let mutations: Mutations = mutations;
        let mut bytes = FULL[file].as_bytes().to_vec();
        for (kind, index, length, byte) in mutations {
            let start = index.index(bytes.len() + 1);
            let end = (start + length).min(bytes.len());
            match kind {
                0 => drop(bytes.drain(start..end)),
                1 => bytes.splice(start..start, bytes[start..end].to_vec()).for_each(drop),
                2 => bytes.iter_mut().skip(start).take(1 + length % 4).for_each(|flipped| *flipped ^= byte),
                _ => bytes.truncate(start.max(bytes.len() / 2)),
            }
        }
        holds(&String::from_utf8_lossy(&bytes))?;
    }

    #[test]
    fn a_robot_with_other_values_is_read_or_refused(
        file in 0..FULL.len(),
        index: prop::sample::Index,
        value in "-?[0-9]{1,3}(e[0-9]{1,3})?|nan|-inf|[a-z]{0,3}|1 2|",
    ) {
        // The attribute or text whose value begins at the chosen place.
        let text = FULL[file];
        let places: Vec<_> = text.match_indices(['"', '>']).map(|(at, _)| at + 1).collect();
        let start = *index.get(&places);
        let end = text[start..].find(['"', '<', '>']).map_or(text.len(), |length| start + length);
        holds(&format!("{}{value}{}", &text[..start], &text[end..]))?;
    }

    #[test]
    fn a_robot_with_other_words_is_read_or_refused(
        file in 0..FULL.len(),
        from: prop::sample::Index,
        to: prop::sample::Index,
    ) {
        // One word of the file in the place of another.
        let text = FULL[file];
        let is_word = |letter: char| letter.is_ascii_alphanumeric() || letter == '_';
        let words: Vec<_> = text.split(|letter: char| !is_word(letter)).filter(|word| !word.is_empty()).collect();
        let (from, to) = (*from.get(&words), *to.get(&words));
        let start = from.as_ptr() as usize - text.as_ptr() as usize;
        holds(&format!("{}{to}{}", &text[..start], &text[start + from.len()..]))?;
    }
}
