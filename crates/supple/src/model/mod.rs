//! What an author writes: the physics of a robot and its environment, once, over any [`Scalar`].

use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde::{Deserialize, Serialize};
use supple_kernels::Scalar;

use crate::Value;
use crate::contacts::{Contact, ContactState};
use crate::cost::{Cost, Vocabulary};
use crate::file::{Document, FileError, Place};
use crate::parameters::Parameters;
use crate::scene::Picture;
use crate::system::{Authored, System};

mod equipped;
mod linear;
mod recorded;
mod robot;
mod start;
mod two_mass;

use equipped::Equipped;
pub(crate) use equipped::{Entry, Equipment};
pub use linear::Linear;
pub use recorded::{Instruction, Recorded, RecordedParts, Tape, TapeError, TapeParts};
pub use robot::Robot;
pub(crate) use robot::{locked_message, sensor_schemas, turn};
pub(crate) use start::{PoseFile, Start};
pub use two_mass::TwoMass;

/// How many numbers a model's vectors have.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Dimensions {
    /// Length of the state `x`.
    pub states: usize,
    /// Length of the control `u`.
    pub controls: usize,
    /// Length of the measurement `y`.
    pub measurements: usize,
}

impl Dimensions {
    /// Length of `z = (x, u)`.
    pub fn joint(self) -> usize {
        self.states + self.controls
    }
}

/// A number of a model's vectors, for people.
#[derive(Clone, Debug, Deserialize, PartialEq, Eq, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Channel {
    /// Its name.
    pub name: String,
    /// Its unit; empty where it is not known.
    #[serde(default)]
    pub unit: String,
}

impl Channel {
    /// A channel.
    pub fn new(name: impl Into<String>, unit: impl Into<String>) -> Self {
        Self { name: name.into(), unit: unit.into() }
    }

    fn numbered(prefix: &str, count: usize) -> Vec<Self> {
        (1..=count).map(|i| Self::new(format!("{prefix}{i}"), "")).collect()
    }
}

/// What the numbers of a model's vectors are.
#[derive(Clone, Debug, Default, Deserialize, PartialEq, Eq, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Channels {
    /// Of the state.
    pub states: Vec<Channel>,
    /// Of the control.
    pub controls: Vec<Channel>,
    /// Of the measurement.
    pub measurements: Vec<Channel>,
}

impl Channels {
    /// Named states without units; controls `u1`, `u2`...; measurements `y1`, `y2`...
    pub fn plain(states: Vec<String>, dimensions: Dimensions) -> Self {
        Self {
            states: states.into_iter().map(|name| Channel::new(name, "")).collect(),
            controls: Channel::numbered("u", dimensions.controls),
            measurements: Channel::numbered("y", dimensions.measurements),
        }
    }
}

/// Bounds of a state or control that the real thing has.
#[derive(Clone, Debug, PartialEq)]
pub struct Limit {
    /// What it is, for people: ``velocity of joint `elbow` ``.
    pub name: String,
    /// Which number it is about.
    pub of: Limited,
    /// The least it may be; may be infinite.
    pub lower: f64,
    /// The most it may be; may be infinite.
    pub upper: f64,
}

/// A state or a control.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Limited {
    /// The state with this index.
    State(usize),
    /// The control with this index.
    Control(usize),
}

impl Limit {
    /// Of a state.
    pub fn state(name: String, index: usize, lower: f64, upper: f64) -> Self {
        Self { name, of: Limited::State(index), lower, upper }
    }

    /// Of a control.
    pub fn control(name: String, index: usize, lower: f64, upper: f64) -> Self {
        Self { name, of: Limited::Control(index), lower, upper }
    }
}

/// A model's own cost, in a stage or at the end: a norm of a residual.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OwnCost {
    /// How many entries the residual has.
    pub residuals: usize,
    /// Whether the norm is convex at any parameters, so that its Gauss-Newton curvature is never indefinite. Where it
    /// is not, or that is not known, the curvature is made so at every point.
    pub convex: bool,
}

/// Where a model is evaluated.
#[derive(Clone, Copy, Debug)]
pub struct Point<'a, S> {
    /// State.
    pub x: &'a [S],
    /// Control. In measurements and final costs it is zero and must not matter.
    pub u: &'a [S],
    /// All parameters, in the order in which they were declared.
    pub phi: &'a [S],
    /// Time step, s.
    pub time_step: S,
    /// The unknowns that a step solves for (see [`Model::unknowns`]); empty in measurements, signals and costs.
    pub w: &'a [S],
}

