//! `supple robot`: the contents of a robot file, and its rigid-body dynamics.

mod page;
mod planning;
mod words;

use std::io::{BufWriter, ErrorKind, Write};

use serde::{Serialize, Serializer};
use supple_file::{read_text, robot_of};
use supple_robot::{
    Kinematics, LoadOptions, Numbers, Pose, Robot, Tree, bias, check_inertia, forward_dynamics, load, mass_matrix,
    mjcf, passive_forces,
};
use supple_study::write_text;

pub use planning::Planning;

use crate::arguments::{RobotFormat, RobotOptions};
use crate::failure::Failure;
use crate::outcome::Outcome;
use crate::output::{print_text, warn};

/// Gravity where neither the command nor the file says otherwise, m/s^2.
const GRAVITY: [f64; 3] = [0.0, 0.0, -9.81];
/// Velocity over which friction is smoothed, rad/s or m/s: the default of robots in task files.
pub const SMOOTHING: f64 = 1e-2;

/// `supple robot FILE`
pub fn robot(options: &RobotOptions) -> Result<Outcome, Failure> {
    if let Some(folder) = options.package_roots.iter().find(|folder| !folder.is_dir()) {
        return Err(Failure::usage(format!("--package-root {}: there is no such folder", folder.display())));
    }
    let given = options.gravity.as_deref().map(three).transpose()?;
    let package_roots = options.package_roots.clone();
    let is_task = options.file.extension().is_some_and(|ending| ending == "toml");
    let robot = if is_task {
        robot_of(&read_text(&options.file)?, &options.file.display().to_string())?
    } else {
        load(
            &options.file,
            &LoadOptions { package_roots, independent_mimic: options.independent_mimic, ..LoadOptions::default() },
        )?
    };
    if let Some(RobotFormat::Mjcf) = options.to {
        return write(robot, options);
    }
    let gravity = given.or(robot.gravity).unwrap_or(GRAVITY);
    let tree = Tree::new(&robot);
    let lists = [("--q", &options.q), ("--v", &options.v), ("--tau", &options.tau)];
    if !options.json && lists.iter().all(|(_, list)| list.is_none()) {
        print_text(&page::robot_page(&robot, &tree, gravity, if is_task { "task" } else { "file" }, options.verbose))?;
        return Ok(Outcome::Success);
    }
    let [q, v, tau] = lists.map(|(option, list)| by_joint(option, list.as_deref().unwrap_or_default(), tree.joints()));
    let state = State { q: q?, v: v?, tau: tau?, gravity };
    let warnings = if options.verbose { &robot.every_warning } else { &robot.warnings };
    warnings.iter().for_each(|warning| warn(warning));
    print(&dynamics(&robot, &tree, &state)?)?;
    Ok(Outcome::Success)
}

/// Writes the robot in another format.
///
/// # Errors
/// If gravity is invalid, or the file cannot be written.
fn write(mut robot: Robot, options: &RobotOptions) -> Result<Outcome, Failure> {
    robot.gravity = options.gravity.as_deref().map(three).transpose()?.or(robot.gravity);
    let written = mjcf(&robot);
    let read = if options.verbose { &robot.every_warning } else { &robot.warnings };
    read.iter().chain(&written.warnings).for_each(|warning| warn(warning));
    match &options.out {
        None => print_text(&written.text)?,
        Some(path) => {
            write_text(path, written.text.as_bytes())?;
            print_text(&format!("wrote {}\n", path.display()))?;
        }
    }
    Ok(Outcome::Success)
}

/// Parses a list of one number per joint; numbers omitted at the end are 0.
///
/// # Errors
/// If there are more numbers than joints, or one is not finite.
fn by_joint(option: &str, list: &str, joints: &[String]) -> Result<Vec<f64>, Failure> {
    let order = || match joints.len() {
        0 => "no joint moves".to_owned(),
        1 => format!("the one joint is {}", supple_text::quoted(joints)),
        count => format!("the {count} joints are {}", supple_text::quoted(joints)),
    };
    let wrong = |what: String| Failure::usage(format!("{option}: {what}; {}", order()));
    let mut numbers = numbers(list).map_err(wrong)?;
    if numbers.len() > joints.len() {
        return Err(wrong(format!("there are {} numbers for {} joints", numbers.len(), joints.len())));
    }
    numbers.resize(joints.len(), 0.0);
    Ok(numbers)
}

/// The three numbers of `--gravity`.
fn three(list: &str) -> Result<[f64; 3], Failure> {
    let wrong = |what: String| Failure::usage(format!("--gravity: {what}; write x,y,z in m/s^2, such as 0,0,-9.81"));
    let numbers = numbers(list).map_err(wrong)?;
    let count = numbers.len();
    numbers.try_into().map_err(|_| wrong(format!("there are {count} numbers, not 3")))
}

