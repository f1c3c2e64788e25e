//! The least directed information that any sensors and any controller of a task need, beside what its own use (method:
//! docs/theory/bound.md).

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
