//! The state of reading a file.

use std::collections::{HashMap, HashSet};
use std::path::Path;

use super::super::options::LoadOptions;
use super::super::parts::Parts;
use super::super::warnings::Warnings;
use super::super::xml::Element;
use super::defaults::Classes;
use super::settings::Settings;
use crate::{Actuator, Key, Measured, Omitted, Pose, Wall};

/// The parts of a robot while its file is read.
pub(super) struct Reader<'a, 'o> {
    pub(super) settings: &'o Settings,
    pub(super) classes: &'o Classes<'a>,
    pub(super) options: &'o LoadOptions,
    /// Where the file is.
    pub(super) folder: &'o Path,
    /// Meshes of the `asset` sections by name.
    pub(super) meshes: HashMap<&'a str, Element<'a>>,
    pub(super) parts: Parts<'a>,
    pub(super) actuators: Actuators<'a>,
    pub(super) sensors: Vec<SensorPart>,
    /// Keyframes; joints by their place in the file.
    pub(super) keys: Vec<Key>,
    pub(super) walls: Vec<Wall>,
    pub(super) omitted: Vec<Omitted>,
    /// Names that the file gives.
    pub(super) names: HashSet<&'a str>,
    /// Bodies and joints so far.
    pub(super) bodies: usize,
    pub(super) joints: usize,
}

/// The contents of a body, including nested frames.
#[derive(Default)]
pub(super) struct Items<'a> {
    pub(super) inertial: Option<Element<'a>>,
    pub(super) joints: Vec<Placed<'a>>,
    pub(super) geoms: Vec<Placed<'a>>,
    pub(super) sites: Vec<Placed<'a>>,
    pub(super) bodies: Vec<Placed<'a>>,
}

/// An element with its frame in its body, and its default class.
pub(super) type Placed<'a> = (Element<'a>, Pose, usize);

/// Actuators of the file.
#[derive(Default)]
pub(super) struct Actuators<'a> {
    /// Those that are modelled; joints by their index in the file.
    pub(super) kept: Vec<Actuator>,
    /// Damping ratios of those whose damping follows from the robot's inertia, by their index.
    pub(super) ratios: HashMap<usize, f64>,
    /// For every actuator in the file, its index among the supported ones.
    pub(super) places: Vec<Option<usize>>,
    /// Place of each by the name that it has in the file.
    pub(super) names: HashMap<&'a str, (usize, Element<'a>)>,
}

/// A sensor that is modelled.
pub(super) struct SensorPart {
    pub(super) name: String,
    pub(super) target: Target,
    /// Standard deviation of its noise.
    pub(super) noise: f64,
    pub(super) line: usize,
}

/// What a sensor measures, by index or name in the file.
pub(super) enum Target {
    Joint(usize, Of),
    Body(String, Of),
    Site(String, Of),
}

/// A quantity of a joint or frame with an index.
pub(super) type Of = fn(usize) -> Measured;

impl<'a, 'o> Reader<'a, 'o> {
    pub(super) fn new(
        settings: &'o Settings,
        classes: &'o Classes<'a>,
        names: HashSet<&'a str>,
        options: &'o LoadOptions,
        folder: &'o Path,
        warnings: Warnings,
    ) -> Self {
        let parts = Parts {
            name: String::new(),
            links: Vec::new(),
            joints: Vec::new(),
            frames: Vec::new(),
            gravity: None,
            warnings,
        };
        Self {
            settings,
            classes,
            options,
            folder,
            meshes: HashMap::new(),
            parts,
            actuators: Actuators::default(),
            sensors: Vec::new(),
            keys: Vec::new(),
            walls: Vec::new(),
            omitted: Vec::new(),
            names,
            bodies: 0,
            joints: 0,
        }
    }
}
