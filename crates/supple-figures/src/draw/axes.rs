//! Axes: frame, ticks, labels, title.

use super::canvas::{Canvas, Hold, Paint};
use super::layout::PanelLayout;
use super::series::Frame;
use super::sizes::{LABEL, LEADING, SMALL, TICK};
use crate::figure::Panel;
use crate::words;

const BLACK: &str = "#000000";

/// Draws light lines at the ticks with texts.
pub fn grid(canvas: &mut Canvas, place: &PanelLayout, frame: &Frame) {
    let [left, top, width, height] = place.area;
    let texts = |ticks: &super::scale::Ticks| -> Vec<f64> {
        ticks.ticks.iter().filter(|tick| !tick.text.is_empty()).map(|tick| tick.value).collect()
    };
    let upright = texts(&place.x).into_iter().map(|x| frame.x.at(x)).map(|x| vec![(x, top), (x, top + height)]);
    let level = texts(&place.y).into_iter().map(|y| frame.y.at(y)).map(|y| vec![(left, y), (left + width, y)]);
    let lines: Vec<_> = upright.chain(level).collect();
    canvas.path(&lines, false, Paint::stroke("#e4e4e4", 0.4));
}

/// Draws frame, ticks, labels and title.
pub fn draw(canvas: &mut Canvas, panel: &Panel, place: &PanelLayout, frame: &Frame) {
    let [left, top, width, height] = place.area;
    canvas.rectangle(place.area, Paint::stroke(BLACK, 0.6));
    let length = |text: &str| if text.is_empty() { 0.6 * TICK } else { TICK };
    let below = top + height;
    let mut marks = Vec::new();
    for tick in &place.x.ticks {
        let x = frame.x.at(tick.value);
        marks.push(vec![(x, below), (x, below + length(&tick.text))]);
        if place.labelled_x {
            let y = below + TICK + 1.5 + 0.8 * SMALL;
            canvas.text(&tick.text, (x, y), SMALL, Hold::Middle, 0.0, BLACK);
        }
    }
    for tick in &place.y.ticks {
        let y = frame.y.at(tick.value);
        marks.push(vec![(left, y), (left - length(&tick.text), y)]);
        if place.labelled_y {
            canvas.text(&tick.text, (left - TICK - 1.5, y + 0.36 * SMALL), SMALL, Hold::Right, 0.0, BLACK);
        }
    }
    canvas.path(&marks, false, Paint::stroke(BLACK, 0.5));
    if place.labelled_x {
        let label = words::label(&panel.x.label, &panel.x.unit, place.x.exponent);
        let y = below + TICK + 2.0 + SMALL * LEADING + 0.85 * LABEL;
        canvas.text(&label, (left + width / 2.0, y), LABEL, Hold::Middle, 0.0, BLACK);
    }
    let lines = place.y_label.len();
    for (index, line) in place.y_label.iter().enumerate() {
        let x = left - place.y_label_gap - (lines - 1 - index) as f64 * LABEL * LEADING;
        canvas.text(line, (x, top + height / 2.0), LABEL, Hold::Middle, -90.0, BLACK);
    }
    for (index, line) in place.title.iter().enumerate() {
        let up = (place.title.len() - 1 - index) as f64 * LABEL * LEADING;
        canvas.text(line, (left, top - place.title_gap - up), LABEL, Hold::Left, 0.0, BLACK);
    }
}
