//! Quantities that are recorded along plans, in addition to those in costs: limits, and curves that a task requests.
//!
//! # An enforced limit
//!
//! ```
//! use supple_model::TwoMass;
//! use supple_model::cost::Cost;
//! use supple_model::followed::{Ends, Followed, numbers, shows};
//! use supple_model::quantity::{Penetration, State, Vocabulary};
//!
//! let model = TwoMass {
//!     mass: [0.8.into(), 0.4.into()],
//!     damping: [60.0.into(), 35.0.into()],
//!     stiffness: [300.0.into(), 200.0.into()],
//!     contact_smoothing: 0.0.into(),
//! };
//! // The depth of its contact, signal 1, must not exceed 0.03 m.
//! let followed = [Followed::limit(Penetration::new(1), f64::NEG_INFINITY, 0.03).enforced()];
//! let ends = Ends::of(&followed).ok_or("no limit is enforced")?;
//! assert_eq!((ends.list.len(), ends.list[0].upper), (1, true));
//! let recorded = numbers(&[], &followed, &Vocabulary::of(&model), &[]);
//! assert_eq!((recorded[0].of.as_str(), recorded[0].limits[1]), ("limit 1", 0.03));
//! assert!(recorded[0].is_limited());
//! assert!(!shows(&Cost::new(State::new([0]), 1.0)), "states are shown in any case");
//! # Ok::<(), &'static str>(())
//! ```

use crate::Value;
use crate::channels::{Channel, Limit};
use crate::cost::Cost;
use crate::quantity::{Control, DriveEffort, Quantity, Unfit, Vocabulary};

/// A quantity that is recorded along plans.
///
/// Example: the [module](crate::followed).
#[derive(Clone, Debug)]
pub struct Followed {
    /// The quantity.
    pub quantity: Quantity,
    /// Lower and upper limits, one pair per entry, if it has limits; infinite on a side without a limit.
    pub limits: Option<[Vec<Value>; 2]>,
    /// Whether plans enforce its limits as those of any quantity, rather than by [bounds](Self::take_control_bounds) of
    /// the controls, or only reporting violations.
    pub enforced: bool,
    /// Whether the limits come from the model rather than from the task.
    pub is_of_model: bool,
}

impl Followed {
    /// A quantity that is only plotted.
    pub fn curve(quantity: impl Into<Quantity>) -> Self {
        Self { quantity: quantity.into(), limits: None, enforced: false, is_of_model: false }
    }

    /// A quantity whose entries must stay between two numbers, either of which may be infinite.
    pub fn limit(quantity: impl Into<Quantity>, lower: impl Into<Value>, upper: impl Into<Value>) -> Self {
        let quantity = quantity.into();
        let count = quantity.len();
        let limits = Some([vec![lower.into(); count], vec![upper.into(); count]]);
        Self { limits, ..Self::curve(quantity) }
    }

    /// The [effort limits](crate::channels::Drive::effort) of drives whose controls are not
    /// efforts; `None` if none are limited.
    ///
    /// # Errors
    /// If the model lacks the signal of a drive.
    pub fn efforts(vocabulary: &Vocabulary) -> Result<Option<Self>, Unfit> {
        let limited = vocabulary.drives.iter().filter(|drive| drive.effort.iter().any(|end| end.is_finite()));
        let (names, ends): (Vec<String>, Vec<[f64; 2]>) =
            limited.map(|drive| (drive.channel.name.clone(), drive.effort)).unzip();
        if names.is_empty() {
            return Ok(None);
        }
        let side = |side: usize| ends.iter().map(|ends| Value::Number(ends[side])).collect();
        let limits = Some([side(0), side(1)]);
        Ok(Some(Self { limits, is_of_model: true, ..Self::curve(DriveEffort::of(Some(names), vocabulary)?) }))
    }

