//! A compliance element of any kind.

use std::fmt::Debug;
use std::sync::Arc;

use serde::Deserialize;
use supple_kernels::Scalar;
use supple_kernels::graph::Node;

use super::{
    BesideJoint, Compliance, ComplianceFile, Drawn, DryFriction, Forces, Names, Own, Push, Resistance, Rule, Unfit,
};
use crate::contacts::ContactState;
use crate::document::{ReadError, Reader, Registry};
use crate::{Point, Value};

/// An element of compliance of any kind: every [`Compliance`] can be converted to it by `into`.
#[derive(Clone, Debug)]
pub(in crate::model) struct Coupling(Arc<dyn Kind>);

/// Interface, over one scalar type, of an element whose kind is erased.
pub(in crate::model) trait Over<S> {
    fn inertias(&self, at: &Point<S>) -> Vec<S>;
    fn measure(&self, own: &Own<S>) -> Vec<S>;
    fn deflect(&self, own: &Own<S>) -> Vec<S>;
    fn apply(&self, own: &Own<S>, forces: &mut Forces<S>);
    fn resistance(&self, own: &Own<S>) -> Vec<Resistance<S>>;
    fn dry_friction(&self, own: &Own<S>) -> Option<DryFriction<S>>;
    fn push(&self, own: &Own<S>) -> Option<Push<S>>;
    fn wall(&self, own: &Own<S>) -> Option<([f64; 3], [S; 3])>;
}

impl<C: Compliance, S: Scalar> Over<S> for C {
    fn inertias(&self, at: &Point<S>) -> Vec<S> {
        Compliance::inertias(self, at)
    }
    fn measure(&self, own: &Own<S>) -> Vec<S> {
        Compliance::measure(self, own)
    }
    fn deflect(&self, own: &Own<S>) -> Vec<S> {
        Compliance::deflect(self, own)
    }
    fn apply(&self, own: &Own<S>, forces: &mut Forces<S>) {
        Compliance::apply(self, own, forces);
    }
    fn resistance(&self, own: &Own<S>) -> Vec<Resistance<S>> {
        Compliance::resistance(self, own)
    }
    fn dry_friction(&self, own: &Own<S>) -> Option<DryFriction<S>> {
        Compliance::dry_friction(self, own)
    }
    fn push(&self, own: &Own<S>) -> Option<Push<S>> {
        Compliance::push(self, own)
    }
    fn wall(&self, own: &Own<S>) -> Option<([f64; 3], [S; 3])> {
        Compliance::wall(self, own)
    }
}

/// Interface of an element whose kind is erased.
pub(in crate::model) trait Kind: Debug + Send + Sync + Over<f64> + Over<Node> {
    fn coordinates(&self) -> usize;
    fn constants(&self) -> usize;
    fn signals(&self) -> Vec<&'static str>;
    fn deflections(&self) -> Vec<&'static str>;
    fn has_dry_friction(&self) -> bool;
    fn pushes(&self) -> bool;
    fn widened(&self, length: &Value, speed: &Value) -> Option<Coupling>;
    fn draw(&self, own: &Own<f64>) -> Drawn;
    fn ball(&self, own: &Own<f64>) -> Option<(usize, f64)>;
    fn frames(&self) -> Vec<usize>;
    fn has_wall(&self) -> bool;
    fn motor_of(&self) -> Option<usize>;
    fn beside_joint(&self) -> Option<BesideJoint>;
    fn rules(&self) -> Vec<Rule<'_>>;
}

impl<C: Compliance> Kind for C {
    fn coordinates(&self) -> usize {
        Compliance::coordinates(self)
    }
    fn constants(&self) -> usize {
        Compliance::constants(self)
    }
    fn signals(&self) -> Vec<&'static str> {
        Compliance::signals(self)
    }
    fn deflections(&self) -> Vec<&'static str> {
        Compliance::deflections(self)
    }
    fn has_dry_friction(&self) -> bool {
        Compliance::has_dry_friction(self)
    }
    fn pushes(&self) -> bool {
        Compliance::pushes(self)
    }
    fn widened(&self, length: &Value, speed: &Value) -> Option<Coupling> {
        Compliance::widened(self, length, speed).map(Coupling::from)
    }
    fn draw(&self, own: &Own<f64>) -> Drawn {
        Compliance::draw(self, own)
    }
    fn ball(&self, own: &Own<f64>) -> Option<(usize, f64)> {
        Compliance::ball(self, own)
    }
    fn frames(&self) -> Vec<usize> {
        Compliance::frames(self)
    }
    fn has_wall(&self) -> bool {
        Compliance::has_wall(self)
    }
    fn motor_of(&self) -> Option<usize> {
        Compliance::motor_of(self)
    }
    fn beside_joint(&self) -> Option<BesideJoint> {
        Compliance::beside_joint(self)
    }
    fn rules(&self) -> Vec<Rule<'_>> {
        Compliance::rules(self)
    }
}

