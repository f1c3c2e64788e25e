//! The contents of a figure as plain data, independent of points, fonts and files.
//!
//! # A custom figure
//!
//! ```
//! use supple_figures::figure::{Axis, Colour, Dash, Figure, Grid, Marker, Panel, Scale, Series, Shape, Style};
//! use supple_figures::{Format, Width, render};
//!
//! let (x, y) = (vec![0.0, 1.0, 2.0], vec![0.0, 1.0, 0.5]);
//! let across = Axis::over("time", "s", Scale::Linear, [0.0, 2.0]);
//! let up = Axis::around("force", "N", Scale::Linear, &y);
//! let style = Style { dash: Dash::Dashed, ..Style::line(Colour::Blue) }.marked(Marker::Circle);
//! let series = vec![Series::named("plan", style, Shape::Line { x, y })];
//! let panel = Panel { title: String::new(), x: across, y: up, series };
//! let grid = Grid { columns: 1, aspect: 0.5 };
//! let figure = Figure {
//!     name: "force".into(),
//!     title: "Force over time".into(),
//!     panels: vec![panel],
//!     column: grid,
//!     page: grid,
//!     shared_x: true,
//!     shared_y: true,
//! };
//! assert_eq!(figure.entries(), ["plan"]);
//! assert!(render(&figure, Format::Pdf, Width::Column)?.starts_with(b"%PDF-"));
//! # Ok::<(), supple_figures::FigureError>(())
//! ```

use serde::Serialize;
pub use supple::parameters::Scale;

/// A figure: panels in rows.
///
/// Example: the [front page](crate).
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Figure {
    /// Its name, also that of its file.
    pub name: String,
    /// What it shows, in a sentence.
    pub title: String,
    /// Its panels, row by row.
    pub panels: Vec<Panel>,
    /// How panels are laid out in a column of a paper.
    pub column: Grid,
    /// How panels are laid out over the page.
    pub page: Grid,
    /// Whether panels in a column have the same x axis, which is labelled at the lowest only.
    pub shared_x: bool,
    /// Whether panels in a row have the same y axis, which is labelled at the first only.
    pub shared_y: bool,
}

impl Figure {
    /// The entries of its legend, in the order in which they first appear.
    #[must_use]
    pub fn entries(&self) -> Vec<&str> {
        let mut entries: Vec<&str> = Vec::new();
        for label in self.panels.iter().flat_map(|panel| &panel.series).filter_map(|series| series.label.as_deref()) {
            if !entries.contains(&label) {
                entries.push(label);
            }
        }
        entries
    }
}

/// How panels are laid out.
///
/// Example: the [module](crate::figure).
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Grid {
    /// Panels side by side.
    pub columns: usize,
    /// Height of a panel over its width, without labels.
    pub aspect: f64,
}

/// A pair of axes with what is drawn in them.
///
/// Example: the [module](crate::figure).
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Panel {
    /// What it shows; may be empty.
    pub title: String,
    /// The horizontal axis.
    pub x: Axis,
    /// The vertical axis.
    pub y: Axis,
    /// What is drawn, the lowest first.
    pub series: Vec<Series>,
}

/// An axis.
///
/// Example: the [module](crate::figure).
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Axis {
    /// What it measures; may be empty.
    pub label: String,
    /// Its unit; empty where there is none.
    pub unit: String,
    /// How it is divided.
    pub scale: Scale,
    /// Its ends: finite, rising, and positive where the scale is logarithmic.
    pub range: [f64; 2],
}

/// Something drawn in a panel.
///
/// Example: the [module](crate::figure).
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Series {
    /// Its name in the legend, where series of the same name are one entry; none for no entry.
    pub label: Option<String>,
    /// How it looks.
    pub style: Style,
    /// What it is.
    pub shape: Shape,
}

