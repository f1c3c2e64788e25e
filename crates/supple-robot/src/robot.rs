//! A robot as a file describes it. SI units and radians throughout.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use crate::pose::{dot, sub};
use crate::{Actuator, Key, Law, Omitted, Pose, Sensor, Wall};

/// A tree of links and joints, as a file describes it.
///
/// Joint `i` moves link `i + 1`: the list of links begins with the root, which is fixed in the world, and every link
/// stands after its parent.
///
/// ```
/// use supple_robot::{JointKind, LoadOptions};
/// # let text = r#"<robot name="pendulum"><link name="world"/>
/// #     <joint name="hinge" type="continuous"><parent link="world"/><child link="rod"/><axis xyz="0 1 0"/></joint>
/// #     <link name="rod"><inertial><origin xyz="0 0 -0.5"/><mass value="2"/>
/// #         <inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link></robot>"#;
/// // The pendulum of the front page.
/// let robot = supple_robot::parse(text, "pendulum.urdf", &LoadOptions::default())?;
/// let joint = &robot.joints[0];
/// assert_eq!((joint.name.as_str(), joint.kind), ("hinge", JointKind::Continuous));
/// assert_eq!(joint.limits.upper, f64::INFINITY, "it may turn without limits");
/// let rod = &robot.links[1];
/// assert_eq!(rod.inertia.map(|inertia| inertia.mass), Some(2.0));
/// # Ok::<(), supple_text::FileError>(())
/// ```
#[derive(Clone, Debug, Default)]
pub struct Robot {
    /// Its name.
    pub name: String,
    /// The links, the root first, each after its parent.
    pub links: Vec<Link>,
    /// The joints; joint `i` has `links[i + 1]` as its child.
    pub joints: Vec<Joint>,
    /// Named frames besides those of the links: MJCF sites, SDF frames.
    pub frames: Vec<Frame>,
    /// Gravity specified by the file, m/s^2 in the world; `None` if the format has none.
    pub gravity: Option<[f64; 3]>,
    /// Actuators at joints, in the order of the file; only MJCF files have them.
    pub actuators: Vec<Actuator>,
    /// Sensors, in the order of the file; only MJCF files have them.
    pub sensors: Vec<Sensor>,
    /// Keyframes, in the order of the file; only MJCF files have them.
    pub keys: Vec<Key>,
    /// Named planes and boxes that do not move; only MJCF files have them.
    pub walls: Vec<Wall>,
    /// Actuators and sensors of the file that cannot be modelled, each with the reason.
    pub omitted: Vec<Omitted>,
    /// Files that the file includes, in the order in which they were read; only MJCF files include others.
    pub included: Vec<PathBuf>,
    /// Unsupported and suspicious parts of the file: one sentence for all of a kind.
    pub warnings: Vec<String>,
    /// The same with a separate sentence for each occurrence.
    pub every_warning: Vec<String>,
    /// Those of them about parts of the file that exert forces, and are left out: the robot moves differently.
    pub left_out_forces: Vec<String>,
}

/// A rigid body.
///
/// Example: [`Robot`].
#[derive(Clone, Debug)]
pub struct Link {
    /// Its name, unique among links.
    pub name: String,
    /// Its inertia; `None` if the file gives none.
    pub inertia: Option<Inertia>,
    /// Files of its visual meshes with their poses in the link and scales, each inside the robot file's folder or a
    /// declared package root. Not read here.
    pub meshes: Vec<Mesh>,
    /// Its visual boxes, balls and the like.
    pub primitives: Vec<Primitive>,
    /// Line in the file.
    pub line: usize,
}

/// A visual shape that needs no mesh.
///
/// ```
/// use supple_robot::{Pose, Primitive, Solid};
///
/// // A rod from the origin of its link to 0.3 m above.
/// let rod = Primitive { solid: Solid::Cylinder { radius: 0.02, length: 0.3 }, pose: Pose::at([0.0, 0.0, 0.15]) };
/// assert_eq!(rod.reach([0.0, 0.0, 1.0]), 0.3);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Primitive {
    /// What it is.
    pub solid: Solid,
    /// Where its centre is in its link.
    pub pose: Pose,
}

