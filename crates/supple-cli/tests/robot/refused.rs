//! Options and files that are refused: exit code 2, an error that says what is valid, and nothing printed.

use crate::common::Folder;
use crate::{gripper, robot};

#[test]
fn bad_options_are_named_with_what_is_valid() {
    const JOINTS: &str = "; the 2 joints are `swing`, `left`";
    for (arguments, says) in [
        (&["--q", "1,2,3"][..], "--q: there are 3 numbers for 2 joints"),
        (&["--v", "0,0,0,0"], "--v: there are 4 numbers for 2 joints"),
        (&["--tau=1,2,3"], "--tau: there are 3 numbers for 2 joints"),
        (&["--q", "one"], "--q: entry 1 is `one`, which is not a number; write numbers between commas"),
        (&["--q", "0,1;2"], "--q: entry 2 is `1;2`, which is not a number; write numbers between commas"),
        (&["--q", "0 1"], "--q: entry 1 is `0 1`, which is not a number; write numbers between commas"),
        (&["--v", "1,"], "--v: entry 2 is ``, which is not a number; write numbers between commas"),
        (&["--v", ",1"], "--v: entry 1 is ``, which is not a number; write numbers between commas"),
        (&["--q", "nan"], "--q: entry 1 is `nan`, which is not finite"),
        (&["--v", "0,-inf"], "--v: entry 2 is `-inf`, which is not finite"),
        (&["--tau", "1e999"], "--tau: entry 1 is `1e999`, which is not finite"),
        (&["--q", "--json"], "--q: entry 1 is `--json`, which is not a number; write numbers between commas"),
    ] {
        assert_eq!(robot(gripper(), arguments).error(), format!("error: {says}{JOINTS}"));
    }
    const GRAVITY: &str = "; write x,y,z in m/s^2, such as 0,0,-9.81";
    for (gravity, says) in [
        ("-9.81", "there are 1 numbers, not 3"),
        ("", "there are 0 numbers, not 3"),
        ("0,0,0,-9.81", "there are 4 numbers, not 3"),
        ("0,0,down", "entry 3 is `down`, which is not a number; write numbers between commas"),
        ("0,0,-inf", "entry 3 is `-inf`, which is not finite"),
    ] {
        let run = robot(gripper(), &["--gravity", gravity]);
        assert_eq!(run.error(), format!("error: --gravity: {says}{GRAVITY}"));
    }
    let missing = robot(gripper(), &["--package-root", "nowhere"]);
    assert_eq!(missing.error(), "error: --package-root nowhere: there is no such folder");
    let still = robot("<robot name='r'><link name='a'/></robot>", &["--q", "1"]);
    assert_eq!(still.error(), "error: --q: there are 1 numbers for 0 joints; no joint moves");
}

#[test]
fn options_that_there_are_not_are_refused() {
    for arguments in [&["--gravity"][..], &["--q", "1", "--q", "2"], &["--mimic"], &["another.urdf"], &["--json=1"]] {
        let run = robot(gripper(), arguments);
        assert_eq!((run.code, run.stdout.as_str()), (Some(2), ""), "{arguments:?}");
        assert!(run.stderr.starts_with("error: "), "{}", run.stderr);
    }
}

#[test]
fn states_beyond_numbers_are_refused() {
    let error = "error: the dynamics are not finite at this state: its numbers, or numbers in the file, are too large";
    for state in [["--q", "0,1e200"], ["--v", "1e200"], ["--gravity", "1e308,1e308,1e308"]] {
        assert_eq!(robot(gripper(), &[&state[..], &["--json"]].concat()).error(), error, "{state:?}");
    }
    let run = robot(gripper().replace("value='1'", "value='1e-20'").replace("'0.", "'1e-30"), &["--tau", "1e300"]);
    assert_eq!(run.code, Some(0), "{}", run.stderr);
    assert!(run.stdout.contains("\"acceleration\": null"), "{}", run.stdout);
    assert!(run.stderr.contains("warning: "), "{}", run.stderr);
}

#[test]
fn broken_files_are_named_with_the_line() {
    let good = gripper();
    let edits = [
        ("</robot>", "", "1:1: the file ends before"),
        ("<parent link='base'/>", "<parent link='bass'/>", "6:53: parent of joint `swing`: there is no link `bass`"),
        (
            "<parent link='base'/>",
            "<parent link='hand'/>",
            "6:73: child of joint `swing`: link `hand` is its own parent",
        ),
        ("value='1'", "value='-1'", "3:29: mass of link `hand`: the mass must be at least 0; found -1"),
        ("value='1'", "value='NaN'", "3:42: mass of link `hand`: `value` holds `NaN`, which is not finite"),
        ("ixx='0.1'", "ixx='-0.1'", "3:46: inertia of link `hand`: the principal moments of inertia must be"),
        ("type='continuous'", "type='floating'", "6:27: joint `swing`: type `floating` is not supported"),
        ("type='continuous'", "type='twisting'", "6:27: joint `swing`: type `twisting` is not a type of joint"),
        ("xyz='1 0 0'", "xyz='0 0 0'", "6:80: axis of joint `swing`: the axis must have a direction"),
        ("<link name='base'/>", "<link name='hand'/>", "3:13: link `hand`: there is another link `hand`, at line 2"),
        ("mimic joint='left'", "mimic joint='lift'", "8:239: mimic of joint `right`: there is no joint `lift`"),
        ("mimic joint='left'", "mimic joint='right'", "8:239: mimic of joint `right`: a joint cannot follow itself"),
        ("<robot", "<!DOCTYPE r [<!ENTITY a 'a'>]><robot", "1:1: `<!DOCTYPE` is not accepted"),
        ("<robot name='gripper'>", "<machine/>", "2:1: content after the root element"),
    ];
    for (from, to, says) in edits {
        let text = good.replacen(from, to, 1);
        assert_ne!(text, good, "{from}");
        for arguments in [&[][..], &["--q", "1", "--json"]] {
            let run = robot(&text, arguments);
            let start = format!("error: robot.urdf:{says}");
            assert!(run.error().starts_with(&start), "{to}: {}", run.stderr);
        }
    }
    assert!(robot("", &[]).error().starts_with("error: robot.urdf:1:1: "));
    assert!(
        robot(b"<robot name='r'>\n<link name='\xff'/></robot>", &[]).error().starts_with("error: robot.urdf:2:13: ")
    );
    for name in ["no.urdf", "."] {
        let run = Folder::new().run(&["robot", name]);
        assert!(run.error().starts_with(&format!("error: {name}: cannot be read: ")), "{}", run.stderr);
    }
}
