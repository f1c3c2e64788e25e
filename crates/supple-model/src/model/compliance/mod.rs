//! Compliance: springs, dampers and contacts that a designer adds to a robot.
//!
//! To add a kind, write one file and one line in the list of `library.rs`; kinds of other crates are added to
//! [`Kinds`](crate::Kinds).

use std::fmt::Debug;

use serde::Deserialize;
use supple_kernels::Scalar;

use super::bodies::{Forces, Own};
use crate::document::Described;
use crate::quantity::Unfit;
use crate::scene::ConnectionKind;
use crate::{Point, Value};

mod any;
mod bushing;
mod contact;
mod elastic_joint;
mod element;
mod library;
mod names;
mod spring;

pub use any::Couplings;
pub(super) use any::{CONTACT_FORCE, FORCE_COMPONENTS, Native, PENETRATION};
pub(super) use element::Element;
pub use names::Names;
pub(super) use names::find;
pub(super) use spring::Spring;

/// The behaviour of an element of compliance.
///
/// It stores the indices of the frames and positions on which it acts; [`Names`] resolves them when the file is read.
/// Its functions are recorded only once, so favour readability over speed; do not branch on computed numbers.
///
/// Example: the [module](crate::model::coupling).
pub trait Compliance: Debug + Send + Sync + 'static {
    /// The name of the kind, as files write it.
    const NAME: &'static str;

    /// How many coordinates it adds to the state, each with its velocity.
    fn coordinates(&self) -> usize {
        0
    }

    /// How many constants it adds to the state.
    fn constants(&self) -> usize {
        0
    }

    /// The inertias of the coordinates that it adds, kg m^2 or kg.
    fn inertias<S: Scalar>(&self, _at: &Point<S>) -> Vec<S> {
        Vec::new()
    }

    /// The names of the values of [`Compliance::measure`].
    fn signals(&self) -> Vec<&'static str>;

    /// Its forces and other signals for sensors and costs.
    fn measure<S: Scalar>(&self, own: &Own<S>) -> Vec<S>;

    /// The names of the values of [`Compliance::deflect`].
    fn deflections(&self) -> Vec<&'static str> {
        Vec::new()
    }

    /// Deflection from rest, m or rad.
    fn deflect<S: Scalar>(&self, _own: &Own<S>) -> Vec<S> {
        Vec::new()
    }

    /// Adds its forces to the total.
    fn apply<S: Scalar>(&self, own: &Own<S>, forces: &mut Forces<S>);

    /// How its forces decrease with the [rates](Own::rates).
    fn resistance<S: Scalar>(&self, own: &Own<S>) -> Vec<Resistance<S>>;

    /// Whether it has dry friction, as [`Compliance::dry_friction`] describes.
    fn has_dry_friction(&self) -> bool {
        false
    }

    /// Its friction along a surface, which implicit steps evaluate at their final velocity (theory, equation R.23).
    fn dry_friction<S: Scalar>(&self, _own: &Own<S>) -> Option<DryFriction<S>> {
        None
    }

    /// Whether it pushes, as [`Compliance::push`] describes.
    fn pushes(&self) -> bool {
        false
    }

    /// Its push away from a wall, which implicit steps evaluate where they end (theory, equation R.22).
    fn push<S: Scalar>(&self, _own: &Own<S>) -> Option<Push<S>> {
        None
    }

    /// The same element with forces that build up over a length increased by `_length`, m, and friction over one increased
    /// by `_speed`, m/s; `None` if it has no such length.
    fn widened(&self, _length: &Value, _speed: &Value) -> Option<Self>
    where
        Self: Sized,
    {
        None
    }

    /// Its location and force, for pictures.
    fn draw(&self, own: &Own<f64>) -> Drawn;

    /// The frame at which it touches with a sphere, and the radius of that, m, for pictures; `None` if it does not.
    fn ball(&self, _own: &Own<f64>) -> Option<(usize, f64)> {
        None
    }

    /// The frames that it acts on.
    fn frames(&self) -> Vec<usize> {
        Vec::new()
    }

    /// Whether it involves a wall.
    fn has_wall(&self) -> bool {
        false
    }

    /// Its wall: the normal, and a point of it, m in the world.
    fn wall<S: Scalar>(&self, _own: &Own<S>) -> Option<([f64; 3], [S; 3])> {
        None
    }

    /// The degree of freedom that it makes elastic; its first coordinate is then that of the motor.
    fn motor_of(&self) -> Option<usize> {
        None
    }

    /// The equivalent joint spring and damper, if this kind is one.
    fn beside_joint(&self) -> Option<BesideJoint> {
        None
    }

    /// Lower limits of its numbers.
    fn rules(&self) -> Vec<Rule<'_>>;
}

