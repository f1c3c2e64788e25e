use std::path::PathBuf;
use std::sync::Arc;
use supple_kernels::Scalar;
use supple_lqg::Dimensions;

use super::any::AnyModel;
use super::equipment::{Entry, Equipment, Recalled};
use super::file::ModelFile;
use super::start::Start;
use crate::Value;
use crate::channels::{Channel, Channels, Drive, Limit, free_name};
use crate::contacts::{Contact, ContactState};
use crate::cost::Cost;
use crate::followed::Followed;
use crate::physics::{DependentJoint, FileSensor, Model, OwnCost, Point};
use crate::quantity::{Known, Quantity, Sensor, Unfit, Vocabulary, signals_for};
use crate::scene::Picture;
use crate::system::{Authored, System};

/// A model with replaced sensors. Its states are the model's own, and after these what sensors recall of the last step.
#[derive(Clone, Debug)]
pub(super) struct Equipped<M> {
    model: M,
    equipment: Equipment,
    recalled: Vec<Recalled>,
    /// How many states and measurements the model itself has.
    own: Dimensions,
}

impl<M: ModelFile> Equipped<M> {
    pub fn new(model: M, equipment: Equipment) -> Self {
        let mut taken = model.state_names();
        let mut recalled = Vec::new();
        for (entry, channel, _) in &equipment.added {
            let Some((quantity, entry)) = entry.of_last_step() else { continue };
            let name = free_name(format!("last.{}", channel.name), &taken);
            taken.push(name.clone());
            recalled
                .push(Recalled { channel: Channel::new(name, channel.unit.clone()), rate_of: quantity.rate_of(entry) });
        }
        Self { own: Model::dimensions(&model), model, equipment, recalled }
    }

    /// A point without what sensors recall.
    fn own<'a, S: Scalar>(&self, at: &Point<'a, S>) -> Point<'a, S> {
        Point { x: &at.x[..self.own.states], ..*at }
    }
}

/// The numbers of the quantity that was asked for last: entries of one quantity are consecutive.
struct Last<'q, S> {
    quantity: Option<&'q Quantity>,
    values: Vec<S>,
}

impl<S> Default for Last<'_, S> {
    fn default() -> Self {
        Self { quantity: None, values: Vec::new() }
    }
}

impl<'q, S: Scalar> Last<'q, S> {
    fn value(&mut self, quantity: &'q Quantity, entry: usize, at: &Point<S>, known: &Known<S>) -> S {
        if !self.quantity.is_some_and(|last| std::ptr::eq(last, quantity)) {
            *self = Self { quantity: Some(quantity), values: quantity.values(at, known) };
        }
        self.values[entry]
    }
}

impl<M: ModelFile> Model for Equipped<M> {
    fn dimensions(&self) -> Dimensions {
        let measurements = self.equipment.kept.len() + self.equipment.added.len();
        Dimensions { states: self.own.states + self.recalled.len(), measurements, ..self.own }
    }

    fn step<S: Scalar>(&self, at: &Point<S>, next: &mut [S]) {
        let at = &self.own(at);
        let (next, recalled) = next.split_at_mut(self.own.states);
        self.model.step(at, next);
        let all = || self.equipment.added.iter().filter_map(|(entry, ..)| entry.of_last_step());
        // What it measures does not depend on the unknowns of the step.
        let at = &Point { w: &[], ..*at };
        let quantities: Vec<&Quantity> = all().map(|(quantity, _)| quantity).collect();
        let signals = signals_for(&self.model, &quantities, at, next);
        let known = Known { signals: &signals, next, early: &[] };
        let mut last = Last::default();
        for (recalled, (quantity, entry)) in recalled.iter_mut().zip(all()) {
            *recalled = last.value(quantity, entry, at, &known);
        }
    }

