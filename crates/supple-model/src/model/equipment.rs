use std::sync::Arc;

use crate::noise::Covariance;
use crate::quantity::{Quantity, Sensor};
use crate::{Channel, Value};

/// The source of an entry of a measurement.
///
/// Example: [`Equipment`].
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
///
/// ```
/// use supple_model::model::{Entry, Equipment};
/// use supple_model::noise::Covariance;
/// use supple_model::{Channel, Value};
///
/// // The second of two measurements is kept; the first is replaced by one with less noise.
/// let laser = (Entry::Own(0), Channel::new("x1 by laser", "m"), Value::Number(1e-4));
/// let equipment = Equipment { own: 2, kept: vec![1], added: vec![laser] };
/// let found = equipment.covariance(&Covariance::diagonal([0.1, 0.2]));
/// assert_eq!(found, Ok(Covariance::diagonal([0.2, 1e-4])));
/// ```
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
    /// The entries of a sensor.
    #[must_use]
    pub fn entries(sensor: &Sensor) -> Vec<(Entry, Channel, Value)> {
        let quantity = Arc::new(sensor.quantity.clone());
        let entries = sensor.channels.iter().zip(&sensor.variances).enumerate();
        entries
            .map(|(entry, (channel, variance))| (Entry::Of(quantity.clone(), entry), channel.clone(), variance.clone()))
            .collect()
    }

    /// The same with only some of its entries, by their numbers in order.
    #[must_use]
    pub fn keeping(self, numbers: &[usize]) -> Self {
        let Self { own, kept, added } = self;
        let is_kept = |number: usize| numbers.contains(&number);
        let first = kept.len();
        let kept = kept.into_iter().enumerate().filter(|(place, _)| is_kept(*place)).map(|(_, row)| row).collect();
        let added =
            added.into_iter().enumerate().filter(|(place, _)| is_kept(first + place)).map(|(_, it)| it).collect();
        Self { own, kept, added }
    }

    /// The covariance of all entries, given that of the model's own measurements; added noise is independent.
    ///
    /// # Errors
    /// If the covariance does not match the model's own measurements; the error is its order.
    pub fn covariance(&self, own: &Covariance) -> Result<Covariance, usize> {
        if own.order() != self.own {
            return Err(own.order());
        }
        let added = || self.added.iter().map(|(_, _, variance)| variance);
        Ok(match own {
            Covariance::Diagonal(variances) => {
                Covariance::Diagonal(self.kept.iter().map(|&row| &variances[row]).chain(added()).cloned().collect())
            }
            Covariance::Full(rows) => {
                let order = self.kept.len() + self.added.len();
                let first = self.kept.iter().map(|&row| {
                    let mut kept: Vec<Value> = self.kept.iter().map(|&col| rows[row][col].clone()).collect();
                    kept.resize(order, Value::default());
                    kept
                });
                let alone = added().enumerate().map(|(place, variance)| {
                    let mut row = vec![Value::default(); order];
                    row[self.kept.len() + place] = variance.clone();
                    row
                });
                Covariance::Full(first.chain(alone).collect())
            }
            // Not possible in task files.
            Covariance::Sequence(_) => return Err(own.order()),
        })
    }
}

/// A state that keeps what an entry of a quantity was in the last step, for sensors of what depends on the control
/// (theory, equation R.28).
///
/// A sensor in a task file whose measurement such a state keeps:
///
/// ```toml
/// sensors = [{ kind = "joint_acceleration", select = ["elbow"], variance = 1e-2 }]
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Recalled {
    /// Its name and unit.
    pub channel: Channel,
    /// The model's state whose rate the entry is, if it is one. Its process noise over the time step is part of that rate.
    pub rate_of: Option<usize>,
}

impl Entry {
    /// The entry of a quantity that is measured one step later; `None` for what is measured at once.
    pub(super) fn of_last_step(&self) -> Option<(&Quantity, usize)> {
        match self {
            Self::Of(quantity, entry) if quantity.depends_on_control() => Some((quantity, *entry)),
            _ => None,
        }
    }

    /// The quantity that is measured at once.
    pub(super) fn of_now(&self) -> Option<&Quantity> {
        match self {
            Self::Of(quantity, _) if !quantity.depends_on_control() => Some(quantity),
            _ => None,
        }
    }
}
