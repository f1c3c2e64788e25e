//! MJCF, the format of MuJoCo: bodies in bodies, with joints, inertias and sites in them, and classes of defaults.
//!
//! Source: the reference at <https://mujoco.readthedocs.io/en/stable/XMLreference.html>, versions up to 4.0.

mod actuator;
mod angles;
mod body;
mod defaults;
mod equality;
mod equip;
mod geom;
mod include;
mod inertia;
mod joint;
mod key;
mod known;
mod law;
mod meshes;
mod orientation;
mod reader;
mod sensor;
mod settings;

use std::collections::HashSet;
use std::path::Path;

use supple_text::FileError;

use self::defaults::Classes;
pub(super) use self::include::Sources;
use self::reader::Reader;
use self::settings::{Settings, gravity};
use super::assemble::assemble;
use super::options::LoadOptions;
use super::warnings::Warnings;
use super::words::shown;
use super::xml::{Document, Element};
use crate::Robot;

/// The name of the root link, which is the world.
const WORLD: &str = "world";
/// Sections that are read.
const SECTIONS: [&str; 9] =
    ["compiler", "option", "default", "asset", "worldbody", "equality", "actuator", "sensor", "keyframe"];
/// Sections that do not affect the dynamics.
const SECTIONS_PASSED: [&str; 4] = ["size", "statistic", "visual", "custom"];
/// Sections that are known but not modelled.
const SECTIONS_IGNORED: [&str; 4] = ["contact", "tendon", "extension", "deformable"];

/// Reads an MJCF file. Meshes are looked for in `folder`.
///
/// The root link is `world`. A body without joints hangs on a fixed joint `BODY/fixed`. A body with several joints
/// hangs on the last of them; each of the others carries a link `BODY/JOINT` without inertia, which coincides with the
/// body when the joints after it are at their references. Bodies and joints without a name are called `body3`, `joint2`,
/// by the number that MuJoCo gives them: bodies from 1, joints from 0.
///
/// # Errors
/// If anything in it is invalid or cannot be modelled: free and ball joints, closed loops, and replicated bodies.
pub(super) fn read(document: &Document, options: &LoadOptions, folder: &Path) -> Result<Robot, FileError> {
    let root = document.root();
    let names = names(root);
    let mut warnings = Warnings::default();
    for section in root.children() {
        let tag = section.tag();
        if SECTIONS_IGNORED.contains(&tag) {
            warnings.ignore(section);
        } else if !SECTIONS.contains(&tag) && !SECTIONS_PASSED.contains(&tag) {
            warnings.unknown(section, &[&SECTIONS[..], &SECTIONS_IGNORED].concat());
        }
    }
    leave_out_tendons(root, &mut warnings)?;
    let settings = Settings::read(root)?;
    let gravity = gravity(root, &mut warnings)?;
    let classes = Classes::read(root, &mut warnings)?;
    let mut reader = Reader::new(&settings, &classes, names, options, folder, warnings);
    reader.parts.name = root.attribute("model").unwrap_or("MuJoCo Model").to_owned();
    reader.parts.gravity = Some(gravity);
    reader.meshes(root);
    reader.world(root)?;
    reader.doubt_angles(root);
    reader.equalities(root)?;
    reader.read_actuators(root)?;
    reader.read_sensors(root)?;
    reader.read_keys(root)?;
    let equipment = reader.equipment();
    let mut robot = assemble(document, reader.parts, options)?;
    equipment.add_to(&mut robot);
    Ok(robot)
}

/// Ways in which a tendon exerts forces: its attribute, and what that means.
const TENDON_FORCES: [(&str, &str); 4] =
    [("stiffness", "spring"), ("damping", "damper"), ("frictionloss", "friction"), ("range", "limit")];

/// Reports the tendons that exert forces: they have a spring, a damper, friction or a limit, of their own or by a
/// default of the file.
///
/// # Errors
/// Where one of these is not a number.
fn leave_out_tendons(root: Element, warnings: &mut Warnings) -> Result<(), FileError> {
    let is_unlimited = |at: &Element| at.attribute("limited").is_some_and(|word| word.trim() == "false");
    let exerts = |at: &Element, what: &str| {
        Ok::<_, FileError>(match what {
            // A range limits unless the file says that it does not; springs may be given by two numbers.
            "range" => at.attribute("range").is_some() && !is_unlimited(at),
            _ => at.list(what)?.is_some_and(|numbers| numbers.iter().any(|&number| number != 0.0)),
        })
    };
    let tendons = root.all("tendon").flat_map(Element::children);
    let tendons: Vec<Element> = tendons.filter(|at| matches!(at.tag(), "fixed" | "spatial")).collect();
    if tendons.is_empty() {
        return Ok(());
    }
    let mut by_default = [false; TENDON_FORCES.len()];
    let mut defaults: Vec<Element> = root.all("default").collect();
    while let Some(default) = defaults.pop() {
        for tendon in default.all("tendon") {
            for (found, (what, _)) in by_default.iter_mut().zip(TENDON_FORCES) {
                *found |= exerts(&tendon, what)?;
            }
        }
        defaults.extend(default.all("default"));
    }
    for tendon in tendons {
        for ((what, means), by_default) in TENDON_FORCES.into_iter().zip(by_default) {
            let found = exerts(&tendon, what)? || by_default;
            if found && !(what == "range" && is_unlimited(&tendon)) {
                warnings.leave_out_force(&format!("tendon {what}"), tendon, || {
                    let name = tendon.attribute("name").map_or_else(String::new, |name| format!(" {}", shown(name)));
                    format!("tendon{name} is left out, with its {means} (`{what}`)")
                });
            }
        }
    }
    Ok(())
}

/// The names of bodies and joints, to avoid conflicts with generated names.
fn names<'a>(root: Element<'a>) -> HashSet<&'a str> {
    let mut names = HashSet::new();
    let mut open = vec![root];
    while let Some(element) = open.pop() {
        if matches!(element.tag(), "body" | "joint") {
            names.extend(element.attribute("name"));
        }
        open.extend(element.children());
    }
    names
}
