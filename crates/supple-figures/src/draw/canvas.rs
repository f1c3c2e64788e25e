//! A page of vector graphics, written as SVG; lengths are in points.

use std::fmt::Write;

use ttf_parser::Face;

use super::contour::Place;

/// The family of the font that comes with the program.
pub const FAMILY: &str = "Noto Sans";

/// The anchor of a text.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Hold {
    /// At its left.
    Left,
    /// At its middle.
    Middle,
    /// At its right.
    Right,
}

/// How a line or area is painted.
#[derive(Clone, Copy, Debug)]
pub struct Paint<'a> {
    /// Colour of the area; none for no area.
    pub fill: Option<&'a str>,
    /// Colour of the line; none for no line.
    pub stroke: Option<&'a str>,
    /// Width of the line.
    pub width: f64,
    /// Lengths of dashes and gaps, for a line of width 1; empty for a full line.
    pub dash: &'a [f64],
    /// Opacity of both.
    pub opacity: f64,
}

impl<'a> Paint<'a> {
    /// A line.
    pub fn stroke(colour: &'a str, width: f64) -> Self {
        Self { fill: None, stroke: Some(colour), width, dash: &[], opacity: 1.0 }
    }

    /// An area.
    pub fn fill(colour: &'a str) -> Self {
        Self { fill: Some(colour), stroke: None, width: 0.0, dash: &[], opacity: 1.0 }
    }
}

/// Widths of texts.
pub struct Ruler {
    face: Option<Face<'static>>,
}

impl Ruler {
    /// Of the font that comes with the program.
    pub fn new() -> Self {
        Self { face: Face::parse(notosans::REGULAR_TTF, 0).ok() }
    }

    /// The width of a text.
    pub fn width(&self, text: &str, size: f64) -> f64 {
        let part = |c: char| {
            let face = self.face.as_ref()?;
            let advance = face.glyph_hor_advance(face.glyph_index(c)?)?;
            Some(f64::from(advance) / f64::from(face.units_per_em()))
        };
        let width = |c: char| match level(c) {
            (c, Level::Line) => part(c).unwrap_or(0.6),
            (c, _) => part(c).unwrap_or(0.6) * INDEX,
        };
        text.chars().map(width).sum::<f64>() * size
    }
}

/// Size of an index or power in that of its text.
const INDEX: f64 = 0.7;

/// Where a character stands.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Level {
    Line,
    Raised,
    Lowered,
}

/// The character to draw for one of a text, and its level: fonts have few superscript and subscript glyphs.
fn level(c: char) -> (char, Level) {
    let digit = |zero: u32| char::from_digit((c as u32).wrapping_sub(zero), 10);
    match c {
        '\u{b9}' => ('1', Level::Raised),
        '\u{b2}' => ('2', Level::Raised),
        '\u{b3}' => ('3', Level::Raised),
        '\u{207b}' => ('\u{2212}', Level::Raised),
        _ => match (digit(0x2070), digit(0x2080)) {
            (Some(digit), _) => (digit, Level::Raised),
            (_, Some(digit)) => (digit, Level::Lowered),
            _ => (c, Level::Line),
        },
    }
}

/// What is drawn.
pub struct Canvas {
    body: String,
    clips: usize,
}

impl Canvas {
    /// An empty one.
    pub fn new() -> Self {
        Self { body: String::new(), clips: 0 }
    }

