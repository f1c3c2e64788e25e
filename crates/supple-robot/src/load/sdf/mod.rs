//! SDF, the format of Gazebo: a `model` of `link`, `joint` and `frame` elements, posed as they are at joint positions 0.
//!
//! Source: the specification at <http://sdformat.org/spec>, versions 1.6 to 1.12.

mod frames;
mod joint;
mod link;
mod values;

use std::path::Path;

use supple_text::FileError;

use self::frames::{Frames, MODEL, WORLD};
use self::values::{Version, flag, pass_over, pose};
use super::assemble::assemble;
use super::options::LoadOptions;
use super::parts::{FramePart, JointPart, LinkPart, Parts, Reference};
use super::warnings::Warnings;
use super::words::{listed, shown};
use super::xml::{Document, Element};
use crate::{JointKind, Pose, Robot};

/// The name of the link that stands for the world if the robot has a link named `world`.
const OUTER_WORLD: &str = "__world__";
/// Elements of `world` that are read, or that must not be ignored.
const WORLD_READ: [&str; 5] = ["model", "include", "joint", "gravity", "frame"];
/// Elements of `world` that are known and not modelled.
const WORLD_IGNORED: [&str; 19] = [
    "physics",
    "scene",
    "light",
    "plugin",
    "gui",
    "atmosphere",
    "magnetic_field",
    "wind",
    "spherical_coordinates",
    "state",
    "actor",
    "population",
    "road",
    "audio",
    "sensor",
    "particle_emitter",
    "projector",
    "joint_state",
    "grid",
];
/// Elements of `model` that are read, or that must not be ignored.
const MODEL_READ: [&str; 7] = ["link", "joint", "frame", "pose", "static", "model", "include"];
/// Elements of `model` that are known and not modelled.
const MODEL_IGNORED: [&str; 7] =
    ["self_collide", "allow_auto_disable", "enable_wind", "plugin", "gripper", "sensor", "light"];

/// State for reading the parts of a file.
struct Reader<'o> {
    version: Version,
    options: &'o LoadOptions,
    /// Where the file is.
    folder: &'o Path,
    warnings: Warnings,
}

/// Reads an SDF file with one model, which may be in a world. Meshes are looked for in `folder`.
///
/// A model that no joint attaches to the world is treated as fixed to it, with a warning. The root of the robot is then
/// the model's root link if that is at the origin of the world; otherwise it is a link `world`, from which a joint
/// `world/LINK` leads to each root link.
///
/// # Errors
/// Where anything in it is wrong or cannot be modelled: several models, models in models, files that are included.
pub(super) fn read(document: &Document, options: &LoadOptions, folder: &Path) -> Result<Robot, FileError> {
    let root = document.root();
    let mut warnings = Warnings::default();
    let version = Version::read(root, &mut warnings)?;
    let mut reader = Reader { version, options, folder, warnings };
    let (model, gravity) = reader.find_model(root)?;
    for element in model.children() {
        match element.tag() {
            "model" => return Err(element.error("models in models are not supported; write one model without them")),
            "include" => return Err(included(element)),
            _ => pass_over(element, &MODEL_READ, &MODEL_IGNORED, &mut reader.warnings),
        }
    }
    let mut parts = reader.parts(model)?;
    parts.gravity = gravity;
    parts.warnings = reader.warnings;
    assemble(document, parts, options)
}

/// Checks the place of a named frame.
///
/// # Errors
/// Where it is further away than any part of a robot.
pub(super) fn check_position(at: Element, pose: &Pose) -> Result<(), FileError> {
    const FURTHEST: f64 = 1e30;
    if pose.position.iter().all(|entry| entry.abs() < FURTHEST) {
        return Ok(());
    }
    Err(at.error(format!("positions must be below {FURTHEST:e} m")))
}

/// The error about an `include`.
fn included(at: Element) -> FileError {
    at.error("`include` is not supported: only one file is read")
        .with_help("replace it by the included model, or remove it if the robot does not need it")
}

