//! Pages of studies.

mod pareto;
mod robustness;
mod sweep;
mod trace;

pub use pareto::pareto_page;
pub use robustness::robustness_page;
pub use sweep::{failed, sweep_page, table_page};
pub use trace::trace_page;
