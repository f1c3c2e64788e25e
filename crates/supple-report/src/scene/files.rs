//! Mesh files of bodies, each read once.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::path::{Path, PathBuf};

use supple::scene::{Body, Scene};

use super::read::read;
use super::simplify::simplify;
use super::surface::Surface;

/// How many triangles of mesh files a scene has at most; more are made fewer.
pub const MOST_TRIANGLES: usize = 20_000;

/// How many bytes of mesh files are read for one page.
const MOST_BYTES: u64 = 256 << 20;

/// Files that a warning names, at most.
const MOST_NAMES: usize = 5;

/// The reason for not reading a file that a result names.
const OUTSIDE: &str =
    "is not in the folder of the result's robot or task file, nor in a package root; or that file has changed";

/// The mesh files that were read, and what went wrong.
#[derive(Default)]
pub struct Files {
    /// Where files may be, without symbolic links; anywhere where it is not said.
    folders: Option<Vec<PathBuf>>,
    known: HashMap<PathBuf, Option<Surface>>,
    bytes: u64,
    /// Files that cannot be shown, by the reason.
    failed: BTreeMap<String, BTreeSet<String>>,
}

impl Files {
    /// Only files within these folders are read, whatever a result says.
    pub fn within(folders: &[PathBuf]) -> Self {
        let folders = folders.iter().filter_map(|folder| folder.canonicalize().ok()).collect();
        Self { folders: Some(folders), ..Self::default() }
    }

    fn is_within(&self, path: &Path) -> bool {
        // A missing file is reported when it is read.
        let Some(folders) = &self.folders else { return true };
        path.canonicalize().map_or(true, |real| folders.iter().any(|folder| real.starts_with(folder)))
    }

    fn file(&mut self, path: &Path) -> Option<&Surface> {
        if !self.known.contains_key(path) {
            let read = if self.is_within(path) { read(path, MOST_BYTES - self.bytes) } else { Err(OUTSIDE.to_owned()) };
            let surface = match read {
                Ok((surface, bytes)) => {
                    self.bytes += bytes;
                    Some(surface)
                }
                Err(why) => {
                    self.failed.entry(why).or_default().insert(path.display().to_string());
                    None
                }
            };
            self.known.insert(path.to_owned(), surface);
        }
        self.known.get(path)?.as_ref()
    }

    /// What to tell the reader: one sentence by reason.
    pub fn warnings(&self) -> Vec<String> {
        let sentence = |(why, paths): (&String, &BTreeSet<String>)| {
            let shown: Vec<_> = paths.iter().take(MOST_NAMES).map(String::as_str).collect();
            match paths.len() {
                1 => format!("mesh {} {why}; lines between joints are shown instead", shown[0]),
                count => {
                    let rest = count.saturating_sub(MOST_NAMES);
                    let more = if rest > 0 { format!(" and {rest} more") } else { String::new() };
                    let shown = shown.join(", ");
                    format!(
                        "{count} meshes cannot be shown, each of which {why}: {shown}{more}; lines between joints are shown instead"
                    )
                }
            }
        };
        self.failed.iter().map(sentence).collect()
    }

    /// The share of their triangles that the meshes of a scene may keep.
    pub fn share(&mut self, scene: &Scene) -> f64 {
        let paths = scene.bodies.iter().flat_map(|body| &body.meshes).map(|mesh| &mesh.path);
        let count: usize = paths.map(|path| self.file(path).map_or(0, |surface| surface.faces.len())).sum();
        if count > MOST_TRIANGLES { MOST_TRIANGLES as f64 / count as f64 } else { 1.0 }
    }

    /// The surface of a body's meshes, with `share` of their triangles; `None` if none can be shown.
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
