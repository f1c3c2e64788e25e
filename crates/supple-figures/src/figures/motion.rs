use supple::parameters::Scale;
use supple::scene::{Body, Connection, ConnectionKind, Scene, Solid, Wall};
use supple_study::Folder;

use super::results::{Shown, content, designs};
use crate::figure::{Axis, Colour, Dash, Figure, Grid, Panel, Series, Shape, Style};
use crate::{FigureError, words};

/// How many poses of each design are shown.
const POSES: usize = 6;
/// Springs that are shorter than this, in the size of what is drawn, are not shown.
const NO_LENGTH: f64 = 1e-3;
/// Corners of circles.
const ROUND: usize = 24;
/// The longest arrow, in the size of what is drawn.
const ARROW: f64 = 0.3;

/// The robot at six times of its motion, from the first to the last; a row of panels per design. Bodies are drawn by
/// their simple shapes, contact forces as arrows that end where they act, all to one scale.
///
/// The view is along an axis of the world: of the three planes, the one with the most motion and force is shown, z
/// upwards.
///
/// # Errors
/// Where there is no evaluated design, no task of the name, or the model cannot be drawn.
///
/// ```
/// use std::path::Path;
///
/// use supple_figures::motion;
/// use supple_study::evaluate::EvaluateOptions;
/// use supple_study::study::Work;
/// use supple_study::{Folder, LoadedTask, Made, Watch};
///
/// # let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tasks/two_mass_small.toml");
/// let task = LoadedTask::load(Path::new(file))?;
/// let work = Work::Evaluate(EvaluateOptions { trajectories: true, ..Default::default() });
/// let result = work.run(&task, None, Watch::default())?;
/// let folder = Folder { path: "press".into(), made: Made::of(&task, work), result };
/// assert_eq!(motion(&[folder], Some("press"))?.panels.len(), 6);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn motion(folders: &[Folder], task: Option<&str>) -> Result<Figure, FigureError> {
    let shown = designs("motion", folders, task)?;
    let scenes: Vec<(&Shown, &Scene)> =
        shown.iter().filter_map(|design| Some((design, design.trajectory.scene.as_ref()?))).collect();
    let Some((first, _)) = scenes.first() else {
        return Err(content(&folders[0], "has no motion to draw: its model has no bodies"));
    };
    let view = View::of(&scenes);
    // Peaks may be between the frames of a scene.
    let peaks = shown.iter().flat_map(|design| &design.task.contacts).map(|contact| contact.peak_force);
    let strongest = scenes.iter().flat_map(|(_, scene)| strengths(scene)).chain(peaks).fold(0.0, f64::max);
    let label = format!("contact force, at most {} N", words::typeset(strongest));
    let mut poses = Vec::new();
    for (design, scene) in &scenes {
        let frames = scene.time.0.len();
        for pose in 0..POSES.min(frames) {
            let frame = if frames > 1 { pose * (frames - 1) / (POSES.min(frames) - 1).max(1) } else { 0 };
            let digits = if scene.time.0[frames - 1][0] < 0.5 { 3 } else { 2 };
            let time = format!("{}\u{a0}s", words::fixed(scene.time.0[frame][0], digits));
            let title = if scenes.len() > 1 { format!("{}, {time}", design.design) } else { time };
            poses.push(Pose {
                title,
                guides: view.guides(scene, frame),
                series: view.pose(scene, frame),
                scene,
                frame,
            });
        }
    }
    let ([x, y], _) = ranges(&poses);
    let size = (x[1] - x[0]).max(y[1] - y[0]);
    let length = if strongest > 0.0 { ARROW * size / strongest } else { 0.0 };
    for Pose { series, scene, frame, .. } in &mut poses {
        series.extend(view.forces(scene, *frame, length, &label));
    }
    let ([x, y], aspect) = ranges(&poses);
    let axis = |axis: usize, range: [f64; 2]| Axis::over(["x", "y", "z"][axis], "m", Scale::Linear, range);
    let (x, y) = (axis(view.across, x), axis(view.up, y));
    let panel = |Pose { title, guides, series, .. }: Pose| {
        let series = guides.into_iter().chain(series).collect();
        Panel { title, x: x.clone(), y: y.clone(), series }
    };
    Ok(Figure {
        name: "motion".into(),
        title: format!("The robot at {POSES} instants of task {}, with contact forces", first.task.name),
        panels: poses.into_iter().map(panel).collect(),
        column: Grid { columns: POSES / 2, aspect },
        page: Grid { columns: POSES, aspect },
        shared_x: true,
        shared_y: true,
    })
}

