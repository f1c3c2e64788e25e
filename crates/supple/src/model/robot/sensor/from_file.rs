use serde::Deserialize;
use supple_kernels::Scalar;
use supple_robot::{Kinematics, Measured, Numbers, Pose, Tree};

use super::frame_point::FramePoint;
use super::frame_turn::FrameTurn;
use super::joint_position::JointPosition;
use super::joint_torque::JointTorque;
use super::joint_velocity::JointVelocity;
use super::{Context, Kind, Measure, SensorFile, Variance};
use crate::Channel;
use crate::model::robot::Robot;
use crate::model::robot::compliance::{Unfit, find};
use crate::model::robot::situation::Situation;

/// Sensors of the robot's file, in the units of what they measure.
#[derive(Clone, Debug)]
pub(crate) struct FromFile {
    sensors: Vec<Kind>,
}

/// Sensors of the robot's file.
#[derive(Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct File {
    /// Names of the sensors.
    select: Vec<String>,
    /// Variance of the noise, one for all or one for each number that they measure, in squares of the unit; above 0.
    variance: Variance,
}

impl SensorFile for FromFile {
    type File = File;

    fn build(file: File, context: &Context) -> Result<(Self, Variance), Unfit> {
        let sensors = file.select.iter().map(|name| sensor(name, context)).collect::<Result<_, _>>()?;
        Ok((Self { sensors }, file.variance))
    }
}

/// What the sensor of this name measures.
fn sensor(name: &str, context: &Context) -> Result<Kind, Unfit> {
    let robot = context.names.robot;
    let names: Vec<String> = robot.sensors.iter().map(|sensor| sensor.name.clone()).collect();
    if let Some(omitted) = robot.omitted.iter().find(|omitted| omitted.what == "sensor" && omitted.name == name) {
        let message =
            format!("sensor `{name}` of the robot's file (line {}) is not supported: {}", omitted.line, omitted.why);
        let help = format!("sensors of the file that are: {}", supple_files::owned(&names));
        return Err(("select", message, Some(help)));
    }
    let index = find("select", "sensor in its file", name, &names)?;
    let dof = |joint: usize| context.names.joint("select", &robot.joints[joint].name);
    Ok(match robot.sensors[index].measures {
        Measured::JointPosition(joint) => Kind::JointPosition(JointPosition::of(dof(joint)?)),
        Measured::JointVelocity(joint) => Kind::JointVelocity(JointVelocity::of(dof(joint)?)),
        Measured::JointTorque(joint) => Kind::JointTorque(JointTorque::of(&robot.joints[joint].name, context)?),
        Measured::FramePosition(frame) => Kind::FramePoint(FramePoint::of(frame)),
        Measured::FrameOrientation(frame) => Kind::FrameTurn(FrameTurn::new(frame, at_reference(frame, context))),
    })
}

/// The frame with this number where all joints are at their references, the initial state of the file.
fn at_reference(frame: usize, context: &Context) -> Pose {
    let robot = context.names.robot;
    let tree = Tree::new(robot);
    let q: Vec<f64> = tree.joint_indices().iter().map(|&joint| robot.joints[joint].reference).collect();
    let kinematics = Kinematics::of(&tree, &Numbers::of(robot, [0.0; 3]), &q, &vec![0.0; q.len()]);
    let (link, pose) = match frame.checked_sub(robot.links.len()) {
        None => (frame, Pose::IDENTITY),
        Some(other) => (robot.frames[other].link, robot.frames[other].pose),
    };
    kinematics.poses()[link].compose(&pose)
}

impl Measure for FromFile {
    fn len(&self) -> usize {
        self.sensors.iter().map(Measure::len).sum()
    }

    fn channels(&self, robot: &Robot) -> Vec<Channel> {
        self.sensors.iter().flat_map(|sensor| sensor.channels(robot)).collect()
    }

    fn measure<S: Scalar>(&self, now: &Situation<S>, out: &mut [S]) {
        let mut rest = out;
        for sensor in &self.sensors {
            let (own, others) = rest.split_at_mut(sensor.len());
            sensor.measure(now, own);
            rest = others;
        }
    }
}
