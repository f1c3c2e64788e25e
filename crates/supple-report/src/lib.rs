//! One self-contained HTML page of studies: what was asked, the answer, plots, and the robot moving.
//!
//! [`Folder::load_all`](supple_study::Folder::load_all) reads folders of results, [`page`] makes the page. Its text and tables are HTML made here; its plots are
//! data made here and drawn by plotly.js, which the page carries; nothing is fetched when it is read.
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
