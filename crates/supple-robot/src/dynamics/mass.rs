//! The mass matrix: the composite rigid body algorithm.

use supple_kernels::Scalar;

use super::inertia::Inertia;
use super::inverse::along;
use super::{Kinematics, Wrench};
use crate::tree::Motion;
use crate::{Numbers, Tree};

/// The mass matrix, including the inertia of drives: `dofs` by `dofs`, symmetric; kg m^2, kg m or kg.
///
/// Entries that couple two degrees of freedom are constant zeros if no body is moved by both.
///
/// # Panics
/// If `kinematics` belongs to another tree.
///
/// Example: [`forward_dynamics`](crate::forward_dynamics).
pub fn mass_matrix<S: Scalar>(tree: &Tree, numbers: &Numbers<S>, kinematics: &Kinematics<S>) -> Vec<Vec<S>> {
    let mut mass = vec![vec![S::zero(); tree.dofs()]; tree.dofs()];
    for_each_part(tree, numbers, kinematics, |row, column, part| {
        mass[row][column] += part;
        if row != column {
            mass[column][row] = mass[row][column];
        }
    });
    mass
}

/// Calls `add` with row, column and value of each part of the mass matrix that is not a constant zero. Of each symmetric
/// pair of off-diagonal entries, only one is passed.
///
/// # Panics
/// As [`mass_matrix`].
pub(super) fn for_each_part<S: Scalar>(
    tree: &Tree,
    numbers: &Numbers<S>,
    kinematics: &Kinematics<S>,
    mut add: impl FnMut(usize, usize, S),
) {
    let bodies = tree.bodies();
    let composites = composites(tree, kinematics);
    for (index, body) in bodies.iter().enumerate() {
        let mut force = unit_force(body.motion, &composites[index]);
        let own = (along(body.motion, &force) + numbers.joints[body.joint].armature) * (body.ratio * body.ratio);
        add(body.dof, body.dof, own);
        let mut below = index;
        for above in tree.path(body.parent) {
            force = force.inward(&kinematics.moved[below].step);
            let other = &bodies[above];
            let shared = along(other.motion, &force) * (body.ratio * other.ratio);
            add(body.dof, other.dof, if other.dof == body.dof { shared * 2.0 } else { shared });
            below = above;
        }
    }
}

/// The composite inertia of each body with everything it carries.
fn composites<S: Scalar>(tree: &Tree, kinematics: &Kinematics<S>) -> Vec<Inertia<S>> {
    let mut composites = kinematics.bodies.inertias.clone();
    for (index, body) in tree.bodies().iter().enumerate().rev() {
        if let Some(parent) = body.parent {
            composites[parent] = composites[parent].plus(&composites[index].inward(&kinematics.moved[index].step));
        }
    }
    composites
}

/// The wrench that gives a body with this inertia, at rest, unit acceleration along its joint.
fn unit_force<S: Scalar>(motion: Motion, inertia: &Inertia<S>) -> Wrench<S> {
    let [x, y, _] = inertia.first;
    match motion {
        Motion::Turn => {
            let [[_, _, xz], [_, _, yz], [_, _, zz]] = inertia.moments();
            Wrench { torque: [xz, yz, zz], force: [-y, x, S::zero()] }
        }
        Motion::Slide => Wrench { torque: [y, -x, S::zero()], force: [S::zero(), S::zero(), inertia.mass] },
    }
}
