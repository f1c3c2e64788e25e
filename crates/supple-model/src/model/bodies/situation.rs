use supple_kernels::Scalar;
use supple_robot::vector::{add, cross};
use supple_robot::{Kinematics, LinkWrench, Numbers, Pose, Resisted, Twist, Wrench, point_jacobian};

use super::Bodies;
use super::numbers::Place;
use crate::{Point, Value};

/// The positions and velocities of a robot at one point.
pub struct Situation<'a, S> {
    pub bodies: &'a Bodies,
    pub at: &'a Point<'a, S>,
    pub numbers: Numbers<S>,
    pub kinematics: Kinematics<S>,
    ahead: Option<Ahead<S>>,
    /// Whether forces that are not linear in the rates are left out.
    is_linear: bool,
}

/// The end of an implicit step, at which resistive forces are evaluated.
struct Ahead<S> {
    /// Rates of all positions.
    rates: Vec<S>,
    /// The bodies at these rates; `None` if no element of compliance needs them.
    kinematics: Option<Kinematics<S>>,
    /// The step, s.
    lead: S,
}

/// Positions and velocities of everything, with the indices of one compliance element's own coordinates and constants.
///
/// Example: the [module](crate::model::coupling).
pub struct Own<'a, S> {
    now: &'a Situation<'a, S>,
    /// Index of the element's first coordinate among those that compliance adds.
    coordinate: usize,
    /// Index of its first constant.
    constant: usize,
}

/// Total forces of drives, compliance and joints.
///
/// Example: the [module](crate::model::coupling).
#[derive(Debug)]
pub struct Forces<S> {
    /// Generalised forces on the degrees of freedom and on the coordinates that compliance adds, N m or N.
    pub(in crate::model) generalised: Vec<S>,
    /// Wrenches on links, by link, about the link's origin in its axes.
    pub(in crate::model) wrenches: Vec<LinkWrench<S>>,
}

impl<S: Scalar> Forces<S> {
    /// Adds a generalised force on a position of a degree of freedom or of compliance, N m or N.
    pub fn on_position(&mut self, place: usize, effort: S) {
        self.generalised[place] += effort;
    }

    /// Adds a wrench on the link that a frame is fixed to, about the frame's origin in its axes, N m and N.
    pub fn on_frame(&mut self, own: &Own<S>, frame: usize, wrench: Wrench<S>) {
        let place = own.now.bodies.place(frame, own.now.at);
        let force = place.pose.rotate(wrench.force);
        let torque = add(place.pose.rotate(wrench.torque), cross(place.pose.position, force));
        self.wrenches.push(LinkWrench { link: place.link, wrench: Wrench { torque, force } });
    }
}

impl<'a, S: Scalar> Situation<'a, S> {
    pub fn of(bodies: &'a Bodies, at: &'a Point<'a, S>) -> Self {
        let numbers = bodies.numbers(at);
        let (dofs, positions) = bodies.positions();
        let (q, v) = (&at.x[..dofs], &at.x[positions..positions + dofs]);
        let kinematics = Kinematics::of(&bodies.tree, &numbers, q, v);
        Self { bodies, at, numbers, kinematics, ahead: None, is_linear: false }
    }

    /// The same situation, with resistive forces evaluated a time `lead` ahead, s, in a step with accelerations `a`;
    /// `with_bodies` states whether any of them needs the rates of frames there.
    pub fn ahead(mut self, lead: S, a: &[S], with_bodies: bool) -> Self {
        let rates: Vec<S> = self.velocities().iter().zip(a).map(|(&v, &a)| lead.mul_add(a, v)).collect();
        let dofs = self.bodies.positions().0;
        let kinematics = with_bodies.then(|| self.kinematics.moving(&self.bodies.tree, &rates[..dofs]));
        self.ahead = Some(Ahead { rates, kinematics, lead });
        self
    }

    /// The same situation without forces that are not linear in the rates: dry friction and the push of contacts.
    pub fn linear(mut self) -> Self {
        self.numbers.joints.iter_mut().for_each(|joint| joint.friction = S::zero());
        Self { is_linear: true, ..self }
    }

    /// Positions of the degrees of freedom.
    pub fn q(&self) -> &[S] {
        &self.at.x[..self.bodies.positions().0]
    }

    /// All positions: of the degrees of freedom and of the coordinates that compliance adds.
    pub fn positions(&self) -> &[S] {
        &self.at.x[..self.bodies.positions().1]
    }

    /// Their velocities.
    pub fn velocities(&self) -> &[S] {
        let (_, positions) = self.bodies.positions();
        &self.at.x[positions..2 * positions]
    }

    /// The rates at which resistive forces are evaluated: the velocities, or those at the end of an implicit step.
    pub fn rates(&self) -> &[S] {
        self.ahead.as_ref().map_or(self.velocities(), |ahead| &ahead.rates)
    }

    /// How far ahead resistive forces evaluate positions, s.
    pub fn lead(&self) -> S {
        self.ahead.as_ref().map_or(S::zero(), |ahead| ahead.lead)
    }

