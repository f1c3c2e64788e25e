//! The kinds of model that task files name, and how they are read.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use supple_lqg::Dimensions;

use serde::Deserialize;

use crate::Value;
use crate::channels::{Channel, Channels, Limit};
use crate::cost::Cost;
use crate::document::{Document, FileError};
use crate::followed::Followed;
use crate::parameters::Parameters;
use crate::physics::{FileSensor, Model, OwnCost, Point};
use crate::quantity::Vocabulary;
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
pub(crate) use start::{PoseFile, Start};
pub use two_mass::TwoMass;

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
    fn system(&self, terms: (Vec<Cost>, Vec<Followed>), time_step: Value, parameters: usize) -> Arc<dyn System>;
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
    fn system(
        &self,
        (costs, followed): (Vec<Cost>, Vec<Followed>),
        time_step: Value,
        parameters: usize,
    ) -> Arc<dyn System> {
        Arc::new(Authored::new(self.clone(), costs, time_step, parameters).following(followed))
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
