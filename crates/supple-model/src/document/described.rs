//! Requirements on the keys of a kind besides being readable.

/// Keys that can be described to editors. With the feature `schema` these are the types that implement
/// `schemars::JsonSchema`; without it, all types are.
///
/// Example: [`Registry`](crate::document::Registry).
#[cfg(feature = "schema")]
#[diagnostic::on_unimplemented(
    message = "the keys of a kind need a JSON schema, as the feature `schema` is on",
    label = "has no JSON schema",
    note = "derive `schemars::JsonSchema` for `{Self}`"
)]
pub trait Described: schemars::JsonSchema {}

#[cfg(feature = "schema")]
impl<T: schemars::JsonSchema> Described for T {}

/// Keys that can be described to editors. With the feature `schema` these are the types that implement
/// `schemars::JsonSchema`; without it, all types are.
#[cfg(not(feature = "schema"))]
pub trait Described {}

#[cfg(not(feature = "schema"))]
impl<T> Described for T {}
