//! Signals available to sensors and costs besides states: frames, compliance, drives and the centre of mass.

use supple_kernels::Scalar;
use supple_robot::vector::{add, scale};
use supple_robot::{Kinematics, Measured, Numbers, Pose, Tree};

use super::Robot;
use crate::Point;
use crate::model::bodies::Situation;
use crate::model::compliance::Native;
use crate::physics::{CENTER_OF_MASS, EFFORT, FRAME_SIGNALS, FileSensor, POWER, Sensed, frame_signals};

impl Robot {
    /// [`FRAME_SIGNALS`] of every frame; `NAME.FORCE` and deflections of every element of compliance; [`EFFORT`] and
    /// [`POWER`] of every drive; the [`CENTER_OF_MASS`].
    pub(super) fn signal_names(&self) -> Vec<String> {
        let frames = self.bodies.frame_names().into_iter();
        let frames = frames.flat_map(|frame| FRAME_SIGNALS.iter().map(move |signal| format!("{frame}.{signal}")));
        let of_compliance = self.compliance.iter().flat_map(|element| {
            let own = element.kind.signals().into_iter().chain(element.kind.deflections());
            own.map(|signal| format!("{}.{signal}", element.name))
        });
        let of_drives = self.drives.iter().flat_map(|drive| {
            let name = self.described_drive(drive).channel.name;
            [EFFORT, POWER].map(|signal| format!("{signal}{name}"))
        });
        frames.chain(of_compliance).chain(of_drives).chain(CENTER_OF_MASS.map(str::to_owned)).collect()
    }

    /// The signals, in the order of their names.
    pub(super) fn signal_values<S: Native>(&self, at: &Point<S>) -> Vec<S> {
        let now = Situation::of(&self.bodies, at);
        let mut values = Vec::new();
        for frame in 0..self.bodies.frame_names().len() {
            let (_, pose, twist) = now.frame(frame);
            values.extend(pose.position);
            values.extend(pose.rotation.concat());
            values.extend(pose.rotate(twist.linear));
            values.extend(pose.rotate(twist.angular));
        }
        for element in &self.compliance {
            let own = element.own(&now);
            values.extend(element.kind.over::<S>().measure(&own));
            values.extend(element.kind.over::<S>().deflect(&own));
        }
        let (_, positions) = self.positions();
        for (drive, &u) in self.drives.iter().zip(at.u) {
            let place = self.driven(drive);
            let rate = at.x[positions + place];
            let effort = drive.force(at, u, at.x[place], rate);
            values.extend([effort, effort * rate]);
        }
        values.extend(center_of_mass(&now));
        values
    }

    /// Replaces the signals of drives that act at the end of a step by their values there, where the state is `next`.
    pub(super) fn move_drives_to_end<S: Scalar>(&self, at: &Point<S>, next: &[S], signals: &mut [S]) {
        let (_, positions) = self.positions();
        let first = signals.len() - CENTER_OF_MASS.len() - 2 * self.drives.len();
        for ((drive, &u), own) in self.drives.iter().zip(at.u).zip(signals[first..].as_chunks_mut().0) {
            if self.acts_at_end(drive) {
                let place = self.driven(drive);
                let rate = next[positions + place];
                let effort = drive.force(at, u, next[place], rate);
                *own = [effort, effort * rate];
            }
        }
    }

    /// Elastic joints, and the elements that make them elastic.
    pub(super) fn elastic_joints(&self) -> Vec<(String, String)> {
        let elements = |dof: usize| self.compliance.iter().filter(move |element| element.kind.is_motor_of(dof));
        let joints = self.bodies.tree.joints().iter().enumerate();
        joints.flat_map(|(dof, joint)| elements(dof).map(|element| (joint.clone(), element.name.clone()))).collect()
    }

    /// Sensors of the robot's file.
    pub(super) fn sensors_of_file(&self) -> Vec<FileSensor> {
        let joint = |index: usize| self.bodies.robot.joints[index].name.clone();
        let supported = self.bodies.robot.sensors.iter().map(|sensor| {
            let measures = match sensor.measures {
                Measured::JointPosition(index) => Sensed::JointPosition(joint(index)),
                Measured::JointVelocity(index) => Sensed::JointVelocity(joint(index)),
                Measured::JointTorque(index) => Sensed::JointTorque(joint(index)),
                Measured::FramePosition(frame) => Sensed::FramePosition { first: frame_signals(frame) },
                Measured::FrameOrientation(frame) => {
                    let reference = self.at_reference(frame).rotation;
                    Sensed::FrameOrientation { first: frame_signals(frame), reference }
                }
            };
            FileSensor { name: sensor.name.clone(), measures }
        });
        let others =
            self.bodies.robot.omitted.iter().filter(|omitted| omitted.what == "sensor").map(|omitted| FileSensor {
                name: omitted.name.clone(),
                measures: Sensed::Nothing { line: omitted.line, why: omitted.why.clone() },
            });
        supported.chain(others).collect()
    }

    /// The pose of the frame with this number when all joints are at their references, the file's initial state.
    fn at_reference(&self, frame: usize) -> Pose {
        let (robot, tree): (_, &Tree) = (&*self.bodies.robot, &self.bodies.tree);
        let q: Vec<f64> = tree.joint_indices().iter().map(|&joint| robot.joints[joint].reference).collect();
        let kinematics = Kinematics::of(tree, &Numbers::of(robot, [0.0; 3]), &q, &vec![0.0; q.len()]);
        let (link, pose) = match frame.checked_sub(robot.links.len()) {
            None => (frame, Pose::IDENTITY),
            Some(other) => (robot.frames[other].link, robot.frames[other].pose),
        };
        kinematics.poses()[link].compose(&pose)
    }
}

/// The centre of mass of all links in the world, m.
fn center_of_mass<S: Scalar>(now: &Situation<S>) -> [S; 3] {
    let (mut mass, mut moment) = (S::zero(), [S::zero(); 3]);
    for (link, pose) in now.numbers.links.iter().zip(now.kinematics.poses()) {
        mass += link.mass;
        moment = add(moment, scale(link.mass, pose.apply(link.center)));
    }
    scale(mass.recip(), moment)
}
