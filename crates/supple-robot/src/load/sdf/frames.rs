//! Poses of the links, joints and frames of a model, each given relative to another, in any order.
//!
//! Source: <http://sdformat.org/tutorials?tut=pose_frame_semantics>.
//!
//! ```text
//! relative to, by default:              link -> model   frame -> what it is attached to   joint -> its child
//! attached to:                          joint -> its child   frame -> `attached_to`, or the model -> canonical link
//! ```

use std::collections::HashMap;

use supple_text::FileError;

use super::super::parts::Reference;
use super::super::warnings::Warnings;
use super::super::words::{listed, near, shown};
use super::super::xml::Element;
use super::values::{Version, pose};
use crate::Pose;

/// The name of the world as a joint's parent, and of the link that stands for it.
pub(super) const WORLD: &str = "world";

/// The node of the model's own frame.
pub(super) const MODEL: usize = 0;
/// Greatest number of steps between two nodes for which poses are composed one by one.
const NEAR: usize = 64;

/// What a node is.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    Model,
    Link,
    Joint,
    Frame,
}

/// A frame: of a link, of a joint, or one that is named.
struct Node<'a> {
    at: Element<'a>,
    kind: Kind,
    name: &'a str,
    /// Where it is in `base`.
    pose: Pose,
    /// The node that it is relative to.
    base: usize,
    /// The node that it moves with; itself for links.
    attached: usize,
}

/// The frames of a model. Nodes are the model, and then links, frames and joints in the order of the file.
pub(super) struct Frames<'a> {
    nodes: Vec<Node<'a>>,
    /// The node for each name; if several things share a name, a link, or else a frame.
    index: HashMap<&'a str, usize>,
    /// Number of steps from each node to the model.
    depths: Vec<usize>,
    /// Where each node is in the model.
    in_model: Vec<Pose>,
    /// The link that each node moves with.
    links: Vec<usize>,
}

impl<'a> Frames<'a> {
    /// The frames of a model.
    ///
    /// # Errors
    /// If one is relative or attached to something unknown or, through a chain, to itself, or a name is missing.
    pub(super) fn read(model: Element<'a>, version: Version, warnings: &mut Warnings) -> Result<Self, FileError> {
        let origin = |at, kind, name| Node { at, kind, name, pose: Pose::IDENTITY, base: MODEL, attached: MODEL };
        let mut nodes = vec![origin(model, Kind::Model, "__model__")];
        for (tag, kind) in [("link", Kind::Link), ("frame", Kind::Frame), ("joint", Kind::Joint)] {
            for at in model.all(tag) {
                nodes.push(origin(at, kind, at.required("name")?));
            }
        }
        let mut index = HashMap::new();
        for (i, node) in nodes.iter().enumerate() {
            if node.name == WORLD && node.kind == Kind::Link {
                warnings.note("world link", node.at, || {
                    "`world` is the name of the world frame; here a link of the robot has this name".to_owned()
                });
            } else if node.name == WORLD {
                return Err(node.at.error_at("name", "the name `world` is reserved for the world frame"));
            }
            if let Some(&first) = index.get(node.name) {
                let first: &Node = &nodes[first];
                let others = format!("a {} at line {} has this name, too", first.at.tag(), first.at.line());
                if first.kind == node.kind {
                    return Err(node.at.error_at("name", others + "; names must differ"));
                }
                warnings.note("shared name", node.at, || others + "; references to the name mean that one");
            } else {
                index.insert(node.name, i);
            }
        }
        let mut frames = Self { nodes, index, depths: Vec::new(), in_model: Vec::new(), links: Vec::new() };
        frames.connect(model, version, warnings)?;
        frames.depths = frames.place()?;
        frames.links = frames.carry()?;
        Ok(frames)
    }

    /// Whether a link is named `world`, so that references to `world` mean that link.
    pub(super) fn has_world(&self) -> bool {
        self.links().any(|link| self.name(link) == WORLD)
    }

    /// Reads what each node is relative and attached to.
    fn connect(&mut self, model: Element<'a>, version: Version, warnings: &mut Warnings) -> Result<(), FileError> {
        let canonical = match model.attribute("canonical_link").filter(|name| !name.is_empty()) {
            Some(name) => {
                let found = self.find(&Reference { at: model, name: name.to_owned() })?;
                if self.nodes[found].kind != Kind::Link {
                    return Err(model.error_at("canonical_link", format!("{} is not a link", shown(name))));
                }
                found
            }
            None => self.links().next().unwrap_or(MODEL),
        };
        self.nodes[MODEL].attached = canonical;
        for i in 1..self.nodes.len() {
            let Node { at, kind, .. } = self.nodes[i];
            let attached = match kind {
                Kind::Model | Kind::Link => i,
                Kind::Joint => self.find(&child(at)?)?,
                Kind::Frame => match at.attribute("attached_to").filter(|name| !name.is_empty()) {
                    Some(name) => self.find(&Reference { at, name: name.to_owned() })?,
                    None => MODEL,
                },
            };
            let (pose, relative_to) = pose(at, version, warnings)?;
            let base = match relative_to {
                Some(reference) => self.find(&reference)?,
                None if kind == Kind::Link => MODEL,
                None => attached,
            };
            let node = &mut self.nodes[i];
            (node.pose, node.base, node.attached) = (pose, base, attached);
        }
        Ok(())
    }

