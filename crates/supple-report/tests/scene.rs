//! The data of the view: surfaces of bodies from shapes and files, whatever the files hold.
#![allow(missing_docs, clippy::unwrap_used)]

use std::path::{Path, PathBuf};

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde_json::Value;
use supple::scene::{Body, MeshFile, Scene, Shape, Solid, Track};
use supple_report::scene::{MOST_TRIANGLES, SCRIPT, data};

/// A folder for one test, empty at first.
fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("scene_{name}"));
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

const UNIT: [f64; 4] = [1.0, 0.0, 0.0, 0.0];

fn scene(shapes: Vec<Shape>, meshes: Vec<MeshFile>) -> Scene {
    let rest = (Track::new(vec![[0.0; 3]]), Track::new(vec![UNIT]));
    let body = Body { name: "body".into(), shapes, meshes, position: rest.0, rotation: rest.1 };
    Scene { time: Track::new(vec![[0.0], [1.0]]), size: 1.0, bodies: vec![body], ..Scene::default() }
}

fn mesh(path: &Path) -> MeshFile {
    MeshFile { path: path.to_owned(), position: [0.0; 3], rotation: UNIT, scale: [1.0; 3] }
}

fn ball() -> Shape {
    Shape::at([0.0; 3], Solid::Sphere { radius: 0.1 })
}

/// Vertices and faces of a surface of the data.
fn surface(data: &Value, place: usize) -> (Vec<[f32; 3]>, Vec<[u32; 3]>) {
    let words = |key: &str| -> Vec<[u8; 4]> {
        let bytes = STANDARD.decode(data["meshes"][place][key].as_str().unwrap()).unwrap();
        bytes.chunks_exact(4).map(|word| word.try_into().unwrap()).collect()
    };
    let vertices: Vec<f32> = words("vertices").into_iter().map(f32::from_le_bytes).collect();
    let faces: Vec<u32> = words("faces").into_iter().map(u32::from_le_bytes).collect();
    (
        vertices.chunks_exact(3).map(|v| v.try_into().unwrap()).collect(),
        faces.chunks_exact(3).map(|f| f.try_into().unwrap()).collect(),
    )
}

/// The volume inside a closed surface whose faces turn anticlockwise seen from outside.
fn volume((vertices, faces): &(Vec<[f32; 3]>, Vec<[u32; 3]>)) -> f64 {
    let corner = |place: u32| vertices[place as usize].map(f64::from);
    let part = |face: &[u32; 3]| {
        let [a, b, c] = face.map(corner);
        let across = [b[1] * c[2] - b[2] * c[1], b[2] * c[0] - b[0] * c[2], b[0] * c[1] - b[1] * c[0]];
        (a[0] * across[0] + a[1] * across[1] + a[2] * across[2]) / 6.0
    };
    faces.iter().map(part).sum()
}

#[test]
fn shapes_are_closed_and_as_large_as_they_should_be() {
    let at = [3.0, -1.0, 0.5];
    // A circle of 16 corners has 0.9745 of the area of the round one; half a ball of three rings a little less yet.
    let solids = [
        (Solid::Box { size: [1.0, 2.0, 3.0] }, 6.0, 1.0),
        (Solid::Cylinder { radius: 0.5, length: 2.0 }, 0.5 * std::f64::consts::PI, 0.97),
        (Solid::Sphere { radius: 0.5 }, std::f64::consts::PI / 6.0, 0.88),
        (Solid::Capsule { radius: 0.5, length: 2.0 }, std::f64::consts::PI * (0.5 + 1.0 / 6.0), 0.94),
        (Solid::Ellipsoid { radii: [0.5, 1.0, 2.0] }, std::f64::consts::PI * 4.0 / 3.0, 0.88),
    ];
    for (solid, expected, least) in solids {
        let turned = Shape { rotation: [0.5, 0.5, 0.5, 0.5], ..Shape::at(at, solid) };
        let found = volume(&surface(&data(&[("a", &scene(vec![turned], vec![]))]), 0));
        assert!(found <= 1.00001 * expected && found >= least * expected, "{solid:?}: {found}, not {expected}");
    }
}

