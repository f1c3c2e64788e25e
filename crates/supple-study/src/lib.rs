//! Studies of compliant robots: designs, grids, Pareto fronts and comparisons over noise levels, computed in parallel,
//! stopped and resumed, stored in folders and read back. A [`Study`](study::Study) is a value that serialises: what to do,
//! to which task, with which options.
//!
//! The crate builds on `supple` and `supple-file`. The program, the Python package and the explorer build studies and
//! nothing else; `supple-figures` and `supple-report` show stored results and compute nothing.
//!
//! | what | main items |
//! |---|---|
//! | a task file as it was read, with the parameters to start from | [`LoadedTask`] |
//! | what to do, with all options, and the one function that does it | [`Work`](study::Work), [`Work::run`](study::Work::run) |
//! | parts of long work for other processes | [`Units`](study::Units) |
//! | the result of any study, as plain data | [`StudyResult`] |
//! | one folder per result, with all that determined it | [`Folder`], [`Made`] |
//! | progress, and the request to stop | [`Watch`], [`Progress`], [`Silent`] |
//! | one module per kind of study, with its options and its result | [`design`], [`evaluate`], [`sweep`], [`pareto`], [`robustness`], [`trace`], [`sensors`], [`bound`] |
//! | the controller of a stored design as C, JSON or NumPy arrays | [`controller`] |
//!
//! # A study as a value
//!
//! ```
//! use supple::Named;
//! use supple_study::evaluate::EvaluateOptions;
//! use supple_study::study::{Study, Work};
//! use supple_study::{Folder, LoadedTask, Made, Source, StudyResult, Watch};
//!
//! let text = r#"
//!     model = { kind = "linear", A = [[1.0]], B = [[1.0]], C = [[1.0]] }
//!     parameters.variance = { initial = 1e-2, bounds = [1e-4, 1.0] }
//!     [[tasks]]
//!     name = "hold"
//!     steps = 20
//!     time_step = 0.1
//!     initial_state = [1.0]
//!     noise = { initial = [1e-2], process = [1e-3], measurement = ["variance"] }
//!     costs = [{ kind = "quadratic", Q = [[1.0]], R = [[1.0]] }]
//! "#;
//! let source = Source { path: "hold.toml".to_owned(), text: text.to_owned() };
//! let task = LoadedTask::restore(&[source])?.setting(&Named::from([("variance", 1e-3)]))?;
//! let work = Work::Evaluate(EvaluateOptions { rollouts: 100, seed: 1, ..Default::default() });
//! let result = work.run(&task, None, Watch::default())?;
//!
//! // The folder keeps the study, the text of the task and the result.
//! let folder = tempfile::tempdir()?;
//! Folder::save(folder.path(), &Made::of(&task, work.clone()), &result)?;
//! let [kept] = &Folder::load_all(&[folder.path()])?[..] else { return Err("one folder".into()) };
//! assert_eq!(kept.made.study, Some(Study::of(&task, work)));
//! let StudyResult::Evaluate(report) = &kept.result else { return Err("an evaluation".into()) };
//! assert!((report.evaluation.objective.information_bits - 15.7).abs() < 0.01);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod bound;
mod catalogue;
mod checksums;
mod clipped;
mod consistent;
pub mod controller;
pub mod design;
mod error;
pub mod evaluate;
mod finite;
mod folder;
mod journal;
mod lenient;
pub mod pareto;
mod picture;
mod result;
pub mod robustness;
pub mod sensors;
pub mod study;
pub mod sweep;
mod table;
mod task;
pub mod trace;
mod watch;
mod write;

pub use checksums::{CHECKSUMS, changed};
pub use clipped::clipped;
pub use error::StudyError;
pub use finite::{NotFinite, not_finite};
pub use folder::{Folder, Made};
pub use journal::{JOURNAL, forget, kept_parts};
pub use picture::picture;
pub use result::{Steps, StudyResult};
pub use supple::Stop;
pub use table::{Cell, Column, Table};
pub use task::{About, AboutTask, LoadedTask, OWN_MODEL, Source};
pub use watch::{Progress, Silent, Watch};
pub use write::{RESULT, check_writable, write_text};
