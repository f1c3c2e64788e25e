//! What a robot's file holds besides links and joints: actuators, sensors, keyframes and walls. SI units and radians.

use crate::Pose;

/// An actuator at a joint.
///
/// Its *length* is `l = gear q`, with the joint's position `q`. The torque or force on the joint is
///
/// ```text
/// tau = gear force        force = gain u + offset - kp l - kv l'
/// ```
///
/// with the control `u` and the numbers of its [`Law`].
///
/// ```
/// use supple_robot::{Law, LoadOptions, LockedJoint, Measured, Omitted, WallShape};
///
/// let text = r#"<mujoco><worldbody>
///         <geom name="floor" type="plane" size="1 1 0.1"/>
///         <body name="rod" pos="0 0 2">
///             <inertial pos="0 0 -0.5" mass="2" diaginertia="0.1 0.1 0.1"/>
///             <joint name="hinge" axis="0 1 0"/>
///             <site name="tip" pos="0 0 -1"/>
///         </body>
///     </worldbody>
///     <actuator><motor name="drive" joint="hinge" gear="50"/></actuator>
///     <sensor><jointpos name="encoder" joint="hinge" noise="0.001"/></sensor>
///     <keyframe><key name="aside" qpos="0.1"/></keyframe></mujoco>"#;
/// let robot = supple_robot::parse(text, "pendulum.xml", &LoadOptions::default())?;
/// let (drive, encoder) = (&robot.actuators[0], &robot.sensors[0]);
/// assert_eq!((drive.joint, drive.gear, drive.law), (0, 50.0, Law::Motor { gain: 1.0 }));
/// assert_eq!((encoder.measures, encoder.noise), (Measured::JointPosition(0), 0.001));
/// let (key, wall, frame) = (&robot.keys[0], &robot.walls[0], &robot.frames[0]);
/// assert_eq!((key.name.as_str(), &key.positions), ("aside", &vec![0.1]));
/// assert_eq!((wall.name.as_str(), wall.shape), ("floor", WallShape::Plane));
/// assert_eq!((frame.name.as_str(), frame.link), ("tip", 1));
///
/// // With its joint locked, the robot has neither drive nor encoder.
/// let locked = robot.locked(&[LockedJoint { joint: 0, position: 0.1 }]);
/// assert_eq!((locked.omitted[0].name.as_str(), locked.omitted[0].why.as_str()), ("drive", Omitted::LOCKED));
/// # Ok::<(), supple_text::FileError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Actuator {
    /// Its name, unique among actuators; the name of its joint if the file gives none.
    pub name: String,
    /// Index of the joint that it drives, which is not fixed and follows no other joint.
    pub joint: usize,
    /// Length per unit of joint position, and joint torque per unit of force; not 0.
    pub gear: f64,
    /// The law for its force, given the control.
    pub law: Law,
    /// The least and greatest control; infinite where the file sets no limit. In the unit of the control: see [`Law`].
    pub control: [f64; 2],
    /// The least and greatest force before the gear, N m or N; infinite where the file sets no limit.
    pub force: [f64; 2],
    /// Line in the file.
    pub line: usize,
}

/// The law for an actuator's force, given its control `u`, length `l` and rate `l'`.
///
/// Example: [`Actuator`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Law {
    /// `force = gain u`. With a gain of 1 the control is the force, N m or N.
    Motor {
        /// Force for a unit of control.
        gain: f64,
    },
    /// `force = kp (u - l) - kv l'`. The control is a length, rad or m.
    Position {
        /// Stiffness, N m/rad or N/m.
        kp: f64,
        /// Damping, N m s/rad or N s/m.
        kv: f64,
    },
    /// `force = kv (u - l')`. The control is a rate, rad/s or m/s.
    Velocity {
        /// Damping, N m s/rad or N s/m.
        kv: f64,
    },
    /// `force = gain u + offset - kp l - kv l'`. The unit of the control is the file's own.
    Affine {
        /// Force for a unit of control.
        gain: f64,
        /// Force at control, length and rate 0, N m or N.
        offset: f64,
        /// Stiffness, N m/rad or N/m.
        kp: f64,
        /// Damping, N m s/rad or N s/m.
        kv: f64,
    },
}

impl Law {
    /// The law `force = gain u + offset - kp l - kv l'` with these numbers, in the simplest form that represents them.
    #[must_use]
    pub fn new(gain: f64, offset: f64, kp: f64, kv: f64) -> Self {
        match (offset, kp, kv) {
            (0.0, 0.0, 0.0) => Self::Motor { gain },
            (0.0, kp, kv) if kp == gain && kp != 0.0 => Self::Position { kp, kv },
            (0.0, 0.0, kv) if kv == gain => Self::Velocity { kv },
            _ => Self::Affine { gain, offset, kp, kv },
        }
    }

