//! The robot of a task as a robot file would describe it.

use supple_robot::{Frame, Inertia};

use super::Robot;
use crate::Point;

impl Robot {
    /// The robot at parameters `phi`, with everything that a robot file can express: numbers that the task overrides,
    /// position and velocity drives, inserted joints, locked joints, frames of the task, gravity, and springs beside
    /// joints. Anything else that the task adds is listed in [`omitted`](supple_robot::Robot::omitted).
    #[must_use]
    pub fn described(&self, phi: &[f64]) -> supple_robot::Robot {
        let at = Point { x: &[], u: &[], phi, time_step: 0.0, w: &[] };
        let numbers = self.bodies.numbers(&at);
        let mut robot = (*self.bodies.robot).clone();
        robot.gravity = Some(numbers.gravity);
        for (link, numbers) in robot.links.iter_mut().zip(&numbers.links) {
            if link.inertia.is_some() || numbers.mass != 0.0 {
                link.inertia = Some(Inertia { mass: numbers.mass, center: numbers.center, moment: numbers.moment });
            }
        }
        for (joint, numbers) in robot.joints.iter_mut().zip(&numbers.joints) {
            (joint.origin, joint.child_pose) = (numbers.origin, numbers.child_pose);
            (joint.damping, joint.friction, joint.armature) = (numbers.damping, numbers.friction, numbers.armature);
            (joint.stiffness, joint.rest) = (numbers.stiffness, numbers.rest);
        }
        for (drive, rotor) in self.drives.iter().zip(self.rotors(&at)) {
            if drive.motor.is_none() {
                robot.joints[self.bodies.tree.joint_indices()[drive.dof]].armature += rotor.1;
            }
        }
        for drive in &self.drives {
            if let Some(servo) = &drive.actuator {
                let actuator = &mut robot.actuators[servo.index];
                (actuator.gear, actuator.law) = (at.value(&drive.gear), servo.law(&at));
            }
        }
        let own = self.bodies.robot.links.len() + self.bodies.robot.frames.len();
        for (place, frame) in self.bodies.frames.iter().enumerate() {
            let found = self.bodies.place(own + place, &at);
            robot.frames.push(Frame { name: frame.name.clone(), link: found.link, pose: found.pose });
        }
        for element in &self.compliance {
            match element.kind.beside_joint() {
                Some(spring) => {
                    let [stiffness, rest, damping] =
                        [&spring.stiffness, &spring.rest, &spring.damping].map(|value| at.value(value));
                    let joint = &mut robot.joints[self.bodies.tree.joint_indices()[spring.dof]];
                    let sum = joint.stiffness + stiffness;
                    if sum > 0.0 {
                        joint.rest = (joint.stiffness * joint.rest + stiffness * rest) / sum;
                    }
                    joint.stiffness = sum;
                    joint.damping += damping;
                }
                None => robot.omitted.push(supple_robot::Omitted {
                    what: "compliance",
                    name: element.name.clone(),
                    why: "robot files cannot describe this kind".to_owned(),
                    line: 0,
                }),
            }
        }
        robot
    }
}