#[test]
fn guides_are_the_last_vertices_of_a_surface() {
    let rail = Shape { guide: true, ..Shape::at([0.0; 3], Solid::Capsule { radius: 0.1, length: 50.0 }) };
    let cube = Shape::at([0.0; 3], Solid::Box { size: [1.0; 3] });
    let shown = data(&[("a", &scene(vec![rail, cube], vec![])), ("b", &scene(vec![cube], vec![]))]);
    let guides = shown["designs"][0]["bodies"][0]["guides"].as_u64().unwrap() as usize;
    let (vertices, _) = surface(&shown, 0);
    let is_near = |vertex: &[f32; 3]| vertex.iter().all(|entry| entry.abs() <= 0.5);
    let (own, far) = vertices.split_at(vertices.len() - guides);
    assert!(own.len() == 8 && own.iter().all(is_near) && far.iter().any(|vertex| !is_near(vertex)));
    assert!(shown["designs"][1]["bodies"][0].get("guides").is_none());
}

/// What a body looks like is beside its meshes; what stands in for it is not.
#[test]
fn real_shapes_are_shown_with_meshes() {
    let folder = folder("beside");
    let path = folder.join("pyramid.obj");
    std::fs::write(&path, OBJ).unwrap();
    let count = |shapes: Vec<Shape>, meshes: Vec<MeshFile>| surface(&data(&[("a", &scene(shapes, meshes))]), 0).1.len();
    let (bare, real) = (count(vec![], vec![mesh(&path)]), Shape { real: true, ..ball() });
    let of_ball = count(vec![ball()], vec![]);
    assert_eq!(count(vec![ball()], vec![mesh(&path)]), bare);
    assert_eq!(count(vec![ball(), real], vec![mesh(&path)]), bare + of_ball);
}

const OBJ: &str = "v 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\nv 1 1 3\nf 1 4 3 2\nf 1 2 5\nf 2 3 5\nf 3 4 5\nf 4 1 5\n";

/// A tetrahedron with corners at 0 and on the axes.
const CORNERS: [[f32; 3]; 4] = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
const SIDES: [[usize; 3]; 4] = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];

fn binary_stl() -> Vec<u8> {
    let mut bytes = b"solid in name only".to_vec();
    bytes.resize(80, b' ');
    bytes.extend(4_u32.to_le_bytes());
    for side in SIDES {
        bytes.extend([0; 12]);
        bytes.extend(side.iter().flat_map(|&corner| CORNERS[corner]).flat_map(f32::to_le_bytes));
        bytes.extend([0; 2]);
    }
    bytes
}

fn text_stl() -> Vec<u8> {
    let mut text = String::from("solid tetrahedron\n");
    for side in SIDES {
        text += "facet normal 0 0 1\nouter loop\n";
        for corner in side {
            let [x, y, z] = CORNERS[corner];
            text += &format!("vertex {x} {y} {z}\n");
        }
        text += "endloop\nendfacet\n";
    }
    (text + "endsolid tetrahedron\n").into_bytes()
}

/// The tetrahedron in cm, twice as large by its node, shifted by 5 cm along x and turned a quarter about z.
fn collada() -> Vec<u8> {
    r##"<?xml version="1.0" encoding="utf-8"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
  <asset><created>1970-01-01T00:00:00Z</created><modified>1970-01-01T00:00:00Z</modified>
    <unit name="centimeter" meter="0.01"/><up_axis>Z_UP</up_axis></asset>
  <library_geometries><geometry id="g" name="g"><mesh>
    <source id="p"><float_array id="pa" count="12">0 0 0 1 0 0 0 1 0 0 0 1</float_array>
      <technique_common><accessor source="#pa" count="4" stride="3"><param name="X" type="float"/>
        <param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common></source>
    <vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
    <triangles count="2"><input semantic="VERTEX" source="#v" offset="0"/><p>0 2 1 0 1 3</p></triangles>
    <polylist count="2"><input semantic="VERTEX" source="#v" offset="0"/><vcount>3 3</vcount><p>0 3 2 1 2 3</p></polylist>
  </mesh></geometry></library_geometries>
  <library_visual_scenes><visual_scene id="s"><node id="n">
    <translate>5 0 0</translate><rotate>0 0 1 90</rotate><scale>2 2 2</scale>
    <instance_geometry url="#g"/></node></visual_scene></library_visual_scenes>
  <scene><instance_visual_scene url="#s"/></scene>
</COLLADA>"##
        .into()
}

