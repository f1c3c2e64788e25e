//! Reads a robot from its table in the task file and from its own file.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

use serde::Deserialize;
use supple_robot::vector::dot;
use supple_robot::{LoadOptions, Tree, load};
use supple_text::{FileError, digits};

use super::Robot;
use super::drive::DriveFile;
use super::insert::{Inserted, insert};
use super::keys::{File, FrameFile, JointFile, LinkFile};
use super::locked::Locked;
use crate::Value;
use crate::document::{Document, Place};
use crate::model::bodies::{Bodies, FrameNumbers, Override};
use crate::model::compliance::{Element, Names, Rule, find};
use crate::model::{Kinds, Source};
use crate::parameters::Parameters;
use crate::physics::DependentJoint;
use crate::quantity::{Context, Sensor, Unfit, Vocabulary, read_sensor};

mod drives;
mod inserted;

/// Reads a robot from the parts of its table.
pub(super) struct Build<'a> {
    document: &'a Document<'a>,
    parameters: &'a Parameters,
    kinds: &'a Kinds,
    /// The robot's file.
    path: PathBuf,
    robot: supple_robot::Robot,
    tree: Tree,
    /// Names of the degrees of freedom.
    joints: Vec<String>,
    frames: Vec<String>,
    locked: Locked,
    /// The joints that do not move on their own.
    dependent: Vec<DependentJoint>,
    inserted: Vec<Inserted>,
}

/// Error for a robot with too many moving joints: recording its derivatives took 0.6 GB for 80 joints, growing
/// with their number to the power of 2.5 (measured on chains of 20 to 80).
fn too_large(joints: usize) -> Option<String> {
    let gigabytes = 0.6 * (joints as f64 / 80.0).powi(2) * (joints as f64 / 80.0).sqrt();
    let most = Robot::MOST_JOINTS;
    (joints > most).then(|| {
        format!(
            "has {joints} moving joints, but at most {most} are supported: recording their derivatives would need about {gigabytes:.0} GB; fix joints with `locked`"
        )
    })
}

/// Gravity above this seems to be in other units, m/s^2.
const MOST_GRAVITY: f64 = 100.0;

/// Reads `[model]` of kind `robot`.
pub(super) fn read(source: &Source) -> Result<Robot, FileError> {
    let &Source { document, parameters, folder, kinds } = source;
    let at = ["model".into()];
    let (_, table) = document.table_with_kind(&at, &["robot"])?;
    let file = File::deserialize(table).map_err(|error| document.read_error(&at, error))?;
    for (index, root) in file.package_roots.iter().enumerate() {
        let place = ["model".into(), "package_roots".into(), index.into()];
        if folder.join(root).canonicalize().is_ok_and(|real| real.parent().is_none()) {
            return Err(document.error(&place, "is the whole file system; name the folder that holds the packages"));
        }
    }
    let options = LoadOptions {
        package_roots: file.package_roots.iter().map(|root| folder.join(root)).collect(),
        independent_mimic: file.independent_mimic,
        files: document.files().clone(),
    };
    let path: PathBuf = folder.join(&file.file);
    let named = ["model".into(), "file".into()];
    let mut robot = load(&path, &options).map_err(|error| document.error_of_file(&named, error))?;
    // Their lines are those of the robot's file, unlike those of other warnings about the task.
    for warning in robot.warnings.iter_mut().chain(&mut robot.every_warning) {
        *warning = format!("{}: {warning}", file.file);
    }
    let (robot, inserted) = insert(document, file.insert.clone(), robot)?;
    let locked = file.locked.clone();
    let robot = locked.apply(document, robot)?;
    let tree = Tree::new(&robot);
    let joints = tree.joints().to_vec();
    let follower = |joint: &supple_robot::Joint| {
        let leader = joint.mimic.filter(|_| !joints.contains(&joint.name))?.joint;
        Some(DependentJoint { name: joint.name.clone(), leader: Some(robot.joints[leader].name.clone()) })
    };
    let locked_joints = locked.names().into_iter().map(|name| DependentJoint { name, leader: None });
    let dependent = locked_joints.chain(robot.joints.iter().filter_map(follower)).collect();
    if let Some(message) = too_large(joints.len()) {
        return Err(document.error(&named, message));
    }
    let links = robot.links.iter().map(|link| link.name.clone());
    let frames = links.chain(robot.frames.iter().map(|frame| frame.name.clone())).collect();
    Build { document, parameters, kinds, path, robot, tree, joints, frames, locked, dependent, inserted }.build(file)
}

