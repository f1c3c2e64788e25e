//! What an author writes: the physics of a robot and its environment, once, over any [`Scalar`].

use supple_kernels::{Ldl, Scalar};
use supple_lqg::Dimensions;

use crate::channels::{Channels, Drive, Limit};
use crate::contacts::{Contact, ContactState};
use crate::scene::Picture;
use crate::value::Value;

/// A model's own cost, in a stage or at the end: a norm of a residual.
///
/// ```
/// use supple_model::system::{Authored, System};
/// use supple_model::{Dimensions, Model, OwnCost, Point, Scalar, Scratch};
///
/// /// `x+ = u`, with its own stage cost `x^2` in place of costs of a task.
/// struct Follower;
///
/// impl Model for Follower {
///     fn dimensions(&self) -> Dimensions {
///         Dimensions { states: 1, controls: 1, measurements: 1 }
///     }
///     fn step<S: Scalar>(&self, at: &Point<S>, next: &mut [S]) {
///         next[0] = at.u[0];
///     }
///     fn observe<S: Scalar>(&self, at: &Point<S>, y: &mut [S]) {
///         y[0] = at.x[0];
///     }
///     fn own_cost(&self, last: bool) -> Option<OwnCost> {
///         (!last).then_some(OwnCost { residuals: 1, convex: true })
///     }
///     fn own_residual<S: Scalar>(&self, at: &Point<S>, _last: bool, out: &mut [S]) {
///         out[0] = at.x[0];
///     }
///     fn own_norm<S: Scalar>(&self, residual: &[S], _phi: &[S], _time_step: S, _last: bool) -> S {
///         residual[0] * residual[0]
///     }
/// }
///
/// let system = Authored::new(Follower, Vec::new(), 0.1, 0);
/// assert_eq!(system.stage_cost(0, &[3.0], &[0.0], &[], &mut Scratch::new()), 9.0);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OwnCost {
    /// How many entries the residual has.
    pub residuals: usize,
    /// Whether the norm is convex for all parameters, so that its Gauss-Newton curvature is never indefinite. If not, or
    /// if unknown, the curvature is made positive semidefinite at every point.
    pub convex: bool,
}

/// The point at which a model is evaluated.
///
/// Example: [`Model`].
#[derive(Clone, Copy, Debug)]
pub struct Point<'a, S> {
    /// State.
    pub x: &'a [S],
    /// Control. In measurements and final costs it is zero and must not matter.
    pub u: &'a [S],
    /// All parameters, in the order in which they were declared.
    pub phi: &'a [S],
    /// Time step, s: that of one integration step in [`Model::step`] and related functions, that of the task elsewhere.
    pub time_step: S,
    /// The unknowns that a step solves for (see [`Model::unknowns`]); empty in measurements, signals and costs.
    pub w: &'a [S],
}

impl<S: Scalar> Point<'_, S> {
    /// A value of the model's at this point: a number, or the parameter that it names.
    pub fn value(&self, value: &Value) -> S {
        value.resolve(self.phi)
    }
}

/// Signals of a frame, in order: its origin, m, and its rotation matrix by rows in the world;
/// the velocity of its origin, m/s, and its angular velocity, rad/s, in the axes of the world.
///
/// Example: [`frame_signals`].
pub const FRAME_SIGNALS: [&str; 18] =
    ["x", "y", "z", "xx", "xy", "xz", "yx", "yy", "yz", "zx", "zy", "zz", "vx", "vy", "vz", "wx", "wy", "wz"];

/// The total number of signals for this many frames.
///
/// ```
/// use supple_model::{FRAME_SIGNALS, frame_signals};
///
/// assert_eq!((frame_signals(2), FRAME_SIGNALS[3]), (36, "xx"));
/// ```
#[must_use]
pub const fn frame_signals(frames: usize) -> usize {
    frames * FRAME_SIGNALS.len()
}

/// The signals of a robot's centre of mass in the world, m.
///
/// ```
/// assert_eq!(supple_model::CENTER_OF_MASS[2], "center_of_mass_z");
/// ```
pub const CENTER_OF_MASS: [&str; 3] = ["center_of_mass_x", "center_of_mass_y", "center_of_mass_z"];