/// A scalar type that elements of compliance support directly. Other scalars are handled through the supported ones: see
/// [`Function`](supple_kernels::graph::Function).
pub(in crate::model) trait Native: Scalar {
    /// The element's interface over this scalar.
    fn over(kind: &dyn Kind) -> &dyn Over<Self>;
}

impl Native for f64 {
    fn over(kind: &dyn Kind) -> &dyn Over<Self> {
        kind
    }
}

impl Native for Node {
    fn over(kind: &dyn Kind) -> &dyn Over<Self> {
        kind
    }
}

impl<C: Compliance> From<C> for Coupling {
    fn from(element: C) -> Self {
        Self(Arc::new(element))
    }
}

impl std::ops::Deref for Coupling {
    type Target = dyn Kind;

    fn deref(&self) -> &Self::Target {
        &*self.0
    }
}

/// The signals that make an element a contact, in addition to the total force `force_x`, `force_y`, `force_z`.
pub(in crate::model) const CONTACT_FORCE: &str = "contact_force";

/// The components of the total force of a contact.
pub(in crate::model) const FORCE_COMPONENTS: [&str; 3] = ["force_x", "force_y", "force_z"];
pub(in crate::model) const PENETRATION: &str = "penetration";

impl Coupling {
    /// Its interface over a scalar type.
    pub fn over<S: Native>(&self) -> &dyn Over<S> {
        S::over(&*self.0)
    }

    /// Whether this element makes the given degree of freedom elastic.
    pub fn is_motor_of(&self, dof: usize) -> bool {
        self.motor_of() == Some(dof)
    }

    /// Whether it is a contact: it has the signals `contact_force` and `penetration`.
    pub fn is_contact(&self) -> bool {
        [CONTACT_FORCE, PENETRATION].iter().all(|signal| self.signals().contains(signal))
    }

    /// Its state as a contact; `None` if it is not a contact.
    pub fn contact_state(&self, own: &Own<f64>) -> Option<ContactState> {
        if !self.is_contact() {
            return None;
        }
        let (names, values, rules) = (self.signals(), self.over::<f64>().measure(own), self.rules());
        let signal = |name: &str| names.iter().position(|other| *other == name).map(|place| values[place]);
        let number = |name: &str| rules.iter().find(|rule| rule.key == name).map(|rule| own.value(rule.value));
        Some(ContactState {
            force: signal(CONTACT_FORCE)?,
            clearance: -signal(PENETRATION)?,
            smoothing: number("smoothing")?,
            stiffness: number("stiffness")?,
            radius: number("radius").unwrap_or_default(),
            total_force: [signal("force_x")?, signal("force_y")?, signal("force_z")?],
        })
    }
}

/// Reads an element from its table, without the keys `kind` and `name`.
type Build = fn(Reader, &Names) -> Result<Result<Coupling, Unfit>, ReadError>;

/// The kinds of compliance that task files may name.
#[derive(Clone, Debug)]
pub struct Couplings(Registry<Build>);

impl Couplings {
    /// An empty registry.
    pub(super) fn none() -> Self {
        Self(Registry::default())
    }

    /// Adds a kind, replacing any kind of the same name.
    pub fn add<C: ComplianceFile>(&mut self) {
        let build = |table: Reader, names: &Names| {
            C::File::deserialize(table).map(|file| C::build(file, names).map(Coupling::from))
        };
        self.0.add::<C::File>(C::NAME, build);
    }

    /// The names of all kinds, in order.
    pub fn names(&self) -> Vec<&'static str> {
        self.0.names()
    }

    /// How a kind is read; `None` if there is no such kind.
    pub(in crate::model) fn get(&self, kind: &str) -> Option<&Build> {
        self.0.get(kind)
    }

    /// The schema of each kind's table, by name.
    #[cfg(feature = "schema")]
    pub fn schemas(&self, generator: &mut schemars::SchemaGenerator) -> Vec<(&'static str, schemars::Schema)> {
        self.0.schemas(generator)
    }
}