#[test]
fn files_of_every_kind_are_read() {
    let folder = folder("kinds");
    let files: [(&str, Vec<u8>, f64); 4] = [
        ("pyramid.obj", OBJ.into(), 4.0),
        ("binary.STL", binary_stl(), 1.0 / 6.0),
        ("text.stl", text_stl(), 1.0 / 6.0),
        ("part.dae", collada(), 8e-6 / 6.0),
    ];
    for (name, bytes, expected) in files {
        let path = folder.join(name);
        std::fs::write(&path, bytes).unwrap();
        let json = data(&[("a", &scene(vec![ball()], vec![mesh(&path)]))]);
        assert_eq!(json["warnings"], serde_json::json!([]), "{name}");
        let found = volume(&surface(&json, 0));
        assert!((found - expected).abs() < 1e-5 * expected, "{name}: {found}, not {expected}");
    }
    let (vertices, _) = surface(&data(&[("a", &scene(vec![], vec![mesh(&folder.join("part.dae"))]))]), 0);
    for (corner, expected) in
        vertices.iter().zip([[0.05, 0.0, 0.0], [0.05, 0.02, 0.0], [0.03, 0.0, 0.0], [0.05, 0.0, 0.02]])
    {
        assert!(corner.iter().zip(expected).all(|(a, b): (&f32, f32)| (a - b).abs() < 1e-7), "{corner:?}");
    }
}

#[test]
fn meshes_are_stretched_turned_and_shifted() {
    let path = folder("place").join("pyramid.obj");
    std::fs::write(&path, OBJ).unwrap();
    let half = 0.5_f64.sqrt();
    let placed =
        MeshFile { path, position: [1.0, 0.0, 0.0], rotation: [half, 0.0, 0.0, half], scale: [-1.0, 2.0, 0.5] };
    let found = surface(&data(&[("a", &scene(vec![], vec![placed]))]), 0);
    // The tip (1, 1, 3) becomes (-1, 2, 1.5), a quarter about z (-2, -1, 1.5), shifted (-1, -1, 1.5).
    let tip = found.0.iter().find(|vertex| (vertex[2] - 1.5).abs() < 1e-6).unwrap();
    assert!((tip[0] + 1.0).abs() < 1e-6 && (tip[1] + 1.0).abs() < 1e-6, "{tip:?}");
    // A mirrored surface still has its outside outside.
    assert!((volume(&found) - 4.0).abs() < 1e-5, "{}", volume(&found));
}

#[test]
fn damaged_files_give_a_warning_and_the_shape() {
    let folder = folder("damaged");
    let whole: [(&str, Vec<u8>); 4] =
        [("a.obj", OBJ.into()), ("b.stl", binary_stl()), ("c.stl", text_stl()), ("d.dae", collada())];
    let mut seed = 12345_u64;
    let mut random = || {
        seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (seed >> 56) as u8
    };
    let plain = data(&[("a", &scene(vec![ball()], vec![]))]);
    let mut fell_back = 0;
    for (name, bytes) in whole {
        let length = bytes.len();
        let cuts = (0..20).map(|part| bytes[..length * part / 20].to_vec());
        let noise: Vec<Vec<u8>> = (0..20).map(|_| (0..300).map(|_| random()).collect()).collect();
        let spots: Vec<Vec<u8>> = (0..40)
            .map(|_| {
                let mut spoilt = bytes.clone();
                for _ in 0..8 {
                    let place = (usize::from(random()) << 8 | usize::from(random())) % length;
                    spoilt[place] = random();
                }
                spoilt
            })
            .collect();
        for (index, broken) in cuts.chain(noise).chain(spots).enumerate() {
            let path = folder.join(format!("{index}_{name}"));
            std::fs::write(&path, &broken).unwrap();
            let json = data(&[("a", &scene(vec![ball()], vec![mesh(&path)]))]);
            let warned = !json["warnings"].as_array().unwrap().is_empty();
            assert_eq!(warned, json["meshes"] == plain["meshes"], "{index} {name}: {}", json["warnings"]);
            let (vertices, faces) = surface(&json, 0);
            assert!(vertices.iter().flatten().all(|entry| entry.is_finite()), "{index} {name}");
            assert!(faces.iter().flatten().all(|&place| (place as usize) < vertices.len()), "{index} {name}");
            fell_back += usize::from(warned);
        }
    }
    assert!(fell_back > 150, "only {fell_back} of 320 were seen to be damaged");
}

