//! The `sensor` sections: measured quantities of the robot.

use std::collections::{HashMap, HashSet};

use supple_text::FileError;

use super::super::words::{listed, near, shown};
use super::super::xml::Element;
use super::known::{SENSORS, check_attributes};
use super::reader::{Of, Reader, SensorPart, Target};
use crate::{JointKind, Measured, Omitted};

/// Sensors that are supported; others are known but left out.
const READ: [&str; 7] =
    ["jointpos", "jointvel", "jointactuatorfrc", "actuatorpos", "actuatorvel", "framepos", "framequat"];

/// What sensors may name.
struct Known<'k> {
    /// Index in the file of each joint.
    joints: HashMap<&'k str, usize>,
    /// For each body, whether its centre of mass is its origin.
    bodies: HashMap<&'k str, bool>,
    sites: HashSet<&'k str>,
}

impl<'a> Reader<'a, '_> {
    /// The sensors of the file. What cannot be modelled is left out, with one warning for each kind.
    ///
    /// # Errors
    /// If a measured object does not exist, or a name is used twice.
    pub(super) fn read_sensors(&mut self, root: Element<'a>) -> Result<(), FileError> {
        let mut names: HashMap<&str, Element> = HashMap::new();
        let mut found = Vec::new();
        let known = self.known();
        for (number, at) in root.all("sensor").flat_map(Element::children).enumerate() {
            let label = at.attribute("name").filter(|name| !name.is_empty());
            if let Some(first) = label.and_then(|label| names.insert(label, at)) {
                let message = format!("there is another sensor of this name, at {}", first.place());
                return Err(at.error_at("name", message));
            }
            let name = label.map_or_else(|| format!("sensor{number}"), str::to_owned);
            let target = if READ.contains(&at.tag()) { Some(self.target(at, &known)?) } else { None };
            found.push((at, name, target));
        }
        for (at, name, target) in found {
            let (what, line) = ("sensor", at.line());
            match target {
                Some(Ok(target)) => {
                    check_attributes(at, "sensor", &mut self.parts.warnings);
                    let noise = at.number("noise")?.unwrap_or(0.0);
                    if at.number("cutoff")?.is_some_and(|cutoff| cutoff != 0.0) {
                        self.parts.warnings.note("cutoff", at, || "its `cutoff` is left out".to_owned());
                    }
                    self.sensors.push(SensorPart { name, target, noise, line });
                }
                Some(Err(why)) => self.omit(at, Omitted { what, name, why, line }),
                None if SENSORS.split_ascii_whitespace().any(|tag| tag == at.tag()) => {
                    self.parts.warnings.ignore(at);
                    let why = format!("sensors of kind {} are not supported", shown(at.tag()));
                    self.omitted.push(Omitted { what, name, why, line });
                }
                None => self.parts.warnings.unknown(at, &READ),
            }
        }
        Ok(())
    }

    fn known(&self) -> Known<'_> {
        let joints = self.parts.joints.iter().enumerate().filter(|(_, joint)| joint.own.kind != JointKind::Fixed);
        let centered = |center: [f64; 3]| center == [0.0; 3];
        let bodies = self.parts.links.iter().map(|link| {
            let at_origin = link.inertia.as_ref().is_none_or(|(inertia, _)| centered(inertia.center));
            (link.name.as_str(), at_origin)
        });
        Known {
            joints: joints.map(|(i, joint)| (joint.own.name.as_str(), i)).collect(),
            bodies: bodies.collect(),
            sites: self.parts.frames.iter().map(|frame| frame.name.as_str()).collect(),
        }
    }

    /// What a sensor measures, or why that cannot be modelled.
    fn target(&self, at: Element<'a>, known: &Known) -> Result<Result<Target, String>, FileError> {
        let of = match at.tag() {
            "framepos" => return framed(at, Measured::FramePosition, known),
            "framequat" => return framed(at, Measured::FrameOrientation, known),
            "actuatorpos" => return self.actuated(at, Measured::JointPosition),
            "actuatorvel" => return self.actuated(at, Measured::JointVelocity),
            "jointpos" => Measured::JointPosition,
            "jointvel" => Measured::JointVelocity,
            _ => Measured::JointTorque,
        };
        let name = at.required("joint")?;
        let joint = known.joints.get(name).copied();
        let joint = joint.ok_or_else(|| unknown(at, "joint", "joint", known.joints.keys().copied()))?;
        Ok(match self.leader(joint) {
            None => Ok(Target::Joint(joint, of)),
            Some(leader) => Err(format!(
                "its joint {} is a mimic joint of {}; measure that joint instead",
                shown(name),
                shown(leader)
            )),
        })
    }

    /// The joint that a joint follows.
    pub(super) fn leader(&self, joint: usize) -> Option<&str> {
        let mimic = self.parts.joints[joint].mimic.as_ref().filter(|_| !self.options.independent_mimic)?;
        Some(&mimic.joint.name)
    }

    /// What a sensor of an actuator measures: its joint's position or velocity, if the gear is 1.
    fn actuated(&self, at: Element<'a>, of: Of) -> Result<Result<Target, String>, FileError> {
        let name = at.required("actuator")?;
        let Some(&(number, _)) = self.actuators.names.get(name) else {
            return Err(unknown(at, "actuator", "actuator", self.actuators.names.keys().copied()));
        };
        Ok(match self.actuators.places[number].map(|place| &self.actuators.kept[place]) {
            Some(actuator) if actuator.gear == 1.0 => Ok(Target::Joint(actuator.joint, of)),
            Some(_) => Err(format!("the gear of actuator {} is not 1: measure its joint", shown(name))),
            None => Err(format!("its actuator {} is left out", shown(name))),
        })
    }
}

