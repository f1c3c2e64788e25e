//! What a robot looks like: its meshes, or shapes made up from where its joints are.

use nalgebra::{Matrix3, SymmetricEigen};
use supple_kernels::Scalar;
use supple_robot::vector::{dot, sub};
use supple_robot::{JointKind, LinkNumbers, Numbers};

use super::compliance::{Compliance, Drawn, Element};
use super::situation::Situation;
use super::{Point, Robot};
use crate::scene::{
    Landmark, LandmarkKind, MeshFile, Picture, PlacedBody, PlacedConnection, Pose, Shape, Solid, quaternion, turned_to,
};

/// Radius of the first link, relative to the size of the robot.
const RADIUS: f64 = 0.04;
/// Radius of the last link, relative to that of the first.
const TAPER: f64 = 0.5;
/// Radius of what carries the robot and of ribs of plates, relative to that of the first link.
const THIN: f64 = 0.35;
/// Links shorter than this, relative to their radius, are not drawn as capsules.
const SHORT: f64 = 0.5;
/// A link is a plate where its least dimension is at most this share of the next.
const FLAT: f64 = 0.3;
/// How many points have their uncertainty drawn.
const MOST_LANDMARKS: usize = 12;

/// How wide the links are drawn.
struct Widths {
    /// Radius of the first link, m.
    radius: f64,
    /// By link, how many joints are between it and the root.
    depth: Vec<usize>,
    deepest: usize,
    size: f64,
}

impl Widths {
    fn of(robot: &supple_robot::Robot, numbers: &Numbers<f64>) -> Self {
        let (mut depth, mut reach) = (vec![0], vec![0.0_f64]);
        for (joint, numbers) in robot.joints.iter().zip(&numbers.joints) {
            let moves = usize::from(joint.kind != JointKind::Fixed);
            depth.push(depth[joint.parent] + moves);
            reach.push(reach[joint.parent] + length(numbers.origin.position) + length(numbers.child_pose.position));
        }
        let ends = robot.frames.iter().map(|frame| reach[frame.link] + length(frame.pose.position));
        let size = ends.chain(reach.iter().copied()).fold(0.0, f64::max);
        // A robot all of whose joints are in one place has no size; it moves by some decimetres then.
        let size = if size > 0.0 && size.is_finite() { size } else { 0.3 };
        let deepest = depth.iter().copied().max().unwrap_or(0).max(1);
        Self { radius: RADIUS * size, depth, deepest, size }
    }

    fn radius(&self, link: usize) -> f64 {
        self.radius * (1.0 - (1.0 - TAPER) * self.depth[link] as f64 / self.deepest as f64)
    }
}

fn length(v: [f64; 3]) -> f64 {
    dot(v, v).sqrt()
}

/// A capsule between two points.
fn capsule(from: [f64; 3], to: [f64; 3], radius: f64) -> Shape {
    let along = sub(to, from);
    let middle = [0, 1, 2].map(|i| 0.5 * (from[i] + to[i]));
    let pose = Pose { rotation: turned_to(along), position: middle };
    Shape::placed(&pose, Solid::Capsule { radius, length: length(along) })
}

/// The box of even density that has the inertia of a link, where that is a flat one: a door, not an arm.
fn plate(link: &LinkNumbers<f64>) -> Option<Shape> {
    let [a, b, c] = link.moment;
    let moment = Matrix3::new(a[0], a[1], a[2], a[1], b[1], b[2], a[2], b[2], c[2]);
    if link.mass.is_nan() || link.mass <= 0.0 || moment.iter().any(|entry| !entry.is_finite()) {
        return None;
    }
    let SymmetricEigen { eigenvalues: principal, eigenvectors: mut axes } = SymmetricEigen::new(moment);
    if axes.determinant() < 0.0 {
        axes.column_mut(0).neg_mut();
    }
    // Of a box with edges a, b, c the moment about a is m/12 (b^2 + c^2).
    let sum: f64 = principal.iter().sum();
    let size = [0, 1, 2].map(|i| (6.0 / link.mass * (sum - 2.0 * principal[i])).max(0.0).sqrt());
    let mut sorted = size;
    sorted.sort_by(f64::total_cmp);
    let rotation = [0, 1, 2].map(|row| [0, 1, 2].map(|column| axes[(row, column)]));
    let pose = Pose { rotation, position: link.center };
    (sorted[1] > 0.0 && sorted[0] <= FLAT * sorted[1]).then(|| {
        // A box without any thickness could not be seen from the side.
        let size = size.map(|edge| edge.max(0.02 * sorted[2]));
        Shape::placed(&pose, Solid::Box { size })
    })
}

impl Robot {
    /// Frames whose uncertainty is drawn: those of the compliance, and the ends of the robot, as far as they move.
    fn tracked(&self) -> Vec<usize> {
        let robot = &self.robot;
        let is_end = |link: &usize| robot.joints.iter().all(|joint| joint.parent != *link);
        let ends = (0..robot.links.len()).filter(is_end);
        let of_compliance = self.compliance.iter().flat_map(|element| element.kind.frames());
        let mut frames: Vec<usize> = Vec::new();
        for frame in of_compliance.chain(ends) {
            if self.tree.body_of(self.link_of(frame)).is_some() && !frames.contains(&frame) {
                frames.push(frame);
            }
        }
        frames.truncate(MOST_LANDMARKS);
        frames
    }