    /// What it is called: `motor`, `position`, `velocity` or `affine`.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Self::Motor { .. } => "motor",
            Self::Position { .. } => "position",
            Self::Velocity { .. } => "velocity",
            Self::Affine { .. } => "affine",
        }
    }
}

/// A sensor of the file.
///
/// Example: [`Actuator`].
#[derive(Clone, Debug, PartialEq)]
pub struct Sensor {
    /// Its name, unique among sensors.
    pub name: String,
    /// What it measures.
    pub measures: Measured,
    /// Standard deviation of its noise as the file gives it, in the unit of the measurement; 0 where it gives none.
    pub noise: f64,
    /// Line in the file.
    pub line: usize,
}

/// What a sensor of the file measures.
///
/// Example: [`Actuator`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Measured {
    /// Position of the joint with this index, rad or m.
    JointPosition(usize),
    /// Velocity of the joint with this index, rad/s or m/s.
    JointVelocity(usize),
    /// Torque or force that actuators exert on the joint with this index, N m or N.
    JointTorque(usize),
    /// Position in the world of the frame with this number, m: links first, then [`Robot::frames`](crate::Robot::frames).
    FramePosition(usize),
    /// Orientation in the world of the frame with this number: links first, then [`Robot::frames`](crate::Robot::frames).
    FrameOrientation(usize),
}

impl Measured {
    /// What it is called.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Self::JointPosition(_) => "joint position",
            Self::JointVelocity(_) => "joint velocity",
            Self::JointTorque(_) => "joint torque",
            Self::FramePosition(_) => "frame position",
            Self::FrameOrientation(_) => "frame orientation",
        }
    }
}

/// An actuator or a sensor of the file that cannot be modelled.
///
/// Example: [`Actuator`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Omitted {
    /// Which of the two it is: `actuator` or `sensor`.
    pub what: &'static str,
    /// Its name.
    pub name: String,
    /// Why it cannot be modelled, as the end of a sentence: "its transmission is a tendon".
    pub why: String,
    /// Line in the file.
    pub line: usize,
}

impl Omitted {
    /// Reason for omitting actuators and sensors of a locked joint.
    pub const LOCKED: &str = "its joint is locked";
}

/// A keyframe: a state of the robot with a name, and controls for it.
///
/// Example: [`Actuator`].
#[derive(Clone, Debug, PartialEq)]
pub struct Key {
    /// Its name, unique among keyframes; `keyN`, numbered from 0, if the file gives none.
    pub name: String,
    /// Position of every joint of [`Robot::joints`](crate::Robot::joints), rad or m; 0 for those that are fixed.
    pub positions: Vec<f64>,
    /// Velocity of every joint of [`Robot::joints`](crate::Robot::joints), rad/s or m/s; 0 for those that are fixed.
    pub velocities: Vec<f64>,
    /// Control of every actuator of [`Robot::actuators`](crate::Robot::actuators), in the unit of the control; 0 where the
    /// file gives none.
    pub controls: Vec<f64>,
    /// Line in the file.
    pub line: usize,
}

/// A plane or a box of the environment, which does not move.
///
/// Example: [`Actuator`].
#[derive(Clone, Debug, PartialEq)]
pub struct Wall {
    /// Its name, unique among walls.
    pub name: String,
    /// What it is.
    pub shape: WallShape,
    /// Its pose in the world. The origin is the centre of a box, or a point of a plane, whose normal is z.
    pub pose: Pose,
    /// Line in the file.
    pub line: usize,
}

/// What a wall is.
///
/// Example: [`Actuator`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum WallShape {
    /// An infinite plane.
    Plane,
    /// A box with these half lengths along its axes, m.
    Box([f64; 3]),
}

impl Wall {
    /// The outward normal of a face in the world, and a point of the face, m. `axis` is 0, 1 or 2 for x, y or z of the
    /// wall, and `negative` selects the opposite face. A plane has only the face +z; `None` if there is no such
    /// face.
    #[must_use]
    pub fn face(&self, axis: usize, negative: bool) -> Option<([f64; 3], [f64; 3])> {
        let half = match self.shape {
            WallShape::Plane if axis == 2 && !negative => 0.0,
            WallShape::Plane => return None,
            WallShape::Box(halves) => *halves.get(axis)?,
        };
        let sign = if negative { -1.0 } else { 1.0 };
        let normal = self.pose.rotation.map(|row| sign * row[axis]);
        let at = self.pose.position;
        Some((normal, [0, 1, 2].map(|entry| at[entry] + half * normal[entry])))
    }
}
