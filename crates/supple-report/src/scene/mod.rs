//! What the three-dimensional view needs: scenes with their meshes, read and made small.
//!
//! ```text
//! Scene -> surfaces of bodies (files: read.rs, simplify.rs; else shapes: solids.rs) -> JSON -> SuppleScene (SCRIPT)
//! ```
//!
//! # A ball that rises
//!
//! ```
//! use supple::scene::{Body, Scene, Shape, Solid, Track};
//! use supple_report::scene::{SCRIPT, Stage, data, data_of_result};
//!
//! let position = Track::new(vec![[0.0, 0.0, 0.0], [0.0, 0.0, 0.5]]);
//! let rotation = Track::new(vec![[1.0, 0.0, 0.0, 0.0]]);
//! let shapes = vec![Shape::at([0.0; 3], Solid::Sphere { radius: 0.1 })];
//! let body = Body { name: "ball".into(), shapes, position, rotation, ..Body::default() };
//! let time = Track::new(vec![[0.0], [1.0]]);
//! let scene = Scene { time, size: 1.0, bodies: vec![body], ..Scene::default() };
//! let shown = data(&[("design", &scene)]);
//! assert_eq!(shown["designs"][0]["bodies"][0]["name"], "ball");
//! assert!(SCRIPT.contains("SuppleScene"));
//!
//! // The same for an untrusted result, and scene by scene.
//! assert_eq!(data_of_result(&[("design", &scene)], &[]), shown);
//! let mut stage = Stage::default();
//! assert_eq!(stage.design("design", &scene), shown["designs"][0]);
//! assert_eq!(stage.surfaces().len(), 1);
//! ```

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde_json::{Value, json};
use supple::scene::{Body, Scene, Shape};
use supple_file::read_text;
use supple_study::Source;

mod dae;
mod files;
mod read;
mod simplify;
mod solids;
mod surface;

use files::Files;
pub use files::MOST_TRIANGLES;
use surface::Surface;

/// The script of the view, which defines `SuppleScene`. It needs plotly.js, as the global `Plotly`.
///
/// Example: the [module](crate::scene).
pub const SCRIPT: &str = concat!(
    include_str!("../../assets/scene_geometry.js"),
    include_str!("../../assets/scene_figure.js"),
    include_str!("../../assets/scene.js"),
);

/// The data of the view, for `SuppleScene.mount(element, data)`: scenes by the name of their design.
///
/// `{ meshes, designs, warnings }`: surfaces of bodies, stored once even if shared, with vertices (`f4`) and
/// faces (`u4`) in base64, little-endian; the scenes, whose bodies refer to surfaces by index, and how many of a surface's
/// last vertices (`guides`) the view's limits ignore; and warnings for the reader. Instead of unreadable meshes, the view
/// shows the lines and marks that the scene has for each body, with a warning.
///
/// Example: the [module](crate::scene).
#[must_use]
pub fn data(scenes: &[(&str, &Scene)]) -> Value {
    Stage::default().all(scenes)
}

/// Like [`data`], for an untrusted result: meshes are only read from the folders of its `sources`, as long
/// as those files are unchanged, and from the package roots of its task file.
///
/// Example: the [module](crate::scene).
#[must_use]
pub fn data_of_result(scenes: &[(&str, &Scene)], sources: &[Source]) -> Value {
    Stage { files: Files::within(&folders(sources)), ..Stage::default() }.all(scenes)
}

/// Scenes that are shown one after another: surfaces and mesh files are read once, whoever shares them.
///
/// Example: the [module](crate::scene).
#[derive(Default)]
pub struct Stage {
    files: Files,
    shared: Shared,
    /// Surfaces by what they are made of, and how many of their last vertices are of guides; none for bodies without any.
    known: HashMap<String, (Option<usize>, usize)>,
}

impl Stage {
    fn all(mut self, scenes: &[(&str, &Scene)]) -> Value {
        let designs: Vec<Value> = scenes.iter().map(|(name, scene)| self.design(name, scene)).collect();
        json!({ "meshes": self.shared.list, "designs": designs, "warnings": self.warnings() })
    }

    /// One of the `designs` of [`data`]: a scene, whose bodies name their surface among [`surfaces`](Self::surfaces).
    pub fn design(&mut self, name: &str, scene: &Scene) -> Value {
        let share = self.files.share(scene);
        let bodies: Vec<Value> = scene.bodies.iter().map(|body| self.body(body, share)).collect();
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

    /// The `meshes` of [`data`]: all surfaces so far.
    #[must_use]
    pub fn surfaces(&self) -> &[Value] {
        &self.shared.list
    }

    /// Warnings about meshes that cannot be shown.
    #[must_use]
    pub fn warnings(&self) -> Vec<String> {
        self.files.warnings()
    }

    fn body(&mut self, body: &Body, share: f64) -> Value {
        let made_of = format!("{:?} {:?} {share}", body.shapes, body.meshes);
        let Self { files, shared, known } = self;
        let (mesh, guides) = *known.entry(made_of).or_insert_with(|| {
            let meshes = files.surface(body, share);
            let (surface, guides) = with_shapes(meshes, body);
            ((!surface.faces.is_empty()).then(|| shared.place(&surface)), guides)
        });
        let mut out = json!({ "name": body.name, "mesh": mesh, "position": body.position, "rotation": body.rotation });
        if guides > 0 {
            out["guides"] = guides.into();
        }
        out
    }
}

/// The surface of a body's meshes and shapes, guides last, and how many vertices these have. With meshes, nothing stands in
/// for the body.
fn with_shapes(meshes: Option<Surface>, body: &Body) -> (Surface, usize) {
    let shown = body.shapes.iter().filter(|shape| shape.real || meshes.is_none());
    let (guides, own): (Vec<Shape>, Vec<Shape>) = shown.partition(|shape| shape.guide);
    let mut surface = meshes.unwrap_or_default();
    surface.add(solids::surface(&own));
    let guides = solids::surface(&guides);
    let count = guides.vertices.len();
    surface.add(guides);
    (surface, count)
}

/// The folders of task and robot files that still are what a result was made of, and the package roots of the task
/// file.
fn folders(sources: &[Source]) -> Vec<PathBuf> {
    let is_same = |source: &&Source| read_text(&source.path).is_ok_and(|text| text == source.text);
    let home = |source: &Source| match Path::new(&source.path).parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder.to_owned(),
        _ => PathBuf::from("."),
    };
    let mut folders: Vec<PathBuf> = sources.iter().filter(is_same).map(home).collect();
    if let Some(task) = sources.first().filter(is_same) {
        let table: toml::Table = task.text.parse().unwrap_or_default();
        let roots = table.get("model").and_then(|model| model.get("package_roots")?.as_array());
        let names = roots.into_iter().flatten().filter_map(toml::Value::as_str);
        folders.extend(names.map(|name| home(task).join(name)));
    }
    folders
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
