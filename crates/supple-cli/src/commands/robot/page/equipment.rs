//! What a robot's file holds besides bodies: actuators, sensors, keyframes and walls.

use supple_robot::{Actuator, Key, Law, Measured, Robot, Sensor, Tree, Wall, WallShape};

use crate::commands::robot::words::{name, number, vector};
use crate::tables::{Rows, align_right, table};

/// Keyframes that are shown.
const MOST_KEYS: usize = 20;

/// Its tables, each with a heading; empty where there is nothing.
pub(super) fn equipment(robot: &Robot, tree: &Tree) -> String {
    let mut page = String::new();
    let mut add = |heading: &str, table: Rows, any: bool| {
        if any {
            page.push_str(&format!("\n{heading}\n\n{}", table.trimmed()));
        }
    };
    let actuators =
        "Actuators: force = gain u + offset - kp l - kv l', with the length l = gear q; torque = gear force";
    add(actuators, actuator_table(robot), !robot.actuators.is_empty());
    add("Sensors", sensor_table(robot), !robot.sensors.is_empty());
    let keys = "Keyframes: positions of the joints, in the order of --q, and controls";
    add(keys, key_table(robot, tree), !robot.keys.is_empty());
    add("Walls: planes and boxes that do not move", wall_table(robot), !robot.walls.is_empty());
    page
}

fn actuator_table(robot: &Robot) -> Rows {
    let mut table = table(&["actuator", "kind", "joint", "gear", "gain", "offset", "kp", "kv", "control", "force"]);
    for actuator in &robot.actuators {
        let Actuator { name: label, joint, gear, law, control, force, .. } = actuator;
        let numbers = match *law {
            Law::Motor { gain } => [gain, 0.0, 0.0, 0.0],
            Law::Position { kp, kv } => [kp, 0.0, kp, kv],
            Law::Velocity { kv } => [kv, 0.0, 0.0, kv],
            Law::Affine { gain, offset, kp, kv } => [gain, offset, kp, kv],
        };
        let [gain, offset, kp, kv] = numbers.map(number);
        let joint = name(&robot.joints[*joint].name);
        table.add_row([
            name(label),
            law.name().into(),
            joint,
            number(*gear),
            gain,
            offset,
            kp,
            kv,
            range(*control),
            range(*force),
        ]);
    }
    align_right(&mut table, 3..8);
    table
}

/// A range in words; empty where it is infinite.
fn range([lower, upper]: [f64; 2]) -> String {
    if lower.is_infinite() && upper.is_infinite() {
        String::new()
    } else {
        format!("{} to {}", number(lower), number(upper))
    }
}

fn sensor_table(robot: &Robot) -> Rows {
    let mut table = table(&["sensor", "measures", "of"]);
    for Sensor { name: label, measures, .. } in &robot.sensors {
        let of = match *measures {
            Measured::JointPosition(joint) | Measured::JointVelocity(joint) | Measured::JointTorque(joint) => {
                &robot.joints[joint].name
            }
            Measured::FramePosition(frame) | Measured::FrameOrientation(frame) => {
                match frame.checked_sub(robot.links.len()) {
                    None => &robot.links[frame].name,
                    Some(other) => &robot.frames[other].name,
                }
            }
        };
        table.add_row([name(label), measures.name().into(), name(of)]);
    }
    table
}

fn key_table(robot: &Robot, tree: &Tree) -> Rows {
    let mut table = table(&["keyframe", "positions", "controls"]);
    let list = |numbers: &[f64]| numbers.iter().map(|&entry| number(entry)).collect::<Vec<_>>().join(",");
    for key in robot.keys.iter().take(MOST_KEYS) {
        let Key { name: label, controls, .. } = key;
        table.add_row([name(label), list(&key.q(tree)), list(controls)]);
    }
    if let Some(rest) = robot.keys.len().checked_sub(MOST_KEYS).filter(|rest| *rest > 0) {
        table.add_row([format!("and {rest} more"), String::new(), String::new()]);
    }
    table
}

fn wall_table(robot: &Robot) -> Rows {
    let mut table = table(&["wall", "shape", "at x y z, m", "z axis"]);
    for Wall { name: label, shape, pose, .. } in &robot.walls {
        let shape = match shape {
            WallShape::Plane => "plane".to_owned(),
            WallShape::Box(halves) => format!("box {} m", vector(halves.map(|half| 2.0 * half))),
        };
        let axis = pose.rotation.map(|row| (row[2] * 1e6).round() * 1e-6);
        table.add_row([name(label), shape, vector(pose.position), vector(axis)]);
    }
    table
}