impl<S: Scalar> Point<'_, S> {
    /// A value of the model's at this point: a number, or the parameter that it names.
    pub fn value(&self, value: Value) -> S {
        value.resolve(self.phi)
    }
}

/// A robot and its environment in discrete time: `x+ = f(x, u; phi) + w`, `y = g(x; phi) + v`.
///
/// One `impl` with the physics is all a new model needs: it is recorded once, and derivatives of every order come from
/// the record. Use no branch on values but [`Scalar::select`].
///
/// ```
/// use supple::{Dimensions, Model, Point, Scalar, Value};
///
/// /// A pendulum with a torque at its joint; its angle is measured.
/// struct Pendulum { length: Value }
///
/// impl Model for Pendulum {
///     fn dimensions(&self) -> Dimensions {
///         Dimensions { states: 2, controls: 1, measurements: 1 }
///     }
///     fn step<S: Scalar>(&self, at: &Point<S>, next: &mut [S]) {
///         let (angle, rate) = (at.x[0], at.x[1]);
///         next[0] = angle + at.time_step * rate;
///         next[1] = rate + at.time_step * (at.u[0] - angle.sin() * 9.81 / at.value(self.length));
///     }
///     fn observe<S: Scalar>(&self, at: &Point<S>, y: &mut [S]) {
///         y[0] = at.x[0];
///     }
/// }
/// ```
pub trait Model: Send + Sync + 'static {
    /// Lengths of state, control and measurement.
    fn dimensions(&self) -> Dimensions;

    /// The next state `f(x, u; phi)`, without noise.
    fn step<S: Scalar>(&self, at: &Point<S>, next: &mut [S]);

    /// The measurement `g(x; phi)`, without noise.
    fn observe<S: Scalar>(&self, at: &Point<S>, y: &mut [S]);

    /// How many unknowns `w` each step solves for, such as accelerations; [`Model::step`] finds them in its point.
    ///
    /// Derivatives of an equation are cheaper than those of its solution: a model of rigid bodies gives inverse
    /// dynamics in [`Model::balance`], and no derivative goes through the inversion of the mass matrix.
    fn unknowns(&self) -> usize {
        0
    }

    /// `r(x, u, w; phi)`, which is 0 at the unknowns, and linear in them.
    fn balance<S: Scalar>(&self, _at: &Point<S>, _residual: &mut [S]) {}

    /// `r_w`, symmetric positive definite, by rows.
    fn mass<S: Scalar>(&self, _at: &Point<S>, _matrix: &mut [S]) {}

    /// Names of the signals that costs may use beside state and control, such as a contact's penetration.
    fn signals(&self) -> Vec<String> {
        Vec::new()
    }

    /// The signals, in the order of their names.
    fn signal<S: Scalar>(&self, _at: &Point<S>, _out: &mut [S]) {}

    /// The model's own cost of a stage or of the end, beside the costs of the task; none where it has none.
    fn own_cost(&self, _last: bool) -> Option<OwnCost> {
        None
    }

    /// The residual of its own cost.
    fn own_residual<S: Scalar>(&self, _at: &Point<S>, _last: bool, _out: &mut [S]) {}

    /// Its own cost, given the residual: the norm. All else that the cost depends on is parameters and time step.
    fn own_norm<S: Scalar>(&self, _residual: &[S], _phi: &[S], _time_step: S, _last: bool) -> S {
        S::zero()
    }

    /// What states and controls must stay within for the real thing: reported where a plan does not.
    fn limits(&self) -> Vec<Limit> {
        Vec::new()
    }

    /// Its contacts, which are reported along plans; none in models without contacts.
    fn contacts(&self) -> Vec<Contact> {
        Vec::new()
    }

    /// The contacts at a point, in the order of [`Model::contacts`].
    fn contact_states(&self, _at: &Point<f64>) -> Vec<ContactState> {
        Vec::new()
    }

    /// Into how many steps of integration each time step is divided, where task files can choose that.
    fn substeps(&self) -> Option<usize> {
        None
    }

    /// The same model with contacts that set in over a length wider by a value, m, and are softer by as much, and with friction
    /// that sets in over a speed higher by a value, rad/s or m/s: with these planning finds contacts from afar, and gets
    /// friction moving. At 0 it is this model. None in models without contacts and friction.
    fn widened(&self, _length: Value, _speed: Value) -> Option<Self>
    where
        Self: Sized,
    {
        None
    }

    /// Names of the joints, each with the states `q.NAME` and `v.NAME`; none in models that have no joints.
    fn joint_names(&self) -> Vec<String> {
        Vec::new()
    }

    /// Names of the joints that a task has taken out, of which nothing may be asked.
    fn locked_joints(&self) -> Vec<String> {
        Vec::new()
    }

    /// Names of the elements of compliance, each with the signals `NAME.FORCE`; none in models that do not name theirs.
    fn coupling_names(&self) -> Vec<String> {
        Vec::new()
    }

    /// Names of the states, by which tasks select them: `x1`, `x2`... unless said otherwise.
    fn state_names(&self) -> Vec<String> {
        (1..=self.dimensions().states).map(|i| format!("x{i}")).collect()
    }

    /// What the numbers of state, control and measurement are, for people.
    fn channels(&self) -> Channels {
        Channels::plain(self.state_names(), self.dimensions())
    }

    /// What it looks like, with the forces between its bodies; none in models that cannot be drawn.
    ///
    /// Bodies, connections and landmarks are the same at every point, in the same order; only where they are changes.
    fn picture(&self, _at: &Point<f64>) -> Option<Picture> {
        None
    }

    /// Where the points are whose uncertainty is drawn, m in the world, in the order of [`Picture::landmarks`].
    fn landmarks<S: Scalar>(&self, _at: &Point<S>) -> Vec<[S; 3]> {
        Vec::new()
    }
}