/// What is drawn. Gaps are where a number is not finite.
///
/// Example: the [module](crate::figure).
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Shape {
    /// A line through points, with markers where the style has one.
    Line {
        /// Abscissae.
        x: Vec<f64>,
        /// Ordinates.
        y: Vec<f64>,
    },
    /// Markers.
    Points {
        /// Abscissae.
        x: Vec<f64>,
        /// Ordinates.
        y: Vec<f64>,
    },
    /// The area between two lines.
    Band {
        /// Abscissae.
        x: Vec<f64>,
        /// Lower ordinates.
        low: Vec<f64>,
        /// Upper ordinates.
        high: Vec<f64>,
    },
    /// Vertical bars with caps.
    Bars {
        /// Abscissae.
        x: Vec<f64>,
        /// Lower ordinates.
        low: Vec<f64>,
        /// Upper ordinates.
        high: Vec<f64>,
    },
    /// A line over the whole height.
    Vertical {
        /// Its abscissa.
        x: f64,
    },
    /// A line over the whole width.
    Horizontal {
        /// Its ordinate.
        y: f64,
    },
    /// A closed outline, filled in a light tone.
    Outline {
        /// Abscissae of its corners.
        x: Vec<f64>,
        /// Their ordinates.
        y: Vec<f64>,
    },
    /// An arrow.
    Arrow {
        /// Abscissae of its foot and its tip.
        x: [f64; 2],
        /// Their ordinates.
        y: [f64; 2],
    },
    /// Filled contours with a colour bar.
    Field {
        /// What is shown.
        grid: Values,
        /// Where one colour ends and the next begins, rising.
        levels: Vec<f64>,
        /// The colours.
        map: Map,
    },
    /// The line on which a quantity has a value.
    Contour {
        /// The quantity.
        grid: Values,
        /// The value.
        level: f64,
    },
}

/// A quantity on a grid.
///
/// ```
/// use supple_figures::figure::{Map, Shape, Values};
///
/// // The product of both coordinates.
/// let (x, y) = (vec![0.0, 1.0], vec![0.0, 1.0, 2.0]);
/// let rows: Vec<Vec<f64>> = y.iter().map(|y| x.iter().map(|x| x * y).collect()).collect();
/// let grid = Values { x, y, rows };
/// assert_eq!(grid.rows[2], [0.0, 2.0]);
/// let field = Shape::Field { grid, levels: vec![0.0, 1.0, 2.0], map: Map::Viridis };
/// assert!(matches!(field, Shape::Field { .. }));
/// ```
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Values {
    /// Abscissae, rising.
    pub x: Vec<f64>,
    /// Ordinates, rising.
    pub y: Vec<f64>,
    /// One row by ordinate, with one value by abscissa; NaN where there is none.
    pub rows: Vec<Vec<f64>>,
}

/// A sequence of colours of rising lightness.
///
/// Example: [`Values`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Map {
    /// Blue, green, yellow.
    Viridis,
    /// Blue, grey, yellow.
    Cividis,
}

/// How something looks.
///
/// Example: the [module](crate::figure).
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Style {
    /// Its colour.
    pub colour: Colour,
    /// Solid, dashed or dotted.
    pub dash: Dash,
    /// The marker at its points.
    pub marker: Option<Marker>,
    /// Whether markers are filled with the colour, or else with white.
    pub filled: bool,
    /// Width of its line, pt.
    pub width: f64,
    /// From 0, not to be seen, to 1.
    pub opacity: f64,
    /// Whether a white outline separates it from what is underneath.
    pub rim: bool,
}

impl Style {
    /// A full line of 1 pt.
    #[must_use]
    pub fn line(colour: Colour) -> Self {
        Self { colour, dash: Dash::Solid, marker: None, filled: true, width: 1.0, opacity: 1.0, rim: false }
    }

    /// An area that lets others through.
    #[must_use]
    pub fn area(colour: Colour, opacity: f64) -> Self {
        Self { opacity, ..Self::line(colour) }
    }

    /// Markers alone.
    #[must_use]
    pub fn points(colour: Colour, marker: Marker) -> Self {
        Self { marker: Some(marker), ..Self::line(colour) }
    }

    /// The `index`th of a set of lines to tell apart, by colour and by dash.
    #[must_use]
    pub fn of_set(index: usize) -> Self {
        let colours = Colour::SET.len();
        let dash = Dash::SET[(index + index / colours) % Dash::SET.len()];
        Self { dash, ..Self::line(Colour::SET[index % colours]) }
    }

    /// The same with a marker.
    #[must_use]
    pub fn marked(self, marker: Marker) -> Self {
        Self { marker: Some(marker), ..self }
    }
}

/// Colours that colour-blind readers can distinguish, by Okabe and Ito.
///
/// Example: the [module](crate::figure).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Colour {
    /// For what others are compared with.
    Black,
    /// For what is in the background.
    Grey,
    /// `#0072b2`
    Blue,
    /// `#d55e00`
    Vermilion,
    /// `#009e73`
    Green,
    /// `#cc79a7`
    Purple,
    /// `#e69f00`
    Orange,
    /// `#56b4e9`
    Sky,
}

impl Colour {
    /// Colours of sets of lines, in this order. Yellow is not among them: it is too light for lines on white.
    const SET: [Self; 6] = [Self::Blue, Self::Vermilion, Self::Green, Self::Purple, Self::Orange, Self::Sky];