/// How an element is read from a task file.
///
/// Example: the [module](crate::model::coupling).
pub trait ComplianceFile: Compliance + Sized {
    /// The keys of its table, except `kind` and `name`.
    type File: for<'de> Deserialize<'de> + Described;

    /// The element.
    ///
    /// # Errors
    /// If the table does not fit the robot.
    fn build(file: Self::File, names: &Names) -> Result<Self, Unfit>;
}

/// Lower limit of the value of a key.
///
/// Example: the [module](crate::model::coupling).
#[derive(Clone, Copy, Debug)]
pub struct Rule<'a> {
    pub(super) key: &'static str,
    pub(super) value: &'a Value,
    pub(super) least: f64,
    /// Whether the value must be strictly greater than the limit.
    pub(super) more: bool,
    /// What the value means, for whoever gave another.
    pub(super) help: Option<&'static str>,
}

impl<'a> Rule<'a> {
    /// The value of a key must be at least this.
    #[must_use]
    pub fn at_least(key: &'static str, value: &'a Value, least: f64) -> Self {
        Self { key, value, least, more: false, help: None }
    }

    /// The value of a key must be above this.
    #[must_use]
    pub fn above(key: &'static str, value: &'a Value, least: f64) -> Self {
        Self { key, value, least, more: true, help: None }
    }

    /// Says what the value means to whoever gave one that breaks the rule.
    #[must_use]
    pub fn with_help(self, help: &'static str) -> Self {
        Self { help: Some(help), ..self }
    }
}

/// A spring and damper acting in parallel with a joint.
///
/// Example: the [module](crate::model::coupling).
#[derive(Clone, Debug)]
pub struct BesideJoint {
    /// The joint's degree of freedom.
    pub dof: usize,
    /// N m/rad or N/m.
    pub stiffness: Value,
    /// Position at which it is at rest, rad or m.
    pub rest: Value,
    /// N m s/rad or N s/m.
    pub damping: Value,
}

/// A force that decreases by `rows' block rows r` with the rates `r` of all positions.
///
/// Example: the [module](crate::model::coupling).
#[derive(Clone, Debug)]
pub struct Resistance<S> {
    /// N s/m or N m s/rad: symmetric, positive semidefinite.
    pub block: Vec<Vec<S>>,
    /// As many rows as the block, each with an entry per position.
    pub rows: Vec<Vec<S>>,
}

/// Friction along a surface: at the velocity `v = motions' rates` of the sliding point, the force is
/// `-limit v / sqrt(v' v + smoothing^2)`. [`Compliance::apply`] leaves it out if [`Own::is_linear`].
#[derive(Clone, Debug)]
pub struct DryFriction<S> {
    /// Force at speeds far above the smoothing, N: not negative, and independent of the [rates](Own::rates).
    pub limit: S,
    /// Speed over which friction builds up, m/s; above 0.
    pub smoothing: S,
    /// Motion of the sliding point along the surface per unit rate of each degree of freedom, in the world.
    pub motions: Vec<[S; 3]>,
}

/// The push of a contact away from its wall (theory, equation R.14): with the depth `d` and its rate `v`, both at the end of
/// the step, `stiffness [d] [1 + dissipation v]`. [`Compliance::apply`] leaves it out if [`Own::is_linear`].
#[derive(Clone, Debug)]
pub struct Push<S> {
    /// Depth at the beginning of the step, m.
    pub depth: S,
    /// N/m
    pub stiffness: S,
    /// Length over which the force begins, m; above 0.
    pub smoothing: S,
    /// s/m
    pub dissipation: S,
    /// How much the depth grows per unit rate of each degree of freedom.
    pub motions: Vec<S>,
}

