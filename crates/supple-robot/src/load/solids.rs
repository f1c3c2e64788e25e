//! Visual shapes that need no mesh.

use supple_text::FileError;

use super::warnings::Warnings;
use super::xml::Element;
use crate::Solid;

/// The solid at an element of a `geometry`, whose lengths a format gives by these names; `None` for any other shape.
pub(super) fn solid(
    at: Element,
    length: impl Fn(&str) -> Result<f64, FileError>,
    lengths: impl Fn(&str) -> Result<[f64; 3], FileError>,
) -> Result<Option<Solid>, FileError> {
    Ok(Some(match at.tag() {
        "box" => Solid::Box { size: lengths("size")? },
        "sphere" => Solid::Sphere { radius: length("radius")? },
        "cylinder" => Solid::Cylinder { radius: length("radius")?, length: length("length")? },
        "capsule" => Solid::Capsule { radius: length("radius")?, length: length("length")? },
        "ellipsoid" => Solid::Ellipsoid { radii: lengths("radii")? },
        _ => return Ok(None),
    }))
}

/// The solid that was read at an element; `None` and a warning if it cannot be drawn, as a robot loads without.
pub(super) fn drawn(at: Element, read: Result<Option<Solid>, FileError>, warnings: &mut Warnings) -> Option<Solid> {
    let why = match read {
        Ok(None) => return None,
        Ok(Some(solid)) if solid.is_sound() => return Some(solid),
        Ok(Some(_)) => "its sizes must be positive".to_owned(),
        Err(error) => error.message,
    };
    warnings.note("solid", at, || format!("it is not drawn: {why}"));
    None
}
