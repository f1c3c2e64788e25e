//! Kinds of joints by their names in URDF and SDF.

use supple_text::FileError;

use super::words::{listed, near, shown};
use super::xml::Element;
use crate::JointKind;

/// The `type` of a joint. `known` lists types that the format defines but that are not supported.
///
/// # Errors
/// If it is missing or cannot be modelled.
pub(super) fn joint_kind(at: Element, known: &[&str]) -> Result<JointKind, FileError> {
    const VALID: [&str; 4] = ["fixed", "revolute", "continuous", "prismatic"];
    Ok(match at.required("type")? {
        "fixed" => JointKind::Fixed,
        "revolute" => JointKind::Revolute,
        "continuous" => JointKind::Continuous,
        "prismatic" => JointKind::Prismatic,
        found => {
            let known = known.contains(&found);
            let what = if known { "is not supported" } else { "is not a type of joint" };
            let error = at.error_at("type", format!("type {} {what}; valid: {}", shown(found), listed(&VALID)));
            return Err(match near(found, &VALID) {
                Some(help) if !known => error.with_help(help),
                _ => error,
            });
        }
    })
}
