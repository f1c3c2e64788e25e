//! Broken and hostile URDF files: each has its error, and none makes the reader panic, hang or reach other files.
#![allow(clippy::unwrap_used, clippy::expect_used)]

#[path = "data/hostile/meshes.rs"]
mod meshes;
#[path = "data/hostile/not_xml.rs"]
mod not_xml;
#[path = "data/hostile/numbers.rs"]
mod numbers;
#[path = "data/hostile/trees.rs"]
mod trees;

use std::fmt::Write;
use std::time::{Duration, Instant};

use proptest::prelude::*;
use supple_robot::{LoadOptions, Robot, load, parse};

/// The robot, or the error as one line.
fn read(text: &str) -> Result<Robot, String> {
    parse(text, "robot.urdf", &LoadOptions::default()).map_err(|error| error.to_string())
}

/// The error, within `most` time: far more than is needed, and far less than what grows with the square of the size.
fn soon(text: &str) -> Result<Robot, String> {
    let start = Instant::now();
    let read = read(text);
    let took = start.elapsed();
    assert!(took < Duration::from_secs(5), "took {took:?}");
    read
}

#[test]
fn every_broken_file_has_its_error() {
    let cases: Vec<_> = [not_xml::NOT_XML, trees::TREES, numbers::NUMBERS, meshes::MESHES].concat();
    assert!(cases.len() >= 30);
    let mut wrong = String::new();
    for (what, text, expected) in cases {
        let found = match read(text) {
            Ok(_) => "it loads".to_owned(),
            Err(error) => error,
        };
        if found != expected {
            writeln!(wrong, "@{what}@{found}@{expected}").unwrap();
        }
    }
    assert!(wrong.is_empty(), "case, error and what it should be:\n{wrong}");
}

#[test]
fn meshes_out_of_reach_are_left_out() {
    for (what, text, expected) in meshes::LEFT_OUT {
        let robot = read(text).unwrap_or_else(|error| panic!("{what}: {error}"));
        assert!(robot.links.iter().all(|link| link.meshes.is_empty()), "{what}: {:?}", robot.links);
        assert_eq!((&robot.warnings, &robot.every_warning), (&vec![(*expected).to_owned()], &robot.warnings), "{what}");
    }
}

/// Misspelt attributes lost damping or friction, or the sign of a mimic joint, without a word; moments in g m^2 made links
/// of a kilogram as hard to turn as lorries.
#[test]
fn what_is_likely_a_slip_is_a_warning() {
    let joint = "<axis xyz=\"0 1 0\"/><dynamics dampng=\"0.1\" friction=\"0.2\"/>";
    for (what, text, expected) in [
        (
            "a misspelt attribute",
            PAIR.replace("<origin xyz=\"1 2 3\"/>", joint),
            "dynamics of joint `j`: attribute `dampng` is not known and is ignored; did you mean `damping`? (line 5)",
        ),
        (
            "a misspelt attribute of an inertial",
            PAIR.replace("<inertial>", "<inertial><origin xzy=\"0 0 0\"/>"),
            "origin of link `b`: attribute `xzy` is not known and is ignored (line 4)",
        ),
        (
            "moments in g m^2",
            PAIR.replace("\"1\"", "\"1000\""),
            "inertial of link `b`: its mass of 2 kg has the moments of inertia of a body many metres in size (radius of gyration \
             22.4 m); they must be in kg m^2, and lengths in m (line 4)",
        ),
        (
            "a centre of mass in mm",
            PAIR.replace("<inertial>", "<inertial><origin xyz=\"0 0 150\"/>"),
            "inertial of link `b`: its centre of mass is 150 m away from the origin of the link; lengths must be in m (line 4)",
        ),
        (
            "a joint in mm",
            PAIR.replace("1 2 3", "0 0 300"),
            "joint `j`: it is 300 m away from the origin of its parent link; lengths must be in m (line 5)",
        ),
        (
            "a fixed joint in mm",
            PAIR.replace(
                "</robot>",
                "<link name=\"c\"/><joint name=\"f\" type=\"fixed\"><parent link=\"b\"/><child link=\"c\"/>\
             <origin xyz=\"0 -60 -250\"/></joint></robot>",
            ),
            "joint `f`: it is 257 m away from the origin of its parent link; lengths must be in m (line 6)",
        ),
        (
            "a mass in g",
            PAIR.replace("mass value=\"2\"", "mass value=\"3800\""),
            "inertial of link `b`: its mass is 3800 kg; masses must be in kg (line 4)",
        ),
        (
            "limits in degrees",
            PAIR.replace("continuous", "revolute")
                .replace("</joint>", "<limit lower=\"-11\" upper=\"115\" effort=\"9\" velocity=\"9\"/></joint>"),
            "limit of joint `j`: `lower` = -11 and `upper` = 115 are rad, but look like degrees (line 5)",
        ),
    ] {
        assert_eq!(read(&text).unwrap().warnings, [expected], "{what}");
    }
}

