//! The controller of a design, taken from its result to run elsewhere: as C, JSON or arrays of NumPy.
//!
//! # The controller of an evaluation
//!
//! ```
//! use supple_study::controller::{At, CONTROLLER_FORMAT, CSource, ControllerFile, ControllerFormat};
//! use supple_study::controller::ExportedController;
//! use supple_study::evaluate::EvaluateOptions;
//! use supple_study::study::Work;
//! use supple_study::{Folder, LoadedTask, Made, Source, Watch};
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
//! let work = Work::Evaluate(EvaluateOptions { trajectories: true, ..Default::default() });
//! let result = work.run(&task, None, Watch::default())?;
//! let folder = Folder { path: "hold".into(), made: Made::of(&task, work), result };
//! let exported = ExportedController::of(&folder, Some(&task), None, None)?;
//! let at_start = ExportedController::of(&folder, Some(&task), None, Some(At::Start));
//! assert!(at_start.is_err(), "only results of design searches hold several designs");
//!
//! let texts = CSource::of(&exported, "hold.h")?;
//! assert!(texts.source.contains(r#"#include "hold.h""#));
//! let file = ControllerFile::of(&exported);
//! assert_eq!((file.format, file.task.as_str()), (CONTROLLER_FORMAT, "hold"));
//! let out = tempfile::tempdir()?;
//! let written = exported.write(ControllerFormat::Json, &out.path().join("hold.json"))?;
//! assert_eq!(written.len(), 1);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod c;
mod exported;
mod file;
mod names;
mod npz;
mod write;

pub use c::CSource;
pub use exported::{At, ExportedController};
pub use file::{CONTROLLER_FORMAT, CONTROLLER_VERSION, ControllerFile};
pub use write::{ControllerFormat, check_out};
