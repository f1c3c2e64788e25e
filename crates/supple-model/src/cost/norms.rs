//! The norms that task files may name. To add one, write one line at the end of this file.

#[cfg(feature = "schema")]
use serde_json::{Value as Json, json};

#[cfg(feature = "schema")]
use super::norm::NormKind;
use super::norm::{Norm, NormFile};
use super::{Absolute, Quadratic};
use crate::document::{Document, FileError, Place, ReadError, Registry, Variant};

/// The norms that task files may name.
///
/// Example: [`Kinds`](crate::Kinds).
#[derive(Clone, Debug)]
pub struct Norms(Registry<fn(Variant) -> Result<Norm, ReadError>>);

impl Norms {
    /// Adds a kind, replacing a kind of the same name.
    pub fn add<N: NormFile>(&mut self) {
        let build = |given: Variant| given.read().map(|file| N::build(file).into());
        self.0.add::<N::File>(N::NAME, build);
    }

    /// Reads the norm at a place; defaults to the square if nothing is given.
    ///
    /// # Errors
    /// If there is no such norm, or its settings are invalid.
    pub fn read(&self, document: &Document, at: &[Place]) -> Result<Norm, FileError> {
        let Some(value) = document.get(at) else { return Ok(Quadratic.into()) };
        let read = |given: Variant| match self.0.get(given.name()) {
            Some(build) => build(given),
            None => Err(given.unknown(&self.0.names())),
        };
        let norm = document.reader(value).variant(&self.0.names()).and_then(read);
        norm.map_err(|error| document.read_error(at, error))
    }

    /// The schema of all norms: a name, or a table with the name and its settings.
    #[cfg(feature = "schema")]
    pub fn schema(&self, generator: &mut schemars::SchemaGenerator) -> Json {
        let one = |(name, schema): (&'static str, schemars::Schema)| {
            let mut settings = schema.to_value();
            let description = settings["description"].take();
            settings.as_object_mut().map(|keys| keys.remove("description"));
            match settings["properties"].as_object() {
                Some(keys) if !keys.is_empty() => json!({
                    "description": description,
                    "type": "object",
                    "properties": { name: settings },
                    "required": [name],
                    "additionalProperties": false
                }),
                _ => json!({ "type": "string", "const": name }),
            }
        };
        let kinds: Vec<Json> = self.0.schemas(generator).into_iter().map(one).collect();
        json!({ "description": "How the distance becomes a cost", "oneOf": kinds, "default": Quadratic::NAME })
    }
}

impl Default for Norms {
    /// The norms of the library.
    fn default() -> Self {
        let mut norms = Self(Registry::default());
        norms.add::<Absolute>();
        norms.add::<Quadratic>();
        norms
    }
}