impl Reader<'_> {
    /// The one model of the file, and gravity if the model is in a world that gives it.
    ///
    /// # Errors
    /// If there is not exactly one model.
    fn find_model<'a>(&mut self, root: Element<'a>) -> Result<(Element<'a>, Option<[f64; 3]>), FileError> {
        let mut models: Vec<_> = root.all("model").collect();
        let world = root.child("world")?;
        for element in root.children() {
            match element.tag() {
                "include" => return Err(included(element)),
                _ => pass_over(element, &["model", "world"], &["actor", "light"], &mut self.warnings),
            }
        }
        let mut gravity = None;
        if let Some(world) = world {
            for element in world.children() {
                match element.tag() {
                    "include" => return Err(included(element)),
                    "joint" => return Err(element.error("joints outside a model are not supported")),
                    "frame" => self.warnings.ignore(element),
                    _ => pass_over(element, &WORLD_READ, &WORLD_IGNORED, &mut self.warnings),
                }
            }
            models.extend(world.all("model"));
            gravity = world.child("gravity")?.map(Element::content_numbers).transpose()?;
        }
        match models[..] {
            [model] => Ok((model, gravity)),
            [] => Err(root.error("there is no `model` in it")),
            [_, second, ..] => {
                let names: Vec<_> = models.iter().map(|model| model.attribute("name").unwrap_or("")).collect();
                let message = format!("there are {} models: {}", names.len(), listed(&names));
                Err(second.error(message).with_help("keep the one that is the robot"))
            }
        }
    }

    /// The parts of a model.
    fn parts<'a>(&mut self, model: Element<'a>) -> Result<Parts<'a>, FileError> {
        let frames = Frames::read(model, self.version, &mut self.warnings)?;
        let placed = self.place(model, &frames)?;
        let mut links = Vec::new();
        for at in model.all("link") {
            links.push(self.link(at)?);
        }
        let mut joints = Vec::new();
        for node in frames.joints() {
            joints.push(self.joint(node, &frames, &placed)?);
        }
        let mut named = Vec::new();
        for (name, node) in frames.named() {
            let (at, link) = (frames.element(node), frames.link_of(node));
            let pose = frames.between(link, node);
            check_position(at, &pose)?;
            let link = Reference { at, name: frames.name(link).to_owned() };
            named.push(FramePart { name: name.to_owned(), link, pose });
        }
        let mut parts = Parts {
            name: model.required("name")?.to_owned(),
            links,
            joints,
            frames: named,
            gravity: None,
            warnings: Warnings::default(),
        };
        self.attach(model, &frames, &placed, &mut parts)?;
        Ok(parts)
    }

    /// The model's frame in the world.
    fn place(&mut self, model: Element, frames: &Frames) -> Result<Pose, FileError> {
        let (pose, relative_to) = pose(model, self.version, &mut self.warnings)?;
        if let Some(reference) = relative_to.filter(|reference| reference.name != WORLD) {
            let message =
                format!("the pose of a model must be relative to the world, not to {}", shown(&reference.name));
            return Err(reference.at.error_naming(&reference.name, message));
        }
        match model.attribute("placement_frame").filter(|name| !name.is_empty()) {
            Some(name) => {
                let placed = frames.find(&Reference { at: model, name: name.to_owned() })?;
                Ok(pose.compose(&frames.between(MODEL, placed).inverse()))
            }
            None => Ok(pose),
        }
    }

    /// Fixes to the world whatever no joint carries.
    ///
    /// # Errors
    /// Where `static` is neither true nor false.
    fn attach<'a>(
        &mut self,
        model: Element<'a>,
        frames: &Frames<'a>,
        placed: &Pose,
        parts: &mut Parts<'a>,
    ) -> Result<(), FileError> {
        let is_static = model.child("static")?.map(flag).transpose()?.unwrap_or(false);
        let carried: std::collections::HashSet<_> =
            parts.joints.iter().map(|joint| joint.child.name.as_str()).collect();
        let roots: Vec<_> = frames.links().filter(|&link| !carried.contains(frames.name(link))).collect();
        if !is_static {
            for &root in &roots {
                self.warnings.note("not attached", frames.element(root), || {
                    "no joint attaches it to anything; it is treated as fixed to the world".to_owned()
                });
            }
        }
        if is_static && !parts.joints.is_empty() {
            self.warnings.note("static", model, || "static is ignored: its joints still move".to_owned());
        }
        let in_world = |link: usize| placed.compose(&frames.between(MODEL, link));
        let world = if frames.has_world() { OUTER_WORLD } else { WORLD };
        let needs_world = parts.joints.iter().any(|joint| joint.parent.name == world);
        if !needs_world && roots.len() == 1 && roots.iter().all(|&root| in_world(root) == Pose::IDENTITY) {
            return Ok(());
        }
        // Without a root there is a loop, which is reported later.
        if !needs_world && roots.is_empty() {
            return Ok(());
        }
        for &root in &roots {
            let (at, name) = (frames.element(root), frames.name(root));
            let reference = |name: &str| Reference { at, name: name.to_owned() };
            let named = format!("{world}/{name}");
            let mut joint = JointPart::new(at, &named, JointKind::Fixed, reference(world), reference(name));
            joint.own.origin = in_world(root);
            parts.joints.push(joint);
        }
        parts.links.insert(0, LinkPart::empty(model, world.to_owned()));
        Ok(())
    }
}
