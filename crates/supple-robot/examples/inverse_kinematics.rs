//! Finds the pose of the arm of `models/iiwa14_door.urdf` that holds the handle with the door at another angle.
//!
//! The frame of `iiwa_link_7` must coincide with `handle`: six equations for seven joints. From the pose with the door at
//! -0.17 rad the arm follows the door in small steps, each solved by Gauss-Newton steps of least length: of all poses
//! that hold the handle it finds the one that is reached without moving along the arm's null space.
//!
//! ```text
//! J dq = e      J: Jacobian of the link against the handle,  e: what is left, as turn and shift      dq = J' (J J')^-1 e
//! ```
//!
//! Run by `cargo run --release -p supple-robot --example inverse_kinematics`.

#![allow(clippy::print_stdout)]

use std::error::Error;

use supple_kernels::Ldl;
use supple_robot::vector::sub;
use supple_robot::{Kinematics, LoadOptions, Numbers, Robot, Tree, frame_jacobian, load};

const FILE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../models/iiwa14_door.urdf");

/// Joints of the arm, rad, with the door at `CLOSED`, where link and handle coincide.
const CLOSED_POSE: [f64; 7] = [
    -0.052255002788278625,
    -0.4837162360307082,
    -0.03740188978866321,
    1.214768001195358,
    0.017525951442721687,
    -1.443319521894041,
    0.0824038247253496,
];
const CLOSED: f64 = -0.17;
const OPEN: f64 = -0.5;

/// Steps in which the door is followed.
const STEPS: usize = 33;

fn main() -> Result<(), Box<dyn Error>> {
    let robot = load(FILE, &LoadOptions::default())?;
    let tree = Tree::new(&robot);
    let mut q = [CLOSED_POSE.as_slice(), &[CLOSED]].concat();
    let mut error = 0.0;
    for step in 1..=STEPS {
        q[7] = CLOSED + (OPEN - CLOSED) * step as f64 / STEPS as f64;
        error = hold(&robot, &tree, &mut q)?;
    }
    for (i, (name, q)) in tree.joints().iter().zip(&q).enumerate() {
        let limits = &robot.joints[tree.joint_indices()[i]].limits;
        let within = if (limits.lower..=limits.upper).contains(q) { "within" } else { "outside" };
        println!("\"q.{name}\" = {q:?}    # {within} [{}, {}]", limits.lower, limits.upper);
    }
    println!("link and handle differ by {error:.0e}");
    Ok(())
}

/// Moves the arm, at least, until its last link holds the handle; what is left, the largest entry in m and rad.
fn hold(robot: &Robot, tree: &Tree, q: &mut [f64]) -> Result<f64, Box<dyn Error>> {
    let hand = robot.link("iiwa_link_7").ok_or("no link `iiwa_link_7`")?;
    let handle = robot.link("handle").ok_or("no link `handle`")?;
    let numbers = Numbers::of(robot, [0.0; 3]);
    let mut left = f64::INFINITY;
    for _ in 0..20 {
        let kinematics = Kinematics::of(tree, &numbers, q, &vec![0.0; q.len()]);
        let [at, goal] = [hand, handle].map(|link| kinematics.poses()[link]);
        let turn = goal.compose(&at.inverse()).rotation;
        let turn = [turn[2][1] - turn[1][2], turn[0][2] - turn[2][0], turn[1][0] - turn[0][1]].map(|skew| 0.5 * skew);
        let e = [turn, sub(goal.position, at.position)].concat();
        left = e.iter().fold(0.0, |most: f64, entry| most.max(entry.abs()));
        if left < 1e-15 {
            break;
        }
        // The handle does not move with the arm, and the door stays.
        let jacobian = frame_jacobian(tree, &kinematics, hand, [0.0; 3]).map(|row| row[..7].to_vec());
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let square: Vec<Vec<f64>> = jacobian.iter().map(|a| jacobian.iter().map(|b| dot(a, b)).collect()).collect();
        let weights = Ldl::new(&square).solve(e);
        for (joint, q) in q[..7].iter_mut().enumerate() {
            *q += jacobian.iter().zip(&weights).map(|(row, weight)| row[joint] * weight).sum::<f64>();
        }
    }
    if left < 1e-12 { Ok(left) } else { Err(format!("the arm does not reach the handle: {left:.1e} is left").into()) }
}
