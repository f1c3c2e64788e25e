//! Parameters at an end of their range.

use supple::Evaluation;
use supple_study::About;

/// The parameters of the search that end at a bound, and which; those from a catalogue can have no other values.
pub(super) fn at_bounds(about: &About, at: &Evaluation) -> Vec<(String, &'static str)> {
    let design =
        about.parameters.design().into_iter().map(|index| (about.parameters.get(index), at.parameters.0[index].1));
    let free = design.filter(|(parameter, _)| parameter.catalogue.is_empty());
    let held = free.filter_map(|(parameter, value)| {
        let is_at = |&(end, _): &(f64, _)| parameter.is_at(end, value);
        let (_, side) = parameter.bounds.into_iter().zip(["lower", "upper"]).find(is_at)?;
        Some((parameter.name.clone(), side))
    });
    held.collect()
}
