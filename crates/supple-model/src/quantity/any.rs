//! A quantity of whatever kind.

use std::any::Any;
use std::fmt::Debug;
use std::sync::Arc;

use supple_kernels::Scalar;
use supple_kernels::graph::{Function, Node, call};
use supple_lqg::Dimensions;

use super::{Known, Measurable, Reach, Vocabulary};
use crate::channels::Channel;
use crate::document::Unfit;
use crate::parameters::Parameters;
use crate::physics::{Model, Point};

/// A quantity of any kind: every [`Measurable`] can be converted to it by `into`.
///
/// Example: the [module](crate::quantity).
#[derive(Clone, Debug)]
pub struct Quantity(Arc<dyn Kind>);

/// Interface of a quantity whose kind is erased.
trait Kind: Any + Debug + Send + Sync {
    fn name(&self) -> &'static str;
    fn len(&self) -> usize;
    fn channels(&self, vocabulary: &Vocabulary) -> Vec<Channel>;
    fn number(&self, at: &Point<f64>, known: &Known<f64>, out: &mut [f64]);
    fn node(&self, at: &Point<Node>, known: &Known<Node>, out: &mut [Node]);
    fn depends_on_control(&self) -> bool;
    fn needs_signals(&self) -> bool;
    fn needs_next(&self) -> bool;
    fn needs_signals_during(&self) -> bool;
    fn needs_signals_early(&self) -> bool;
    fn rate_of(&self, entry: usize) -> Option<usize>;
    fn least_targets(&self) -> usize;
    fn needs_target(&self) -> bool;
    fn signal_of(&self, entry: usize) -> Option<usize>;
    fn depth_of(&self, target: f64) -> Option<(usize, f64)>;
    fn reach(&self) -> Reach;
    fn check(&self, parameters: &Parameters) -> Result<(), Unfit>;
}

impl<Q: Measurable> Kind for Q {
    fn name(&self) -> &'static str {
        Q::NAME
    }
    fn len(&self) -> usize {
        Measurable::len(self)
    }
    fn channels(&self, vocabulary: &Vocabulary) -> Vec<Channel> {
        Measurable::channels(self, vocabulary)
    }
    fn number(&self, at: &Point<f64>, known: &Known<f64>, out: &mut [f64]) {
        self.evaluate(at, known, out);
    }
    fn node(&self, at: &Point<Node>, known: &Known<Node>, out: &mut [Node]) {
        self.evaluate(at, known, out);
    }
    fn depends_on_control(&self) -> bool {
        Measurable::depends_on_control(self)
    }
    fn needs_signals(&self) -> bool {
        Measurable::needs_signals(self)
    }
    fn needs_next(&self) -> bool {
        Measurable::needs_next(self)
    }
    fn needs_signals_during(&self) -> bool {
        Measurable::needs_signals_during(self)
    }
    fn needs_signals_early(&self) -> bool {
        Measurable::needs_signals_early(self)
    }
    fn rate_of(&self, entry: usize) -> Option<usize> {
        Measurable::rate_of(self, entry)
    }
    fn least_targets(&self) -> usize {
        Measurable::least_targets(self)
    }
    fn needs_target(&self) -> bool {
        Measurable::needs_target(self)
    }
    fn signal_of(&self, entry: usize) -> Option<usize> {
        Measurable::signal_of(self, entry)
    }
    fn depth_of(&self, target: f64) -> Option<(usize, f64)> {
        Measurable::depth_of(self, target)
    }
    fn reach(&self) -> Reach {
        Measurable::reach(self)
    }
    fn check(&self, parameters: &Parameters) -> Result<(), Unfit> {
        Measurable::check(self, parameters)
    }
}

impl<Q: Measurable> From<Q> for Quantity {
    fn from(quantity: Q) -> Self {
        Self(Arc::new(quantity))
    }
}

/// The numbers of a quantity as a function of all possible inputs.
struct Numbers<'a>(&'a dyn Kind);

/// Unpacks the inputs of such a function.
fn known<'a, S: Scalar>(inputs: &[&'a [S]]) -> (Point<'a, S>, Known<'a, S>) {
    let input = |place: usize| inputs.get(place).copied().unwrap_or_default();
    let time_step = input(3).first().copied().unwrap_or_else(S::zero);
    let at = Point { x: input(0), u: input(1), phi: input(2), time_step, w: input(4) };
    (at, Known { signals: input(5), next: input(6), early: input(7) })
}

impl Function for Numbers<'_> {
    fn number(&self, inputs: &[&[f64]], outputs: &mut [f64]) {
        let (at, known) = known(inputs);
        self.0.number(&at, &known, outputs);
    }
    fn node(&self, inputs: &[&[Node]], outputs: &mut [Node]) {
        let (at, known) = known(inputs);
        self.0.node(&at, &known, outputs);
    }
}

