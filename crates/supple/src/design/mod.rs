//! Design.
use serde::{Deserialize, Serialize};
/// Settings.
#[derive(Clone, Debug, Default, Deserialize, Serialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct DesignSettings {}
impl DesignSettings { pub(crate) fn check(&self) -> Result<(), (&'static str, String)> { Ok(()) } }
