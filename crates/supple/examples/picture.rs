//! Draws `docs/images/two_mass.svg`: the two masses before and after the design, and the information they need.

use std::error::Error;
use std::fmt::Write;

use supple::design::{Control, design};
use supple::{EvaluateOptions, TaskEvaluation, TrajectoryReport};

/// The folder of the repository.
const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../");

fn main() -> Result<(), Box<dyn Error>> {
    std::fs::write(format!("{ROOT}docs/images/two_mass.svg"), draw(&format!("{ROOT}tasks/two_mass.toml"))?)?;
    Ok(())
}

/// The picture of a two-mass task, as the text of an SVG file.
pub fn draw(task: &str) -> Result<String, Box<dyn Error>> {
    let problem = supple_file::load(task)?;
    let start = problem.parameters.initial();
    let control = Control::default();
    let found = design(&problem, &start, &problem.design, control)?;
    let best = &found.starts[found.best];
    let options = EvaluateOptions { trajectories: true, ..Default::default() };
    let before = problem.evaluate(&start, &options)?;
    let options = EvaluateOptions { controls: Some(best.controls.clone()), ..options };
    let after = problem.evaluate(&best.to, &options)?;

    let mut svg = String::from(HEAD);
    let designs = [("start", "a", &start, &before.tasks[0]), ("optimum", "b", &best.to, &after.tasks[0])];
    for (number, (name, _, phi, task)) in designs.into_iter().enumerate() {
        let Some(trajectory) = &task.trajectory else { continue };
        let panel = Panel { left: 55.0 + 320.0 * number as f64, range: [-0.1, 1.1] };
        let title = format!("{name}: k1 = {:.0}, k2 = {:.0} N/m", phi[0], phi[1]);
        panel.axes(&mut svg, &title, "position, m", 0.5)?;
        positions(&mut svg, &panel, trajectory)?;
    }
    let panel = Panel { left: 695.0, range: [0.0, 9.0] };
    panel.axes(&mut svg, "directed information", "bits per measurement", 2.0)?;
    for (number, (name, class, _, task)) in designs.into_iter().enumerate() {
        information(&mut svg, &panel, task, class)?;
        panel.key(&mut svg, 2 + number, class, &format!("{name}: {:.0} bits", task.information.total_bits))?;
    }
    svg.push_str("</svg>\n");
    Ok(svg)
}

