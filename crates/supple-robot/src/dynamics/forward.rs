//! Accelerations from forces: by the mass matrix, or by the articulated body algorithm.

use supple_kernels::Scalar;

use super::articulated::Articulated;
use super::external::on_bodies;
use super::inertia::Acceleration;
use super::inverse::along;
use super::{Kinematics, LinkWrench, Wrench, inverse_dynamics, mass_matrix, solve};
use crate::pose::{add, cross, dot};
use crate::tree::Motion;
use crate::{Numbers, Tree};

/// Depth of the tree up to which the mass matrix takes fewer operations than articulated bodies; found by counting them
/// for chains of joints, both at right angles and at arbitrary angles.
const SHALLOW: usize = 9;

/// The accelerations `a` of the degrees of freedom, rad/s^2 or m/s^2, that solve `M a + h = tau + sum J' wrench`.
///
/// `tau` are all forces in the joints, N m or N: those of drives plus [`passive_forces`](crate::passive_forces). `external`
/// is as in [`inverse_dynamics`]. If joints follow others, or the tree is no deeper than nine bodies, this
/// uses [`solve`](solve()) with the mass matrix, else [`articulated_bodies`]: both give the same result, and the one with
/// fewer operations is used. If the mass matrix is singular, which [`check_inertia`](crate::check_inertia) detects, the
/// accelerations are not finite.
///
/// # Panics
/// If `tau` does not have one entry per degree of freedom, or `kinematics` belongs to another tree.
///
/// ```
/// use supple_robot::{Kinematics, LoadOptions, Numbers, Tree};
/// use supple_robot::{articulated_bodies, forward_dynamics, inverse_dynamics, mass_matrix, solve};
/// # let text = r#"<robot name="pendulum"><link name="world"/>
/// #     <joint name="hinge" type="continuous"><parent link="world"/><child link="rod"/><axis xyz="0 1 0"/></joint>
/// #     <link name="rod"><inertial><origin xyz="0 0 -0.5"/><mass value="2"/>
/// #         <inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link></robot>"#;
/// // The pendulum of the front page.
/// let robot = supple_robot::parse(text, "pendulum.urdf", &LoadOptions::default())?;
/// let (tree, numbers) = (Tree::new(&robot), Numbers::<f64>::of(&robot, [0.0, 0.0, -9.81]));
/// let kinematics = Kinematics::of(&tree, &numbers, &[0.3], &[0.0]);
///
/// // Without a torque at the hinge it swings back: a = -m g l sin(q) / M.
/// let a = forward_dynamics(&tree, &numbers, &kinematics, &[0.0], &[])[0];
/// assert!((a + 9.81 * 0.3_f64.sin() / 0.6).abs() < 1e-9);
///
/// // The same by articulated bodies, and by the mass matrix with the torque that would hold it.
/// let other = articulated_bodies(&tree, &numbers, &kinematics, &[0.0], &[])[0];
/// let holding = inverse_dynamics(&tree, &numbers, &kinematics, &[0.0], &[])[0];
/// let third = solve(mass_matrix(&tree, &numbers, &kinematics), &[-holding])[0];
/// assert!((a - other).abs() < 1e-9 && (a - third).abs() < 1e-9);
/// # Ok::<(), supple_text::FileError>(())
/// ```
pub fn forward_dynamics<S: Scalar>(
    tree: &Tree,
    numbers: &Numbers<S>,
    kinematics: &Kinematics<S>,
    tau: &[S],
    external: &[LinkWrench<S>],
) -> Vec<S> {
    assert_eq!(tau.len(), tree.dofs(), "wrong number of forces");
    if !tree.has_mimic() && tree.depth() > SHALLOW {
        return articulated_bodies(tree, numbers, kinematics, tau, external);
    }
    let held = inverse_dynamics(tree, numbers, kinematics, &vec![S::zero(); tree.dofs()], external);
    let free: Vec<_> = tau.iter().zip(held).map(|(&tau, held)| tau - held).collect();
    solve(mass_matrix(tree, numbers, kinematics), &free)
}