    /// As in SVG.
    #[must_use]
    pub fn hex(self) -> &'static str {
        match self {
            Self::Black => "#000000",
            Self::Grey => "#7f7f7f",
            Self::Blue => "#0072b2",
            Self::Vermilion => "#d55e00",
            Self::Green => "#009e73",
            Self::Purple => "#cc79a7",
            Self::Orange => "#e69f00",
            Self::Sky => "#56b4e9",
        }
    }
}

/// How a line is broken.
///
/// Example: the [module](crate::figure).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Dash {
    /// Not at all.
    Solid,
    /// Into dashes.
    Dashed,
    /// Into dashes and dots in turn.
    DashDotted,
    /// Into dots.
    Dotted,
}

impl Dash {
    const SET: [Self; 4] = [Self::Solid, Self::Dashed, Self::DashDotted, Self::Dotted];
}

/// A mark at a point.
///
/// Example: the [module](crate::figure).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Marker {
    /// A disc.
    Circle,
    /// A square on its side.
    Square,
    /// A triangle on its side.
    Triangle,
    /// A square on its corner.
    Diamond,
    /// A star of five points.
    Star,
    /// A cross, for what a reader must not rely on.
    Cross,
}

impl Marker {
    /// The `index`th of a set of markers to tell apart.
    #[must_use]
    pub fn of_set(index: usize) -> Self {
        [Self::Circle, Self::Square, Self::Triangle, Self::Diamond][index % 4]
    }
}

impl Series {
    /// A series with an entry in the legend.
    pub fn named(label: impl Into<String>, style: Style, shape: Shape) -> Self {
        Self { label: Some(label.into()), style, shape }
    }

    /// A series without one.
    #[must_use]
    pub fn plain(style: Style, shape: Shape) -> Self {
        Self { label: None, style, shape }
    }

    /// All finite ordinates and abscissae, for ranges.
    pub(crate) fn ordinates(&self) -> Vec<f64> {
        match &self.shape {
            Shape::Line { y, .. } | Shape::Points { y, .. } | Shape::Outline { y, .. } => y.clone(),
            Shape::Arrow { y, .. } => y.to_vec(),
            Shape::Band { low, high, .. } | Shape::Bars { low, high, .. } => [low.as_slice(), high].concat(),
            Shape::Horizontal { y } => vec![*y],
            Shape::Vertical { .. } | Shape::Field { .. } | Shape::Contour { .. } => Vec::new(),
        }
    }
}

impl Axis {
    /// An axis over exactly these ends.
    pub fn over(label: impl Into<String>, unit: impl Into<String>, scale: Scale, range: [f64; 2]) -> Self {
        Self { label: label.into(), unit: unit.into(), scale, range }
    }

    /// An axis with some room beyond all values; linear if the values do not suit a logarithmic scale.
    pub fn around(label: impl Into<String>, unit: impl Into<String>, scale: Scale, values: &[f64]) -> Self {
        let (low, high) = ends(values.iter().copied().filter(|value| value.is_finite()));
        let scale = suited(scale, low, high);
        Self::over(label, unit, scale, room(scale, low, high))
    }

    /// An axis that ends at the least and the greatest value.
    pub fn within(label: impl Into<String>, unit: impl Into<String>, scale: Scale, values: &[f64]) -> Self {
        let (low, high) = ends(values.iter().copied().filter(|value| value.is_finite()));
        let scale = suited(scale, low, high);
        if low < high {
            return Self::over(label, unit, scale, [low, high]);
        }
        Self::over(label, unit, scale, room(scale, low, high))
    }
}

/// Keeps a logarithmic scale only if its ends and their ratio are normal positive numbers.
fn suited(scale: Scale, low: f64, high: f64) -> Scale {
    if low > 1e-290 && high < 1e290 && (high / low).is_finite() { scale } else { Scale::Linear }
}

/// The least and the greatest of finite values; 0 and 1 of none.
fn ends(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
    if low <= high { (low, high) } else { (0.0, 1.0) }
}

/// Ends of an axis beyond the ends of what it shows.
fn room(scale: Scale, low: f64, high: f64) -> [f64; 2] {
    match scale {
        Scale::Log => {
            let part = ((high / low).ln() * 0.06).max(0.02);
            [low * (-part).exp(), high * part.exp()]
        }
        Scale::Linear => {
            // A constant line would otherwise be magnified to its rounding errors.
            let least = 0.02 * low.abs().max(high.abs());
            let part =
                if high - low > 1e-9 * high.abs().max(low.abs()) { 0.06 * (high - low) } else { least.max(1e-3) };
            [low - part, high + part]
        }
    }
}
