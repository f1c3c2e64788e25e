//! What the three-dimensional view needs: scenes with their meshes, read and made small.
//!
//! ```text
//! Scene -> surfaces of bodies (files: read.rs, simplify.rs; else shapes: solids.rs) -> JSON -> SuppleScene (SCRIPT)
//! ```

use std::collections::HashMap;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde_json::{Value, json};
use supple::scene::{Body, Scene};

mod dae;
mod files;
mod read;
mod simplify;
mod solids;
mod surface;

use files::Files;
use surface::Surface;

/// The script of the view, which defines `SuppleScene`. It needs plotly.js, as the global `Plotly`.
pub const SCRIPT: &str = concat!(
    include_str!("../../assets/scene_geometry.js"),
    include_str!("../../assets/scene_figure.js"),
    include_str!("../../assets/scene.js"),
);

/// How many triangles of mesh files a scene has at most; more are made fewer.
pub const MOST_TRIANGLES: usize = 20_000;

/// The data of the view, for `SuppleScene.mount(element, data)`: scenes by the name of their design.
///
/// `{ meshes, designs, warnings }`: surfaces of bodies, each there once whoever shares it, with vertices (`f4`) and faces
/// (`u4`) in base64, little-endian; the scenes, whose bodies name their surface by number; and what to tell the reader.
/// Meshes that cannot be read are shown as the simple shapes that the scene has for each body, with a warning.
pub fn data(scenes: &[(&str, &Scene)]) -> Value {
    let mut files = Files::default();
    let mut shared = Shared::default();
    let designs: Vec<Value> = scenes.iter().map(|(name, scene)| design(name, scene, &mut files, &mut shared)).collect();
    json!({ "meshes": shared.list, "designs": designs, "warnings": files.warnings() })
}

/// Surfaces, each once.
#[derive(Default)]
struct Shared {
    list: Vec<Value>,
    places: HashMap<(String, String), usize>,
}

impl Shared {
    fn place(&mut self, surface: &Surface) -> usize {
        let numbers: Vec<u8> = surface.vertices.iter().flatten().flat_map(|entry| entry.to_le_bytes()).collect();
        let places: Vec<u8> = surface.faces.iter().flatten().flat_map(|entry| entry.to_le_bytes()).collect();
        let key = (STANDARD.encode(numbers), STANDARD.encode(places));
        *self.places.entry(key).or_insert_with_key(|(vertices, faces)| {
            self.list.push(json!({ "vertices": vertices, "faces": faces }));
            self.list.len() - 1
        })
    }
}

fn design(name: &str, scene: &Scene, files: &mut Files, shared: &mut Shared) -> Value {
    let share = files.share(scene);
    let body = |body: &Body| {
        let surface = files.surface(body, share).unwrap_or_else(|| solids::surface(&body.shapes));
        json!({
            "name": body.name,
            "mesh": (!surface.faces.is_empty()).then(|| shared.place(&surface)),
            "position": body.position,
            "rotation": body.rotation,
        })
    };
    let bodies: Vec<Value> = scene.bodies.iter().map(body).collect();
    json!({
        "name": name,
        "time": scene.time,
        "size": scene.size,
        "bodies": bodies,
        "connections": scene.connections,
        "beliefs": scene.beliefs,
        "walls": scene.walls,
    })
}
