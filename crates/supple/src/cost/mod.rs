//! Costs: `l(x, u) = sum of terms`, each a weight times a norm of a residual.
//!
//! A new kind is one file with its residual, and one line in the table at the end of this file.

use serde::Deserialize;
use supple_kernels::Scalar;

use crate::file::{ReadError, Reader};
use crate::parameters::Parameters;
use crate::{Model, Point, Value};

mod contact_force;
mod control;
mod coupling_force;
mod frame_point;
mod frame_pose;
mod joint_position;
mod joint_velocity;
mod penetration;
mod quadratic;
mod state;

pub use contact_force::ContactForce;
pub use control::Control;
pub use coupling_force::CouplingForce;
pub use frame_point::FramePoint;
pub use frame_pose::FramePose;
pub use joint_position::JointPosition;
pub use joint_velocity::JointVelocity;
pub use penetration::Penetration;
pub use quadratic::Quadratic;
pub use state::State;

/// What a cost may refer to: the names and sizes of the model.
#[derive(Clone, Debug)]
pub struct Vocabulary {
    /// Names of the states.
    pub states: Vec<String>,
    /// Names of the joints, of which `q.NAME` and `v.NAME` are states.
    pub joints: Vec<String>,
    /// Names of the joints that a task has taken out.
    pub locked: Vec<String>,
    /// How many controls there are.
    pub controls: usize,
    /// Names of the model's signals.
    pub signals: Vec<String>,
    /// Names of the elements of compliance, of which `NAME.FORCE` are signals.
    pub couplings: Vec<String>,
}

impl Vocabulary {
    /// The names and sizes of a model.
    pub fn of<M: Model>(model: &M) -> Self {
        Self {
            states: model.state_names(),
            joints: model.joint_names(),
            locked: model.locked_joints(),
            controls: model.dimensions().controls,
            signals: model.signals(),
            couplings: model.coupling_names(),
        }
    }

    /// What is wrong with the name of a joint or of a state, where that is one of a locked joint.
    fn if_locked(&self, key: &'static str, name: &str) -> Option<CostError> {
        let (message, help) = crate::model::locked_message(name, &self.locked)?;
        Some(CostError { help: Some(help), ..CostError::new(key, message) })
    }

    /// The place of the signal `SIGNAL` of something named, `NAME.SIGNAL`; `key` is the one that names it, `what` what
    /// it is.
    pub fn signal_of(&self, key: &'static str, what: &str, name: &str, signal: &str) -> Result<usize, CostError> {
        let whole = format!("{name}.{signal}");
        let place = self.signals.iter().position(|other| *other == whole);
        place.ok_or_else(|| {
            let named: Vec<_> = self.with_signal(signal).collect();
            CostError::unknown(key, &format!("the model has no {what} `{name}`"), name, &named)
        })
    }

    /// What has a signal `NAME.SIGNAL`.
    fn with_signal<'a>(&'a self, signal: &'a str) -> impl Iterator<Item = &'a str> {
        self.signals.iter().filter_map(move |other| other.strip_suffix(signal)?.strip_suffix('.'))
    }

    /// The place of the signal `FORCE` of an element of compliance; `coupling` and `select` are the keys that name them.
    pub fn force_of(&self, coupling: &str, force: &str) -> Result<usize, CostError> {
        if !self.couplings.iter().any(|other| other == coupling) {
            let what = format!("the model has no compliance `{coupling}`");
            return Err(CostError::unknown("coupling", &what, coupling, &self.couplings));
        }
        let whole = format!("{coupling}.{force}");
        self.signals.iter().position(|other| *other == whole).ok_or_else(|| {
            let forces = self.signals.iter().filter_map(|other| other.strip_prefix(coupling)?.strip_prefix('.'));
            CostError::unknown("select", &format!("`{coupling}` has no `{force}`"), force, &forces.collect::<Vec<_>>())
        })
    }

    /// The place of a contact's signal, by the contact's name where the model has named ones.
    pub fn contact_signal(&self, contact: Option<&str>, signal: &'static str) -> Result<usize, CostError> {
        match contact {
            Some(name) => self.signal_of("contact", "contact", name, signal),
            None => self.signals.iter().position(|other| other == signal).ok_or_else(|| {
                let named: Vec<_> = self.with_signal(signal).collect();
                if named.is_empty() {
                    return CostError::new("kind", format!("the model has no contact: it has no signal `{signal}`"));
                }
                let message = format!("is missing: the model has {}", supple_files::quoted(&named));
                CostError { help: Some("name the contact".into()), ..CostError::new("contact", message) }
            }),
        }
    }
}

