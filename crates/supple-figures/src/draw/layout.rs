//! Where panels, labels and legend lie on the page.

use super::canvas::Ruler;
use super::legend::Legend;
use super::scale::{Ticks, ticks};
use super::sizes::{BAR, LABEL, LEADING, REACH, SMALL, TICK};
use crate::figure::{Axis, Figure, Grid, Panel, Shape};
use crate::words;

/// The layout of a figure.
pub struct Layout {
    /// Width of the page, pt.
    pub width: f64,
    /// Its height, pt.
    pub height: f64,
    /// The legend.
    pub legend: Legend,
    /// The panels.
    pub places: Vec<PanelLayout>,
}

/// The layout of a panel.
pub struct PanelLayout {
    /// Left, top, width and height of what is within the axes.
    pub area: [f64; 4],
    /// Ticks of the horizontal axis.
    pub x: Ticks,
    /// Ticks of the vertical axis.
    pub y: Ticks,
    /// Whether the horizontal axis has texts.
    pub labelled_x: bool,
    /// Whether the vertical axis has texts.
    pub labelled_y: bool,
    /// Lines of the title.
    pub title: Vec<String>,
    /// From the upper axis to the title.
    pub title_gap: f64,
    /// Lines of the label of the vertical axis.
    pub y_label: Vec<String>,
    /// From the vertical axis to the middle of its label.
    pub y_label_gap: f64,
}

/// Room around a panel: left, right, top, bottom.
#[derive(Clone, Copy, Default)]
struct Margins([f64; 4]);

impl Layout {
    /// Of a figure on a page of a width.
    pub fn new(figure: &Figure, grid: Grid, width: f64, ruler: &Ruler) -> Self {
        let count = figure.panels.len();
        let columns = grid.columns.clamp(1, count.max(1));
        let rows = count.div_ceil(columns);
        let legend = Legend::new(figure, width, ruler);
        let mut size = [width / columns as f64 - 42.0, 0.0];
        size[1] = size[0] * grid.aspect;
        let mut places = Vec::new();
        let mut margins = vec![[0.0; 4]; count];
        // Ticks and titles depend on panel sizes, which depend on the room for ticks.
        for _ in 0..6 {
            let before = size[0];
            let gap = if figure.panels.iter().any(|panel| marked_above(panel, size[1])) { REACH + 3.5 } else { 3.5 };
            let at = |(index, panel): (usize, &Panel)| {
                let labelled_x = !figure.shared_x || index + columns >= count;
                let labelled_y = !figure.shared_y || index % columns == 0;
                let tag = if count > 1 { format!("({}) ", letter(index)) } else { String::new() };
                panel_layout(panel, tag, labelled_x, labelled_y, size, gap, ruler)
            };
            let (laid, rooms): (Vec<_>, Vec<_>) = figure.panels.iter().enumerate().map(at).unzip();
            places = laid;
            margins = rooms.iter().map(|margins: &Margins| margins.0).collect();
            for (places, margins) in places.chunks_mut(columns).zip(margins.chunks_mut(columns)) {
                break_alike(places, margins, size[0], ruler);
            }
            let sides: f64 =
                (0..columns).map(|c| column(&margins, c, columns, 0) + column(&margins, c, columns, 1)).sum();
            size[0] = ((width - sides) / columns as f64).max(20.0);
            size[1] = size[0] * grid.aspect;
            if (size[0] - before).abs() < SETTLED {
                break;
            }
        }
        let mut y = legend.height;
        for row in 0..rows {
            let of_row = |side: usize| {
                let last = ((row + 1) * columns).min(count);
                margins[row * columns..last].iter().map(|room| room[side]).fold(0.0, f64::max)
            };
            y += of_row(2);
            let mut x = 0.0;
            for (index, place) in places.iter_mut().enumerate().skip(row * columns).take(columns) {
                x += column(&margins, index % columns, columns, 0);
                place.area = [x, y, size[0], size[1]];
                x += size[0] + column(&margins, index % columns, columns, 1);
            }
            y += size[1] + of_row(3);
        }
        Self { width, height: y, legend, places }
    }
}

/// Change of a panel's width from which the layout is not settled.
const SETTLED: f64 = 0.1;

/// Room above a panel.
fn above(title: &[String], gap: f64) -> f64 {
    if title.is_empty() { 5.0 } else { 1.5 + gap + title.len() as f64 * LABEL * LEADING }
}

/// Whether a marker of a panel lies on its upper axis, or reaches beyond it.
fn marked_above(panel: &Panel, height: f64) -> bool {
    let map = super::scale::Mapping::new(&panel.y, height, 0.0);
    let near = |y: &f64| (-0.1..REACH).contains(&map.at(*y));
    panel.series.iter().any(|series| matches!(&series.shape, Shape::Points { y, .. } if y.iter().any(near)))
}

