//! How a task specifies the start of a robot.

use serde::Deserialize;

/// How a task specifies the start of a robot.
///
/// In a task file, by a keyframe of the robot file and the value of one state:
///
/// ```toml
/// [tasks.initial_state]
/// key = "home"
/// "q.elbow" = 0.3
/// ```
pub struct Start<'a> {
    /// Name of a keyframe.
    pub key: Option<&'a str>,
    /// The pose of a frame.
    pub pose: Option<&'a PoseFile>,
    /// Initial values that the task gives for individual states, at the initial values of parameters.
    pub given: &'a [Option<f64>],
    /// The initial values of all parameters.
    pub phi: &'a [f64],
}

/// The pose of a robot's frame at the start of a task.
///
/// In a task file:
///
/// ```toml
/// [tasks.initial_state]
/// pose = { frame = "tool", position = [0.4, 0.0, 0.3], rpy = [3.1416, 0.0, 0.0] }
/// ```
#[derive(Debug, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "schema", schemars(description = "The pose of a robot's frame at the start of a task."))]
#[serde(deny_unknown_fields)]
pub struct PoseFile {
    /// Name of the frame or link.
    pub frame: String,
    /// Position of its origin in the world, m; parameters are not allowed.
    pub position: [f64; 3],
    /// Its roll, pitch and yaw in the world, rad; default: any orientation.
    pub rpy: Option<[f64; 3]>,
}

impl PoseFile {
    /// Its numbers, by key.
    #[must_use]
    pub fn numbers(&self) -> Vec<(&'static str, [f64; 3])> {
        std::iter::once(("position", self.position)).chain(self.rpy.map(|rpy| ("rpy", rpy))).collect()
    }
}
