//! Sweeps: many designs on a grid, each evaluated; a journal keeps what is done.
//!
//! Points are evaluated in segments of neighbours along the last axis. Within a segment each plan is also continued
//! from the previous point's; segments are independent of one another. So the table does not depend on the number of
//! threads, nor on how often a sweep was interrupted.
//!
//! # Three points
//!
//! ```
//! use supple_study::sweep::{Axis, Collector, Holds, SweepOptions, SweepUnits, misses_contact, run};
//! use supple_study::{LoadedTask, Source, Stop, Watch};
//! # let text = r#"
//! #     model = { kind = "linear", A = [[1.0]], B = [[1.0]], C = [[1.0]] }
//! #     parameters.variance = { initial = 1e-2, bounds = [1e-4, 1.0] }
//! #     [[tasks]]
//! #     name = "hold"
//! #     steps = 20
//! #     time_step = 0.1
//! #     initial_state = [1.0]
//! #     noise = { initial = [1e-2], process = [1e-3], measurement = ["variance"] }
//! #     costs = [{ kind = "quadratic", Q = [[1.0]], R = [[1.0]] }]
//! # "#;
//! # let source = Source { path: "hold.toml".to_owned(), text: text.to_owned() };
//!
//! // The task of the front page.
//! let task = LoadedTask::restore(&[source])?;
//! let axes = vec![Axis::parse("variance=log:1e-3:1e-1:3", &task)?];
//! let options = SweepOptions { axes, rollouts: 0, starts: 0, branches: 0, seed: 0 };
//! let sweep = run(&task, &options, None, Watch::default())?;
//! let bits = sweep.table.numbers("information_bits").ok_or("it is a column")?;
//! assert!(sweep.complete && bits[0] > bits[1] && bits[1] > bits[2]);
//! let least = sweep.least().ok_or("every point has information")?;
//! assert_eq!((least.row, least.among, sweep.contacts_made()[2]), (2, 3, true));
//! assert_eq!((Holds::of(&sweep.columns[0]), misses_contact(&sweep.columns[0])), (Holds::Numbers, None));
//!
//! // The same by units, which may run in different processes.
//! let (mut collector, stop) = (Collector::open(&task, &options, None)?, Stop::never());
//! let units = SweepUnits::new(&task, &options)?;
//! while let Some(unit) = collector.next_unit(1) {
//!     let rows = units.work(&unit, stop)?;
//!     collector.keep(&[(unit, rows)])?;
//! }
//! assert_eq!(collector.finish()?, sweep);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod axis;
mod codec;
mod collector;
mod columns;
mod done;
mod grid;
mod journal;
mod jumps;
mod least;
mod options;
#[cfg(feature = "parquet")]
mod parquet;
mod point;
mod result;
mod store;
mod unit;
mod work;

use std::path::Path;

pub use self::axis::{Axis, MOST_POINTS};
pub use self::collector::Collector;
pub use self::columns::{Holds, misses_contact};
pub use self::journal::kept_points;
pub use self::jumps::Jumps;
pub use self::least::LeastPoint;
pub use self::options::SweepOptions;
#[cfg(feature = "parquet")]
pub use self::parquet::TABLE_PARQUET;
pub use self::result::{Sweep, TABLE_CSV, TABLE_JSONL};
pub use self::unit::{SweepUnit, SweepUnits};
use self::work::work;
use crate::{LoadedTask, StudyError, Watch};

/// Evaluates every point of a grid on all threads of the current pool; with a folder, a journal in it keeps what is
/// done, and the same sweep resumes there. Told to stop, it ends with the points that are done.
///
/// # Errors
/// Where a grid is empty, or the journal cannot be written, is damaged, or belongs to something else.
///
/// Example: the [module](crate::sweep).
pub fn run(
    task: &LoadedTask,
    options: &SweepOptions,
    folder: Option<&Path>,
    watch: Watch,
) -> Result<Sweep, StudyError> {
    let mut collector = Collector::open(task, options, folder)?;
    let Collector { study, started, store, .. } = &mut collector;
    work(study, started, store, watch)?;
    collector.finish()
}

#[cfg(test)]
mod tests;