    /// Rates and lead for [passive forces](supple_robot::passive_forces) in joints.
    pub fn resisted(&self) -> Resisted<'_, S> {
        Resisted { rates: &self.rates()[..self.bodies.positions().0], lead: self.lead() }
    }

    /// The situation for the compliance element whose first coordinate and first constant have these indices.
    pub fn seen_from(&'a self, coordinate: usize, constant: usize) -> Own<'a, S> {
        Own { now: self, coordinate, constant }
    }

    /// The frame with this number, in the world.
    pub fn pose(&self, frame: usize) -> Pose<S> {
        let place = self.bodies.place(frame, self.at);
        self.kinematics.poses()[place.link].compose(&place.pose)
    }

    /// The link a frame is fixed to, its pose in the world, and its velocity in its own axes.
    pub fn frame(&self, frame: usize) -> (Place<S>, Pose<S>, Twist<S>) {
        let place = self.bodies.place(frame, self.at);
        let pose = self.kinematics.poses()[place.link].compose(&place.pose);
        let own = in_frame(&self.kinematics, &place);
        (place, pose, own)
    }

    /// The velocity of a frame in its own axes at the [rates](Self::rates) used for resistive forces.
    pub fn frame_rates(&self, frame: usize) -> Twist<S> {
        let kinematics = self.ahead.as_ref().and_then(|ahead| ahead.kinematics.as_ref());
        in_frame(kinematics.unwrap_or(&self.kinematics), &self.bodies.place(frame, self.at))
    }

    /// The motion of a world point fixed to the link of a frame, in world axes, per unit velocity of each degree of
    /// freedom.
    pub fn point_motions(&self, frame: usize, point: [S; 3]) -> Vec<Twist<S>> {
        let link = self.bodies.place(frame, self.at).link;
        let rows = point_jacobian(&self.bodies.tree, &self.kinematics, link, point);
        let motion = |dof: usize| {
            let [a, b, c, x, y, z] = [0, 1, 2, 3, 4, 5].map(|row: usize| rows[row][dof]);
            Twist { angular: [a, b, c], linear: [x, y, z] }
        };
        (0..self.bodies.positions().0).map(motion).collect()
    }
}

/// The velocity of a frame in its own axes.
fn in_frame<S: Scalar>(kinematics: &Kinematics<S>, place: &Place<S>) -> Twist<S> {
    let twist = kinematics.velocity(place.link);
    Twist { angular: place.pose.unrotate(twist.angular), linear: place.pose.unrotate(twist.at(place.pose.position)) }
}

impl Situation<'_, f64> {
    /// The location of a degree of freedom's joint on its parent side, that on its child side, and its axis,
    /// all in the world.
    pub fn joint(&self, dof: usize) -> ([f64; 3], [f64; 3], [f64; 3]) {
        let index = self.bodies.tree.joint_indices()[dof];
        let (joint, numbers) = (&self.bodies.robot.joints[index], &self.numbers.joints[index]);
        let poses = self.kinematics.poses();
        let moved = poses[index + 1].compose(&numbers.child_pose.inverse());
        let still = poses[joint.parent].compose(&numbers.origin);
        (still.position, moved.position, moved.rotate(joint.axis))
    }
}

impl<S: Scalar> Own<'_, S> {
    /// State, control and parameters.
    #[must_use]
    pub fn at(&self) -> &Point<'_, S> {
        self.now.at
    }

    /// A value of the task file at these parameters.
    #[must_use]
    pub fn value(&self, value: &Value) -> S {
        self.now.at.value(value)
    }

    /// All positions, rad or m: of the degrees of freedom, then of the coordinates that compliance adds.
    #[must_use]
    pub fn positions(&self) -> &[S] {
        self.now.positions()
    }

    /// The rates of all positions at which resistive forces are evaluated: the velocities, or those at the end of
    /// an implicit step.
    #[must_use]
    pub fn rates(&self) -> &[S] {
        self.now.rates()
    }

    /// How far ahead resistive forces evaluate positions, s: a spring's force is evaluated at `x + lead x'`.
    #[must_use]
    pub fn lead(&self) -> S {
        self.now.lead()
    }

    /// Whether its forces are those that are linear in the [rates](Self::rates) alone, without dry friction and the push of
    /// contacts, for which an implicit step solves.
    #[must_use]
    pub fn is_linear(&self) -> bool {
        self.now.is_linear
    }

    /// The frame with this number, in the world.
    #[must_use]
    pub fn pose(&self, frame: usize) -> Pose<S> {
        self.now.pose(frame)
    }

    /// The velocity of a frame in its own axes.
    #[must_use]
    pub fn velocity(&self, frame: usize) -> Twist<S> {
        self.now.frame(frame).2
    }

    /// The velocity of a frame in its own axes at the [rates](Self::rates) used for resistive forces.
    #[must_use]
    pub fn frame_rates(&self, frame: usize) -> Twist<S> {
        self.now.frame_rates(frame)
    }

    /// The motion of a world point fixed to the link of a frame, in world axes, per unit velocity of each degree of
    /// freedom.
    pub fn point_motions(&self, frame: usize, point: [S; 3]) -> Vec<Twist<S>> {
        self.now.point_motions(frame, point)
    }

    /// Index, among all positions, of the first coordinate that the element adds.
    #[must_use]
    pub fn place(&self) -> usize {
        self.now.bodies.positions().0 + self.coordinate
    }

    /// The first constant that the element adds.
    #[must_use]
    pub fn constant(&self) -> S {
        self.now.at.x[2 * self.now.bodies.positions().1 + self.constant]
    }
}

impl Own<'_, f64> {
    /// The location of a degree of freedom's joint on its parent side, that on its child side, and its axis,
    /// all in the world.
    pub(in crate::model) fn joint(&self, dof: usize) -> ([f64; 3], [f64; 3], [f64; 3]) {
        self.now.joint(dof)
    }

    /// Whether a degree of freedom is prismatic.
    pub(in crate::model) fn slides(&self, dof: usize) -> bool {
        self.now.bodies.slides(dof)
    }
}
