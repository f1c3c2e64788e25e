//! The least directed information that any sensors and any controller need to keep an expected cost, with a certificate
//! (method: docs/theory/bound.md).

mod along;
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
mod sensitivity;
mod sensor;
mod size;
mod solution;
mod stationary;
mod subspace;
mod unmeasured;
mod verify;
mod witness;
mod zeros;

pub use along::Spread;
pub use floors::{KostinaHassibi, Vacuous, data_rate_floor, kostina_hassibi, product_growth, quantiser_bound};
pub use horizon::{Horizon, Stationary};
pub use minimum::{minimum_information, minimum_information_within};
pub use nearby::Nearby;
pub use needed::Needed;
pub use own::{OwnRates, own_rates};
pub use proof::{Achieved, Proof, regulator_distance};
pub use sensitivity::Sensitivity;
pub use sensor::virtual_sensors;
pub use solution::{BoundSettings, BoundStatus, MinimumInformation, StationaryMinimum, VirtualSensor};
pub use stationary::{InUnits, stationary_minimum};
pub use subspace::observed;
pub use unmeasured::Unmeasured;
