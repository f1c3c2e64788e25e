//! The kinds of model that task files name, and how they are read.
//!
//! ```text
//! bodies -> compliance -> kinds -> robot        parts of robots, and other kinds that files may name
//!                         linear, recorded, two_mass
//! ```
//!
//! # A linear model
//!
//! ```
//! use supple_model::system::{Authored, System};
//! use supple_model::{Linear, Value};
//!
//! let row = |entries: &[f64]| entries.iter().map(|&entry| Value::Number(entry)).collect::<Vec<_>>();
//! let model = Linear {
//!     A: vec![row(&[1.0, 0.1]), row(&[0.0, 1.0])],
//!     B: vec![row(&[0.0]), row(&[0.1])],
//!     C: vec![row(&[1.0, 0.0])],
//! };
//! let mut next = [0.0; 2];
//! Authored::new(model, Vec::new(), 0.1, 0).step(0, &[0.0, 1.0], &[2.0], &[], &mut next);
//! assert!((next[0] - 0.1).abs() < 1e-12 && (next[1] - 1.2).abs() < 1e-12);
//! ```

use std::path::PathBuf;
use std::sync::Arc;
use supple_lqg::Dimensions;

use serde::Deserialize;

use crate::Value;
use crate::channels::{Channel, Channels, Limit};
use crate::cost::Cost;
use crate::document::{Described, FileError};
use crate::followed::Followed;
use crate::parameters::Parameters;
use crate::physics::{FileSensor, Model, OwnCost, Point};
use crate::quantity::{Sensor, Unfit, Vocabulary};
use crate::system::{Authored, System};

mod bodies;
mod compliance;
pub mod coupling;
mod equipped;
mod kinds;
mod linear;
mod recorded;
mod robot;
mod start;
mod two_mass;

use equipped::Equipped;
pub use equipped::{Entry, Equipment, Recalled};
pub use kinds::{Kinds, Source};
pub use linear::Linear;
pub use recorded::{Instruction, Recorded, RecordedParts, Tape, TapeError, TapeParts};
pub use robot::Robot;
pub use start::{PoseFile, Start};
pub use two_mass::TwoMass;

/// How a model is read from a task file.
///
/// Most models implement [`PlainFile`] instead, which has an example.
pub trait ModelFile: Model + Clone {
    /// The name of the kind, as files write it.
    const NAME: &'static str;

    /// The keys of `[model]`, except `kind`.
    type File: Described;

    /// Reads `[model]`.
    fn read(source: &Source) -> Result<Self, FileError>;

    /// Variances of the measurements, if the model defines them.
    fn variances(&self) -> Option<Vec<Value>> {
        None
    }

    /// The files that it names, except meshes.
    fn files(&self) -> Vec<PathBuf> {
        Vec::new()
    }

    /// Sensors of the model that measure what depends on the control, and are not among its measurements.
    fn recalling(&self) -> &[Sensor] {
        &[]
    }

    /// Warnings about ignored or suspicious parts of the files that it names.
    fn warnings(&self) -> Vec<String> {
        Vec::new()
    }

    /// The same with a separate sentence for each occurrence.
    fn every_warning(&self) -> Vec<String> {
        self.warnings()
    }

    /// Whether the task may omit the first state, or give it by a keyframe or a pose.
    fn starts_by_itself(&self) -> bool {
        false
    }

    /// The first state before individual states are set, or an error about what does not fit the model, with its place
    /// below `initial_state`, as `pose.frame`.
    fn first_state(&self, _start: &Start) -> Result<Vec<f64>, Unfit> {
        Ok(vec![0.0; self.dimensions().states])
    }

    /// Pairs of states of which the first defaults to the second if the task does not give its initial value.
    fn followers(&self) -> Vec<(usize, usize)> {
        Vec::new()
    }

    /// Adds parts of the schema that [`ModelFile::File`] does not describe.
    #[cfg(feature = "schema")]
    fn complete_schema(_schema: &mut serde_json::Value, _generator: &mut schemars::SchemaGenerator, _kinds: &Kinds) {}
}