/// A robot of two links.
const PAIR: &str = r#"<?xml version="1.0"?>
<robot name="r">
<link name="a"/>
<link name="b"><inertial><mass value="2"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
<joint name="j" type="continuous"><parent link="a"/><child link="b"/><origin xyz="1 2 3"/></joint>
</robot>
"#;

#[test]
fn what_only_looks_strange_loads() {
    let strange = [
        PAIR.to_owned(),
        format!("\u{feff}{PAIR}"),
        PAIR.replace('\n', "\r\n"),
        PAIR.replace("<link", "<!-- a link: <link> & co. --><?editor fold?><link"),
        PAIR.replace("<link name", "<link\n\tname").replace("2 3\"", "2\t\n 3 \""),
        PAIR.replace('"', "'"),
        PAIR.replace("<robot", "<robot xmlns:xacro='http://ros.org/wiki/xacro' version='1.0'"),
        PAIR.replace("<robot", "<robot xmlns='http://example.com/robot'"),
        PAIR.replace("1 2 3", "+1.0 2e0 30E-1").replace("name=\"a\"", "name=\"&#97;\""),
        PAIR.replace("<link name=\"a\"/>", "<link name=\"a\">words<![CDATA[<link/>]]></link>"),
        PAIR.trim_start_matches("<?xml version=\"1.0\"?>\n").trim_end().to_owned(),
        format!("{PAIR}<!-- the end -->\n\n"),
    ];
    for text in strange {
        let robot = read(&text).unwrap();
        assert_eq!(robot.warnings, [""; 0], "{text}");
        assert_eq!((robot.links[0].name.as_str(), robot.links[1].name.as_str()), ("a", "b"));
        assert_eq!(robot.joints[0].origin.position, [1.0, 2.0, 3.0], "{text}");
        assert_eq!(robot.links[1].inertia.unwrap().mass, 2.0);
    }
}

#[test]
fn a_file_that_cannot_be_read_is_named() {
    let missing = load("no/such/robot.urdf", &LoadOptions::default()).unwrap_err();
    assert!(missing.to_string().starts_with("no/such/robot.urdf: cannot be read: "), "{missing}");
    let folder = tempdir("binary");
    let path = folder.join("robot.urdf");
    std::fs::write(&path, b"<robot name=\"r\">\n<link name=\"\xff\"/></robot>").unwrap();
    let error = load(&path, &LoadOptions::default()).unwrap_err();
    assert_eq!((error.line, error.message.as_str()), (2, "must be UTF-8; this byte is invalid"));
}