impl Primitive {
    /// How far it reaches in a direction of length 1, from the origin of its link, m.
    #[must_use]
    pub fn reach(&self, along: [f64; 3]) -> f64 {
        dot(self.pose.position, along) + self.solid.reach(self.pose.unrotate(along))
    }

    /// Where it ends in a direction of length 1, in its link, m: straight from the origin of the link if that is on it, and
    /// otherwise in the middle of the face, edge or end that is farthest.
    ///
    /// ```
    /// use supple_robot::{Pose, Primitive, Solid};
    ///
    /// // A plate beside the origin of its link, and one above it.
    /// let plate = |at| Primitive { solid: Solid::Box { size: [0.2, 0.2, 0.02] }, pose: Pose::at(at) };
    /// assert_eq!(plate([0.3, 0.0, 0.1]).end([0.0, 0.0, 1.0]), [0.3, 0.0, 0.11]);
    /// assert_eq!(plate([0.05, 0.0, 0.1]).end([0.0, 0.0, 1.0]), [0.0, 0.0, 0.11]);
    /// ```
    #[must_use]
    pub fn end(&self, along: [f64; 3]) -> [f64; 3] {
        let straight = along.map(|entry| self.reach(along) * entry);
        match self.solid.holds(self.pose.unrotate(sub(straight, self.pose.position))) {
            true => straight,
            false => self.pose.apply(self.solid.end(self.pose.unrotate(along))),
        }
    }
}

/// How far beside a solid a point still counts as on it, m.
const BESIDE: f64 = 1e-6;

/// A solid about its own centre; lengths in m.
///
/// Example: [`Primitive`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Solid {
    /// Edges along x, y and z.
    Box {
        /// Their lengths.
        size: [f64; 3],
    },
    /// A ball.
    Sphere {
        /// Its radius.
        radius: f64,
    },
    /// With its axis along z.
    Cylinder {
        /// Its radius.
        radius: f64,
        /// Its length.
        length: f64,
    },
    /// With its axis along z: a cylinder with half a ball on either end.
    Capsule {
        /// Its radius.
        radius: f64,
        /// Its length without the half balls.
        length: f64,
    },
    /// With its axes along x, y and z.
    Ellipsoid {
        /// Half of their lengths.
        radii: [f64; 3],
    },
}

impl Solid {
    /// How far it reaches in a direction of length 1, from its centre, m.
    ///
    /// ```
    /// use supple_robot::Solid;
    ///
    /// assert_eq!(Solid::Box { size: [2.0, 4.0, 6.0] }.reach([0.0, 1.0, 0.0]), 2.0);
    /// assert_eq!(Solid::Capsule { radius: 0.1, length: 1.0 }.reach([0.0, 0.0, -1.0]), 0.6);
    /// ```
    #[must_use]
    pub fn reach(self, along: [f64; 3]) -> f64 {
        let [x, y, z] = along;
        match self {
            Self::Box { size } => 0.5 * dot(size, along.map(f64::abs)),
            Self::Sphere { radius } => radius,
            Self::Cylinder { radius, length } => radius * x.hypot(y) + 0.5 * length * z.abs(),
            Self::Capsule { radius, length } => radius + 0.5 * length * z.abs(),
            Self::Ellipsoid { radii: [a, b, c] } => (a * x).hypot(b * y).hypot(c * z),
        }
    }

