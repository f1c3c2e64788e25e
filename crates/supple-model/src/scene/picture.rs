use super::{ConnectionKind, MeshFile, Pose, Shape};

/// What a model looks like at one point.
///
/// ```
/// use supple_model::scene::LandmarkKind;
/// use supple_model::system::{Authored, System};
/// use supple_model::TwoMass;
///
/// let model = TwoMass {
///     mass: [0.8.into(), 0.4.into()],
///     damping: [60.0.into(), 35.0.into()],
///     stiffness: [300.0.into(), 200.0.into()],
///     contact_smoothing: 0.0.into(),
/// };
/// let system = Authored::new(model, Vec::new(), 0.02, 0);
/// let seen = system.picture(&[0.0, 0.0, 0.0, 0.0, 0.75], &[0.0], &[]).ok_or("it can be drawn")?;
/// assert_eq!(seen.picture.bodies.iter().map(|body| body.name.as_str()).collect::<Vec<_>>(), ["m1", "m2"]);
/// assert_eq!(seen.picture.connections[0].name, "spring");
/// assert!(matches!(seen.picture.landmarks[1].kind, LandmarkKind::Wall { .. }));
/// assert_eq!(seen.positions[1], [0.75, 0.0, 0.0]);
/// # Ok::<(), &'static str>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Picture {
    /// A typical length of what is drawn, m.
    pub size: f64,
    /// What is there: the same bodies at every point.
    pub bodies: Vec<PlacedBody>,
    /// Springs, bushings and contacts: the same at every point.
    pub connections: Vec<PlacedConnection>,
    /// The points that [`Model::landmarks`](crate::Model::landmarks) gives, in their order.
    pub landmarks: Vec<Landmark>,
}

/// A body at its pose.
///
/// Example: [`Picture`].
#[derive(Clone, Debug, PartialEq)]
pub struct PlacedBody {
    /// Its name.
    pub name: String,
    /// What it looks like beside its meshes; or what stands in for it where nothing of it can be shown. The same at every
    /// point.
    pub shapes: Vec<Shape>,
    /// Its meshes.
    pub meshes: Vec<MeshFile>,
    /// Where it is in the world.
    pub pose: Pose,
}

/// A connection at one point.
///
/// Example: [`Picture`].
#[derive(Clone, Debug, PartialEq)]
pub struct PlacedConnection {
    /// Its name.
    pub name: String,
    /// What it is.
    pub kind: ConnectionKind,
    /// Where the first end is, m in the world.
    pub from: [f64; 3],
    /// Where the second end is.
    pub to: [f64; 3],
    /// Force on what is at the second end, N.
    pub force: [f64; 3],
    /// Torque on what is at the second end, N m.
    pub torque: [f64; 3],
}

/// A point with uncertain position.
///
/// Example: [`Picture`].
#[derive(Clone, Debug, PartialEq)]
pub struct Landmark {
    /// Its name.
    pub name: String,
    /// What it is.
    pub kind: LandmarkKind,
}

/// What a landmark is.
///
/// Example: [`Picture`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LandmarkKind {
    /// A point of a body.
    Point,
    /// A point of a wall.
    Wall {
        /// The wall's normal, out of it, of length 1.
        normal: [f64; 3],
        /// The point that may touch the wall, m: the plate is drawn to cover its path.
        touch: [f64; 3],
    },
}

/// A picture with the positions of its landmarks and their derivatives with respect to the state.
///
/// Example: [`Picture`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Seen {
    /// The picture.
    pub picture: Picture,
    /// Where each landmark is, m.
    pub positions: Vec<[f64; 3]>,
    /// Their derivatives by the state: three rows of length n each.
    pub jacobians: Vec<[Vec<f64>; 3]>,
}
