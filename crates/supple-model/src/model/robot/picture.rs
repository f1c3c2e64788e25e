//! How a robot is drawn: its meshes and other visual shapes, and the line skeleton of links without.

use supple_robot::vector::{add, dot, scale, sub};
use supple_robot::{Joint, JointKind, JointNumbers, Link, Numbers};

use super::Robot;
use crate::Point;
use crate::model::bodies::Situation;
use crate::model::compliance::{Drawn, Element, Native};
use crate::scene::{
    Landmark, LandmarkKind, MeshFile, Picture, PlacedBody, PlacedConnection, Pose, Shape, Solid, quaternion, turned_to,
};

/// Radius of the lines of a skeleton, relative to the size of the robot.
const LINE: f64 = 0.006;
/// Radius of the mark of a joint, relative to that of lines.
const JOINT: f64 = 2.0;
/// Radius of rails, and of lines to frames of links that carry others, relative to that of lines.
const BRANCH: f64 = 0.6;
/// Points closer together than this many line radii are drawn as one.
const NEAR: f64 = 2.0;
/// Greatest number of points whose uncertainty is drawn.
const MOST_LANDMARKS: usize = 12;

/// A typical length of a robot, m: the greatest distance of an end from the root with all joints stretched.
fn size(robot: &supple_robot::Robot, numbers: &Numbers<f64>) -> f64 {
    let mut reach = vec![0.0_f64];
    for (joint, numbers) in robot.joints.iter().zip(&numbers.joints) {
        reach.push(reach[joint.parent] + length(numbers.origin.position) + length(numbers.child_pose.position));
    }
    let ends = robot.frames.iter().map(|frame| reach[frame.link] + length(frame.pose.position));
    let size = ends.chain(reach.iter().copied()).fold(0.0, f64::max);
    // If all joints coincide, the size is 0; use a few decimetres instead.
    if size > 0.0 && size.is_finite() { size } else { 0.3 }
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

/// The rail of a prismatic joint in its parent link: its range of travel, if limited.
fn rail(joint: &Joint, numbers: &JointNumbers<f64>, radius: f64) -> Option<Shape> {
    let ends = [joint.limits.lower, joint.limits.upper].map(|end| end - joint.reference);
    let is_drawn = joint.kind == JointKind::Prismatic && ends.iter().all(|end| end.is_finite()) && ends[0] < ends[1];
    let along = numbers.origin.rotate(joint.axis);
    let [from, to] = ends.map(|end| add(numbers.origin.position, scale(end, along)));
    is_drawn.then(|| Shape { guide: true, ..capsule(from, to, radius) })
}

/// Whether a link has a look of its own.
fn is_seen(link: &Link) -> bool {
    !(link.meshes.is_empty() && link.primitives.is_empty())
}

/// How long a solid is, m, up to a factor of the square root of 3.
fn largest(solid: Solid) -> f64 {
    let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    axes.into_iter().map(|axis| 2.0 * solid.reach(axis)).fold(0.0, f64::max)
}

impl Robot {
    /// Frames whose uncertainty is drawn: those of the compliance, and the end links of the robot, if they move.
    fn tracked(&self) -> Vec<usize> {
        let robot = &self.bodies.robot;
        let is_end = |link: &usize| robot.joints.iter().all(|joint| joint.parent != *link);
        let ends = (0..robot.links.len()).filter(is_end);
        let of_compliance = self.compliance.iter().flat_map(|element| element.kind.frames());
        let mut frames: Vec<usize> = Vec::new();
        for frame in of_compliance.chain(ends) {
            if self.bodies.tree.body_of(self.bodies.link_of(frame)).is_some() && !frames.contains(&frame) {
                frames.push(frame);
            }
        }
        frames.truncate(MOST_LANDMARKS);
        frames
    }

    /// What stands in for a link that has meshes, or no visual shapes; and the shapes, if it has any.
    fn shapes(&self, at: &Point<f64>, numbers: &Numbers<f64>, size: f64, link: usize) -> Vec<Shape> {
        let described = &self.bodies.robot.links[link];
        let moves = self.bodies.tree.body_of(link).is_some();
        let real = described.primitives.iter().map(|primitive| Shape {
            real: true,
            // A floor is much larger than the robot on it.
            guide: !moves && largest(primitive.solid) > size,
            ..Shape::placed(&primitive.pose, primitive.solid)
        });
        let mut shapes: Vec<Shape> = real.collect();
        let links = &self.bodies.robot.links;
        // The world is seen by what is in it.
        let is_world = link == 0 && described.inertia.is_none() && links.iter().any(is_seen);
        if !is_world && (shapes.is_empty() || !described.meshes.is_empty()) {
            shapes.extend(self.skeleton(at, numbers, LINE * size, link));
        }
        shapes
    }

    /// The line skeleton of a link: lines from its joint to the next joints and to its frames, rails of prismatic joints
    /// on it, and a mark at its joint. The line of an end link without frames ends at its centre of mass.
    fn skeleton(&self, at: &Point<f64>, numbers: &Numbers<f64>, line: f64, link: usize) -> Vec<Shape> {
        let robot = &self.bodies.robot;
        let joint = link.checked_sub(1);
        let moved = joint.map_or(Pose::IDENTITY, |joint| numbers.joints[joint].child_pose.inverse());
        let start = moved.position;
        let next = robot.joints.iter().zip(&numbers.joints).filter(|(joint, _)| joint.parent == link);
        let next: Vec<([f64; 3], f64)> = next.map(|(_, numbers)| (numbers.origin.position, line)).collect();
        let of_frames = if next.is_empty() { line } else { BRANCH * line };
        let frames = self.marked().map(|frame| self.bodies.place(frame, at)).filter(|place| place.link == link);
        let frames: Vec<([f64; 3], f64)> = frames.map(|place| (place.pose.position, of_frames)).collect();
        let is_far = |from: [f64; 3], to: [f64; 3]| length(sub(to, from)) > NEAR * line;
        let mut ends: Vec<([f64; 3], f64)> = Vec::new();
        for &(end, radius) in next.iter().chain(&frames) {
            if is_far(start, end) && ends.iter().all(|&(other, _)| is_far(other, end)) {
                ends.push((end, radius));
            }
        }
        let own = &numbers.links[link];
        if next.is_empty() && ends.is_empty() && own.mass > 0.0 && is_far(start, own.center) {
            ends.push((own.center, line));
        }
        let mut shapes: Vec<Shape> = ends.iter().map(|&(end, radius)| capsule(start, end, radius)).collect();
        let slides = robot.joints.iter().zip(&numbers.joints).filter(|(joint, _)| joint.parent == link);
        shapes.extend(slides.filter_map(|(joint, numbers)| rail(joint, numbers, BRANCH * line)));
        let mark = JOINT * line;
        match joint.map(|joint| &robot.joints[joint]).filter(|joint| joint.kind != JointKind::Fixed) {
            Some(joint) => {
                let pose = Pose { rotation: turned_to(moved.rotate(joint.axis)), position: start };
                let solid = match joint.kind {
                    JointKind::Prismatic => Solid::Box { size: [1.6 * mark, 1.6 * mark, 3.0 * mark] },
                    _ => Solid::Cylinder { radius: mark, length: 2.0 * mark },
                };
                shapes.push(Shape::placed(&pose, solid));
            }
            None if shapes.is_empty() => shapes.push(Shape::at(start, Solid::Sphere { radius: line })),
            None => {}
        }
        shapes
    }

    /// Frames that belong to the drawing: those of the robot's file and of compliance.
    fn marked(&self) -> impl Iterator<Item = usize> + '_ {
        let links = self.bodies.robot.links.len();
        (links..links + self.bodies.robot.frames.len())
            .chain(self.compliance.iter().flat_map(|element| element.kind.frames()))
    }

    /// The picture of the robot at a point.
    pub(super) fn draw(&self, at: &Point<f64>) -> Picture {
        let now = Situation::of(&self.bodies, at);
        let size = size(&self.bodies.robot, &now.numbers);
        let balls: Vec<_> =
            self.compliance.iter().filter_map(|element| element.kind.ball(&element.own(&now))).collect();
        let balls_of = |link: usize| {
            let placed = balls.iter().map(|&(frame, radius)| (self.bodies.place(frame, at), radius));
            let own = placed.filter(move |(place, _)| place.link == link);
            own.map(|(place, radius)| Shape { real: true, ..Shape::placed(&place.pose, Solid::Sphere { radius }) })
        };
        let bodies = self.bodies.robot.links.iter().enumerate().map(|(link, described)| PlacedBody {
            name: described.name.clone(),
            shapes: self.shapes(at, &now.numbers, size, link).into_iter().chain(balls_of(link)).collect(),
            meshes: described.meshes.iter().map(mesh).collect(),
            pose: now.kinematics.poses()[link],
        });
        let connection = |element: &Element| {
            let Drawn { kind, from, to, force, torque } = element.kind.draw(&element.own(&now));
            PlacedConnection { name: element.name.clone(), kind, from, to, force, torque }
        };
        let names = self.bodies.frame_names();
        let points = self.tracked().into_iter();
        let points = points.map(|frame| Landmark { name: names[frame].to_owned(), kind: LandmarkKind::Point });
        let wall = |element: &Element| {
            let own = element.own(&now);
            let (normal, _) = element.kind.over::<f64>().wall(&own)?;
            let touch = element.kind.draw(&own).to;
            Some(Landmark { name: element.name.clone(), kind: LandmarkKind::Wall { normal, touch } })
        };
        Picture {
            size,
            bodies: bodies.collect(),
            connections: self.compliance.iter().map(connection).collect(),
            landmarks: points.chain(self.compliance.iter().filter_map(wall)).collect(),
        }
    }

    /// How many landmarks there are.
    pub(super) fn landmark_count(&self) -> usize {
        self.tracked().len() + self.compliance.iter().filter(|element| element.kind.has_wall()).count()
    }

    /// The positions of the landmarks.
    pub(super) fn mark<S: Native>(&self, at: &Point<S>) -> Vec<[S; 3]> {
        let now = Situation::of(&self.bodies, at);
        let points = self.tracked().into_iter().map(|frame| now.pose(frame).position);
        let walls =
            self.compliance.iter().filter_map(|element| Some(element.kind.over::<S>().wall(&element.own(&now))?.1));
        points.chain(walls).collect()
    }
}

fn mesh(mesh: &supple_robot::Mesh) -> MeshFile {
    MeshFile {
        path: mesh.path.clone(),
        position: mesh.pose.position,
        rotation: quaternion(&mesh.pose.rotation),
        scale: mesh.scale,
    }
}
