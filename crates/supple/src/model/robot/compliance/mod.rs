//! Compliance: springs, dampers and contacts that a designer adds to a robot.
//!
//! A new kind is one file, and one line in the table at the end of this file.

use serde::Deserialize;
use supple_kernels::Scalar;

use super::situation::{Forces, Own};
use crate::contacts::ContactState;
use crate::document::{ReadError, Reader};
use crate::scene::ConnectionKind;
use crate::{Point, Value};

mod bushing;
mod contact;
mod elastic_joint;
mod spring;

use bushing::Bushing;
use contact::Contact;
use elastic_joint::ElasticJoint;
use spring::Spring;

/// A named element of compliance, and where in the state it finds what it adds.
#[derive(Clone, Debug)]
pub(super) struct Element {
    pub name: String,
    pub kind: Kind,
    /// Place of its first coordinate among those that compliance adds.
    pub coordinate: usize,
    /// Place of its first constant.
    pub constant: usize,
}

/// What an element of compliance does.
pub(super) trait Compliance {
    /// How many coordinates with velocities of their own it adds to the state.
    fn coordinates(&self) -> usize {
        0
    }

    /// How many constants it adds to the state.
    fn constants(&self) -> usize {
        0
    }

    /// The inertias of the coordinates that it adds.
    fn inertias<S: Scalar>(&self, _at: &Point<S>) -> Vec<S> {
        Vec::new()
    }

    /// The names of what [`Compliance::measure`] gives.
    fn signals(&self) -> Vec<&'static str>;

    /// Its forces, and what else sensors and costs may want to know.
    fn measure<S: Scalar>(&self, own: &Own<S>) -> Vec<S>;

    /// The names of what [`Compliance::deflect`] gives.
    fn deflections(&self) -> Vec<&'static str> {
        Vec::new()
    }

    /// How far it is from rest, m or rad.
    fn deflect<S: Scalar>(&self, _own: &Own<S>) -> Vec<S> {
        Vec::new()
    }

    /// Adds its forces to those of all.
    fn apply<S: Scalar>(&self, own: &Own<S>, forces: &mut Forces<S>);

    /// How its forces fall with the [rates](super::situation::Situation::rates) that they are linear in.
    fn resistance<S: Scalar>(&self, own: &Own<S>) -> Vec<Resistance<S>>;

    /// The same element with forces that set in over a length wider by a value, m, and friction over a speed higher by a
    /// value, m/s; none where it has no such length.
    fn widened(&self, _length: Value, _speed: Value) -> Option<Kind> {
        None
    }

    /// Where it acts, and with what force, for pictures.
    fn draw(&self, own: &Own<f64>) -> Drawn;

    /// The frames that it acts on.
    fn frames(&self) -> Vec<usize> {
        Vec::new()
    }

    /// The wall that it belongs to: its normal, and a point of it, m in the world.
    fn wall<S: Scalar>(&self, _own: &Own<S>) -> Option<([f64; 3], [S; 3])> {
        None
    }

    /// Keys, values, and the least that each value may be; a value with `true` must be more than that.
    fn rules(&self) -> Vec<(&'static str, Value, f64, bool)>;
}

/// A force that falls by `rows' block rows r` with the rates `r` of all positions.
pub(super) struct Resistance<S> {
    /// N s/m or N m s/rad: symmetric, positive semidefinite.
    pub block: Vec<Vec<S>>,
    /// As many as the block has, each by position.
    pub rows: Vec<Vec<S>>,
}

