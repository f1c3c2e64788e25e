//! Figures for papers: vector graphics with labels and units, safe for colour-blind readers.
//!
//! A [`Figure`] is plain data: panels with axes and what is drawn in them. [`draw`] makes one of results of studies, and
//! [`render`] makes a file of it.
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