    /// Lines through places, in one path. Places that are not finite break a line.
    pub fn path(&mut self, lines: &[Vec<Place>], closed: bool, paint: Paint) {
        let mut data = String::new();
        for line in lines {
            for part in line.split(|(x, y)| !x.is_finite() || !y.is_finite()).filter(|part| part.len() > 1) {
                for (index, &(x, y)) in part.iter().enumerate() {
                    let _ = write!(data, "{}{} {}", if index == 0 { 'M' } else { 'L' }, Number(x), Number(y));
                }
                data.push_str(if closed { "Z" } else { "" });
            }
        }
        if !data.is_empty() {
            let _ = write!(self.body, r#"<path d="{data}""#);
            self.paint(paint);
            self.body.push_str(r#" fill-rule="evenodd" stroke-linejoin="round"/>"#);
        }
    }

    /// A rectangle.
    pub fn rectangle(&mut self, [x, y, width, height]: [f64; 4], paint: Paint) {
        let (x, y, width, height) = (Number(x), Number(y), Number(width), Number(height));
        let _ = write!(self.body, r#"<rect x="{x}" y="{y}" width="{width}" height="{height}""#);
        self.paint(paint);
        self.body.push_str("/>");
    }

    /// A circle.
    pub fn circle(&mut self, (x, y): Place, radius: f64, paint: Paint) {
        let _ = write!(self.body, r#"<circle cx="{}" cy="{}" r="{}""#, Number(x), Number(y), Number(radius));
        self.paint(paint);
        self.body.push_str("/>");
    }

    /// A text on its baseline, turned by an angle in degrees.
    pub fn text(&mut self, text: &str, (x, y): Place, size: f64, hold: Hold, angle: f64, colour: &str) {
        if text.is_empty() {
            return;
        }
        let anchor = match hold {
            Hold::Left => "start",
            Hold::Middle => "middle",
            Hold::Right => "end",
        };
        let (x, y) = (Number(x), Number(y));
        let _ = write!(self.body, r#"<text x="{x}" y="{y}" font-size="{size}" text-anchor="{anchor}" fill="{colour}""#);
        if angle != 0.0 {
            let _ = write!(self.body, r#" transform="rotate({} {x} {y})""#, Number(angle));
        }
        self.body.push('>');
        let mut drop = 0.0;
        let runs: Vec<(char, Level)> = text.chars().map(level).collect();
        for run in runs.chunk_by(|a, b| a.1 == b.1) {
            let content: String = run.iter().map(|(c, _)| *c).collect();
            let (down, part) = match run[0].1 {
                Level::Line => (0.0, 1.0),
                Level::Raised => (-0.36 * size, INDEX),
                Level::Lowered => (0.16 * size, INDEX),
            };
            let (shift, size) = (Number(down - drop), Number(size * part));
            let _ = write!(self.body, r#"<tspan dy="{shift}" font-size="{size}">{}</tspan>"#, escaped(&content));
            drop = down;
        }
        self.body.push_str("</text>");
    }

    /// Draws within a rectangle what `draw` draws.
    pub fn within(&mut self, [x, y, width, height]: [f64; 4], draw: impl FnOnce(&mut Self)) {
        self.clips += 1;
        let (id, x, y) = (self.clips, Number(x), Number(y));
        let (width, height) = (Number(width), Number(height));
        let _ = write!(self.body, r#"<clipPath id="c{id}"><rect x="{x}" y="{y}" width="{width}" height="{height}"/>"#);
        let _ = write!(self.body, r##"</clipPath><g clip-path="url(#c{id})">"##);
        draw(self);
        self.body.push_str("</g>");
    }

    fn paint(&mut self, paint: Paint) {
        let _ = write!(self.body, r#" fill="{}""#, paint.fill.unwrap_or("none"));
        if let Some(stroke) = paint.stroke {
            let _ = write!(self.body, r#" stroke="{stroke}" stroke-width="{}""#, Number(paint.width));
            if !paint.dash.is_empty() {
                let dash: Vec<_> =
                    paint.dash.iter().map(|part| Number(part * paint.width.max(0.6)).to_string()).collect();
                let _ = write!(self.body, r#" stroke-dasharray="{}""#, dash.join(" "));
            }
        }
        if paint.opacity < 1.0 {
            let _ = write!(self.body, r#" opacity="{}""#, Number(paint.opacity));
        }
    }

    /// The page as SVG, with texts as texts.
    pub fn finish(self, width: f64, height: f64) -> String {
        let (w, h) = (Number(width), Number(height));
        format!(
            r#"<svg xmlns="http://www.w3.org/2000/svg" width="{w}" height="{h}" viewBox="0 0 {w} {h}" font-family="{FAMILY}">{}</svg>"#,
            self.body
        )
    }
}

/// A text in XML.
pub fn escaped(text: &str) -> String {
    // Characters that XML does not allow are shown as replacement characters.
    let legal = |c: char| if c.is_control() || matches!(c, '\u{fffe}' | '\u{ffff}') { '\u{fffd}' } else { c };
    let mut out = String::with_capacity(text.len());
    for c in text.chars().map(legal) {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            _ => out.push(c),
        }
    }
    out
}

/// A length to a hundredth of a point, without zeros at its end.
struct Number(f64);

impl std::fmt::Display for Number {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        // Places far outside the page are clamped, as some programs read only a limited number of digits.
        let rounded = (self.0.clamp(-1e5, 1e5) * 100.0).round() / 100.0;
        write!(f, "{}", if rounded == 0.0 { 0.0 } else { rounded })
    }
}
