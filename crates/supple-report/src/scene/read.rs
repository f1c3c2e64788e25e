//! Mesh files, which are untrusted: limits are checked first, and panics of parsers are caught.

use std::io::Cursor;
use std::panic::catch_unwind;
use std::path::Path;

use super::dae;
use super::surface::Surface;

/// The largest mesh file that is read, bytes.
const MOST_BYTES: u64 = 64 << 20;
/// The most triangles that a file may have.
const MOST_FACES: usize = 2_000_000;

/// The mesh in a file of at most `left` bytes, in the file's units, and how many bytes the file has; or why not.
pub fn read(path: &Path, left: u64) -> Result<(Surface, u64), String> {
    let bytes = bytes(path, left)?;
    let ending = path.extension().map(|ending| ending.to_string_lossy().to_lowercase()).unwrap_or_default();
    // If a parser panics on a malformed file, no state that is used later can be corrupted.
    let parsed =
        catch_unwind(|| parse(&ending, &bytes)).unwrap_or_else(|_| Err("cannot be read: it is damaged".into()));
    let surface = parsed?;
    if surface.faces.is_empty() {
        return Err("has no triangles".into());
    }
    if surface.faces.len() > MOST_FACES {
        return Err(format!("has {} triangles; at most {MOST_FACES} are read", surface.faces.len()));
    }
    if !surface.is_sound() {
        return Err("has numbers that are not finite, or faces without corners".into());
    }
    Ok((surface, bytes.len() as u64))
}

fn bytes(path: &Path, left: u64) -> Result<Vec<u8>, String> {
    let fail = |error: std::io::Error| format!("cannot be read: {error}");
    let about = std::fs::metadata(path).map_err(fail)?;
    if !about.is_file() {
        return Err("is no file".into());
    }
    let most = MOST_BYTES.min(left);
    if about.len() > most {
        return Err(format!("has {} bytes; at most {most} are read here", about.len()));
    }
    std::fs::read(path).map_err(fail)
}

fn parse(ending: &str, bytes: &[u8]) -> Result<Surface, String> {
    match ending {
        "stl" => stl(bytes),
        "obj" => obj(bytes),
        "dae" => dae::read(bytes),
        other => Err(format!("has the unsupported format `{other}`; supported: stl, obj, dae")),
    }
}

fn stl(bytes: &[u8]) -> Result<Surface, String> {
    // Binary files declare the number of triangles; check it, so that a file cannot request unlimited memory. Files that
    // begin with `solid` may be text or binary.
    let said = bytes.get(80..84).and_then(|count| count.try_into().ok()).map(u32::from_le_bytes).map(u64::from);
    let is_binary = said.is_some_and(|count| bytes.len() as u64 == 84 + 50 * count);
    let mut bytes = bytes.to_vec();
    if is_binary {
        // Otherwise the parser would treat the file as text because of its first word.
        bytes[..80].fill(0);
    } else if !bytes.trim_ascii_start().starts_with(b"solid") {
        return Err("cannot be read: neither text nor a binary STL of the stated length".into());
    }
    let mesh = stl_io::read_stl(&mut Cursor::new(bytes)).map_err(|error| format!("cannot be read: {error}"))?;
    let place = |places: [usize; 3]| places.map(|place| u32::try_from(place).unwrap_or(u32::MAX));
    Ok(Surface {
        vertices: mesh.vertices.iter().map(|vertex| vertex.0).collect(),
        faces: mesh.faces.iter().map(|face| place(face.vertices)).collect(),
    })
}

fn obj(bytes: &[u8]) -> Result<Surface, String> {
    let options =
        tobj::LoadOptions { triangulate: true, ignore_points: true, ignore_lines: true, ..Default::default() };
    // Materials are not used, and not looked for.
    let none = |_: &Path| Ok(Default::default());
    let (models, _) = tobj::load_obj_buf(&mut Cursor::new(bytes), &options, none)
        .map_err(|error| format!("cannot be read: {error}"))?;
    let mut all = Surface::default();
    for model in models {
        let triples = |list: &[f32]| list.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect();
        let faces = model.mesh.indices.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect();
        let surface = Surface { vertices: triples(&model.mesh.positions), faces };
        if !surface.is_sound() {
            return Err("has numbers that are not finite, or faces without corners".into());
        }
        all.add(surface);
    }
    Ok(all)
}
