//! Joints that the task locks.

use std::collections::BTreeMap;

use serde::Deserialize;
use serde::de::{self, Deserializer, MapAccess, SeqAccess, Visitor};
use supple_robot::{Joint, JointKind, Limits, LockedJoint, Tree};
use supple_text::{FileError, degrees, digits};

use crate::document::{Document, Place};
use crate::model::compliance::find;
use crate::value::as_key;

/// `locked` of `[model]`: names of joints, or their positions by name.
#[derive(Clone, Debug)]
pub(super) enum Locked {
    Names(Vec<String>),
    At(BTreeMap<String, f64>),
}

impl Default for Locked {
    fn default() -> Self {
        Self::Names(Vec::new())
    }
}

impl<'de> Deserialize<'de> for Locked {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Joints;

        impl<'de> Visitor<'de> for Joints {
            type Value = Locked;

            fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
                f.write_str("a list of joints, or a table of their positions by name")
            }
            fn visit_map<A: MapAccess<'de>>(self, table: A) -> Result<Locked, A::Error> {
                BTreeMap::deserialize(de::value::MapAccessDeserializer::new(table)).map(Locked::At)
            }
            fn visit_seq<A: SeqAccess<'de>>(self, list: A) -> Result<Locked, A::Error> {
                Vec::deserialize(de::value::SeqAccessDeserializer::new(list)).map(Locked::Names)
            }
        }

        deserializer.deserialize_any(Joints)
    }
}

#[cfg(feature = "schema")]
impl schemars::JsonSchema for Locked {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Locked".into()
    }
    fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
        schemars::json_schema!({
            "description": "Names of joints, or their positions by name, rad or m",
            "anyOf": [
                { "type": "array", "items": { "type": "string" } },
                { "type": "object", "additionalProperties": { "type": "number" } }
            ]
        })
    }
}

impl Locked {
    /// The joints, each with its position where one is given.
    fn joints(&self) -> Vec<(&String, Option<f64>)> {
        match self {
            Self::Names(names) => names.iter().map(|name| (name, None)).collect(),
            Self::At(positions) => positions.iter().map(|(name, position)| (name, Some(*position))).collect(),
        }
    }

    /// Their names.
    pub fn names(&self) -> Vec<String> {
        self.joints().into_iter().map(|(name, _)| name.clone()).collect()
    }

    /// The line of a task file that locks `more` joints as well.
    pub fn line_with(&self, more: &[String]) -> String {
        match self {
            Self::Names(names) => {
                let all: Vec<_> = names.iter().chain(more).map(|name| format!("{name:?}")).collect();
                format!("locked = [{}]", all.join(", "))
            }
            Self::At(positions) => {
                let own = positions.iter().map(|(name, position)| format!("{} = {position:?}", as_key(name)));
                let all: Vec<_> = own.chain(more.iter().map(|name| format!("{} = 0.0", as_key(name)))).collect();
                format!("locked = {{ {} }}", all.join(", "))
            }
        }
    }

    /// The robot with these joints locked; positions outside a joint's range are added to its warnings.
    ///
    /// # Errors
    /// If one of them does not move on its own, is named twice, or has a non-finite position; or if no moving
    /// joint is left.
    pub fn apply(&self, document: &Document, robot: supple_robot::Robot) -> Result<supple_robot::Robot, FileError> {
        let listed = self.joints();
        if listed.is_empty() {
            return Ok(robot);
        }
        let at = ["model".into(), "locked".into()];
        let tree = Tree::new(&robot);
        let mut locked: Vec<LockedJoint> = Vec::new();
        let mut warnings = Vec::new();
        for (index, (name, position)) in listed.into_iter().enumerate() {
            let own = if matches!(self, Self::At(_)) { Place::Key(name) } else { index.into() };
            let error = |message: String| document.error(&[at[0], at[1], own], message);
            let joint =
                joint_of(&robot, &tree, name).map_err(|(message, help)| FileError { help, ..error(message) })?;
            if locked.iter().any(|other| other.joint == joint) {
                return Err(error(format!("joint `{name}` occurs twice")));
            }
            let position = position.unwrap_or_else(|| robot.joints[joint].neutral());
            if !position.is_finite() {
                return Err(error(format!("must be a finite position, rad or m; found {position}")));
            }
            if let Some((message, help)) = doubt(&robot.joints[joint], position) {
                warnings.push(FileError { help, ..error(message) }.to_string());
            }
            locked.push(LockedJoint { joint, position });
        }
        if locked.len() == tree.dofs() {
            let error = document.error(&at, "all moving joints are locked; there is nothing to control");
            return Err(error.with_help(format!("leave out one of {}", supple_text::quoted(tree.joints()))));
        }
        let mut robot = robot.locked(&locked);
        robot.warnings.extend_from_slice(&warnings);
        robot.every_warning.extend(warnings);
        Ok(robot)
    }
}

/// A warning if the position of a locked joint looks suspicious, with advice.
fn doubt(joint: &Joint, position: f64) -> Option<(String, Option<String>)> {
    let Limits { lower, upper, .. } = joint.limits;
    let help = if joint.kind == JointKind::Prismatic { None } else { degrees(position) };
    let (name, at) = (&joint.name, digits(position));
    if joint.limits.allow(position) {
        let is_bounded = lower.is_finite() && upper.is_finite();
        return (help.is_some() && !is_bounded).then(|| (format!("joint `{name}` is locked at {at} rad"), help));
    }
    let range = format!("[{}, {}]", digits(lower), digits(upper));
    Some((format!("joint `{name}` is locked at {at}, outside its range {range}"), help))
}

/// The joint with this name, which must move on its own; the error comes with advice.
fn joint_of(robot: &supple_robot::Robot, tree: &Tree, name: &str) -> Result<usize, (String, Option<String>)> {
    if let Some(joint) = robot.joint(name).map(|joint| &robot.joints[joint]) {
        if joint.kind == JointKind::Fixed {
            return Err((
                format!("joint `{name}` is fixed in the robot's file"),
                Some("take it out of `locked`".into()),
            ));
        }
        if let Some(mimic) = joint.mimic.filter(|_| !tree.joints().iter().any(|other| other == name)) {
            let leader = &robot.joints[mimic.joint].name;
            let message = format!("joint `{name}` follows joint `{leader}` and is locked with it");
            return Err((message, Some(format!("write `{leader}` in its place"))));
        }
    }
    let dof = find("", "moving joint", name, tree.joints()).map_err(|unfit| (unfit.message, unfit.help))?;
    Ok(tree.joint_indices()[dof])
}
