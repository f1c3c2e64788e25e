#[cfg(feature = "schema")]
use schemars::{Schema, SchemaGenerator};

use super::Described;

/// A registry of kinds by their names in files: how each is read, and the schema of its keys.
///
/// ```
/// use supple_model::document::{NoKeys, Registry};
///
/// // Kinds of joints with their degrees of freedom; in files they have no keys but `kind`.
/// let mut joints = Registry::default();
/// joints.add::<NoKeys>("hinge", 1);
/// joints.add::<NoKeys>("ball", 3);
/// assert_eq!((joints.names(), joints.get("ball")), (vec!["ball", "hinge"], Some(&3)));
/// ```
#[derive(Clone, Debug)]
pub struct Registry<R> {
    kinds: Vec<Kind<R>>,
}

#[derive(Clone, Debug)]
struct Kind<R> {
    name: &'static str,
    read: R,
    #[cfg(feature = "schema")]
    schema: fn(&mut SchemaGenerator) -> Schema,
}

impl<R> Default for Registry<R> {
    fn default() -> Self {
        Self { kinds: Vec::new() }
    }
}

impl<R> Registry<R> {
    /// Adds a kind with the keys `File`, replacing any kind of the same name.
    pub fn add<File: Described>(&mut self, name: &'static str, read: R) {
        self.kinds.retain(|kind| kind.name != name);
        self.kinds.push(Kind {
            name,
            read,
            #[cfg(feature = "schema")]
            schema: File::json_schema,
        });
        self.kinds.sort_by_key(|kind| kind.name);
    }

    /// The names of all kinds, in order.
    #[must_use]
    pub fn names(&self) -> Vec<&'static str> {
        self.kinds.iter().map(|kind| kind.name).collect()
    }

    /// How a kind is read; `None` if there is no such kind.
    #[must_use]
    pub fn get(&self, name: &str) -> Option<&R> {
        self.kinds.iter().find(|kind| kind.name == name).map(|kind| &kind.read)
    }

    /// The schema of each kind's own keys, by name.
    #[cfg(feature = "schema")]
    pub fn schemas(&self, generator: &mut SchemaGenerator) -> Vec<(&'static str, Schema)> {
        self.kinds.iter().map(|kind| (kind.name, (kind.schema)(generator))).collect()
    }
}

/// A kind without additional keys.
///
/// Example: [`Registry`].
#[derive(Debug, serde::Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "schema", schemars(description = "A kind without additional keys."))]
#[serde(deny_unknown_fields)]
pub struct NoKeys {}