/// Prefix of the signal of a drive's mechanical power, W; the drive's name follows.
///
/// ```
/// // The signal of the drive `elbow`.
/// assert_eq!(format!("{}elbow", supple_model::POWER), "power_elbow");
/// ```
pub const POWER: &str = "power_";

/// Prefix of the signal of the torque or force that a drive exerts on its joint, N m or N; the drive's name follows.
///
/// ```
/// // The signal of the drive `elbow`.
/// assert_eq!(format!("{}elbow", supple_model::EFFORT), "effort_elbow");
/// ```
pub const EFFORT: &str = "effort_";

/// A sensor of a robot's file.
///
/// ```
/// use supple_model::{FileSensor, Sensed};
///
/// let encoder = FileSensor { name: "encoder".to_owned(), measures: Sensed::JointPosition("elbow".to_owned()) };
/// assert!(matches!(encoder.measures, Sensed::JointPosition(joint) if joint == "elbow"));
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct FileSensor {
    /// Its name.
    pub name: String,
    /// What it measures.
    pub measures: Sensed,
}

/// What a sensor of a robot's file measures.
///
/// Example: [`FileSensor`].
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Sensed {
    /// The position of a joint.
    JointPosition(String),
    /// The velocity of a joint.
    JointVelocity(String),
    /// The torque through an elastic joint.
    JointTorque(String),
    /// The position of the frame whose signals begin at an index.
    FramePosition {
        /// The place of its first signal.
        first: usize,
    },
    /// The rotation of the frame whose signals begin at an index, from a reference given as a rotation matrix by rows.
    FrameOrientation {
        /// The place of its first signal.
        first: usize,
        /// The reference orientation, at which the rotation is 0.
        reference: [[f64; 3]; 3],
    },
    /// A sensor that is not supported.
    Nothing {
        /// Its line in the file.
        line: usize,
        /// Why.
        why: String,
    },
}

