use std::path::PathBuf;
use std::sync::Arc;
use supple_kernels::Scalar;
use supple_lqg::Dimensions;

use super::{AnyModel, Channel, Channels, FileSensor, Limit, Model, ModelFile, OwnCost, Point, Start};

use crate::Value;
use crate::channels::Drive;
use crate::contacts::{Contact, ContactState};
use crate::cost::Cost;
use crate::followed::Followed;
use crate::noise::Covariance;
use crate::quantity::{Known, Quantity, Unfit, Vocabulary};
use crate::scene::Picture;
use crate::system::{Authored, System};

/// The source of an entry of a measurement.
#[derive(Clone, Debug)]
pub enum Entry {
    /// The model's own measurement with this index.
    Own(usize),
    /// An entry of a quantity.
    Of(Arc<Quantity>, usize),
    /// A linear combination of states, with these coefficients.
    Sum(Vec<Value>),
}

/// The measurements that replace a model's own: first those of the model that are kept, then those from a catalogue.
#[derive(Clone, Debug, Default)]
pub struct Equipment {
    /// How many measurements the model itself has.
    pub own: usize,
    /// Indices of the model's measurements that are kept, with their noise; they come first.
    pub kept: Vec<usize>,
    /// Added measurements: the entry, its name and unit, and the variance of its noise.
    pub added: Vec<(Entry, Channel, Value)>,
}

impl Equipment {
    /// The covariance of all entries, given that of the model's own measurements; added noise is independent.
    ///
    /// # Errors
    /// If the covariance does not match the model's own measurements; the error is its order.
    pub fn covariance(&self, own: &Covariance) -> Result<Covariance, usize> {
        if own.order() != self.own {
            return Err(own.order());
        }
        let added = || self.added.iter().map(|(_, _, variance)| *variance);
        Ok(match own {
            Covariance::Diagonal(variances) => {
                Covariance::Diagonal(self.kept.iter().map(|&row| variances[row]).chain(added()).collect())
            }
            Covariance::Full(rows) => {
                let order = self.kept.len() + self.added.len();
                let first = self.kept.iter().map(|&row| {
                    let mut kept: Vec<Value> = self.kept.iter().map(|&col| rows[row][col]).collect();
                    kept.resize(order, Value::default());
                    kept
                });
                let alone = added().enumerate().map(|(place, variance)| {
                    let mut row = vec![Value::default(); order];
                    row[self.kept.len() + place] = variance;
                    row
                });
                Covariance::Full(first.chain(alone).collect())
            }
            // Not possible in task files.
            Covariance::Sequence(_) => return Err(own.order()),
        })
    }
}

/// A model with replaced sensors.
#[derive(Clone, Debug)]
pub(super) struct Equipped<M> {
    pub model: M,
    pub equipment: Equipment,
}

impl<M: ModelFile> Model for Equipped<M> {
    fn dimensions(&self) -> Dimensions {
        let measurements = self.equipment.kept.len() + self.equipment.added.len();
        Dimensions { measurements, ..Model::dimensions(&self.model) }
    }

    fn step<S: Scalar>(&self, at: &Point<S>, next: &mut [S]) {
        self.model.step(at, next);
    }

    fn observe<S: Scalar>(&self, at: &Point<S>, y: &mut [S]) {
        let mut own = vec![S::zero(); Model::dimensions(&self.model).measurements];
        self.model.observe(at, &mut own);
        let Equipment { kept, added, .. } = &self.equipment;
        let mut signals = Vec::new();
        if added.iter().any(|(entry, ..)| matches!(entry, Entry::Of(quantity, _) if quantity.needs_signals())) {
            signals = vec![S::zero(); self.model.signals().len()];
            self.model.signal(at, &mut signals);
        }
        let known = Known { signals: &signals, next: &[] };
        let mut measured = Vec::new();
        let (first, rest) = y.split_at_mut(kept.len());
        for (y, &row) in first.iter_mut().zip(kept) {
            *y = own[row];
        }
        for (y, (entry, ..)) in rest.iter_mut().zip(added) {
            *y = match entry {
                Entry::Own(row) => own[*row],
                Entry::Of(quantity, entry) => {
                    // The entries of a quantity are consecutive.
                    if *entry == 0 {
                        measured = quantity.values(at, &known);
                    }
                    measured[*entry]
                }
                Entry::Sum(factors) => {
                    let terms = factors.iter().zip(at.x).filter(|(factor, _)| !factor.is_zero());
                    terms.fold(S::zero(), |sum, (&factor, &x)| at.value(factor).mul_add(x, sum))
                }
            };
        }
    }

    fn unknowns(&self) -> usize {
        self.model.unknowns()
    }

    fn balance<S: Scalar>(&self, at: &Point<S>, residual: &mut [S]) {
        self.model.balance(at, residual);
    }

    fn mass<S: Scalar>(&self, at: &Point<S>, matrix: &mut [S]) {
        self.model.mass(at, matrix);
    }

    fn solution<S: Scalar>(&self, at: &Point<S>) -> Option<Vec<S>> {
        self.model.solution(at)
    }

    fn signals(&self) -> Vec<String> {
        self.model.signals()
    }

    fn signal<S: Scalar>(&self, at: &Point<S>, out: &mut [S]) {
        self.model.signal(at, out);
    }

    fn own_cost(&self, last: bool) -> Option<OwnCost> {
        self.model.own_cost(last)
    }

    fn own_residual<S: Scalar>(&self, at: &Point<S>, last: bool, out: &mut [S]) {
        self.model.own_residual(at, last, out);
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
        self.model.contact_states(at)
    }

    fn substeps(&self) -> Option<usize> {
        self.model.substeps()
    }

    fn widened(&self, length: Value, speed: Value) -> Option<Self> {
        Some(Self { model: self.model.widened(length, speed)?, equipment: self.equipment.clone() })
    }

    fn joint_names(&self) -> Vec<String> {
        self.model.joint_names()
    }

    fn locked_joints(&self) -> Vec<String> {
        self.model.locked_joints()
    }

    fn coupling_names(&self) -> Vec<String> {
        self.model.coupling_names()
    }

    fn state_names(&self) -> Vec<String> {
        self.model.state_names()
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
        let measurements = kept.chain(added.iter().map(|(_, channel, _)| channel.clone())).collect();
        Channels { states, controls, measurements }
    }

    fn picture(&self, at: &Point<f64>) -> Option<Picture> {
        self.model.picture(at)
    }

    fn landmarks<S: Scalar>(&self, at: &Point<S>) -> Vec<[S; 3]> {
        self.model.landmarks(at)
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
        Some(kept.iter().map(|&row| of_own[row]).chain(added.iter().map(|(_, _, variance)| *variance)).collect())
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
        Vocabulary::of(self)
    }
    fn system(
        &self,
        (costs, followed): (Vec<Cost>, Vec<Followed>),
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
}
