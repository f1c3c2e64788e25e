//! The physical numbers of a robot, any of which may be a design parameter.

use supple_kernels::Scalar;

use crate::pose::constants;
use crate::{Inertia, Joint, Link, Pose, Robot};

/// The physical numbers of a robot over any scalar; SI units and radians throughout.
///
/// They are those of the file unless a model overrides some by parameters.
///
/// Example: the [front page](crate).
#[derive(Clone, Debug, PartialEq)]
pub struct Numbers<S> {
    /// By link of the robot.
    pub links: Vec<LinkNumbers<S>>,
    /// By joint of the robot.
    pub joints: Vec<JointNumbers<S>>,
    /// Gravitational acceleration in the world, m/s^2.
    pub gravity: [S; 3],
}

/// The inertia of a link; zero where it has none.
///
/// Example: [`check_inertia`](crate::check_inertia).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinkNumbers<S> {
    /// Mass, kg.
    pub mass: S,
    /// Centre of mass in the link's frame, m.
    pub center: [S; 3],
    /// Moments of inertia about the centre of mass in the link's axes, kg m^2. Only `moment[i][j]` with `i <= j` is
    /// read: the matrix is symmetric.
    pub moment: [[S; 3]; 3],
}

/// The numbers of a joint, without its axis, which belongs to the [`Tree`](crate::Tree).
///
/// Example: [`passive_forces`](crate::passive_forces).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointNumbers<S> {
    /// The joint's frame in the parent link.
    pub origin: Pose<S>,
    /// The child link in the joint's moved frame.
    pub child_pose: Pose<S>,
    /// Viscous damping, N m s/rad or N s/m.
    pub damping: S,
    /// Coulomb friction, N m or N.
    pub friction: S,
    /// Inertia of the drive, reflected to the joint, kg m^2 or kg.
    pub armature: S,
    /// Stiffness of a spring in the joint, N m/rad or N/m.
    pub stiffness: S,
    /// Position at which that spring is at rest, rad or m.
    pub rest: S,
}

impl<S: Scalar> Numbers<S> {
    /// The numbers of a robot's file, under the given gravity, m/s^2 in the world.
    pub fn of(robot: &Robot, gravity: [f64; 3]) -> Self {
        Self {
            links: robot.links.iter().map(LinkNumbers::of).collect(),
            joints: robot.joints.iter().map(JointNumbers::of).collect(),
            gravity: constants(gravity),
        }
    }
}

impl<S: Scalar> LinkNumbers<S> {
    fn of(link: &Link) -> Self {
        let none = Inertia { mass: 0.0, center: [0.0; 3], moment: [[0.0; 3]; 3] };
        let Inertia { mass, center, moment } = link.inertia.unwrap_or(none);
        Self { mass: S::constant(mass), center: constants(center), moment: moment.map(constants) }
    }
}

impl<S: Scalar> JointNumbers<S> {
    fn of(joint: &Joint) -> Self {
        Self {
            origin: joint.origin.cast(),
            child_pose: joint.child_pose.cast(),
            damping: S::constant(joint.damping),
            friction: S::constant(joint.friction),
            armature: S::constant(joint.armature),
            stiffness: S::constant(joint.stiffness),
            rest: S::constant(joint.rest),
        }
    }
}