    /// Whether it holds a point, from its centre, m.
    fn holds(self, [x, y, z]: [f64; 3]) -> bool {
        let within = |length: f64, most: f64| length <= most + BESIDE;
        match self {
            Self::Box { size: [a, b, c] } => {
                [(x, a), (y, b), (z, c)].into_iter().all(|(p, s)| within(p.abs(), 0.5 * s))
            }
            Self::Sphere { radius } => within(x.hypot(y).hypot(z), radius),
            Self::Cylinder { radius, length } => within(x.hypot(y), radius) && within(z.abs(), 0.5 * length),
            Self::Capsule { radius, length } => {
                let beyond = (z.abs() - 0.5 * length).max(0.0);
                within(x.hypot(y).hypot(beyond), radius)
            }
            Self::Ellipsoid { radii: [a, b, c] } => within((x / a).hypot(y / b).hypot(z / c), 1.0),
        }
    }

    /// Where it ends in a direction of length 1, from its centre, m: in the middle of the face, edge or end that is farthest.
    fn end(self, along: [f64; 3]) -> [f64; 3] {
        let [x, y, z] = along;
        // The half of a length towards an entry of the direction that is not much smaller than another.
        let half = |length: f64, entry: f64, other: f64| {
            if entry.abs() >= 0.5 * other { 0.5 * length * entry.signum() } else { 0.0 }
        };
        match self {
            Self::Box { size: [a, b, c] } => {
                let most = x.abs().max(y.abs()).max(z.abs());
                [half(a, x, most), half(b, y, most), half(c, z, most)]
            }
            Self::Sphere { radius } => along.map(|entry| radius * entry),
            Self::Cylinder { radius, length } => {
                let aside = x.hypot(y);
                let outwards = if aside >= 0.5 * z.abs() { radius / aside } else { 0.0 };
                [outwards * x, outwards * y, half(length, z, aside)]
            }
            Self::Capsule { radius, length } => [radius * x, radius * y, radius * z + half(length, z, x.hypot(y))],
            Self::Ellipsoid { radii } => {
                let size = self.reach(along);
                [0, 1, 2].map(|axis| radii[axis].powi(2) * along[axis] / size)
            }
        }
    }

    /// Whether all its lengths are positive and finite.
    pub(crate) fn is_sound(self) -> bool {
        let is_length = |length: f64| length > 0.0 && length.is_finite();
        match self {
            Self::Box { size: lengths } | Self::Ellipsoid { radii: lengths } => lengths.into_iter().all(is_length),
            Self::Sphere { radius } => is_length(radius),
            Self::Cylinder { radius, length } | Self::Capsule { radius, length } => {
                is_length(radius) && is_length(length)
            }
        }
    }
}

/// A visual mesh.
///
/// ```
/// use supple_robot::{Mesh, Pose};
///
/// // The vertices are in mm, and the mesh is 0.1 m above the origin of its link. Its vertex (50, 0, 0) in the link:
/// let mesh = Mesh { path: "hand.stl".into(), pose: Pose::at([0.0, 0.0, 0.1]), scale: [1e-3; 3] };
/// let point = mesh.pose.apply([50.0 * mesh.scale[0], 0.0, 0.0]);
/// assert!((point[0] - 0.05).abs() < 1e-12 && point[2] == 0.1);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Mesh {
    /// Where the file is.
    pub path: PathBuf,
    /// Where it is in its link.
    pub pose: Pose,
    /// Factor by axis.
    pub scale: [f64; 3],
}

/// The inertia of a link.
///
/// Example: [`Robot`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Inertia {
    /// Mass, kg; at least 0.
    pub mass: f64,
    /// Centre of mass in the link's frame, m.
    pub center: [f64; 3],
    /// Moments of inertia about the centre of mass, in the link's axes, kg m^2: symmetric, positive semidefinite.
    pub moment: [[f64; 3]; 3],
}

/// Kinds of motion that a joint allows.
///
/// Example: [`Robot`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum JointKind {
    /// No motion.
    Fixed,
    /// Turn about the axis, within limits.
    Revolute,
    /// Turn about the axis without limits.
    Continuous,
    /// Slide along the axis.
    Prismatic,
}

