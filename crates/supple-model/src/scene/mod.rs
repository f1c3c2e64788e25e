//! A plan as an animation: bodies, the forces between them, and the controller's estimate of their positions.
//!
//! A model that can be drawn gives a [`Picture`] at one point ([`Model::picture`](crate::Model::picture)); a [`Scene`]
//! is the sequence of them along a plan, at no more than [`MOST_FRAMES`] times.
//!
//! # A moving ball
//!
//! ```
//! use supple_model::scene::{Body, Connection, ConnectionKind, PointBelief, Scene, Shape, Solid, Track, Wall};
//!
//! let still = |point: [f64; 3]| Track::new(vec![point]);
//! let path = Track::new(vec![[0.0, 0.0, 0.1], [0.5, 0.0, 0.1]]);
//! let ball = Body {
//!     name: "ball".to_owned(),
//!     shapes: vec![Shape::at([0.0; 3], Solid::Sphere { radius: 0.1 })],
//!     position: path.clone(),
//!     rotation: Track::new(vec![[1.0, 0.0, 0.0, 0.0]]),
//!     ..Body::default()
//! };
//! let spring = Connection {
//!     name: "spring".to_owned(),
//!     kind: ConnectionKind::Spring,
//!     from: still([0.0; 3]),
//!     to: path.clone(),
//!     force: Track::new(vec![[0.0; 3], [-5.0, 0.0, 0.0]]),
//!     torque: still([0.0; 3]),
//! };
//! let scene = Scene {
//!     time: Track::new(vec![[0.0], [1.0]]),
//!     size: 1.0,
//!     bodies: vec![ball],
//!     connections: vec![spring],
//!     beliefs: vec![PointBelief { name: "centre".to_owned(), position: path, ..PointBelief::default() }],
//!     walls: vec![Wall { name: "wall".to_owned(), position: still([0.7, 0.0, 0.0]), ..Wall::default() }],
//! };
//! assert_eq!(scene.bodies[0].position.at(1), Some(&[0.5, 0.0, 0.1]));
//! assert!(scene.bodies[0].rotation.is_fixed());
//! ```

use serde::{Deserialize, Serialize};

mod picture;
mod track;

pub use picture::{Landmark, LandmarkKind, Picture, PlacedBody, PlacedConnection, Seen};
pub use supple_robot::{Pose, Solid};
pub use track::Track;
pub use track::round;

/// Greatest number of frames in a scene.
pub const MOST_FRAMES: usize = 101;

/// A moving picture of a plan. All lengths are in m and in the axes of the world; rotations are quaternions
/// `w, x, y, z` of length 1.
///
/// Example: the [module](crate::scene).
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Scene {
    /// Time of each frame, s.
    pub time: Track<1>,
    /// A typical length of what is drawn, m: that of the robot when stretched, for sizes of marks.
    pub size: f64,
    /// The bodies.
    pub bodies: Vec<Body>,
    /// Springs, bushings and contacts.
    pub connections: Vec<Connection>,
    /// Uncertainty of points.
    pub beliefs: Vec<PointBelief>,
    /// Walls, and the uncertainty of their positions.
    pub walls: Vec<Wall>,
}

/// A rigid body.
///
/// Example: the [module](crate::scene).
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Body {
    /// Its name.
    pub name: String,
    /// What it looks like beside its meshes; or what stands in for it where nothing of it can be shown.
    pub shapes: Vec<Shape>,
    /// Its meshes.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub meshes: Vec<MeshFile>,
    /// Where its frame's origin is.
    pub position: Track<3>,
    /// How it is turned.
    pub rotation: Track<4>,
}

/// A simple shape on a body.
///
/// Example: the [module](crate::scene).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Shape {
    /// What it is.
    pub solid: Solid,
    /// Its centre in the body's frame.
    pub position: [f64; 3],
    /// How it is turned in that frame.
    pub rotation: [f64; 4],
    /// Whether it only shows a range of motion, as rails do; pictures may crop it.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub guide: bool,
    /// Whether the body looks so; else it stands in for what is not known, or only guides.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub real: bool,
}

/// A file with a mesh on a body.
///
/// ```
/// use supple_model::scene::MeshFile;
///
/// // Vertices in mm.
/// let scale = [1e-3; 3];
/// let mesh = MeshFile { path: "link.stl".into(), position: [0.0; 3], rotation: [1.0, 0.0, 0.0, 0.0], scale };
/// assert_eq!(mesh.path.extension().and_then(|end| end.to_str()), Some("stl"));
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MeshFile {
    /// Where the file is, as the robot's file was named.
    pub path: std::path::PathBuf,
    /// Where it is in the body's frame.
    pub position: [f64; 3],
    /// How it is turned in that frame.
    pub rotation: [f64; 4],
    /// Scale factor for each axis of the mesh, applied before rotation.
    pub scale: [f64; 3],
}

