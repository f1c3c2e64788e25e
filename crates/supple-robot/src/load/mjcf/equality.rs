//! The `equality` sections: joints that follow others.

use std::collections::HashMap;

use supple_text::FileError;

use super::super::parts::{MimicPart, Reference};
use super::super::words::{listed, near, shown};
use super::super::xml::Element;
use super::defaults::MAIN;
use super::known::check_attributes;
use super::reader::Reader;

/// Kinds of equality that are known.
const KINDS: [&str; 7] = ["joint", "connect", "weld", "tendon", "flex", "flexvert", "flexstrain"];

/// Advice on an equality that is not supported.
const WITHOUT: &str = "to plan without it, remove it or set `active=\"false\"`";
/// The same on one of tendons.
const AS_JOINT: &str = "where it couples two joints, write an equality of type `joint`; to plan without it, remove it or set `active=\"false\"`";

impl<'a> Reader<'a, '_> {
    /// Makes joints follow others. Inactive equalities are left out, with a warning.
    ///
    /// ```text
    /// q1 - ref1 = c0 + c1 (q2 - ref2)
    /// ```
    ///
    /// # Errors
    /// If a joint is unknown or already follows another, the relation is nonlinear, or a loop would be closed.
    pub(super) fn equalities(&mut self, root: Element<'a>) -> Result<(), FileError> {
        let joints = self.parts.joints.iter().enumerate().map(|(i, joint)| (joint.own.name.clone(), i));
        let joints: HashMap<_, _> = joints.collect();
        for at in root.all("equality").flat_map(Element::children) {
            if !KINDS.contains(&at.tag()) {
                self.parts.warnings.unknown(at, &KINDS);
                continue;
            }
            let values = self.classes.values(at, "equality", MAIN)?;
            if values.choice("active", &[("true", true), ("false", false)])? == Some(false) {
                let warn = || format!("{} that is not active is ignored", shown(at.tag()));
                self.parts.warnings.note("inactive", at, warn);
                continue;
            }
            match at.tag() {
                "joint" => self.follow(at, &joints)?,
                "connect" | "weld" => {
                    let message = format!("{} closes a loop of bodies, which is not supported", shown(at.tag()));
                    return Err(at.error(message).with_help(WITHOUT));
                }
                "tendon" => {
                    let message = "an equality of type `tendon` is not supported";
                    return Err(at.error(message).with_help(AS_JOINT));
                }
                tag => {
                    let message = format!("an equality of type {} is not supported", shown(tag));
                    return Err(at.error(message).with_help(WITHOUT));
                }
            }
        }
        Ok(())
    }

    /// One `joint` element in `equality`.
    fn follow(&mut self, at: Element<'a>, joints: &HashMap<String, usize>) -> Result<(), FileError> {
        check_attributes(at, "equality", &mut self.parts.warnings);
        let find = |attribute: &str| {
            let name = at.required(attribute)?;
            joints.get(name).copied().ok_or_else(|| {
                let known: Vec<_> = self.parts.joints.iter().map(|joint| joint.own.name.as_str()).collect();
                let message = format!("there is no joint {}; known: {}", shown(name), listed(&known));
                let error = at.error_at(attribute, message);
                match near(name, &known) {
                    Some(help) => error.with_help(help),
                    None => error,
                }
            })
        };
        let follower = find("joint1")?;
        if at.attribute("joint2").is_none() {
            let message =
                format!("`joint2` is missing, which locks joint {}", shown(at.attribute("joint1").unwrap_or("")));
            return Err(at.error(message).with_help("remove the joint, as it does not move"));
        }
        let leader = find("joint2")?;
        let mut coefficients = [0.0, 1.0, 0.0, 0.0, 0.0];
        if let Some(found) = at.list("polycoef")? {
            if found.len() > 5 {
                return Err(
                    at.error_at("polycoef", format!("`polycoef` must have at most 5 numbers; found {}", found.len()))
                );
            }
            coefficients.iter_mut().zip(found).for_each(|(coefficient, found)| *coefficient = found);
        }
        let [offset, ratio, rest @ ..] = coefficients;
        if rest != [0.0; 3] {
            let message = "only a linear relation is supported: the last three of five coefficients must be 0";
            return Err(at.error_at("polycoef", message));
        }
        let (led, lead) = (&self.parts.joints[follower], &self.parts.joints[leader]);
        if let Some(first) = &led.mimic {
            let message =
                format!("joint {} already follows another, at {}", shown(&led.own.name), first.joint.at.place());
            return Err(at.error_at("joint1", message));
        }
        let offset = led.own.reference + offset - ratio * lead.own.reference;
        let joint = Reference { at, name: lead.own.name.clone() };
        self.parts.joints[follower].mimic = Some(MimicPart { joint, ratio, offset });
        Ok(())
    }
}