/// A joint, which carries a link.
///
/// ```text
/// parent link --origin--> joint frame --motion(position - reference)--> joint frame, moved --child_pose--> child link
/// ```
///
/// Example: [`Robot`].
#[derive(Clone, Debug)]
pub struct Joint {
    /// Its name, unique among joints.
    pub name: String,
    /// The motion that it allows.
    pub kind: JointKind,
    /// Index of the parent link.
    pub parent: usize,
    /// The joint's frame in the parent link.
    pub origin: Pose,
    /// The child link in the joint's frame.
    pub child_pose: Pose,
    /// Axis in the joint's frame, of length 1.
    pub axis: [f64; 3],
    /// Position at which the moved joint frame coincides with the joint frame: 0, except for MJCF's `ref`.
    pub reference: f64,
    /// Viscous damping, N m s/rad or N s/m; at least 0.
    pub damping: f64,
    /// Coulomb friction, N m or N; at least 0.
    pub friction: f64,
    /// Inertia of the drive, felt at the joint, kg m^2 or kg; at least 0.
    pub armature: f64,
    /// Stiffness of a spring in the joint, N m/rad or N/m; at least 0.
    pub stiffness: f64,
    /// Position at which that spring is at rest.
    pub rest: f64,
    /// Its limits: the stricter of its own in the file and those that the joints which follow it imply.
    pub limits: Limits,
    /// Which joints' limits those are.
    pub narrowed: Narrowed,
    /// The joint that it follows.
    pub mimic: Option<Mimic>,
    /// Line in the file.
    pub line: usize,
}

impl Joint {
    /// A joint at the origins of its links, about or along x, without limits and free of forces.
    #[must_use]
    pub fn free(name: String, kind: JointKind, parent: usize) -> Self {
        Self {
            name,
            kind,
            parent,
            origin: Pose::IDENTITY,
            child_pose: Pose::IDENTITY,
            axis: [1.0, 0.0, 0.0],
            reference: 0.0,
            damping: 0.0,
            friction: 0.0,
            armature: 0.0,
            stiffness: 0.0,
            rest: 0.0,
            limits: Limits::default(),
            narrowed: Narrowed::default(),
            mimic: None,
            line: 0,
        }
    }
}

/// Limits of a joint; infinite if not given.
///
/// Example: [`Robot`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Least position, rad or m.
    pub lower: f64,
    /// Greatest position, rad or m.
    pub upper: f64,
    /// Greatest speed, rad/s or m/s.
    pub velocity: f64,
    /// Greatest torque or force of its drive, N m or N; 0 if it has no drive while other joints do.
    pub effort: f64,
}

impl Default for Limits {
    fn default() -> Self {
        Self { lower: f64::NEG_INFINITY, upper: f64::INFINITY, velocity: f64::INFINITY, effort: f64::INFINITY }
    }
}

/// Names of the joints that follow a joint and whose limits are stricter on it than its own.
///
/// ```
/// use supple_robot::LoadOptions;
///
/// let text = r#"<robot name="gripper"><link name="palm"/><link name="left"/><link name="right"/>
///     <joint name="slide" type="prismatic"><parent link="palm"/><child link="left"/>
///         <limit lower="0" upper="0.04" effort="10" velocity="1"/></joint>
///     <joint name="other" type="prismatic"><parent link="palm"/><child link="right"/>
///         <limit lower="-0.06" upper="0" effort="10" velocity="1"/>
///         <mimic joint="slide" multiplier="-2"/></joint></robot>"#;
/// let robot = supple_robot::parse(text, "gripper.urdf", &LoadOptions::default())?;
/// let slide = &robot.joints[0];
/// assert_eq!((slide.limits.upper, slide.limits.velocity), (0.03, 0.5));
/// assert_eq!(slide.narrowed.position, ["other"]);
/// # Ok::<(), supple_text::FileError>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Narrowed {
    /// Those that limit its position.
    pub position: Vec<String>,
    /// Those that limit its velocity.
    pub velocity: Vec<String>,
}

