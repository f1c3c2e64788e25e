use std::path::PathBuf;
use std::sync::Arc;

use supple_lqg::Dimensions;

use super::equipment::{Equipment, Recalled};
use super::start::Start;
use crate::Value;
use crate::channels::{Channels, Limit};
use crate::cost::Cost;
use crate::followed::Followed;
use crate::quantity::{Sensor, Unfit, Vocabulary};
use crate::system::System;

/// A model read from a file, of whatever kind.
///
/// Example: [`Source`](super::Source) reads one from the table shown there.
pub trait AnyModel {
    /// Its sizes.
    fn dimensions(&self) -> Dimensions;
    /// Variances of its measurements, if it defines them.
    fn variances(&self) -> Option<Vec<Value>>;
    /// The files that it names, except meshes.
    fn files(&self) -> Vec<PathBuf>;
    /// Warnings about ignored or suspicious parts of the files that it names, one sentence per kind.
    fn warnings(&self) -> Vec<String>;
    /// The same with a separate sentence for each occurrence.
    fn every_warning(&self) -> Vec<String>;
    /// Reasons not to trust any number about it, which every result repeats.
    fn doubts(&self) -> Vec<String>;
    /// The limits of its states and controls.
    fn limits(&self) -> Vec<Limit>;
    /// Whether its first state may be omitted, or given by a keyframe or a pose.
    fn starts_by_itself(&self) -> bool;
    /// The first state before individual states are set.
    ///
    /// # Errors
    /// If the keyframe or pose does not fit; the place of the error is below `initial_state`, as `pose.frame`.
    fn first_state(&self, start: &Start) -> Result<Vec<f64>, Unfit>;
    /// Pairs of states of which the first defaults to the second if the task does not give its initial value.
    fn followers(&self) -> Vec<(usize, usize)>;
    /// The names that quantities may refer to.
    fn vocabulary(&self) -> Vocabulary;
    /// Names and units of states, controls and measurements.
    fn channels(&self) -> Channels;
    /// The model with its costs and the recorded quantities, for solvers.
    fn system(&self, costs: Vec<Cost>, followed: Vec<Followed>, time_step: Value, parameters: usize)
    -> Arc<dyn System>;
    /// The same model with other measurements.
    fn equipped(self: Box<Self>, equipment: Equipment) -> Box<dyn AnyModel>;
    /// Its measurements, if they replace its own.
    fn equipment(&self) -> Option<&Equipment> {
        None
    }
    /// Its sensors that measure what depends on the control; they become measurements by [`AnyModel::equipped`].
    fn recalling(&self) -> &[Sensor] {
        &[]
    }
    /// States after its own, that keep what such sensors measure.
    fn recalled(&self) -> &[Recalled] {
        &[]
    }
}

impl Equipment {
    /// All sensors of a model: its measurements, and what its sensors recall of the last step.
    #[must_use]
    pub fn of(model: &dyn AnyModel) -> Self {
        let own = model.dimensions().measurements;
        Self { own, kept: (0..own).collect(), added: model.recalling().iter().flat_map(Self::entries).collect() }
    }
}
