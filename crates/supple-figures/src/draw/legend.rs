//! The legend, above all panels: it never covers what is drawn.

use super::canvas::{Canvas, Hold, Ruler};
use super::series;
use super::sizes::SMALL;
use crate::figure::{Figure, Series, Shape};

/// Length of the sample of an entry, pt.
const SAMPLE: f64 = 17.0;
/// Gap between sample and text, and between entries, pt.
const GAPS: [f64; 2] = [3.0, 9.0];
/// Height of a row, pt.
const ROW: f64 = 10.0;

/// The legend of a figure.
pub struct Legend {
    entries: Vec<Entry>,
    /// Height of all of it, pt.
    pub height: f64,
}

struct Entry {
    label: String,
    series: Vec<Series>,
    at: (f64, f64),
}

impl Entry {
    /// Length of its sample, pt.
    fn sample(&self) -> f64 {
        let narrow = |series: &Series| {
            matches!(series.shape, Shape::Points { .. } | Shape::Vertical { .. } | Shape::Bars { .. })
        };
        if self.series.iter().all(narrow) { SAMPLE / 2.5 } else { SAMPLE }
    }
}

impl Legend {
    /// Entries in rows, in the order in which they first appear.
    pub fn new(figure: &Figure, width: f64, ruler: &Ruler) -> Self {
        let mut entries: Vec<Entry> = Vec::new();
        for panel in &figure.panels {
            // Within one panel, what has the same name is drawn as one sample; other panels repeat it.
            let fresh = entries.len();
            for series in &panel.series {
                let Some(label) = &series.label else { continue };
                match entries.iter().position(|entry| entry.label == *label) {
                    None => entries.push(Entry { label: label.clone(), series: vec![series.clone()], at: (0.0, 0.0) }),
                    Some(known) if known >= fresh => entries[known].series.push(series.clone()),
                    Some(_) => {}
                }
            }
        }
        let (mut x, mut row) = (2.0, 0.0);
        for entry in &mut entries {
            let length = entry.sample() + GAPS[0] + ruler.width(&entry.label, SMALL);
            if x > 2.0 && x + length > width - 2.0 {
                (x, row) = (2.0, row + 1.0);
            }
            entry.at = (x, 2.0 + (row + 0.5) * ROW);
            x += length + GAPS[1];
        }
        let height = if entries.is_empty() { 0.0 } else { (row + 1.0) * ROW + 4.0 };
        Self { entries, height }
    }

    /// Draws it.
    pub fn draw(&self, canvas: &mut Canvas) {
        for entry in &self.entries {
            let (x, y) = entry.at;
            for series in &entry.series {
                series::sample(canvas, series, [x, y - 3.5, entry.sample(), 7.0]);
            }
            let place = (x + entry.sample() + GAPS[0], y + 0.36 * SMALL);
            canvas.text(&entry.label, place, SMALL, Hold::Left, 0.0, "#000000");
        }
    }
}