/// A design at an instant.
struct Pose<'a> {
    title: String,
    /// Rails, which the panel may crop.
    guides: Vec<Series>,
    /// What the panel shows as a whole.
    series: Vec<Series>,
    scene: &'a Scene,
    frame: usize,
}

/// Ranges of both axes that show all poses, and the ratio of height to width.
fn ranges(poses: &[Pose]) -> ([[f64; 2]; 2], f64) {
    let all = |of: fn(&Shape) -> &[f64]| -> Vec<f64> {
        poses.iter().flat_map(|pose| &pose.series).flat_map(|series| of(&series.shape).iter().copied()).collect()
    };
    let (x, y, aspect) = square(&all(abscissae), &all(ordinates));
    ([x, y], aspect)
}

/// The axes of the world that are seen.
struct View {
    across: usize,
    up: usize,
}

impl View {
    /// Of the axes along which most moves and presses; z is upwards where it is one of them.
    fn of(scenes: &[(&Shown, &Scene)]) -> Self {
        let mut ranges = [[f64::INFINITY, f64::NEG_INFINITY]; 3];
        let mut pressed = [0.0; 3];
        for (_, scene) in scenes {
            for point in scene.bodies.iter().flat_map(|body| &body.position.0) {
                for (range, place) in ranges.iter_mut().zip(point) {
                    *range = [range[0].min(*place), range[1].max(*place)];
                }
            }
            for force in contacts(scene).flat_map(|contact| &contact.force.0) {
                pressed.iter_mut().zip(force).for_each(|(most, force): (&mut f64, _)| *most = most.max(force.abs()));
            }
        }
        let share = |all: [f64; 3]| {
            let most = all.into_iter().fold(f64::MIN_POSITIVE, f64::max);
            all.map(|one| one / most)
        };
        let (moved, pressed) = (share(ranges.map(|[low, high]| (high - low).max(0.0))), share(pressed));
        let mut order = [2, 0, 1];
        order.sort_by(|&a, &b| (moved[b] + pressed[b]).total_cmp(&(moved[a] + pressed[a])));
        let [one, other] = [order[0].min(order[1]), order[0].max(order[1])];
        Self { across: one, up: other }
    }

    fn seen(&self, point: [f64; 3]) -> [f64; 2] {
        [point[self.across], point[self.up]]
    }

    /// Along what other bodies slide.
    fn guides(&self, scene: &Scene, frame: usize) -> Vec<Series> {
        scene.bodies.iter().flat_map(|body| self.body(body, frame, true)).collect()
    }

    /// A scene at a frame without rails and forces: walls, bodies, then springs.
    fn pose(&self, scene: &Scene, frame: usize) -> Vec<Series> {
        let wall = |wall: &Wall| {
            let corner = |index: usize| {
                let side = |axis: usize| if index >> axis & 1 == 1 { 0.5 } else { -0.5 };
                let [a, b, thick] = wall.size;
                let corner = [side(0) * a, side(1) * b, (side(2) - 0.5) * thick];
                placed(corner, wall.rotation, at(&wall.position.0, frame))
            };
            let style = Style { width: 0.4, ..Style::area(Colour::Grey, 0.45) };
            Series::named("wall", style, self.outline((0..8).map(corner)))
        };
        let mut series: Vec<Series> = scene.walls.iter().map(wall).collect();
        series.extend(scene.bodies.iter().flat_map(|body| self.body(body, frame, false)));
        for spring in scene.connections.iter().filter(|one| one.kind != ConnectionKind::Contact) {
            let [from, to] = [&spring.from, &spring.to].map(|end| self.seen(at(&end.0, frame)));
            // Springs of joints that turn have no length.
            if (from[0] - to[0]).hypot(from[1] - to[1]) < NO_LENGTH * scene.size {
                continue;
            }
            let style = Style { width: 0.8, dash: Dash::Dotted, ..Style::line(Colour::Green) };
            series.push(Series::named(
                "spring",
                style,
                Shape::Line { x: vec![from[0], to[0]], y: vec![from[1], to[1]] },
            ));
        }
        series
    }