/// Parses finite numbers separated by commas; an empty list gives none.
fn numbers(list: &str) -> Result<Vec<f64>, String> {
    if list.trim().is_empty() {
        return Ok(Vec::new());
    }
    let number = |(index, entry): (usize, &str)| {
        let shown: String = entry.trim().chars().filter(|c| !c.is_control()).take(40).collect();
        match entry.trim().parse::<f64>() {
            Ok(number) if number.is_finite() => Ok(number),
            Ok(_) => Err(format!("entry {} is `{shown}`, which is not finite", index + 1)),
            Err(_) => {
                Err(format!("entry {} is `{shown}`, which is not a number; write numbers between commas", index + 1))
            }
        }
    };
    list.split(',').enumerate().map(number).collect()
}

/// Positions, velocities and drive forces of a robot; lists in the order of the joints.
struct State {
    /// Positions, rad or m.
    q: Vec<f64>,
    /// Velocities, rad/s or m/s.
    v: Vec<f64>,
    /// Torques or forces of the drives, N m or N.
    tau: Vec<f64>,
    /// Gravity in the world, m/s^2.
    gravity: [f64; 3],
}

/// `mass_matrix acceleration + bias = tau`, and the poses of the links.
#[derive(Serialize)]
struct Dynamics<'a> {
    joints: &'a [String],
    mass_matrix: Vec<Vec<f64>>,
    bias: Vec<f64>,
    acceleration: Option<Vec<f64>>,
    frames: Frames<'a>,
    /// Every warning about the file.
    warnings: &'a [String],
}

/// Poses of the links in the world.
struct Frames<'a>(Vec<(&'a str, Pose)>);

#[derive(Serialize)]
struct Frame {
    position: [f64; 3],
    rotation: [[f64; 3]; 3],
}

impl Serialize for Frames<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let frame = |pose: &Pose| Frame { position: pose.position, rotation: pose.rotation };
        serializer.collect_map(self.0.iter().map(|(link, pose)| (link, frame(pose))))
    }
}

/// The dynamics at a state.
///
/// # Errors
/// If numbers are so large that their products are not finite.
fn dynamics<'a>(robot: &'a Robot, tree: &'a Tree, state: &State) -> Result<Dynamics<'a>, Failure> {
    let State { q, v, tau, gravity } = state;
    let numbers = Numbers::of(robot, *gravity);
    let kinematics = Kinematics::of(tree, &numbers, q, v);
    let bias = bias(tree, &numbers, &kinematics, q, v, SMOOTHING);
    let mass_matrix = mass_matrix(tree, &numbers, &kinematics);
    let poses = kinematics.poses().iter().flat_map(|pose| pose.position.into_iter().chain(pose.rotation.concat()));
    if !mass_matrix.iter().flatten().chain(&bias).copied().chain(poses).all(f64::is_finite) {
        let message = "the dynamics are not finite at this state: its numbers, or numbers in the file, are too large";
        return Err(Failure::usage(message.to_owned()));
    }
    let acceleration = match check_inertia(tree, &numbers, q) {
        Err(singular) => {
            warn(&format!("the mass matrix is singular: {singular}"));
            None
        }
        Ok(()) => {
            let passive = passive_forces(tree, &numbers, q, v, SMOOTHING);
            let forces: Vec<_> = tau.iter().zip(passive).map(|(tau, passive)| tau + passive).collect();
            let found = forward_dynamics(tree, &numbers, &kinematics, &forces, &[]);
            let finite = found.iter().all(|entry| entry.is_finite());
            if !finite {
                warn("the accelerations are not finite: forces are too large for the inertia that they move");
            }
            finite.then_some(found)
        }
    };
    let frames = robot.links.iter().zip(kinematics.poses()).map(|(link, pose)| (link.name.as_str(), *pose));
    Ok(Dynamics {
        joints: tree.joints(),
        mass_matrix,
        bias,
        acceleration,
        frames: Frames(frames.collect()),
        warnings: &robot.every_warning,
    })
}

/// Streams the JSON: for a robot with many joints, the text would be larger than the data. A closed pipe is
/// not an error.
fn print(dynamics: &Dynamics) -> Result<(), Failure> {
    let mut out = BufWriter::new(std::io::stdout().lock());
    let written = serde_json::to_writer_pretty(&mut out, dynamics).map_err(std::io::Error::from);
    match written.and_then(|()| writeln!(out)).and_then(|()| out.flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => Err(Failure::write("standard output", error)),
        _ => Ok(()),
    }
}
