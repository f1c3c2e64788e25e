//! From a figure to a page of vector graphics.

mod axes;
mod canvas;
mod contour;
mod field;
mod layout;
mod legend;
mod scale;
mod series;
mod sizes;

pub use canvas::{FAMILY, escaped};
pub use scale::step;

use canvas::{Canvas, Paint, Ruler};
use layout::{Layout, PanelLayout};
use scale::Mapping;
use series::Frame;

use crate::figure::{Figure, Grid, Panel, Series, Shape};

/// A page.
pub struct Page {
    /// Its width, pt.
    pub width: f64,
    /// Its height, pt.
    pub height: f64,
    /// What is on it, as SVG with texts as texts.
    pub svg: String,
}

/// Draws a figure on a page of a width in points.
pub fn page(figure: &Figure, grid: Grid, width: f64) -> Page {
    let layout = Layout::new(figure, grid, width, &Ruler::new());
    let mut canvas = Canvas::new();
    canvas.rectangle([0.0, 0.0, layout.width, layout.height], Paint::fill("#ffffff"));
    layout.legend.draw(&mut canvas);
    for (panel, place) in figure.panels.iter().zip(&layout.places) {
        draw_panel(&mut canvas, panel, place);
    }
    Page { width: layout.width, height: layout.height, svg: canvas.finish(layout.width, layout.height) }
}

fn draw_panel(canvas: &mut Canvas, panel: &Panel, place: &PanelLayout) {
    let [left, top, width, height] = place.area;
    let x = Mapping::new(&panel.x, left, left + width);
    let y = Mapping::new(&panel.y, top + height, top);
    let frame = Frame { area: place.area, x, y };
    let field = panel.series.iter().find_map(|series| match &series.shape {
        Shape::Field { levels, map, .. } => Some((levels, *map)),
        _ => None,
    });
    if field.is_none() {
        axes::grid(canvas, place, &frame);
    }
    let markers = |series: &&Series| matches!(series.shape, Shape::Points { .. });
    canvas.within(place.area, |canvas| {
        let above: Vec<_> = panel.series.iter().flat_map(|series| series::lines(series, &frame)).collect();
        for series in &panel.series {
            if let Shape::Field { grid, levels, map } = &series.shape {
                field::draw(canvas, &frame, grid, levels, *map, &above);
            }
        }
        panel.series.iter().for_each(|series| series::rim(canvas, series, &frame));
        let lines = panel.series.iter().filter(|series| !markers(series));
        lines.for_each(|series| series::draw(canvas, series, &frame));
    });
    if let Some((levels, map)) = field {
        field::bar(canvas, place.area, levels, map);
    }
    axes::draw(canvas, panel, place, &frame);
    // Above the axes, as a marker on them is drawn whole.
    panel.series.iter().filter(markers).for_each(|series| series::draw(canvas, series, &frame));
}
