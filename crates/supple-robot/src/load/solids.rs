//! Visual shapes that need no mesh.

use supple_text::FileError;

use super::warnings::Warnings;
use super::xml::Element;
use crate::Solid;

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
