//! MJCF, the format of MuJoCo: bodies in bodies, with joints, inertias and sites in them, and classes of defaults.
//!
//! Source: the reference at <https://mujoco.readthedocs.io/en/stable/XMLreference.html>, versions up to 4.0.

mod body;
mod defaults;
mod equality;
mod geom;
mod inertia;
mod joint;
mod known;
mod meshes;
mod orientation;
mod settings;

use std::collections::HashSet;
use std::path::Path;

use supple_files::FileError;

use self::body::Reader;
use self::defaults::Classes;
use self::settings::{Settings, gravity};
use super::LoadOptions;
use super::assemble::assemble;
use super::warnings::Warnings;
use super::xml::{Document, Element};
use crate::Robot;

/// The name of the root link, which is the world.
const WORLD: &str = "world";
/// Sections that are read.
const SECTIONS: [&str; 6] = ["compiler", "option", "default", "asset", "worldbody", "equality"];
/// Sections that have no meaning for the dynamics.
const SECTIONS_PASSED: [&str; 4] = ["size", "statistic", "visual", "custom"];
/// Sections that are known and not modelled.
const SECTIONS_IGNORED: [&str; 7] = ["contact", "tendon", "actuator", "sensor", "keyframe", "extension", "deformable"];

/// Reads an MJCF file. Meshes are looked for in `folder`.
///
/// The root link is `world`. A body without joints hangs on a fixed joint `BODY/fixed`. A body with several joints
/// hangs on the last of them; each of the others carries a link `BODY/JOINT` without inertia, which lies where the body
/// is when the joints after it are at their references. Bodies and joints without a name are called `body3`, `joint2`,
/// by the number that MuJoCo gives them: bodies from 1, joints from 0.
///
/// # Errors
/// Where anything in it is wrong or cannot be modelled: free and ball joints, closed loops, files that are included,
/// and what multiplies bodies.
pub(super) fn read(document: &Document, options: &LoadOptions, folder: &Path) -> Result<Robot, FileError> {
    let root = document.root();
    let names = names(root)?;
    let mut warnings = Warnings::default();
    for section in root.children() {
        let tag = section.tag();
        if SECTIONS_IGNORED.contains(&tag) {
            warnings.ignore(section);
        } else if !SECTIONS.contains(&tag) && !SECTIONS_PASSED.contains(&tag) {
            warnings.unknown(section, &[&SECTIONS[..], &SECTIONS_IGNORED].concat());
        }
    }
    let settings = Settings::read(root)?;
    let gravity = gravity(root, &mut warnings)?;
    let classes = Classes::read(root, &mut warnings)?;
    let mut reader = Reader::new(&settings, &classes, names, options, folder, warnings);
    reader.parts.name = root.attribute("model").unwrap_or("MuJoCo Model").to_owned();
    reader.parts.gravity = Some(gravity);
    reader.meshes(root)?;
    reader.world(root)?;
    reader.equalities(root)?;
    assemble(document, reader.parts, options)
}

/// The names of bodies and joints, so that others get names unlike them.
///
/// # Errors
/// Where another file is included: this one is not the whole robot.
fn names<'a>(root: Element<'a>) -> Result<HashSet<&'a str>, FileError> {
    let mut names = HashSet::new();
    let mut open = vec![root];
    let mut included: Option<Element> = None;
    while let Some(element) = open.pop() {
        match element.tag() {
            "include" if included.is_none_or(|first| element.line() < first.line()) => included = Some(element),
            "body" | "joint" => names.extend(element.attribute("name")),
            _ => {}
        }
        open.extend(element.children());
    }
    match included {
        Some(element) => {
            let message = "only this one file is read, and it includes another one";
            let help = "write the whole model to one file, for example with MuJoCo's `mj_saveLastXML`";
            Err(element.error_at("file", message).with_help(help))
        }
        None => Ok(names),
    }
}
