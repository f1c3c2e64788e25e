//! Visual meshes of geoms.

use std::collections::hash_map::Entry;
use std::path::Path;

use supple_text::FileError;

use super::super::meshes::mesh_path;
use super::super::words::shown;
use super::super::xml::Element;
use super::defaults::MAIN;
use super::geom::is_shown;
use super::known::check_attributes;
use super::orientation::pose;
use super::reader::Reader;
use crate::{Mesh, Pose};

/// Elements of `asset` that are known and not read.
const IGNORED: [&str; 5] = ["hfield", "skin", "texture", "material", "model"];

impl<'a> Reader<'a, '_> {
    /// The meshes of the `asset` sections; the first of those with the same name.
    pub(super) fn meshes(&mut self, root: Element<'a>) {
        for at in root.all("asset").flat_map(Element::children) {
            let tag = at.tag();
            if IGNORED.contains(&tag) {
                self.parts.warnings.ignore(at);
                continue;
            }
            if tag != "mesh" {
                self.parts.warnings.unknown(at, &["mesh"]);
                continue;
            }
            check_attributes(at, "mesh", &mut self.parts.warnings);
            // Without a name, the file name without folder and extension is used.
            let stem = at.attribute("file").and_then(|file| Path::new(file).file_stem()?.to_str());
            let Some(name) = at.attribute("name").filter(|name| !name.is_empty()).or(stem) else { continue };
            match self.meshes.entry(name) {
                Entry::Vacant(free) => {
                    free.insert(at);
                }
                Entry::Occupied(first) => {
                    let place = first.get().place();
                    self.parts.warnings.note("mesh name", at, || {
                        format!("it is ignored: there is another mesh {}, at {place}", shown(name))
                    });
                }
            }
        }
    }

    /// The visual mesh of a geom in `frame` of its body; `None` if it shows none, or one without a file.
    ///
    /// # Errors
    /// If there is no such mesh, or its file is outside the robot file's folder.
    pub(super) fn mesh(&mut self, at: Element<'a>, frame: &Pose, class: usize) -> Result<Option<Mesh>, FileError> {
        let values = self.classes.values(at, "geom", class)?;
        let Some(name) = values.text("mesh") else { return Ok(None) };
        let Some(&asset) = self.meshes.get(name) else {
            return Err(values.error("mesh", format!("there is no mesh {} in `asset`", shown(name))));
        };
        let fitted = values.text("type").is_none_or(|shape| shape != "mesh");
        let Some(file) = asset.attribute("file").filter(|_| !fitted) else { return Ok(None) };
        if !is_shown(&values)? {
            return Ok(None);
        }
        let placed = frame.compose(&pose(&values, self.settings)?);
        let mesh = self.classes.values(asset, "mesh", MAIN)?;
        let scale: [f64; 3] = mesh.numbers("scale")?.unwrap_or([1.0; 3]);
        let origin = mesh.numbers("refpos")?.unwrap_or([0.0; 3]);
        let turned = mesh.numbers("refquat")?.unwrap_or([1.0, 0.0, 0.0, 0.0]);
        let [a, b, c] = scale;
        if turned != [1.0, 0.0, 0.0, 0.0] && !(a == b && b == c) {
            self.parts
                .warnings
                .note("refquat", asset, || "it is left out: it is both rotated and scaled non-uniformly".to_owned());
            return Ok(None);
        }
        let origin = [0, 1, 2].map(|axis| scale[axis] * origin[axis]);
        let reference = Pose::from_quaternion(origin, turned)
            .ok_or_else(|| asset.error_at("refquat", "the quaternion must be non-zero and finite when squared"))?;
        let path = mesh_path(asset, &self.file(file), self.options, self.folder, &mut self.parts.warnings);
        Ok(path.map(|path| Mesh { path, pose: placed.compose(&reference.inverse()), scale }))
    }

    /// The name of a mesh's file as seen from the robot file.
    fn file(&self, file: &str) -> String {
        let named = Path::new(file).file_name().and_then(|name| name.to_str()).filter(|_| self.settings.strip_folders);
        let file = named.unwrap_or(file);
        match self.settings.mesh_folder.trim_end_matches('/') {
            "" => file.to_owned(),
            folder => format!("{folder}/{file}"),
        }
    }
}
