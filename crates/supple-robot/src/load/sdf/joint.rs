//! A `joint`: its kind, its place between its links, and its axis.

use supple_text::FileError;

use super::super::joint_kind::joint_kind;
use super::super::parts::{JointPart, MimicPart, Reference};
use super::super::words::shown;
use super::super::xml::Element;
use super::Reader;
use super::frames::WORLD;
use super::frames::{Frames, MODEL, child};
use super::values::{Version, flag, number, pass_over};
use crate::{JointKind, Limits, Pose};

/// Elements of `joint` that are read.
const JOINT: [&str; 5] = ["parent", "child", "pose", "axis", "axis2"];
/// Elements of `joint` that are known and not modelled.
const JOINT_IGNORED: [&str; 8] = [
    "physics",
    "sensor",
    "frame",
    "plugin",
    "gearbox_ratio",
    "gearbox_reference_body",
    "thread_pitch",
    "screw_thread_pitch",
];
/// Elements of `axis` that are read.
const AXIS: [&str; 5] = ["xyz", "limit", "dynamics", "mimic", "use_parent_model_frame"];
/// Elements of `axis` that are known and not modelled.
const AXIS_IGNORED: [&str; 1] = ["initial_position"];
/// Limits of at least this size mean unlimited.
const UNLIMITED: f64 = 1e16;

impl Reader<'_> {
    /// The joint of a node. `placed` is the model in the world.
    ///
    /// # Errors
    /// Where anything in it is wrong, or it is of a kind that is not supported.
    pub(super) fn joint<'a>(
        &mut self,
        node: usize,
        frames: &Frames<'a>,
        placed: &Pose,
    ) -> Result<JointPart<'a>, FileError> {
        let at = frames.element(node);
        let kind = joint_kind(at, &["ball", "universal", "screw", "gearbox", "revolute2"])?;
        for element in at.children() {
            pass_over(element, &JOINT, &JOINT_IGNORED, &mut self.warnings);
        }
        if let Some(second) = at.child("axis2")? {
            self.warnings.ignore(second);
        }
        let parent = at.required_child("parent")?;
        let parent = Reference { at: parent, name: parent.content()?.into_owned() };
        let child = child(at)?;
        let (parent_link, origin) = match parent.name.as_str() {
            WORLD if !frames.has_world() => (WORLD, placed.compose(&frames.between(MODEL, node))),
            _ => {
                let link = frames.link_of(frames.find(&parent)?);
                (frames.name(link), frames.between(link, node))
            }
        };
        let child_link = frames.link_of(node);
        let end = |reference: Reference<'a>, link: &str| Reference { at: reference.at, name: link.to_owned() };
        let (parent, child) = (end(parent, parent_link), end(child, frames.name(child_link)));
        let mut joint = JointPart::new(at, frames.name(node), kind, parent, child);
        joint.own.origin = origin;
        joint.own.child_pose = frames.between(node, child_link);
        match at.child("axis")? {
            Some(axis) if kind != JointKind::Fixed => self.axis(axis, node, frames, &mut joint)?,
            None if kind != JointKind::Fixed => return Err(at.error("a joint that moves must have an `axis`")),
            _ => {}
        }
        Ok(joint)
    }

    /// The `axis` of a joint, with all that is in it.
    fn axis<'a>(
        &mut self,
        at: Element<'a>,
        node: usize,
        frames: &Frames<'a>,
        joint: &mut JointPart<'a>,
    ) -> Result<(), FileError> {
        for element in at.children() {
            pass_over(element, &AXIS, &AXIS_IGNORED, &mut self.warnings);
        }
        let xyz = at.required_child("xyz")?;
        joint.own.axis = xyz.content_numbers()?;
        let in_model = at.child("use_parent_model_frame")?.map(flag).transpose()?;
        let expressed_in = match xyz.attribute("expressed_in").filter(|name| !name.is_empty()) {
            Some(name) => Some(frames.find(&Reference { at: xyz, name: name.to_owned() })?),
            None if in_model.unwrap_or(self.version < Version::AXIS_IN_JOINT) => Some(MODEL),
            None => None,
        };
        if let Some(frame) = expressed_in {
            joint.own.axis = frames.between(node, frame).rotate(joint.own.axis);
        }
        if let Some(dynamics) = at.child("dynamics")? {
            let value = |tag| Ok(number(dynamics, tag)?.unwrap_or(0.0));
            (joint.own.damping, joint.own.friction) = (value("damping")?, value("friction")?);
            (joint.own.stiffness, joint.own.rest) = (value("spring_stiffness")?, value("spring_reference")?);
        }
        if let Some(limit) = at.child("limit")? {
            joint.own.limits = limits(limit)?;
        }
        let Limits { lower, upper, .. } = joint.own.limits;
        let limited = lower.is_finite() || upper.is_finite();
        if joint.own.kind == JointKind::Revolute && !limited {
            joint.own.kind = JointKind::Continuous;
        } else if joint.own.kind == JointKind::Continuous && limited {
            self.warnings.note("continuous", at, || {
                "a continuous joint has no `lower` and `upper`, and they are ignored".to_owned()
            });
        }
        joint.mimic = at.child("mimic")?.map(mimic).transpose()?;
        Ok(())
    }
}

/// The `limit` of an axis. Numbers of 1e16 and more mean unlimited, as do a negative effort and velocity.
fn limits(at: Element) -> Result<Limits, FileError> {
    let value = |tag: &str| at.child(tag)?.map(Element::content_extended).transpose();
    let most = |tag: &str| {
        let found = value(tag)?.unwrap_or(f64::INFINITY);
        Ok(if (0.0..UNLIMITED).contains(&found) { found } else { f64::INFINITY })
    };
    let position = |tag: &str, none: f64| {
        let found = value(tag)?.unwrap_or(none);
        if found.is_infinite() && found != none {
            return Err(at.error(format!("`{tag}` must not be {found}")));
        }
        // At or beyond the bound that means unlimited, on the corresponding side.
        Ok(if found * none.signum() >= UNLIMITED { none } else { found })
    };
    Ok(Limits {
        lower: position("lower", f64::NEG_INFINITY)?,
        upper: position("upper", f64::INFINITY)?,
        velocity: most("velocity")?,
        effort: most("effort")?,
    })
}

/// A `mimic`: `position = multiplier (position of the other - reference) + offset`.
fn mimic(at: Element) -> Result<MimicPart, FileError> {
    let name = at.required("joint")?.to_owned();
    if let Some(axis) = at.attribute("axis").filter(|&axis| axis != "axis") {
        return Err(at.error_at("axis", format!("only one `axis` per joint is supported; {} is not", shown(axis))));
    }
    let ratio = number(at, "multiplier")?.unwrap_or(1.0);
    let offset = number(at, "offset")?.unwrap_or(0.0) - ratio * number(at, "reference")?.unwrap_or(0.0);
    Ok(MimicPart { joint: Reference { at, name }, ratio, offset })
}
