//! Joints that the task inserts: a compliant mount at a frame, or a door in the world.

use serde::Deserialize;
use supple_robot::{Inertia, InsertedAxis, Pose};
use supple_text::{FileError, digits, nearest, owned, quoted};

use crate::Value;
use crate::document::{Document, Place};
use crate::value::OneOrMore;

/// One of `[[model.insert]]`.
#[derive(Clone, Debug, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(super) struct InsertFile {
    /// Unique name of the link beyond the joints; the joints are NAME_x, NAME_y, NAME_z, NAME_rx, NAME_ry
    /// and NAME_rz, and so are their springs.
    name: String,
    /// Link, or frame of the robot's file, that the joints are mounted on.
    frame: String,
    /// Their position in that frame, m.
    #[serde(default)]
    position: [f64; 3],
    /// Roll, pitch and yaw of their axes in that frame, rad.
    #[serde(default)]
    rpy: [f64; 3],
    /// The joints, from one to six: slides along x, y and z, and turns about them, the first one nearest to the frame.
    #[cfg_attr(feature = "schema", schemars(length(min = 1, max = 6)))]
    axes: Vec<Axis>,
    /// Links to attach to the mount; they must be children of the frame's link.
    #[serde(default)]
    carries: Vec<String>,
    /// Mass of the link beyond, kg; at least 0.
    #[serde(default)]
    mass: Value,
    /// Its centre of mass in its own frame, m.
    #[serde(default)]
    center: [Value; 3],
    /// Its moments of inertia about the axes of its frame through its centre of mass, kg m^2; at least 0.
    #[serde(default)]
    inertia: [f64; 3],
    /// Stiffness of the springs, one for all joints or one each, N/m and N m/rad; at least 0.
    stiffness: Option<OneOrMore>,
    /// Damping of the springs, one for all joints or one each, N s/m and N m s/rad; at least 0.
    damping: Option<OneOrMore>,
}

/// A joint of a mount.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
enum Axis {
    X,
    Y,
    Z,
    Rx,
    Ry,
    Rz,
}

/// Inserted joints, with their numbers that may be parameters.
#[derive(Debug)]
pub(super) struct Inserted {
    /// Names of the joints.
    pub joints: Vec<String>,
    /// Name of the link after the joints.
    pub link: String,
    pub mass: Value,
    pub center: [Value; 3],
    pub stiffness: Vec<Value>,
    pub damping: Vec<Value>,
}

/// Inserts all joints that the task asks for, one after the other.
///
/// # Errors
/// If one of them does not fit the robot.
pub(super) fn insert(
    document: &Document,
    files: Vec<InsertFile>,
    mut robot: supple_robot::Robot,
) -> Result<(supple_robot::Robot, Vec<Inserted>), FileError> {
    let mut inserted = Vec::new();
    for (index, file) in files.into_iter().enumerate() {
        let error = |keys: &[Place], message: String| {
            let at = ["model".into(), "insert".into(), index.into()];
            document.error(&at.into_iter().chain(keys.iter().copied()).collect::<Vec<_>>(), message)
        };
        let built = file.built(&robot, &error)?;
        let axes = file.axes.len();
        let each = |key: &'static str, given: Option<OneOrMore>| {
            let given = given.unwrap_or_else(|| OneOrMore(vec![Value::default()]));
            let found = given.0.len();
            given.each(axes).map_err(|_| {
                let message = format!("must be one number, or {axes} of them, one per axis; found {found}");
                error(&[key.into()], message)
            })
        };
        inserted.push(Inserted {
            joints: built.joints().collect(),
            link: file.name.clone(),
            mass: file.mass,
            center: file.center,
            stiffness: each("stiffness", file.stiffness)?,
            damping: each("damping", file.damping)?,
        });
        robot = robot.with_insert(&built);
    }
    Ok((robot, inserted))
}

