//! Requests of pages.

use serde::Deserialize;

/// A request of a page.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Ask {
    /// What is asked for.
    pub view: View,
    /// Its number: among requests of one kind, the one with the greatest number wins.
    pub id: u64,
    /// The version of the task file that the page shows: how often it had been read.
    pub generation: u64,
    /// The values of all knobs.
    #[serde(default)]
    pub values: Vec<f64>,
    /// The task that is shown.
    #[serde(default)]
    pub task: usize,
    /// Quantities whose curves are wanted.
    #[serde(default)]
    pub want: Vec<String>,
    /// Of maps: the knobs along both axes.
    #[serde(default)]
    pub axes: [usize; 2],
    /// Of maps: whether shadow prices are wanted.
    #[serde(default)]
    pub prices: bool,
    /// How many starts or samples.
    #[serde(default)]
    pub count: usize,
    /// Designs to compare with.
    #[serde(default)]
    pub pins: Vec<Pin>,
    /// What to save, or which work to stop.
    #[serde(default)]
    pub what: String,
}

/// Pinned designs of one request at most; pages have three.
const MOST_PINS: usize = 8;
/// Quantities of one request at most.
const MOST_WANTED: usize = 100;

impl Ask {
    /// What exceeds a maximum, if anything.
    pub fn excess(&self) -> Option<String> {
        let lists = [("pinned designs", self.pins.len(), MOST_PINS), ("quantities", self.want.len(), MOST_WANTED)];
        let (what, found, most) = lists.into_iter().find(|(_, found, most)| found > most)?;
        Some(format!("a request has at most {most} {what}; found {found}"))
    }
}

/// A pinned design.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Pin {
    /// Its letter.
    pub name: String,
    /// The values of all knobs.
    pub values: Vec<f64>,
}

/// Kinds of requests; each has a worker for itself.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub enum View {
    /// The design on screen.
    Evaluate,
    /// Its gradients, and the information needed.
    Details,
    /// Pinned designs.
    Pins,
    /// The virtual sensor.
    Sensor,
    /// The map.
    Map,
    /// A search.
    Design,
    /// Roll-outs.
    Rollouts,
    /// Files to write.
    Save,
    /// To stop work.
    Stop,
}

impl View {
    /// All kinds that have a worker.
    pub const WORKERS: [Self; 8] =
        [Self::Evaluate, Self::Details, Self::Pins, Self::Sensor, Self::Map, Self::Design, Self::Rollouts, Self::Save];

    /// Its name in answers.
    pub fn name(self) -> &'static str {
        match self {
            Self::Evaluate => "evaluate",
            Self::Details => "details",
            Self::Pins => "pins",
            Self::Sensor => "sensor",
            Self::Map => "map",
            Self::Design => "design",
            Self::Rollouts => "rollouts",
            Self::Save => "save",
            Self::Stop => "stop",
        }
    }
}
