//! What the numbers of states, controls and measurements are, and the limits of the real robot.

use serde::{Deserialize, Serialize};
use supple_lqg::Dimensions;

/// A number of a model's vectors, for people.
#[derive(Clone, Debug, Deserialize, PartialEq, Eq, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Channel {
    /// Its name.
    pub name: String,
    /// Its unit; empty where it is not known.
    #[serde(default)]
    pub unit: String,
}

impl Channel {
    /// A channel.
    pub fn new(name: impl Into<String>, unit: impl Into<String>) -> Self {
        Self { name: name.into(), unit: unit.into() }
    }

    fn numbered(prefix: &str, count: usize) -> Vec<Self> {
        (1..=count).map(|i| Self::new(format!("{prefix}{i}"), "")).collect()
    }
}

/// What the numbers of a model's vectors are.
#[derive(Clone, Debug, Default, Deserialize, PartialEq, Eq, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Channels {
    /// Of the state.
    pub states: Vec<Channel>,
    /// Of the control.
    pub controls: Vec<Channel>,
    /// Of the measurement.
    pub measurements: Vec<Channel>,
}

impl Channels {
    /// Named states without units; controls `u1`, `u2`...; measurements `y1`, `y2`...
    #[must_use]
    pub fn plain(states: Vec<String>, dimensions: Dimensions) -> Self {
        Self {
            states: states.into_iter().map(|name| Channel::new(name, "")).collect(),
            controls: Channel::numbered("u", dimensions.controls),
            measurements: Channel::numbered("y", dimensions.measurements),
        }
    }
}

/// A drive of a joint, which a control commands.
#[derive(Clone, Debug, PartialEq)]
pub struct Drive {
    /// Its name, and the unit of the torque or force that it exerts.
    pub channel: Channel,
    /// The least and the most that it may exert, where its control says something else, such as a position; infinite
    /// where nothing limits that, and where [`Limit`]s of the control do.
    pub effort: [f64; 2],
}

/// Bounds of a state or control that the real thing has.
#[derive(Clone, Debug, PartialEq)]
pub struct Limit {
    /// What it is, for people: ``velocity of joint `elbow` ``.
    pub name: String,
    /// Which number it is about.
    pub of: Limited,
    /// The least it may be; may be infinite.
    pub lower: f64,
    /// The most it may be; may be infinite.
    pub upper: f64,
}

/// A state or a control.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Limited {
    /// The state with this index.
    State(usize),
    /// The control with this index.
    Control(usize),
}

impl Limit {
    /// Of a state.
    #[must_use]
    pub fn state(name: String, index: usize, lower: f64, upper: f64) -> Self {
        Self { name, of: Limited::State(index), lower, upper }
    }

    /// Of a control.
    #[must_use]
    pub fn control(name: String, index: usize, lower: f64, upper: f64) -> Self {
        Self { name, of: Limited::Control(index), lower, upper }
    }
}