    fn observe<S: Scalar>(&self, at: &Point<S>, y: &mut [S]) {
        let recalled = &at.x[self.own.states..];
        let at = &self.own(at);
        let mut own = vec![S::zero(); self.own.measurements];
        self.model.observe(at, &mut own);
        let Equipment { kept, added, .. } = &self.equipment;
        let quantities: Vec<&Quantity> = added.iter().filter_map(|(entry, ..)| entry.of_now()).collect();
        let signals = signals_for(&self.model, &quantities, at, &[]);
        let known = Known { signals: &signals, ..Known::NONE };
        let (mut last, mut recalled) = (Last::default(), recalled.iter());
        let (first, rest) = y.split_at_mut(kept.len());
        for (y, &row) in first.iter_mut().zip(kept) {
            *y = own[row];
        }
        for (y, (entry, ..)) in rest.iter_mut().zip(added) {
            *y = match entry {
                Entry::Own(row) => own[*row],
                Entry::Of(..) if entry.of_last_step().is_some() => recalled.next().copied().unwrap_or_else(S::zero),
                Entry::Of(quantity, entry) => last.value(quantity, *entry, at, &known),
                Entry::Sum(factors) => {
                    let terms = factors.iter().zip(at.x).filter(|(factor, _)| !factor.is_zero());
                    terms.fold(S::zero(), |sum, (factor, &x)| at.value(factor).mul_add(x, sum))
                }
            };
        }
    }

    fn unknowns(&self) -> usize {
        self.model.unknowns()
    }

    fn balance<S: Scalar>(&self, at: &Point<S>, residual: &mut [S]) {
        self.model.balance(&self.own(at), residual);
    }

    fn mass<S: Scalar>(&self, at: &Point<S>, matrix: &mut [S]) {
        self.model.mass(&self.own(at), matrix);
    }

    fn solution<S: Scalar>(&self, at: &Point<S>) -> Option<Vec<S>> {
        self.model.solution(&self.own(at))
    }

    fn signals(&self) -> Vec<String> {
        self.model.signals()
    }

    fn signal<S: Scalar>(&self, at: &Point<S>, out: &mut [S]) {
        self.model.signal(&self.own(at), out);
    }

    fn signal_during<S: Scalar>(&self, at: &Point<S>, next: &[S], out: &mut [S]) {
        self.model.signal_during(&self.own(at), &next[..self.own.states], out);
    }

    fn own_cost(&self, last: bool) -> Option<OwnCost> {
        self.model.own_cost(last)
    }

    fn own_residual<S: Scalar>(&self, at: &Point<S>, last: bool, out: &mut [S]) {
        self.model.own_residual(&self.own(at), last, out);
    }

    fn own_norm<S: Scalar>(&self, residual: &[S], phi: &[S], time_step: S, last: bool) -> S {
        self.model.own_norm(residual, phi, time_step, last)
    }

    fn limits(&self) -> Vec<Limit> {
        self.model.limits()
    }

    fn contacts(&self) -> Vec<Contact> {
        self.model.contacts()
    }

    fn contact_states(&self, at: &Point<f64>) -> Vec<ContactState> {
        self.model.contact_states(&self.own(at))
    }

    fn substeps(&self) -> Option<usize> {
        self.model.substeps()
    }

    fn widened(&self, length: &Value, speed: &Value, lead: &Value) -> Option<Self> {
        Some(Self { model: self.model.widened(length, speed, lead)?, ..self.clone() })
    }

    fn endures_longer_steps(&self) -> bool {
        self.model.endures_longer_steps()
    }

    fn joint_names(&self) -> Vec<String> {
        self.model.joint_names()
    }

    fn dependent_joints(&self) -> Vec<DependentJoint> {
        self.model.dependent_joints()
    }

    fn coupling_names(&self) -> Vec<String> {
        self.model.coupling_names()
    }

    fn state_names(&self) -> Vec<String> {
        let recalled = self.recalled.iter().map(|recalled| recalled.channel.name.clone());
        self.model.state_names().into_iter().chain(recalled).collect()
    }

    fn frame_names(&self) -> Vec<String> {
        self.model.frame_names()
    }

    fn motors(&self) -> Vec<(String, String)> {
        self.model.motors()
    }

    fn drives(&self) -> Vec<Drive> {
        self.model.drives()
    }

    fn file_sensors(&self) -> Vec<FileSensor> {
        self.model.file_sensors()
    }

    fn channels(&self) -> Channels {
        let Channels { states, controls, measurements } = self.model.channels();
        let Equipment { kept, added, .. } = &self.equipment;
        let kept = kept.iter().map(|&row| measurements[row].clone());
        let measurements = Channel::distinct(kept.chain(added.iter().map(|(_, channel, _)| channel.clone())).collect());
        let recalled = self.recalled.iter().map(|recalled| recalled.channel.clone());
        Channels { states: states.into_iter().chain(recalled).collect(), controls, measurements }
    }