impl Build<'_> {
    fn error(&self, keys: &[Place], message: impl Into<String>) -> FileError {
        let at: Vec<Place> = std::iter::once("model".into()).chain(keys.iter().copied()).collect();
        self.document.error(&at, message)
    }

    fn unfit(&self, keys: &[Place], Unfit { place, message, help }: Unfit) -> FileError {
        let keys: Vec<Place> = keys.iter().copied().chain(place).collect();
        FileError { help, ..self.error(&keys, message) }
    }

    /// Checks that a value is at least `least`, or above `least` if `more`.
    fn check(&self, keys: &[Place], value: &Value, least: f64, more: bool) -> Result<(), FileError> {
        match self.parameters.least(value) {
            Some(found) if found < least || more && found <= least => {
                let valid = if more { "must be above" } else { "must be at least" };
                Err(self.error(keys, format!("{valid} {}; {}", digits(least), value.found(found))))
            }
            _ => Ok(()),
        }
    }

    /// Joints that the task inserted: they have no drives of their own.
    fn passive_joints(&self) -> impl Iterator<Item = &str> {
        self.inserted.iter().flat_map(|inserted| inserted.joints.iter().map(String::as_str))
    }

    fn build(mut self, file: File) -> Result<Robot, FileError> {
        if self.tree.dofs() == 0 {
            return Err(self.error(&["file".into()], "the robot has no joint that moves"));
        }
        if !(1..=1000).contains(&file.substeps) {
            let message = format!("must be from 1 to 1000; found {}", file.substeps);
            return Err(self.error(&["substeps".into()], message));
        }
        self.check(&["friction_smoothing".into()], &file.friction_smoothing, 0.0, true)?;
        let frames = self.frames(file.frames)?;
        let mut overrides = self.inserted_numbers()?;
        overrides.extend(self.overrides(file.links, file.joints)?);
        let compliance = self.compliance()?;
        self.check_dependent_uses(&file.drives)?;
        let drives = self.drives(file.actuated, file.file_actuators, file.drives, &compliance)?;
        let in_task = file.gravity.is_some();
        let gravity =
            file.gravity.unwrap_or_else(|| self.robot.gravity.unwrap_or([0.0, 0.0, -9.81]).map(Value::Number));
        self.doubt_gravity(&gravity, in_task);
        let mut robot = Robot {
            file: self.path.clone(),
            bodies: Bodies {
                robot: Arc::new(self.robot.clone()),
                tree: Arc::new(self.tree.clone()),
                gravity,
                overrides,
                frames,
                added: compliance.iter().map(|element| element.kind.coordinates()).sum(),
            },
            drives,
            compliance,
            sensors: Vec::new(),
            recalling: Vec::new(),
            friction_smoothing: file.friction_smoothing,
            friction_widening: None,
            integrator: file.integrator,
            lead: None,
            substeps: file.substeps,
            dependent: self.dependent.clone(),
            inserted: self.passive_joints().map(str::to_owned).collect(),
        };
        (robot.recalling, robot.sensors) = self.sensors(&robot)?.into_iter().partition(Sensor::recalls);
        self.check_inertia(&robot)?;
        for (index, element) in robot.compliance.iter().enumerate() {
            if let Some((key, message, help)) = robot.rigid(element) {
                let keys = ["compliance".into(), index.into(), key.into()];
                return Err(self.error(&keys, message).with_help(help));
            }
        }
        Ok(robot)
    }

    /// Warns of gravity, given in the task or by the robot's file, that seems to be in other units than m/s^2.
    fn doubt_gravity(&mut self, gravity: &[Value; 3], in_task: bool) {
        let phi = self.parameters.initial();
        let gravity = gravity.each_ref().map(|entry| entry.resolve::<f64>(&phi));
        let size = dot(gravity, gravity).sqrt();
        if size <= MOST_GRAVITY {
            return;
        }
        let message = format!("is {} m/s^2, more than on any planet; lengths are in m", digits(size));
        let warning = match in_task {
            true => self.error(&["gravity".into()], message).to_string(),
            false => format!("{}: gravity {message}", self.path.display()),
        };
        self.doubt(warning);
    }

    /// Adds a warning to those of the robot.
    fn doubt(&mut self, warning: String) {
        self.robot.warnings.push(warning.clone());
        self.robot.every_warning.push(warning);
    }

    /// Checks that every joint moves something that has inertia.
    fn check_inertia(&self, robot: &Robot) -> Result<(), FileError> {
        let phi = self.parameters.initial();
        let at = crate::Point { x: &[], u: &[], phi: &phi, time_step: 0.0, w: &[] };
        let mut numbers = robot.bodies.numbers(&at);
        for drive in robot.drives.iter().filter(|drive| drive.motor.is_none()) {
            let felt = at.value(&drive.gear).powi(2) * at.value(&drive.rotor);
            numbers.joints[self.tree.joint_indices()[drive.dof]].armature += felt;
        }
        let q = vec![0.1; self.tree.dofs()];
        let checked = supple_robot::check_inertia(&self.tree, &numbers, &q);
        checked.map_err(|error| {
            let massless = supple_robot::massless_joints(&self.tree, &numbers, &q);
            let names: Vec<_> = massless.into_iter().map(|dof| self.joints[dof].clone()).collect();
            let line = self.locked.line_with(&names);
            let help = format!("write `{line}` in [model] to take them out, or give their drives a `rotor_inertia`");
            self.error(&["file".into()], error.to_string()).with_help(help)
        })
    }

    /// Checks that the task does not set properties of the drive of a joint that does not move on its own.
    fn check_dependent_uses(&self, drives: &BTreeMap<String, DriveFile>) -> Result<(), FileError> {
        for name in drives.keys() {
            if let Some((message, help)) = DependentJoint::message(name, &self.dependent) {
                return Err(self.error(&["drives".into(), Place::Key(name)], message).with_help(help));
            }
        }
        Ok(())
    }

    fn frames(&mut self, list: BTreeMap<String, FrameFile>) -> Result<Vec<FrameNumbers>, FileError> {
        let known = self.frames.clone();
        let mut frames = Vec::new();
        for (name, FrameFile { on, position, rpy }) in list {
            let keys = ["frames".into(), Place::Key(&name)];
            if known.contains(&name) {
                return Err(self.error(&keys, format!("the robot already has a link or frame `{name}`")));
            }
            let on = find("on", "link or frame", &on, &known).map_err(|unfit| self.unfit(&keys, unfit))?;
            self.frames.push(name.clone());
            frames.push(FrameNumbers { name, on, position, rpy });
        }
        Ok(frames)
    }

    fn overrides(
        &self,
        links: BTreeMap<String, LinkFile>,
        joints: BTreeMap<String, JointFile>,
    ) -> Result<Vec<Override>, FileError> {
        let mut overrides = Vec::new();
        let link_names: Vec<_> = self.robot.links.iter().map(|link| link.name.clone()).collect();
        for (name, LinkFile { mass, inertia_scale, center }) in links {
            let keys = ["links".into(), Place::Key(&name)];
            let link = find("", "link", &name, &link_names);
            let link = link.map_err(|Unfit { message, help, .. }| FileError { help, ..self.error(&keys, message) })?;
            let change = Override::Link { link, mass, inertia_scale, center };
            self.check_override(&keys, &change)?;
            overrides.push(change);
        }
        let joint_names: Vec<_> = self.robot.joints.iter().map(|joint| joint.name.clone()).collect();
        for (name, JointFile { damping, friction, armature, stiffness, rest, offset, length_scale }) in joints {
            let keys = ["joints".into(), Place::Key(&name)];
            let joint = find("", "joint", &name, &joint_names);
            let joint =
                joint.map_err(|Unfit { message, help, .. }| FileError { help, ..self.error(&keys, message) })?;
            let change = Override::Joint { joint, damping, friction, armature, stiffness, rest, offset, length_scale };
            self.check_override(&keys, &change)?;
            overrides.push(change);
        }
        Ok(overrides)
    }

    fn check_override(&self, keys: &[Place], change: &Override) -> Result<(), FileError> {
        change.rules().into_iter().try_for_each(|(key, value, least)| {
            let keys: Vec<Place> = keys.iter().copied().chain([key.into()]).collect();
            least.map_or(Ok(()), |least| self.check(&keys, value, least, false))
        })
    }

    fn names(&self) -> Names<'_> {
        Names { joints: &self.joints, frames: &self.frames, robot: &self.robot, dependent: &self.dependent }
    }

    fn compliance(&self) -> Result<Vec<Element>, FileError> {
        let mut elements = self.inserted_springs();
        let at = ["model".into(), "compliance".into()];
        for index in 0..self.document.tables(&at)? {
            let keys = ["compliance".into(), index.into()];
            let at = ["model".into(), "compliance".into(), index.into()];
            let valid = self.kinds.couplings.names();
            let (kind, table) = self.document.table_with_kind(&at, &valid)?;
            let name = self.document.text_of(&at, "name")?;
            let is_used = |by: &str| {
                self.error(&[keys[0], keys[1], "name".into()], format!("the name `{name}` is already in use by {by}"))
            };
            if elements.iter().any(|other| other.name == name) {
                return Err(is_used("another table of `compliance`"));
            }
            if self.frames.contains(&name) {
                return Err(
                    is_used("a frame of the robot").with_help(format!("choose another, such as `{name}_{kind}`"))
                );
            }
            let unknown = || self.document.unknown_kind(&at, kind, &valid);
            let build = self.kinds.couplings.get(kind).ok_or_else(unknown)?;
            let read = build(table.beside(&["name"]), &self.names())
                .map_err(|error| self.document.read_error(&at, error))?
                .map_err(|unfit| self.unfit(&keys, unfit))?;
            for Rule { key, value, least, more, help } in read.rules() {
                let checked = self.check(&[keys[0], keys[1], key.into()], value, least, more);
                checked.map_err(|error| FileError { help: help.map(str::to_owned), ..error })?;
            }
            if let Some(dof) = (0..self.joints.len()).find(|&dof| read.is_motor_of(dof))
                && let Some(other) = elements.iter().find(|other| other.kind.is_motor_of(dof))
            {
                let message = format!("joint `{}` is already elastic (`{}`)", other.name, self.joints[dof]);
                return Err(self.error(&[keys[0], keys[1], "joint".into()], message));
            }
            let coordinate = elements.iter().map(|element| element.kind.coordinates()).sum();
            let constant = elements.iter().map(|element| element.kind.constants()).sum();
            elements.push(Element { name, kind: read, coordinate, constant });
        }
        Ok(elements)
    }

    fn sensors(&self, robot: &Robot) -> Result<Vec<Sensor>, FileError> {
        let at = ["model".into(), "sensors".into()];
        let count = self.document.tables(&at)?;
        if count == 0 && self.document.get(&["catalogue".into()]).is_none() {
            let missing = self.document.get(&at).is_none();
            let what = if missing { "is missing" } else { "must be a list of one or more tables: [[model.sensors]]" };
            return Err(self.error(&["sensors".into()], what));
        }
        let (vocabulary, quantities) = (Vocabulary::of(robot), &self.kinds.quantities);
        let context = Context { kinds: quantities, vocabulary: &vocabulary, parameters: self.parameters };
        let read = |index: usize| {
            let at = ["model".into(), "sensors".into(), index.into()];
            let (kind, table) = self.document.table_with_kind(&at, &quantities.names())?;
            read_sensor(kind, table, self.document.spot(&at), &context)
        };
        (0..count).map(read).collect()
    }
}
