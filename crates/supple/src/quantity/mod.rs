//! Quantities: numbers of a robot that sensors measure, costs weigh, limits bound and curves show.
//!
//! A new kind is one file, and one line in the table at the end of this file.

use serde::Deserialize;
use supple_kernels::Scalar;

use crate::channels::Channel;
use crate::document::{Document, FileError, Place, ReadError, Reader};
use crate::parameters::Parameters;
use crate::physics::Point;

mod center_of_mass;
mod clearance;
mod contact_force;
mod control;
mod coupling_deflection;
mod coupling_force;
mod frame_point;
mod frame_pose;
mod frame_turn;
mod frame_velocity;
mod from_file;
mod joint_acceleration;
mod joint_position;
mod joint_torque;
mod joint_velocity;
mod penetration;
mod power;
mod sensor;
mod signal;
mod state;
mod state_and_control;
mod vocabulary;

pub use center_of_mass::CenterOfMass;
pub use clearance::Clearance;
pub use contact_force::ContactForce;
pub use control::Control;
pub use coupling_deflection::CouplingDeflection;
pub use coupling_force::CouplingForce;
pub use frame_point::FramePoint;
pub use frame_pose::FramePose;
pub use frame_turn::FrameTurn;
pub use frame_velocity::FrameVelocity;
pub use from_file::FromFile;
pub use joint_acceleration::JointAcceleration;
pub use joint_position::JointPosition;
pub use joint_torque::JointTorque;
pub use joint_velocity::JointVelocity;
pub use penetration::Penetration;
pub use power::Power;
pub(crate) use sensor::{Noise, Sensor, read_sensor, sensor_schemas};
pub use signal::Signal;
pub use state::State;
pub use state_and_control::StateAndControl;
pub use vocabulary::{Unfit, Vocabulary};

/// What is known at a point beside state, control and parameters.
#[derive(Clone, Copy, Debug)]
pub struct Known<'a, S> {
    /// The model's signals.
    pub signals: &'a [S],
    /// The next state; empty where nothing needs it.
    pub next: &'a [S],
}

impl<S> Known<'_, S> {
    /// Nothing.
    pub const NONE: Self = Known { signals: &[], next: &[] };
}

/// What a kind of quantity defines: its numbers.
pub trait Measurable {
    /// How many numbers it has.
    fn len(&self) -> usize;

    /// Whether it has no numbers.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Names and units of its numbers, for people.
    fn channels(&self, vocabulary: &Vocabulary) -> Vec<Channel>;

    /// Its numbers at a point.
    fn evaluate<S: Scalar>(&self, at: &Point<S>, known: &Known<S>, out: &mut [S]);

    /// The same as a list.
    fn values<S: Scalar>(&self, at: &Point<S>, known: &Known<S>) -> Vec<S> {
        let mut values = vec![S::zero(); self.len()];
        self.evaluate(at, known, &mut values);
        values
    }

    /// Whether it depends on the control: then it has no part in the final cost, and cannot be measured, as controls
    /// are chosen after measuring.
    fn depends_on_control(&self) -> bool {
        false
    }

    /// Whether it depends on the model's signals.
    fn needs_signals(&self) -> bool {
        true
    }

    /// Whether it depends on the next state.
    fn needs_next(&self) -> bool {
        false
    }

    /// How many targets a cost must give where it gives any; the target of all others is 0.
    fn least_targets(&self) -> usize {
        self.len()
    }

    /// Whether 0 is no target that anybody means by leaving it out.
    fn needs_target(&self) -> bool {
        false
    }

    /// The place among the model's signals of a number that follows one signal.
    fn signal_of(&self, _entry: usize) -> Option<usize> {
        None
    }

    /// What is wrong with its numbers, given the parameters' bounds: the key, and what is valid.
    fn check(&self, _parameters: &Parameters) -> Result<(), (&'static str, String)> {
        Ok(())
    }
}

/// How a kind of quantity is read from a task file.
pub(crate) trait QuantityFile: Sized {
    /// The keys of its table, but for `kind` and those of what it is used for.
    type File: for<'de> Deserialize<'de> + schemars::JsonSchema;

    /// Whether all of this kind depend on the control.
    const OF_CONTROL: bool = false;

    /// The quantity, or what does not fit the model.
    fn build(file: Self::File, vocabulary: &Vocabulary) -> Result<Self, Unfit>;
}

/// Reads the quantity of kind `kind` from its own keys of a table at a place.
///
/// # Errors
/// Where there is no such kind, or the table is wrong or does not fit the model.
pub(crate) fn read(
    (kind, table): (&str, Reader),
    (document, at): (&Document, &[Place]),
    (vocabulary, parameters): (&Vocabulary, &Parameters),
) -> Result<Quantity, FileError> {
    let quantity = build(kind, table, vocabulary)
        .ok_or_else(|| document.unknown_kind(at, kind, Quantity::NAMES))?
        .map_err(|error| document.read_error(at, error))?
        .map_err(|unfit| unfit.at(document, at))?;
    quantity.check(parameters).map_err(|(key, message)| Unfit::new(key, message).at(document, at))?;
    Ok(quantity)
}

