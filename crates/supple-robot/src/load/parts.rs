//! A robot in parts, as a file names them.

use super::warnings::Warnings;
use super::xml::Element;
use crate::{Inertia, Joint, JointKind, Mesh, Pose, Primitive};

/// A robot in parts, as a file names them.
pub(super) struct Parts<'a> {
    /// Its name.
    pub(super) name: String,
    /// Its links, in the order of the file.
    pub(super) links: Vec<LinkPart<'a>>,
    /// Its joints, in the order of the file.
    pub(super) joints: Vec<JointPart<'a>>,
    /// Its named frames besides those of the links.
    pub(super) frames: Vec<FramePart<'a>>,
    /// Gravity specified by the file, m/s^2.
    pub(super) gravity: Option<[f64; 3]>,
    /// Warnings so far about unsupported parts.
    pub(super) warnings: Warnings,
}

/// A link, with the element that errors about it refer to.
pub(super) struct LinkPart<'a> {
    /// Its element.
    pub(super) at: Element<'a>,
    /// Its name.
    pub(super) name: String,
    /// Its inertia, and the element that gives it.
    pub(super) inertia: Option<(Inertia, Element<'a>)>,
    /// Its visual meshes.
    pub(super) meshes: Vec<Mesh>,
    /// Its other visual shapes.
    pub(super) primitives: Vec<Primitive>,
}

impl<'a> LinkPart<'a> {
    /// A link without mass that cannot be seen.
    pub(super) fn empty(at: Element<'a>, name: String) -> Self {
        Self { at, name, inertia: None, meshes: Vec::new(), primitives: Vec::new() }
    }
}

/// A reference by name, with its element.
#[derive(Clone)]
pub(super) struct Reference<'a> {
    /// Where it stands.
    pub(super) at: Element<'a>,
    /// The name.
    pub(super) name: String,
}

/// A joint between named links.
pub(super) struct JointPart<'a> {
    /// Where it stands.
    pub(super) at: Element<'a>,
    pub(super) parent: Reference<'a>,
    pub(super) child: Reference<'a>,
    pub(super) mimic: Option<MimicPart<'a>>,
    /// Everything else; the axis may have any non-zero length.
    pub(super) own: Joint,
}

/// `position = ratio * position of the named joint + offset`
#[derive(Clone)]
pub(super) struct MimicPart<'a> {
    /// The joint that is followed.
    pub(super) joint: Reference<'a>,
    /// Ratio.
    pub(super) ratio: f64,
    /// Offset, rad or m.
    pub(super) offset: f64,
}

/// A named frame on a named link.
pub(super) struct FramePart<'a> {
    /// Its name.
    pub(super) name: String,
    /// Its link.
    pub(super) link: Reference<'a>,
    /// Where it is in the link.
    pub(super) pose: Pose,
}

impl<'a> JointPart<'a> {
    /// A [free](Joint::free) joint.
    pub(super) fn new(
        at: Element<'a>,
        name: &str,
        kind: JointKind,
        parent: Reference<'a>,
        child: Reference<'a>,
    ) -> Self {
        let own = Joint { line: at.line(), ..Joint::free(name.to_owned(), kind, 0) };
        Self { at, parent, child, mimic: None, own }
    }
}

/// A joint's links, by index in the file.
#[derive(Clone, Copy)]
pub(super) struct Ends {
    pub(super) parent: usize,
    pub(super) child: usize,
}
