use std::path::PathBuf;

use serde::Deserialize;

#[cfg(feature = "schema")]
use super::kinds::Kinds;
use super::kinds::Source;
use super::start::Start;
use crate::Value;
use crate::document::{Described, FileError};
use crate::parameters::Parameters;
use crate::physics::Model;
use crate::quantity::{Sensor, Unfit};

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

    /// Reasons not to trust any number about it, which every result repeats.
    fn doubts(&self) -> Vec<String> {
        Vec::new()
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
