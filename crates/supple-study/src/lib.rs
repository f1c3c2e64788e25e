//! Studies of compliant robots: computations over many designs or noise levels, stored in folders and read back.
//!
//! A [`Study`](study::Study) is a value: what to do, to which task, with which options. [`Work::run`](study::Work::run)
//! does it and gives a plain [`StudyResult`]; [`Folder`] stores a result with everything that determined it.
//!
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
mod found;
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
pub use table::{Cell, Column, Table};
pub use task::{About, AboutTask, LoadedTask, OWN_MODEL, Source};
pub use watch::{Progress, Silent, Watch};
pub use write::{RESULT, check_writable, write_text};
