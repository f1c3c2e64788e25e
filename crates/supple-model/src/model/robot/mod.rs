//! Robots of rigid bodies from URDF, SDF or MJCF files, with compliance added by the designer.
//!
//! ```text
//! file.rs, keys.rs, build/: task file + robot file -> Robot
//! ../bodies/: numbers that may be parameters, positions and motion
//! ../compliance/, drive.rs: forces        dynamics.rs, sliding.rs: inertia and steps
//! signals.rs: what can be measured        picture.rs: its appearance
//! ```

use std::path::PathBuf;

use super::bodies::Bodies;
use super::compliance::Element;
use crate::Value;
use crate::physics::DependentJoint;
use crate::quantity::Sensor;

mod build;
mod described;
mod drive;
mod drives;
mod dynamics;
mod file;
mod insert;
mod integrator;
mod keys;
mod locked;
mod model;
mod native;
mod picture;
mod rigid;
#[cfg(feature = "schema")]
mod schema;
mod signals;
mod sliding;
mod start;

use drive::Drive;
use integrator::Integrator;

/// A robot of rigid bodies, its drives, compliance and sensors.
///
/// The state is `[q, s, q', s', c]`: positions of the degrees of freedom (rad or m) and of what compliance adds (such
/// as motors of elastic joints), their velocities, and uncertain constants (such as wall positions). The controls are
/// drive torques or forces, or the inputs of actuators. A step is
///
/// ```text
/// M(q) a = tau(q, v, u) - h(q, v)      v+ = v + dt a      q+ = q + dt v+
/// ```
///
/// where the forces of springs, dampers, friction and contacts in `tau` may be evaluated at the end of the step.
///
/// In a task file:
///
/// ```toml
/// [model]
/// kind = "robot"
/// file = "arm.urdf"
/// actuated = ["shoulder", "elbow"]
/// compliance = [{ kind = "spring", name = "return", joint = "elbow", stiffness = "elbow_stiffness", damping = 0.5 }]
/// sensors = [{ kind = "joint_position", variance = 1e-6 }]
/// ```
#[derive(Clone, Debug)]
pub struct Robot {
    /// The file that it was read from.
    file: PathBuf,
    bodies: Bodies,
    drives: Vec<Drive>,
    compliance: Vec<Element>,
    sensors: Vec<Sensor>,
    /// Sensors of what depends on the control.
    recalling: Vec<Sensor>,
    friction_smoothing: Value,
    /// Used in planning: a speed that widens the smoothing of joint friction.
    friction_widening: Option<Value>,
    integrator: Integrator,
    /// Used in planning: the share of an implicit step after which resistive forces are evaluated; 1 by default.
    lead: Option<Value>,
    substeps: usize,
    /// Joints that the task has locked, or that follow others.
    dependent: Vec<DependentJoint>,
    /// Joints that the task has inserted.
    inserted: Vec<String>,
}

impl Robot {
    /// Greatest number of joints that move.
    pub const MOST_JOINTS: usize = 200;

    /// The number of degrees of freedom, and the number of all positions including those that compliance adds.
    fn positions(&self) -> (usize, usize) {
        self.bodies.positions()
    }

    fn constants(&self) -> usize {
        self.compliance.iter().map(|element| element.kind.constants()).sum()
    }
}
