//! Forces from accelerations: the recursive Newton-Euler algorithm.

use supple_kernels::Scalar;

use super::external::on_bodies;
use super::inertia::Acceleration;
use super::kinematics::Moved;
use super::{Kinematics, LinkWrench, Wrench, passive_forces};
use crate::tree::Motion;
use crate::{Numbers, Tree};

/// The generalised forces `M a + h - sum J' wrench` on the degrees of freedom required for accelerations `a`, rad/s^2 or
/// m/s^2, including inertia, Coriolis forces, gravity and external wrenches on links: N m or N. Springs, dampers and
/// friction in joints are left out; see [`passive_forces`].
///
/// `external` lists the external wrenches on links.
///
/// # Panics
/// If `a` does not have one entry per degree of freedom, or `kinematics` belongs to another tree.
///
/// ```
/// use supple_robot::{Kinematics, LinkWrench, LoadOptions, Numbers, Tree, Wrench, inverse_dynamics};
/// # let text = r#"<robot name="pendulum"><link name="world"/>
/// #     <joint name="hinge" type="continuous"><parent link="world"/><child link="rod"/><axis xyz="0 1 0"/></joint>
/// #     <link name="rod"><inertial><origin xyz="0 0 -0.5"/><mass value="2"/>
/// #         <inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link></robot>"#;
/// // The pendulum of the front page.
/// let robot = supple_robot::parse(text, "pendulum.urdf", &LoadOptions::default())?;
/// let (tree, numbers) = (Tree::new(&robot), Numbers::<f64>::of(&robot, [0.0, 0.0, -9.81]));
/// let kinematics = Kinematics::at_rest(&tree, &numbers, &[0.3]);
///
/// // An external torque of 1 N m about the hinge reduces the torque of the drive by 1 N m.
/// let push = Wrench { torque: [0.0, 1.0, 0.0], force: [0.0; 3] };
/// let alone = inverse_dynamics(&tree, &numbers, &kinematics, &[0.0], &[])[0];
/// let pushed = inverse_dynamics(&tree, &numbers, &kinematics, &[0.0], &[LinkWrench { link: 1, wrench: push }])[0];
/// assert!((alone - pushed - 1.0).abs() < 1e-12);
/// # Ok::<(), supple_text::FileError>(())
/// ```
pub fn inverse_dynamics<S: Scalar>(
    tree: &Tree,
    numbers: &Numbers<S>,
    kinematics: &Kinematics<S>,
    a: &[S],
    external: &[LinkWrench<S>],
) -> Vec<S> {
    assert_eq!(a.len(), tree.dofs(), "wrong number of accelerations");
    let moved = &kinematics.moved;
    let world = Moved::world(numbers.gravity);
    let mut accelerations: Vec<Acceleration<S>> = Vec::with_capacity(moved.len());
    for (body, moved) in tree.bodies().iter().zip(moved) {
        let parent = body.parent.map_or(world, |parent| accelerations[parent]);
        accelerations.push(moved.accelerated(body.motion, &parent, a[body.dof] * body.ratio));
    }
    let inertias = kinematics.bodies.inertias.iter().zip(&accelerations);
    let needed = inertias.map(|(inertia, acceleration)| inertia.force(acceleration));
    let outside = on_bodies(tree, kinematics, external);
    let mut forces: Vec<_> = needed.zip(&outside).map(|(needed, outside)| needed.minus(outside)).collect();
    let mut generalized = vec![S::zero(); tree.dofs()];
    for (index, body) in tree.bodies().iter().enumerate().rev() {
        let force = forces[index];
        let drive = numbers.joints[body.joint].armature * (a[body.dof] * body.ratio);
        generalized[body.dof] += (along(body.motion, &force) + drive) * body.ratio;
        if let Some(parent) = body.parent {
            forces[parent] = forces[parent].plus(&force.inward(&moved[index].step));
        }
    }
    generalized
}

/// The generalised forces `h - passive` required for zero accelerations: Coriolis forces and gravity, minus
/// [`passive_forces`] at `q`, `v` and `smoothing`. With it, `M a + bias = tau`.
///
/// # Panics
/// As [`inverse_dynamics`].
///
/// Example: the [front page](crate).
pub fn bias<S: Scalar>(
    tree: &Tree,
    numbers: &Numbers<S>,
    kinematics: &Kinematics<S>,
    q: &[S],
    v: &[S],
    smoothing: S,
) -> Vec<S> {
    let needed = inverse_dynamics(tree, numbers, kinematics, &vec![S::zero(); tree.dofs()], &[]);
    let passive = passive_forces(tree, numbers, q, v, smoothing);
    needed.into_iter().zip(passive).map(|(needed, passive)| needed - passive).collect()
}

/// The component of a wrench on a body along its joint, which the joint does not transmit.
pub(crate) fn along<S: Scalar>(motion: Motion, wrench: &Wrench<S>) -> S {
    match motion {
        Motion::Turn => wrench.torque[2],
        Motion::Slide => wrench.force[2],
    }
}
