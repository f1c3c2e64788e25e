//! Design.
/// Settings.
#[derive(Clone, Debug, Default)]
pub struct DesignSettings;
