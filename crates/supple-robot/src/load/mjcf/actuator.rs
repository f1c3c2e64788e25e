//! The `actuator` sections: forces at joints.

use std::collections::HashMap;

use supple_text::FileError;

use super::super::words::{listed, near, shown};
use super::super::xml::Element;
use super::defaults::{MAIN, Values};
use super::known::{ACTUATORS, check_attributes};
use super::law::LAWS;
use super::reader::{Actuators, Reader};
use crate::{Actuator, JointKind, Law, Omitted};

/// Attributes for actuators on things other than joints, and what these are.
const OTHERS: [(&str, &str); 4] =
    [("tendon", "a tendon"), ("site", "a site"), ("body", "a body"), ("cranksite", "a slider-crank")];

impl<'a> Reader<'a, '_> {
    /// The actuators of the file. What cannot be modelled is left out, with a warning.
    ///
    /// # Errors
    /// Where a number is not valid, a joint is not known, or a name is used twice.
    pub(super) fn read_actuators(&mut self, root: Element<'a>) -> Result<(), FileError> {
        let joints = self.parts.joints.iter().enumerate().map(|(i, joint)| (joint.own.name.clone(), i));
        let joints: HashMap<_, _> = joints.collect();
        for at in root.all("actuator").flat_map(Element::children) {
            if ACTUATORS.split_ascii_whitespace().all(|tag| tag != at.tag()) {
                self.parts.warnings.unknown(at, &LAWS);
                continue;
            }
            let number = self.actuators.places.len();
            let label = at.attribute("name").filter(|name| !name.is_empty());
            if let Some((_, first)) = label.and_then(|label| self.actuators.names.insert(label, (number, at))) {
                let message = format!("there is another actuator of this name, at {}", first.place());
                return Err(at.error_at("name", message));
            }
            let found = self.actuator(at, &joints)?;
            let name = label.map(str::to_owned);
            match found {
                Ok((actuator, ratio)) => {
                    let place = self.actuators.kept.len();
                    self.actuators.places.push(Some(place));
                    self.actuators.ratios.extend(ratio.map(|ratio| (place, ratio)));
                    self.actuators.kept.push(Actuator { name: name.unwrap_or_default(), ..actuator });
                }
                Err(why) => {
                    self.actuators.places.push(None);
                    let name = name.unwrap_or_else(|| format!("actuator{number}"));
                    self.omit(at, Omitted { what: "actuator", name, why, line: at.line() });
                }
            }
        }
        if self.actuators.kept.is_empty()
            && self.omitted.iter().any(|omitted| omitted.what == "actuator")
            && let Some(at) = root.all("actuator").next()
        {
            self.parts.warnings.note("no actuator", at, || {
                "no actuator of the file is supported: tasks have a control for each joint instead, an effort"
                    .to_owned()
            });
        }
        self.name_actuators();
        Ok(())
    }

    /// Records what cannot be modelled, with a warning.
    pub(super) fn omit(&mut self, at: Element<'a>, omitted: Omitted) {
        let Omitted { what, name, why, .. } = &omitted;
        self.parts
            .warnings
            .note(&format!("{what} {name} {why}"), at, || format!("{what} {} is left out: {why}", shown(name)));
        self.omitted.push(omitted);
    }

    /// An actuator without its name, with its damping ratio if its damping is given by one; or why it cannot be modelled.
    fn actuator(
        &mut self,
        at: Element<'a>,
        joints: &HashMap<String, usize>,
    ) -> Result<Result<(Actuator, Option<f64>), String>, FileError> {
        let tag = at.tag();
        let Some(&tag) = LAWS.iter().find(|law| **law == tag) else {
            return Ok(Err(format!("actuators of kind {} are not supported", shown(tag))));
        };
        check_attributes(at, tag, &mut self.parts.warnings);
        let values = self.classes.values(at, "actuator", MAIN)?;
        let mut numbers = self.classes.numbers(at)?;
        numbers.update(at)?;
        if let Some((name, what)) = OTHERS.iter().find(|(name, _)| at.attribute(name).is_some()) {
            let target = shown(at.attribute(name).unwrap_or_default());
            return Ok(Err(format!("it acts on {what}, {target}; only actuators of joints are supported")));
        }
        let attribute = if at.attribute("joint").is_some() { "joint" } else { "jointinparent" };
        let Some(target) = at.attribute(attribute) else {
            return Err(at.error("it acts on nothing").with_help("name the joint that it drives: `joint`"));
        };
        let Some(&joint) = joints.get(target) else {
            let known: Vec<_> = self.moving().map(|joint| joint.own.name.as_str()).collect();
            let message = format!("there is no joint {}; known: {}", shown(target), listed(&known));
            let error = at.error_at(attribute, message);
            return Err(FileError { help: near(target, &known), ..error });
        };
        let gear = gear(&values)?;
        let control = self.control_range(&values, joint)?;
        let force = self.range(&values, "forcerange", "forcelimited")?.unwrap_or([f64::NEG_INFINITY, f64::INFINITY]);
        if gear == 0.0 {
            return Ok(Err("its gear is 0: it exerts no force".to_owned()));
        }
        self.reflect(&values, joint, gear)?;
        if values.number("delay")?.is_some_and(|delay| delay > 0.0) {
            return Ok(Err("its control is delayed, which is not supported".to_owned()));
        }
        if let Some(leader) = self.leader(joint) {
            return Ok(Err(format!("its joint {} follows {}: drive that one", shown(target), shown(leader))));
        }
        let (law, ratio) = match numbers.law() {
            Ok((Law::Motor { gain: 0.0 }, _)) => return Ok(Err("its gain is 0: it exerts no force".to_owned())),
            Ok(law) => law,
            Err(why) => return Ok(Err(why.to_owned())),
        };
        Ok(Ok((Actuator { name: String::new(), joint, gear, law, control, force, line: at.line() }, ratio)))
    }

    /// Joints that move, in the order of the file.
    pub(super) fn moving(&self) -> impl Iterator<Item = &super::super::parts::JointPart<'a>> {
        self.parts.joints.iter().filter(|joint| joint.own.kind != JointKind::Fixed)
    }

    /// The range of an actuator's control, which may be that of its joint.
    fn control_range(&self, values: &Values, joint: usize) -> Result<[f64; 2], FileError> {
        let free = [f64::NEG_INFINITY, f64::INFINITY];
        let own = self.range(values, "ctrlrange", "ctrllimited")?;
        let inherited = values.number("inheritrange")?.unwrap_or(0.0);
        if inherited <= 0.0 || !matches!(values.at.tag(), "position" | "general") {
            return Ok(own.unwrap_or(free));
        }
        let limits = self.parts.joints[joint].own.limits;
        if own.is_some() {
            return Err(values.error("inheritrange", "give either `ctrlrange` or `inheritrange`, not both"));
        }
        if !(limits.lower.is_finite() && limits.upper.is_finite()) {
            return Err(values.error("inheritrange", "its joint has no range to inherit"));
        }
        let (middle, half) = (0.5 * (limits.lower + limits.upper), 0.5 * (limits.upper - limits.lower));
        Ok([middle - inherited * half, middle + inherited * half])
    }

    /// Adds inertia and damping of an actuator to its joint, multiplied by `gear^2`.
    fn reflect(&mut self, values: &Values<'a, '_>, joint: usize, gear: f64) -> Result<(), FileError> {
        let square = gear * gear;
        let armature = square * values.number("armature")?.unwrap_or(0.0);
        let damping = square * super::joint::linear(values, "damping")?;
        let joint = &mut self.parts.joints[joint];
        joint.own.armature += armature;
        joint.own.damping += damping;
        Ok(())
    }

    /// Names unnamed actuators after their joint, or with a number if that name is taken.
    fn name_actuators(&mut self) {
        let Actuators { kept, places, .. } = &mut self.actuators;
        let mut taken: std::collections::HashSet<String> = kept.iter().map(|actuator| actuator.name.clone()).collect();
        let numbers: Vec<_> = (0..places.len()).filter(|&number| places[number].is_some()).collect();
        for (actuator, number) in kept.iter_mut().zip(numbers).filter(|(actuator, _)| actuator.name.is_empty()) {
            let mut name = self.parts.joints[actuator.joint].own.name.clone();
            if taken.contains(&name) {
                name = format!("actuator{number}");
            }
            while !taken.insert(name.clone()) {
                name.push('_');
            }
            actuator.name = name;
        }
    }
}

/// The gear of an actuator at a joint: the first number.
fn gear(values: &Values) -> Result<f64, FileError> {
    let Some(found) = values.list("gear")? else { return Ok(1.0) };
    if found.len() > 6 {
        return Err(values.error("gear", format!("`gear` must have at most 6 numbers; found {}", found.len())));
    }
    Ok(found.first().copied().unwrap_or(1.0))
}
