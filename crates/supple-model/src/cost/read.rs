//! How costs are read from files, by kind.

use serde::Deserialize;
use serde::de::IgnoredAny;

use super::norm::Norm;
use super::norms::Norms;
use super::{Cost, QUADRATIC, Weights, quadratic};
use crate::Value;
#[cfg(feature = "schema")]
use crate::document::merged;
use crate::document::{FileError, Place, ReadError, Reader, Spot, Unfit};
use crate::quantity::{Context, Kinds, Quantity};
use crate::value::{OneOrList, OneOrMore};

/// The keys of a cost besides those of its quantity.
const KEYS: &[&str] = &["target", "weight", "final_weight", "norm"];
/// The same keys for a pose, whose target may also be written as `position`.
const KEYS_OF_POSES: &[&str] = &["target", "position", "weight", "final_weight", "norm"];

/// The keys of a cost besides those of its quantity.
#[derive(Debug, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
struct File {
    /// Where the quantity should be, in its units: one number for all entries or one each; default: 0; required for contact forces, frame
    /// positions and the centre of mass. For `frame_pose`, the three position entries suffice.
    #[serde(alias = "position")]
    #[cfg_attr(feature = "schema", schemars(with = "Option<OneOrMore>"))]
    target: Option<OneOrList>,
    /// Weight in every stage, one for all entries or one each, in 1/unit² with the quadratic norm.
    weight: OneOrMore,
    /// The same in the final cost; default: `weight`. Not allowed for quantities that depend on the control.
    final_weight: Option<OneOrMore>,
    /// Norm of the error, by kind.
    #[serde(default)]
    #[cfg_attr(feature = "schema", schemars(skip))]
    #[allow(dead_code)]
    norm: IgnoredAny,
}

impl File {
    fn cost(self, quantity: Quantity, norm: Norm) -> Result<Cost, Unfit> {
        let len = quantity.len();
        let weights = |key: &'static str, given: OneOrMore| match <[Value; 1]>::try_from(given.0) {
            Ok([weight]) => Ok(Weights::Equal(weight)),
            Err(list) => {
                let each = OneOrMore(list).each(len);
                each.map(Weights::Each).map_err(|found| Unfit::new(key, found.to_string()))
            }
        };
        let cost = Cost::new(quantity, 1.0).with_norm(norm).with_weights(weights("weight", self.weight)?);
        let least = cost.quantity.least_targets();
        let targets = self.target.map(|target| match target {
            // Entries of poses are in different units.
            OneOrList::One(target) if least == len => vec![target; len],
            OneOrList::One(target) => vec![target],
            OneOrList::List(targets) => targets,
        });
        let cost = match targets {
            None if cost.quantity.needs_target() => return Err(Unfit::new("target", "is missing")),
            None => cost,
            Some(targets) if targets.len() == len || targets.len() == least => cost.with_targets(targets),
            Some(targets) => {
                let valid = if len == 1 { "one number".into() } else { format!("{len} numbers, one for each entry") };
                return Err(Unfit::new("target", format!("must be {valid}; found {}", targets.len())));
            }
        };
        match self.final_weight {
            Some(_) if cost.quantity.depends_on_control() => {
                let message = "is not allowed: quantities that depend on the control do not enter the final cost";
                Err(Unfit { help: Some("leave it out".into()), ..Unfit::new("final_weight", message) })
            }
            Some(given) => Ok(Cost { last: weights("final_weight", given)?, ..cost }),
            None => Ok(cost),
        }
    }
}

/// The names of all kinds of cost, as files write them: all quantities, and `quadratic`.
///
/// ```
/// let kinds = supple_model::cost::kinds(&supple_model::Kinds::default().quantities);
/// assert!(kinds.contains(&"joint_position") && kinds.contains(&"quadratic"));
/// ```
#[must_use]
pub fn kinds(quantities: &Kinds) -> Vec<&'static str> {
    let mut kinds: Vec<_> = quantities.names().into_iter().chain([QUADRATIC]).collect();
    kinds.sort_unstable();
    kinds
}

/// Reads the cost of kind `kind` from its table at a place, without the key `kind`.
///
/// # Errors
/// If there is no such kind, or the table is invalid or does not fit the model.
///
/// Such a table in a task file:
///
/// ```toml
/// [[tasks.costs]]
/// kind = "frame_point"
/// frame = "handle"
/// axes = ["x", "y"]
/// target = [0.5, 0.1]
/// weight = 1.0
/// ```
pub fn read(kind: &str, table: Reader, spot: Spot, context: &Context, norms: &Norms) -> Result<Cost, FileError> {
    let Spot { document, at } = spot;
    let kinds = kinds(context.kinds);
    if !kinds.contains(&kind) {
        return Err(document.unknown_kind(at, kind, &kinds));
    }
    let wrong = |error: ReadError| document.read_error(at, error);
    let cost = if kind == QUADRATIC {
        quadratic::File::deserialize(table).map_err(wrong)?.cost(spot, context)?
    } else {
        let keys = if kind == "frame_pose" { KEYS_OF_POSES } else { KEYS };
        let quantity = context.read(kind, table.beside(keys), spot)?;
        let file = File::deserialize(table.only(keys)).map_err(wrong)?;
        let norm: Vec<Place> = at.iter().copied().chain(["norm".into()]).collect();
        let norm = norms.read(document, &norm)?;
        file.cost(quantity, norm).map_err(|unfit| unfit.at(document, at))?
    };
    cost.check_numbers(context.parameters).map_err(|unfit| unfit.at(document, at))?;
    Ok(cost)
}

/// The schema of each kind's table, by name.
///
/// It merges keys like the example of [`merged`].
#[cfg(feature = "schema")]
pub fn schemas(
    quantities: &Kinds,
    norms: &Norms,
    generator: &mut schemars::SchemaGenerator,
) -> Vec<(&'static str, schemars::Schema)> {
    let mut common = <File as schemars::JsonSchema>::json_schema(generator);
    let norm = norms.schema(generator);
    let add = |common: &mut schemars::Schema, remove: Option<&str>| {
        let properties = common.ensure_object().get_mut("properties").and_then(|keys| keys.as_object_mut());
        if let Some(properties) = properties {
            properties.insert("norm".to_owned(), norm.clone());
            remove.map(|key| properties.remove(key));
        }
    };
    let mut of_control = common.clone();
    add(&mut common, None);
    add(&mut of_control, Some("final_weight"));
    let with_keys = |(kind, own)| {
        let keys = if quantities.is_of_control(kind) { &of_control } else { &common };
        (kind, merged(own, keys))
    };
    let mut all: Vec<_> = quantities.schemas(generator).into_iter().map(with_keys).collect();
    all.push((QUADRATIC, <quadratic::File as schemars::JsonSchema>::json_schema(generator)));
    all
}
