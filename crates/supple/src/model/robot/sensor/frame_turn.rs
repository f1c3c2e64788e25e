use serde::Deserialize;
use supple_kernels::Scalar;
use supple_robot::Pose;

use super::frame_pose::turn;
use super::{Context, Measure, SensorFile, Variance};
use crate::Channel;
use crate::model::robot::Robot;
use crate::model::robot::compliance::Unfit;
use crate::model::robot::situation::Situation;

/// Turn of a frame from a reference orientation in the world, rad.
#[derive(Clone, Debug)]
pub(crate) struct FrameTurn {
    frame: usize,
    reference: Pose,
}

/// Orientation of a frame.
#[derive(Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct File {
    /// Name of the frame or link.
    frame: String,
    /// Roll, pitch and yaw of the orientation from which turns are measured, rad; the closer to the frame's the better.
    #[serde(default)]
    reference: [f64; 3],
    /// Variance of the noise, one for all or three, rad^2; above 0.
    variance: Variance,
}

impl FrameTurn {
    /// The turn of the frame with this number from an orientation.
    pub fn new(frame: usize, reference: Pose) -> Self {
        Self { frame, reference }
    }
}

impl SensorFile for FrameTurn {
    type File = File;

    fn build(file: File, context: &Context) -> Result<(Self, Variance), Unfit> {
        let frame = context.names.frame("frame", &file.frame)?;
        Ok((Self::new(frame, Pose::from_rpy([0.0; 3], file.reference)), file.variance))
    }
}

impl Measure for FrameTurn {
    fn len(&self) -> usize {
        3
    }

    fn channels(&self, robot: &Robot) -> Vec<Channel> {
        let name = robot.frame_names()[self.frame];
        ["x", "y", "z"].map(|axis| Channel::new(format!("turn of {name} about {axis}"), "rad")).to_vec()
    }

    fn measure<S: Scalar>(&self, now: &Situation<S>, out: &mut [S]) {
        out.copy_from_slice(&turn(&now.pose(self.frame).rotation, &self.reference.cast().rotation));
    }
}
