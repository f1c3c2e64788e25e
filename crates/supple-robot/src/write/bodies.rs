//! Writes links and joints as nested bodies.

use super::mended::{is_solid, mended};
use super::rotation::quaternion;
use super::text::{Attributes, Text, named};
use crate::{Frame, Inertia, Joint, JointKind, Pose, Primitive, Robot, Solid, WallShape};

/// State for writing a robot's bodies as MJCF.
pub(super) struct Bodies<'a> {
    pub robot: &'a Robot,
    /// Joints by the link that they hang on.
    children: Vec<Vec<usize>>,
    /// Joints in the order in which they are written.
    pub order: Vec<usize>,
    pub warnings: Vec<String>,
}

/// Joints that together carry one body, the first one nearest to the root, each with its frame in that body when all
/// are at their references.
struct Chain {
    joints: Vec<(usize, Pose)>,
    /// The body in the parent link where all joints are at their references.
    pose: Pose,
    link: usize,
}

impl<'a> Bodies<'a> {
    pub fn of(robot: &'a Robot) -> Self {
        let mut children = vec![Vec::new(); robot.links.len()];
        for (index, joint) in robot.joints.iter().enumerate() {
            children[joint.parent].push(index);
        }
        Self { robot, children, order: Vec::new(), warnings: Vec::new() }
    }

    /// Writes the world, which is the root link, and all bodies in it.
    pub fn write(&mut self, text: &mut Text) {
        let root = &self.robot.links[0];
        let is_world = root.name == "world";
        if !is_world {
            text.open("body", named(&root.name));
            self.inertia(0, false, text);
        } else if root.inertia.is_some() {
            self.warnings.push("the root link `world` is the world of MJCF: its inertia is left out".to_owned());
        }
        // A body is closed when the next one is not inside it.
        let mut open: Vec<(usize, usize)> = Vec::new();
        primitives(self.robot, 0, text);
        self.frames(0, text);
        open.extend(self.children[0].iter().rev().map(|&joint| (joint, 0)));
        let mut depth = 0;
        while let Some((joint, level)) = open.pop() {
            while depth > level {
                text.close();
                depth -= 1;
            }
            let chain = self.chain(joint);
            self.body(&chain, text);
            depth += 1;
            open.extend(self.children[chain.link].iter().rev().map(|&joint| (joint, level + 1)));
        }
        (0..depth).for_each(|_| text.close());
        if !is_world {
            text.close();
        }
    }

    /// The joints, from `first` on, that carry one body: a link without inertia and frames that carries only the next
    /// joint is not written as a body of its own.
    fn chain(&self, first: usize) -> Chain {
        let Robot { joints, links, frames, .. } = self.robot;
        let mut chain = vec![first];
        let mut last = first;
        loop {
            let link = last + 1;
            let is_bare = links[link].inertia.is_none() && frames.iter().all(|frame| frame.link != link);
            let next = match self.children[link][..] {
                [next] if is_bare && moves(&joints[last]) && moves(&joints[next]) => next,
                _ => break,
            };
            chain.push(next);
            last = next;
        }
        // Frames of joints in the body, from the last one back.
        let mut to_body = Pose::IDENTITY;
        let mut placed = Vec::new();
        for &index in chain.iter().rev() {
            let joint = &joints[index];
            to_body = joint.child_pose.compose(&to_body);
            placed.push((index, to_body.inverse()));
            to_body = joint.origin.compose(&to_body);
        }
        placed.reverse();
        Chain { joints: placed, pose: to_body, link: last + 1 }
    }

    fn body(&mut self, chain: &Chain, text: &mut Text) {
        let link = &self.robot.links[chain.link];
        text.open("body", placed(named(&link.name), &chain.pose));
        for &(index, frame) in &chain.joints {
            let joint = &self.robot.joints[index];
            self.order.push(index);
            if moves(joint) {
                text.element("joint", attributes(joint, &frame));
            }
            if joint.limits.velocity.is_finite() {
                self.warnings.push(format!(
                    "joint `{}`: MJCF has no speed limit; {} is left out",
                    joint.name, joint.limits.velocity
                ));
            }
            if joint.limits.effort == 0.0 {
                self.warnings.push(format!("joint `{}`: MJCF has no limit of force of 0; it is left out", joint.name));
            }
            if [joint.limits.lower, joint.limits.upper].iter().filter(|bound| bound.is_finite()).count() == 1 {
                self.warnings
                    .push(format!("joint `{}`: MJCF has no one-sided ranges; the range is left out", joint.name));
            }
        }
        let moved = chain.joints.iter().any(|&(index, _)| moves(&self.robot.joints[index]));
        self.inertia(chain.link, moved && !self.is_solid(chain.link), text);
        primitives(self.robot, chain.link, text);
        self.frames(chain.link, text);
    }

