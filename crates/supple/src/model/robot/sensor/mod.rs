//! Sensors of a robot; their measurements are stacked in the order of the task file.
//!
//! A new kind is one file, and one line in the table at the end of this file.

use serde::Deserialize;
use supple_kernels::Scalar;

use super::Robot;
use super::compliance::{Element, Names, Unfit};
use super::situation::Situation;
use crate::file::{ReadError, Reader};
use crate::value::OneOrMore;
use crate::{Channel, Value};

mod coupling_force;
mod frame_point;
mod frame_pose;
mod frame_turn;
mod from_file;
mod joint_position;
mod joint_torque;
mod joint_velocity;

use coupling_force::CouplingForce;
use frame_point::FramePoint;
use frame_pose::FramePose;
pub(crate) use frame_pose::turn;
use frame_turn::FrameTurn;
use from_file::FromFile;
use joint_position::JointPosition;
use joint_torque::JointTorque;
use joint_velocity::JointVelocity;

/// A sensor and its noise.
#[derive(Clone, Debug)]
pub(super) struct Sensor {
    pub kind: Kind,
    /// Variance of each entry.
    pub variance: Vec<Value>,
}

/// What a sensor measures.
pub(super) trait Measure {
    /// How many numbers it gives.
    fn len(&self) -> usize;

    /// What the numbers are, for people.
    fn channels(&self, robot: &Robot) -> Vec<Channel>;

    /// The numbers, without noise.
    fn measure<S: Scalar>(&self, now: &Situation<S>, out: &mut [S]);
}

impl Measure for Sensor {
    fn len(&self) -> usize {
        self.kind.len()
    }

    fn channels(&self, robot: &Robot) -> Vec<Channel> {
        self.kind.channels(robot)
    }

    fn measure<S: Scalar>(&self, now: &Situation<S>, out: &mut [S]) {
        self.kind.measure(now, out);
    }
}

/// One variance for all entries of a sensor, or one each.
pub(super) type Variance = OneOrMore;

impl OneOrMore {
    /// The variance of each of `len` entries.
    pub(crate) fn each(self, len: usize) -> Result<Vec<Value>, Unfit> {
        match self.0 {
            list if list.len() == len => Ok(list),
            list if list.len() == 1 => Ok(vec![list[0]; len]),
            list => {
                let message =
                    format!("must be one number, or {len} of them, one per measurement; found {}", list.len());
                Err(("variance", message, None))
            }
        }
    }
}

/// What sensors may refer to by name.
pub(super) struct Context<'a> {
    pub names: Names<'a>,
    pub compliance: &'a [Element],
}

/// How a sensor is read from a task file.
pub(super) trait SensorFile: Sized {
    /// The keys of its table, but for `kind`.
    type File: for<'de> Deserialize<'de> + schemars::JsonSchema;

    /// The sensor with its noise, or what does not fit the robot.
    fn build(file: Self::File, context: &Context) -> Result<(Self, Variance), Unfit>;
}

/// The table of all kinds of sensor: name in the file, type.
macro_rules! sensor_kinds {
    ($($(#[$doc:meta])* $name:literal => $kind:ident,)*) => {
        /// A sensor, by kind.
        #[derive(Clone, Debug)]
        pub(super) enum Kind {
            $($(#[$doc])* $kind($kind),)*
        }

        impl Measure for Kind {
            fn len(&self) -> usize {
                match self { $(Self::$kind(kind) => kind.len(),)* }
            }
            fn channels(&self, robot: &Robot) -> Vec<Channel> {
                match self { $(Self::$kind(kind) => kind.channels(robot),)* }
            }
            fn measure<S: Scalar>(&self, now: &Situation<S>, out: &mut [S]) {
                match self { $(Self::$kind(kind) => kind.measure(now, out),)* }
            }
        }

        /// The names of all kinds, as files write them.
        pub(super) const KINDS: &[&str] = &[$($name),*];

        /// Reads the sensor of kind `kind` from its table, without the key `kind`; `None` where there is no such kind.
        pub(super) fn read(
            kind: &str,
            table: Reader,
            context: &Context,
        ) -> Option<Result<Result<Sensor, Unfit>, ReadError>> {
            match kind {
                $($name => Some(<$kind as SensorFile>::File::deserialize(table).map(|file| {
                    let (kind, variance) = $kind::build(file, context)?;
                    let variance = variance.each(kind.len())?;
                    Ok(Sensor { kind: Kind::$kind(kind), variance })
                })),)*
                _ => None,
            }
        }

        /// The schema of each kind's table, by name.
        pub(crate) fn schemas(generator: &mut schemars::SchemaGenerator) -> Vec<(&'static str, schemars::Schema)> {
            vec![$(($name, <<$kind as SensorFile>::File as schemars::JsonSchema>::json_schema(generator)),)*]
        }
    };
}

sensor_kinds! {
    /// Forces and torques in an element of compliance.
    "coupling_force" => CouplingForce,
    /// Sensors of the robot's file.
    "file" => FromFile,
    /// Position of a frame's origin.
    "frame_point" => FramePoint,
    /// Position and orientation of a frame.
    "frame_pose" => FramePose,
    /// Orientation of a frame.
    "frame_turn" => FrameTurn,
    /// Positions of joints, or of motors of elastic joints.
    "joint_position" => JointPosition,
    /// Torques through elastic joints.
    "joint_torque" => JointTorque,
    /// Velocities of joints, or of motors of elastic joints.
    "joint_velocity" => JointVelocity,
}
