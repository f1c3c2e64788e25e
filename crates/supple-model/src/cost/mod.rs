//! Costs: `l(x, u) = sum of terms`, each a weight times a norm of a quantity's distance from its targets.
//!
//! # Norms
//!
//! ```
//! use supple_model::Value;
//! use supple_model::cost::{Absolute, Cost, Quadratic};
//! use supple_model::quantity::State;
//!
//! // A residual of 3 and 4: the sum of its squares, and approximately the sum of its absolute values.
//! let squares = Cost::new(State::new([0, 1]), 1.0).with_norm(Quadratic);
//! let absolute = Cost::new(State::new([0, 1]), 1.0).with_norm(Absolute { smoothing: Value::Number(1e-3) });
//! assert_eq!(squares.of_residual(&[3.0_f64, 4.0], &[], false), 25.0);
//! assert!((absolute.of_residual(&[3.0_f64, 4.0], &[], false) - 7.0).abs() < 0.01);
//! ```

use supple_kernels::Scalar;

use crate::quantity::{Quantity, StateAndControl};
use crate::{Point, Value};

mod absolute;
mod check;
mod norm;
mod norms;
mod quadratic;
mod read;
mod square;
mod target;

pub use crate::document::NoKeys;
pub use absolute::Absolute;
pub use norm::{Norm, NormFile, NormKind};
pub use norms::Norms;
#[cfg(feature = "schema")]
pub use read::schemas;
pub use read::{kinds, read};
pub use square::Quadratic;
pub use target::Target;

/// The name in files of the cost `x'Qx + u'Ru`.
const QUADRATIC: &str = "quadratic";

/// The weights of a residual's entries in a stage or in the final cost.
///
/// Example: [`Cost`].
#[derive(Clone, Debug, PartialEq)]
pub enum Weights {
    /// One weight for all entries.
    Equal(Value),
    /// One weight for each entry.
    Each(Vec<Value>),
    /// A weight matrix `M`: `r' M r`; only used with the quadratic norm.
    Matrix(Vec<Vec<Value>>),
}

impl Weights {
    /// All of them.
    fn iter(&self) -> impl Iterator<Item = &Value> {
        let (list, rows): (&[Value], &[Vec<Value>]) = match self {
            Self::Equal(weight) => (std::slice::from_ref(weight), &[]),
            Self::Each(weights) => (weights, &[]),
            Self::Matrix(rows) => (&[], rows),
        };
        list.iter().chain(rows.iter().flatten())
    }

    /// Whether every weight is the number 0.
    #[must_use]
    pub fn are_zero(&self) -> bool {
        self.iter().all(|weight| weight.is_zero())
    }

    /// Whether any weight of an entry is non-zero at `phi`.
    pub(crate) fn weighs(&self, entry: usize, phi: &[f64]) -> bool {
        let is_weighed = |weight: &Value| weight.resolve::<f64>(phi) != 0.0;
        match self {
            Self::Equal(weight) => is_weighed(weight),
            Self::Each(weights) => weights.get(entry).is_some_and(is_weighed),
            Self::Matrix(rows) => rows.get(entry).is_some_and(|row| row.iter().any(is_weighed)),
        }
    }

    /// Multiplies every weight by a value.
    pub fn scale(&mut self, by: &Value) {
        match self {
            Self::Equal(weight) => *weight = weight.times(by),
            Self::Each(weights) => weights.iter_mut().for_each(|weight| *weight = weight.times(by)),
            Self::Matrix(rows) => rows.iter_mut().flatten().for_each(|weight| *weight = weight.times(by)),
        }
    }

    /// Whether every weight is 0 at `phi`.
    #[must_use]
    pub fn are_zero_at(&self, phi: &[f64]) -> bool {
        self.iter().all(|weight| weight.resolve::<f64>(phi) == 0.0)
    }
}

/// One term of a task's cost: how far a quantity is from its targets.
///
/// ```
/// use supple_model::Value;
/// use supple_model::cost::Cost;
/// use supple_model::quantity::{Control, State};
///
/// // Track 0.5 and 0 with the first two states, with five times the weight at the end, and penalise controls.
/// let reach = Cost::new(State::new([0, 1]), 1.0).with_targets([0.5, 0.0]).with_final_weight(5.0);
/// let effort = Cost::new(Control::all(2), 0.01);
/// assert!(effort.last.are_zero());
/// # assert_eq!(reach.targets, [Value::Number(0.5), Value::Number(0.0)]);
/// ```
#[derive(Clone, Debug)]
pub struct Cost {
    /// The quantity.
    pub quantity: Quantity,
    /// Where it should be: one number per entry of the quantity, in its units.
    pub targets: Vec<Value>,
    /// The norm that converts the distance to a cost.
    pub norm: Norm,
    /// Weights at steps 0 to N - 1.
    pub stage: Weights,
    /// Weights at step N.
    pub last: Weights,
}