    /// Whether MuJoCo accepts a moving body, given its own inertia, or that of a link fixed to it.
    fn is_solid(&self, link: usize) -> bool {
        let mut waiting = vec![link];
        while let Some(link) = waiting.pop() {
            if self.robot.links[link].inertia.as_ref().is_some_and(is_solid) {
                return true;
            }
            let fixed = self.children[link].iter().filter(|&&next| !moves(&self.robot.joints[next]));
            waiting.extend(fixed.map(|next| next + 1));
        }
        false
    }

    /// Writes the inertia of a link, or a replacement that MuJoCo accepts; `lacks` if it moves and has too little.
    fn inertia(&mut self, link: usize, lacks: bool, text: &mut Text) {
        let link = &self.robot.links[link];
        let Some(mended) = mended(link.inertia.as_ref(), lacks) else {
            inertia(link.inertia.as_ref(), text);
            return;
        };
        if let Some(why) = &mended.why {
            text.comment(&format!("link {} {why}", link.name));
            self.warnings.push(format!("link `{}` {why}", link.name));
        }
        let head = Attributes::default().numbers("pos", &mended.center.map(plain)).numbers("mass", &[mended.mass]);
        let turned = if mended.axes == Pose::IDENTITY.rotation {
            head
        } else {
            head.numbers("quat", &quaternion(&mended.axes).map(plain))
        };
        text.element("inertial", turned.numbers("diaginertia", &mended.moments.map(plain)));
    }

    fn frames(&self, link: usize, text: &mut Text) {
        for Frame { name, pose, .. } in self.robot.frames.iter().filter(|frame| frame.link == link) {
            text.element("site", placed(named(name), pose));
        }
    }
}

/// The visual shapes of a link, as geoms that touch nothing; those that are walls are written as such.
fn primitives(robot: &Robot, link: usize, text: &mut Text) {
    let is_wall = |primitive: &Primitive| {
        let Solid::Box { size } = primitive.solid else { return false };
        let shape = WallShape::Box(size.map(|edge| 0.5 * edge));
        link == 0 && robot.walls.iter().any(|wall| wall.shape == shape && wall.pose == primitive.pose)
    };
    for primitive in robot.links[link].primitives.iter().filter(|primitive| !is_wall(primitive)) {
        let (kind, size) = match primitive.solid {
            Solid::Box { size } => ("box", size.map(|edge| 0.5 * edge).to_vec()),
            Solid::Sphere { radius } => ("sphere", vec![radius]),
            Solid::Cylinder { radius, length } => ("cylinder", vec![radius, 0.5 * length]),
            Solid::Capsule { radius, length } => ("capsule", vec![radius, 0.5 * length]),
            Solid::Ellipsoid { radii } => ("ellipsoid", radii.to_vec()),
        };
        let shape = Attributes::default().text("type", kind).numbers("size", &size);
        let shape = shape.numbers("contype", &[0.0]).numbers("conaffinity", &[0.0]);
        text.element("geom", placed(shape, &primitive.pose));
    }
}

fn moves(joint: &Joint) -> bool {
    joint.kind != JointKind::Fixed
}

/// Attributes of a joint with the given frame in its body.
fn attributes(joint: &Joint, frame: &Pose) -> Attributes {
    let kind = if joint.kind == JointKind::Prismatic { "slide" } else { "hinge" };
    let limits = &joint.limits;
    named(&joint.name)
        .text("type", kind)
        .numbers("pos", &frame.position.map(plain))
        .numbers("axis", &frame.rotate(joint.axis).map(plain))
        .range("range", [limits.lower, limits.upper])
        .range("actuatorfrcrange", [-limits.effort, limits.effort])
        .unless("damping", joint.damping, 0.0)
        .unless("frictionloss", joint.friction, 0.0)
        .unless("armature", joint.armature, 0.0)
        .unless("stiffness", joint.stiffness, 0.0)
        .unless("springref", joint.rest, 0.0)
        .unless("ref", joint.reference, 0.0)
}

/// Adds a position and, unless it is the identity, a rotation to the attributes.
pub(super) fn placed(attributes: Attributes, pose: &Pose) -> Attributes {
    let attributes = match pose.position {
        [0.0, 0.0, 0.0] => attributes,
        position => attributes.numbers("pos", &position.map(plain)),
    };
    if pose.rotation == Pose::IDENTITY.rotation {
        return attributes;
    }
    attributes.numbers("quat", &quaternion(&pose.rotation).map(plain))
}

/// Avoids negative zero.
fn plain(value: f64) -> f64 {
    value + 0.0
}

fn inertia(inertia: Option<&Inertia>, text: &mut Text) {
    let Some(Inertia { mass, center, moment: m }) = inertia else { return };
    let mut attributes = Attributes::default().numbers("pos", &center.map(plain)).numbers("mass", &[*mass]);
    attributes = if m[0][1] == 0.0 && m[0][2] == 0.0 && m[1][2] == 0.0 {
        attributes.numbers("diaginertia", &[m[0][0], m[1][1], m[2][2]])
    } else {
        attributes.numbers("fullinertia", &[m[0][0], m[1][1], m[2][2], m[0][1], m[0][2], m[1][2]])
    };
    text.element("inertial", attributes);
}