/// An empty folder of its own.
fn tempdir(name: &str) -> std::path::PathBuf {
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("hostile").join(name);
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

/// Links `l0` to `l{links - 1}`, where each but the first hangs from `parent(i)`; joints before links, in reverse.
fn large(links: usize, parent: impl Fn(usize) -> usize) -> String {
    let mut text = "<robot name=\"large\">\n".to_owned();
    for i in (1..links).rev() {
        let parent = parent(i);
        writeln!(text, "<joint name='j{i}' type='continuous'><parent link='l{parent}'/><child link='l{i}'/></joint>")
            .unwrap();
    }
    for i in (0..links).rev() {
        writeln!(text, "<link name='l{i}'/>").unwrap();
    }
    text + "</robot>"
}

#[test]
fn ten_thousand_links_load() {
    let chain = soon(&large(10_000, |i| i - 1)).unwrap();
    assert_eq!((chain.links.len(), chain.links[9_999].name.as_str()), (10_000, "l9999"));
    assert!((0..9_999).all(|i| chain.joints[i].parent == i));
    let star = soon(&large(10_000, |_| 0)).unwrap();
    assert_eq!((star.joints.len(), star.joints[0].name.as_str()), (9_999, "j9999"));
    let heap = soon(&large(10_000, |i| (i - 1) / 2)).unwrap();
    assert!(heap.joints.iter().enumerate().all(|(i, joint)| joint.parent <= i));
    let message = "it moves link `l9999` and the links attached to it, none of which has inertia";
    assert_eq!(heap.warnings, [format!("joint `j9999`: {message} (line 2, and 9998 more)")]);
}

#[test]
fn more_links_than_a_robot_has_are_refused() {
    let error = soon(&large(20_001, |i| i - 1)).unwrap_err();
    assert_eq!(error, "robot.urdf:40002:1: link `l0`: a robot has at most 20000 links");
}

#[test]
fn large_errors_are_found_soon() {
    let turned = large(10_000, |i| (i + 1) % 10_000).replace("<link name='l0'/>", "");
    let error = soon(&turned).unwrap_err();
    assert!(error.contains("there is no link `l0`; known: `l9999`, `l9998`,"), "{error}");
    let text = large(10_000, |i| if i == 1 { 9_999 } else { i - 1 });
    let error = soon(&text).unwrap_err();
    assert!(error.contains("closed kinematic loop along `l9999`, `l1`, `l2`,"), "{error}");
    let mimic = |i: usize| format!("<mimic joint='j{}'/><child link='l{i}'/>", i + 1);
    let text = (1..9_999).fold(large(10_000, |_| 0), |text, i| match i % 100 {
        0 => text.replace(&format!("<child link='l{i}'/>"), &mimic(i)),
        _ => text,
    });
    assert_eq!(soon(&text).unwrap().joints.iter().filter(|joint| joint.mimic.is_some()).count(), 99);
}

#[test]
fn a_long_chain_of_followers_is_resolved() {
    let mut text = large(5_000, |_| 0);
    for i in 1..4_999 {
        let (child, next) = (format!("<child link='l{i}'/>"), i + 1);
        text = text.replacen(&child, &format!("{child}<mimic joint='j{next}' multiplier='-1' offset='1'/>"), 1);
    }
    let robot = soon(&text).unwrap();
    let last = robot.joint("j4999").unwrap();
    // An odd number of steps: -x + 1. An even number: x.
    let first = robot.joints[robot.joint("j1").unwrap()].mimic.unwrap();
    assert_eq!((first.joint, first.ratio, first.offset), (last, 1.0, 0.0));
    let second = robot.joints[robot.joint("j2").unwrap()].mimic.unwrap();
    assert_eq!((second.joint, second.ratio, second.offset), (last, -1.0, 1.0));
}

#[test]
fn a_fixed_joint_follows_nothing_whatever_is_said() {
    let text = r#"<robot name="r">
<link name="a"/>
<link name="b"/>
<joint name="j" type="fixed"><parent link="a"/><child link="b"/><mimic joint="of a part that is left out"/></joint>
</robot>"#;
    let robot = read(text).unwrap();
    assert_eq!(robot.joints[0].mimic, None);
    let warning = "joint `j`: it is fixed; its mimic relation to `of a part that is left out` is ignored (line 4)";
    assert_eq!(robot.warnings, [warning]);
    let options = LoadOptions { independent_mimic: true, ..LoadOptions::default() };
    assert_eq!(parse(text, "robot.urdf", &options).unwrap().warnings, [""; 0]);
}

#[test]
fn what_is_too_deep_or_too_wide_is_refused() {
    let deep = format!("<robot name='r'>{}{}</robot>", "<a>".repeat(100_000), "</a>".repeat(100_000));
    assert_eq!(soon(&deep).unwrap_err(), "robot.urdf:1:782: elements are nested more than 256 deep");
    let open = "<robot>".repeat(1_000_000);
    assert_eq!(soon(&open).unwrap_err(), "robot.urdf:1:1793: elements are nested more than 256 deep");
    let attributes = |i| format!(" a{i}=''");
    let wide = format!("<robot{}/>", (0..100_000).map(attributes).collect::<String>());
    assert_eq!(soon(&wide).unwrap_err(), "robot.urdf:1:1: an element has at most 100 attributes");
    let spaces = (0..1_000).map(|i| format!("<a xmlns:n{i}='u{i}'/>")).collect::<String>();
    let error = soon(&format!("<robot name='r'>\n{spaces}</robot>")).unwrap_err();
    assert_eq!(error, "robot.urdf:2:1984: a robot file declares at most 100 name spaces");
    let many = format!("<robot name='r'>\n{}</robot>", "<a/>".repeat(2_000_000));
    let error = soon(&many).unwrap_err();
    assert_eq!(error, "robot.urdf:2:8000009: a robot file has at most 2000000 elements, texts and comments");
    let brackets = "<".repeat(20_000_000);
    let message = "a robot file has at most 4000000 characters `<`; this one has 20000000";
    assert_eq!(soon(&brackets).unwrap_err(), format!("robot.urdf:1:1: {message}"));
}

#[test]
fn what_is_nested_up_to_the_limit_loads() {
    let (open, close) = ("<gazebo>".repeat(255), "</gazebo>".repeat(255));
    let text = PAIR.replace("<link name=\"a\"/>", &format!("{open}{close}<link name=\"a\"/>"));
    assert_eq!(read(&text).unwrap().warnings, ["element `gazebo` is ignored (line 3)"]);
}

#[test]
fn warnings_of_a_kind_are_one_line_and_each_of_them_another() {
    let visual = |i: usize| format!("<visual><geometry><mesh filename='/far/{i}.stl'/></geometry></visual>\n");
    let visuals: String = (0..12).map(visual).collect();
    let robot = read(&PAIR.replace("<link name=\"a\"/>", &format!("<link name=\"a\">{visuals}</link>"))).unwrap();
    let names: Vec<_> = (0..10).map(|i| format!("`/far/{i}.stl`")).collect();
    let why = "is outside the robot file's folder and all package roots";
    let all = format!("12 meshes are ignored, because each {why}: {} and 2 more (first at line 3)", names.join(", "));
    assert_eq!(robot.warnings, [all]);
    let one = |i: usize| format!("mesh `/far/{i}.stl` is left out: it {why} (line {})", 3 + i);
    assert_eq!(robot.every_warning, (0..12).map(one).collect::<Vec<_>>());
}

#[test]
fn long_names_and_many_mistakes_stay_short() {
    let (a, b) = ("a".repeat(5_000_000), "b".repeat(5_000_000));
    let error =
        soon(&PAIR.replace("\"a\"", &format!("\"{a}\"")).replace("child link=\"b\"", &format!("child link=\"{b}\"")));
    let error = error.unwrap_err();
    assert!(error.len() < 400 && error.contains("there is no link `bbbbb"), "{error}");
    let unknown: String = (0..100_000).map(|i| format!("<e{i}/>\n")).collect();
    let robot = soon(&PAIR.replace("<link name=\"a\"/>", &format!("<link name=\"a\"/>{unknown}"))).unwrap();
    assert_eq!(robot.warnings.len(), 101);
    assert_eq!(robot.warnings[0], "unknown `e0` in `robot` is ignored; known: `link`, `joint` (line 3)");
    assert_eq!(robot.warnings[100], "99900 further kinds of warnings are omitted");
    let text = "1 <!-- -->".repeat(200_000);
    soon(&PAIR.replace("<link name=\"a\"/>", &format!("<link name=\"a\">{text}</link>"))).unwrap();
}

#[cfg(unix)]
#[test]
fn a_symbolic_link_does_not_lead_out() {
    let folder = tempdir("links");
    let robot = folder.join("robot");
    std::fs::create_dir_all(&robot).unwrap();
    std::fs::write(folder.join("secret.stl"), "").unwrap();
    std::fs::write(robot.join("own.stl"), "").unwrap();
    std::os::unix::fs::symlink(folder.join("secret.stl"), robot.join("mesh.stl")).unwrap();
    std::os::unix::fs::symlink(robot.join("own.stl"), robot.join("alias.stl")).unwrap();
    let path = robot.join("robot.urdf");
    let write = |mesh: &str| {
        let visual = format!("<link name='a'><visual><geometry>\n<mesh filename='{mesh}'/></geometry></visual></link>");
        std::fs::write(&path, format!("<robot name='r'>{visual}</robot>")).unwrap();
        load(&path, &LoadOptions::default())
    };
    let without = write("mesh.stl").unwrap();
    let why = "is outside the robot file's folder and all package roots by a symbolic link";
    assert_eq!(without.warnings, [format!("mesh `mesh.stl` is left out: it {why} (line 2)")]);
    assert_eq!(without.links[0].meshes, []);
    assert_eq!(write("alias.stl").unwrap().links[0].meshes[0].path, robot.join("alias.stl"));
    assert_eq!(write("missing/../own.stl").unwrap().links[0].meshes[0].path, robot.join("own.stl"));
}

/// A valid robot with everything that is read.
const FULL: &str = include_str!("data/arm/arm.urdf");

/// The error of a mutated file is within the file.
fn holds(text: &str) -> Result<(), TestCaseError> {
    if let Err(error) = parse(text, "robot.urdf", &LoadOptions::default()) {
        let lines = text.matches('\n').count() + 1;
        prop_assert!((1..=lines).contains(&error.line), "{error}");
        prop_assert!(error.span.end <= error.text.len(), "{error}");
        prop_assert!(!error.message.is_empty() && error.to_string().len() < 2_000, "{error}");
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2_000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_text_is_read_or_refused(text in "\\PC{0,200}") {
        holds(&text)?;
    }

    #[test]
    fn any_text_of_signs_of_xml_is_read_or_refused(text in "([<>/=!?&;'\" -]|<robot|</|/>|name=|<!--|\\[|\\]|é|\n|xmlns:?|link){0,60}") {
        holds(&text)?;
        holds(&format!("<robot name='r'>{text}</robot>"))?;
    }

    #[test]
    fn a_mutated_robot_is_read_or_refused(mutations in prop::collection::vec((0..4, any::<prop::sample::Index>(), 0..200_usize, any::<u8>()), 1..6)) {
        let mut bytes = FULL.as_bytes().to_vec();
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
    fn a_robot_with_other_values_is_read_or_refused(index: prop::sample::Index, value in "-?[0-9]{1,3}(e[0-9]{1,3})?|nan|-inf|[a-z]{0,3}|1 2|", ) {
        // The attribute whose value begins at the chosen quote.
        let quotes: Vec<_> = FULL.match_indices("=\"").map(|(at, _)| at + 2).collect();
        let start = *index.get(&quotes);
        let end = start + FULL[start..].find('"').unwrap();
        holds(&format!("{}{value}{}", &FULL[..start], &FULL[end..]))?;
    }
}
