//! COLLADA files: triangles and polygons of the visual scene, in m. Materials are not used, and the up axis is not, as
//! is the custom with robots' files.

use std::str::FromStr;

use dae_parser::{
    ArrayElement, Document, Geometry, Input, LocalMap, Mesh, Node, Primitive, Semantic, Source, Transform, VisualScene,
};

use super::surface::Surface;

/// How deep elements and nodes may be in one another.
const DEEPEST: usize = 64;
/// The most triangles that are put together from nodes, which may use a mesh many times.
const MOST_FACES: usize = 2_000_000;

/// A matrix of three rows for points `(x, y, z, 1)`.
type Affine = [[f64; 4]; 3];

const IDENTITY: Affine = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]];

/// What nodes refer to.
struct Parts<'a> {
    geometries: LocalMap<'a, Geometry>,
    sources: LocalMap<'a, Source>,
    nodes: LocalMap<'a, Node>,
}

/// Reads a file.
pub fn read(bytes: &[u8]) -> Result<Surface, String> {
    let text = std::str::from_utf8(bytes).map_err(|_| "cannot be read: it is no text".to_string())?;
    if !is_shallow(text) {
        return Err(format!("has elements more than {DEEPEST} deep in one another"));
    }
    let fail = |_: dae_parser::Error| "cannot be read: it is no valid COLLADA 1.4".to_string();
    let document = Document::from_str(text).map_err(fail)?;
    let parts = Parts {
        geometries: document.local_map().map_err(fail)?,
        sources: document.local_map().map_err(fail)?,
        nodes: document.local_map().map_err(fail)?,
    };
    let scenes: LocalMap<VisualScene> = document.local_map().map_err(fail)?;
    let instance = document.scene.as_ref().and_then(|scene| scene.instance_visual_scene.as_ref());
    let mut all = Surface::default();
    match instance.and_then(|instance| scenes.get(&instance.url)) {
        Some(scene) => {
            for node in &scene.nodes {
                add_node(node, &IDENTITY, &parts, 0, &mut all)?;
            }
        }
        // Without a scene all that there is.
        None => {
            let mut list: Vec<_> = parts.geometries.0.iter().collect();
            list.sort_by_key(|&(id, _)| *id);
            for (_, geometry) in list {
                add_geometry(geometry, &IDENTITY, &parts, &mut all)?;
            }
        }
    }
    let meter = f64::from(document.asset.unit.meter);
    Ok(all.placed([meter; 3], [1.0, 0.0, 0.0, 0.0], [0.0; 3]))
}

/// Whether elements are not too deep in one another: the reader goes into them by recursion.
fn is_shallow(text: &str) -> bool {
    let mut depth = 0_usize;
    text.split('<').skip(1).all(|rest| {
        let end = rest.find('>').map_or(rest, |end| &rest[..end]);
        match end.as_bytes().first() {
            Some(b'/') => depth = depth.saturating_sub(1),
            Some(b'?' | b'!') | None => {}
            Some(_) if end.ends_with('/') => {}
            Some(_) => depth += 1,
        }
        depth <= DEEPEST
    })
}

fn product(a: &Affine, b: &Affine) -> Affine {
    let entry = |row: &[f64; 4], column: usize| {
        let sum: f64 = (0..3).map(|k| row[k] * b[k][column]).sum();
        sum + if column == 3 { row[3] } else { 0.0 }
    };
    a.map(|row| [0, 1, 2, 3].map(|column| entry(&row, column)))
}

fn matrix(transform: &Transform) -> Result<Affine, String> {
    Ok(match transform {
        Transform::Translate(by) => {
            let mut out = IDENTITY;
            (0..3).for_each(|i| out[i][3] = f64::from(by.0[i]));
            out
        }
        Transform::Scale(by) => {
            let mut out = IDENTITY;
            (0..3).for_each(|i| out[i][i] = f64::from(by.0[i]));
            out
        }
        Transform::Matrix(by) => [0, 1, 2].map(|row| [0, 1, 2, 3].map(|column| f64::from(by.0[4 * row + column]))),
        Transform::Rotate(by) => rotation(by.0.map(f64::from)),
        Transform::LookAt(_) | Transform::Skew(_) => return Err("uses `lookat` or `skew`, which are not read".into()),
    })
}

/// About an axis by an angle in degrees (Rodrigues).
fn rotation([x, y, z, degrees]: [f64; 4]) -> Affine {
    let length = (x * x + y * y + z * z).sqrt();
    if length == 0.0 {
        return IDENTITY;
    }
    let axis = [x / length, y / length, z / length];
    let (sin, cos) = degrees.to_radians().sin_cos();
    let skew = [[0.0, -axis[2], axis[1]], [axis[2], 0.0, -axis[0]], [-axis[1], axis[0], 0.0]];
    let mut out = IDENTITY;
    for i in 0..3 {
        for j in 0..3 {
            let unit = if i == j { cos } else { 0.0 };
            out[i][j] = unit + sin * skew[i][j] + (1.0 - cos) * axis[i] * axis[j];
        }
    }
    out
}

