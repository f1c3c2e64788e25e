use serde::Deserialize;
use supple_kernels::Scalar;

use super::{Context, Measure, SensorFile, Variance};
use crate::Channel;
use crate::model::robot::Robot;
use crate::model::robot::compliance::{Compliance, Kind, Unfit};
use crate::model::robot::situation::Situation;

/// Positions of joints, rad or m.
#[derive(Clone, Debug)]
pub(crate) struct JointPosition {
    /// Places among all positions: degrees of freedom, then motors.
    selected: Vec<usize>,
}

/// Positions or velocities of joints.
#[derive(Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct File {
    /// Names of the joints.
    select: Vec<String>,
    /// Which side of an elastic joint is measured.
    #[serde(default)]
    side: Side,
    /// Variance of the noise, one for all or one each, in squares of the unit; above 0.
    variance: Variance,
}

/// A side of an elastic joint.
#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq, Eq, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Side {
    /// The link that the joint moves.
    #[default]
    Link,
    /// The motor, seen through its gear.
    Motor,
}

impl File {
    /// Places of what is selected among all positions.
    pub fn places(self, context: &Context) -> Result<(Vec<usize>, Variance), Unfit> {
        if self.select.is_empty() {
            return Err(("select", "name at least one joint".into(), None));
        }
        let dofs = context.names.joints.len();
        let place = |name: &String| {
            let dof = context.names.joint("select", name)?;
            if self.side == Side::Link {
                return Ok(dof);
            }
            let motor = context.compliance.iter().find(|element| element.kind.is_motor_of(dof));
            motor.map(|element| dofs + element.coordinate).ok_or_else(|| {
                ("side", format!("joint `{name}` has no motor of its own: it is no elastic joint"), None)
            })
        };
        Ok((self.select.iter().map(place).collect::<Result<_, _>>()?, self.variance))
    }
}

impl Kind {
    /// Whether this drives the given degree of freedom elastically.
    pub fn is_motor_of(&self, dof: usize) -> bool {
        self.coordinates() > 0 && matches!(self, Self::ElasticJoint(joint) if joint.dof == dof)
    }
}

impl JointPosition {
    /// The position of a degree of freedom.
    pub fn of(dof: usize) -> Self {
        Self { selected: vec![dof] }
    }
}

impl SensorFile for JointPosition {
    type File = File;

    fn build(file: File, context: &Context) -> Result<(Self, Variance), Unfit> {
        file.places(context).map(|(selected, variance)| (Self { selected }, variance))
    }
}

impl Measure for JointPosition {
    fn len(&self) -> usize {
        self.selected.len()
    }

    fn channels(&self, robot: &Robot) -> Vec<Channel> {
        let all = robot.state_channels();
        self.selected.iter().map(|&place| all[place].clone()).collect()
    }

    fn measure<S: Scalar>(&self, now: &Situation<S>, out: &mut [S]) {
        for (out, &place) in out.iter_mut().zip(&self.selected) {
            *out = now.at.x[place];
        }
    }
}
