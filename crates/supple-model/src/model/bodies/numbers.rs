use supple_kernels::Scalar;
use supple_robot::vector::{add, scale};
use supple_robot::{Numbers, Pose};

use super::Bodies;
use super::overrides::Override;
use crate::{Point, Value};

/// The link that a frame is fixed to, and the frame's pose in that link.
#[derive(Clone, Copy, Debug)]
pub struct Place<S> {
    pub link: usize,
    pub pose: Pose<S>,
}

/// Three values evaluated at a point.
fn vector<S: Scalar>(at: &Point<S>, values: &[Value; 3]) -> [S; 3] {
    values.each_ref().map(|value| at.value(value))
}

impl Bodies {
    /// All numbers of the robot, evaluated at a point.
    pub fn numbers<S: Scalar>(&self, at: &Point<S>) -> Numbers<S> {
        let mut numbers = Numbers::of(&self.robot, [0.0; 3]);
        numbers.gravity = vector(at, &self.gravity);
        for change in &self.overrides {
            change.apply(at, &mut numbers);
        }
        numbers
    }

    /// Names of all frames, in the order of their numbers: links, other frames of the file, frames of the task.
    pub fn frame_names(&self) -> Vec<&str> {
        let links = self.robot.links.iter().map(|link| link.name.as_str());
        let others = self.robot.frames.iter().map(|frame| frame.name.as_str());
        links.chain(others).chain(self.frames.iter().map(|frame| frame.name.as_str())).collect()
    }

    /// The link that the frame with this number is on.
    pub fn link_of(&self, frame: usize) -> usize {
        let (links, others) = (self.robot.links.len(), self.robot.frames.len());
        match frame.checked_sub(links) {
            None => frame,
            Some(other) if other < others => self.robot.frames[other].link,
            Some(own) => self.link_of(self.frames[own - others].on),
        }
    }

    /// The link and pose of the frame with this number.
    pub fn place<S: Scalar>(&self, frame: usize, at: &Point<S>) -> Place<S> {
        let (links, others) = (self.robot.links.len(), self.robot.frames.len());
        if frame < links {
            return Place { link: frame, pose: Pose::identity() };
        }
        if frame < links + others {
            let frame = &self.robot.frames[frame - links];
            return Place { link: frame.link, pose: frame.pose.cast() };
        }
        let own = &self.frames[frame - links - others];
        let outer = self.place(own.on, at);
        let inner = turned(vector(at, &own.rpy), vector(at, &own.position));
        Place { link: outer.link, pose: outer.pose.compose(&inner) }
    }
}

/// The pose at `position`, rotated by roll, pitch and yaw.
fn turned<S: Scalar>(rpy: [S; 3], position: [S; 3]) -> Pose<S> {
    let [(sr, cr), (sp, cp), (sy, cy)] = rpy.map(Scalar::sin_cos);
    let rotation = [
        [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
        [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
        [-sp, cp * sr, cp * cr],
    ];
    Pose { rotation, position }
}

impl Override {
    fn apply<S: Scalar>(&self, at: &Point<S>, numbers: &mut Numbers<S>) {
        let set = |to: &mut S, value: &Option<Value>| {
            if let Some(value) = value {
                *to = at.value(value);
            }
        };
        match self {
            Self::Link { link, mass, inertia_scale, center } => {
                let numbers = &mut numbers.links[*link];
                set(&mut numbers.mass, mass);
                if let Some(center) = center {
                    numbers.center = vector(at, center);
                }
                if let Some(factor) = inertia_scale {
                    numbers.moment = numbers.moment.map(|row| scale(at.value(factor), row));
                }
            }
            Self::Joint { joint, damping, friction, armature, stiffness, rest, offset, length_scale } => {
                let numbers = &mut numbers.joints[*joint];
                set(&mut numbers.damping, damping);
                set(&mut numbers.friction, friction);
                set(&mut numbers.armature, armature);
                set(&mut numbers.stiffness, stiffness);
                set(&mut numbers.rest, rest);
                let position = &mut numbers.origin.position;
                if let Some(factor) = length_scale {
                    *position = scale(at.value(factor), *position);
                }
                if let Some(offset) = offset {
                    *position = add(*position, vector(at, offset));
                }
            }
        }
    }
}

/// A smoothing length widened by `by`: `sqrt(smoothing^2 + by^2)` (theory, equation P.3c).
pub fn widened<S: Scalar>(at: &Point<S>, smoothing: S, by: &Value) -> S {
    smoothing.mul_add(smoothing, at.value(by).square()).sqrt()
}
