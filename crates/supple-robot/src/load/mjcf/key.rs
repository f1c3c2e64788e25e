//! The `keyframe` sections: states of the robot with names.

use std::collections::HashMap;

use supple_text::FileError;

use super::super::words::shown;
use super::super::xml::Element;
use super::known::check_attributes;
use super::reader::Reader;
use crate::{JointKind, Key};

/// Numbers in all keyframes together, at most.
const MOST: usize = 10_000_000;

impl<'a> Reader<'a, '_> {
    /// The keyframes of the file; numbers by joint in the order of the file.
    ///
    /// # Errors
    /// Where there are more numbers than joints or actuators, or a name is used twice.
    pub(super) fn read_keys(&mut self, root: Element<'a>) -> Result<(), FileError> {
        let mut names: HashMap<String, Element> = HashMap::new();
        for (number, at) in root.all("keyframe").flat_map(Element::children).enumerate() {
            if at.tag() != "key" {
                self.parts.warnings.unknown(at, &["key"]);
                continue;
            }
            check_attributes(at, "key", &mut self.parts.warnings);
            if (number + 1).saturating_mul(self.parts.joints.len()) > MOST {
                return Err(at.error(format!("keyframes may hold at most {MOST} numbers in total")));
            }
            let name = at.attribute("name").filter(|name| !name.is_empty());
            let name = name.map_or_else(|| format!("key{number}"), str::to_owned);
            if let Some(first) = names.insert(name.clone(), at) {
                let message = format!("there is another keyframe {}, at {}", shown(&name), first.place());
                return Err(at.error_at("name", message));
            }
            let moving: Vec<_> =
                (0..self.parts.joints.len()).filter(|&i| self.parts.joints[i].own.kind != JointKind::Fixed).collect();
            let mut key = Key {
                name,
                positions: self.parts.joints.iter().map(|joint| joint.own.reference).collect(),
                velocities: vec![0.0; self.parts.joints.len()],
                controls: vec![0.0; self.actuators.kept.len()],
                line: at.line(),
            };
            let joints = |count: usize| format!("{count} moving joint{}", if count == 1 { "" } else { "s" });
            for (place, value) in numbers(at, "qpos", &joints(moving.len()), moving.len())?.into_iter().enumerate() {
                key.positions[moving[place]] = value;
            }
            for (place, value) in numbers(at, "qvel", &joints(moving.len()), moving.len())?.into_iter().enumerate() {
                key.velocities[moving[place]] = value;
            }
            let count = self.actuators.places.len();
            let actuators = format!("{count} actuator{}", if count == 1 { "" } else { "s" });
            for (place, value) in numbers(at, "ctrl", &actuators, count)?.into_iter().enumerate() {
                if let Some(kept) = self.actuators.places[place] {
                    key.controls[kept] = value;
                }
            }
            self.keys.push(key);
        }
        Ok(())
    }
}

/// The numbers of an attribute; if there are fewer than joints or actuators, they apply to the first ones.
fn numbers(at: Element, name: &str, all: &str, most: usize) -> Result<Vec<f64>, FileError> {
    let found = at.list(name)?.unwrap_or_default();
    if found.len() > most {
        return Err(at.error_at(name, format!("`{name}` has {} numbers, and the robot has {all}", found.len())));
    }
    Ok(found)
}