impl InsertFile {
    /// The insert for a robot, checked.
    fn built(
        &self,
        robot: &supple_robot::Robot,
        error: &dyn Fn(&[Place], String) -> FileError,
    ) -> Result<supple_robot::Insert, FileError> {
        let links: Vec<String> = robot.links.iter().map(|link| link.name.clone()).collect();
        let frames = links.iter().cloned().chain(robot.frames.iter().map(|frame| frame.name.clone()));
        let frames: Vec<String> = frames.collect();
        let unfit = |keys: &[Place], message: String, help: Option<String>| FileError { help, ..error(keys, message) };
        if self.name.is_empty() {
            return Err(error(&["name".into()], "must not be empty".into()));
        }
        let axes = self.distinct_axes(error)?;
        let (link, place) = robot.frame(&self.frame).ok_or_else(|| {
            let message = format!("the robot has no link or frame `{}`: {}", self.frame, owned(&frames));
            unfit(&["frame".into()], message, nearest(&self.frame, &frames))
        })?;
        self.check_numbers(error)?;
        let carried = |(place, name): (usize, &String)| {
            let keys = ["carries".into(), place.into()];
            let children = (0..links.len()).filter(|&child| child > 0 && robot.joints[child - 1].parent == link);
            let children: Vec<usize> = children.collect();
            let names: Vec<String> = children.iter().map(|&child| links[child].clone()).collect();
            children.iter().copied().find(|&child| links[child] == *name).ok_or_else(|| {
                let message = match names.len() {
                    0 => format!("link `{}` carries no other link", links[link]),
                    _ => format!("`{name}` is not a child of link `{}`, which carries {}", links[link], quoted(&names)),
                };
                unfit(&keys, message, nearest(name, &names))
            })
        };
        let insert = supple_robot::Insert {
            name: self.name.clone(),
            link,
            pose: place.compose(&Pose::from_rpy(self.position, self.rpy)),
            axes,
            inertia: self.own_inertia(),
            carries: self.carries.iter().enumerate().map(carried).collect::<Result<_, _>>()?,
            line: error(&[], String::new()).line,
        };
        let taken = insert.links().find(|name| frames.contains(name));
        let taken = taken.map(|name| format!("the robot already has a link or frame `{name}`"));
        let joint = insert.joints().find(|name| robot.joint(name).is_some());
        match taken.or(joint.map(|name| format!("the robot has a joint `{name}` already"))) {
            Some(message) => Err(error(&["name".into()], message)),
            None => Ok(insert),
        }
    }

    /// The axes of motion: at least one, each at most once.
    fn distinct_axes(&self, error: &dyn Fn(&[Place], String) -> FileError) -> Result<Vec<InsertedAxis>, FileError> {
        let axes: Vec<InsertedAxis> = self.axes.iter().map(|&axis| InsertedAxis::ALL[axis as usize]).collect();
        if axes.is_empty() {
            let all = InsertedAxis::ALL.map(|axis| axis.name);
            return Err(error(&["axes".into()], format!("name at least one of {}", quoted(&all))));
        }
        match (1..axes.len()).find(|&place| axes[..place].contains(&axes[place])) {
            Some(twice) => Err(error(&["axes".into(), twice.into()], format!("`{}` occurs twice", axes[twice].name))),
            None => Ok(axes),
        }
    }

    /// Checks that its pose is finite and its moments of inertia are not negative.
    fn check_numbers(&self, error: &dyn Fn(&[Place], String) -> FileError) -> Result<(), FileError> {
        for (key, numbers) in [("position", self.position), ("rpy", self.rpy), ("inertia", self.inertia)] {
            let least = if key == "inertia" { 0.0 } else { f64::NEG_INFINITY };
            if let Some(entry) = (0..3).find(|&entry| !(numbers[entry].is_finite() && numbers[entry] >= least)) {
                let valid = if key == "inertia" { "must be at least 0" } else { "must be finite" };
                return Err(error(&[key.into(), entry.into()], format!("{valid}; found {}", digits(numbers[entry]))));
            }
        }
        Ok(())
    }

    /// Its inertia, if it has any; entries that are parameters are set to 0.
    fn own_inertia(&self) -> Option<Inertia> {
        let [ixx, iyy, izz] = self.inertia;
        let number = |value: &Value| if let Value::Number(number) = *value { number } else { 0.0 };
        let has_mass = !self.mass.is_zero() || self.inertia != [0.0; 3];
        has_mass.then(|| Inertia {
            mass: number(&self.mass),
            center: self.center.each_ref().map(number),
            moment: [[ixx, 0.0, 0.0], [0.0, iyy, 0.0], [0.0, 0.0, izz]],
        })
    }
}
