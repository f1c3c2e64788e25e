//! The sections of a page, each only where there is data for it.

mod answer;
mod bound;
mod catalogue;
mod contacts;
mod context;
mod controller;
mod convergence;
mod headlines;
mod information;
mod landscape;
mod level_lines;
mod motion;
mod origin;
mod pareto;
mod quantities;
mod robustness;
mod sensitivities;
mod sensors;
mod series;
mod terms;
mod trajectories;
mod warnings;

use maud::Markup;

pub use self::context::Context;

/// A kind of section.
pub struct Kind {
    /// Its name in links.
    pub name: &'static str,
    /// Its heading.
    pub title: &'static str,
    /// Makes it; `None` if there is no data for it.
    pub make: fn(&mut Context) -> Option<Markup>,
}

/// All kinds, in the order of the page.
pub const KINDS: [Kind; 17] = [
    Kind { name: "answer", title: "The answer", make: answer::section },
    Kind { name: "landscape", title: "Landscape", make: landscape::section },
    Kind { name: "motion", title: "The robot in motion", make: motion::section },
    Kind { name: "contacts", title: "Contacts", make: contacts::section },
    Kind { name: "terms", title: "What the costs ask for", make: terms::section },
    Kind { name: "quantities", title: "Forces, points and cost over time", make: quantities::section },
    Kind { name: "trajectories", title: "Trajectories", make: trajectories::section },
    Kind { name: "information", title: "Information over time", make: information::section },
    Kind { name: "controller", title: "Controller", make: controller::section },
    Kind { name: "robustness", title: "Robustness", make: robustness::section },
    Kind { name: "pareto", title: "Information and cost", make: pareto::section },
    Kind { name: "bound", title: "Minimum information required", make: bound::section },
    Kind { name: "sensors", title: "Sensors", make: sensors::section },
    Kind { name: "catalogue", title: "From catalogues", make: catalogue::section },
    Kind { name: "sensitivities", title: "Sensitivities", make: sensitivities::section },
    Kind { name: "convergence", title: "Convergence", make: convergence::section },
    Kind { name: "origin", title: "Commands and task files", make: origin::section },
];
