//! URDF, the format of ROS: `robot` with `link` and `joint` elements side by side.
//!
//! Source: the specification at <https://wiki.ros.org/urdf/XML>.

use std::path::Path;

use supple_text::FileError;

use super::LoadOptions;
use super::assemble::{JointPart, LinkPart, MimicPart, Parts, Reference, assemble};
use super::joint_kind::joint_kind;
use super::meshes::mesh_path;
use super::moments::turned;
use super::warnings::Warnings;
use super::words::{RUN_XACRO, XACRO};
use super::xml::{Document, Element};
use crate::{Inertia, JointKind, Limits, Mesh, Pose, Robot};

/// Elements of `robot` that are read.
const ROBOT: [&str; 2] = ["link", "joint"];
/// Elements of `robot` that are known and not modelled.
const ROBOT_IGNORED: [&str; 5] = ["transmission", "gazebo", "material", "sensor", "ros2_control"];
/// Elements of `link` that are read, or have no meaning for the dynamics.
const LINK: [&str; 3] = ["inertial", "visual", "collision"];
/// Elements of `link` that are known and not modelled.
const LINK_IGNORED: [&str; 4] = ["gazebo", "sensor", "material", "contact"];
/// Elements of `joint` that are read.
const JOINT: [&str; 7] = ["parent", "child", "origin", "axis", "limit", "dynamics", "mimic"];
/// Elements of `joint` that are known and not modelled.
const JOINT_IGNORED: [&str; 4] = ["safety_controller", "calibration", "gazebo", "hardwareInterface"];

/// Reads a URDF file. Meshes are looked for in `folder`.
///
/// # Errors
/// Where anything in it is wrong or cannot be modelled.
pub(super) fn read(document: &Document, options: &LoadOptions, folder: &Path) -> Result<Robot, FileError> {
    refuse_macros(document)?;
    let root = document.root();
    if root.children().next().is_none() && document.text().contains("xacro") {
        let error = root.error("a robot has at least one link, and this one has none");
        return Err(
            error.with_help("xacro made it of a file that only declares macros: expand the file that uses them")
        );
    }
    let name = root.required("name")?.to_owned();
    let mut parts = Parts {
        name,
        links: Vec::new(),
        joints: Vec::new(),
        frames: Vec::new(),
        gravity: None,
        warnings: Warnings::default(),
    };
    for element in root.children() {
        match element.tag() {
            "link" => parts.links.push(link(element, options, folder, &mut parts.warnings)?),
            "joint" => parts.joints.push(joint(element, &mut parts.warnings)?),
            _ => pass_over(element, &ROBOT, &ROBOT_IGNORED, &mut parts.warnings),
        }
    }
    assemble(document, parts, options)
}

/// # Errors
/// Where the file holds elements or values that xacro is to expand first.
fn refuse_macros(document: &Document) -> Result<(), FileError> {
    let macros = |value: &str| value.contains("${") || value.contains("$(");
    if !document.text().contains("<xacro:") && !macros(document.text()) {
        return Ok(());
    }
    for element in document.root().descendants() {
        if element.tag().starts_with("xacro:") {
            return Err(element.error(XACRO).with_help(RUN_XACRO));
        }
        if let Some(name) = element.attribute_with(macros) {
            return Err(element.error_at(name, XACRO).with_help(RUN_XACRO));
        }
    }
    Ok(())
}

/// Warns of an element that is not read.
fn pass_over(element: Element, read: &[&str], ignored: &[&str], warnings: &mut Warnings) {
    let tag = element.tag();
    if ignored.contains(&tag) {
        warnings.ignore(element);
    } else if !read.contains(&tag) {
        warnings.unknown(element, read);
    }
}

/// A `link`.
fn link<'a>(
    at: Element<'a>,
    options: &LoadOptions,
    folder: &Path,
    warnings: &mut Warnings,
) -> Result<LinkPart<'a>, FileError> {
    let name = at.required("name")?.to_owned();
    for element in at.children() {
        pass_over(element, &LINK, &LINK_IGNORED, warnings);
    }
    let inertia = at.child("inertial")?.map(|at| Ok((inertial(at)?, at))).transpose()?;
    let mut meshes = Vec::new();
    for visual in at.all("visual") {
        meshes.extend(mesh(visual, options, folder, warnings)?);
    }
    Ok(LinkPart { at, name, inertia, meshes })
}

