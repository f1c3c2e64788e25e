//! Assembles the pictures along a plan into tracks: one per body, connection, point and wall.

use supple_kernels::Matrices;
use supple_model::scene::{
    Body, Connection, Landmark, LandmarkKind, MOST_FRAMES, PointBelief, Scene, Seen, Shape, Solid, Track, Wall,
    quaternion, round, turned_to,
};
use supple_model::{Trajectory, time_of};
use supple_robot::vector::{add, dot, scale};

use crate::problem::Task;

/// The scene of a task's plan, given the covariance of the belief at each state; `None` if the model cannot be drawn.
pub(crate) fn film(task: &Task, phi: &[f64], trajectory: &Trajectory, sigma: &Matrices) -> Option<Scene> {
    let steps = frames(trajectory.steps());
    let idle = vec![0.0; trajectory.controls.rows()];
    let see = |&t: &usize| {
        let u = if t < trajectory.steps() { trajectory.controls.vector(t) } else { &idle };
        task.system.picture(trajectory.states.vector(t), u, phi)
    };
    let seen: Vec<Seen> = steps.iter().map(see).collect::<Option<_>>()?;
    let first = seen.first()?;
    let dt = task.time_step.resolve::<f64>(phi);
    let mut size = first.picture.size;
    round(std::slice::from_mut(&mut size));
    let mut scene = Scene {
        time: Track::new(steps.iter().map(|&t| [time_of(t, dt)]).collect()),
        size,
        bodies: (0..first.picture.bodies.len()).map(|body| film_body(&seen, body)).collect(),
        connections: (0..first.picture.connections.len()).map(|index| film_connection(&seen, index)).collect(),
        ..Scene::default()
    };
    for (index, landmark) in first.picture.landmarks.iter().enumerate() {
        let known: Vec<_> = seen.iter().zip(&steps).map(|(seen, &t)| covariance(seen, index, sigma, t)).collect();
        match landmark.kind {
            LandmarkKind::Point => scene.beliefs.push(film_point(&seen, index, landmark, &known)),
            LandmarkKind::Wall { normal, .. } => {
                scene.walls.push(film_wall(&seen, index, landmark, normal, &known));
            }
        }
    }
    Some(scene)
}

/// The steps that are shown: all of 0 to N, or [`MOST_FRAMES`] of them, evenly spaced up to rounding.
fn frames(steps: usize) -> Vec<usize> {
    let gaps = steps.min(MOST_FRAMES - 1);
    (0..=gaps).map(|frame| (frame * steps + gaps / 2).checked_div(gaps).unwrap_or(0)).collect()
}

fn film_body(seen: &[Seen], index: usize) -> Body {
    let placed = || seen.iter().map(move |seen| &seen.picture.bodies[index]);
    let first = &seen[0].picture.bodies[index];
    let mut rotations: Vec<[f64; 4]> = placed().map(|body| quaternion(&body.pose.rotation)).collect();
    // Of the two quaternions of each rotation, take the one nearer to the previous, so that interpolation is correct.
    for frame in 1..rotations.len() {
        let before = rotations[frame - 1];
        if before.iter().zip(rotations[frame]).map(|(a, b)| a * b).sum::<f64>() < 0.0 {
            rotations[frame] = rotations[frame].map(|entry| -entry);
        }
    }
    Body {
        name: first.name.clone(),
        shapes: first.shapes.iter().map(rounded).collect(),
        meshes: first.meshes.clone(),
        position: Track::new(placed().map(|body| body.pose.position).collect()),
        rotation: Track::new(rotations),
    }
}

fn rounded(shape: &Shape) -> Shape {
    let mut shape = *shape;
    round(&mut shape.position);
    round(&mut shape.rotation);
    match &mut shape.solid {
        Solid::Box { size: lengths } | Solid::Ellipsoid { radii: lengths } => round(lengths),
        Solid::Sphere { radius } => round(std::slice::from_mut(radius)),
        Solid::Cylinder { radius, length } | Solid::Capsule { radius, length } => {
            round(std::slice::from_mut(radius));
            round(std::slice::from_mut(length));
        }
    }
    shape
}

