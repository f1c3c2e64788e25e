//! The keys of `[model]` of robots.

use std::collections::BTreeMap;

use serde::Deserialize;
use serde::de::IgnoredAny;

use super::drive::DriveFile;
use super::insert::InsertFile;
use super::integrator::Integrator;
use super::locked::Locked;
use crate::Value;

/// `[model]` of kind `robot`. Compliance and sensors are read by kind.
#[derive(Debug, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct File {
    /// The robot file (URDF, SDF or MJCF), relative to the folder of the task file.
    pub(super) file: String,
    /// Folders searched for packages, relative to the folder of the task file.
    #[serde(default)]
    pub(super) package_roots: Vec<String>,
    /// Whether mimic joints move independently.
    #[serde(default)]
    pub(super) independent_mimic: bool,
    /// Gravitational acceleration in the world, m/s^2; default: that of the robot's file, or 0, 0, -9.81.
    pub(super) gravity: Option<[Value; 3]>,
    /// Names of actuators of the robot's file and of joints with plain drives, in the order of the controls; default: all
    /// actuators of the file, or all moving joints if it has none.
    pub(super) actuated: Option<Vec<String>>,
    /// Fixed joints: names (fixed at 0, or at the middle of their range if it excludes 0), or positions by name, rad or
    /// m.
    #[serde(default)]
    pub(super) locked: Locked,
    /// Joints that are inserted at frames, with springs: compliant mounts, doors.
    #[serde(default)]
    pub(super) insert: Vec<InsertFile>,
    /// Whether actuators of the robot's file are used; if not, all drives are plain.
    #[serde(default = "yes")]
    pub(super) file_actuators: bool,
    /// Properties of drives, by joint or actuator.
    #[serde(default)]
    pub(super) drives: BTreeMap<String, DriveFile>,
    /// Numbers of links, by link, overriding those of the robot file.
    #[serde(default)]
    pub(super) links: BTreeMap<String, LinkFile>,
    /// Numbers of joints, by joint, overriding those of the robot file.
    #[serde(default)]
    pub(super) joints: BTreeMap<String, JointFile>,
    /// Additional frames, by name.
    #[serde(default)]
    pub(super) frames: BTreeMap<String, FrameFile>,
    /// Speed over which joint friction builds up, rad/s or m/s; above 0.
    #[serde(default = "slow")]
    pub(super) friction_smoothing: Value,
    /// How motion is integrated over a time step.
    #[serde(default)]
    pub(super) integrator: Integrator,
    /// Steps of integration in each time step.
    #[serde(default = "one")]
    #[cfg_attr(feature = "schema", schemars(range(min = 1, max = 1000)))]
    pub(super) substeps: usize,
    /// Compliance: a list of tables, each with a `kind` and a `name`.
    #[serde(default)]
    #[cfg_attr(feature = "schema", schemars(skip))]
    #[allow(dead_code)]
    pub(super) compliance: IgnoredAny,
    /// Sensors: a list of tables, each with a `kind`; may be empty if there is a catalogue.
    #[serde(default)]
    #[cfg_attr(feature = "schema", schemars(skip))]
    #[allow(dead_code)]
    pub(super) sensors: IgnoredAny,
}

/// Numbers of a link.
#[derive(Debug, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(super) struct LinkFile {
    /// Mass, kg; at least 0.
    pub(super) mass: Option<Value>,
    /// Factor on the moments of inertia; at least 0.
    pub(super) inertia_scale: Option<Value>,
    /// Centre of mass in the link's frame, m.
    pub(super) center: Option<[Value; 3]>,
}

/// Numbers of a joint.
#[derive(Debug, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(super) struct JointFile {
    /// Damping, N m s/rad or N s/m; at least 0.
    pub(super) damping: Option<Value>,
    /// Friction, N m or N; at least 0.
    pub(super) friction: Option<Value>,
    /// Inertia of the drive reflected to the joint, kg m² or kg; at least 0.
    pub(super) armature: Option<Value>,
    /// Stiffness of a spring beside the joint, N m/rad or N/m; at least 0.
    pub(super) stiffness: Option<Value>,
    /// Position at which that spring is at rest, rad or m.
    pub(super) rest: Option<Value>,
    /// Offset added to the joint's position in the parent link, in that link's axes, m.
    pub(super) offset: Option<[Value; 3]>,
    /// Factor applied to the joint's position in the parent link (link length); at least 0.
    pub(super) length_scale: Option<Value>,
}

/// A frame on a link.
#[derive(Debug, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(super) struct FrameFile {
    /// Name of the link, or of a frame of the robot's file, that it is fixed to.
    pub(super) on: String,
    /// Its origin there, m.
    #[serde(default)]
    pub(super) position: [Value; 3],
    /// Its roll, pitch and yaw there, rad.
    #[serde(default)]
    pub(super) rpy: [Value; 3],
}

fn slow() -> Value {
    Value::Number(1e-2)
}

fn yes() -> bool {
    true
}

fn one() -> usize {
    1
}
