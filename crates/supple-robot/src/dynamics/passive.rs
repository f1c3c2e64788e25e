//! Springs, dampers and friction in joints.

use supple_kernels::Scalar;

use crate::{Numbers, Tree};

/// The forces of springs, dampers and friction in the joints on the degrees of freedom, N m or N. For a joint at
/// position `p` with velocity `r`,
///
/// ```text
/// - stiffness (p - rest) - damping r - friction r / sqrt(r^2 + smoothing^2)
/// ```
///
/// `smoothing` is the velocity, rad/s or m/s, above which friction is nearly that of Coulomb; more than 0.
///
/// # Panics
/// Where `q` or `v` has not one entry by degree of freedom, or `numbers` are those of another robot.
pub fn passive_forces<S: Scalar>(tree: &Tree, numbers: &Numbers<S>, q: &[S], v: &[S], smoothing: S) -> Vec<S> {
    assert_eq!((q.len(), v.len()), (tree.dofs(), tree.dofs()), "positions and velocities of other dofs");
    let mut forces = vec![S::zero(); tree.dofs()];
    for body in tree.bodies() {
        let joint = &numbers.joints[body.joint];
        let position = q[body.dof] * body.ratio + body.offset;
        let rate = v[body.dof] * body.ratio;
        let direction = rate / (rate * rate + smoothing * smoothing).sqrt();
        let resisting = joint.stiffness * (position - joint.rest) + joint.damping * rate + joint.friction * direction;
        forces[body.dof] -= resisting * body.ratio;
    }
    forces
}
