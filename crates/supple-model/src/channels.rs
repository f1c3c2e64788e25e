//! Names and units of the states, controls and measurements, and the limits of the real robot.

use serde::{Deserialize, Serialize};
use supple_lqg::Dimensions;

/// One entry of a model's state, control or measurement vector, as shown to people.
///
/// Example: [`Measurable`](crate::quantity::Measurable).
#[derive(Clone, Debug, Deserialize, PartialEq, Eq, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Channel {
    /// Its name.
    pub name: String,
    /// Its unit; empty if unknown.
    #[serde(default)]
    pub unit: String,
}

impl Channel {
    /// A channel.
    pub fn new(name: impl Into<String>, unit: impl Into<String>) -> Self {
        Self { name: name.into(), unit: unit.into() }
    }

    /// The same channels with distinct names: later ones with the same name get a number, as in `q.elbow.2`.
    ///
    /// ```
    /// use supple_model::Channel;
    ///
    /// let twice = vec![Channel::new("q.elbow", "rad"), Channel::new("q.elbow", "rad")];
    /// assert_eq!(Channel::distinct(twice)[1].name, "q.elbow.2");
    /// ```
    #[must_use]
    pub fn distinct(channels: Vec<Self>) -> Vec<Self> {
        let mut taken: Vec<String> = Vec::with_capacity(channels.len());
        let rename = |channel: Self| {
            let name = free_name(channel.name, &taken);
            taken.push(name.clone());
            Self { name, ..channel }
        };
        channels.into_iter().map(rename).collect()
    }

    fn numbered(prefix: &str, count: usize) -> Vec<Self> {
        (1..=count).map(|i| Self::new(format!("{prefix}{i}"), "")).collect()
    }
}

/// A name that is not taken: the name itself, or with a number.
pub(crate) fn free_name(name: String, taken: &[String]) -> String {
    let numbered = (2..).map(|number| format!("{name}.{number}"));
    let free = std::iter::once(name.clone()).chain(numbered).find(|name| !taken.contains(name));
    free.unwrap_or(name)
}

/// Names and units of the entries of a model's vectors.
///
/// ```
/// use supple_model::{Channels, Dimensions};
///
/// let size = Dimensions { states: 2, controls: 1, measurements: 1 };
/// let channels = Channels::plain(vec!["angle".to_owned(), "rate".to_owned()], size);
/// assert_eq!((channels.states[1].name.as_str(), channels.controls[0].name.as_str()), ("rate", "u1"));
/// ```
#[derive(Clone, Debug, Default, Deserialize, PartialEq, Eq, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Channels {
    /// Entries of the state.
    pub states: Vec<Channel>,
    /// Entries of the control.
    pub controls: Vec<Channel>,
    /// Entries of the measurement.
    pub measurements: Vec<Channel>,
}

impl Channels {
    /// Channels with these state names and no units; controls are `u1`, `u2`..., measurements `y1`, `y2`...
    #[must_use]
    pub fn plain(states: Vec<String>, dimensions: Dimensions) -> Self {
        Self {
            states: states.into_iter().map(|name| Channel::new(name, "")).collect(),
            controls: Channel::numbered("u", dimensions.controls),
            measurements: Channel::numbered("y", dimensions.measurements),
        }
    }
}

/// A drive of a joint, commanded by one control.
///
/// ```
/// use supple_model::{Channel, Drive};
///
/// // Torques between -80 and 80 N m.
/// let elbow = Drive { channel: Channel::new("elbow", "N m"), effort: [-80.0, 80.0], acts_at_end: false };
/// assert!(elbow.effort.iter().all(|end| end.is_finite()));
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Drive {
    /// Its name, and the unit of the torque or force that it exerts.
    pub channel: Channel,
    /// Lower and upper limit of its effort, if its control is not itself an effort (for example a position); infinite if
    /// there is no limit, or if [`Limit`]s of the control already bound the effort.
    pub effort: [f64; 2],
    /// Whether its effort during a step is that at the end of the step, as of position drives with implicit integration.
    pub acts_at_end: bool,
}

/// Bounds of the real robot on a state or control.
///
/// Example: [`limits_violated`](crate::limits_violated).
#[derive(Clone, Debug, PartialEq)]
pub struct Limit {
    /// Description for messages: ``velocity of joint `elbow` ``.
    pub name: String,
    /// The state or control it applies to.
    pub of: Limited,
    /// The least it may be; may be infinite.
    pub lower: f64,
    /// The most it may be; may be infinite.
    pub upper: f64,
}

/// A state or a control.
///
/// Example: [`limits_violated`](crate::limits_violated).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Limited {
    /// The state with this index.
    State(usize),
    /// The control with this index.
    Control(usize),
}

impl Limit {
    /// A limit of a state.
    #[must_use]
    pub fn state(name: String, index: usize, lower: f64, upper: f64) -> Self {
        Self { name, of: Limited::State(index), lower, upper }
    }

    /// A limit of a control.
    #[must_use]
    pub fn control(name: String, index: usize, lower: f64, upper: f64) -> Self {
        Self { name, of: Limited::Control(index), lower, upper }
    }
}