/// A robot and its environment in discrete time: `x+ = f(x, u; phi) + w`, `y = g(x; phi) + v`.
///
/// A new model only needs one `impl` with the physics: it is recorded once, and derivatives of all orders are taken from
/// the recording. Do not branch on values; use [`Scalar::select`].
///
/// ```
/// use supple_model::{Dimensions, Model, Point, Scalar, Value};
///
/// /// A pendulum with a torque at its joint; its angle is measured.
/// struct Pendulum { length: Value }
///
/// impl Model for Pendulum {
///     fn dimensions(&self) -> Dimensions {
///         Dimensions { states: 2, controls: 1, measurements: 1 }
///     }
///     fn step<S: Scalar>(&self, at: &Point<S>, next: &mut [S]) {
///         let (angle, rate) = (at.x[0], at.x[1]);
///         next[0] = angle + at.time_step * rate;
///         next[1] = rate + at.time_step * (at.u[0] - angle.sin() * 9.81 / at.value(&self.length));
///     }
///     fn observe<S: Scalar>(&self, at: &Point<S>, y: &mut [S]) {
///         y[0] = at.x[0];
///     }
/// }
/// ```
pub trait Model: Send + Sync + 'static {
    /// Lengths of state, control and measurement.
    fn dimensions(&self) -> Dimensions;

    /// The next state `f(x, u; phi)`, without noise: one integration step of the point's time step.
    fn step<S: Scalar>(&self, at: &Point<S>, next: &mut [S]);

    /// The measurement `g(x; phi)`, without noise.
    fn observe<S: Scalar>(&self, at: &Point<S>, y: &mut [S]);

    /// How many unknowns `w` each step solves for, such as accelerations; [`Model::step`] receives them in its point.
    ///
    /// Derivatives of an equation are cheaper than those of its solution: a model of rigid bodies provides inverse
    /// dynamics in [`Model::balance`], so that the inverse of the mass matrix need not be differentiated.
    fn unknowns(&self) -> usize {
        0
    }

    /// `r(x, u, w; phi)`, which is 0 at the unknowns.
    fn balance<S: Scalar>(&self, _at: &Point<S>, _residual: &mut [S]) {}

    /// `r_w` at the unknowns of the point, symmetric positive definite, by rows.
    fn mass<S: Scalar>(&self, _at: &Point<S>, _matrix: &mut [S]) {}

    /// The unknowns, exact to rounding, if `r` is not linear in them; `None` if it is. This need not be differentiable, as
    /// in [`Scalar::repeat`]: derivatives of the unknowns follow from [`Model::balance`].
    fn solution<S: Scalar>(&self, _at: &Point<S>) -> Option<Vec<S>> {
        None
    }

    /// Names of the signals: what sensors and costs may use beside state and control, such as a contact's penetration.
    /// Only those of [`POWER`] and [`EFFORT`] may depend on the control.
    fn signals(&self) -> Vec<String> {
        Vec::new()
    }

    /// The signals, in the order of their names.
    fn signal<S: Scalar>(&self, _at: &Point<S>, _out: &mut [S]) {}

    /// The signals during the step to the `next` state: those of drives that [act at its end](Drive::acts_at_end) as they
    /// are there.
    fn signal_during<S: Scalar>(&self, at: &Point<S>, _next: &[S], out: &mut [S]) {
        self.signal(at, out);
    }

    /// The model's own cost of a stage or of the end, beside the costs of the task; `None` if it has none.
    fn own_cost(&self, _last: bool) -> Option<OwnCost> {
        None
    }

    /// The residual of its own cost.
    fn own_residual<S: Scalar>(&self, _at: &Point<S>, _last: bool, _out: &mut [S]) {}

    /// Its own cost, given the residual: the norm. Otherwise the cost may depend only on parameters and the time step.
    fn own_norm<S: Scalar>(&self, _residual: &[S], _phi: &[S], _time_step: S, _last: bool) -> S {
        S::zero()
    }

    /// Limits of states and controls of the real robot; reported if a plan violates them.
    fn limits(&self) -> Vec<Limit> {
        Vec::new()
    }

    /// Its contacts, which are reported along plans; none in models without contacts.
    fn contacts(&self) -> Vec<Contact> {
        Vec::new()
    }

    /// The contacts at a point, in the order of [`Model::contacts`].
    fn contact_states(&self, _at: &Point<f64>) -> Vec<ContactState> {
        Vec::new()
    }

    /// Number of integration steps per time step of a task, if task files can choose it; [`Model::step`] computes the
    /// next state of a single one.
    fn substeps(&self) -> Option<usize> {
        None
    }

    /// The same model for planning, with contacts that build up over a length wider by `_length`, m, and are softer
    /// accordingly, and friction that builds up over a speed higher by `_speed`, rad/s or m/s: planning then senses contacts
    /// at a distance, and overcomes friction. Implicit steps evaluate resistive forces after a share `_lead` of them. At
    /// 0, 0 and 1 it is this model. `None` for models without contacts and friction.
    fn widened(&self, _length: &Value, _speed: &Value, _lead: &Value) -> Option<Self>
    where
        Self: Sized,
    {
        None
    }

    /// Whether time steps several times as long give nearly the same motion.
    fn endures_longer_steps(&self) -> bool {
        false
    }

    /// Names of the joints, each with the states `q.NAME` and `v.NAME`; none in models that have no joints.
    fn joint_names(&self) -> Vec<String> {
        Vec::new()
    }

    /// The joints that do not move on their own; nothing may refer to them.
    fn dependent_joints(&self) -> Vec<DependentJoint> {
        Vec::new()
    }

    /// Names of the elements of compliance, each with signals `NAME.FORCE`; none if the model does not name them.
    fn coupling_names(&self) -> Vec<String> {
        Vec::new()
    }

    /// Names of the frames, each with the signals [`FRAME_SIGNALS`], which come before all others; none in models
    /// without frames.
    fn frame_names(&self) -> Vec<String> {
        Vec::new()
    }

    /// Elastic joints, each with the element of compliance whose `q.NAME` and `v.NAME` are the states of its motor.
    fn motors(&self) -> Vec<(String, String)> {
        Vec::new()
    }

    /// The drives, each with signals [`EFFORT`]`NAME` and [`POWER`]`NAME`, in the order of the controls; none if they
    /// do not act on joints.
    fn drives(&self) -> Vec<Drive> {
        Vec::new()
    }

    /// Sensors of the file that a robot was read from.
    fn file_sensors(&self) -> Vec<FileSensor> {
        Vec::new()
    }

    /// Names of the states, by which tasks select them: `x1`, `x2`... by default.
    fn state_names(&self) -> Vec<String> {
        (1..=self.dimensions().states).map(|i| format!("x{i}")).collect()
    }

    /// Names and units of the states, controls and measurements.
    fn channels(&self) -> Channels {
        Channels::plain(self.state_names(), self.dimensions())
    }

    /// A picture of the model with the forces between its bodies, if it can be drawn.
    ///
    /// Bodies, connections and landmarks are the same at every point, in the same order; only their poses change.
    fn picture(&self, _at: &Point<f64>) -> Option<Picture> {
        None
    }

    /// Positions of the points whose uncertainty is drawn, m in the world, in the order of [`Picture::landmarks`].
    fn landmarks<S: Scalar>(&self, _at: &Point<S>) -> Vec<[S; 3]> {
        Vec::new()
    }
}

