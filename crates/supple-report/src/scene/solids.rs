//! Simple shapes as triangles.

use std::f64::consts::{FRAC_PI_2, TAU};

use supple::scene::{Shape, Solid};

use super::surface::Surface;

/// Corners of circles.
const ROUND: usize = 16;
/// Rings of half a ball.
const RINGS: usize = 3;

/// The surface of several shapes.
pub fn surface(shapes: &[Shape]) -> Surface {
    let mut all = Surface::default();
    for shape in shapes {
        let own = match shape.solid {
            Solid::Box { size } => cuboid(size),
            Solid::Sphere { radius } => turned_profile(&capsule(radius, 0.0)),
            Solid::Capsule { radius, length } => turned_profile(&capsule(radius, length)),
            Solid::Ellipsoid { radii } => {
                turned_profile(&capsule(1.0, 0.0)).placed(radii, [1.0, 0.0, 0.0, 0.0], [0.0; 3])
            }
            Solid::Cylinder { radius, length } => {
                let half = 0.5 * length;
                turned_profile(&[(0.0, -half), (radius, -half), (radius, half), (0.0, half)])
            }
        };
        all.add(own.placed([1.0; 3], shape.rotation, shape.position));
    }
    all
}

fn cuboid(size: [f64; 3]) -> Surface {
    let corner = |index: usize| {
        [0, 1, 2].map(|axis| {
            let side = if index >> axis & 1 == 1 { 0.5 } else { -0.5 };
            (side * size[axis]) as f32
        })
    };
    let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let faces = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    Surface { vertices: (0..8).map(corner).collect(), faces }
}

/// Radius and height of the rings of a capsule about z, from below.
fn capsule(radius: f64, length: f64) -> Vec<(f64, f64)> {
    let angles = move || (0..=RINGS).map(|ring| FRAC_PI_2 * ring as f64 / RINGS as f64);
    let upper = move || angles().map(move |angle| (radius * angle.cos(), 0.5 * length + radius * angle.sin()));
    let lower = upper().map(|(radius, height)| (radius, -height)).rev();
    lower.chain(upper()).collect()
}

/// The surface that a profile, of radii and heights from below, sweeps about z. Rings of radius 0 are single points.
fn turned_profile(profile: &[(f64, f64)]) -> Surface {
    let widest = profile.iter().map(|&(radius, _)| radius).fold(0.0, f64::max);
    let mut surface = Surface::default();
    let mut before: Option<(u32, bool)> = None;
    for &(radius, height) in profile {
        let is_point = radius <= 1e-12 * widest;
        let first = surface.vertices.len() as u32;
        let count = if is_point { 1 } else { ROUND };
        for corner in 0..count {
            let (sin, cos) = (TAU * corner as f64 / ROUND as f64).sin_cos();
            let radius = if is_point { 0.0 } else { radius };
            surface.vertices.push([(radius * cos) as f32, (radius * sin) as f32, height as f32]);
        }
        if let Some((below, was_point)) = before {
            for corner in 0..ROUND as u32 {
                let next = (corner + 1) % ROUND as u32;
                let (a, b) = if was_point { (below, below) } else { (below + corner, below + next) };
                let (c, d) = if is_point { (first, first) } else { (first + corner, first + next) };
                if !was_point {
                    surface.faces.push([a, b, d]);
                }
                if !is_point {
                    surface.faces.push([a, d, c]);
                }
            }
        }
        before = Some((first, is_point));
    }
    surface
}