fn add_node(node: &Node, outer: &Affine, parts: &Parts, depth: usize, all: &mut Surface) -> Result<(), String> {
    if depth > DEEPEST {
        return Err(format!("has nodes more than {DEEPEST} deep in one another"));
    }
    let mut here = *outer;
    for transform in &node.transforms {
        here = product(&here, &matrix(transform)?);
    }
    for instance in &node.instance_geometry {
        if let Some(geometry) = parts.geometries.get(&instance.url) {
            add_geometry(geometry, &here, parts, all)?;
        }
    }
    for instance in &node.instance_node {
        if let Some(other) = parts.nodes.get(&instance.url) {
            add_node(other, &here, parts, depth + 1, all)?;
        }
    }
    node.children.iter().try_for_each(|child| add_node(child, &here, parts, depth + 1, all))
}

fn add_geometry(geometry: &Geometry, here: &Affine, parts: &Parts, all: &mut Surface) -> Result<(), String> {
    let Some(mesh) = geometry.element.as_mesh() else { return Ok(()) };
    let mut own = Surface { vertices: positions(mesh, parts)?, faces: Vec::new() };
    for primitive in &mesh.elements {
        add_faces(primitive, &mut own.faces)?;
    }
    if all.faces.len() + own.faces.len() > MOST_FACES || all.vertices.len() + own.vertices.len() > 3 * MOST_FACES {
        return Err(format!("has more than {MOST_FACES} triangles"));
    }
    for vertex in &mut own.vertices {
        let [x, y, z] = vertex.map(f64::from);
        *vertex = here.map(|row| (row[0] * x + row[1] * y + row[2] * z + row[3]) as f32);
    }
    if !own.is_sound() {
        return Err("has numbers that are not finite, or faces without corners".into());
    }
    all.add(own);
    Ok(())
}

fn positions(mesh: &Mesh, parts: &Parts) -> Result<Vec<[f32; 3]>, String> {
    let vertices = mesh.vertices.as_ref().ok_or("has a mesh without vertices")?;
    let position = |input: &&Input| input.semantic == Semantic::Position;
    let input = vertices.inputs.iter().find(position).ok_or("has vertices without positions")?;
    let source = parts.sources.get(input.source_as_source()).ok_or("has positions that lead nowhere")?;
    let Some(ArrayElement::Float(array)) = &source.array else {
        return Err("has positions that are no numbers".into());
    };
    let (offset, stride) = (source.accessor.offset, source.accessor.stride);
    if stride < 3 {
        return Err("has positions of less than three numbers".into());
    }
    let rest = array.val.get(offset..).ok_or("has positions that lead nowhere")?;
    Ok(rest.chunks(stride).filter(|chunk| chunk.len() >= 3).map(|chunk| [chunk[0], chunk[1], chunk[2]]).collect())
}

/// Adds the triangles of a list of primitives; lines are left out.
fn add_faces(primitive: &Primitive, faces: &mut Vec<[u32; 3]>) -> Result<(), String> {
    let (inputs, polygons): (_, Vec<&[u32]>) = match primitive {
        Primitive::Triangles(list) => {
            let stride = list.inputs.stride.max(1);
            (&list.inputs, list.data.as_deref().unwrap_or(&[]).chunks_exact(3 * stride).collect())
        }
        Primitive::PolyList(list) => {
            let stride = list.inputs.stride.max(1);
            let mut rest = &list.data.prim[..];
            let mut polygons = Vec::new();
            for &count in &list.data.vcount {
                let length = stride * count as usize;
                let (own, others) = rest.split_at_checked(length).ok_or("has polygons without corners")?;
                polygons.push(own);
                rest = others;
            }
            (&list.inputs, polygons)
        }
        Primitive::Polygons(list) => (&list.inputs, list.data.0.iter().map(|polygon| &polygon.verts[..]).collect()),
        Primitive::TriFans(_) | Primitive::TriStrips(_) => {
            return Err("uses fans or strips of triangles, which are not read".into());
        }
        _ => return Ok(()),
    };
    let stride = inputs.stride.max(1);
    let vertex = inputs.iter().find(|input| input.semantic == Semantic::Vertex);
    let offset = vertex.ok_or("has faces without vertices")?.offset as usize;
    for polygon in polygons {
        let corners: Vec<u32> = polygon.chunks_exact(stride).filter_map(|corner| corner.get(offset).copied()).collect();
        for pair in corners.windows(2).skip(1) {
            faces.push([corners[0], pair[0], pair[1]]);
        }
    }
    Ok(())
}
