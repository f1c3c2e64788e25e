//! The least directed information that any sensors and controller require to stay within a cost, with a certificate
//! (method: docs/theory/bound.md).
//!
//! ```text
//! horizon -> reduce -> local -> certificate, newton -> interior    coordinates, and the search in them
//! verify -> regulator; settle                                      the optimal regulator and filters in a steady state
//! verify -> witness -> proof, sensor, sensitivity -> solution      sensors and proofs from the iterate that a search found
//! minimum, stationary, needed                                      the entry points, on top of all of these
//! ```

mod along;
mod certificate;
mod floors;
mod free;
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
mod settings;
mod settle;
mod size;
mod solution;
mod start;
mod stationary;
mod subspace;
mod units;
mod unmeasured;
mod verify;
mod virtual_sensor;
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
pub use settings::{BoundSettings, BoundStatus};
pub use solution::{MinimumInformation, StationaryMinimum, virtual_sensors};
pub use stationary::stationary_minimum;
pub use unmeasured::Unmeasured;
pub use virtual_sensor::VirtualSensor;
