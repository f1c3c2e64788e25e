//! Lines, bands, markers and bars.

use super::canvas::{Canvas, Paint};
use super::contour::{Place, Sheet};
use super::scale::Mapping;
use super::sizes::RADIUS;
use crate::figure::{Dash, Marker, Series, Shape, Style, Values};

/// Length of the head of an arrow, in widths of its line.
const HEAD: f64 = 4.0;

/// From data to places in a panel.
#[derive(Clone, Copy)]
pub struct Frame {
    /// Left, top, width and height.
    pub area: [f64; 4],
    /// Along the horizontal axis.
    pub x: Mapping,
    /// Along the vertical axis.
    pub y: Mapping,
}

impl Frame {
    fn places(&self, x: &[f64], y: &[f64]) -> Vec<Place> {
        x.iter().zip(y).map(|(&x, &y)| (self.x.at(x), self.y.at(y))).collect()
    }

    /// A quantity at its places.
    pub fn sheet<T>(&self, grid: &Values, draw: impl FnOnce(Sheet) -> T) -> T {
        let x: Vec<f64> = grid.x.iter().map(|&x| self.x.at(x)).collect();
        let y: Vec<f64> = grid.y.iter().map(|&y| self.y.at(y)).collect();
        draw(Sheet { x: &x, y: &y, rows: &grid.rows })
    }
}

/// Draws a series in its panel.
pub fn draw(canvas: &mut Canvas, series: &Series, frame: &Frame) {
    let style = &series.style;
    let [left, top, width, height] = frame.area;
    match &series.shape {
        Shape::Line { x, y } => {
            let places = frame.places(x, y);
            line(canvas, std::slice::from_ref(&places), style);
            // A line of one point, as of a task of one step, is a marker.
            let style = match (places.len(), style.marker) {
                (1, None) => style.marked(Marker::of_set(0)),
                _ => *style,
            };
            markers(canvas, &places, &style);
        }
        Shape::Points { x, y } => {
            let inside = |(x, y): &Place| {
                (left - 0.1..=left + width + 0.1).contains(x) && (top - 0.1..=top + height + 0.1).contains(y)
            };
            let places: Vec<Place> = frame.places(x, y).into_iter().filter(inside).collect();
            markers(canvas, &places, style);
        }
        Shape::Band { x, low, high } => {
            let (low, high) = (frame.places(x, low), frame.places(x, high));
            band(canvas, &low, &high, style);
        }
        Shape::Bars { x, low, high } => {
            for (low, high) in frame.places(x, low).into_iter().zip(frame.places(x, high)) {
                bar(canvas, low, high, style);
            }
        }
        Shape::Vertical { x } => {
            let x = frame.x.at(*x);
            line(canvas, &[vec![(x, top), (x, top + height)]], style);
        }
        Shape::Horizontal { y } => {
            let y = frame.y.at(*y);
            line(canvas, &[vec![(left, y), (left + width, y)]], style);
        }
        Shape::Outline { x, y } => outline(canvas, frame.places(x, y), style),
        Shape::Arrow { x, y } => arrow(canvas, &frame.places(x, y), style),
        // Drawn before all others.
        Shape::Field { .. } => {}
        Shape::Contour { grid, level } => {
            let lines = frame.sheet(grid, |sheet| sheet.lines(*level));
            line(canvas, &lines, style);
        }
    }
}

/// The lines and marks of a series, each mark as a line of one place; of areas there are none.
pub fn lines(series: &Series, frame: &Frame) -> Vec<Vec<Place>> {
    match &series.shape {
        Shape::Line { x, y } => vec![frame.places(x, y)],
        Shape::Points { x, y } => frame.places(x, y).into_iter().map(|place| vec![place]).collect(),
        Shape::Contour { grid, level } => frame.sheet(grid, |sheet| sheet.lines(*level)),
        _ => Vec::new(),
    }
}

/// Draws the rim of a line: below all lines, so that it hides none of them.
pub fn rim(canvas: &mut Canvas, series: &Series, frame: &Frame) {
    let lines = match &series.shape {
        Shape::Line { x, y } => vec![frame.places(x, y)],
        Shape::Contour { grid, level } => frame.sheet(grid, |sheet| sheet.lines(*level)),
        _ => return,
    };
    if series.style.rim {
        let paint = Paint::stroke("#ffffff", series.style.width + 1.2);
        canvas.path(&lines, false, Paint { opacity: 0.75, ..paint });
    }
}

/// Draws a sample of a series for the legend.
pub fn sample(canvas: &mut Canvas, series: &Series, [x, y, width, height]: [f64; 4]) {
    let style = &series.style;
    let middle = (x + width / 2.0, y + height / 2.0);
    match &series.shape {
        Shape::Band { .. } => {
            let paint = Paint { opacity: style.opacity, ..Paint::fill(style.colour.hex()) };
            canvas.rectangle([x, y + 0.5, width, height - 1.0], paint);
        }
        Shape::Points { .. } => markers(canvas, &[middle], style),
        Shape::Bars { .. } => bar(canvas, (middle.0, y + height), (middle.0, y), style),
        Shape::Field { .. } => {}
        Shape::Outline { .. } => {
            let corners = [(x, y + 1.0), (x + width, y + 1.0), (x + width, y + height - 1.0), (x, y + height - 1.0)];
            outline(canvas, corners.to_vec(), style);
        }
        Shape::Arrow { .. } => arrow(canvas, &[(x, middle.1), (x + width, middle.1)], style),
        Shape::Vertical { .. } => line(canvas, &[vec![(middle.0, y), (middle.0, y + height)]], style),
        Shape::Line { .. } | Shape::Horizontal { .. } | Shape::Contour { .. } => {
            line(canvas, &[vec![(x, middle.1), (x + width, middle.1)]], style);
            markers(canvas, &[middle], style);
        }
    }
}

