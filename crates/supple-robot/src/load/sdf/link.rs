//! A `link`: its inertia and its visual meshes.

use supple_text::FileError;

use super::super::meshes::mesh_path;
use super::super::moments::turned;
use super::super::parts::LinkPart;
use super::super::solids::{drawn, solid};
use super::super::words::shown;
use super::super::xml::Element;
use super::Reader;
use super::values::{flag, number, pass_over, pose};
use crate::{Inertia, Mesh, Pose, Primitive};

/// Elements of `link` that are read, or do not affect the dynamics.
const LINK: [&str; 6] = ["pose", "inertial", "visual", "collision", "gravity", "kinematic"];
/// Elements of `link` that are known but not modelled.
const LINK_IGNORED: [&str; 13] = [
    "sensor",
    "plugin",
    "light",
    "projector",
    "audio_sink",
    "audio_source",
    "battery",
    "particle_emitter",
    "velocity_decay",
    "self_collide",
    "enable_wind",
    "must_be_base_link",
    "frame",
];
/// Shapes of `geometry` that are drawn and need no mesh.
const SOLIDS: [&str; 5] = ["box", "sphere", "cylinder", "capsule", "ellipsoid"];
/// Elements of `inertial` that are read.
const INERTIAL: [&str; 3] = ["pose", "mass", "inertia"];
/// Elements of `inertial` that are known and not modelled.
const INERTIAL_IGNORED: [&str; 4] = ["density", "fluid_added_mass", "auto_inertia_params", "frame"];

impl Reader<'_> {
    /// Reads a link. Its pose in the model is left to the joints.
    ///
    /// # Errors
    /// Where anything in it is wrong.
    pub(super) fn link<'a>(&mut self, at: Element<'a>) -> Result<LinkPart<'a>, FileError> {
        for element in at.children() {
            pass_over(element, &LINK, &LINK_IGNORED, &mut self.warnings);
        }
        if at.child("gravity")?.map(flag).transpose()? == Some(false) {
            self.warnings.note("gravity", at, || "gravity is applied although the file disables it".to_owned());
        }
        if at.child("kinematic")?.map(flag).transpose()? == Some(true) {
            self.warnings.note("kinematic", at, || "treated as dynamic although the file says kinematic".to_owned());
        }
        let inertia = match at.child("inertial")? {
            Some(at) => (self.inertial(at)?, at),
            None => {
                self.warnings.note("no inertial", at, || {
                    "it has no `inertial`; the SDF default is used: 1 kg and 1 kg m^2 about each axis".to_owned()
                });
                let moment = Pose::IDENTITY.rotation;
                (Inertia { mass: 1.0, center: [0.0; 3], moment }, at)
            }
        };
        let name = at.required("name")?.to_owned();
        let mut link = LinkPart { inertia: Some(inertia), ..LinkPart::empty(at, name) };
        for visual in at.all("visual") {
            self.visual(visual, &mut link)?;
        }
        Ok(link)
    }

    /// Reads an `inertial`: moments are given about the centre of mass, in axes rotated by `pose`.
    ///
    /// ```text
    /// moment in the link's axes = R I R'
    /// ```
    fn inertial(&mut self, at: Element) -> Result<Inertia, FileError> {
        for element in at.children() {
            pass_over(element, &INERTIAL, &INERTIAL_IGNORED, &mut self.warnings);
        }
        if at.choice("auto", &[("true", true), ("false", false), ("1", true), ("0", false)])? == Some(true) {
            let message = "inertia is not computed from collision shapes";
            return Err(at.error_at("auto", message).with_help("write out `mass` and `inertia`"));
        }
        let (pose, relative_to) = pose(at, self.version, &mut self.warnings)?;
        let link = at.parent().and_then(|link| link.attribute("name"));
        if let Some(reference) = relative_to.filter(|reference| Some(reference.name.as_str()) != link) {
            let name = &reference.name;
            let message = format!("a centre of mass must be given in its own link, not in {}", shown(name));
            return Err(reference.at.error_naming(name, message));
        }
        let mass = number(at, "mass")?;
        let inertia = at.child("inertia")?;
        for (missing, what, unit) in
            [(mass.is_none(), "mass", "1 kg"), (inertia.is_none(), "inertia", "1 kg m^2 about each axis")]
        {
            if missing {
                self.warnings.note(what, at, || format!("it has no `{what}`; the SDF default is used: {unit}"));
            }
        }
        let mut moment = Pose::IDENTITY.rotation;
        if let Some(inertia) = inertia {
            let entry = |name: &str, default: f64| Ok(number(inertia, name)?.unwrap_or(default));
            let (xx, yy, zz) = (entry("ixx", 1.0)?, entry("iyy", 1.0)?, entry("izz", 1.0)?);
            let (xy, xz, yz) = (entry("ixy", 0.0)?, entry("ixz", 0.0)?, entry("iyz", 0.0)?);
            moment = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]];
        }
        Ok(Inertia { mass: mass.unwrap_or(1.0), center: pose.position, moment: turned(pose.rotation, moment) })
    }

    /// Adds the shape of a `visual`.
    fn visual(&mut self, at: Element, link: &mut LinkPart) -> Result<(), FileError> {
        let Some(geometry) = at.child("geometry")? else { return Ok(()) };
        let mesh = geometry.child("mesh")?;
        let shape = geometry.children().find(|shape| SOLIDS.contains(&shape.tag()));
        if mesh.is_none() && shape.is_none() {
            if let Some(cone) = geometry.child("cone")? {
                self.warnings.note("cone", cone, || "it is not drawn: cones are not supported".to_owned());
            }
            return Ok(());
        }
        let (pose, relative_to) = pose(at, self.version, &mut self.warnings)?;
        if relative_to.is_some_and(|reference| reference.name != link.name) {
            self.warnings.note("visual", at, || "it is not drawn: its pose is not relative to its link".to_owned());
            return Ok(());
        }
        if let Some(mesh) = mesh {
            link.meshes.extend(self.mesh(mesh, pose)?);
        } else if let Some(shape) = shape {
            let length = |tag: &str| shape.required_child(tag)?.content_number();
            let lengths = |tag: &str| shape.required_child(tag)?.content_numbers();
            let solid = drawn(shape, solid(shape, length, lengths), &mut self.warnings);
            link.primitives.extend(solid.map(|solid| Primitive { solid, pose }));
        }
        Ok(())
    }

    /// A mesh at a pose; `None` and a warning if it cannot be used.
    fn mesh(&mut self, mesh: Element, pose: Pose) -> Result<Option<Mesh>, FileError> {
        let scale = mesh.child("scale")?.map(Element::content_numbers).transpose()?.unwrap_or([1.0; 3]);
        let uri = mesh.required_child("uri")?;
        let path = mesh_path(uri, &uri.content()?, self.options, self.folder, &mut self.warnings);
        Ok(path.map(|path| Mesh { path, pose, scale }))
    }
}
