//! The native part of the Python package `supple`: tasks and results for `python/supple`, which gives them their shape.
//!
//! Everything here is private to the package; its functions take and give plain objects.

mod arrays;
mod collect;
mod controller;
mod errors;
mod explore;
mod json;
mod options;
mod own;
mod plant;
mod pool;
mod result;
mod robot;
mod task;
mod unit;
mod watch;

use pyo3::prelude::*;

/// The module `supple._supple`.
#[pymodule]
mod _supple {
    use pyo3::prelude::*;

    #[pymodule_export]
    use crate::collect::{DesignCollector, RobustnessCollector, SweepCollector};
    #[pymodule_export]
    use crate::controller::NativeController;
    #[pymodule_export]
    use crate::explore::NativeExplorer;
    #[pymodule_export]
    use crate::own::check_covariance;
    #[pymodule_export]
    use crate::result::Kept;
    #[pymodule_export]
    use crate::robot::as_mjcf;
    #[pymodule_export]
    use crate::task::NativeTask;
    #[pymodule_export]
    use crate::unit::{Units, instructions, mean_and_interval, most_steps, times, use_instructions};

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