/// How a model is read from a task file.
pub(crate) trait ModelFile: Model + Clone {
    /// The keys of `[model]`, but for `kind`.
    type File: schemars::JsonSchema;

    /// Reads `[model]`; files that it names are looked for in `folder`.
    fn read(document: &Document, parameters: &Parameters, folder: &Path) -> Result<Self, FileError>;

    /// Variances of the measurements, where the model knows them.
    fn variances(&self) -> Option<Vec<Value>> {
        None
    }

    /// Kinds of sensors that only such models may have, in catalogues too.
    fn sensor_kinds() -> &'static [&'static str] {
        &[]
    }

    /// Adds a sensor of one of these kinds, read from the table at a place; variances of its measurements, which come
    /// after all others.
    fn add_sensor(
        &mut self,
        kind: &str,
        document: &Document,
        _parameters: &Parameters,
        at: &[Place],
    ) -> Result<Vec<Value>, FileError> {
        Err(document.unknown_kind(at, kind, Self::sensor_kinds()))
    }

    /// The files that it names, but for meshes.
    fn files(&self) -> Vec<PathBuf> {
        Vec::new()
    }

    /// What of the files that it names is ignored or most likely wrong.
    fn warnings(&self) -> Vec<String> {
        Vec::new()
    }

    /// The same with a sentence for every single thing.
    fn every_warning(&self) -> Vec<String> {
        self.warnings()
    }

    /// Whether its first state need not be given, and may be given by a keyframe or a pose.
    fn starts_by_itself(&self) -> bool {
        false
    }

    /// The first state where nothing is said of single states, or what does not fit: the key, what is valid, and
    /// advice.
    fn first_state(&self, _start: &Start) -> Result<Vec<f64>, (&'static str, String, Option<String>)> {
        Ok(vec![0.0; self.dimensions().states])
    }

    /// States that are the same as another one where the first state does not name them: both places.
    fn followers(&self) -> Vec<(usize, usize)> {
        Vec::new()
    }

    /// More of the schema than [`ModelFile::File`] says.
    fn complete_schema(_schema: &mut serde_json::Value, _generator: &mut schemars::SchemaGenerator) {}
}

/// A model all of whose table serde reads.
pub(crate) trait PlainFile: Model + Clone + for<'de> Deserialize<'de> + schemars::JsonSchema {
    /// What is wrong with its numbers or shapes, given the parameters' bounds: the key, and what is valid.
    fn check(&self, parameters: &Parameters) -> Result<(), (&'static str, String)>;
}

impl<M: PlainFile> ModelFile for M {
    type File = M;

