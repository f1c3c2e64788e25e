use supple_kernels::Scalar;

use super::joint_position::File;
use super::{Context, Measure, SensorFile, Variance};
use crate::Channel;
use crate::model::robot::Robot;
use crate::model::robot::compliance::Unfit;
use crate::model::robot::situation::Situation;

/// Velocities of joints, rad/s or m/s.
#[derive(Clone, Debug)]
pub(crate) struct JointVelocity {
    /// Places among all velocities: degrees of freedom, then motors.
    selected: Vec<usize>,
}

impl JointVelocity {
    /// The velocity of a degree of freedom.
    pub fn of(dof: usize) -> Self {
        Self { selected: vec![dof] }
    }
}

impl SensorFile for JointVelocity {
    type File = File;

    fn build(file: File, context: &Context) -> Result<(Self, Variance), Unfit> {
        file.places(context).map(|(selected, variance)| (Self { selected }, variance))
    }
}

impl Measure for JointVelocity {
    fn len(&self) -> usize {
        self.selected.len()
    }

    fn channels(&self, robot: &Robot) -> Vec<Channel> {
        let (_, positions) = robot.positions();
        let all = robot.state_channels();
        self.selected.iter().map(|&place| all[positions + place].clone()).collect()
    }

    fn measure<S: Scalar>(&self, now: &Situation<S>, out: &mut [S]) {
        let (_, positions) = now.robot.positions();
        for (out, &place) in out.iter_mut().zip(&self.selected) {
            *out = now.at.x[positions + place];
        }
    }
}
