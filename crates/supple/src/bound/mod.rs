//! How little information would do: the least directed information that any sensors and any controller need to keep an
//! expected cost, with a certificate (method: docs/theory/bound.md).

mod certificate;
mod dense;
mod horizon;
mod interior;
mod local;
mod minimum;
mod newton;
mod reduce;
mod regulator;
mod sensor;
mod solution;
mod stationary;
mod subspace;

pub use horizon::{Horizon, Stationary};
pub use minimum::minimum_information;
pub use sensor::virtual_sensors;
pub use solution::{BoundSettings, BoundStatus, MinimumInformation, StationaryMinimum, VirtualSensor};
pub use stationary::stationary_minimum;
