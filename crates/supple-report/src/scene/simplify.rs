//! Fewer triangles.

use std::collections::HashMap;

use super::surface::Surface;

/// The surface with at most `most` triangles: vertices in one cell of a grid become their mean (Rossignac and Borrel
/// 1993), with the finest of the tried grids that does. The same for the same surface.
pub fn simplify(surface: Surface, most: usize) -> Surface {
    if surface.faces.len() <= most {
        return surface;
    }
    // A surface of T triangles crosses about T/2 cells, which are a share of cells^2: start above that.
    let mut cells = ((most as f64).sqrt() * 2.0).ceil().max(2.0);
    loop {
        let coarse = cluster(&surface, cells);
        if coarse.faces.len() <= most || cells <= 1.0 {
            return if coarse.faces.len() <= most { coarse } else { Surface::default() };
        }
        cells = (cells * 0.85).floor();
    }
}

/// Vertices merged by the cells of a grid with `cells` cells along the longest edge of the box about the surface.
fn cluster(surface: &Surface, cells: f64) -> Surface {
    let bound = |axis: usize, best: fn(f32, f32) -> f32, from: f32| {
        surface.vertices.iter().map(|vertex| vertex[axis]).fold(from, best)
    };
    let least = [0, 1, 2].map(|axis| bound(axis, f32::min, f32::INFINITY));
    let most = [0, 1, 2].map(|axis| bound(axis, f32::max, f32::NEG_INFINITY));
    let longest = [0, 1, 2].map(|axis| f64::from(most[axis]) - f64::from(least[axis])).into_iter().fold(0.0, f64::max);
    let edge = longest / cells;
    let mut places: HashMap<[u32; 3], u32> = HashMap::new();
    let mut sums: Vec<([f64; 3], f64)> = Vec::new();
    let mut new_place = Vec::with_capacity(surface.vertices.len());
    for vertex in &surface.vertices {
        let cell = [0, 1, 2].map(|axis| ((f64::from(vertex[axis]) - f64::from(least[axis])) / edge) as u32);
        let place = *places.entry(cell).or_insert_with(|| {
            sums.push(([0.0; 3], 0.0));
            sums.len() as u32 - 1
        });
        let (sum, count) = &mut sums[place as usize];
        sum.iter_mut().zip(vertex).for_each(|(sum, &entry)| *sum += f64::from(entry));
        *count += 1.0;
        new_place.push(place);
    }
    let mut seen = std::collections::HashSet::new();
    let faces = surface.faces.iter().map(|face| face.map(|place| new_place[place as usize]));
    let faces = faces.filter(|&[a, b, c]| a != b && b != c && c != a).filter(|face| {
        let mut sorted = *face;
        sorted.sort_unstable();
        seen.insert(sorted)
    });
    let faces = faces.collect();
    let vertices = sums.iter().map(|(sum, count)| sum.map(|sum| (sum / count) as f32)).collect();
    Surface { vertices, faces }
}
