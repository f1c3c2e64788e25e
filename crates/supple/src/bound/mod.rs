//! The minimum directed information over all sensors and controllers of a task, and what its own ones use (method:
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