    fn read(document: &Document, parameters: &Parameters, _: &Path) -> Result<Self, FileError> {
        let at = ["model".into()];
        let (_, table) = document.table_with_kind(&at, KINDS)?;
        let model = Self::deserialize(table).map_err(|error| document.read_error(&at, error))?;
        model.check(parameters).map_err(|(key, message)| document.error(&["model".into(), key.into()], message))?;
        Ok(model)
    }
}

/// A model read from a file, of whatever kind.
pub(crate) trait AnyModel {
    fn dimensions(&self) -> Dimensions;
    fn variances(&self) -> Option<Vec<Value>>;
    fn files(&self) -> Vec<PathBuf>;
    fn warnings(&self) -> Vec<String>;
    fn every_warning(&self) -> Vec<String>;
    fn starts_by_itself(&self) -> bool;
    fn first_state(&self, start: &Start) -> Result<Vec<f64>, (&'static str, String, Option<String>)>;
    fn followers(&self) -> Vec<(usize, usize)>;
    fn vocabulary(&self) -> Vocabulary;
    fn channels(&self) -> Channels;
    fn system(&self, costs: Vec<Cost>, time_step: Value, parameters: usize) -> Arc<dyn System>;
    /// As of [`ModelFile`].
    fn sensor_kinds(&self) -> &'static [&'static str];
    /// As of [`ModelFile`].
    fn add_sensor(
        &mut self,
        kind: &str,
        document: &Document,
        parameters: &Parameters,
        at: &[Place],
    ) -> Result<Vec<Value>, FileError>;
    /// The same model with other measurements.
    fn equipped(self: Box<Self>, equipment: Equipment) -> Box<dyn AnyModel>;
    /// Its measurements, where they are not its own.
    fn equipment(&self) -> Option<&Equipment> {
        None
    }
}

impl<M: ModelFile> AnyModel for M {
    fn dimensions(&self) -> Dimensions {
        Model::dimensions(self)
    }
    fn variances(&self) -> Option<Vec<Value>> {
        ModelFile::variances(self)
    }
    fn files(&self) -> Vec<PathBuf> {
        ModelFile::files(self)
    }
    fn warnings(&self) -> Vec<String> {
        ModelFile::warnings(self)
    }
    fn every_warning(&self) -> Vec<String> {
        ModelFile::every_warning(self)
    }
    fn starts_by_itself(&self) -> bool {
        ModelFile::starts_by_itself(self)
    }
    fn first_state(&self, start: &Start) -> Result<Vec<f64>, (&'static str, String, Option<String>)> {
        ModelFile::first_state(self, start)
    }
    fn followers(&self) -> Vec<(usize, usize)> {
        ModelFile::followers(self)
    }
    fn vocabulary(&self) -> Vocabulary {
        Vocabulary::of(self)
    }
    fn channels(&self) -> Channels {
        Model::channels(self)
    }
    fn system(&self, costs: Vec<Cost>, time_step: Value, parameters: usize) -> Arc<dyn System> {
        Arc::new(Authored::new(self.clone(), costs, time_step, parameters))
    }
    fn sensor_kinds(&self) -> &'static [&'static str] {
        M::sensor_kinds()
    }
    fn add_sensor(
        &mut self,
        kind: &str,
        document: &Document,
        parameters: &Parameters,
        at: &[Place],
    ) -> Result<Vec<Value>, FileError> {
        ModelFile::add_sensor(self, kind, document, parameters, at)
    }
    fn equipped(self: Box<Self>, equipment: Equipment) -> Box<dyn AnyModel> {
        Box::new(Equipped { model: *self, equipment })
    }
}

/// The table of all kinds of model: name in the file, type.
macro_rules! model_kinds {
    ($($name:literal => $kind:ty,)*) => {
        /// The names of all kinds, as files write them.
        pub(crate) const KINDS: &[&str] = &[$($name),*];

        /// Reads `[model]` as the kind `kind`; `None` where there is no such kind.
        pub(crate) fn read(
            kind: &str,
            document: &Document,
            parameters: &Parameters,
            folder: &Path,
        ) -> Option<Result<Box<dyn AnyModel>, FileError>> {
            match kind {
                $($name => Some(
                    <$kind as ModelFile>::read(document, parameters, folder)
                        .map(|model| Box::new(model) as Box<dyn AnyModel>),
                ),)*
                _ => None,
            }
        }

        /// The schema of each kind's table, by name.
        pub(crate) fn schemas(generator: &mut schemars::SchemaGenerator) -> Vec<(&'static str, serde_json::Value)> {
            vec![$(($name, {
                let mut schema = <<$kind as ModelFile>::File as schemars::JsonSchema>::json_schema(generator).to_value();
                <$kind as ModelFile>::complete_schema(&mut schema, generator);
                schema
            }),)*]
        }
    };
}

model_kinds! {
    "linear" => Linear,
    "robot" => Robot,
    "two_mass" => TwoMass,
}
