//! Links and joints of a robot expressed in the frames of its bodies.

use supple_kernels::Scalar;

use super::inertia::Inertia;
use crate::pose::constants;
use crate::{Numbers, Pose, Tree};

/// Constant properties of all bodies and links, in body frames.
#[derive(Clone, Debug)]
pub(crate) struct Bodies<S> {
    /// Pose of each body in its parent body, with the joint at position 0.
    pub joints: Vec<Pose<S>>,
    /// The inertia of each body.
    pub inertias: Vec<Inertia<S>>,
    /// Pose of each link in its body, or in the world.
    pub links: Vec<Pose<S>>,
}

impl<S: Scalar> Bodies<S> {
    /// The constants for a tree with the given numbers.
    pub fn of(tree: &Tree, numbers: &Numbers<S>) -> Self {
        let mut joints = Vec::with_capacity(tree.bodies().len());
        let mut inertias = vec![Inertia::zero(); tree.bodies().len()];
        let mut links: Vec<Pose<S>> = Vec::with_capacity(tree.places().len());
        for (link, place) in tree.places().iter().enumerate() {
            let pose = match (place.parent, place.body) {
                (None, _) => Pose::identity(),
                (Some(parent), Some(body)) if place.moves => {
                    let axes = Pose { rotation: tree.bodies()[body].axes.map(constants), ..Pose::identity() };
                    let joint = &numbers.joints[link - 1];
                    joints.push(links[parent].compose(&joint.origin).compose(&axes));
                    axes.inverse().compose(&joint.child_pose)
                }
                (Some(parent), _) => {
                    let joint = &numbers.joints[link - 1];
                    links[parent].compose(&joint.origin).compose(&joint.child_pose)
                }
            };
            if let Some(body) = place.body {
                inertias[body] = inertias[body].plus(&Inertia::of(&numbers.links[link], &pose));
            }
            links.push(pose);
        }
        Self { joints, inertias, links }
    }
}
