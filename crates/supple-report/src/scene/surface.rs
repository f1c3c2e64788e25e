/// A surface of triangles, m.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Surface {
    pub vertices: Vec<[f32; 3]>,
    /// Three places of vertices each.
    pub faces: Vec<[u32; 3]>,
}

impl Surface {
    /// Adds another surface.
    pub fn add(&mut self, other: Surface) {
        let first = self.vertices.len() as u32;
        self.vertices.extend(other.vertices);
        self.faces.extend(other.faces.iter().map(|face| face.map(|place| first + place)));
    }

    /// Stretches, turns by a unit quaternion `w, x, y, z`, and shifts.
    pub fn placed(mut self, scale: [f64; 3], rotation: [f64; 4], position: [f64; 3]) -> Self {
        for vertex in &mut self.vertices {
            let stretched = [0, 1, 2].map(|i| f64::from(vertex[i]) * scale[i]);
            let turned = turned(rotation, stretched);
            *vertex = [0, 1, 2].map(|i| (turned[i] + position[i]) as f32);
        }
        // A mirror turns surfaces inside out.
        if scale.iter().product::<f64>() < 0.0 {
            self.faces.iter_mut().for_each(|face| face.swap(1, 2));
        }
        self
    }

    /// Whether all numbers are finite and all faces lead to vertices.
    pub fn is_sound(&self) -> bool {
        let count = self.vertices.len();
        self.vertices.iter().flatten().all(|entry| entry.is_finite())
            && self.faces.iter().flatten().all(|&place| (place as usize) < count)
    }
}

/// `v`, turned by a unit quaternion.
fn turned([w, x, y, z]: [f64; 4], v: [f64; 3]) -> [f64; 3] {
    let cross =
        |a: [f64; 3], b: [f64; 3]| [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    let axis = [x, y, z];
    let once = cross(axis, v);
    let twice = cross(axis, once);
    [0, 1, 2].map(|i| v[i] + 2.0 * (w * once[i] + twice[i]))
}