/// How a joint follows another: `position = ratio * position of the other + offset`.
///
/// ```
/// use supple_robot::{LoadOptions, Mimic, Tree};
///
/// let text = r#"<robot name="gripper"><link name="palm"/><link name="left"/><link name="right"/>
///     <joint name="slide" type="prismatic"><parent link="palm"/><child link="left"/>
///         <limit lower="0" upper="0.04" effort="10" velocity="1"/></joint>
///     <joint name="other" type="prismatic"><parent link="palm"/><child link="right"/>
///         <limit lower="-0.04" upper="0" effort="10" velocity="1"/>
///         <mimic joint="slide" multiplier="-1"/></joint></robot>"#;
/// let robot = supple_robot::parse(text, "gripper.urdf", &LoadOptions::default())?;
/// assert_eq!(robot.joints[1].mimic, Some(Mimic { joint: 0, ratio: -1.0, offset: 0.0 }));
/// assert_eq!(Tree::new(&robot).joints(), ["slide"]);
/// # Ok::<(), supple_text::FileError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mimic {
    /// Index of the joint that is followed.
    pub joint: usize,
    /// Ratio.
    pub ratio: f64,
    /// Offset, rad or m.
    pub offset: f64,
}

/// A named frame on a link.
///
/// Example: [`Actuator`].
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    /// Its name.
    pub name: String,
    /// Index of its link.
    pub link: usize,
    /// Where it is in the link.
    pub pose: Pose,
}

impl Robot {
    /// The greatest torque or force on a joint, N m or N, from its own limit and, if actuators of the file drive
    /// it, from their control and force ranges; infinite if unlimited. Control ranges limit only the force of
    /// motors.
    #[must_use]
    pub fn greatest_effort(&self, joint: usize) -> f64 {
        let most = |range: [f64; 2]| range[0].abs().max(range[1].abs());
        let of = |actuator: &Actuator| {
            let by_control = match actuator.law {
                Law::Motor { gain } => gain.abs() * most(actuator.control),
                _ => f64::INFINITY,
            };
            actuator.gear.abs() * by_control.min(most(actuator.force))
        };
        let own = match self.joints[joint].limits.effort {
            effort if effort > 0.0 => effort,
            _ => f64::INFINITY,
        };
        let mut driven = self.actuators.iter().filter(|actuator| actuator.joint == joint).peekable();
        if driven.peek().is_none() { own } else { own.min(driven.map(of).sum()) }
    }

    /// The link `name`.
    #[must_use]
    pub fn link(&self, name: &str) -> Option<usize> {
        self.links.iter().position(|link| link.name == name)
    }

    /// The joint `name`.
    #[must_use]
    pub fn joint(&self, name: &str) -> Option<usize> {
        self.joints.iter().position(|joint| joint.name == name)
    }

    /// The frame `name`: a link's own, or another named one. Link and place in it.
    #[must_use]
    pub fn frame(&self, name: &str) -> Option<(usize, Pose)> {
        let own = self.link(name).map(|link| (link, Pose::IDENTITY));
        own.or_else(|| self.frames.iter().find(|frame| frame.name == name).map(|frame| (frame.link, frame.pose)))
    }
}

impl Robot {
    /// The actuator `name`.
    #[must_use]
    pub fn actuator(&self, name: &str) -> Option<&Actuator> {
        self.actuators.iter().find(|actuator| actuator.name == name)
    }

    /// The keyframe `name`.
    #[must_use]
    pub fn key(&self, name: &str) -> Option<&Key> {
        self.keys.iter().find(|key| key.name == name)
    }

    /// The wall `name`.
    #[must_use]
    pub fn wall(&self, name: &str) -> Option<&Wall> {
        self.walls.iter().find(|wall| wall.name == name)
    }

    /// Whether the joint of an actuator slides: its force is then in N, and not in N m.
    #[must_use]
    pub fn slides(&self, actuator: &Actuator) -> bool {
        self.joints.get(actuator.joint).is_some_and(|joint| joint.kind == JointKind::Prismatic)
    }
}
