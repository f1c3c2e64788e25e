//! COLLADA files: triangles and polygons of the visual scene, in m. Materials and the up axis are ignored, as
//! is the custom with robots' files.

use std::collections::HashMap;

use roxmltree::{Document, Node, ParsingOptions};

use super::surface::Surface;

/// How deep elements and nodes may be in one another.
const DEEPEST: usize = 64;
/// The most elements of a file.
const MOST_ELEMENTS: u32 = 2_000_000;
/// The maximum number of triangles in the assembled scene; nodes may use a mesh many times.
const MOST_FACES: usize = 2_000_000;

/// A matrix of three rows for points `(x, y, z, 1)`.
type Affine = [[f64; 4]; 3];

const IDENTITY: Affine = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]];

/// Elements by their `id`.
type Ids<'a> = HashMap<&'a str, Node<'a, 'a>>;

/// Reads a file.
pub fn read(bytes: &[u8]) -> Result<Surface, String> {
    let text = std::str::from_utf8(bytes).map_err(|_| "cannot be read: it is not text".to_string())?;
    if !is_shallow(text) {
        return Err(format!("has elements nested more than {DEEPEST} deep"));
    }
    let options = ParsingOptions { nodes_limit: MOST_ELEMENTS, ..ParsingOptions::default() };
    let document = Document::parse_with_options(text, options).map_err(|error| format!("cannot be read: {error}"))?;
    let root = document.root_element();
    if root.tag_name().name() != "COLLADA" {
        return Err(format!("cannot be read: it is no COLLADA file but `{}`", root.tag_name().name()));
    }
    let ids: Ids = root.descendants().filter_map(|node| Some((node.attribute("id")?, node))).collect();
    let mut all = Surface::default();
    let instance = child(root, "scene").and_then(|scene| child(scene, "instance_visual_scene"));
    match instance.and_then(|instance| target(instance, "url", &ids)) {
        Some(scene) => {
            for node in children(scene, "node") {
                add_node(node, &IDENTITY, &ids, 0, &mut all)?;
            }
        }
        // Without a scene all that there is.
        None => {
            for geometry in root.descendants().filter(|node| is(*node, "geometry")) {
                add_geometry(geometry, &IDENTITY, &ids, &mut all)?;
            }
        }
    }
    let unit = child(root, "asset").and_then(|asset| child(asset, "unit"));
    let meter = match unit.and_then(|unit| unit.attribute("meter")) {
        Some(text) => text.trim().parse().map_err(|_| format!("has the unit `{text}`, which is not a number"))?,
        None => 1.0,
    };
    Ok(all.placed([meter; 3], [1.0, 0.0, 0.0, 0.0], [0.0; 3]))
}

/// Whether elements are not too deep in one another.
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

/// Whether an element has this name, in whatever namespace.
fn is(node: Node, name: &str) -> bool {
    node.is_element() && node.tag_name().name() == name
}

fn children<'a>(node: Node<'a, 'a>, name: &'a str) -> impl Iterator<Item = Node<'a, 'a>> {
    node.children().filter(move |child| is(*child, name))
}

fn child<'a>(node: Node<'a, 'a>, name: &'a str) -> Option<Node<'a, 'a>> {
    children(node, name).next()
}

/// The element that an attribute such as `url="#id"` leads to.
fn target<'a>(node: Node<'a, 'a>, attribute: &str, ids: &Ids<'a>) -> Option<Node<'a, 'a>> {
    ids.get(node.attribute(attribute)?.trim().strip_prefix('#')?).copied()
}

/// The numbers in an element.
fn numbers<T: std::str::FromStr>(node: Node) -> Result<Vec<T>, String> {
    let text = || node.children().filter_map(|part| part.text());
    let words = text().flat_map(str::split_ascii_whitespace);
    let number = |word: &str| word.parse().map_err(|_| format!("has `{word}` instead of a number"));
    words.map(number).collect()
}

fn product(a: &Affine, b: &Affine) -> Affine {
    let entry = |row: &[f64; 4], column: usize| {
        let sum: f64 = (0..3).map(|k| row[k] * b[k][column]).sum();
        sum + if column == 3 { row[3] } else { 0.0 }
    };
    a.map(|row| [0, 1, 2, 3].map(|column| entry(&row, column)))
}

