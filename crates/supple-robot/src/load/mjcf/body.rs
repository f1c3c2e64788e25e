//! The tree of bodies, from `worldbody` on.

use std::collections::{HashMap, HashSet};

use supple_text::FileError;

use super::super::parts::{FramePart, JointPart, LinkPart, Parts, Reference};
use super::super::sdf::check_position;
use super::super::words::shown;
use super::super::xml::Element;
use super::WORLD;
use super::defaults::{MAIN, Values};
use super::known::check_attributes;
use super::orientation::{between, pose};
use super::reader::{Items, Reader};
use crate::{JointKind, Pose};

/// Elements of a body that are read, or that must not be ignored.
const BODY: [&str; 7] = ["body", "inertial", "joint", "freejoint", "geom", "site", "frame"];

/// A body to be read.
struct Task<'a> {
    at: Element<'a>,
    /// The link it is attached to; its pose is relative to the frame below, in that link.
    parent: String,
    frame: Pose,
    /// The default class of its elements.
    class: usize,
    /// Pose of its parent in the world; `None` if the parent can move.
    world: Option<Pose>,
}

impl<'a> Reader<'a, '_> {
    /// The `worldbody` sections, and all bodies in them.
    ///
    /// # Errors
    /// Where anything in them is wrong, or there is none.
    pub(super) fn world(&mut self, root: Element<'a>) -> Result<(), FileError> {
        let worlds: Vec<_> = root.all("worldbody").collect();
        let Some(&first) = worlds.first() else {
            let error = root.error("there is no `worldbody` in it");
            return Err(error.with_help("this file contains settings only; load the file that includes it"));
        };
        let mut items = Items::default();
        for at in worlds {
            check_attributes(at, "worldbody", &mut self.parts.warnings);
            self.collect(at, Pose::IDENTITY, MAIN, &mut items)?;
        }
        if let Some(&(at, ..)) = items.joints.first() {
            return Err(at.error("joints must be inside a body, not in the world"));
        }
        if let Some(at) = items.inertial {
            return Err(at.error("`inertial` must be inside a body, not in the world"));
        }
        self.finish(first, WORLD, &items, Some(Pose::IDENTITY))?;
        let mut open: Vec<_> = tasks(items, WORLD, Some(Pose::IDENTITY)).collect();
        while let Some(task) = open.pop() {
            let (name, items, world) = self.body(task)?;
            open.extend(tasks(items, &name, world));
        }
        self.scale_masses(first)?;
        self.check_walls(first)?;
        self.check_sites()
    }

    /// # Errors
    /// Where two sites have one name, or one is too far away.
    fn check_sites(&mut self) -> Result<(), FileError> {
        let Parts { links, frames, warnings, .. } = &mut self.parts;
        let links: HashSet<_> = links.iter().map(|link| link.name.as_str()).collect();
        let mut sites = HashMap::new();
        for frame in frames {
            let at = frame.link.at;
            if let Some(first) = sites.insert(frame.name.as_str(), at) {
                let message = format!("there is another site of this name, at {}", first.place());
                return Err(at.error_at("name", message));
            }
            if links.contains(frame.name.as_str()) {
                warnings.note("shadowed", at, || "a body has the same name; references use the body".to_owned());
            }
            check_position(at, &frame.pose)?;
        }
        Ok(())
    }

    /// A body: its link, its joints, and links between them. Returns its name, its contents, and its pose in the
    /// world if it cannot move.
    fn body(&mut self, task: Task<'a>) -> Result<(String, Items<'a>, Option<Pose>), FileError> {
        let Task { at, parent, frame, class, world } = task;
        check_attributes(at, "body", &mut self.parts.warnings);
        self.bodies += 1;
        let name = self.name(at, "body", self.bodies);
        if at.attribute("mocap").is_some_and(|value| value.trim() != "false") {
            self.parts.warnings.ignore_attribute(at, "mocap");
        }
        if at.number("gravcomp")?.is_some_and(|share| share != 0.0) {
            self.parts.warnings.leave_out_force("gravcomp", at, || {
                "`gravcomp` of bodies is left out: gravity acts on them".to_owned()
            });
        }
        let placed = frame.compose(&pose(&Values::own(at), self.settings)?);
        let class = self.classes.named(at, "childclass", class)?;
        let mut items = Items::default();
        self.collect(at, Pose::IDENTITY, class, &mut items)?;

        let world = world.filter(|_| items.joints.is_empty()).map(|parent| parent.compose(&placed));
        let reference = |name: &str| Reference { at, name: name.to_owned() };
        if items.joints.is_empty() {
            let ends = [reference(&parent), reference(&name)];
            let [parent, child] = ends;
            let mut joint = JointPart::new(at, &format!("{name}/fixed"), JointKind::Fixed, parent, child);
            joint.own.origin = placed;
            self.parts.joints.push(joint);
        }
        let mut last = parent;
        for (i, &(at, frame, class)) in items.joints.iter().enumerate() {
            let joint_name = self.name(at, "joint", self.joints);
            self.joints += 1;
            let link = if i + 1 < items.joints.len() {
                let link = format!("{name}/{joint_name}");
                self.parts.links.push(LinkPart::empty(at, link.clone()));
                link
            } else {
                name.clone()
            };
            let mut joint = self.joint(at, &frame, class, &joint_name, [reference(&last), reference(&link)])?;
            if i == 0 {
                joint.own.origin = placed.compose(&joint.own.origin);
            }
            self.parts.joints.push(joint);
            last = link;
        }
        self.finish(at, &name, &items, world)?;
        Ok((name, items, world))
    }

    /// The link of a body with its inertia, meshes, sites and walls. `world` is where it is if it cannot move.
    fn finish(&mut self, at: Element<'a>, name: &str, items: &Items<'a>, world: Option<Pose>) -> Result<(), FileError> {
        let counts = world.is_none() || self.settings.total_mass.is_some();
        let inertia = if name == WORLD { None } else { self.inertia(at, items, counts)? };
        let mut link = LinkPart { inertia, ..LinkPart::empty(at, name.to_owned()) };
        for &(geom, frame, class) in &items.geoms {
            check_attributes(geom, "geom", &mut self.parts.warnings);
            link.meshes.extend(self.mesh(geom, &frame, class)?);
            link.primitives.extend(self.primitive(geom, &frame, class)?);
            if let Some(world) = world {
                self.wall(geom, &world.compose(&frame), class)?;
            }
        }
        self.parts.links.push(link);
        for &(site, frame, class) in &items.sites {
            check_attributes(site, "site", &mut self.parts.warnings);
            let values = self.classes.values(site, "site", class)?;
            let placed = match between(&values)? {
                Some((placed, _)) => placed,
                None => pose(&values, self.settings)?,
            };
            if let Some(label) = site.attribute("name").filter(|label| !label.is_empty()) {
                let link = Reference { at: site, name: name.to_owned() };
                self.parts.frames.push(FramePart { name: label.to_owned(), link, pose: frame.compose(&placed) });
            }
        }
        Ok(())
    }

    /// What is in a body or a frame, which is at `frame` in the body.
    fn collect(&mut self, at: Element<'a>, frame: Pose, class: usize, items: &mut Items<'a>) -> Result<(), FileError> {
        for child in at.children() {
            let placed = (child, frame, class);
            match child.tag() {
                "body" => items.bodies.push(placed),
                "joint" | "freejoint" => items.joints.push(placed),
                "geom" => items.geoms.push(placed),
                "site" => items.sites.push(placed),
                "inertial" => {
                    check_attributes(child, "inertial", &mut self.parts.warnings);
                    if let Some(first) = items.inertial.replace(child) {
                        let message = format!("a body may have only one `inertial`; the first is at {}", first.place());
                        return Err(child.error(message));
                    }
                }
                "frame" => {
                    check_attributes(child, "frame", &mut self.parts.warnings);
                    let inner = frame.compose(&pose(&Values::own(child), self.settings)?);
                    let class = self.classes.named(child, "childclass", class)?;
                    self.collect(child, inner, class, items)?;
                }
                "camera" | "light" | "plugin" => self.parts.warnings.ignore(child),
                "composite" | "flexcomp" | "attach" | "replicate" => {
                    let help = "write the whole model out, for example with MuJoCo's `mj_saveLastXML`";
                    let message = format!("{} is not supported", shown(child.tag()));
                    return Err(child.error(message).with_help(help));
                }
                _ => self.parts.warnings.unknown(child, &BODY),
            }
        }
        Ok(())
    }

    /// The name of an element, or a generated one that the file does not use.
    fn name(&self, at: Element, what: &str, number: usize) -> String {
        match at.attribute("name").filter(|name| !name.is_empty()) {
            Some(name) => name.to_owned(),
            None => {
                let mut name = format!("{what}{number}");
                while self.names.contains(name.as_str()) {
                    name.push('_');
                }
                name
            }
        }
    }
}

/// The bodies in a body, the last one first.
fn tasks<'a>(items: Items<'a>, parent: &str, world: Option<Pose>) -> impl Iterator<Item = Task<'a>> {
    let parent = parent.to_owned();
    items.bodies.into_iter().rev().map(move |(at, frame, class)| Task {
        at,
        parent: parent.clone(),
        frame,
        class,
        world,
    })
}