impl Cost {
    /// The squared distance of a quantity from 0, with one weight for all of its entries. The final cost has the same
    /// weight, unless the quantity depends on the control.
    pub fn new(quantity: impl Into<Quantity>, weight: impl Into<Value>) -> Self {
        let (quantity, weight) = (quantity.into(), weight.into());
        let last = if quantity.depends_on_control() { Value::Number(0.0) } else { weight.clone() };
        Self {
            targets: vec![Value::Number(0.0); quantity.len()],
            norm: Quadratic.into(),
            stage: Weights::Equal(weight),
            last: Weights::Equal(last),
            quantity,
        }
    }

    /// The same with targets, in the order of the quantity's entries; entries without a new target keep theirs.
    #[must_use]
    pub fn with_targets<T: Into<Value>>(mut self, targets: impl IntoIterator<Item = T>) -> Self {
        // More than there are entries are kept too, for checks to refuse.
        let given: Vec<Value> = targets.into_iter().map(Into::into).collect();
        self.targets.splice(..given.len().min(self.targets.len()), given);
        self
    }

    /// The same with another norm.
    #[must_use]
    pub fn with_norm(self, norm: impl Into<Norm>) -> Self {
        Self { norm: norm.into(), ..self }
    }

    /// The same with these weights at all steps, and in the final cost unless the quantity depends on the control.
    #[must_use]
    pub fn with_weights(self, weights: Weights) -> Self {
        let last = if self.quantity.depends_on_control() { self.last } else { weights.clone() };
        Self { stage: weights, last, ..self }
    }

    /// The same with one final weight for all entries.
    #[must_use]
    pub fn with_final_weight(self, weight: impl Into<Value>) -> Self {
        Self { last: Weights::Equal(weight.into()), ..self }
    }

    /// The name of its kind, as files write it.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match (self.quantity.as_kind::<StateAndControl>(), &self.stage) {
            (Some(_), Weights::Matrix(_)) => QUADRATIC,
            _ => self.quantity.name(),
        }
    }

    /// The weights of a stage, or those of the final cost.
    #[must_use]
    pub fn weights(&self, last: bool) -> &Weights {
        if last { &self.last } else { &self.stage }
    }

    /// Whether any of its weights is non-zero at `phi`, so that it contributes to the cost.
    #[must_use]
    pub fn counts(&self, phi: &[f64]) -> bool {
        !(self.stage.are_zero_at(phi) && self.last.are_zero_at(phi))
    }

    /// The entries of its quantity that any of its weights counts at `phi`.
    #[must_use]
    pub fn weighed(&self, phi: &[f64]) -> Vec<usize> {
        let is_weighed = |&entry: &usize| self.stage.weighs(entry, phi) || self.last.weighs(entry, phi);
        (0..self.targets.len()).filter(is_weighed).collect()
    }

    /// Whether an entry of its quantity depends on the control.
    pub(crate) fn of_control(&self, entry: usize) -> bool {
        let states = self.quantity.as_kind::<StateAndControl>().map_or(0, StateAndControl::states);
        entry >= states && self.quantity.depends_on_control()
    }

    /// The signals with a non-zero target, by index, and their targets.
    #[must_use]
    pub fn wanted(&self, phi: &[f64]) -> Vec<(usize, f64)> {
        let targets = self.targets.iter().enumerate();
        let wanted = targets.filter_map(|(entry, target)| Some((self.quantity.signal_of(entry)?, target.resolve(phi))));
        wanted.filter(|&(_, target)| target != 0.0).collect()
    }

    /// If its quantity is the depth of a contact, or minus that: the index of its signal, and the depth that it asks for, m.
    #[must_use]
    pub fn wanted_depth(&self, phi: &[f64]) -> Option<(usize, f64)> {
        self.quantity.depth_of(self.targets.first().map_or(0.0, |target| target.resolve(phi)))
    }

    /// The residual at a point: how far the quantity is from its targets, given its values there.
    pub fn residual<S: Scalar>(&self, mut values: Vec<S>, at: &Point<S>) -> Vec<S> {
        for (entry, target) in values.iter_mut().zip(&self.targets).filter(|(_, target)| !target.is_zero()) {
            *entry -= at.value(target);
        }
        values
    }

    /// The cost of a residual.
    pub fn of_residual<S: Scalar>(&self, r: &[S], phi: &[S], last: bool) -> S {
        let mut sum = S::zero();
        match self.weights(last) {
            Weights::Equal(weight) => {
                for value in self.norm.values(r, phi) {
                    sum += value;
                }
                weight.resolve(phi) * sum
            }
            Weights::Each(weights) => {
                for (weight, value) in weights.iter().zip(self.norm.values(r, phi)) {
                    if !weight.is_zero() {
                        sum = weight.resolve(phi).mul_add(value, sum);
                    }
                }
                sum
            }
            Weights::Matrix(rows) => {
                for (row, &left) in rows.iter().zip(r) {
                    for (weight, &right) in row.iter().zip(r) {
                        if !weight.is_zero() {
                            sum = (weight.resolve(phi) * left).mul_add(right, sum);
                        }
                    }
                }
                sum
            }
        }
    }
}