#[test]
fn what_is_no_mesh_is_said() {
    let folder = folder("words");
    let cases: [(&str, &[u8], &str); 5] = [
        ("a.ply", b"ply", "has the unsupported format `ply`; supported: stl, obj, dae"),
        ("b.obj", b"", "has no triangles"),
        ("c.obj", b"v 0 0 nan\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "has numbers that are not finite"),
        ("d.stl", b"\x00\x01", "cannot be read: neither text nor a binary STL of the stated length"),
        ("e.dae", &b"<a>".repeat(5000), "has elements nested more than 64 deep"),
    ];
    for (name, bytes, expected) in cases {
        std::fs::write(folder.join(name), bytes).unwrap();
        let json = data(&[("a", &scene(vec![ball()], vec![mesh(&folder.join(name))]))]);
        let warning = json["warnings"][0].as_str().unwrap();
        assert!(warning.contains(expected) && warning.contains(name), "{warning}");
    }
    let json = data(&[("a", &scene(vec![ball()], vec![mesh(&folder.join("missing.stl")), mesh(&folder)]))]);
    assert_eq!(json["warnings"].as_array().unwrap().len(), 2);
    let missing: Vec<_> = (0..7).map(|i| mesh(&folder.join(format!("missing{i}.stl")))).collect();
    let json = data(&[("a", &scene(vec![ball()], missing))]);
    let [warning] = &json["warnings"].as_array().unwrap()[..] else { panic!("{}", json["warnings"]) };
    let warning = warning.as_str().unwrap();
    assert!(warning.starts_with("7 meshes cannot be shown, each of which cannot be read: "), "{warning}");
    assert!(warning.contains("missing4.stl and 2 more; lines between joints are shown instead"), "{warning}");
}

#[test]
fn large_meshes_become_small() {
    let path = folder("large").join("sheet.obj");
    let (side, mut text) = (180, String::new());
    for row in 0..side {
        for column in 0..side {
            text += &format!("v {} {} {}\n", row, column, (f64::from(row) * 0.1).sin());
        }
    }
    for row in 1..side {
        for column in 1..side {
            let [a, b] = [(row - 1) * side + column, row * side + column];
            text += &format!("f {a} {b} {}\nf {a} {} {}\n", b + 1, b + 1, a + 1);
        }
    }
    std::fs::write(&path, text).unwrap();
    let json = data(&[("a", &scene(vec![ball()], vec![mesh(&path)]))]);
    let (vertices, faces) = surface(&json, 0);
    assert!(faces.len() <= MOST_TRIANGLES && faces.len() > MOST_TRIANGLES / 3, "{} triangles", faces.len());
    let most = |axis: usize| vertices.iter().map(|vertex| vertex[axis]).fold(0.0, f32::max);
    assert!(most(0) > 177.0 && most(1) > 177.0, "the edge went from 179 to {} and {}", most(0), most(1));
}

#[test]
fn designs_share_their_surfaces() {
    let one = scene(vec![ball()], vec![]);
    let other = scene(vec![Shape::at([0.0; 3], Solid::Sphere { radius: 0.2 })], vec![]);
    let json = data(&[("first", &one), ("second", &one), ("third", &other)]);
    assert_eq!(json["meshes"].as_array().unwrap().len(), 2);
    let place = |design: usize| json["designs"][design]["bodies"][0]["mesh"].as_u64().unwrap();
    assert_eq!([place(0), place(1), place(2)], [0, 0, 1]);
    assert_eq!(json["designs"][2]["name"], "third");
}

#[test]
fn the_script_brings_nothing_from_elsewhere() {
    for word in ["http:", "https:", "import ", "fetch(", "XMLHttpRequest", "</script"] {
        assert!(!SCRIPT.contains(word), "the script has `{word}`");
    }
    for file in ["scene.js", "scene_figure.js", "scene_geometry.js"] {
        let text = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("assets").join(file)).unwrap();
        assert!(SCRIPT.contains(&text), "{file} is not in the script");
    }
}
