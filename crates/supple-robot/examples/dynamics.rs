//! Prints the dynamics of a robot file at states given on the standard input, to compare with other programs.
//!
//! ```text
//! dynamics ROBOT [--independent-mimic] [--packages FOLDER]... < states
//! ```
//!
//! Every line of the input is a state: positions, velocities and forces of the degrees of freedom, in the order of the
//! first line of the output. That line has the names of joints and links; then comes one line by state. Lines are JSON.
//! Gravity is 9.81 m/s^2 against z, and Coulomb friction is smoothed over 0.1 rad/s or m/s.

#![allow(clippy::print_stdout, clippy::print_stderr)]

use std::error::Error;
use std::fmt::Display;
use std::io::BufRead;
use std::process::ExitCode;

use supple_robot::*;

/// Velocity over which friction is smoothed, rad/s or m/s.
const SMOOTHING: f64 = 0.1;

fn main() -> ExitCode {
    let ended = run();
    if let Err(error) = &ended {
        eprintln!("{error}");
    }
    if ended.is_ok() { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

fn run() -> Result<(), Box<dyn Error>> {
    let mut options = LoadOptions::default();
    let (mut path, mut arguments) = (None, std::env::args().skip(1));
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "--independent-mimic" => options.independent_mimic = true,
            "--packages" => options.package_roots.extend(arguments.next().map(Into::into)),
            _ => path = Some(argument),
        }
    }
    let robot = load(path.ok_or("name a robot file")?, &options)?;
    let tree = Tree::new(&robot);
    let names = list(robot.links.iter().map(|link| format!("{:?}", link.name)));
    println!("{{\"joints\": {:?}, \"links\": {names}}}", tree.joints());
    for line in std::io::stdin().lock().lines() {
        let state: Vec<f64> = line?.split_whitespace().map(str::parse).collect::<Result<_, _>>()?;
        if state.len() != 3 * tree.dofs() {
            return Err(format!("a state has {} numbers, not {}", 3 * tree.dofs(), state.len()).into());
        }
        println!("{}", dynamics(&robot, &tree, &state));
    }
    Ok(())
}

/// Everything at one state, as JSON: mass matrix, bias, accelerations (none where not determined), and of every link
/// the rotation by rows and position, and the angular and linear velocity in the axes of the world.
fn dynamics(robot: &Robot, tree: &Tree, state: &[f64]) -> String {
    let (q, rest) = state.split_at(tree.dofs());
    let (v, tau) = rest.split_at(tree.dofs());
    let numbers = Numbers::of(robot, [0.0, 0.0, -9.81]);
    let kinematics = Kinematics::of(tree, &numbers, q, v);
    let passive = passive_forces(tree, &numbers, q, v, SMOOTHING);
    let forces: Vec<f64> = tau.iter().zip(passive).map(|(tau, passive)| tau + passive).collect();
    let acceleration = match check_inertia(tree, &numbers, q) {
        Ok(()) => list(forward_dynamics(tree, &numbers, &kinematics, &forces, &[])),
        Err(_) => "null".to_owned(),
    };
    let mass = list(mass_matrix(tree, &numbers, &kinematics).into_iter().map(list));
    let bias = list(bias(tree, &numbers, &kinematics, q, v, SMOOTHING));
    let poses = kinematics.poses().iter().map(|pose| list(pose.rotation.into_iter().flatten().chain(pose.position)));
    let velocity = |link| frame_velocity(&kinematics, link, [0.0; 3]);
    let velocities =
        (0..robot.links.len()).map(velocity).map(|twist| list(twist.angular.into_iter().chain(twist.linear)));
    format!(
        "{{\"mass\": {mass}, \"bias\": {bias}, \"acceleration\": {acceleration}, \"frames\": {}, \"velocities\": {}}}",
        list(poses),
        list(velocities)
    )
}

fn list(entries: impl IntoIterator<Item = impl Display>) -> String {
    let entries: Vec<String> = entries.into_iter().map(|entry| entry.to_string()).collect();
    format!("[{}]", entries.join(", "))
}
