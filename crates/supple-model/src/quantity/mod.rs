//! Quantities: numbers of a robot that sensors measure, costs weigh, limits bound and curves show.
//!
//! To add a kind, write one file and one line in the list of `library.rs`; kinds of other crates are added to
//! [`Kinds`](crate::Kinds).
//!
//! # Numbers of quantities
//!
//! ```
//! use supple_model::quantity::{ContactForce, Known, Penetration, Quantity, Sensor, Signal};
//! use supple_model::quantity::{StateAndControl, Vocabulary};
//! use supple_model::{Model, Point, TwoMass};
//!
//! let model = TwoMass {
//!     mass: [0.8.into(), 0.4.into()],
//!     damping: [60.0.into(), 35.0.into()],
//!     stiffness: [300.0.into(), 200.0.into()],
//!     contact_smoothing: 0.0.into(),
//! };
//! let vocabulary = Vocabulary::of(&model);
//! let force: Quantity = ContactForce::new(vocabulary.contact_signal(None, "contact_force")?).into();
//! let depth: Quantity = Penetration::new(vocabulary.contact_signal(None, "penetration")?).into();
//!
//! // The second mass is 0.02 m inside the wall.
//! let at: Point<f64> = Point { x: &[0.0, 0.0, 0.77, 0.0, 0.75], u: &[1.0], phi: &[], time_step: 0.02, w: &[] };
//! let mut signals = [0.0; 2];
//! model.signal(&at, &mut signals);
//! let known = Known { signals: &signals, ..Known::NONE };
//! assert!((force.values(&at, &known)[0] - 4.0).abs() < 1e-9);
//! assert!((depth.values(&at, &known)[0] - 0.02).abs() < 1e-9);
//! assert_eq!(Quantity::from(Signal::new([0, 1])).values(&at, &known), signals);
//! assert_eq!(Quantity::from(StateAndControl::new(5, 1)).values(&at, &known)[5], 1.0);
//!
//! // A sensor is a quantity with noise: here 0.1 N^2.
//! let sensor = Sensor { channels: force.channels(&vocabulary), quantity: force, variances: vec![0.1.into()] };
//! assert_eq!(sensor.channels[0].unit, "N");
//! # Ok::<(), supple_model::quantity::Unfit>(())
//! ```

use std::fmt::Debug;

use supple_kernels::Scalar;

use crate::channels::Channel;
use crate::parameters::Parameters;
use crate::physics::Point;

mod any;
mod center_of_mass;
mod clearance;
mod contact_force;
mod control;
mod coupling_deflection;
mod coupling_force;
mod drive_effort;
mod frame_point;
mod frame_pose;
mod frame_turn;
mod frame_velocity;
mod from_file;
mod joint_acceleration;
mod joint_position;
mod joint_torque;
mod joint_velocity;
mod kinds;
mod library;
mod penetration;
mod power;
mod sensor;
mod signal;
mod state;
mod state_and_control;
mod vocabulary;

pub use crate::document::NoKeys;
pub use crate::document::Unfit;
pub use any::Quantity;
pub(crate) use any::signals_for;
pub use center_of_mass::CenterOfMass;
pub use clearance::Clearance;
pub use contact_force::ContactForce;
pub use control::Control;
pub use coupling_deflection::CouplingDeflection;
pub use coupling_force::CouplingForce;
pub use drive_effort::DriveEffort;
pub use frame_point::FramePoint;
pub use frame_pose::FramePose;
pub use frame_turn::FrameTurn;
pub use frame_velocity::FrameVelocity;
pub use from_file::FromFile;
pub use joint_acceleration::JointAcceleration;
pub use joint_position::JointPosition;
pub use joint_torque::JointTorque;
pub use joint_velocity::JointVelocity;
pub use kinds::QuantityFile;
pub use kinds::{Context, Kinds};
pub use penetration::Penetration;
pub use power::Power;
#[cfg(feature = "schema")]
pub use sensor::sensor_schemas;
pub use sensor::{Noise, Sensor, read_sensor};
pub use signal::Signal;
pub use state::State;
pub use state_and_control::StateAndControl;
pub use vocabulary::Vocabulary;

