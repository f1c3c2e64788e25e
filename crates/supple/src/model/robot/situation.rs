use supple_kernels::Scalar;
use supple_robot::vector::{add, cross};
use supple_robot::{Kinematics, Numbers, Pose, Twist, Wrench};

use super::Robot;
use super::compliance::Element;
use super::numbers::Place;
use crate::Point;

/// Where everything is and how it moves.
pub(super) struct Situation<'a, S> {
    pub robot: &'a Robot,
    pub at: &'a Point<'a, S>,
    pub numbers: Numbers<S>,
    pub kinematics: Kinematics<S>,
}

/// A situation as an element of compliance sees it.
pub(super) struct Own<'a, S> {
    pub now: &'a Situation<'a, S>,
    element: &'a Element,
}

/// Forces of drives, compliance and joints.
pub(super) struct Forces<S> {
    /// On the degrees of freedom and on what compliance adds, N m or N.
    pub generalised: Vec<S>,
    /// On links, about the link's origin in its axes.
    pub wrenches: Vec<(usize, Wrench<S>)>,
}

impl<S: Scalar> Forces<S> {
    /// Adds a wrench on what a frame is fixed to, given about the frame's origin in its axes.
    pub fn add(&mut self, place: &Place<S>, wrench: Wrench<S>) {
        let force = place.pose.rotate(wrench.force);
        let torque = add(place.pose.rotate(wrench.torque), cross(place.pose.position, force));
        self.wrenches.push((place.link, Wrench { torque, force }));
    }
}

impl<'a, S: Scalar> Situation<'a, S> {
    pub fn of(robot: &'a Robot, at: &'a Point<'a, S>) -> Self {
        let numbers = robot.numbers(at);
        let (dofs, positions) = robot.positions();
        let (q, v) = (&at.x[..dofs], &at.x[positions..positions + dofs]);
        let kinematics = Kinematics::of(&robot.tree, &numbers, q, v);
        Self { robot, at, numbers, kinematics }
    }

    /// Positions of the degrees of freedom.
    pub fn q(&self) -> &[S] {
        &self.at.x[..self.robot.positions().0]
    }

    /// Velocities of the degrees of freedom.
    pub fn v(&self) -> &[S] {
        let (dofs, positions) = self.robot.positions();
        &self.at.x[positions..positions + dofs]
    }

    /// The same as an element sees it.
    pub fn seen_by(&'a self, element: &'a Element) -> Own<'a, S> {
        Own { now: self, element }
    }

    /// The frame with this number, in the world.
    pub fn pose(&self, frame: usize) -> Pose<S> {
        let place = self.robot.place(frame, self.at);
        self.kinematics.poses()[place.link].compose(&place.pose)
    }

    /// Where a frame is fixed, its pose in the world, and its velocity in its own axes.
    pub fn frame(&self, frame: usize) -> (Place<S>, Pose<S>, Twist<S>) {
        let place = self.robot.place(frame, self.at);
        let pose = self.kinematics.poses()[place.link].compose(&place.pose);
        let twist = self.kinematics.velocity(place.link);
        let own = Twist {
            angular: place.pose.unrotate(twist.angular),
            linear: place.pose.unrotate(twist.at(place.pose.position)),
        };
        (place, pose, own)
    }

    /// All named frames in the world, in the order of their numbers.
    pub fn frames(&self) -> impl Iterator<Item = Pose<S>> + '_ {
        (0..self.robot.frame_names().len()).map(|frame| self.pose(frame))
    }
}

impl Situation<'_, f64> {
    /// Where the joint of a degree of freedom is, seen from what carries it, where that which it carries is, and the
    /// joint's axis; all in the world.
    pub fn joint(&self, dof: usize) -> ([f64; 3], [f64; 3], [f64; 3]) {
        let index = self.robot.tree.joint_indices()[dof];
        let (joint, numbers) = (&self.robot.robot.joints[index], &self.numbers.joints[index]);
        let poses = self.kinematics.poses();
        let moved = poses[index + 1].compose(&numbers.child_pose.inverse());
        let still = poses[joint.parent].compose(&numbers.origin);
        (still.position, moved.position, moved.rotate(joint.axis))
    }
}

impl<S: Scalar> Own<'_, S> {
    /// Positions and velocities of what the element adds, first one of each.
    pub fn motor(&self) -> (S, S) {
        let (dofs, positions) = self.now.robot.positions();
        let place = dofs + self.element.coordinate;
        (self.now.at.x[place], self.now.at.x[positions + place])
    }

    /// Place among the generalised forces of the first coordinate that the element adds.
    pub fn place(&self) -> usize {
        self.now.robot.positions().0 + self.element.coordinate
    }

    /// The first constant that the element adds.
    pub fn constant(&self) -> S {
        self.now.at.x[2 * self.now.robot.positions().1 + self.element.constant]
    }
}