    fn picture(&self, at: &Point<f64>) -> Option<Picture> {
        self.model.picture(&self.own(at))
    }

    fn landmarks<S: Scalar>(&self, at: &Point<S>) -> Vec<[S; 3]> {
        self.model.landmarks(&self.own(at))
    }
}

impl<M: ModelFile> AnyModel for Equipped<M> {
    fn dimensions(&self) -> Dimensions {
        Model::dimensions(self)
    }
    fn variances(&self) -> Option<Vec<Value>> {
        let Equipment { own, kept, added } = &self.equipment;
        // If none of the model's own measurements are kept, their noise does not matter.
        let of_own = ModelFile::variances(&self.model);
        let of_own = of_own.or_else(|| kept.is_empty().then(|| vec![Value::default(); *own]))?;
        let of_added = added.iter().map(|(_, _, variance)| variance);
        Some(kept.iter().map(|&row| &of_own[row]).chain(of_added).cloned().collect())
    }
    fn files(&self) -> Vec<PathBuf> {
        self.model.files()
    }
    fn warnings(&self) -> Vec<String> {
        self.model.warnings()
    }
    fn every_warning(&self) -> Vec<String> {
        self.model.every_warning()
    }
    fn doubts(&self) -> Vec<String> {
        self.model.doubts()
    }
    fn limits(&self) -> Vec<Limit> {
        Model::limits(self)
    }
    fn starts_by_itself(&self) -> bool {
        self.model.starts_by_itself()
    }
    fn first_state(&self, start: &Start) -> Result<Vec<f64>, Unfit> {
        ModelFile::first_state(&self.model, start)
    }
    fn followers(&self) -> Vec<(usize, usize)> {
        ModelFile::followers(&self.model)
    }
    fn vocabulary(&self) -> Vocabulary {
        let own = Vocabulary::of(&self.model);
        let Channels { states, controls, .. } = own.channels;
        Vocabulary { channels: Channels { states, controls, measurements: Model::channels(self).measurements }, ..own }
    }
    fn system(
        &self,
        costs: Vec<Cost>,
        followed: Vec<Followed>,
        time_step: Value,
        parameters: usize,
    ) -> Arc<dyn System> {
        Arc::new(Authored::new(self.clone(), costs, time_step, parameters).following(followed))
    }
    fn channels(&self) -> Channels {
        Model::channels(self)
    }
    fn equipped(self: Box<Self>, _: Equipment) -> Box<dyn AnyModel> {
        self
    }
    fn equipment(&self) -> Option<&Equipment> {
        Some(&self.equipment)
    }
    fn recalled(&self) -> &[Recalled] {
        &self.recalled
    }
}

impl<M: ModelFile> AnyModel for M {
    fn dimensions(&self) -> Dimensions {
        Model::dimensions(self)
    }
    fn variances(&self) -> Option<Vec<Value>> {
        ModelFile::variances(self)
    }
    fn files(&self) -> Vec<PathBuf> {
        ModelFile::files(self)
    }
    fn warnings(&self) -> Vec<String> {
        ModelFile::warnings(self)
    }
    fn every_warning(&self) -> Vec<String> {
        ModelFile::every_warning(self)
    }
    fn doubts(&self) -> Vec<String> {
        ModelFile::doubts(self)
    }
    fn limits(&self) -> Vec<Limit> {
        Model::limits(self)
    }
    fn starts_by_itself(&self) -> bool {
        ModelFile::starts_by_itself(self)
    }
    fn first_state(&self, start: &Start) -> Result<Vec<f64>, Unfit> {
        ModelFile::first_state(self, start)
    }
    fn followers(&self) -> Vec<(usize, usize)> {
        ModelFile::followers(self)
    }
    fn vocabulary(&self) -> Vocabulary {
        Vocabulary::of(self)
    }
    fn channels(&self) -> Channels {
        Model::channels(self)
    }
    fn system(
        &self,
        costs: Vec<Cost>,
        followed: Vec<Followed>,
        time_step: Value,
        parameters: usize,
    ) -> Arc<dyn System> {
        Arc::new(Authored::new(self.clone(), costs, time_step, parameters).following(followed))
    }
    fn equipped(self: Box<Self>, equipment: Equipment) -> Box<dyn AnyModel> {
        Box::new(Equipped::new(*self, equipment))
    }
    fn recalling(&self) -> &[Sensor] {
        ModelFile::recalling(self)
    }
}
