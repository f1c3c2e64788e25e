//! All kinds that task files may name.

use std::path::Path;

use super::any::AnyModel;
use super::compliance::{ComplianceFile, Couplings};
use crate::cost::{NormFile, Norms};
use crate::document::{Document, FileError, Registry};
use crate::parameters::Parameters;
use crate::quantity::{self, QuantityFile};

/// The kinds that task files may name: those of the library, and any added here.
///
/// A kind from another crate can do everything that a built-in kind can; a task file read with
/// `supple_file::load_with` names it in the same way.
///
/// ```
/// use supple_model::Kinds;
/// use supple_model::cost::{NoKeys, NormFile, NormKind};
/// use supple_model::Scalar;
///
/// /// `cosh(r) - 1`
/// #[derive(Debug)]
/// struct Cosh;
///
/// impl NormKind for Cosh {
///     const NAME: &'static str = "cosh";
///     fn value<S: Scalar>(&self, r: S, _: &[S]) -> S {
///         (r.exp() + (-r).exp()) * 0.5 - 1.0
///     }
/// }
///
/// impl NormFile for Cosh {
///     type File = NoKeys;
///     fn build(_: NoKeys) -> Self {
///         Self
///     }
/// }
///
/// let kinds = Kinds::default().with_norm::<Cosh>();
/// ```
#[derive(Clone, Debug)]
pub struct Kinds {
    /// Kinds of quantities.
    pub quantities: quantity::Kinds,
    /// Kinds of norms.
    pub norms: Norms,
    pub(super) couplings: Couplings,
    pub(super) models: Registry<Reads>,
}

/// The source from which a model is read.
///
/// The table of a task file that it reads, with a parameter in place of a number:
///
/// ```toml
/// [model]
/// kind = "two_mass"
/// mass = [0.8, 0.4]
/// damping = [60.0, 35.0]
/// stiffness = ["stiffness", 200.0]
/// ```
#[derive(Clone, Copy)]
pub struct Source<'a> {
    /// The task file.
    pub document: &'a Document<'a>,
    /// Its parameters.
    pub parameters: &'a Parameters,
    /// The folder in which files named by the document are looked up.
    pub folder: &'a Path,
    /// The kinds that it may name.
    pub kinds: &'a Kinds,
}

/// How one kind of model is read.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reads {
    pub read: fn(&Source) -> Result<Box<dyn AnyModel>, FileError>,
    #[cfg(feature = "schema")]
    pub complete_schema: fn(&mut serde_json::Value, &mut schemars::SchemaGenerator, &Kinds),
}

impl Kinds {
    /// Adds a kind of quantity, replacing any kind of the same name.
    #[must_use]
    pub fn with_quantity<Q: QuantityFile>(mut self) -> Self {
        self.quantities.add::<Q>();
        self
    }

    /// Adds a kind of norm, replacing any kind of the same name.
    #[must_use]
    pub fn with_norm<N: NormFile>(mut self) -> Self {
        self.norms.add::<N>();
        self
    }

    /// Adds a kind of compliance, replacing any kind of the same name.
    #[must_use]
    pub fn with_coupling<C: ComplianceFile>(mut self) -> Self {
        self.couplings.add::<C>();
        self
    }

    /// Kinds of quantities, norms and compliance, and no model.
    pub(super) fn without_models() -> Self {
        Self {
            quantities: quantity::Kinds::default(),
            norms: Norms::default(),
            couplings: Couplings::default(),
            models: Registry::default(),
        }
    }

    /// The names of all kinds of quantity, in order.
    #[must_use]
    pub fn quantities(&self) -> Vec<&'static str> {
        self.quantities.names()
    }

    /// The names of all kinds of model, in order.
    #[must_use]
    pub fn models(&self) -> Vec<&'static str> {
        self.models.names()
    }

    /// The schema of each kind of model, by name.
    #[cfg(feature = "schema")]
    pub fn model_schemas(&self, generator: &mut schemars::SchemaGenerator) -> Vec<(&'static str, serde_json::Value)> {
        let schemas = self.models.schemas(generator);
        let complete = |(name, schema): (&'static str, schemars::Schema)| {
            let mut schema = schema.to_value();
            if let Some(reads) = self.models.get(name) {
                (reads.complete_schema)(&mut schema, generator, self);
            }
            (name, schema)
        };
        schemas.into_iter().map(complete).collect()
    }
}

impl Source<'_> {
    /// Reads `[model]`, whose `kind` determines which other keys are valid.
    ///
    /// # Errors
    /// If there is no such kind, or the table is invalid.
    pub fn read(&self) -> Result<Box<dyn AnyModel>, FileError> {
        let (at, valid) = (["model".into()], self.kinds.models());
        let (kind, _) = self.document.table_with_kind(&at, &valid)?;
        let reads = self.kinds.models.get(kind).ok_or_else(|| self.document.unknown_kind(&at, kind, &valid))?;
        (reads.read)(self)
    }
}