/// Positions of the masses and the wall, with bands of two standard deviations of the belief to either side.
fn positions(svg: &mut String, panel: &Panel, at: &TrajectoryReport) -> std::fmt::Result {
    let lines = [(4, "w", "wall"), (0, "p", "first mass, x1"), (2, "q", "second mass, x2")];
    for (row, (state, class, label)) in lines.into_iter().enumerate() {
        let edge = |t: usize, sign: f64| (at.time[t], at.states[t][state] + sign * 2.0 * at.deviations[t][state]);
        let upper = (0..at.time.len()).map(|t| edge(t, 1.0));
        let lower = (0..at.time.len()).rev().map(|t| edge(t, -1.0));
        writeln!(svg, r#"<path class="band {class}" d="{}Z"/>"#, panel.path(upper.chain(lower)))?;
        let line = at.time.iter().zip(&at.states).map(|(&time, x)| (time, x[state]));
        writeln!(svg, r#"<path class="line {class}" d="{}"/>"#, panel.path(line))?;
        panel.key(svg, 7 + row, class, label)?;
    }
    panel.key(svg, 10, "none", "bands: belief, ± 2 σ")
}

/// Bits per measurement over time.
fn information(svg: &mut String, panel: &Panel, task: &TaskEvaluation, class: &str) -> std::fmt::Result {
    let Some(trajectory) = &task.trajectory else { return Ok(()) };
    let bits = task.information.per_step_nats.iter().map(|nats| nats / std::f64::consts::LN_2);
    writeln!(svg, r#"<path class="line {class}" d="{}"/>"#, panel.path(trajectory.time.iter().copied().zip(bits)))
}

/// A plot: time from 0 to `END` to the right, something over its range upwards.
struct Panel {
    left: f64,
    range: [f64; 2],
}

/// Seconds shown.
const END: f64 = 2.5;
const TOP: f64 = 36.0;
const WIDTH: f64 = 240.0;
const HEIGHT: f64 = 240.0;

impl Panel {
    fn at(&self, x: f64, y: f64) -> (f64, f64) {
        let [low, high] = self.range;
        (self.left + x / END * WIDTH, TOP + HEIGHT * (high - y) / (high - low))
    }

    fn path(&self, points: impl Iterator<Item = (f64, f64)>) -> String {
        let point = |(number, (x, y))| {
            let (x, y) = self.at(x, y);
            format!("{}{x:.1} {y:.1}", if number == 0 { 'M' } else { 'L' })
        };
        points.enumerate().map(point).collect()
    }

    /// A line of the legend, `row` lines below the top.
    fn key(&self, svg: &mut String, row: usize, class: &str, label: &str) -> std::fmt::Result {
        let (x, y) = (self.left + 85.0, TOP + 18.0 * row as f64 + 14.0);
        writeln!(svg, r#"<path class="line {class}" d="M{x:.1} {:.1}h18"/>"#, y - 4.0)?;
        writeln!(svg, r#"<text x="{:.1}" y="{y:.1}">{label}</text>"#, x + 24.0)
    }

    fn axes(&self, svg: &mut String, title: &str, unit: &str, step: f64) -> std::fmt::Result {
        let (bottom, right) = (TOP + HEIGHT, self.left + WIDTH);
        let middle = (self.left + right) / 2.0;
        writeln!(svg, r#"<text class="title" x="{middle:.1}" y="20" text-anchor="middle">{title}</text>"#)?;
        for tick in 0..=(self.range[1] / step) as usize {
            let value = tick as f64 * step;
            let (x, y) = self.at(0.0, value);
            writeln!(svg, r#"<path class="grid" d="M{x:.1} {y:.1}H{right:.1}"/>"#)?;
            let digits = usize::from(step < 1.0);
            writeln!(svg, r#"<text x="{:.1}" y="{:.1}" text-anchor="end">{value:.digits$}</text>"#, x - 6.0, y + 4.0)?;
        }
        for tick in 0..=5 {
            let value = 0.5 * f64::from(tick);
            let x = self.left + value / END * WIDTH;
            writeln!(svg, r#"<text x="{x:.1}" y="{:.1}" text-anchor="middle">{value:.1}</text>"#, bottom + 17.0)?;
        }
        writeln!(svg, r#"<path class="axis" d="M{:.1} {TOP}V{bottom}H{right:.1}"/>"#, self.left)?;
        writeln!(svg, r#"<text x="{middle:.1}" y="{:.1}" text-anchor="middle">time, s</text>"#, bottom + 36.0)?;
        let (x, y) = (self.left - 34.0, TOP + HEIGHT / 2.0);
        writeln!(svg, r#"<text transform="translate({x:.1} {y:.1}) rotate(-90)" text-anchor="middle">{unit}</text>"#)
    }
}

/// Size and colours: neutral ones that read on white and on black, with stronger text where the page is dark.
const HEAD: &str = r#"<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 960 322" role="img">
<title>Two masses press on a wall: positions with beliefs, and information per step, before and after the design</title>
<style>
text { font: 13px system-ui, "DejaVu Sans", sans-serif; fill: #59636e; }
.title { font-weight: 600; }
.line { fill: none; stroke-width: 1.4; stroke-linejoin: round; }
.band { stroke: none; opacity: 0.35; }
.axis { fill: none; stroke: #818b98; }
.grid { fill: none; stroke: #818b98; opacity: 0.25; }
.line.p { stroke: #2f81f7; } .band.p { fill: #2f81f7; }
.line.q { stroke: #e0700d; } .band.q { fill: #e0700d; }
.line.w { stroke: #818b98; } .band.w { fill: #818b98; }
.line.a { stroke: #a371f7; } .line.b { stroke: #2da44e; }
@media (prefers-color-scheme: dark) { text { fill: #c9d1d9; } }
</style>
"#;