/// The unknowns of an equation, with all derivatives, given a function `at` for its matrix `r_w` and residual `r`.
/// If the equation is not linear, this starts from its [solution](Model::solution).
pub(crate) fn solved<S: Scalar>(
    solution: Option<Vec<S>>,
    count: usize,
    at: impl Fn(&[S]) -> (Vec<Vec<S>>, Vec<S>),
) -> Vec<S> {
    // Each Newton step doubles the order up to which derivatives are right.
    let steps = if solution.is_some() { 2 } else { 1 };
    let mut w = solution.unwrap_or_else(|| vec![S::zero(); count]);
    for _ in 0..steps {
        let (matrix, residual) = at(&w);
        let missing = Ldl::new(&matrix).solve(residual);
        w = w.into_iter().zip(missing).map(|(w, missing)| w - missing).collect();
    }
    w
}

/// A joint that does not move on its own.
///
/// ```
/// use supple_model::physics::DependentJoint;
///
/// let locked = DependentJoint { name: "wrist".to_owned(), leader: None };
/// let (message, _) = DependentJoint::message("q.wrist", &[locked]).ok_or("it is locked")?;
/// assert_eq!(message, "joint `wrist` is locked: it does not move");
///
/// let follower = DependentJoint { name: "tip".to_owned(), leader: Some("finger".to_owned()) };
/// let (message, help) = DependentJoint::message("tip", &[follower]).ok_or("it follows")?;
/// assert_eq!(message, "joint `tip` follows joint `finger` and does not move on its own");
/// assert_eq!(help, "use `finger`, which moves both");
/// # Ok::<(), &'static str>(())
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DependentJoint {
    /// Its name.
    pub name: String,
    /// The joint that it follows; `None` if the task has locked it.
    pub leader: Option<String>,
}

impl DependentJoint {
    /// Error message and advice where a joint that moves on its own, or a state of one, is required and one of these is named.
    #[must_use]
    pub fn message(name: &str, list: &[Self]) -> Option<(String, String)> {
        let own =
            |prefix: &str| name.strip_prefix(prefix).and_then(|rest| list.iter().find(|joint| joint.name == rest));
        let Self { name, leader } = own("").or_else(|| own("q.")).or_else(|| own("v."))?;
        Some(match leader {
            None => (
                format!("joint `{name}` is locked: it does not move"),
                format!("take `{name}` out of `locked` in [model]"),
            ),
            Some(leader) => (
                format!("joint `{name}` follows joint `{leader}` and does not move on its own"),
                format!("use `{leader}`, which moves both"),
            ),
        })
    }
}