/// A model whose whole table serde can read.
///
/// Example: `tests/outsider/src/cart_pole.rs` of the repository.
pub trait PlainFile: Model + Clone + for<'de> Deserialize<'de> + Described {
    /// The name of the kind, as files write it.
    const NAME: &'static str;

    /// Checks its numbers and shapes within the parameters' bounds.
    ///
    /// # Errors
    /// If one is invalid; the error gives the key and what is valid.
    fn check(&self, parameters: &Parameters) -> Result<(), Unfit>;
}

impl<M: PlainFile> ModelFile for M {
    const NAME: &'static str = <M as PlainFile>::NAME;

    type File = M;

    fn read(source: &Source) -> Result<Self, FileError> {
        let (at, document) = (["model".into()], source.document);
        let (_, table) = document.table_with_kind(&at, &source.kinds.models())?;
        let model = Self::deserialize(table).map_err(|error| document.read_error(&at, error))?;
        model.check(source.parameters).map_err(|unfit| unfit.at(document, &at))?;
        Ok(model)
    }
}

/// A model read from a file, of whatever kind.
///
/// Example: [`Source`] reads one from the table shown there.
pub trait AnyModel {
    /// Its sizes.
    fn dimensions(&self) -> Dimensions;
    /// Variances of its measurements, if it defines them.
    fn variances(&self) -> Option<Vec<Value>>;
    /// The files that it names, except meshes.
    fn files(&self) -> Vec<PathBuf>;
    /// Warnings about ignored or suspicious parts of the files that it names, one sentence per kind.
    fn warnings(&self) -> Vec<String>;
    /// The same with a separate sentence for each occurrence.
    fn every_warning(&self) -> Vec<String>;
    /// The limits of its states and controls.
    fn limits(&self) -> Vec<Limit>;
    /// Whether its first state may be omitted, or given by a keyframe or a pose.
    fn starts_by_itself(&self) -> bool;
    /// The first state before individual states are set.
    ///
    /// # Errors
    /// If the keyframe or pose does not fit; the place of the error is below `initial_state`, as `pose.frame`.
    fn first_state(&self, start: &Start) -> Result<Vec<f64>, Unfit>;
    /// Pairs of states of which the first defaults to the second if the task does not give its initial value.
    fn followers(&self) -> Vec<(usize, usize)>;
    /// The names that quantities may refer to.
    fn vocabulary(&self) -> Vocabulary;
    /// Names and units of states, controls and measurements.
    fn channels(&self) -> Channels;
    /// The model with its costs and the recorded quantities, for solvers.
    fn system(&self, terms: (Vec<Cost>, Vec<Followed>), time_step: Value, parameters: usize) -> Arc<dyn System>;
    /// The same model with other measurements.
    fn equipped(self: Box<Self>, equipment: Equipment) -> Box<dyn AnyModel>;
    /// Its measurements, if they replace its own.
    fn equipment(&self) -> Option<&Equipment> {
        None
    }
    /// Its sensors that measure what depends on the control; they become measurements by [`AnyModel::equipped`].
    fn recalling(&self) -> &[Sensor] {
        &[]
    }
    /// States after its own, that keep what such sensors measure.
    fn recalled(&self) -> &[Recalled] {
        &[]
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
    fn limits(&self) -> Vec<Limit> {
        Model::limits(self)
    }
    fn starts_by_itself(&self) -> bool {
        ModelFile::starts_by_itself(self)
    }
    fn first_state(&self, start: &Start) -> Result<Vec<f64>, Unfit> {
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
    fn system(
        &self,
        (costs, followed): (Vec<Cost>, Vec<Followed>),
        time_step: Value,
        parameters: usize,
    ) -> Arc<dyn System> {
        Arc::new(Authored::new(self.clone(), costs, time_step, parameters).following(followed))
    }
    fn equipped(self: Box<Self>, equipment: Equipment) -> Box<dyn AnyModel> {
        Box::new(Equipped::new(*self, equipment))
    }
    fn recalling(&self) -> &[Sensor] {
        ModelFile::recalling(self)
    }
}

impl Default for Kinds {
    /// The kinds of the library.
    fn default() -> Self {
        Self::without_models().with::<Linear>().with::<Robot>().with::<TwoMass>()
    }
}