    /// Contact forces at a frame; the length of an arrow is that of 1 N.
    fn forces(&self, scene: &Scene, frame: usize, length: f64, label: &str) -> Vec<Series> {
        let arrow = |contact: &Connection| {
            let (tip, force) = (at(&contact.to.0, frame), at(&contact.force.0, frame));
            let from = [0, 1, 2].map(|axis| tip[axis] - length * force[axis]);
            let [from, tip] = [from, tip].map(|point| self.seen(point));
            let style = Style { width: 1.2, ..Style::line(Colour::Vermilion) };
            Series::named(label, style, Shape::Arrow { x: [from[0], tip[0]], y: [from[1], tip[1]] })
        };
        contacts(scene).map(arrow).collect()
    }

    /// The simple shapes of a body: those that only guide others, or the rest.
    fn body(&self, body: &Body, frame: usize, guides: bool) -> Vec<Series> {
        let (position, rotation) = (at(&body.position.0, frame), at(&body.rotation.0, frame));
        let shape = |shape: &supple::scene::Shape| {
            let points = corners(shape.solid)
                .into_iter()
                .map(|corner| placed(placed(corner, shape.rotation, shape.position), rotation, position));
            // Along guides, other bodies slide.
            let opacity = if shape.guide { 0.06 } else { 0.25 };
            let style = Style { width: if shape.guide { 0.25 } else { 0.5 }, ..Style::area(Colour::Blue, opacity) };
            Series::plain(style, self.outline(points))
        };
        body.shapes.iter().filter(|shape| shape.guide == guides).map(shape).collect()
    }

    /// The outline of points as they are seen.
    fn outline(&self, points: impl Iterator<Item = [f64; 3]>) -> Shape {
        let (x, y) = hull(points.map(|point| self.seen(point)).collect()).into_iter().map(|[x, y]| (x, y)).unzip();
        Shape::Outline { x, y }
    }
}

fn contacts(scene: &Scene) -> impl Iterator<Item = &Connection> {
    scene.connections.iter().filter(|connection| connection.kind == ConnectionKind::Contact)
}

/// Norms of the forces of all contacts at all times.
fn strengths(scene: &Scene) -> impl Iterator<Item = f64> {
    contacts(scene).flat_map(|contact| &contact.force.0).map(|force| force.iter().map(|f| f * f).sum::<f64>().sqrt())
}

/// An entry over time; the last one where there are fewer.
fn at<const N: usize>(track: &[[f64; N]], frame: usize) -> [f64; N] {
    track.get(frame).or(track.last()).copied().unwrap_or([f64::NAN; N])
}

/// A point turned by a unit quaternion `w, x, y, z` and moved.
fn placed(point: [f64; 3], [w, x, y, z]: [f64; 4], position: [f64; 3]) -> [f64; 3] {
    let cross =
        |a: [f64; 3], b: [f64; 3]| [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    // p + 2 w (v x p) + 2 v x (v x p), with the vector part v.
    let first = cross([x, y, z], point);
    let second = cross([x, y, z], first);
    [0, 1, 2].map(|axis| point[axis] + 2.0 * (w * first[axis] + second[axis]) + position[axis])
}

/// Points whose hull is a solid, to the corners of its circles.
fn corners(solid: Solid) -> Vec<[f64; 3]> {
    let angle = |index: usize| std::f64::consts::TAU * index as f64 / ROUND as f64;
    let ball = |radius: f64, height: f64| {
        let ring = move |up: usize| {
            let (sin, cos) = (angle(up) / 2.0 - std::f64::consts::FRAC_PI_2).sin_cos();
            (0..ROUND).map(move |index| {
                let (y, x) = angle(index).sin_cos();
                [radius * cos * x, radius * cos * y, height + radius * sin]
            })
        };
        (0..=ROUND).flat_map(ring).collect::<Vec<_>>()
    };
    match solid {
        Solid::Box { size } => (0..8)
            .map(|index: usize| [0, 1, 2].map(|axis| if index >> axis & 1 == 1 { 0.5 } else { -0.5 } * size[axis]))
            .collect(),
        Solid::Sphere { radius } => ball(radius, 0.0),
        Solid::Ellipsoid { radii } => {
            ball(1.0, 0.0).into_iter().map(|corner| [0, 1, 2].map(|axis| radii[axis] * corner[axis])).collect()
        }
        Solid::Capsule { radius, length } => [ball(radius, -0.5 * length), ball(radius, 0.5 * length)].concat(),
        Solid::Cylinder { radius, length } => {
            let rim = |height: f64| {
                (0..ROUND).map(move |index| {
                    let (y, x) = angle(index).sin_cos();
                    [radius * x, radius * y, height]
                })
            };
            rim(-0.5 * length).chain(rim(0.5 * length)).collect()
        }
    }
}

/// The convex hull of points, counterclockwise (Andrew's monotone chain).
fn hull(mut points: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
    points.retain(|[x, y]| x.is_finite() && y.is_finite());
    points.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    points.dedup();
    if points.len() < 3 {
        return points;
    }
    let turns_right =
        |a: [f64; 2], b: [f64; 2], c: [f64; 2]| (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]) <= 0.0;
    let half = |points: &mut dyn Iterator<Item = [f64; 2]>| {
        let mut chain: Vec<[f64; 2]> = Vec::new();
        for point in points {
            while chain.len() > 1 && turns_right(chain[chain.len() - 2], chain[chain.len() - 1], point) {
                chain.pop();
            }
            chain.push(point);
        }
        chain.pop();
        chain
    };
    let mut hull = half(&mut points.iter().copied());
    hull.extend(half(&mut points.iter().rev().copied()));
    hull
}

