//! What an interrupted search keeps of its choice from catalogues.

use super::StartSummary;

/// Keeps the designs of combinations of catalogue entries, so that a search that was interrupted does not repeat them.
/// Called from several threads.
///
/// ```
/// use supple::design::{KeepNone, KeptCombinations};
///
/// assert!(KeepNone.find(&[0, 2]).is_none());
/// ```
pub trait KeptCombinations: Sync {
    /// What was kept of the combination with these entries, one per catalogue.
    fn find(&self, entries: &[usize]) -> Option<StartSummary>;

    /// Keeps the design of a combination.
    fn keep(&self, entries: &[usize], found: &StartSummary);
}

/// Keeps nothing.
///
/// Example: [`KeptCombinations`].
#[derive(Clone, Copy, Debug, Default)]
pub struct KeepNone;

impl KeptCombinations for KeepNone {
    fn find(&self, _: &[usize]) -> Option<StartSummary> {
        None
    }

    fn keep(&self, _: &[usize], _: &StartSummary) {}
}
