//! One self-contained HTML page of results: the question, the answer, plots, and the robot in motion. The page carries its
//! data and scripts, and nothing is fetched when it is read.
//!
//! The crate builds on `supple-study`, whose [`Folder`](supple_study::Folder)s it shows, and computes nothing;
//! `supple report`, `supple study` and the Python package write its pages, and `supple-explore` shows the same scenes.
//!
//! | what | main items |
//! |---|---|
//! | the page of some folders: [`Folder::load_all`](supple_study::Folder::load_all) reads them | [`page`] |
//! | why there is no page | [`ReportError`] |
//! | the robot in motion as data for its script | [`scene`] |
//! | scripts and styles that pages carry: plots are drawn by plotly.js | [`assets`] |
//!
//! # A page of a result
//!
//! ```
//! use supple_study::Folder;
//! # use supple_study::evaluate::EvaluateOptions;
//! # use supple_study::study::Work;
//! # use supple_study::{LoadedTask, Made, Source, Watch};
//! # let text = r#"
//! #     model = { kind = "linear", A = [[1.0]], B = [[1.0]], C = [[1.0]] }
//! #     [[tasks]]
//! #     name = "hold"
//! #     steps = 20
//! #     time_step = 0.1
//! #     initial_state = [1.0]
//! #     noise = { initial = [1e-2], process = [1e-3], measurement = [1e-3] }
//! #     costs = [{ kind = "quadratic", Q = [[1.0]], R = [[1.0]] }]
//! # "#;
//! # let source = Source { path: "hold.toml".to_owned(), text: text.to_owned() };
//! # let task = LoadedTask::restore(&[source])?;
//! # let work = Work::Evaluate(EvaluateOptions { trajectories: true, ..Default::default() });
//!
//! // A study with trajectories, as the front page of `supple_study` makes one; `Folder::load_all` reads stored ones.
//! let result = work.run(&task, None, Watch::default())?;
//! let folder = Folder { path: "hold".into(), made: Made::of(&task, work), result };
//! let page = supple_report::page(&[folder])?;
//! assert!(page.starts_with("<!DOCTYPE html>") && page.contains("hold"));
//! assert!(!page.contains("<script src="), "it fetches nothing");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod arrays;
pub mod assets;
mod document;
mod error;
mod html;
mod legend;
mod numbers;
mod packed;
mod part;
mod plots;
pub mod scene;
mod sections;
mod words;

pub use document::page;
pub use error::ReportError;