impl<S: Scalar> Own<'_, S> {
    /// That of a spring and damper on a sum of positions, each with its factor.
    fn resistance(&self, stiffness: Value, damping: Value, sum: &[(usize, f64)]) -> Resistance<S> {
        let mut row = vec![S::zero(); self.now.robot.positions().1];
        for &(place, factor) in sum {
            row[place] = S::constant(factor);
        }
        Resistance { block: vec![vec![self.resisting(stiffness, damping)]], rows: vec![row] }
    }

    /// That of springs and dampers along three directions, of what moves by so much with each degree of freedom.
    fn resistances(
        &self,
        (stiffness, damping): ([Value; 3], [Value; 3]),
        directions: [[S; 3]; 3],
        motions: &[[S; 3]],
    ) -> Resistance<S> {
        let terms = [0, 1, 2].map(|axis| (self.resisting(stiffness[axis], damping[axis]), directions[axis]));
        self.spread(squares(&terms), motions)
    }

    /// A resistance whose rows are the entries of what moves by so much with each degree of freedom.
    fn spread<const N: usize>(&self, block: [[S; N]; N], motions: &[[S; N]]) -> Resistance<S> {
        let row = |entry: usize| {
            let mut row: Vec<S> = motions.iter().map(|motion| motion[entry]).collect();
            row.resize(self.now.robot.positions().1, S::zero());
            row
        };
        Resistance { block: block.map(|row| row.to_vec()).to_vec(), rows: (0..N).map(row).collect() }
    }

    /// `damping + lead stiffness`
    fn resisting(&self, stiffness: Value, damping: Value) -> S {
        self.now.at.value(damping) + self.now.lead() * self.now.at.value(stiffness)
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

/// An element in a picture.
#[derive(Clone, Copy, Debug)]
pub(super) struct Drawn {
    pub kind: ConnectionKind,
    /// Its two ends, m in the world.
    pub from: [f64; 3],
    pub to: [f64; 3],
    /// Force on what is at the second end, N in the world.
    pub force: [f64; 3],
    /// Torque on it, N m.
    pub torque: [f64; 3],
}

impl Drawn {
    /// A spring beside a joint, that pushes or turns what the joint carries by `effort`.
    fn beside_joint(own: &Own<f64>, dof: usize, effort: f64) -> Self {
        let (from, to, axis) = own.now.joint(dof);
        let (along, none) = (axis.map(|entry| effort * entry), [0.0; 3]);
        let (force, torque) = if own.now.robot.slides(dof) { (along, none) } else { (none, along) };
        Self { kind: ConnectionKind::Spring, from, to, force, torque }
    }
}

/// What an element refers to by name.
pub(super) struct Names<'a> {
    /// The degrees of freedom.
    pub joints: &'a [String],
    /// All frames.
    pub frames: &'a [String],
    /// Joints that the task has taken out.
    pub locked: &'a [String],
    /// The robot's file.
    pub robot: &'a supple_robot::Robot,
}

/// A key that does not fit the robot: which one, what is valid, and advice.
pub(super) type Unfit = (&'static str, String, Option<String>);

impl Names<'_> {
    /// The degree of freedom of a joint.
    pub fn joint(&self, key: &'static str, name: &str) -> Result<usize, Unfit> {
        if let Some((message, help)) = crate::physics::locked_message(name, self.locked) {
            return Err((key, message, Some(help)));
        }
        find(key, "moving joint", name, self.joints)
    }

    /// The number of a frame.
    pub fn frame(&self, key: &'static str, name: &str) -> Result<usize, Unfit> {
        find(key, "link or frame", name, self.frames)
    }
}

/// The place of a name in a list.
pub(super) fn find(key: &'static str, what: &str, name: &str, list: &[String]) -> Result<usize, Unfit> {
    list.iter().position(|other| other == name).ok_or_else(|| {
        let message = format!("the robot has no {what} `{name}`: {}", supple_files::owned(list));
        (key, message, supple_files::nearest(name, list))
    })
}

/// How an element is read from a task file.
pub(super) trait ComplianceFile: Sized {
    /// The keys of its table, but for `kind` and `name`.
    type File: for<'de> Deserialize<'de> + schemars::JsonSchema;

    /// The element, or what does not fit the robot.
    fn build(file: Self::File, names: &Names) -> Result<Self, Unfit>;
}

/// The signals that make an element a contact, beside the whole force `force_x`, `force_y`, `force_z`.
pub(super) const CONTACT_FORCE: &str = "contact_force";
const PENETRATION: &str = "penetration";

impl Kind {
    /// Whether this drives the given degree of freedom elastically.
    pub fn is_motor_of(&self, dof: usize) -> bool {
        matches!(self, Self::ElasticJoint(joint) if joint.dof == dof)
    }

    /// A spring and damper beside a degree of freedom, at rest at 0.
    pub fn spring(dof: usize, stiffness: Value, damping: Value) -> Self {
        Self::Spring(Spring::new(dof, stiffness, damping))
    }

    /// The degree of freedom that it is a spring beside, with stiffness, rest position and damping; none where it is of
    /// another kind.
    pub fn beside_joint(&self) -> Option<(usize, [Value; 3])> {
        if let Self::Spring(spring) = self { Some(spring.numbers()) } else { None }
    }

    /// Whether it is a contact: it has the signals `contact_force` and `penetration`.
    pub fn is_contact(&self) -> bool {
        [CONTACT_FORCE, PENETRATION].iter().all(|signal| self.signals().contains(signal))
    }