/// Inputs of quantities besides state, control and parameters.
///
/// Example: the [module](crate::quantity).
#[derive(Clone, Copy, Debug)]
pub struct Known<'a, S> {
    /// The model's signals.
    pub signals: &'a [S],
    /// The next state; empty if nothing needs it.
    pub next: &'a [S],
    /// The model's signals during the first of several sub-steps; empty if nothing needs them.
    pub early: &'a [S],
}

impl<S> Known<'_, S> {
    /// No signals and no next state.
    pub const NONE: Self = Known { signals: &[], next: &[], early: &[] };
}

/// How many of a model's numbers there must be for a quantity to be read.
///
/// ```
/// use supple_model::quantity::{Control, Quantity, Reach, State};
///
/// assert_eq!(Quantity::from(State::new([0, 4])).reach(), Reach { states: 5, ..Reach::default() });
/// assert_eq!(Quantity::from(Control::all(2)).reach(), Reach { controls: 2, ..Reach::default() });
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Reach {
    /// States.
    pub states: usize,
    /// Controls.
    pub controls: usize,
    /// Signals.
    pub signals: usize,
}

impl Reach {
    /// One more than the highest index.
    fn beyond(selected: &[usize]) -> usize {
        selected.iter().map(|place| place + 1).max().unwrap_or(0)
    }
}

/// What a kind of quantity defines: its numbers.
///
/// ```
/// use supple_model::quantity::{Known, Measurable, Vocabulary};
/// use supple_model::{Channel, Point, Scalar};
///
/// /// Speed of a body whose velocity components are two states.
/// #[derive(Debug)]
/// struct Speed { velocity: [usize; 2] }
///
/// impl Measurable for Speed {
///     const NAME: &'static str = "speed";
///     fn len(&self) -> usize {
///         1
///     }
///     fn channels(&self, _: &Vocabulary) -> Vec<Channel> {
///         vec![Channel::new("speed", "m/s")]
///     }
///     fn evaluate<S: Scalar>(&self, at: &Point<S>, _: &Known<S>, out: &mut [S]) {
///         let [vx, vy] = self.velocity.map(|place| at.x[place]);
///         out[0] = (vx.square() + vy.square() + 1e-6).sqrt();
///     }
/// }
/// ```
pub trait Measurable: Debug + Send + Sync + 'static {
    /// The name of the kind, as files write it.
    const NAME: &'static str;

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

    /// Whether it depends on the control. If so, it is excluded from the final cost, and sensors measure what it was in
    /// the last step, as controls are chosen after measuring.
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

    /// Whether it takes signals [during](crate::Model::signal_during) a step, of drives that act at its end.
    fn needs_signals_during(&self) -> bool {
        false
    }

    /// Whether it takes signals during the first sub-step of a step, where drives that act at the end of sub-steps exert most
    /// after a change of their controls.
    fn needs_signals_early(&self) -> bool {
        false
    }

    /// The state of which an entry is the change over a time step, per time; `None` for all other entries. Only such
    /// entries may depend on the next state where they are measured.
    fn rate_of(&self, _entry: usize) -> Option<usize> {
        None
    }

    /// How many targets a cost must give if it gives any; the remaining targets are 0.
    fn least_targets(&self) -> usize {
        self.len()
    }

    /// Whether a target is required, because a default of 0 would make no sense.
    fn needs_target(&self) -> bool {
        false
    }

    /// Index of the signal, if this entry is a signal of the model.
    fn signal_of(&self, _entry: usize) -> Option<usize> {
        None
    }

    /// If this is the depth of a contact, or minus that: the index of its signal, and the depth, m, that a target asks for.
    fn depth_of(&self, _target: f64) -> Option<(usize, f64)> {
        None
    }

    /// How many of the model's states, controls and signals there must be: one more than the highest index of each that it reads.
    fn reach(&self) -> Reach {
        Reach::default()
    }

    /// What is wrong with its numbers, given the parameters' bounds: the key, and what is valid.
    fn check(&self, _parameters: &Parameters) -> Result<(), Unfit> {
        Ok(())
    }
}

/// Selected entries of a vector.
fn pick<S: Copy>(from: &[S], places: &[usize], out: &mut [S]) {
    for (out, &place) in out.iter_mut().zip(places) {
        *out = from[place];
    }
}
