//! Pages of studies, and of any result.

mod bound;
mod check;
mod design;
mod ends;
mod evaluation;
mod next;
mod pareto;
mod result;
mod robustness;
mod sensors;
mod sweep;
mod trace;

pub use check::check_page;
pub use result::{result_page, stopped};
