//! Mesh files of bodies, each read once.

use std::collections::{BTreeSet, HashMap};
use std::path::{Path, PathBuf};

use supple::scene::{Body, Scene};

use super::MOST_TRIANGLES;
use super::read::read;
use super::simplify::simplify;
use super::surface::Surface;

/// How many bytes of mesh files are read for one page.
const MOST_BYTES: u64 = 256 << 20;

/// The mesh files that were read, and what went wrong.
#[derive(Default)]
pub struct Files {
    known: HashMap<PathBuf, Option<Surface>>,
    bytes: u64,
    pub warnings: BTreeSet<String>,
}

impl Files {
    fn file(&mut self, path: &Path) -> Option<&Surface> {
        if !self.known.contains_key(path) {
            let surface = match read(path, MOST_BYTES - self.bytes) {
                Ok((surface, bytes)) => {
                    self.bytes += bytes;
                    Some(surface)
                }
                Err(why) => {
                    self.warnings.insert(format!("mesh {} {why}; a simple shape is shown instead", path.display()));
                    None
                }
            };
            self.known.insert(path.to_owned(), surface);
        }
        self.known.get(path)?.as_ref()
    }

    /// The share of their triangles that the meshes of a scene may keep.
    pub fn share(&mut self, scene: &Scene) -> f64 {
        let paths = scene.bodies.iter().flat_map(|body| &body.meshes).map(|mesh| &mesh.path);
        let count: usize = paths.map(|path| self.file(path).map_or(0, |surface| surface.faces.len())).sum();
        if count > MOST_TRIANGLES { MOST_TRIANGLES as f64 / count as f64 } else { 1.0 }
    }

    /// The surface of a body's meshes, with `share` of their triangles; none where none can be shown.
    pub fn surface(&mut self, body: &Body, share: f64) -> Option<Surface> {
        let mut all = Surface::default();
        for mesh in &body.meshes {
            let Some(surface) = self.file(&mesh.path) else { continue };
            let kept = (share * surface.faces.len() as f64).floor() as usize;
            let surface = simplify(surface.clone(), kept).placed(mesh.scale, mesh.rotation, mesh.position);
            if surface.is_sound() {
                all.add(surface);
            }
        }
        (!all.faces.is_empty()).then_some(all)
    }
}