/// The matrix of a child of a node; `None` if it is no transformation.
fn matrix(transform: Node) -> Result<Option<Affine>, String> {
    let name = transform.tag_name().name();
    let needed = match name {
        "translate" | "scale" => 3,
        "rotate" => 4,
        "matrix" => 16,
        "lookat" | "skew" => return Err("uses `lookat` or `skew`, which are not supported".into()),
        _ => return Ok(None),
    };
    let by: Vec<f64> = numbers(transform)?;
    if by.len() != needed {
        return Err(format!("has `{name}` with {} numbers, not {needed}", by.len()));
    }
    let mut out = IDENTITY;
    match name {
        "translate" => (0..3).for_each(|i| out[i][3] = by[i]),
        "scale" => (0..3).for_each(|i| out[i][i] = by[i]),
        "rotate" => out = rotation([by[0], by[1], by[2], by[3]]),
        _ => out = [0, 1, 2].map(|row| [0, 1, 2, 3].map(|column| by[4 * row + column])),
    }
    Ok(Some(out))
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

fn add_node<'a>(
    node: Node<'a, 'a>,
    outer: &Affine,
    ids: &Ids<'a>,
    depth: usize,
    all: &mut Surface,
) -> Result<(), String> {
    if depth > DEEPEST {
        return Err(format!("has nodes nested more than {DEEPEST} deep"));
    }
    let mut here = *outer;
    for transform in node.children().filter(Node::is_element) {
        if let Some(by) = matrix(transform)? {
            here = product(&here, &by);
        }
    }
    for instance in children(node, "instance_geometry") {
        if let Some(geometry) = target(instance, "url", ids) {
            add_geometry(geometry, &here, ids, all)?;
        }
    }
    for instance in children(node, "instance_node") {
        if let Some(other) = target(instance, "url", ids) {
            add_node(other, &here, ids, depth + 1, all)?;
        }
    }
    children(node, "node").try_for_each(|child| add_node(child, &here, ids, depth + 1, all))
}

fn add_geometry<'a>(geometry: Node<'a, 'a>, here: &Affine, ids: &Ids<'a>, all: &mut Surface) -> Result<(), String> {
    let Some(mesh) = child(geometry, "mesh") else { return Ok(()) };
    let mut own = Surface { vertices: positions(mesh, ids)?, faces: Vec::new() };
    for primitive in mesh.children().filter(Node::is_element) {
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

/// The whole number in an attribute; `default` where there is none.
fn whole(node: Node, attribute: &str, default: usize) -> Result<usize, String> {
    match node.attribute(attribute) {
        Some(text) => {
            text.trim().parse().map_err(|_| format!("has `{attribute}` = `{text}`, which is no whole number"))
        }
        None => Ok(default),
    }
}

fn positions<'a>(mesh: Node<'a, 'a>, ids: &Ids<'a>) -> Result<Vec<[f32; 3]>, String> {
    let vertices = child(mesh, "vertices").ok_or("has a mesh without vertices")?;
    let position = |input: &Node| input.attribute("semantic") == Some("POSITION");
    let input = children(vertices, "input").find(position).ok_or("has vertices without positions")?;
    let source = target(input, "source", ids).ok_or("has invalid references to positions")?;
    let array = child(source, "float_array").ok_or("has positions that are no numbers")?;
    let accessor = child(source, "technique_common").and_then(|common| child(common, "accessor"));
    let (offset, stride) = match accessor {
        Some(accessor) => (whole(accessor, "offset", 0)?, whole(accessor, "stride", 1)?),
        None => (0, 3),
    };
    if stride < 3 {
        return Err("has positions of less than three numbers".into());
    }
    let array: Vec<f32> = numbers(array)?;
    let rest = array.get(offset..).ok_or("has positions beyond the end of their array")?;
    Ok(rest.chunks(stride).filter(|chunk| chunk.len() >= 3).map(|chunk| [chunk[0], chunk[1], chunk[2]]).collect())
}

/// Adds the triangles of a list of primitives; lines are left out.
fn add_faces<'a>(primitive: Node<'a, 'a>, faces: &mut Vec<[u32; 3]>) -> Result<(), String> {
    let name = primitive.tag_name().name();
    match name {
        "triangles" | "polylist" | "polygons" => {}
        "trifans" | "tristrips" => return Err("uses fans or strips of triangles, which are not read".into()),
        _ => return Ok(()),
    }
    let mut stride = 1;
    let mut offset = None;
    for input in children(primitive, "input") {
        let place = whole(input, "offset", 0)?;
        stride = stride.max(place.saturating_add(1));
        if input.attribute("semantic") == Some("VERTEX") {
            offset = Some(place);
        }
    }
    let offset = offset.ok_or("has faces without vertices")?;
    let lists = children(primitive, "p").map(numbers).collect::<Result<Vec<Vec<u32>>, _>>()?;
    let mut add = |polygon: &[u32]| {
        let corners: Vec<u32> = polygon.chunks_exact(stride).map(|corner| corner[offset]).collect();
        faces.extend(corners.windows(2).skip(1).map(|pair| [corners[0], pair[0], pair[1]]));
    };
    let all = lists.concat();
    match name {
        "triangles" => all.chunks_exact(3_usize.saturating_mul(stride)).for_each(add),
        "polygons" => lists.iter().for_each(|polygon| add(polygon)),
        _ => {
            let counts: Vec<usize> = child(primitive, "vcount").map_or(Ok(Vec::new()), numbers)?;
            let mut rest = &all[..];
            for count in counts {
                let (own, others) =
                    rest.split_at_checked(stride.saturating_mul(count)).ok_or("has polygons without corners")?;
                add(own);
                rest = others;
            }
        }
    }
    Ok(())
}
