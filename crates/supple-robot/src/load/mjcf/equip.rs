//! Converts equipment from indices and names in the file to those of the robot.

use std::collections::HashMap;

use super::reader::{Reader, SensorPart, Target};
use crate::{Actuator, Key, Kinematics, Law, Numbers, Omitted, Robot, Sensor, Tree, Wall, mass_matrix, solve};

/// The equipment of a file, while joints are indexed as in the file.
pub(super) struct Equipment {
    actuators: Vec<Actuator>,
    /// Damping ratios by the index of the actuator.
    ratios: HashMap<usize, f64>,
    sensors: Vec<SensorPart>,
    keys: Vec<Key>,
    walls: Vec<Wall>,
    omitted: Vec<Omitted>,
    /// Names of the joints in the order of the file.
    joints: Vec<String>,
}

impl Reader<'_, '_> {
    /// Takes the equipment out of the parts that were read.
    pub(super) fn equipment(&mut self) -> Equipment {
        Equipment {
            actuators: std::mem::take(&mut self.actuators.kept),
            ratios: std::mem::take(&mut self.actuators.ratios),
            sensors: std::mem::take(&mut self.sensors),
            keys: std::mem::take(&mut self.keys),
            walls: std::mem::take(&mut self.walls),
            omitted: std::mem::take(&mut self.omitted),
            joints: self.parts.joints.iter().map(|joint| joint.own.name.clone()).collect(),
        }
    }
}

/// The inertia against which an effort at each joint alone acts at the reference positions, kg m^2 or kg, as MuJoCo has it:
/// followers are joints like others, and all are free. 0 for fixed joints, and where nothing has inertia.
fn inertia_at_reference(robot: &Robot) -> Vec<f64> {
    let mut free = robot.clone();
    free.joints.iter_mut().for_each(|joint| joint.mimic = None);
    let (tree, numbers) = (Tree::new(&free), Numbers::of(&free, [0.0; 3]));
    let joints = tree.joint_indices();
    let positions: Vec<f64> = joints.iter().map(|&joint| free.joints[joint].reference).collect();
    let mass = mass_matrix(&tree, &numbers, &Kinematics::at_rest(&tree, &numbers, &positions));
    let mut inertia = vec![0.0; robot.joints.len()];
    for (dof, &joint) in joints.iter().enumerate() {
        let mut effort = vec![0.0; joints.len()];
        effort[dof] = 1.0;
        let against = 1.0 / solve(mass.clone(), &effort)[dof];
        inertia[joint] = if against.is_finite() { against.max(0.0) } else { 0.0 };
    }
    inertia
}

impl Equipment {
    /// Adds it to the assembled robot. References to things that the robot lacks are dropped.
    pub(super) fn add_to(self, robot: &mut Robot) {
        let by_name: HashMap<_, _> =
            robot.joints.iter().enumerate().map(|(i, joint)| (joint.name.as_str(), i)).collect();
        let places: Vec<_> = self.joints.iter().map(|name| by_name.get(name.as_str()).copied()).collect();
        let place = |joint: usize| places.get(joint).copied().flatten();
        let inertia = if self.ratios.is_empty() { Vec::new() } else { inertia_at_reference(robot) };
        let ratios = &self.ratios;
        let actuators = self.actuators.into_iter().enumerate().filter_map(|(index, part)| {
            let joint = place(part.joint)?;
            let damped = |kp: f64| {
                let ratio = ratios.get(&index)?;
                Some(2.0 * ratio * (kp * inertia[joint]).sqrt() / part.gear.abs())
            };
            let law = match part.law {
                Law::Position { kp, kv } => Law::Position { kp, kv: damped(kp).unwrap_or(kv) },
                Law::Affine { gain, offset, kp, kv } => Law::Affine { gain, offset, kp, kv: damped(kp).unwrap_or(kv) },
                law => law,
            };
            Some(Actuator { joint, law, ..part })
        });
        let actuators = actuators.collect();

        let links: HashMap<_, _> = robot.links.iter().enumerate().map(|(i, link)| (link.name.as_str(), i)).collect();
        let frames = robot.frames.iter().enumerate().map(|(i, frame)| (frame.name.as_str(), robot.links.len() + i));
        let frames: HashMap<_, _> = frames.collect();
        let sensors = self.sensors.into_iter().filter_map(|SensorPart { name, target, noise, line }| {
            let measures = match target {
                Target::Joint(joint, of) => of(place(joint)?),
                Target::Body(body, of) => of(*links.get(body.as_str())?),
                Target::Site(site, of) => of(*frames.get(site.as_str())?),
            };
            Some(Sensor { name, measures, noise, line })
        });
        let sensors = sensors.collect();

        let sorted = |numbers: &[f64]| {
            let mut sorted = vec![0.0; robot.joints.len()];
            for (number, place) in numbers.iter().zip(&places) {
                if let Some(entry) = place.and_then(|place| sorted.get_mut(place)) {
                    *entry = *number;
                }
            }
            sorted
        };
        let keys = self.keys.into_iter();
        let keys = keys
            .map(|key| Key { positions: sorted(&key.positions), velocities: sorted(&key.velocities), ..key })
            .collect();
        (robot.actuators, robot.sensors, robot.keys) = (actuators, sensors, keys);
        (robot.walls, robot.omitted) = (self.walls, self.omitted);
    }
}
