//! How kinds of models are added, and those of the library.

use super::any::AnyModel;
use super::file::{ModelFile, PlainFile};
use super::kinds::{Kinds, Reads, Source};
use super::linear::Linear;
use super::robot::Robot;
use super::two_mass::TwoMass;

impl Kinds {
    /// Adds a kind of model, replacing any kind of the same name.
    #[must_use]
    pub fn with_model<M: PlainFile>(self) -> Self {
        self.with::<M>()
    }

    fn with<M: ModelFile>(mut self) -> Self {
        let read = |source: &Source| M::read(source).map(|model| Box::new(model) as Box<dyn AnyModel>);
        let reads = Reads {
            read,
            #[cfg(feature = "schema")]
            complete_schema: M::complete_schema,
        };
        self.models.add::<M::File>(M::NAME, reads);
        self
    }
}

impl Default for Kinds {
    /// The kinds of the library.
    fn default() -> Self {
        Self::without_models().with::<Linear>().with::<Robot>().with::<TwoMass>()
    }
}