/// If a title in a row of panels of this width takes several lines, all titles of the row break after their last comma where
/// they fit then, so that they look alike and what belongs together stays together.
fn break_alike(row: &mut [PanelLayout], margins: &mut [[f64; 4]], width: f64, ruler: &Ruler) {
    if row.iter().all(|place| place.title.len() < 2) {
        return;
    }
    let broken = |(place, [_, right, ..]): (&PanelLayout, &[f64; 4])| {
        let whole = place.title.join(" ");
        let (first, second) = whole.rsplit_once(", ").filter(|_| place.title.len() < 3)?;
        let lines = vec![format!("{first},"), second.to_owned()];
        lines.iter().all(|line| ruler.width(line, LABEL) <= width + right).then_some(lines)
    };
    let Some(titles) = row.iter().zip(&*margins).map(broken).collect::<Option<Vec<_>>>() else { return };
    for ((place, margins), title) in row.iter_mut().zip(margins).zip(titles) {
        place.title = title;
        margins[2] = above(&place.title, place.title_gap);
    }
}

/// The most room on a side that a panel of a column needs.
fn column(margins: &[[f64; 4]], column: usize, columns: usize, side: usize) -> f64 {
    margins.iter().skip(column).step_by(columns).map(|room| room[side]).fold(0.0, f64::max)
}

fn panel_layout(
    panel: &Panel,
    tag: String,
    labelled_x: bool,
    labelled_y: bool,
    size: [f64; 2],
    title_gap: f64,
    ruler: &Ruler,
) -> (PanelLayout, Margins) {
    let x = apart(&panel.x, size[0], ruler);
    let y = ticks(&panel.y, ((size[1] / 12.0) as usize).clamp(3, 7));
    let widest = |ticks: &Ticks| ticks.ticks.iter().map(|tick| ruler.width(&tick.text, SMALL)).fold(0.0, f64::max);
    let label = words::label(&panel.y.label, &panel.y.unit, y.exponent);
    let y_label = if labelled_y && !label.is_empty() { wrap(&label, size[1] + 14.0, ruler) } else { Vec::new() };
    let y_label_gap = TICK + 6.0 + widest(&y);
    // Texts of the ticks at its ends reach beyond the axis.
    let half = if labelled_x { widest(&x) / 2.0 + 2.5 } else { 4.0 };
    let left = if labelled_y { y_label_gap + y_label.len() as f64 * LABEL * LEADING + 1.0 } else { half };
    let right = bar_levels(panel).map_or(half, |levels| {
        let texts = words::typeset_all(levels).into_iter().map(|text| ruler.width(&text, SMALL));
        2.0 * BAR + 4.0 + texts.fold(0.0, f64::max)
    });
    let title = tag + &panel.title;
    let title = if title.trim().is_empty() { Vec::new() } else { wrap(title.trim_end(), size[0] + right, ruler) };
    let top = above(&title, title_gap);
    let named = !words::label(&panel.x.label, &panel.x.unit, x.exponent).is_empty();
    let bottom = match (labelled_x, named) {
        (true, true) => TICK + 2.0 + (SMALL + LABEL) * LEADING + 3.0,
        (true, false) => TICK + 4.0 + SMALL * LEADING,
        _ => 4.0,
    };
    let layout = PanelLayout { area: [0.0; 4], x, y, labelled_x, labelled_y, title, title_gap, y_label, y_label_gap };
    (layout, Margins([left, right, top, bottom]))
}

/// The levels of a panel with a colour bar.
pub fn bar_levels(panel: &Panel) -> Option<&[f64]> {
    panel.series.iter().find_map(|series| match &series.shape {
        Shape::Field { levels, .. } => Some(levels.as_slice()),
        _ => None,
    })
}

/// As many ticks along a width as have room beside one another.
fn apart(axis: &Axis, width: f64, ruler: &Ruler) -> Ticks {
    let most = ((width / 14.0) as usize).clamp(2, 9);
    let map = super::scale::Mapping::new(axis, 0.0, width);
    let free = |ticks: &Ticks| {
        let ends = ticks.ticks.iter().filter(|tick| !tick.text.is_empty()).map(|tick| {
            let (at, half) = (map.at(tick.value), ruler.width(&tick.text, SMALL) / 2.0);
            (at - half, at + half)
        });
        ends.clone().zip(ends.skip(1)).all(|(one, next)| one.1 + 5.0 <= next.0)
    };
    (2..=most).rev().map(|most| ticks(axis, most)).find(free).unwrap_or_else(|| ticks(axis, 2))
}

/// A text in lines no wider than `width`: between words, or within words that are wider.
fn wrap(text: &str, width: f64, ruler: &Ruler) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split(' ') {
        match lines.last_mut() {
            Some(line) if ruler.width(&format!("{line} {word}"), LABEL) <= width => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
        while let Some(line) = lines.last_mut().filter(|line| ruler.width(line, LABEL) > width) {
            let ends = line.char_indices().map(|(end, _)| end).skip(1);
            let Some(end) = ends.take_while(|&end| ruler.width(&line[..end], LABEL) <= width).last() else { break };
            let rest = line.split_off(end);
            lines.push(rest);
        }
    }
    lines
}

/// The letter of a panel.
fn letter(index: usize) -> String {
    let last = char::from(b'a' + (index % 26) as u8);
    if index < 26 { last.to_string() } else { letter(index / 26 - 1) + &last.to_string() }
}