/// A cost that does not fit its model: the key that is wrong, and what is valid.
#[derive(Clone, Debug, thiserror::Error)]
#[error("{key}: {message}")]
pub struct CostError {
    /// Key in the cost's table.
    pub key: &'static str,
    /// What was found and what is valid.
    pub message: String,
    /// Advice, where there is any.
    pub help: Option<String>,
}

impl CostError {
    /// Without advice.
    pub fn new(key: &'static str, message: impl Into<String>) -> Self {
        Self { key, message: message.into(), help: None }
    }

    /// A name that is none of `valid`: `what` says so. With the nearest of them as advice.
    fn unknown<T: AsRef<str>>(key: &'static str, what: &str, name: &str, valid: &[T]) -> Self {
        let message = format!("{what}: {}", supple_files::owned(valid));
        Self { key, message, help: supple_files::nearest(name, valid) }
    }
}

/// How the residual `r` becomes a number.
#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq, schemars::JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Norm {
    /// `r^2`
    #[default]
    Quadratic,
    /// `sqrt(r^2 + s^2) - s`: about `|r|` beyond `s`
    Absolute {
        /// `s`, in the residual's unit, above 0.
        smoothing: Value,
    },
}

/// The weights of a residual's entries in a stage or in the final cost.
#[derive(Clone, Debug, PartialEq)]
pub enum Weights {
    /// One weight for all entries.
    Equal(Value),
    /// A weight matrix `M`: `r' M r`, whole for every norm but used with the quadratic one only.
    Matrix(Vec<Vec<Value>>),
}

impl Weights {
    /// Whether every weight is the number 0.
    pub fn are_zero(&self) -> bool {
        match self {
            Self::Equal(weight) => weight.is_zero(),
            Self::Matrix(rows) => rows.iter().flatten().all(|weight| weight.is_zero()),
        }
    }

    /// Whether every weight is 0 at `phi`.
    pub fn are_zero_at(&self, phi: &[f64]) -> bool {
        let is_zero = |weight: &Value| weight.resolve::<f64>(phi) == 0.0;
        match self {
            Self::Equal(weight) => is_zero(weight),
            Self::Matrix(rows) => rows.iter().flatten().all(is_zero),
        }
    }
}

/// The part of a cost that its kind defines: the residual.
pub trait Residual {
    /// How many entries the residual has.
    fn len(&self) -> usize;

    /// Whether the residual has no entries.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// What is wrong with its numbers, given the parameters' bounds: the key, and what is valid.
    fn check(&self, _parameters: &Parameters) -> Result<(), (&'static str, String)> {
        Ok(())
    }

    /// The signals that it wants at a value other than 0, with that value: their places among the model's signals.
    fn wanted(&self, _phi: &[f64]) -> Vec<(usize, f64)> {
        Vec::new()
    }

    /// The residual at a point, given the model's signals there.
    fn evaluate<S: Scalar>(&self, at: &Point<S>, signals: &[S], out: &mut [S]);
}

/// One term of a task's cost.
#[derive(Clone, Debug)]
pub struct Cost {
    /// The residual.
    pub kind: CostKind,
    /// How it becomes a number.
    pub norm: Norm,
    /// Weights at steps 0 to N - 1.
    pub stage: Weights,
    /// Weights at step N.
    pub last: Weights,
}

/// The targets that a file gives for `count` things, 0 where it gives none; `what` is what they are.
fn targets(given: Option<Vec<Value>>, count: usize, what: &str) -> Result<Vec<Value>, CostError> {
    let targets = given.unwrap_or_else(|| vec![Value::Number(0.0); count]);
    if targets.len() == count {
        return Ok(targets);
    }
    let message = format!("{} targets for {count} {what}: give one each", targets.len());
    Err(CostError::new("target", message))
}

impl Cost {
    /// A residual with one weight for all of its entries; the final one is that of the stages where left out.
    fn weighed(kind: CostKind, norm: Norm, weight: Value, final_weight: Option<Value>) -> Self {
        let last = Weights::Equal(final_weight.unwrap_or(weight));
        Self { kind, norm, stage: Weights::Equal(weight), last }
    }

    /// The weights of a stage or of the end.
    pub fn weights(&self, last: bool) -> &Weights {
        if last { &self.last } else { &self.stage }
    }

    /// Whether it counts at `phi`, in a stage or at the end.
    pub fn counts(&self, phi: &[f64]) -> bool {
        !(self.stage.are_zero_at(phi) && self.last.are_zero_at(phi))
    }

