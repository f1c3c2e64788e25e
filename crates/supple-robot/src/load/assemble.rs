//! Assembles links and joints, which a file may list in any order, into a [`Robot`]: a tree, root first, checked.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use supple_text::FileError;

use super::mimic::{follow, narrow};
use super::names::Names;
use super::options::LoadOptions;
use super::parts::{Ends, FramePart, JointPart, LinkPart, Parts};
use super::physics::{check_joint, check_link, warn_of_massless, without_zeros};
use super::warnings::Sentences;
use super::words::{listed, shown};
use super::xml::Document;
use crate::{Frame, Joint, Link, Mimic, Robot};

/// Greatest number of links of a robot.
const MOST_LINKS: usize = 20_000;

/// Indices in the robot of the links and joints of the file.
struct Order {
    /// By link in the file.
    links: Vec<usize>,
    /// By joint in the file.
    joints: Vec<usize>,
}

/// Assembles the parts. Joints keep the order of the file, except those listed before the joint that carries
/// their parent.
///
/// # Errors
/// If links and joints do not form one tree with one root, names are duplicate or unknown, or numbers are invalid.
pub(super) fn assemble(document: &Document, mut parts: Parts, options: &LoadOptions) -> Result<Robot, FileError> {
    if options.independent_mimic {
        parts.joints.iter_mut().for_each(|joint| joint.mimic = None);
    }
    if let Some(beyond) = parts.links.get(MOST_LINKS) {
        return Err(beyond.at.error(format!("a robot has at most {MOST_LINKS} links")));
    }
    for link in &parts.links {
        check_link(link, &mut parts.warnings)?;
    }
    for joint in &mut parts.joints {
        check_joint(joint, &mut parts.warnings)?;
    }
    without_zeros(&mut parts);
    let links = Names::new(parts.links.iter().map(|link| (link.name.as_str(), link.at)), "link")?;
    let joints = Names::new(parts.joints.iter().map(|joint| (joint.own.name.as_str(), joint.at)), "joint")?;
    Names::new(parts.frames.iter().map(|frame| (frame.name.as_str(), frame.link.at)), "frame")?;
    let mimics = follow(&parts.joints, &joints, &mut parts.warnings)?;
    narrow(&mut parts.joints, &mimics, &mut parts.warnings);
    let ends = ends(&parts.joints, &links)?;
    let order = order(document, &parts, &ends)?;
    let mut frames = Vec::with_capacity(parts.frames.len());
    for FramePart { name, link, pose } in &parts.frames {
        frames.push(Frame { name: name.clone(), link: order.links[links.find(link)?], pose: *pose });
    }

    let Parts { name, links, joints, gravity, mut warnings, .. } = parts;
    warn_of_massless(&links, &joints, &ends, &order.joints, &mut warnings);
    let placed = |mimic: Mimic| Mimic { joint: order.joints[mimic.joint], ..mimic };
    let joints = joints.into_iter().zip(mimics).zip(&ends);
    let joints = joints.map(|((joint, mimic), ends)| joint.finish(order.links[ends.parent], mimic.map(placed)));
    let Sentences { kinds, every, forces } = warnings.into_sentences();
    Ok(Robot {
        name,
        links: sorted(links.into_iter().map(LinkPart::finish), &order.links),
        joints: sorted(joints, &order.joints),
        frames,
        gravity,
        warnings: kinds,
        every_warning: every,
        left_out_forces: forces,
        ..Robot::default()
    })
}

/// Things sorted by their new indices.
fn sorted<T>(things: impl Iterator<Item = T>, places: &[usize]) -> Vec<T> {
    let mut placed: Vec<_> = things.zip(places).collect();
    placed.sort_by_key(|&(_, place)| *place);
    placed.into_iter().map(|(thing, _)| thing).collect()
}

impl LinkPart<'_> {
    fn finish(self) -> Link {
        let Self { at, name, inertia, meshes, primitives } = self;
        Link { name, inertia: inertia.map(|(inertia, _)| inertia), meshes, primitives, line: at.line() }
    }
}

