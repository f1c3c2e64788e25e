use serde::Deserialize;
use supple_kernels::Scalar;
use supple_robot::Pose;

use super::{Context, Measure, SensorFile, Variance};
use crate::Channel;
use crate::model::robot::Robot;
use crate::model::robot::compliance::Unfit;
use crate::model::robot::situation::Situation;

/// Position of a frame in the world, m, and its turn from a reference orientation, rad.
#[derive(Clone, Debug)]
pub(crate) struct FramePose {
    frame: usize,
    reference: Pose,
}

/// Position and orientation of a frame.
#[derive(Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct File {
    /// Name of the frame or link.
    frame: String,
    /// Roll, pitch and yaw of the orientation from which turns are measured, rad; the closer to the frame's the better.
    #[serde(default)]
    reference: [f64; 3],
    /// Variance of the noise, one for all or six, m^2 and rad^2; above 0.
    variance: Variance,
}

impl SensorFile for FramePose {
    type File = File;

    fn build(file: File, context: &Context) -> Result<(Self, Variance), Unfit> {
        let frame = context.names.frame("frame", &file.frame)?;
        Ok((Self { frame, reference: Pose::from_rpy([0.0; 3], file.reference) }, file.variance))
    }
}

/// The turn of a rotation from a reference, in the axes of the reference: the sine of the angle along the axis, half
/// the skew part of `R_ref' R`. It is the rotation vector for small angles, and bounded and smooth for all.
pub(crate) fn turn<S: Scalar>(rotation: &[[S; 3]; 3], reference: &[[S; 3]; 3]) -> [S; 3] {
    let entry = |i: usize, j: usize| (0..3).fold(S::zero(), |sum, k| sum + reference[k][i] * rotation[k][j]);
    let half = |i: usize, j: usize| (entry(i, j) - entry(j, i)) * 0.5;
    [half(2, 1), half(0, 2), half(1, 0)]
}

impl Measure for FramePose {
    fn len(&self) -> usize {
        6
    }

    fn channels(&self, robot: &Robot) -> Vec<Channel> {
        let name = robot.frame_names()[self.frame];
        let shift = ["x", "y", "z"].map(|axis| Channel::new(format!("{axis} of {name}"), "m"));
        let turn = ["x", "y", "z"].map(|axis| Channel::new(format!("turn of {name} about {axis}"), "rad"));
        [shift, turn].concat()
    }

    fn measure<S: Scalar>(&self, now: &Situation<S>, out: &mut [S]) {
        let pose = now.pose(self.frame);
        out[..3].copy_from_slice(&pose.position);
        out[3..].copy_from_slice(&turn(&pose.rotation, &self.reference.cast().rotation));
    }
}