/// Dashes and gaps, for a line of width 1.
fn dashes(dash: Dash) -> &'static [f64] {
    match dash {
        Dash::Solid => &[],
        Dash::Dashed => &[4.0, 2.0],
        Dash::DashDotted => &[5.0, 1.6, 1.2, 1.6],
        Dash::Dotted => &[1.2, 1.4],
    }
}

fn line(canvas: &mut Canvas, lines: &[Vec<Place>], style: &Style) {
    let stroke = Paint::stroke(style.colour.hex(), style.width);
    canvas.path(lines, false, Paint { dash: dashes(style.dash), opacity: style.opacity, ..stroke });
}

/// The area between two lines, in parts where both are finite.
fn band(canvas: &mut Canvas, low: &[Place], high: &[Place], style: &Style) {
    let finite = |index: &usize| [low[*index], high[*index]].iter().all(|(x, y)| x.is_finite() && y.is_finite());
    let all: Vec<usize> = (0..low.len().min(high.len())).collect();
    let outline = |part: &[usize]| -> Vec<Place> {
        part.iter().map(|&index| low[index]).chain(part.iter().rev().map(|&index| high[index])).collect()
    };
    let parts: Vec<Vec<Place>> = all.split(|index| !finite(index)).map(outline).collect();
    canvas.path(&parts, true, Paint { opacity: style.opacity, ..Paint::fill(style.colour.hex()) });
}

/// A closed outline: a light area with a full rim.
fn outline(canvas: &mut Canvas, corners: Vec<Place>, style: &Style) {
    let lines = [corners];
    canvas.path(&lines, true, Paint { opacity: style.opacity, ..Paint::fill(style.colour.hex()) });
    canvas.path(&lines, true, Paint::stroke(style.colour.hex(), style.width));
}

/// A line with a head at its end, which short arrows have in proportion.
fn arrow(canvas: &mut Canvas, ends: &[Place], style: &Style) {
    let [from, tip] = ends else { return };
    let (x, y) = (tip.0 - from.0, tip.1 - from.1);
    let length = x.hypot(y);
    if length.is_nan() || length < style.width {
        return;
    }
    let head = (HEAD * style.width).min(0.6 * length);
    let (x, y) = (x / length * head, y / length * head);
    let foot = (tip.0 - x, tip.1 - y);
    let corners = vec![*tip, (foot.0 - 0.4 * y, foot.1 + 0.4 * x), (foot.0 + 0.4 * y, foot.1 - 0.4 * x)];
    line(canvas, &[vec![*from, foot]], style);
    canvas.path(&[corners], true, Paint::fill(style.colour.hex()));
}

fn bar(canvas: &mut Canvas, low: Place, high: Place, style: &Style) {
    let cap = |(x, y): Place| vec![(x - 1.6, y), (x + 1.6, y)];
    let paint = Paint { opacity: style.opacity, ..Paint::stroke(style.colour.hex(), 0.7) };
    canvas.path(&[vec![low, high], cap(low), cap(high)], false, paint);
}

fn markers(canvas: &mut Canvas, places: &[Place], style: &Style) {
    let Some(marker) = style.marker else { return };
    let colour = style.colour.hex();
    let fill = if style.filled { colour } else { "#ffffff" };
    let stroke = if style.rim && style.filled { "#ffffff" } else { colour };
    let paint = Paint { stroke: Some(stroke), width: 0.7, opacity: style.opacity, ..Paint::fill(fill) };
    for &(x, y) in places.iter().filter(|(x, y)| x.is_finite() && y.is_finite()) {
        match marker {
            Marker::Circle => canvas.circle((x, y), RADIUS, paint),
            Marker::Square => polygon(canvas, (x, y), 4, 45.0, &[1.25], paint),
            Marker::Triangle => polygon(canvas, (x, y), 3, 90.0, &[1.4], paint),
            Marker::Diamond => polygon(canvas, (x, y), 4, 90.0, &[1.4], paint),
            Marker::Star => polygon(canvas, (x, y), 10, 90.0, &[2.1, 0.9], paint),
            Marker::Cross => polygon(canvas, (x, y), 8, 45.0, &[2.2, 0.8], paint),
        }
    }
}

/// A polygon around a place, with corners from an angle on, at radii in turn.
fn polygon(canvas: &mut Canvas, (x, y): Place, corners: usize, first: f64, radii: &[f64], paint: Paint) {
    let corner = |index: usize| {
        let angle = first.to_radians() + std::f64::consts::TAU * index as f64 / corners as f64;
        let radius = RADIUS * radii[index % radii.len()];
        (x + radius * angle.cos(), y - radius * angle.sin())
    };
    canvas.path(&[(0..corners).map(corner).collect()], true, paint);
}