impl JointPart<'_> {
    fn finish(self, parent: usize, mimic: Option<Mimic>) -> Joint {
        Joint { parent, mimic, ..self.own }
    }
}

/// The links of each joint.
///
/// # Errors
/// If a link is unknown, or is its own parent.
fn ends(joints: &[JointPart], links: &Names) -> Result<Vec<Ends>, FileError> {
    let mut all = Vec::with_capacity(joints.len());
    for joint in joints {
        let ends = Ends { parent: links.find(&joint.parent)?, child: links.find(&joint.child)? };
        if ends.parent == ends.child {
            let name = shown(&joint.child.name);
            return Err(joint.child.at.error_naming(&joint.child.name, format!("link {name} is its own parent")));
        }
        all.push(ends);
    }
    Ok(all)
}

/// New indices of links and joints: each joint after the joint that carries its parent, otherwise as in the file.
///
/// # Errors
/// If they do not form a single tree.
fn order(document: &Document, parts: &Parts, ends: &[Ends]) -> Result<Order, FileError> {
    let mut carrier: Vec<Option<usize>> = vec![None; parts.links.len()];
    let mut carried = vec![Vec::new(); parts.links.len()];
    for (i, (joint, ends)) in parts.joints.iter().zip(ends).enumerate() {
        if let Some(first) = carrier[ends.child].replace(i) {
            let (first, child) = (&parts.joints[first], &joint.child);
            return Err(child.at.error_naming(
                &child.name,
                format!(
                    "link {} is already the child of joint {} ({}); closed loops are not supported",
                    shown(&child.name),
                    shown(&first.own.name),
                    first.at.place()
                ),
            ));
        }
        carried[ends.parent].push(i);
    }
    let root = root(document, parts, ends, &carrier)?;
    let unplaced = usize::MAX;
    let mut order = Order { links: vec![unplaced; parts.links.len()], joints: vec![unplaced; ends.len()] };
    order.links[root] = 0;
    let mut ready: BinaryHeap<_> = carried[root].iter().copied().map(Reverse).collect();
    let mut placed = 0;
    while let Some(Reverse(joint)) = ready.pop() {
        let child = ends[joint].child;
        order.joints[joint] = placed;
        placed += 1;
        order.links[child] = placed;
        ready.extend(carried[child].iter().copied().map(Reverse));
    }
    match order.links.iter().position(|&place| place == unplaced) {
        Some(link) => Err(cycle(parts, ends, &carrier, link)),
        None => Ok(order),
    }
}

/// The one link without a parent.
///
/// # Errors
/// If there is no such link, or more than one.
fn root(document: &Document, parts: &Parts, ends: &[Ends], carrier: &[Option<usize>]) -> Result<usize, FileError> {
    if parts.links.is_empty() {
        return Err(document.root().error("the robot has no links"));
    }
    let mut roots = (0..parts.links.len()).filter(|&link| carrier[link].is_none());
    let Some(root) = roots.next() else { return Err(cycle(parts, ends, carrier, 0)) };
    match roots.next() {
        None => Ok(root),
        Some(other) => {
            let (root, other) = (&parts.links[root], &parts.links[other]);
            Err(other.at.error(format!(
                "two root links: this one and {} ({}); a robot must have one root",
                shown(&root.name),
                root.at.place()
            )))
        }
    }
}

/// The error about the closed loop of joints that contains `link`, or that `link` hangs from.
fn cycle(parts: &Parts, ends: &[Ends], carrier: &[Option<usize>], link: usize) -> FileError {
    let up = |link: usize| carrier[link].map_or(link, |joint| ends[joint].parent);
    // Going up as many steps as there are links must end inside the loop.
    let within = (0..parts.links.len()).fold(link, |link, _| up(link));
    let around = |start| std::iter::successors(Some(start), move |&link| Some(up(link)).filter(|&up| up != start));
    let first = around(within).min().unwrap_or(within);
    let mut names: Vec<_> = around(first).map(|link| parts.links[link].name.as_str()).collect();
    names[1..].reverse();
    parts.links[first].at.error(format!("closed kinematic loop along {}; a robot must be a tree", listed(&names)))
}
