//! How little information would do: the least directed information that any sensors and any controller need to keep an
//! expected cost, with a certificate (method: docs/theory/bound.md).

mod along;
mod bounding;
mod certificate;
mod floors;
mod horizon;
mod interior;
mod local;
mod minimum;
mod nearby;
mod needed;
mod newton;
mod own;
mod product;
mod proof;
mod reduce;
mod regulator;
mod report;
mod sensitivity;
mod sensor;
mod sensor_report;
mod solution;
mod stationary;
mod steady;
mod subspace;
mod verify;
mod witness;
mod zeros;

pub use bounding::{BoundOptions, BoundPoint, Bounding};
pub use floors::{KostinaHassibi, Vacuous, data_rate_floor, kostina_hassibi, product_growth, quantiser_bound};
pub use horizon::{Horizon, Stationary};
pub use minimum::minimum_information;
pub(crate) use nearby::Nearby;
pub(crate) use needed::Needed;
pub use proof::{Achieved, Proof};
pub use report::{BoundReport, OrderLine, TaskBound};
pub use sensitivity::Sensitivity;
pub use sensor::virtual_sensors;
pub use sensor_report::{Direction, MeasuredState, SensorReport, SensorWindow};
pub use solution::{BoundSettings, BoundStatus, MinimumInformation, StationaryMinimum, VirtualSensor};
pub use stationary::stationary_minimum;