fn film_connection(seen: &[Seen], index: usize) -> Connection {
    let all = || seen.iter().map(move |seen| &seen.picture.connections[index]);
    let first = &seen[0].picture.connections[index];
    Connection {
        name: first.name.clone(),
        kind: first.kind,
        from: Track::new(all().map(|connection| connection.from).collect()),
        to: Track::new(all().map(|connection| connection.to).collect()),
        force: Track::new(all().map(|connection| connection.force).collect()),
        torque: Track::new(all().map(|connection| connection.torque).collect()),
    }
}

/// `J Sigma J'` of a landmark at a step.
fn covariance(seen: &Seen, index: usize, sigma: &Matrices, t: usize) -> [[f64; 3]; 3] {
    let jacobian = &seen.jacobians[index];
    let n = sigma.rows();
    let mut out = [[0.0; 3]; 3];
    for (row, out) in jacobian.iter().zip(&mut out) {
        let spread: Vec<f64> = (0..n).map(|b| (0..n).map(|a| row[a] * sigma.get(t, a, b)).sum()).collect();
        for (other, out) in jacobian.iter().zip(out) {
            *out = spread.iter().zip(other).map(|(spread, other)| spread * other).sum();
        }
    }
    out
}

fn film_point(seen: &[Seen], index: usize, landmark: &Landmark, known: &[[[f64; 3]; 3]]) -> PointBelief {
    PointBelief {
        name: landmark.name.clone(),
        position: Track::new(seen.iter().map(|seen| seen.positions[index]).collect()),
        covariance: Track::new(known.iter().map(|c| [c[0][0], c[0][1], c[0][2], c[1][1], c[1][2], c[2][2]]).collect()),
    }
}

/// A plate along the wall that covers all points where it may be touched, with a margin.
fn film_wall(seen: &[Seen], index: usize, landmark: &Landmark, normal: [f64; 3], known: &[[[f64; 3]; 3]]) -> Wall {
    let rotation = turned_to(normal);
    let mut quaternion = quaternion(&rotation);
    round(&mut quaternion);
    let size = seen[0].picture.size;
    let column = |axis: usize| rotation.map(|row| row[axis]);
    let touches = || {
        seen.iter().map(move |seen| match seen.picture.landmarks[index].kind {
            LandmarkKind::Wall { touch, .. } => touch,
            LandmarkKind::Point => seen.positions[index],
        })
    };
    let [(middle_a, length_a), (middle_b, length_b)] = [0, 1].map(|axis| {
        let along = || touches().map(move |touch| dot(touch, column(axis)));
        let (least, most) = (along().fold(f64::INFINITY, f64::min), along().fold(f64::NEG_INFINITY, f64::max));
        (0.5 * (least + most), most - least)
    });
    let mut edges = [length_a + MARGIN * size, length_b + MARGIN * size, THICKNESS * size];
    round(&mut edges);
    let centre = |at: [f64; 3]| {
        let out = scale(dot(at, normal), normal);
        add(out, add(scale(middle_a, column(0)), scale(middle_b, column(1))))
    };
    let deviation = |c: &[[f64; 3]; 3]| [dot(normal, c.map(|row| dot(row, normal))).max(0.0).sqrt()];
    Wall {
        name: landmark.name.clone(),
        position: Track::new(seen.iter().map(|seen| centre(seen.positions[index])).collect()),
        rotation: quaternion,
        size: edges,
        deviation: Track::new(known.iter().map(deviation).collect()),
    }
}

/// How much longer a plate is than the extent of its touched points, relative to the size of the scene.
const MARGIN: f64 = 0.25;
/// Thickness of a plate, relative to the size of the scene.
const THICKNESS: f64 = 0.02;
