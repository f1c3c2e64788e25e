//! How quantities are read from task files, by kind.

use serde::Deserialize;

use super::{Measurable, Quantity, Unfit, Vocabulary};
use crate::document::{Content, Described, Document, FileError, Place, ReadError, Reader, Registry, Spanned, Spot};
use crate::parameters::Parameters;

/// How a kind of quantity is read from a task file.
///
/// With the [`Measurable`] of its own example:
///
/// ```
/// use supple_model::quantity::{Known, Measurable, NoKeys, QuantityFile, Unfit, Vocabulary};
/// use supple_model::{Channel, Kinds, Point, Scalar};
///
/// /// The speed of a body whose velocity components are the states `vx` and `vy`.
/// #[derive(Debug)]
/// struct Speed { velocity: [usize; 2] }
///
/// impl QuantityFile for Speed {
///     type File = NoKeys;
///     fn build(_: NoKeys, vocabulary: &Vocabulary) -> Result<Self, Unfit> {
///         Ok(Self { velocity: [vocabulary.state("kind", "vx")?, vocabulary.state("kind", "vy")?] })
///     }
/// }
/// # impl Measurable for Speed {
/// #     const NAME: &'static str = "speed";
/// #     fn len(&self) -> usize {
/// #         1
/// #     }
/// #     fn channels(&self, _: &Vocabulary) -> Vec<Channel> {
/// #         vec![Channel::new("speed", "m/s")]
/// #     }
/// #     fn evaluate<S: Scalar>(&self, at: &Point<S>, _: &Known<S>, out: &mut [S]) {
/// #         let [vx, vy] = self.velocity.map(|place| at.x[place]);
/// #         out[0] = (vx.square() + vy.square() + 1e-6).sqrt();
/// #     }
/// # }
///
/// assert!(Kinds::default().with_quantity::<Speed>().quantities().contains(&"speed"));
/// ```
pub trait QuantityFile: Measurable + Sized {
    /// The keys of its table, except `kind` and those of its use as a sensor, cost, limit or curve.
    type File: for<'de> Deserialize<'de> + Described;

    /// Whether all quantities of this kind depend on the control.
    const OF_CONTROL: bool = false;

    /// The quantity.
    ///
    /// # Errors
    /// What does not fit the model.
    fn build(file: Self::File, vocabulary: &Vocabulary) -> Result<Self, Unfit>;
}

/// Reads a quantity from its own keys.
type Build = fn(Reader, &Vocabulary) -> Result<Result<Quantity, Unfit>, ReadError>;

/// How one kind is read.
#[derive(Clone, Copy, Debug)]
struct Reads {
    build: Build,
    of_control: bool,
}

/// The kinds of quantity that task files may name.
///
/// ```
/// let kinds = supple_model::quantity::Kinds::default();
/// assert!(kinds.names().contains(&"contact_force") && kinds.is_of_control("power"));
/// ```
#[derive(Clone, Debug)]
pub struct Kinds(Registry<Reads>);

impl Kinds {
    /// An empty registry.
    pub(super) fn none() -> Self {
        Self(Registry::default())
    }

    /// Adds a kind, replacing any kind of the same name.
    pub fn add<Q: QuantityFile>(&mut self) {
        let build = |table: Reader, vocabulary: &Vocabulary| {
            Q::File::deserialize(table).map(|file| Q::build(file, vocabulary).map(Quantity::from))
        };
        self.0.add::<Q::File>(Q::NAME, Reads { build, of_control: Q::OF_CONTROL });
    }

    /// The names of all kinds, in order.
    #[must_use]
    pub fn names(&self) -> Vec<&'static str> {
        self.0.names()
    }

    /// Whether all quantities of a kind depend on the control.
    #[must_use]
    pub fn is_of_control(&self, kind: &str) -> bool {
        self.0.get(kind).is_some_and(|reads| reads.of_control)
    }

    /// The schema of each kind's own keys, by name.
    #[cfg(feature = "schema")]
    pub fn schemas(&self, generator: &mut schemars::SchemaGenerator) -> Vec<(&'static str, schemars::Schema)> {
        self.0.schemas(generator)
    }
}

/// Context for reading a quantity: the kinds that exist, and what it may refer to.
///
/// For an example of what it reads, see [`read_sensor`](crate::quantity::read_sensor).
#[derive(Clone, Copy, Debug)]
pub struct Context<'a> {
    /// The kinds that the file may name.
    pub kinds: &'a Kinds,
    /// The names of the model.
    pub vocabulary: &'a Vocabulary,
    /// The parameters of the problem.
    pub parameters: &'a Parameters,
}

impl Context<'_> {
    /// Reads the quantity of kind `kind` from its own keys of a table at a place.
    ///
    /// # Errors
    /// Where there is no such kind, or the table is wrong or does not fit the model.
    pub fn read(&self, kind: &str, table: Reader, Spot { document, at }: Spot) -> Result<Quantity, FileError> {
        let reads = self.kinds.0.get(kind).ok_or_else(|| document.unknown_kind(at, kind, &self.kinds.names()))?;
        let quantity = (reads.build)(table, self.vocabulary)
            .map_err(|error| document.read_error(at, error))?
            .map_err(|unfit| unfit.at(document, at))?;
        quantity.check(self.parameters).map_err(|unfit| unfit.at(document, at))?;
        check_selection(document, at)?;
        Ok(quantity)
    }
}

/// What is selected twice would be measured, paid for or limited twice.
fn check_selection(document: &Document, at: &[Place]) -> Result<(), FileError> {
    let mut place = at.to_vec();
    place.push("select".into());
    let Some(Content::List(names)) = document.get(&place).map(Spanned::get_ref) else { return Ok(()) };
    let names: Vec<&Content> = names.iter().map(Spanned::get_ref).collect();
    let is_again = |&index: &usize| match names[index] {
        Content::Text(name) => {
            names[..index].iter().any(|other| matches!(other, Content::Text(other) if other == name))
        }
        _ => false,
    };
    match (0..names.len()).find(is_again) {
        None => Ok(()),
        Some(index) => {
            place.push(index.into());
            Err(document.error(&place, "is selected already; name each once"))
        }
    }
}
