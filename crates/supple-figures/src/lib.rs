//! Figures for papers from stored results: SVG, PDF or PNG in the width of a column or a page, with labels and units, in
//! colours that colour-blind readers distinguish. A [`Figure`] is plain data: panels with axes and what is drawn in them.
//!
//! The crate builds on `supple-study`, whose [`Folder`](supple_study::Folder)s it reads, and computes nothing; the program's
//! `supple plot` and the Python package call it.
//!
//! | what | main items |
//! |---|---|
//! | the figure of some kind, of results | [`draw`], [`Kind`] |
//! | the same by one function per kind | [`landscape`], [`belief`], [`gains`], [`robustness`], [`pareto`], [`information`], [`motion`] |
//! | a figure as plain data: panels, axes, series | [`Figure`], [`figure`] |
//! | a file of it | [`render`], [`Format`], [`Width`] |
//! | why there is no figure | [`FigureError`] |
//!
//! # A figure of a result
//!
//! ```
//! use supple_figures::{Format, Kind, Width, draw, render};
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
//! let figure = draw(Kind::Information, &[folder], Some("hold"))?;
//! assert_eq!((figure.name.as_str(), figure.panels[0].x.unit.as_str()), ("information", "s"));
//! let svg = String::from_utf8(render(&figure, Format::Svg, Width::Column)?)?;
//! assert!(svg.starts_with("<svg"));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod draw;
mod error;
pub mod figure;
mod figures;
mod render;
mod words;

pub use error::FigureError;
pub use figure::Figure;
pub use figures::{Kind, MOST_ENTRIES, belief, draw, gains, information, landscape, motion, pareto, robustness};
pub use render::{Format, Width, render};