    /// Computes `in_model`, and returns the depths.
    ///
    /// # Errors
    /// If nodes are relative to each other in a cycle.
    fn place(&mut self) -> Result<Vec<usize>, FileError> {
        let count = self.nodes.len();
        let mut depths = vec![usize::MAX; count];
        self.in_model = vec![Pose::IDENTITY; count];
        depths[MODEL] = 0;
        for start in 1..count {
            for node in self.chain(start, "placed relative to", |node| depths[node] != usize::MAX, |node| node.base)? {
                let Node { base, pose, .. } = self.nodes[node];
                depths[node] = depths[base] + 1;
                self.in_model[node] = self.in_model[base].compose(&pose);
            }
        }
        Ok(depths)
    }

    /// The link that each node moves with.
    ///
    /// # Errors
    /// If nodes are attached to each other in a cycle.
    fn carry(&self) -> Result<Vec<usize>, FileError> {
        let count = self.nodes.len();
        let fixed = |i: usize| self.nodes[i].kind == Kind::Link || self.nodes[MODEL].attached == MODEL && i == MODEL;
        let mut links: Vec<_> = (0..count).map(|i| fixed(i).then_some(i)).collect();
        for start in 0..count {
            for node in self.chain(start, "attached to", |node| links[node].is_some(), |node| node.attached)? {
                links[node] = links[self.nodes[node].attached];
            }
        }
        Ok(links.into_iter().map(|link| link.unwrap_or(MODEL)).collect())
    }

    /// The unprocessed nodes on the chain from `start`, the last one first.
    ///
    /// # Errors
    /// If they form a cycle.
    fn chain(
        &self,
        start: usize,
        how: &str,
        done: impl Fn(usize) -> bool,
        next: impl Fn(&Node) -> usize,
    ) -> Result<Vec<usize>, FileError> {
        let mut chain = Vec::new();
        let mut at = start;
        while !done(at) {
            // A chain without a cycle has each node once.
            if chain.len() > self.nodes.len() {
                let around = chain.iter().rev().take_while(|&&node| node != at);
                let mut names: Vec<_> = std::iter::once(&at).chain(around).map(|&node| self.nodes[node].name).collect();
                names[1..].reverse();
                let message = format!("frames are {how} each other in a cycle: {}", listed(&names));
                return Err(self.nodes[at].at.error(message));
            }
            chain.push(at);
            at = next(&self.nodes[at]);
        }
        chain.reverse();
        Ok(chain)
    }

    /// The node of a name.
    ///
    /// # Errors
    /// Where there is nothing of that name.
    pub(super) fn find(&self, reference: &Reference) -> Result<usize, FileError> {
        let Reference { at, name } = reference;
        self.index.get(name.as_str()).copied().ok_or_else(|| {
            let message = if name == WORLD {
                "the world can only be the parent of a joint".to_owned()
            } else if name.contains("::") {
                format!("{} is in another model, and only this one is read", shown(name))
            } else {
                let names: Vec<_> = self.nodes.iter().map(|node| node.name).collect();
                format!("there is no link, joint or frame {}; known: {}", shown(name), listed(&names))
            };
            let by_attribute = at.attributes().any(|attribute| at.attribute(attribute) == Some(name));
            let error = if by_attribute { at.error_naming(name, message) } else { at.error_in_content(message) };
            let names: Vec<_> = self.nodes.iter().skip(1).map(|node| node.name).collect();
            match near(name, &names).filter(|_| name != WORLD && !name.contains("::")) {
                Some(help) => error.with_help(help),
                None => error,
            }
        })
    }

    /// Where node `inner` is in node `outer`.
    pub(super) fn between(&self, outer: usize, inner: usize) -> Pose {
        let (mut a, mut b) = (outer, inner);
        let (mut from_a, mut from_b) = (Pose::IDENTITY, Pose::IDENTITY);
        for _ in 0..NEAR {
            if a == b {
                return if a == outer { from_b } else { from_a.inverse().compose(&from_b) };
            }
            // Move up from the deeper node, so that both meet at their common ancestor.
            let (node, pose) =
                if self.depths[a] > self.depths[b] { (&mut a, &mut from_a) } else { (&mut b, &mut from_b) };
            let Node { base, pose: step, .. } = &self.nodes[*node];
            (*pose, *node) = (step.compose(pose), *base);
        }
        self.in_model[outer].inverse().compose(&self.in_model[inner])
    }

    /// The link that a node moves with.
    pub(super) fn link_of(&self, node: usize) -> usize {
        self.links[node]
    }

    /// The name of a node.
    pub(super) fn name(&self, node: usize) -> &'a str {
        self.nodes[node].name
    }

    /// Where a node stands in the file.
    pub(super) fn element(&self, node: usize) -> Element<'a> {
        self.nodes[node].at
    }

    /// The nodes of links, in the order of the file.
    pub(super) fn links(&self) -> impl Iterator<Item = usize> {
        self.of(Kind::Link)
    }

    /// The nodes of joints, in the order of the file.
    pub(super) fn joints(&self) -> impl Iterator<Item = usize> {
        self.of(Kind::Joint)
    }

    /// The named frames.
    pub(super) fn named(&self) -> impl Iterator<Item = (&'a str, usize)> {
        self.of(Kind::Frame).map(|node| (self.nodes[node].name, node))
    }

    fn of(&self, kind: Kind) -> impl Iterator<Item = usize> {
        self.nodes.iter().enumerate().filter(move |(_, node)| node.kind == kind).map(|(i, _)| i)
    }
}

/// The `child` of a joint.
///
/// # Errors
/// Where it is missing or empty.
pub(super) fn child(joint: Element) -> Result<Reference, FileError> {
    let at = joint.required_child("child")?;
    Ok(Reference { at, name: at.content()?.into_owned() })
}
