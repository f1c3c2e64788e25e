//! The bodies of a robot: a robot file with numbers that may be parameters, and their positions and motion.

use std::sync::Arc;

use supple_robot::{JointKind, Tree};

use crate::Value;

mod numbers;
mod overrides;
mod situation;

pub(super) use numbers::widened;
pub(super) use overrides::{FrameNumbers, Override};
pub(super) use situation::Situation;
pub use situation::{Forces, Own};

/// The moving parts of a robot: a tree of bodies, and coordinates that compliance adds.
#[derive(Clone, Debug)]
pub(super) struct Bodies {
    /// The robot as described by its file.
    pub robot: Arc<supple_robot::Robot>,
    /// Its degrees of freedom.
    pub tree: Arc<Tree>,
    /// Gravitational acceleration in the world, m/s^2.
    pub gravity: [Value; 3],
    /// Numbers of the file that the task overrides.
    pub overrides: Vec<Override>,
    /// Frames that the task defines.
    pub frames: Vec<FrameNumbers>,
    /// How many coordinates compliance adds.
    pub added: usize,
}

impl Bodies {
    /// The number of degrees of freedom, and the number of all positions including those that compliance adds.
    pub fn positions(&self) -> (usize, usize) {
        let dofs = self.tree.dofs();
        (dofs, dofs + self.added)
    }

    /// Whether a degree of freedom is prismatic.
    pub fn slides(&self, dof: usize) -> bool {
        let joint = self.tree.joint_indices().get(dof).map(|&joint| self.robot.joints[joint].kind);
        joint == Some(JointKind::Prismatic)
    }
}
