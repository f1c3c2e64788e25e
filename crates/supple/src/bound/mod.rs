//! How little information would do: the least directed information that any sensors and any controller need to keep an
//! expected cost, with a certificate (method: docs/theory/bound.md).

mod horizon;
mod solution;

pub use horizon::{Horizon, Stationary};
pub use solution::{BoundSettings, MinimumInformation, StationaryMinimum, VirtualSensor};
