//! External wrenches on links, converted to wrenches on bodies.

use supple_kernels::Scalar;

use super::{Kinematics, LinkWrench, Wrench};
use crate::Tree;
use crate::pose::{add, cross};

/// The external wrench on each body, about the body's origin in the body's axes. Wrenches on links of the world itself have
/// no effect.
pub(crate) fn on_bodies<S: Scalar>(
    tree: &Tree,
    kinematics: &Kinematics<S>,
    external: &[LinkWrench<S>],
) -> Vec<Wrench<S>> {
    let mut sums = vec![Wrench::zero(); tree.bodies().len()];
    for LinkWrench { link, wrench } in external {
        if let Some(body) = tree.body_of(*link) {
            let place = &kinematics.bodies.links[*link];
            let force = place.rotate(wrench.force);
            let torque = add(place.rotate(wrench.torque), cross(place.position, force));
            sums[body] = sums[body].plus(&Wrench { torque, force });
        }
    }
    sums
}