    /// What is wrong with the weights or the norm, given the parameters' bounds: the key, and what is valid.
    pub(crate) fn check(&self, parameters: &Parameters) -> Result<(), (&'static str, String)> {
        for (key, weights) in [("weight", &self.stage), ("final_weight", &self.last)] {
            if let Weights::Equal(weight) = weights
                && let Some(least) = parameters.least(*weight).filter(|&least| least < 0.0)
            {
                return Err((key, format!("must be at least 0; {}", weight.found(least))));
            }
        }
        if let Norm::Absolute { smoothing } = self.norm
            && let Some(least) = parameters.least(smoothing).filter(|&least| least <= 0.0)
        {
            return Err(("norm", format!("its smoothing must be above 0; {}", smoothing.found(least))));
        }
        self.kind.check(parameters)
    }

    /// The cost of a residual.
    pub fn of_residual<S: Scalar>(&self, r: &[S], phi: &[S], last: bool) -> S {
        let mut sum = S::zero();
        match (self.weights(last), self.norm) {
            (Weights::Equal(weight), Norm::Quadratic) => {
                for &r in r {
                    sum = r.mul_add(r, sum);
                }
                weight.resolve(phi) * sum
            }
            (Weights::Equal(weight), Norm::Absolute { smoothing }) => {
                let s: S = smoothing.resolve(phi);
                for &r in r {
                    sum += r.mul_add(r, s * s).sqrt() - s;
                }
                weight.resolve(phi) * sum
            }
            (Weights::Matrix(rows), _) => {
                for (row, &left) in rows.iter().zip(r) {
                    for (&weight, &right) in row.iter().zip(r) {
                        if !weight.is_zero() {
                            sum = (weight.resolve(phi) * left).mul_add(right, sum);
                        }
                    }
                }
                sum
            }
        }
    }
}

/// The table of all kinds of cost: name in the file, type, file.
macro_rules! cost_kinds {
    ($($(#[$doc:meta])* $name:literal => $kind:ident,)*) => {
        /// The residual of a cost, by kind.
        #[derive(Clone, Debug)]
        pub enum CostKind {
            $($(#[$doc])* $kind($kind),)*
        }

        impl Residual for CostKind {
            fn len(&self) -> usize {
                match self { $(Self::$kind(kind) => kind.len(),)* }
            }
            fn check(&self, parameters: &Parameters) -> Result<(), (&'static str, String)> {
                match self { $(Self::$kind(kind) => kind.check(parameters),)* }
            }
            fn wanted(&self, phi: &[f64]) -> Vec<(usize, f64)> {
                match self { $(Self::$kind(kind) => kind.wanted(phi),)* }
            }
            fn evaluate<S: Scalar>(&self, at: &Point<S>, signals: &[S], out: &mut [S]) {
                match self { $(Self::$kind(kind) => kind.evaluate(at, signals, out),)* }
            }
        }

        impl CostKind {
            /// The names of all kinds, as files write them.
            pub const NAMES: &[&str] = &[$($name),*];

            /// The name of its kind.
            pub fn name(&self) -> &'static str {
                match self { $(Self::$kind(_) => $name,)* }
            }
        }

        /// Reads the cost of kind `kind` from its table, without the key `kind`; `None` where there is no such kind.
        pub(crate) fn read(
            kind: &str,
            table: Reader,
            vocabulary: &Vocabulary,
        ) -> Option<Result<Result<Cost, CostError>, ReadError>> {
            match kind {
                $($name => Some(<$kind as CostFile>::File::deserialize(table).map(|file| $kind::build(file, vocabulary))),)*
                _ => None,
            }
        }

        /// The schema of each kind's table, by name.
        pub(crate) fn schemas(generator: &mut schemars::SchemaGenerator) -> Vec<(&'static str, schemars::Schema)> {
            vec![$(($name, <<$kind as CostFile>::File as schemars::JsonSchema>::json_schema(generator)),)*]
        }
    };
}

/// How a kind of cost is read from a task file.
pub(crate) trait CostFile: Sized {
    /// The keys of its table, but for `kind`.
    type File: for<'de> Deserialize<'de> + schemars::JsonSchema;

    /// The cost, or what does not fit the model.
    fn build(file: Self::File, vocabulary: &Vocabulary) -> Result<Cost, CostError>;
}

cost_kinds! {
    /// Force of a contact against a target.
    "contact_force" => ContactForce,
    /// All controls.
    "control" => Control,
    /// Forces in compliance against targets.
    "coupling_force" => CouplingForce,
    /// The origin of a frame against a target.
    "frame_point" => FramePoint,
    /// A frame against a target.
    "frame_pose" => FramePose,
    /// Positions of joints against targets.
    "joint_position" => JointPosition,
    /// Velocities of joints against targets.
    "joint_velocity" => JointVelocity,
    /// Signed depth of a contact.
    "penetration" => Penetration,
    /// `x'Qx + u'Ru`.
    "quadratic" => Quadratic,
    /// Selected states against targets.
    "state" => State,
}
