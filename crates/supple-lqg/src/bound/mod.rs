//! The least directed information that any sensors and controller require to stay within a cost, with a certificate
//! (method: docs/theory/bound.md).
//!
//! ```text
//! horizon -> reduce -> local -> certificate, newton -> interior    coordinates, and the search in them
//! verify -> regulator; settle                                      the optimal regulator and filters in a steady state
//! verify -> witness -> proof, sensor, sensitivity -> solution      sensors and proofs from the iterate that a search found
//! minimum, stationary, needed                                      the entry points, on top of all of these
//! ```
//!
//! # One decision
//!
//! ```
//! use supple_lqg::bound::{BoundSettings, BoundStatus, Horizon, Proof, minimum_information, virtual_sensors};
//! use supple_lqg::{constant, sequence};
//!
//! // A state of variance 4, and a cost of 1 per unit of variance: a cost limit of 1 leaves a variance of 1.
//! let (dynamics, process, initial) = (constant(&[[1.0]]), constant(&[[1.0]]), constant(&[[4.0]]));
//! let horizon = Horizon { dynamics, process, initial, prices: sequence(&[[[1.0]]]), base_cost: 0.0 };
//! assert!((horizon.unmeasured().cost - 4.0).abs() < 1e-12);
//! let found = minimum_information(&horizon, 1.0, &BoundSettings::default())?;
//! assert!((found.nats - 2f64.ln()).abs() < 1e-6 && found.lower_nats <= found.nats);
//! assert!(matches!(found.proof, Proof::Proved { .. }) && found.status != BoundStatus::MaxIterations);
//! assert_eq!(virtual_sensors(&found)[0].rank, 1);
//!
//! // The sensors that attain the minimum keep the cost limit.
//! let achieved = found.achieved.ok_or("the filter of the sensors does not settle")?;
//! assert!(achieved.cost < 1.0 + 1e-6);
//!
//! // 1/2 ln(4 / D) has the slope -1 / 2 in the cost limit D = 1.
//! assert!((found.sensitivity(&horizon).cost + 0.5).abs() < 0.01);
//! # Ok::<(), Box<dyn std::error::Error>>(())
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
pub use proof::{Achieved, Proof, Unproved, regulator_distance};
pub use sensitivity::Sensitivity;
pub use settings::{BoundSettings, BoundStatus};
pub use solution::{MinimumInformation, StationaryMinimum, virtual_sensors};
pub use stationary::stationary_minimum;
pub use unmeasured::Unmeasured;
pub use virtual_sensor::VirtualSensor;
