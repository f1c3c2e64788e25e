//! Filled contours, their lines and numbers, and the colour bar.

use super::canvas::{Canvas, Hold, Paint, Ruler};
use super::contour::{Place, Sheet};
use super::series::Frame;
use super::sizes::{BAR, SMALL};
use crate::figure::{Map, Values};
use crate::words;

/// Colour of what has no value.
const MISSING: &str = "#dcdcdc";

/// The colour of a band among bands, and whether it is dark.
fn colour(map: Map, band: usize, bands: usize) -> (String, bool) {
    let gradient = match map {
        Map::Viridis => colorous::VIRIDIS,
        Map::Cividis => colorous::CIVIDIS,
    };
    // The darkest end is left out: what is drawn above is to be seen.
    let colour = gradient.eval_continuous(0.12 + 0.88 * (band as f64 + 0.5) / bands as f64);
    let light = 0.299 * f64::from(colour.r) + 0.587 * f64::from(colour.g) + 0.114 * f64::from(colour.b);
    (format!("#{colour:x}"), light < 130.0)
}

/// Draws bands, lines between them, and their values wherever lines and marks of `above` would not cover them.
pub fn draw(canvas: &mut Canvas, frame: &Frame, grid: &Values, levels: &[f64], map: Map, above: &[Vec<Place>]) {
    let bands = levels.len() + 1;
    let ruler = Ruler::new();
    canvas.rectangle(frame.area, Paint::fill(MISSING));
    frame.sheet(grid, |sheet| {
        // Each band covers all above it too, so that no gap shows between two.
        canvas.path(&sheet.area(f64::NEG_INFINITY), true, Paint::fill(&colour(map, 0, bands).0));
        for (index, level) in levels.iter().enumerate() {
            canvas.path(&sheet.area(*level), true, Paint::fill(&colour(map, index + 1, bands).0));
        }
        let mut room = Room { area: frame.area, above, taken: Vec::new() };
        for (index, (level, text)) in levels.iter().zip(words::typeset_all(levels)).enumerate() {
            let dark = colour(map, index + 1, bands).1;
            numbered(canvas, &sheet, *level, &text, dark, &ruler, &mut room);
        }
    });
}

/// Where numbers have room.
struct Room<'a> {
    area: [f64; 4],
    /// Lines and marks that are drawn above.
    above: &'a [Vec<Place>],
    /// Middles of other numbers.
    taken: Vec<Place>,
}

impl Room<'_> {
    /// Whether a number of half a width at a place would be covered, or too near to another one.
    fn is_free(&self, at: Place, half: f64) -> bool {
        let near = |line: &Vec<Place>| match line[..] {
            [mark] => distance(mark, at) < half + 3.0,
            _ => line.windows(2).any(|ends| beside(at, ends[0], ends[1]) < half + 1.0),
        };
        self.taken.iter().all(|other| distance(*other, at) > 2.0 * half + 3.0) && !self.above.iter().any(near)
    }
}

/// How far a place is from a line between two others.
fn beside(at: Place, from: Place, to: Place) -> f64 {
    let (along, off) = ((to.0 - from.0, to.1 - from.1), (at.0 - from.0, at.1 - from.1));
    let square = along.0 * along.0 + along.1 * along.1;
    let share = if square > 0.0 { ((off.0 * along.0 + off.1 * along.1) / square).clamp(0.0, 1.0) } else { 0.0 };
    distance(at, (from.0 + share * along.0, from.1 + share * along.1))
}

/// Draws the lines of a level, the longest with its value in a gap.
fn numbered(canvas: &mut Canvas, sheet: &Sheet, level: f64, text: &str, dark: bool, ruler: &Ruler, room: &mut Room) {
    let colour = if dark { "#ffffff" } else { "#000000" };
    let mut lines = sheet.lines(level);
    let half = ruler.width(text, SMALL - 1.0) / 2.0 + 1.5;
    lines.sort_by(|a, b| length(b).total_cmp(&length(a)));
    let spot = lines.first().and_then(|line| spot(line, half, room));
    if let Some(Spot { at: (x, y), angle, from, to }) = spot {
        let line = lines.remove(0);
        lines.extend([line[..=from].to_vec(), line[to..].to_vec()]);
        room.taken.push((x, y));
        let (sin, cos) = angle.to_radians().sin_cos();
        let down = 0.36 * (SMALL - 1.0);
        canvas.text(text, (x - down * sin, y + down * cos), SMALL - 1.0, Hold::Middle, angle, colour);
    }
    canvas.path(&lines, false, Paint { opacity: 0.6, ..Paint::stroke(colour, 0.4) });
}

