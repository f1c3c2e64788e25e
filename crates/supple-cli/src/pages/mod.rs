//! Pages of studies.

mod sweep;

pub use sweep::{failed, sweep_page, table_page};
