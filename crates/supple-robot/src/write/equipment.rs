//! Joints that follow others, actuators, sensors, keyframes and walls.

use super::bodies::placed;
use super::text::{Attributes, Text, named};
use crate::{Actuator, Joint, JointKind, Law, Measured, Robot, WallShape};

/// Named planes and boxes that do not move.
pub(super) fn walls(robot: &Robot, text: &mut Text) {
    for wall in &robot.walls {
        let (kind, size) = match wall.shape {
            WallShape::Plane => ("plane", [0.0, 0.0, 0.05]),
            WallShape::Box(halves) => ("box", halves),
        };
        text.element("geom", placed(named(&wall.name).text("type", kind).numbers("size", &size), &wall.pose));
    }
}

/// `q - ref = c0 + ratio (q_leader - ref_leader)`
pub(super) fn followers(robot: &Robot, text: &mut Text) {
    if robot.joints.iter().all(|joint| joint.mimic.is_none()) {
        return;
    }
    text.open("equality", Attributes::default());
    for joint in &robot.joints {
        let Some(mimic) = joint.mimic else { continue };
        let leader = &robot.joints[mimic.joint];
        let offset = mimic.offset + mimic.ratio * leader.reference - joint.reference;
        let names = Attributes::default().text("joint1", &joint.name).text("joint2", &leader.name);
        text.element("joint", names.numbers("polycoef", &[offset, mimic.ratio, 0.0, 0.0, 0.0]));
    }
    text.close();
}

pub(super) fn actuators(robot: &Robot, text: &mut Text) {
    if robot.actuators.is_empty() {
        return;
    }
    text.open("actuator", Attributes::default());
    for actuator in &robot.actuators {
        let Actuator { name, gear, law, control, force, .. } = actuator;
        let head = named(name).text("joint", &robot.joints[actuator.joint].name).unless("gear", *gear, 1.0);
        let head = head.range("ctrlrange", *control).range("forcerange", *force);
        match *law {
            Law::Motor { gain: 1.0 } => text.element("motor", head),
            Law::Motor { gain } => text.element("general", head.numbers("gainprm", &[gain])),
            Law::Position { kp, kv } => text.element("position", head.numbers("kp", &[kp]).unless("kv", kv, 0.0)),
            Law::Velocity { kv } => text.element("velocity", head.numbers("kv", &[kv])),
            Law::Affine { gain, offset, kp, kv } => {
                let bias = head.numbers("gainprm", &[gain]).text("biastype", "affine");
                text.element("general", bias.numbers("biasprm", &[offset, 0.0 - kp, 0.0 - kv]));
            }
        }
    }
    text.close();
}

pub(super) fn sensors(robot: &Robot, text: &mut Text) {
    if robot.sensors.is_empty() {
        return;
    }
    text.open("sensor", Attributes::default());
    for sensor in &robot.sensors {
        let joint = |index: usize| named(&sensor.name).text("joint", &robot.joints[index].name);
        let frame = |number: usize| {
            let (kind, name) = match robot.links.get(number) {
                Some(link) => ("xbody", &link.name),
                None => ("site", &robot.frames[number - robot.links.len()].name),
            };
            named(&sensor.name).text("objtype", kind).text("objname", name)
        };
        let (tag, attributes) = match sensor.measures {
            Measured::JointPosition(index) => ("jointpos", joint(index)),
            Measured::JointVelocity(index) => ("jointvel", joint(index)),
            Measured::JointTorque(index) => ("jointactuatorfrc", joint(index)),
            Measured::FramePosition(number) => ("framepos", frame(number)),
            Measured::FrameOrientation(number) => ("framequat", frame(number)),
        };
        text.element(tag, attributes.unless("noise", sensor.noise, 0.0));
    }
    text.close();
}

/// Keyframes; positions in the order in which the joints were written.
pub(super) fn keys(robot: &Robot, order: &[usize], text: &mut Text) {
    if robot.keys.is_empty() {
        return;
    }
    text.open("keyframe", Attributes::default());
    let moving = |joint: &Joint| joint.kind != JointKind::Fixed;
    let moving: Vec<usize> = order.iter().copied().filter(|&index| moving(&robot.joints[index])).collect();
    for key in &robot.keys {
        let of = |numbers: &[f64]| moving.iter().map(|&joint| numbers[joint]).collect::<Vec<_>>();
        let mut attributes = named(&key.name);
        if !moving.is_empty() {
            attributes = attributes.numbers("qpos", &of(&key.positions)).numbers("qvel", &of(&key.velocities));
        }
        if !key.controls.is_empty() {
            attributes = attributes.numbers("ctrl", &key.controls);
        }
        text.element("key", attributes);
    }
    text.close();
}