/// An `inertial`: the moments are given about the centre of mass, in axes that `origin` turns.
///
/// ```text
/// moment in the link's axes = R I R'
/// ```
fn inertial(at: Element) -> Result<Inertia, FileError> {
    let Pose { rotation: r, position } = origin(at)?;
    let mass = at.required_child("mass")?.required_number("value")?;
    let element = at.required_child("inertia")?;
    let [xx, xy, xz] = ["ixx", "ixy", "ixz"].map(|name| element.required_number(name));
    let [yy, yz, zz] = ["iyy", "iyz", "izz"].map(|name| element.required_number(name));
    let (xx, xy, xz, yy, yz, zz) = (xx?, xy?, xz?, yy?, yz?, zz?);
    let moment = turned(r, [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]);
    Ok(Inertia { mass, center: position, moment })
}

/// The `origin` of an element: `xyz` in metres and `rpy` in radians, both 0 where nothing is said.
fn origin(at: Element) -> Result<Pose, FileError> {
    let Some(origin) = at.child("origin")? else { return Ok(Pose::IDENTITY) };
    Ok(Pose::from_rpy(origin.numbers("xyz")?.unwrap_or([0.0; 3]), origin.numbers("rpy")?.unwrap_or([0.0; 3])))
}

/// The mesh of a `visual`, where it has one.
fn mesh(at: Element, options: &LoadOptions, folder: &Path, warnings: &mut Warnings) -> Result<Option<Mesh>, FileError> {
    let pose = origin(at)?;
    let Some(geometry) = at.child("geometry")? else { return Ok(None) };
    let Some(mesh) = geometry.child("mesh")? else { return Ok(None) };
    let scale = mesh.numbers("scale")?.unwrap_or([1.0; 3]);
    let path = mesh_path(mesh, mesh.required("filename")?, options, folder, warnings);
    Ok(path.map(|path| Mesh { path, pose, scale }))
}

/// A `joint`.
fn joint<'a>(at: Element<'a>, warnings: &mut Warnings) -> Result<JointPart<'a>, FileError> {
    let name = at.required("name")?.to_owned();
    let kind = joint_kind(at, &["floating", "planar"])?;
    for element in at.children() {
        pass_over(element, &JOINT, &JOINT_IGNORED, warnings);
    }
    let end = |tag| {
        let at = at.required_child(tag)?;
        Ok(Reference { at, name: at.required("link")?.to_owned() })
    };
    let mut joint = JointPart::new(at, &name, kind, end("parent")?, end("child")?);
    joint.origin = origin(at)?;
    if let Some(axis) = at.child("axis")? {
        joint.axis = axis.required_numbers("xyz")?;
    }
    if let Some(dynamics) = at.child("dynamics")? {
        joint.damping = dynamics.number("damping")?.unwrap_or(0.0);
        joint.friction = dynamics.number("friction")?.unwrap_or(0.0);
    }
    joint.limits = limits(at, kind, warnings)?;
    if let Some(mimic) = at.child("mimic")? {
        joint.mimic = Some(MimicPart {
            joint: Reference { at: mimic, name: mimic.required("joint")?.to_owned() },
            ratio: mimic.number("multiplier")?.unwrap_or(1.0),
            offset: mimic.number("offset")?.unwrap_or(0.0),
        });
    }
    Ok(joint)
}

/// The `limit` of a joint. Positions that are not given are 0, as URDF has it.
///
/// # Errors
/// Where a joint has none that must have one.
fn limits(at: Element, kind: JointKind, warnings: &mut Warnings) -> Result<Limits, FileError> {
    let Some(limit) = at.child("limit")? else {
        return match kind {
            JointKind::Fixed | JointKind::Continuous => Ok(Limits::default()),
            JointKind::Revolute => Err(at
                .error("a revolute joint must have a `limit` with `lower`, `upper`, `effort` and `velocity`")
                .with_help("a joint that turns without limits is `continuous`")),
            JointKind::Prismatic => {
                Err(at.error("a prismatic joint must have a `limit` with `lower`, `upper`, `effort` and `velocity`"))
            }
        };
    };
    let given = |name| limit.attribute(name).is_some();
    if matches!(kind, JointKind::Revolute | JointKind::Prismatic) && !given("lower") && !given("upper") {
        warnings.note("no range", limit, || "`lower` and `upper` are missing: the joint can only be at 0".to_owned());
    }
    let mut most = |name: &str| -> Result<f64, FileError> {
        let found = limit.number(name)?;
        if found.is_none() && kind != JointKind::Fixed {
            warnings.note(name, limit, || format!("`{name}` is missing, and is taken as unlimited"));
        }
        Ok(found.unwrap_or(f64::INFINITY))
    };
    Ok(Limits {
        velocity: most("velocity")?,
        effort: most("effort")?,
        lower: limit.number("lower")?.unwrap_or(0.0),
        upper: limit.number("upper")?.unwrap_or(0.0),
    })
}