    /// What to draw of a link without meshes: capsules from its joint to the next ones and to its frames, its joint,
    /// and at an end a ball.
    fn shapes(&self, at: &Point<f64>, numbers: &Numbers<f64>, widths: &Widths, link: usize) -> Vec<Shape> {
        let robot = &self.robot;
        let joint = link.checked_sub(1);
        let moved = joint.map_or(Pose::IDENTITY, |joint| numbers.joints[joint].child_pose.inverse());
        let start = moved.position;
        let plate = self.tree.body_of(link).and_then(|_| plate(&numbers.links[link]));
        let full = widths.radius(link);
        let thin = plate.is_some() || self.tree.body_of(link).is_none();
        let radius = if thin { THIN * full } else { full };
        let children = robot.joints.iter().zip(&numbers.joints).filter(|(joint, _)| joint.parent == link);
        let children = children.map(|(_, numbers)| (numbers.origin.position, radius));
        let frames = self.marked().map(|frame| self.place(frame, at)).filter(|place| place.link == link);
        let frames = frames.map(|place| (place.pose.position, THIN * full));
        let long = |&(end, radius): &([f64; 3], f64)| length(sub(end, start)) > SHORT * radius;
        let mut shapes: Vec<Shape> = plate.into_iter().collect();
        let mut ends: Vec<([f64; 3], f64)> = Vec::new();
        for (end, radius) in children.chain(frames).filter(long) {
            if ends.iter().all(|(other, _)| length(sub(*other, end)) > SHORT * radius) {
                ends.push((end, radius));
            }
        }
        shapes.extend(ends.iter().map(|&(end, radius)| capsule(start, end, radius)));
        match joint.map(|joint| &robot.joints[joint]).filter(|joint| joint.kind != JointKind::Fixed) {
            Some(joint) => {
                let axis = turned_to(moved.rotate(joint.axis));
                let radius = if plate_is(&shapes) { THIN * full } else { full };
                let solid = match joint.kind {
                    JointKind::Prismatic => Solid::Box { size: [1.8 * radius, 1.8 * radius, 0.5 * radius] },
                    _ => Solid::Cylinder { radius: 1.2 * radius, length: 2.4 * radius },
                };
                shapes.push(Shape::placed(&Pose { rotation: axis, position: start }, solid));
            }
            None if shapes.is_empty() => shapes.push(Shape::at(start, Solid::Sphere { radius: 0.45 * full })),
            None => {}
        }
        shapes
    }

    /// Frames that belong to the drawing: those of the robot's file and of compliance.
    fn marked(&self) -> impl Iterator<Item = usize> + '_ {
        let links = self.robot.links.len();
        (links..links + self.robot.frames.len()).chain(self.compliance.iter().flat_map(|element| element.kind.frames()))
    }

    /// What it looks like at a point.
    pub(super) fn draw(&self, at: &Point<f64>) -> Picture {
        let now = Situation::of(self, at);
        let widths = Widths::of(&self.robot, &now.numbers);
        let bodies = self.robot.links.iter().enumerate().map(|(link, described)| PlacedBody {
            name: described.name.clone(),
            shapes: self.shapes(at, &now.numbers, &widths, link),
            meshes: described.meshes.iter().map(mesh).collect(),
            pose: now.kinematics.poses()[link],
        });
        let connection = |element: &Element| {
            let Drawn { kind, from, to, force, torque } = element.kind.draw(&now.seen_by(element));
            PlacedConnection { name: element.name.clone(), kind, from, to, force, torque }
        };
        let names = self.frame_names();
        let points = self.tracked().into_iter();
        let points = points.map(|frame| Landmark { name: names[frame].to_owned(), kind: LandmarkKind::Point });
        let wall = |element: &Element| {
            let own = now.seen_by(element);
            let (normal, _) = element.kind.wall(&own)?;
            let touch = element.kind.draw(&own).to;
            Some(Landmark { name: element.name.clone(), kind: LandmarkKind::Wall { normal, touch } })
        };
        Picture {
            size: widths.size,
            bodies: bodies.collect(),
            connections: self.compliance.iter().map(connection).collect(),
            landmarks: points.chain(self.compliance.iter().filter_map(wall)).collect(),
        }
    }

    /// Where the landmarks are.
    pub(super) fn mark<S: Scalar>(&self, at: &Point<S>) -> Vec<[S; 3]> {
        let now = Situation::of(self, at);
        let points = self.tracked().into_iter().map(|frame| now.pose(frame).position);
        let walls = self.compliance.iter().filter_map(|element| Some(element.kind.wall(&now.seen_by(element))?.1));
        points.chain(walls).collect()
    }
}

/// Whether the first shape is the box of a plate.
fn plate_is(shapes: &[Shape]) -> bool {
    shapes.first().is_some_and(|shape| matches!(shape.solid, Solid::Box { .. }))
}

fn mesh(mesh: &supple_robot::Mesh) -> MeshFile {
    MeshFile {
        path: mesh.path.clone(),
        position: mesh.pose.position,
        rotation: quaternion(&mesh.pose.rotation),
        scale: mesh.scale,
    }
}
