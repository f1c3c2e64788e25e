//! Where bodies and links are and how they move.

use supple_kernels::Scalar;

use super::bodies::Bodies;
use super::inertia::Acceleration;
use super::step::Step;
use crate::pose::{add, cross, sub};
use crate::tree::{Body, Motion};
use crate::{Numbers, Pose, Tree};

/// Poses and velocities of the links at one position and velocity of a robot: computed once, and used by all
/// the algorithms.
///
/// Example: the [front page](crate).
#[derive(Clone, Debug)]
pub struct Kinematics<S> {
    pub(crate) bodies: Bodies<S>,
    pub(crate) moved: Vec<Moved<S>>,
    links: Vec<Pose<S>>,
    of_link: Vec<Option<usize>>,
}

/// Velocity of a frame.
///
/// Example: [`frame_jacobian`](crate::frame_jacobian).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Twist<S> {
    /// Angular velocity, rad/s.
    pub angular: [S; 3],
    /// Velocity of the frame's origin, m/s.
    pub linear: [S; 3],
}

/// A body and its motion, in the body's axes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Moved<S> {
    /// Transform from its parent body.
    pub step: Step<S>,
    /// In the world.
    pub pose: Pose<S>,
    /// Velocity of its joint, rad/s or m/s.
    pub rate: S,
    /// Velocity of the body.
    pub twist: Twist<S>,
}

impl<S: Scalar> Twist<S> {
    /// At rest.
    #[must_use]
    pub fn zero() -> Self {
        Self { angular: [S::zero(); 3], linear: [S::zero(); 3] }
    }

    /// Velocity of the frame's point `p`, in its axes, m/s.
    pub fn at(&self, p: [S; 3]) -> [S; 3] {
        add(self.linear, cross(self.angular, p))
    }
}

impl<S: Scalar> Kinematics<S> {
    /// The kinematics at positions `q`, rad or m, and velocities `v`, rad/s or m/s, of the degrees of freedom.
    ///
    /// # Panics
    /// If `q` or `v` does not have one entry per degree of freedom, or `numbers` belongs to another robot.
    pub fn of(tree: &Tree, numbers: &Numbers<S>, q: &[S], v: &[S]) -> Self {
        assert_eq!((q.len(), v.len()), (tree.dofs(), tree.dofs()), "positions and velocities of other dofs");
        let bodies = Bodies::of(tree, numbers);
        let mut moved: Vec<Moved<S>> = Vec::with_capacity(tree.bodies().len());
        for (body, fixed) in tree.bodies().iter().zip(&bodies.joints) {
            let step = Step::new(body, *fixed, q[body.dof] * body.ratio + body.offset);
            let (pose, twist) = body
                .parent
                .map_or((Pose::identity(), Twist::zero()), |parent| (moved[parent].pose, moved[parent].twist));
            let rate = v[body.dof] * body.ratio;
            moved.push(Moved { step, pose: step.compose(&pose), rate, twist: carried(body, &step, &twist, rate) });
        }
        let of_link: Vec<_> = tree.places().iter().map(|place| place.body).collect();
        let links = of_link.iter().zip(&bodies.links);
        let links = links.map(|(body, place)| body.map_or(*place, |body| moved[body].pose.compose(place))).collect();
        Self { bodies, moved, links, of_link }
    }

    /// The kinematics at positions `q`, rad or m, of the degrees of freedom, with all velocities 0.
    ///
    /// # Panics
    /// As [`Kinematics::of`].
    pub fn at_rest(tree: &Tree, numbers: &Numbers<S>, q: &[S]) -> Self {
        Self::of(tree, numbers, q, &vec![S::zero(); q.len()])
    }

    /// The same positions with other velocities `v`, rad/s or m/s, of the degrees of freedom.
    ///
    /// # Panics
    /// Where `v` has not one entry by degree of freedom.
    #[must_use]
    pub fn moving(&self, tree: &Tree, v: &[S]) -> Self {
        assert_eq!(v.len(), tree.dofs(), "wrong number of velocities");
        let mut other = self.clone();
        for (index, body) in tree.bodies().iter().enumerate() {
            let carrier = body.parent.map_or(Twist::zero(), |parent| other.moved[parent].twist);
            let moved = &mut other.moved[index];
            moved.rate = v[body.dof] * body.ratio;
            moved.twist = carried(body, &moved.step, &carrier, moved.rate);
        }
        other
    }

    /// The pose of each link of the robot in the world.
    #[must_use]
    pub fn poses(&self) -> &[Pose<S>] {
        &self.links
    }

    /// The velocity of a link relative to the world, in the link's own axes; zero if it belongs to the world.
    ///
    /// # Panics
    /// Where there is no such link.
    #[must_use]
    pub fn velocity(&self, link: usize) -> Twist<S> {
        let Some(body) = self.of_link[link] else { return Twist::zero() };
        let (place, twist) = (&self.bodies.links[link], &self.moved[body].twist);
        Twist { angular: place.unrotate(twist.angular), linear: place.unrotate(twist.at(place.position)) }
    }
}

/// The velocity of a body that moves at `rate` relative to its parent body, which has velocity `parent`.
fn carried<S: Scalar>(body: &Body, step: &Step<S>, parent: &Twist<S>, rate: S) -> Twist<S> {
    let mut angular = step.outward(parent.angular);
    let mut linear = step.outward(parent.at(step.origin));
    match body.motion {
        Motion::Turn => angular[2] += rate,
        Motion::Slide => linear[2] += rate,
    }
    Twist { angular, linear }
}

impl<S: Scalar> Moved<S> {
    /// The acceleration of the body, given `parent`, that of its parent body, and `joint`, that of its joint, rad/s^2
    /// or m/s^2.
    pub fn accelerated(&self, motion: Motion, parent: &Acceleration<S>, joint: S) -> Acceleration<S> {
        let mut angular = self.step.outward(parent.angular);
        let mut linear = self.step.outward(parent.at(self.step.origin));
        // w x z rate
        let [x, y, _] = self.twist.angular;
        let turning = [y * self.rate, x * self.rate];
        match motion {
            Motion::Turn => angular = [angular[0] + turning[0], angular[1] - turning[1], angular[2] + joint],
            Motion::Slide => {
                linear = [linear[0] + turning[0] * 2.0, linear[1] - turning[1] * 2.0, linear[2] + joint];
            }
        }
        Acceleration::new(linear, angular, self.twist.angular)
    }

    /// Acceleration to assign to the world to account for gravity: bodies at rest then require supporting forces.
    pub fn world(gravity: [S; 3]) -> Acceleration<S> {
        let still = [S::zero(); 3];
        Acceleration::new(sub(still, gravity), still, still)
    }
}