fn distance(a: Place, b: Place) -> f64 {
    (a.0 - b.0).hypot(a.1 - b.1)
}

fn length(line: &[Place]) -> f64 {
    line.windows(2).map(|pair| distance(pair[0], pair[1])).sum()
}

/// Where a number has room on a line.
struct Spot {
    at: Place,
    angle: f64,
    /// The last place before the gap, and the first after it.
    from: usize,
    to: usize,
}

/// The straightest stretch of a line that is long enough, in the panel, and free of what else is there.
fn spot(line: &[Place], half: f64, room: &Room) -> Option<Spot> {
    let [left, top, width, height] = room.area;
    let mut best: Option<(f64, Spot)> = None;
    let middle = length(line) / 2.0;
    let mut along = 0.0;
    let mut to = 0;
    for from in 0..line.len() {
        along += if from > 0 { distance(line[from - 1], line[from]) } else { 0.0 };
        while to < line.len() && distance(line[from], line[to]) < 2.0 * half {
            to += 1;
        }
        if to == line.len() {
            break;
        }
        let (a, b) = (line[from], line[to]);
        let at = ((a.0 + b.0) / 2.0, (a.1 + b.1) / 2.0);
        let angle = ((b.1 - a.1) / (b.0 - a.0)).atan();
        // Nearly vertical numbers read upwards.
        let angle = if angle > 1.4 { angle - std::f64::consts::PI } else { angle };
        let (reach_x, reach_y) = (half * angle.cos().abs() + 4.0, half * angle.sin().abs() + 4.0);
        let inside = at.0 > left + reach_x
            && at.0 < left + width - reach_x
            && at.1 > top + reach_y
            && at.1 < top + height - reach_y;
        if inside && room.is_free(at, half) {
            let bend = length(&line[from..=to]) / distance(a, b) - 1.0;
            let aside = (along + half - middle).abs() / middle;
            let score = bend + 0.1 * aside;
            if best.as_ref().is_none_or(|(least, _)| score < *least) {
                best = Some((score, Spot { at, angle: angle.to_degrees(), from, to }));
            }
        }
    }
    best.filter(|(score, _)| *score < 0.5).map(|(_, spot)| spot)
}

/// Draws the colour bar of a panel to its right: bands of the same height, with the levels between them.
pub fn bar(canvas: &mut Canvas, [left, top, width, height]: [f64; 4], levels: &[f64], map: Map) {
    let bands = levels.len() + 1;
    let (x, step) = (left + width + BAR, height / bands as f64);
    for band in 0..bands {
        // Up to the top, so that no gap shows between two.
        let tall = height - step * band as f64;
        canvas.rectangle([x, top, BAR, tall], Paint::fill(&colour(map, band, bands).0));
    }
    canvas.rectangle([x, top, BAR, height], Paint::stroke("#000000", 0.4));
    let every = (1.15 * SMALL / step).ceil().max(1.0) as usize;
    for (index, text) in words::typeset_all(levels).iter().enumerate().filter(|(index, _)| index % every == 0) {
        let y = top + height - step * (index + 1) as f64;
        canvas.path(&[vec![(x + BAR, y), (x + BAR + 1.5, y)]], false, Paint::stroke("#000000", 0.4));
        canvas.text(text, (x + BAR + 3.0, y + 0.36 * SMALL), SMALL, Hold::Left, 0.0, "#000000");
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    /// Where the number of a level line through the middle of a panel is, below these lines.
    fn number_below(above: &[Vec<Place>]) -> Option<Place> {
        let line: Vec<Place> = (0..=100).map(|x| (f64::from(x), 50.0)).collect();
        let room = Room { area: [0.0, 0.0, 100.0, 100.0], above, taken: Vec::new() };
        spot(&line, 8.0, &room).map(|spot| spot.at)
    }

    #[test]
    fn numbers_stay_clear_of_paths_and_marks() {
        let upright = |x: f64| vec![(x, 0.0), (x, 100.0)];
        assert!((number_below(&[]).unwrap().0 - 50.0).abs() < 8.0);
        let (x, _) = number_below(&[upright(50.0), vec![(30.0, 52.0)]]).unwrap();
        assert!((x - 50.0).abs() > 8.0 && (x - 30.0).abs() > 8.0, "{x}");
        let everywhere: Vec<Vec<Place>> = (0..20).map(|i| upright(5.0 * f64::from(i))).collect();
        assert!(number_below(&everywhere).is_none(), "no number rather than one that is covered");
    }
}
