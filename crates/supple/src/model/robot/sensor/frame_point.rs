use serde::Deserialize;
use supple_kernels::Scalar;

use super::{Context, Measure, SensorFile, Variance};
use crate::Channel;
use crate::model::robot::Robot;
use crate::model::robot::compliance::Unfit;
use crate::model::robot::situation::Situation;

/// Position of a frame's origin in the world, m.
#[derive(Clone, Debug)]
pub(crate) struct FramePoint {
    frame: usize,
}

/// Position of a frame's origin in the world.
#[derive(Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct File {
    /// Name of the frame or link.
    frame: String,
    /// Variance of the noise, one for all or three, m^2; above 0.
    variance: Variance,
}

impl FramePoint {
    /// The position of the frame with this number.
    pub fn of(frame: usize) -> Self {
        Self { frame }
    }
}

impl SensorFile for FramePoint {
    type File = File;

    fn build(file: File, context: &Context) -> Result<(Self, Variance), Unfit> {
        Ok((Self { frame: context.names.frame("frame", &file.frame)? }, file.variance))
    }
}

impl Measure for FramePoint {
    fn len(&self) -> usize {
        3
    }

    fn channels(&self, robot: &Robot) -> Vec<Channel> {
        let name = robot.frame_names()[self.frame];
        ["x", "y", "z"].map(|axis| Channel::new(format!("{axis} of {name}"), "m")).to_vec()
    }

    fn measure<S: Scalar>(&self, now: &Situation<S>, out: &mut [S]) {
        out.copy_from_slice(&now.pose(self.frame).position);
    }
}
