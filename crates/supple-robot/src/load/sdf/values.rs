//! Values as SDF writes them: versions, flags, numbers in elements, and poses.

use supple_text::FileError;

use super::super::degrees::{given, turns};
use super::super::parts::Reference;
use super::super::warnings::Warnings;
use super::super::words::shown;
use super::super::xml::Element;
use crate::Pose;

/// A version of the format: major and minor number.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Version(u32, u32);

impl Version {
    /// The first version in which axes are given in the joint's frame.
    pub(super) const AXIS_IN_JOINT: Self = Self(1, 5);
    /// The oldest version that is known.
    const OLDEST: Self = Self(1, 6);
    /// The first version in which poses are `relative_to` frames.
    pub(super) const RELATIVE: Self = Self(1, 7);
    /// The newest version that is known.
    const NEWEST: Self = Self(1, 12);

    /// The `version` of an `sdf` element. Warns of versions that are not known.
    ///
    /// # Errors
    /// Where it is missing, or not two numbers with a dot between.
    pub(super) fn read(at: Element, warnings: &mut Warnings) -> Result<Self, FileError> {
        let text = at.required("version")?.trim();
        let numbers = text.split_once('.').and_then(|(major, minor)| Some((major.parse().ok()?, minor.parse().ok()?)));
        let Some((major, minor)) = numbers else {
            return Err(at.error_at("version", format!("a version is like `1.7`, and this one is {}", shown(text))));
        };
        let version = Self(major, minor);
        if version < Self::OLDEST {
            warnings.note("version", at, || {
                format!("version {text} is older than 1.6: it is read as 1.6, with axes as in {text}")
            });
        }
        if version > Self::NEWEST {
            warnings
                .note("version", at, || format!("version {text} is newer than 1.12, and is read as if it were 1.12"));
        }
        Ok(version)
    }
}

/// Reports an element that is not read, unless its tag is in `read`.
pub(super) fn pass_over(element: Element, read: &[&str], ignored: &[&str], warnings: &mut Warnings) {
    let tag = element.tag();
    // Tags with a prefix belong to other programs.
    if ignored.contains(&tag) || tag.contains(':') {
        warnings.ignore(element);
    } else if !read.contains(&tag) {
        warnings.unknown(element, read);
    }
}

/// True or false in an element's text.
pub(super) fn flag(element: Element) -> Result<bool, FileError> {
    element.content_choice(&[
        ("true", true),
        ("false", false),
        ("1", true),
        ("0", false),
        ("True", true),
        ("False", false),
    ])
}

/// The number in the child `tag`, where there is one.
pub(super) fn number(at: Element, tag: &str) -> Result<Option<f64>, FileError> {
    at.child(tag)?.map(Element::content_number).transpose()
}

/// The `pose` of an element, and the name of the frame it is relative to; the origin if not given.
///
/// # Errors
/// Where it is no pose.
pub(super) fn pose<'a>(
    at: Element<'a>,
    version: Version,
    warnings: &mut Warnings,
) -> Result<(Pose, Option<Reference<'a>>), FileError> {
    let Some(at) = at.child("pose")? else { return Ok((Pose::IDENTITY, None)) };
    let mut relative_to = at.attribute("relative_to").filter(|name| !name.is_empty());
    if let Some(frame) = at.attribute("frame").filter(|name| !name.is_empty() && relative_to.is_none()) {
        if version < Version::RELATIVE {
            relative_to = Some(frame);
        } else {
            warnings.ignore_attribute(at, "frame");
        }
    }
    let relative_to = relative_to.map(|name| Reference { at, name: name.to_owned() });
    // An empty pose is the default one.
    let pose = if at.content().is_ok() { numbers(at, warnings)? } else { Pose::IDENTITY };
    Ok((pose, relative_to))
}

/// The numbers of a `pose`: `x y z roll pitch yaw`, or `x y z qx qy qz qw`.
fn numbers(at: Element, warnings: &mut Warnings) -> Result<Pose, FileError> {
    let quaternion = at.choice("rotation_format", &[("euler_rpy", false), ("quat_xyzw", true)])?.unwrap_or(false);
    let degrees = at.choice("degrees", &[("true", true), ("false", false), ("1", true), ("0", false)])?;
    if quaternion {
        if degrees == Some(true) {
            return Err(at.error_at("degrees", "`degrees` does not apply to a quaternion"));
        }
        let [x, y, z, qx, qy, qz, qw] = at.content_numbers()?;
        return Pose::from_quaternion([x, y, z], [qw, qx, qy, qz])
            .ok_or_else(|| at.error_in_content("the quaternion must be non-zero and finite when squared"));
    }
    let [x, y, z, roll, pitch, yaw] = at.content_numbers()?;
    let unit = if degrees == Some(true) { std::f64::consts::PI / 180.0 } else { 1.0 };
    if degrees != Some(true) && turns([roll, pitch, yaw]) {
        warnings.note("degrees of pose", at, || {
            let angles = given([roll, pitch, yaw]);
            format!("the angles {angles} are rad, but look like degrees; for those, set `degrees=\"true\"`")
        });
    }
    Ok(Pose::from_rpy([x, y, z], [roll, pitch, yaw].map(|angle| angle * unit)))
}