impl<S: Scalar> Push<S> {
    /// The range of `dissipation` times the rate of the depth over which the force on a separating body drops to 0.
    const RELEASE: f64 = 0.5;

    /// The force after a time `lead`, s, in which the depth grows at `rate`, m/s, and how much it grows per unit of the rate.
    pub fn at(&self, lead: S, rate: S) -> (S, S) {
        let release = S::constant(Self::RELEASE);
        let (depth, lifted) = (lead.mul_add(rate, self.depth), self.dissipation.mul_add(rate, S::one()));
        let (pressed, damped) = (depth.rounded_positive_part(self.smoothing), lifted.rounded_positive_part(release));
        let steeper = lead * depth.rounded_step(self.smoothing) * damped;
        let slope = steeper + pressed * self.dissipation * lifted.rounded_step(release);
        (self.stiffness * pressed * damped, self.stiffness * slope)
    }
}

impl<S: Scalar> Own<'_, S> {
    /// The resistance of a spring and damper acting on a weighted sum of positions: their indices, each with its weight.
    #[must_use]
    pub fn resistance(&self, stiffness: &Value, damping: &Value, sum: &[(usize, f64)]) -> Resistance<S> {
        let mut row = vec![S::zero(); self.positions().len()];
        for &(place, factor) in sum {
            row[place] = S::constant(factor);
        }
        Resistance { block: vec![vec![self.resisting(stiffness, damping)]], rows: vec![row] }
    }

    /// The resistance of springs and dampers along three directions; `motions` is the motion per degree of freedom.
    pub fn resistances(
        &self,
        stiffness: &[Value; 3],
        damping: &[Value; 3],
        directions: [[S; 3]; 3],
        motions: &[[S; 3]],
    ) -> Resistance<S> {
        let terms = [0, 1, 2].map(|axis| (self.resisting(&stiffness[axis], &damping[axis]), directions[axis]));
        self.spread(squares(&terms), motions)
    }

    /// A resistance whose rows are the entries of `motions`, the motion per degree of freedom.
    pub fn spread<const N: usize>(&self, block: [[S; N]; N], motions: &[[S; N]]) -> Resistance<S> {
        let row = |entry: usize| {
            let mut row: Vec<S> = motions.iter().map(|motion| motion[entry]).collect();
            row.resize(self.positions().len(), S::zero());
            row
        };
        Resistance { block: block.map(|row| row.to_vec()).to_vec(), rows: (0..N).map(row).collect() }
    }

    /// `damping + lead stiffness`
    fn resisting(&self, stiffness: &Value, damping: &Value) -> S {
        self.value(damping) + self.lead() * self.value(stiffness)
    }
}

/// `sum c d d'` of coefficients and directions.
fn squares<S: Scalar>(terms: &[(S, [S; 3])]) -> [[S; 3]; 3] {
    let mut sum = [[S::zero(); 3]; 3];
    for &(coefficient, direction) in terms {
        let scaled = direction.map(|entry| coefficient * entry);
        for i in 0..3 {
            for j in 0..=i {
                sum[i][j] = scaled[i].mul_add(direction[j], sum[i][j]);
                sum[j][i] = sum[i][j];
            }
        }
    }
    sum
}

/// How an element is drawn in a picture.
///
/// Example: the [module](crate::model::coupling).
#[derive(Clone, Copy, Debug)]
pub struct Drawn {
    /// What it is drawn as.
    pub kind: ConnectionKind,
    /// Its first end, m in the world.
    pub from: [f64; 3],
    /// Its second end, m in the world.
    pub to: [f64; 3],
    /// Force on the body at the second end, N in the world.
    pub force: [f64; 3],
    /// Torque on it, N m.
    pub torque: [f64; 3],
}

impl Drawn {
    /// A spring in parallel with a joint, exerting the force or torque `effort` on the joint's child link.
    #[must_use]
    pub fn beside_joint(own: &Own<f64>, dof: usize, effort: f64) -> Self {
        let (from, to, axis) = own.joint(dof);
        let (along, none) = (axis.map(|entry| effort * entry), [0.0; 3]);
        let (force, torque) = if own.slides(dof) { (along, none) } else { (none, along) };
        Self { kind: ConnectionKind::Spring, from, to, force, torque }
    }
}
