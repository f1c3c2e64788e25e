//! Numbers and springs of the joints that the task inserts.

use supple_text::FileError;

use super::Build;
use crate::Value;
use crate::model::bodies::Override;
use crate::model::compliance::{Element, Spring, find};
use crate::model::robot::insert::Inserted;

impl Build<'_> {
    /// Masses and centres of inserted links, which may be parameters.
    pub(super) fn inserted_numbers(&self) -> Result<Vec<Override>, FileError> {
        let mut overrides = Vec::new();
        for (index, inserted) in self.inserted.iter().enumerate() {
            let Inserted { link, mass, center, stiffness, damping, .. } = inserted;
            let keys = |key: &'static str| ["insert".into(), index.into(), key.into()];
            self.check(&keys("mass"), mass, 0.0, false)?;
            for (key, values) in [("stiffness", stiffness), ("damping", damping)] {
                values.iter().try_for_each(|value| self.check(&keys(key), value, 0.0, false))?;
            }
            let is_constant = |value: &Value| matches!(value, Value::Number(_));
            if is_constant(mass) && center.iter().all(is_constant) {
                continue;
            }
            let names: Vec<String> = self.robot.links.iter().map(|link| link.name.clone()).collect();
            let link = find("name", "link", link, &names).map_err(|unfit| self.unfit(&keys("name")[..2], unfit))?;
            let (mass, center) = (Some(mass.clone()), Some(center.clone()));
            overrides.push(Override::Link { link, mass, inertia_scale: None, center });
        }
        Ok(overrides)
    }

    /// The springs of inserted joints, each named after its joint; locked joints have none.
    pub(super) fn inserted_springs(&self) -> Vec<Element> {
        let springs = self.inserted.iter().flat_map(|inserted| {
            let numbers = inserted.stiffness.iter().zip(&inserted.damping);
            inserted.joints.iter().zip(numbers).filter_map(|(joint, (stiffness, damping))| {
                let dof = self.joints.iter().position(|other| other == joint)?;
                let kind = Spring::new(dof, stiffness.clone(), damping.clone()).into();
                Some((joint.clone(), kind))
            })
        });
        springs.map(|(name, kind)| Element { name, kind, coordinate: 0, constant: 0 }).collect()
    }
}