/// A quantity without keys of its own.
#[derive(Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct NoKeys {}

/// Selected entries of a vector.
fn pick<S: Copy>(from: &[S], places: &[usize], out: &mut [S]) {
    for (out, &place) in out.iter_mut().zip(places) {
        *out = from[place];
    }
}

/// The table of all kinds of quantity: name in the file, type.
macro_rules! quantity_kinds {
    ($($(#[$doc:meta])* $name:literal => $kind:ident,)*) => {
        /// A quantity, by kind.
        #[derive(Clone, Debug)]
        #[non_exhaustive]
        pub enum Quantity {
            $($(#[$doc])* $kind($kind),)*
        }

        $(impl From<$kind> for Quantity {
            fn from(kind: $kind) -> Self {
                Self::$kind(kind)
            }
        })*

        impl Measurable for Quantity {
            fn len(&self) -> usize {
                match self { $(Self::$kind(kind) => kind.len(),)* }
            }
            fn channels(&self, vocabulary: &Vocabulary) -> Vec<Channel> {
                match self { $(Self::$kind(kind) => kind.channels(vocabulary),)* }
            }
            fn evaluate<S: Scalar>(&self, at: &Point<S>, known: &Known<S>, out: &mut [S]) {
                match self { $(Self::$kind(kind) => kind.evaluate(at, known, out),)* }
            }
            fn depends_on_control(&self) -> bool {
                match self { $(Self::$kind(kind) => kind.depends_on_control(),)* }
            }
            fn needs_signals(&self) -> bool {
                match self { $(Self::$kind(kind) => kind.needs_signals(),)* }
            }
            fn needs_next(&self) -> bool {
                match self { $(Self::$kind(kind) => kind.needs_next(),)* }
            }
            fn least_targets(&self) -> usize {
                match self { $(Self::$kind(kind) => kind.least_targets(),)* }
            }
            fn needs_target(&self) -> bool {
                match self { $(Self::$kind(kind) => kind.needs_target(),)* }
            }
            fn signal_of(&self, entry: usize) -> Option<usize> {
                match self { $(Self::$kind(kind) => kind.signal_of(entry),)* }
            }
            fn check(&self, parameters: &Parameters) -> Result<(), (&'static str, String)> {
                match self { $(Self::$kind(kind) => kind.check(parameters),)* }
            }
        }

        impl Quantity {
            /// The names of all kinds, as files write them.
            pub const NAMES: &[&str] = &[$($name),*];

            /// The name of its kind.
            pub fn name(&self) -> &'static str {
                match self { $(Self::$kind(_) => $name,)* }
            }
        }

        /// The quantity of kind `kind`, from its own keys of a table; `None` where there is no such kind.
        fn build(
            kind: &str,
            table: Reader,
            vocabulary: &Vocabulary,
        ) -> Option<Result<Result<Quantity, Unfit>, ReadError>> {
            match kind {
                $($name => Some(<$kind as QuantityFile>::File::deserialize(table).map(|file| {
                    $kind::build(file, vocabulary).map(Quantity::$kind)
                })),)*
                _ => None,
            }
        }

        /// Whether all quantities of a kind depend on the control.
        pub(crate) fn is_of_control(kind: &str) -> bool {
            match kind { $($name => <$kind as QuantityFile>::OF_CONTROL,)* _ => false }
        }

        /// The schema of each kind's own keys, by name.
        pub(crate) fn schemas(generator: &mut schemars::SchemaGenerator) -> Vec<(&'static str, schemars::Schema)> {
            vec![$(($name, <<$kind as QuantityFile>::File as schemars::JsonSchema>::json_schema(generator)),)*]
        }
    };
}

quantity_kinds! {
    /// The centre of mass of a robot.
    "center_of_mass" => CenterOfMass,
    /// Distance between a contact's body and its wall.
    "clearance" => Clearance,
    /// Normal force of a contact.
    "contact_force" => ContactForce,
    /// Controls.
    "control" => Control,
    /// How far compliance is from rest.
    "coupling_deflection" => CouplingDeflection,
    /// Forces in compliance.
    "coupling_force" => CouplingForce,
    /// What sensors of the robot's file measure.
    "file" => FromFile,
    /// Position of a frame's origin.
    "frame_point" => FramePoint,
    /// Position and orientation of a frame.
    "frame_pose" => FramePose,
    /// Orientation of a frame.
    "frame_turn" => FrameTurn,
    /// Velocity of a frame.
    "frame_velocity" => FrameVelocity,
    /// Accelerations of joints.
    "joint_acceleration" => JointAcceleration,
    /// Positions of joints, or of motors of elastic joints.
    "joint_position" => JointPosition,
    /// Torques through elastic joints.
    "joint_torque" => JointTorque,
    /// Velocities of joints, or of motors of elastic joints.
    "joint_velocity" => JointVelocity,
    /// Signed depth of a contact.
    "penetration" => Penetration,
    /// Mechanical power of drives.
    "power" => Power,
    /// Signals of the model.
    "signal" => Signal,
    /// States.
    "state" => State,
    /// State and control stacked.
    "state_and_control" => StateAndControl,
}