    /// The same limits on the efforts of drives in the first of several sub-steps; `None` if these are no limits of efforts, or
    /// the drives do not act at the ends of sub-steps.
    #[must_use]
    pub fn in_first_substep(&self) -> Option<Self> {
        let efforts = self.quantity.as_kind::<DriveEffort>().filter(|_| self.limits.is_some())?;
        Some(Self { quantity: efforts.in_first_substep()?.into(), is_of_model: true, ..self.clone() })
    }

    /// The enforced limits of controls that are numbers. Plans keep these exactly, by bounds of their controls; they are no
    /// longer among the limits that are enforced like those of any quantity.
    ///
    /// ```
    /// use supple_model::Limited;
    /// use supple_model::followed::Followed;
    /// use supple_model::quantity::Control;
    ///
    /// let mut limit = Followed::limit(Control::all(1), -3.0, 5.0).enforced();
    /// let bounds = limit.take_control_bounds();
    /// assert_eq!((bounds[0].of, bounds[0].lower, bounds[0].upper), (Limited::Control(0), -3.0, 5.0));
    /// assert!(!limit.enforced);
    /// ```
    #[must_use]
    pub fn take_control_bounds(&mut self) -> Vec<Limit> {
        let (Some(control), Some([lower, upper])) = (self.quantity.as_kind::<Control>(), &self.limits) else {
            return Vec::new();
        };
        let number = |value: &Value| if let Value::Number(number) = *value { Some(number) } else { None };
        let ends = lower.iter().zip(upper).map(|(lower, upper)| Some([number(lower)?, number(upper)?]));
        let Some(ends) = ends.collect::<Option<Vec<_>>>().filter(|_| self.enforced) else { return Vec::new() };
        self.enforced = false;
        let limit = |(&index, [lower, upper]): (&usize, [f64; 2])| {
            Limit::control(format!("control {}", index + 1), index, lower, upper)
        };
        control.selected().iter().zip(ends).map(limit).collect()
    }

    /// The same, with its limits enforced by plans.
    #[must_use]
    pub fn enforced(self) -> Self {
        Self { enforced: true, ..self }
    }
}

/// One side of an enforced limit: the upper or lower bound of one number.
///
/// Example: the [module](crate::followed).
#[derive(Clone, Debug)]
pub struct LimitEnd {
    /// Index of the enforced limit that it belongs to.
    pub limit: usize,
    /// Index of the number within the limited quantity.
    pub entry: usize,
    /// Whether it is the upper bound; otherwise it is the lower one.
    pub upper: bool,
}

/// All sides of all enforced limits.
///
/// Example: the [module](crate::followed).
#[derive(Debug)]
pub struct Ends {
    /// The enforced limits.
    pub followed: Vec<Followed>,
    /// Their sides: for each number the upper bound, then the lower one, skipping infinite ones.
    pub list: Vec<LimitEnd>,
    /// Whether the number that each side bounds depends on the control.
    pub of_control: Vec<bool>,
}

impl Ends {
    /// The sides of the enforced limits in `followed`; `None` if no limit is enforced.
    #[must_use]
    pub fn of(followed: &[Followed]) -> Option<Self> {
        let followed: Vec<Followed> = followed.iter().filter(|followed| followed.enforced).cloned().collect();
        let mut list = Vec::new();
        for (limit, Followed { limits, .. }) in followed.iter().enumerate() {
            let Some([lower, upper]) = limits else { continue };
            for (entry, sides) in upper.iter().zip(lower).enumerate() {
                let sides = [(sides.0, true), (sides.1, false)];
                let given = sides.into_iter().filter(|(bound, _)| !is_infinite(bound));
                list.extend(given.map(|(_, upper)| LimitEnd { limit, entry, upper }));
            }
        }
        let of_control = list.iter().map(|end| followed[end.limit].quantity.depends_on_control()).collect();
        (!list.is_empty()).then_some(Self { followed, list, of_control })
    }

    /// Whether any of the limited quantities takes the next state.
    #[must_use]
    pub fn need_next(&self) -> bool {
        self.followed.iter().any(|followed| followed.quantity.needs_next())
    }

