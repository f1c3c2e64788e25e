//! How little information would do: the least directed information that any sensors and any controller need to keep an
//! expected cost, with a certificate (method: docs/theory/bound.md).

mod floors;
mod horizon;
mod product;
mod solution;

pub use floors::{KostinaHassibi, Vacuous, data_rate_floor, kostina_hassibi, product_growth, quantiser_bound};
pub use horizon::{Horizon, Stationary};
pub use solution::{BoundSettings, MinimumInformation, StationaryMinimum, VirtualSensor};