/// The accelerations of [`forward_dynamics`] by the articulated body algorithm, whose number of operations is linear
/// in the number of bodies. For trees without joints that follow others.
///
/// # Panics
/// If a joint follows another, `tau` does not have one entry per degree of freedom, or `kinematics` belongs to another
/// tree.
///
/// Example: [`forward_dynamics`].
pub fn articulated_bodies<S: Scalar>(
    tree: &Tree,
    numbers: &Numbers<S>,
    kinematics: &Kinematics<S>,
    tau: &[S],
    external: &[LinkWrench<S>],
) -> Vec<S> {
    assert!(!tree.has_mimic(), "a joint follows another");
    assert_eq!(tau.len(), tree.dofs(), "wrong number of forces");
    let drifts = drifts(tree, kinematics);
    let outside = on_bodies(tree, kinematics, external);
    let joints = swept(tree, numbers, kinematics, &drifts, tau, &outside);
    outward(tree, numbers, kinematics, &drifts, &joints)
}

/// Result of the inward sweep for a joint: its acceleration is `(free - column' X a) inverse`, where `X a` is the
/// acceleration contributed by the parent body.
struct Joint<S> {
    column: Wrench<S>,
    inverse: S,
    free: S,
}

/// The velocity-dependent acceleration of each body relative to its parent body.
fn drifts<S: Scalar>(tree: &Tree, kinematics: &Kinematics<S>) -> Vec<Acceleration<S>> {
    let zero = [S::zero(); 3];
    let still = Acceleration::new(zero, zero, zero);
    let bodies = tree.bodies().iter().zip(&kinematics.moved);
    let drifts = bodies.map(|(body, moved)| {
        let spin = |parent: usize| Acceleration::new(zero, zero, kinematics.moved[parent].twist.angular);
        moved.accelerated(body.motion, &body.parent.map_or(still, spin), S::zero())
    });
    drifts.collect()
}

/// The sweep from the tips to the world, given the external wrenches on bodies.
fn swept<S: Scalar>(
    tree: &Tree,
    numbers: &Numbers<S>,
    kinematics: &Kinematics<S>,
    drifts: &[Acceleration<S>],
    tau: &[S],
    outside: &[Wrench<S>],
) -> Vec<Joint<S>> {
    let zero = [S::zero(); 3];
    let bodies = &kinematics.bodies.inertias;
    let mut inertias: Vec<_> = bodies.iter().map(Articulated::rigid).collect();
    let spinning = bodies.iter().zip(&kinematics.moved).zip(outside).map(|((inertia, moved), outside)| {
        inertia.force(&Acceleration::new(zero, zero, moved.twist.angular)).minus(outside)
    });
    let mut forces: Vec<_> = spinning.collect();
    let mut joints = Vec::with_capacity(bodies.len());
    for (index, body) in tree.bodies().iter().enumerate().rev() {
        let column = inertias[index].column(body.motion);
        let armature = numbers.joints[body.joint].armature;
        let inverse = (along(body.motion, &column) + armature).recip();
        let free = tau[body.dof] - along(body.motion, &forces[index]);
        if let Some(parent) = body.parent {
            let step = &kinematics.moved[index].step;
            let inertia = inertias[index].freed(body.motion, &column, inverse, armature);
            let force = forces[index].plus(&inertia.force(&drifts[index]));
            let force = force.plus(&column.scaled(free * inverse));
            inertias[parent] = inertias[parent].plus(&inertia.inward(step));
            forces[parent] = forces[parent].plus(&force.inward(step));
        }
        joints.push(Joint { column, inverse, free });
    }
    joints.reverse();
    joints
}

/// The sweep from the world to the tips.
fn outward<S: Scalar>(
    tree: &Tree,
    numbers: &Numbers<S>,
    kinematics: &Kinematics<S>,
    drifts: &[Acceleration<S>],
    joints: &[Joint<S>],
) -> Vec<S> {
    let zero = [S::zero(); 3];
    let world = (zero, numbers.gravity.map(|entry| -entry));
    let mut result = vec![S::zero(); tree.dofs()];
    let mut bodies: Vec<([S; 3], [S; 3])> = Vec::with_capacity(joints.len());
    for (index, (body, joint)) in tree.bodies().iter().zip(joints).enumerate() {
        let (angular, linear) = body.parent.map_or(world, |parent| bodies[parent]);
        let (step, drift) = (&kinematics.moved[index].step, &drifts[index]);
        let mut linear = add(step.outward(add(linear, cross(angular, step.origin))), drift.linear);
        let mut angular = add(step.outward(angular), drift.angular);
        let given = dot(joint.column.torque, angular) + dot(joint.column.force, linear);
        let acceleration = (joint.free - given) * joint.inverse;
        match body.motion {
            Motion::Turn => angular[2] += acceleration,
            Motion::Slide => linear[2] += acceleration,
        }
        result[body.dof] = acceleration;
        bodies.push((angular, linear));
    }
    result
}
