//! The minimum directed information over all sensors and controllers of a task, and what its own ones use (method:
//! docs/theory/bound.md).
//!
//! # A linear plant in steady state
//!
//! ```
//! use supple::bound::BoundOptions;
//! # let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tasks/tanaka_plant.toml");
//! let problem = supple_file::load(file)?;
//! let phi = problem.parameters.initial();
//! let options = BoundOptions { stationary: true, cost: Some(40.0), ..BoundOptions::default() };
//! let report = problem.bound(&phi, &options)?;
//! let bound = &report.tasks[0];
//! assert!(bound.minimum_lower_bits_per_step <= bound.minimum_bits_per_step);
//! assert!(bound.is_ordered() && !bound.order.is_empty());
//! let sensor = &bound.virtual_sensor;
//! assert!(sensor.rank > 0 && sensor.measured[0].bits > 0.0);
//! assert!(sensor.windows[0].directions[0].deviation > 0.0);
//!
//! // Several costs from the same data: a looser cost limit requires less information.
//! let bounding = problem.bounding(&phi, &options)?;
//! assert!(bounding[0].point(60.0)?.minimum_bits_per_step < bound.minimum_bits_per_step);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod assemble;
mod bounding;
mod own;
mod report;
mod sensor_report;
mod steady;

pub use crate::horizon::horizon_of_plan;
pub use bounding::{BoundOptions, BoundPoint, Bounding};
pub use report::{BoundReport, OrderLine, TaskBound};
pub use sensor_report::{Direction, MeasuredState, SensorReport, SensorWindow};
pub use supple_lqg::bound::*;