    /// How it stands as a contact; none where it is none.
    pub fn contact_state(&self, own: &Own<f64>) -> Option<ContactState> {
        if !self.is_contact() {
            return None;
        }
        let (names, values, rules) = (self.signals(), self.measure(own), self.rules());
        let signal = |name: &str| names.iter().position(|other| *other == name).map(|place| values[place]);
        let number = |name: &str| rules.iter().find(|rule| rule.0 == name).map(|rule| own.now.at.value(rule.1));
        Some(ContactState {
            force: signal(CONTACT_FORCE)?,
            clearance: -signal(PENETRATION)?,
            smoothing: number("smoothing")?,
            stiffness: number("stiffness")?,
            total_force: [signal("force_x")?, signal("force_y")?, signal("force_z")?],
        })
    }
}

/// The table of all kinds of compliance: name in the file, type.
macro_rules! compliance_kinds {
    ($($(#[$doc:meta])* $name:literal => $kind:ident,)*) => {
        /// An element of compliance, by kind.
        #[derive(Clone, Debug)]
        pub(super) enum Kind {
            $($(#[$doc])* $kind($kind),)*
        }

        impl Compliance for Kind {
            fn coordinates(&self) -> usize {
                match self { $(Self::$kind(kind) => kind.coordinates(),)* }
            }
            fn constants(&self) -> usize {
                match self { $(Self::$kind(kind) => kind.constants(),)* }
            }
            fn inertias<S: Scalar>(&self, at: &Point<S>) -> Vec<S> {
                match self { $(Self::$kind(kind) => kind.inertias(at),)* }
            }
            fn signals(&self) -> Vec<&'static str> {
                match self { $(Self::$kind(kind) => kind.signals(),)* }
            }
            fn measure<S: Scalar>(&self, own: &Own<S>) -> Vec<S> {
                match self { $(Self::$kind(kind) => kind.measure(own),)* }
            }
            fn deflections(&self) -> Vec<&'static str> {
                match self { $(Self::$kind(kind) => kind.deflections(),)* }
            }
            fn deflect<S: Scalar>(&self, own: &Own<S>) -> Vec<S> {
                match self { $(Self::$kind(kind) => kind.deflect(own),)* }
            }
            fn apply<S: Scalar>(&self, own: &Own<S>, forces: &mut Forces<S>) {
                match self { $(Self::$kind(kind) => kind.apply(own, forces),)* }
            }
            fn resistance<S: Scalar>(&self, own: &Own<S>) -> Vec<Resistance<S>> {
                match self { $(Self::$kind(kind) => kind.resistance(own),)* }
            }
            fn widened(&self, length: Value, speed: Value) -> Option<Kind> {
                match self { $(Self::$kind(kind) => kind.widened(length, speed),)* }
            }
            fn draw(&self, own: &Own<f64>) -> Drawn {
                match self { $(Self::$kind(kind) => kind.draw(own),)* }
            }
            fn frames(&self) -> Vec<usize> {
                match self { $(Self::$kind(kind) => kind.frames(),)* }
            }
            fn wall<S: Scalar>(&self, own: &Own<S>) -> Option<([f64; 3], [S; 3])> {
                match self { $(Self::$kind(kind) => kind.wall(own),)* }
            }
            fn rules(&self) -> Vec<(&'static str, Value, f64, bool)> {
                match self { $(Self::$kind(kind) => kind.rules(),)* }
            }
        }

        /// The names of all kinds, as files write them.
        pub(super) const KINDS: &[&str] = &[$($name),*];

        /// Reads the element of kind `kind` from its table, without the keys `kind` and `name`; `None` where there is no
        /// such kind.
        pub(super) fn read(kind: &str, table: Reader, names: &Names) -> Option<Result<Result<Kind, Unfit>, ReadError>> {
            match kind {
                $($name => Some(
                    <$kind as ComplianceFile>::File::deserialize(table).map(|file| $kind::build(file, names).map(Kind::$kind)),
                ),)*
                _ => None,
            }
        }

        /// The schema of each kind's table, by name.
        pub(super) fn schemas(generator: &mut schemars::SchemaGenerator) -> Vec<(&'static str, schemars::Schema)> {
            vec![$(($name, <<$kind as ComplianceFile>::File as schemars::JsonSchema>::json_schema(generator)),)*]
        }
    };
}

compliance_kinds! {
    /// 6-D spring and damper between two frames.
    "bushing" => Bushing,
    /// Point or sphere against a wall of uncertain place.
    "contact" => Contact,
    /// Spring and damper between a motor and its joint.
    "elastic_joint" => ElasticJoint,
    /// Spring and damper beside a joint.
    "spring" => Spring,
}
