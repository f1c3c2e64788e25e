//! Where a robot starts: at rest, at a keyframe of its file, or with a frame at a pose.

use supple_robot::{Kinematics, Pose, PoseGoal, Reach, Reached, inverse_kinematics};
use supple_text::short;

use super::Robot;
use crate::Point;
use crate::model::compliance::find;
use crate::model::{PoseFile, Start};
use crate::quantity::Unfit;

/// A pose written as in a task file, with enough digits to be reachable.
fn typed(pose: &PoseFile, found: &Pose) -> String {
    let list = |numbers: [f64; 3]| {
        // Avoids negative zero.
        let rounded = numbers.map(|number| (number * 1e6).round() / 1e6 + 0.0);
        format!("[{}]", rounded.map(|number| format!("{number:?}")).join(", "))
    };
    let turned = pose.rpy.map_or_else(String::new, |_| format!(", rpy = {}", list(found.rpy())));
    format!("`position = {}{turned}`", list(found.position))
}

impl Robot {
    /// The first state before individual states of the task are applied: positions and velocities of the degrees of
    /// freedom, and 0 for everything else.
    ///
    /// # Errors
    /// If there is no such keyframe or frame, or the frame cannot reach the pose.
    pub(super) fn first_state(&self, start: &Start) -> Result<Vec<f64>, Unfit> {
        let (dofs, positions) = self.positions();
        let mut x = vec![0.0; 2 * positions + self.constants()];
        for (dof, &joint) in self.bodies.tree.joint_indices().iter().enumerate() {
            x[dof] = self.bodies.robot.joints[joint].neutral();
        }
        if let Some(name) = start.key {
            let key = self.bodies.robot.key(name).ok_or_else(|| self.unknown_key(name))?;
            x[..dofs].copy_from_slice(&key.q(&self.bodies.tree));
            x[positions..positions + dofs].copy_from_slice(&key.v(&self.bodies.tree));
        }
        if let Some(pose) = start.pose {
            let q = self.positions_at(pose, &x[..dofs], start).map_err(|unfit| unfit.below("pose"))?;
            x[..dofs].copy_from_slice(&q);
        }
        Ok(x)
    }

    fn unknown_key(&self, name: &str) -> Unfit {
        let keys: Vec<_> = self.bodies.robot.keys.iter().map(|key| key.name.as_str()).collect();
        let message = format!("the robot's file has no keyframe `{name}`: {}", supple_text::owned(&keys));
        let help = supple_text::nearest(name, &keys).or_else(|| match keys.first() {
            Some(first) => Some(format!("write key = {first:?}")),
            None => Some("name positions of joints instead, or give a `pose`".into()),
        });
        Unfit { help, ..Unfit::new("key", message) }
    }

    /// Positions at which a frame has the given pose, searched from those given; joints whose positions the task sets
    /// are held.
    fn positions_at(&self, pose: &PoseFile, from: &[f64], start: &Start) -> Result<Vec<f64>, Unfit> {
        let names: Vec<String> = self.bodies.frame_names().into_iter().map(str::to_owned).collect();
        let frame = find("frame", "link or frame", &pose.frame, &names)?;
        let at = Point { x: &[], u: &[], phi: start.phi, time_step: 0.0, w: &[] };
        let place = self.bodies.place(frame, &at);
        if self.bodies.tree.body_of(place.link).is_none() {
            let message = format!("frame `{}` cannot move: it is fixed to the world", pose.frame);
            return Err(Unfit::new("frame", message).with_help("name a frame that a joint moves"));
        }
        let given = &start.given[..from.len()];
        let limits: Vec<_> =
            self.bodies.tree.joint_indices().iter().map(|&joint| self.bodies.robot.joints[joint].limits).collect();
        // Inserted joints have no drive: they stay where their springs are at rest.
        let free = given.iter().zip(self.bodies.tree.joints());
        let free = free.map(|(given, joint)| given.is_none() && !self.inserted.contains(joint));
        let reach = Reach {
            start: &from.iter().zip(given).map(|(from, given)| given.unwrap_or(*from)).collect::<Vec<_>>(),
            lower: &limits.iter().map(|limits| limits.lower).collect::<Vec<_>>(),
            upper: &limits.iter().map(|limits| limits.upper).collect::<Vec<_>>(),
            free: &free.collect::<Vec<_>>(),
        };
        let goal = PoseGoal {
            link: place.link,
            frame: place.pose,
            position: pose.position,
            rotation: pose.rpy.map(|rpy| Pose::from_rpy([0.0; 3], rpy).rotation),
        };
        let reached = inverse_kinematics(&self.bodies.tree, &self.bodies.numbers(&at), &goal, &reach);
        if reached.is_there() {
            return Ok(reached.q);
        }
        let kinematics = Kinematics::at_rest(&self.bodies.tree, &self.bodies.numbers(&at), &reached.q);
        let found = kinematics.poses()[place.link].compose(&place.pose);
        Err(self.out_of_reach(pose, &reached, &found))
    }

    fn out_of_reach(&self, pose: &PoseFile, reached: &Reached, found: &Pose) -> Unfit {
        let turned = pose.rpy.map_or_else(String::new, |_| format!(" and {} rad", short(reached.angle, 4)));
        let limited: Vec<_> = reached.at_limits.iter().map(|&dof| &self.bodies.tree.joints()[dof]).collect();
        let at_limits = match limited.len() {
            0 => "no joint at a limit".to_owned(),
            1 => format!("joint {} at its limit", supple_text::quoted(&limited)),
            _ => format!("joints {} at their limits", supple_text::quoted(&limited)),
        };
        let message = format!(
            "frame `{}` cannot reach this pose; the closest pose found is {} m{turned} away, with {at_limits}: {}",
            pose.frame,
            short(reached.distance, 5),
            typed(pose, found),
        );
        let in_degrees = pose.rpy.and_then(|rpy| rpy.into_iter().find_map(supple_text::degrees));
        let help = in_degrees.unwrap_or_else(|| match pose.rpy {
            Some(_) => "move the pose closer, or omit `rpy` if the orientation is free".into(),
            None => "move the position nearer to the robot".into(),
        });
        Unfit::here(message).with_help(help)
    }

    /// Pairs of states, of a motor and of its joint: the motor's defaults to the joint's if the task does not set
    /// it.
    pub(super) fn motor_states(&self) -> Vec<(usize, usize)> {
        let (dofs, positions) = self.positions();
        let motors = self.compliance.iter().flat_map(|element| {
            let joint = (0..dofs).find(|&dof| element.kind.is_motor_of(dof));
            joint.map(|dof| (dofs + element.coordinate, dof))
        });
        motors.flat_map(|(motor, dof)| [(motor, dof), (positions + motor, positions + dof)]).collect()
    }
}