fn abscissae(shape: &Shape) -> &[f64] {
    match shape {
        Shape::Outline { x, .. } | Shape::Line { x, .. } => x,
        Shape::Arrow { x, .. } => x,
        _ => &[],
    }
}

fn ordinates(shape: &Shape) -> &[f64] {
    match shape {
        Shape::Outline { y, .. } | Shape::Line { y, .. } => y,
        Shape::Arrow { y, .. } => y,
        _ => &[],
    }
}

/// Ranges of two axes with equal scales and some margin; and the ratio of height to width,
/// between a half and two.
fn square(x: &[f64], y: &[f64]) -> ([f64; 2], [f64; 2], f64) {
    let range = |values: &[f64]| {
        let finite = values.iter().copied().filter(|value| value.is_finite());
        let (low, high) = finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
        if low <= high { [0.5 * (low + high), high - low] } else { [0.0, 1.0] }
    };
    let ([x, wide], [y, high]) = (range(x), range(y));
    let wide = 1.08 * wide.max(1e-6);
    let high = 1.08 * high.max(1e-6);
    let aspect = (high / wide).clamp(0.5, 2.0);
    let (wide, high) = if high / wide > aspect { (high / aspect, high) } else { (wide, wide * aspect) };
    ([x - 0.5 * wide, x + 0.5 * wide], [y - 0.5 * high, y + 0.5 * high], aspect)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hulls_go_around_all_points() {
        let points = vec![[0.0, 0.0], [2.0, 0.0], [1.0, 0.5], [2.0, 1.0], [0.0, 1.0], [0.0, 1.0], [1.0, f64::NAN]];
        assert_eq!(hull(points), [[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [0.0, 1.0]]);
    }

    #[test]
    fn solids_are_turned_and_moved() {
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let found = placed([1.0, 0.0, 0.0], [half, 0.0, 0.0, half], [0.0, 0.0, 3.0]);
        assert!((found[0].abs() + (found[1] - 1.0).abs() + (found[2] - 3.0).abs()) < 1e-12, "{found:?}");
        let widest = |solid: Solid| corners(solid).into_iter().map(|corner| corner[2]).fold(0.0, f64::max);
        assert!((widest(Solid::Capsule { radius: 0.1, length: 1.0 }) - 0.6).abs() < 1e-12);
        assert!((widest(Solid::Cylinder { radius: 0.1, length: 1.0 }) - 0.5).abs() < 1e-12);
    }

    #[test]
    fn a_metre_is_as_long_on_both_axes() {
        let (x, y, aspect) = square(&[0.0, 1.0], &[0.0, 0.1]);
        assert!(((y[1] - y[0]) / (x[1] - x[0]) - aspect).abs() < 1e-12 && (aspect - 0.5).abs() < 1e-12);
        assert!(x[0] < 0.0 && x[1] > 1.0 && y[0] < 0.0 && y[1] > 0.1);
    }
}