/// What a sensor of a frame measures.
fn framed(at: Element, of: Of, known: &Known) -> Result<Result<Target, String>, FileError> {
    const HELP: &str = "`objtype` \"xbody\" or \"site\" is supported";
    let (kind, name) = (at.required("objtype")?, at.required("objname")?);
    if let Some(reference) = at.attribute("refname") {
        let reference = shown(reference);
        return Ok(Err(format!(
            "it measures relative to {reference}; only measurements in the world frame are supported"
        )));
    }
    match kind {
        "xbody" | "body" => match known.bodies.get(name) {
            None => Err(unknown(at, "objname", "body", known.bodies.keys().copied())),
            Some(&centered) if kind == "xbody" || centered && at.tag() == "framepos" => {
                Ok(Ok(Target::Body(name.to_owned(), of)))
            }
            Some(_) => Ok(Err(format!("it is about the body's centre of mass and principal axes; {HELP}"))),
        },
        "site" if known.sites.contains(name) => Ok(Ok(Target::Site(name.to_owned(), of))),
        "site" => Err(unknown(at, "objname", "site", known.sites.iter().copied())),
        "geom" | "camera" => Ok(Err(format!("it is about a {kind}; {HELP}"))),
        _ => {
            let valid = listed(&["body", "xbody", "geom", "site", "camera"]);
            Err(at.error_at("objtype", format!("`objtype` is {}; valid: {valid}", shown(kind))))
        }
    }
}

/// The error about a name that is not known.
fn unknown<'k>(at: Element, attribute: &str, what: &str, known: impl Iterator<Item = &'k str>) -> FileError {
    let mut known: Vec<_> = known.collect();
    known.sort_unstable();
    let name = at.attribute(attribute).unwrap_or_default();
    let listed = if known.is_empty() { "there are none".to_owned() } else { format!("known: {}", listed(&known)) };
    let error = at.error_at(attribute, format!("there is no {what} {}; {listed}", shown(name)));
    FileError { help: near(name, &known), ..error }
}