impl Quantity {
    /// The name of its kind, as files write it.
    #[must_use]
    pub fn name(&self) -> &'static str {
        self.0.name()
    }

    /// The quantity as a given kind; `None` if it is of another kind.
    #[must_use]
    pub fn as_kind<Q: Measurable>(&self) -> Option<&Q> {
        let kind: &dyn Any = &*self.0;
        kind.downcast_ref()
    }

    /// How many numbers it has.
    #[must_use]
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// Whether it has no numbers.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Names and units of its numbers, for people.
    #[must_use]
    pub fn channels(&self, vocabulary: &Vocabulary) -> Vec<Channel> {
        self.0.channels(vocabulary)
    }

    /// Its numbers at a point.
    pub fn evaluate<S: Scalar>(&self, at: &Point<S>, known: &Known<S>, out: &mut [S]) {
        let inputs = [at.x, at.u, at.phi, &[at.time_step], at.w, known.signals, known.next, known.early];
        call(&Numbers(&*self.0), &inputs, out);
    }

    /// The same as a list.
    pub fn values<S: Scalar>(&self, at: &Point<S>, known: &Known<S>) -> Vec<S> {
        let mut values = vec![S::zero(); self.len()];
        self.evaluate(at, known, &mut values);
        values
    }

    /// Whether it depends on the control: see [`Measurable::depends_on_control`].
    #[must_use]
    pub fn depends_on_control(&self) -> bool {
        self.0.depends_on_control()
    }

    /// Whether it depends on the model's signals.
    #[must_use]
    pub fn needs_signals(&self) -> bool {
        self.0.needs_signals()
    }

    /// Whether it depends on the next state, or takes signals that do.
    #[must_use]
    pub fn needs_next(&self) -> bool {
        self.0.needs_next() || self.0.needs_signals_during()
    }

    /// Whether it takes signals of the first sub-step.
    #[must_use]
    pub fn needs_signals_early(&self) -> bool {
        self.0.needs_signals_early()
    }

    /// Whether sensors can measure it, at once or one step later: the next state may be part of it only as far as the process
    /// noise in it is known, that is, by [`Measurable::rate_of`], or not at all, as in signals during the step.
    pub(super) fn is_measurable(&self) -> bool {
        !self.0.needs_next() || (0..self.len()).all(|entry| self.rate_of(entry).is_some())
    }

    /// The state whose rate an entry is: see [`Measurable::rate_of`].
    #[must_use]
    pub fn rate_of(&self, entry: usize) -> Option<usize> {
        self.0.rate_of(entry)
    }

    /// How many targets a cost must give if it gives any; the remaining targets are 0.
    #[must_use]
    pub fn least_targets(&self) -> usize {
        self.0.least_targets()
    }

    /// Whether a cost must give a target.
    #[must_use]
    pub fn needs_target(&self) -> bool {
        self.0.needs_target()
    }

    /// Index of the signal, if this entry is a signal of the model.
    #[must_use]
    pub fn signal_of(&self, entry: usize) -> Option<usize> {
        self.0.signal_of(entry)
    }

    /// If this is the depth of a contact, or minus that: the index of its signal, and the depth, m, that a target asks for.
    #[must_use]
    pub fn depth_of(&self, target: f64) -> Option<(usize, f64)> {
        self.0.depth_of(target)
    }

    /// How many of the model's numbers there must be.
    #[must_use]
    pub fn reach(&self) -> Reach {
        self.0.reach()
    }

    /// Checks that a model of this size, with this many signals, has all that it reads.
    ///
    /// # Errors
    /// What the model has not.
    pub fn check_reach(&self, size: Dimensions, signals: usize) -> Result<(), Unfit> {
        let Reach { states, controls, signals: read } = self.reach();
        let given =
            [("states", states, size.states), ("controls", controls, size.controls), ("signals", read, signals)];
        match given.into_iter().find(|&(_, last, found)| last > found) {
            None => Ok(()),
            Some((what, last, found)) => Err(Unfit::here(format!(
                "`{}` reads number {last} of the model's {what}, of which there are {found}",
                self.name()
            ))),
        }
    }

    /// What is wrong with its numbers, given the parameters' bounds: the key, and what is valid.
    ///
    /// # Errors
    /// If something is wrong.
    pub fn check(&self, parameters: &Parameters) -> Result<(), Unfit> {
        self.0.check(parameters)
    }
}

/// The model's signals at a point, or during the step to `next` if any of these quantities takes such; empty if none
/// takes signals.
pub(crate) fn signals_for<M: Model, S: Scalar>(
    model: &M,
    quantities: &[&Quantity],
    at: &Point<S>,
    next: &[S],
) -> Vec<S> {
    let mut signals = Vec::new();
    if quantities.iter().any(|quantity| quantity.needs_signals()) {
        signals.resize(model.signals().len(), S::zero());
        match quantities.iter().any(|quantity| quantity.0.needs_signals_during()) {
            true => model.signal_during(at, next, &mut signals),
            false => model.signal(at, &mut signals),
        }
    }
    signals
}