/// What a connection is.
///
/// Example: the [module](crate::scene).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ConnectionKind {
    /// Along a line or beside a joint.
    Spring,
    /// A spring in six directions.
    Bushing,
    /// With a wall.
    Contact,
}

/// A spring, bushing or contact that exerts a force between two points.
///
/// Example: the [module](crate::scene).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Connection {
    /// Its name.
    pub name: String,
    /// What it is.
    pub kind: ConnectionKind,
    /// Where the first end is.
    pub from: Track<3>,
    /// Where the second end is.
    pub to: Track<3>,
    /// Force on the body at the second end, N.
    pub force: Track<3>,
    /// Torque on the body at the second end, N m.
    pub torque: Track<3>,
}

/// Uncertainty of a point's position.
///
/// Example: the [module](crate::scene).
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PointBelief {
    /// Its name.
    pub name: String,
    /// Where it is on the plan.
    pub position: Track<3>,
    /// Covariance of its position given all measurements so far, m^2: xx, xy, xz, yy, yz, zz. To first order about the
    /// plan: `J Sigma J'` with the Jacobian `J` of the point by the state.
    pub covariance: Track<6>,
}

/// A wall, drawn as a plate.
///
/// Example: the [module](crate::scene).
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Wall {
    /// Its name.
    pub name: String,
    /// Centre of the plate's outer face.
    pub position: Track<3>,
    /// How it is turned: z is the normal, out of the wall.
    pub rotation: [f64; 4],
    /// Edges of the plate: two along the wall, and its thickness.
    pub size: [f64; 3],
    /// Standard deviation of its place along the normal, m.
    pub deviation: Track<1>,
}

impl Shape {
    /// A shape at a point of its body, not turned.
    #[must_use]
    pub fn at(position: [f64; 3], solid: Solid) -> Self {
        Self { solid, position, rotation: [1.0, 0.0, 0.0, 0.0], guide: false, real: false }
    }

    /// A shape at a pose in its body.
    #[must_use]
    pub fn placed(pose: &Pose, solid: Solid) -> Self {
        Self { rotation: quaternion(&pose.rotation), ..Self::at(pose.position, solid) }
    }
}

/// The unit quaternion `w, x, y, z` of a rotation matrix by rows, with `w` at least 0 (Shepperd's method).
///
/// ```
/// // Half a turn about x.
/// let turned = [[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]];
/// assert_eq!(supple_model::scene::quaternion(&turned), [0.0, 1.0, 0.0, 0.0]);
/// ```
#[must_use]
pub fn quaternion(r: &[[f64; 3]; 3]) -> [f64; 4] {
    // Four times the products of each entry with the largest one.
    let squares = [
        1.0 + r[0][0] + r[1][1] + r[2][2],
        1.0 + r[0][0] - r[1][1] - r[2][2],
        1.0 - r[0][0] + r[1][1] - r[2][2],
        1.0 - r[0][0] - r[1][1] + r[2][2],
    ];
    let largest = (1..4).fold(0, |best, i| if squares[i] > squares[best] { i } else { best });
    let (wx, wy, wz) = (r[2][1] - r[1][2], r[0][2] - r[2][0], r[1][0] - r[0][1]);
    let (xy, xz, yz) = (r[0][1] + r[1][0], r[0][2] + r[2][0], r[1][2] + r[2][1]);
    let products = match largest {
        0 => [squares[0], wx, wy, wz],
        1 => [wx, squares[1], xy, xz],
        2 => [wy, xy, squares[2], yz],
        _ => [wz, xz, yz, squares[3]],
    };
    let length = products.iter().map(|entry| entry * entry).sum::<f64>().sqrt();
    let sign = if products[0] < 0.0 { -1.0 } else { 1.0 };
    products.map(|entry| sign * entry / length)
}

/// A rotation, by rows, whose third column points along `axis`, of any non-zero length; along z if it is zero.
///
/// ```
/// let rotation = supple_model::scene::turned_to([2.0, 0.0, 0.0]);
/// assert_eq!(rotation.map(|row| row[2]), [1.0, 0.0, 0.0]);
/// ```
#[must_use]
pub fn turned_to(axis: [f64; 3]) -> [[f64; 3]; 3] {
    use supple_robot::vector::{cross, dot, scale, sub};
    let length = dot(axis, axis).sqrt();
    if !(length > 0.0 && length.is_finite()) {
        return Pose::IDENTITY.rotation;
    }
    let axis = scale(1.0 / length, axis);
    let least = (0..3).fold(0, |least, i| if axis[i].abs() < axis[least].abs() { i } else { least });
    let mut helper = [0.0; 3];
    helper[least] = 1.0;
    let across = sub(helper, scale(axis[least], axis));
    let first = scale(1.0 / dot(across, across).sqrt(), across);
    let second = cross(axis, first);
    [0, 1, 2].map(|row| [first[row], second[row], axis[row]])
}