    /// The value of a bound.
    #[must_use]
    pub fn bound(&self, end: &LimitEnd) -> &Value {
        let [lower, upper] = self.followed[end.limit].limits.as_ref().map_or([&[][..]; 2], |[l, u]| [&l[..], &u[..]]);
        let side = if end.upper { upper } else { lower };
        side.get(end.entry).unwrap_or(&Value::Number(f64::INFINITY))
    }
}

fn is_infinite(bound: &Value) -> bool {
    matches!(bound, Value::Number(number) if number.is_infinite())
}

/// A number that is recorded along a plan.
///
/// Example: the [module](crate::followed).
#[derive(Clone, Debug, PartialEq)]
pub struct FollowedNumber {
    /// Its name and unit.
    pub channel: Channel,
    /// Its origin: `cost 2`, `limit 1`, `curve 3`, counted from 1, or `robot` for limits of the model.
    pub of: String,
    /// Its target, if a cost gives one.
    pub target: Option<f64>,
    /// Its lower and upper limit; infinite on a side without a limit.
    pub limits: [f64; 2],
    /// Whether it depends on the control, so that it has no value at the final step.
    pub depends_on_control: bool,
}

impl FollowedNumber {
    /// Whether it has a limit.
    ///
    /// Example: the [module](crate::followed).
    #[must_use]
    pub fn is_limited(&self) -> bool {
        self.limits.iter().any(|limit| limit.is_finite())
    }

    /// Whether it is recorded because the model limits it.
    ///
    /// ```
    /// use supple_model::Channel;
    /// use supple_model::followed::FollowedNumber;
    ///
    /// let channel = Channel::new("effort of `elbow`", "N m");
    /// let of = FollowedNumber::OF_MODEL.to_owned();
    /// let effort = FollowedNumber { channel, of, target: None, limits: [-40.0, 40.0], depends_on_control: true };
    /// assert!(effort.is_of_model() && effort.is_limited());
    /// ```
    #[must_use]
    pub fn is_of_model(&self) -> bool {
        self.of == Self::OF_MODEL
    }

    /// The origin of numbers that the model limits.
    pub const OF_MODEL: &'static str = "robot";
}

const FREE: [f64; 2] = [f64::NEG_INFINITY, f64::INFINITY];

/// Whether the quantity of a cost is recorded separately: states and controls are shown in any case.
///
/// Example: the [module](crate::followed).
#[must_use]
pub fn shows(cost: &Cost) -> bool {
    cost.quantity.needs_signals() || cost.quantity.needs_next()
}

/// The recorded numbers, in order: those of costs, then the others.
///
/// Example: the [module](crate::followed).
#[must_use]
pub fn numbers(costs: &[Cost], followed: &[Followed], vocabulary: &Vocabulary, phi: &[f64]) -> Vec<FollowedNumber> {
    let mut numbers = Vec::new();
    for (index, cost) in costs.iter().enumerate().filter(|(_, cost)| shows(cost)) {
        let depends_on_control = cost.quantity.depends_on_control();
        for (channel, target) in cost.quantity.channels(vocabulary).into_iter().zip(&cost.targets) {
            let (of, target) = (format!("cost {}", index + 1), Some(target.resolve(phi)));
            numbers.push(FollowedNumber { channel, of, target, limits: FREE, depends_on_control });
        }
    }
    let mut counts = [0; 2];
    for Followed { quantity, limits, is_of_model, .. } in followed {
        let (count, what) = if limits.is_some() { (&mut counts[0], "limit") } else { (&mut counts[1], "curve") };
        let of = if *is_of_model {
            FollowedNumber::OF_MODEL.to_owned()
        } else {
            *count += 1;
            format!("{what} {count}")
        };
        for (entry, channel) in quantity.channels(vocabulary).into_iter().enumerate() {
            let resolve = |side: usize| limits.as_ref().map_or(FREE[side], |limits| limits[side][entry].resolve(phi));
            numbers.push(FollowedNumber {
                channel,
                of: of.clone(),
                target: None,
                limits: [resolve(0), resolve(1)],
                depends_on_control: quantity.depends_on_control(),
            });
        }
    }
    numbers
}
