//! Joint positions that bring a frame to a pose.
//!
//! Levenberg-Marquardt steps of minimum norm on the errors of position and orientation, with joint limits enforced by
//! projection, from several deterministic starts.
//!
//! ```text
//! e = (l turn, shift)    dq = J' (J J' + mu I)^-1 e    q <- within limits of (q + dq)
//! ```
//!
//! `J` holds the columns of the joints that may move, without those at a limit that the step would violate.

use supple_kernels::Ldl;
use supple_kernels::math;

use crate::vector::{scale, sub};
use crate::{Kinematics, Numbers, Pose, Tree, frame_jacobian};

/// Lever that converts rotation errors to distances, m/rad: about the length of an arm's links.
const LEVER: f64 = 0.3;
/// Number of starts, including the given one.
const STARTS: usize = 64;
/// Greatest number of steps per start.
const STEPS: usize = 200;
/// Error at which the search stops improving, m.
const EXACT: f64 = 1e-12;
/// Tolerances, m and rad: for a pose typed by a user to count as reached, and for the search to stop trying other starts.
const TYPED: [f64; 2] = [1e-4, 1e-3];
const CLOSE: f64 = 1e-6;
/// Number of additional starts for a frame that has reached its pose within [`TYPED`] but not within [`CLOSE`].
const TRIED_AGAIN: usize = 8;
/// Relative decrease of the squared error that a step needs for the search to continue.
const PROGRESS: f64 = 1e-12;
/// Search range of joints without limits: half a turn, or this many m.
const FAR: f64 = 1.0;

/// The desired pose of a frame.
///
/// Example: [`inverse_kinematics`].
#[derive(Clone, Debug)]
pub struct PoseGoal {
    /// The link that the frame is on.
    pub link: usize,
    /// The frame in its link.
    pub frame: Pose,
    /// Desired position of its origin in the world, m.
    pub position: [f64; 3],
    /// Desired rotation in the world, by rows; default: any.
    pub rotation: Option<[[f64; 3]; 3]>,
}

/// What a search for a pose may change. Lists are in the order of the degrees of freedom.
///
/// Example: [`inverse_kinematics`].
#[derive(Clone, Debug)]
pub struct Reach<'a> {
    /// Initial positions, rad or m. Positions that may not move keep these values.
    pub start: &'a [f64],
    /// Least positions; may be infinite.
    pub lower: &'a [f64],
    /// Greatest positions; may be infinite.
    pub upper: &'a [f64],
    /// Whether each may be moved.
    pub free: &'a [bool],
}

/// Where a search for a pose ended.
///
/// Example: [`inverse_kinematics`].
#[derive(Clone, Debug, PartialEq)]
pub struct Reached {
    /// Positions of the degrees of freedom, rad or m.
    pub q: Vec<f64>,
    /// Distance of the frame's origin from the desired position, m.
    pub distance: f64,
    /// Angle between the frame and the desired orientation, rad; 0 if the orientation is free.
    pub angle: f64,
    /// Degrees of freedom that move the frame and are at a limit.
    pub at_limits: Vec<usize>,
}

impl Reached {
    /// Whether the frame is at the goal within the precision that people type: a tenth of a millimetre and a milliradian.
    #[must_use]
    pub fn is_there(&self) -> bool {
        let [distance, angle] = TYPED;
        self.distance < distance && self.angle < angle
    }

    /// Whether the frame is at the goal within 1 micrometre and 1 microradian.
    fn is_close(&self) -> bool {
        self.distance < CLOSE && self.angle < CLOSE
    }
}

/// Positions at which a frame is at the goal, or else the closest ones found. Searches from the given start,
/// and then from others within the limits, until one succeeds.
///
/// # Panics
/// If a list does not have one entry per degree of freedom, or there is no such link.
///
/// ```
/// use supple_robot::{LoadOptions, Numbers, Pose, PoseGoal, Reach, Tree, inverse_kinematics};
/// # let text = r#"<robot name="pendulum"><link name="world"/>
/// #     <joint name="hinge" type="continuous"><parent link="world"/><child link="rod"/><axis xyz="0 1 0"/></joint>
/// #     <link name="rod"><inertial><origin xyz="0 0 -0.5"/><mass value="2"/>
/// #         <inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link></robot>"#;
/// // The pendulum of the front page.
/// let robot = supple_robot::parse(text, "pendulum.urdf", &LoadOptions::default())?;
/// let (tree, numbers) = (Tree::new(&robot), Numbers::<f64>::of(&robot, [0.0, 0.0, -9.81]));
/// // Moves the tip of the rod, 1 m from the hinge, to its position at 0.5 rad.
/// let (sin, cos) = 0.5_f64.sin_cos();
/// let (frame, position) = (Pose::at([0.0, 0.0, -1.0]), [-sin, 0.0, -cos]);
/// let goal = PoseGoal { link: 1, frame, position, rotation: None };
/// let reach = Reach { start: &[0.0], lower: &[-3.0], upper: &[3.0], free: &[true] };
/// let reached = inverse_kinematics(&tree, &numbers, &goal, &reach);
/// assert!(reached.is_there() && (reached.q[0] - 0.5).abs() < 1e-4);
/// # Ok::<(), supple_text::FileError>(())
/// ```
#[must_use]
pub fn inverse_kinematics(tree: &Tree, numbers: &Numbers<f64>, goal: &PoseGoal, reach: &Reach) -> Reached {
    let search = Search { tree, numbers, goal, reach };
    let mut best = search.descend(search.within(reach.start.to_vec()));
    for start in 1..STARTS {
        let reached = search.reached(&best);
        if reached.is_close() || reached.is_there() && start > TRIED_AGAIN {
            break;
        }
        let found = search.descend(search.start(start));
        if found.cost < best.cost {
            best = found;
        }
    }
    search.reached(&best)
}

struct Search<'a> {
    tree: &'a Tree,
    numbers: &'a Numbers<f64>,
    goal: &'a PoseGoal,
    reach: &'a Reach<'a>,
}

/// Positions, their error vector, and half its square.
struct Candidate {
    q: Vec<f64>,
    error: Vec<f64>,
    cost: f64,
}

impl Search<'_> {
    /// The positions clamped to limits; those that may not move keep their values.
    fn within(&self, mut q: Vec<f64>) -> Vec<f64> {
        let Reach { start, lower, upper, free } = self.reach;
        for (i, q) in q.iter_mut().enumerate() {
            *q = if free[i] { q.max(lower[i]).min(upper[i]) } else { start[i] };
        }
        q
    }

    /// A deterministic start for each number: a point of a Halton sequence, which covers the range within the limits evenly.
    fn start(&self, number: usize) -> Vec<f64> {
        let Reach { lower, upper, .. } = self.reach;
        let turns = self.tree.bodies().iter();
        let mut far = vec![FAR; self.tree.dofs()];
        turns.filter(|body| body.motion == crate::Motion::Turn).for_each(|body| far[body.dof] = std::f64::consts::PI);
        let place = |dof: usize| {
            let (low, high) = match (lower[dof].is_finite(), upper[dof].is_finite()) {
                (true, true) => (lower[dof], upper[dof]),
                (true, false) => (lower[dof], lower[dof] + 2.0 * far[dof]),
                (false, true) => (upper[dof] - 2.0 * far[dof], upper[dof]),
                (false, false) => (-far[dof], far[dof]),
            };
            low + (high - low) * radical_inverse(number, prime(dof))
        };
        self.within((0..self.tree.dofs()).map(place).collect())
    }

    fn kinematics(&self, q: &[f64]) -> Kinematics<f64> {
        Kinematics::at_rest(self.tree, self.numbers, q)
    }

    /// The error: rotation times lever, if a rotation is requested, and displacement, in the world.
    fn error(&self, kinematics: &Kinematics<f64>) -> Vec<f64> {
        let at = kinematics.poses()[self.goal.link].compose(&self.goal.frame);
        let shift = sub(self.goal.position, at.position);
        let turn = self.goal.rotation.map(|rotation| {
            let goal = Pose { rotation, position: [0.0; 3] };
            let current = Pose { position: [0.0; 3], ..at };
            scale(LEVER, rotation_vector(&goal.compose(&current.inverse()).rotation))
        });
        turn.into_iter().flatten().chain(shift).collect()
    }

    fn at(&self, q: Vec<f64>) -> Candidate {
        let error = self.error(&self.kinematics(&q));
        let cost = 0.5 * error.iter().map(|entry| entry * entry).sum::<f64>();
        Candidate { q, error, cost }
    }

    /// Rows of the Jacobian of the error, up to sign.
    fn jacobian(&self, q: &[f64]) -> Vec<Vec<f64>> {
        let rows = frame_jacobian(self.tree, &self.kinematics(q), self.goal.link, self.goal.frame.position);
        let lever = |row: Vec<f64>| row.into_iter().map(|entry| LEVER * entry).collect();
        let [a, b, c, x, y, z] = rows;
        let turn = self.goal.rotation.map(|_| [a, b, c].map(lever));
        turn.into_iter().flatten().chain([x, y, z]).collect()
    }

    /// Descends from the given positions.
    fn descend(&self, q: Vec<f64>) -> Candidate {
        let mut at = self.at(q);
        let mut damping = 1e-3 * LEVER * LEVER;
        for _ in 0..STEPS {
            if at.cost < 0.5 * EXACT * EXACT {
                break;
            }
            let jacobian = self.jacobian(&at.q);
            let mut next = None;
            while damping < 1e9 {
                let step = self.step(&at, &jacobian, damping);
                let moved = at.q.iter().zip(&step).map(|(q, step)| q + step).collect();
                let found = self.at(self.within(moved));
                if found.cost < at.cost {
                    next = Some(found);
                    damping = (damping * 0.2).max(1e-15);
                    break;
                }
                damping *= 4.0;
            }
            let Some(next) = next else { break };
            let stuck = at.cost - next.cost <= PROGRESS * at.cost;
            at = next;
            if stuck {
                break;
            }
        }
        at
    }

    /// `J' (J J' + mu I)^-1 e` over the joints that may move, without those at a limit that the step would
    /// violate.
    fn step(&self, at: &Candidate, jacobian: &[Vec<f64>], damping: f64) -> Vec<f64> {
        let Reach { lower, upper, free, .. } = self.reach;
        let mut moves = free.to_vec();
        loop {
            let dot = |a: &[f64], b: &[f64]| -> f64 {
                a.iter().zip(b).zip(&moves).filter(|(_, moves)| **moves).map(|((a, b), _)| a * b).sum()
            };
            let mut square: Vec<Vec<f64>> =
                jacobian.iter().map(|a| jacobian.iter().map(|b| dot(a, b)).collect()).collect();
            for (i, row) in square.iter_mut().enumerate() {
                row[i] += damping;
            }
            let weights = Ldl::new(&square).solve(at.error.clone());
            let along = |dof: usize| jacobian.iter().zip(&weights).map(|(row, weight)| row[dof] * weight).sum();
            let step: Vec<f64> =
                moves.iter().enumerate().map(|(dof, &moves)| if moves { along(dof) } else { 0.0 }).collect();
            let leaves =
                |dof: usize| step[dof] < 0.0 && at.q[dof] <= lower[dof] || step[dof] > 0.0 && at.q[dof] >= upper[dof];
            let beyond: Vec<usize> = (0..step.len()).filter(|&dof| moves[dof] && leaves(dof)).collect();
            if beyond.is_empty() {
                return step;
            }
            beyond.into_iter().for_each(|dof| moves[dof] = false);
        }
    }

    fn reached(&self, at: &Candidate) -> Reached {
        let length = |entries: &[f64]| entries.iter().map(|entry| entry * entry).sum::<f64>().sqrt();
        let (turn, shift) = at.error.split_at(at.error.len() - 3);
        let Reach { lower, upper, free, .. } = self.reach;
        let near = |q: f64, limit: f64| (q - limit).abs() < 1e-9;
        let jacobian = self.jacobian(&at.q);
        let at_limits = (0..at.q.len()).filter(|&dof| {
            let moves_it = jacobian.iter().any(|row| row[dof] != 0.0);
            free[dof] && moves_it && (near(at.q[dof], lower[dof]) || near(at.q[dof], upper[dof]))
        });
        Reached {
            q: at.q.clone(),
            distance: length(shift),
            angle: length(turn) / LEVER,
            at_limits: at_limits.collect(),
        }
    }
}

/// Axis times angle of a rotation, rad; the angle is at most half a turn.
fn rotation_vector(r: &[[f64; 3]; 3]) -> [f64; 3] {
    let skew = [r[2][1] - r[1][2], r[0][2] - r[2][0], r[1][0] - r[0][1]].map(|entry| 0.5 * entry);
    let sin = skew.iter().map(|entry| entry * entry).sum::<f64>().sqrt();
    let cos = 0.5 * (r[0][0] + r[1][1] + r[2][2] - 1.0);
    let angle = math::atan2(sin, cos);
    if sin > 1e-6 {
        return scale(angle / sin, skew);
    }
    if cos > 0.0 {
        return skew;
    }
    // Near half a turn R = 2 a a' - I: the longest column of R + I is along the axis a.
    let columns = [0, 1, 2].map(|j| [0, 1, 2].map(|i| r[i][j] + if i == j { 1.0 } else { 0.0 }));
    let squared = |v: &[f64; 3]| v.iter().map(|entry| entry * entry).sum::<f64>();
    let longest = columns.into_iter().fold([0.0; 3], |best, v| if squared(&v) > squared(&best) { v } else { best });
    scale(angle / squared(&longest).sqrt(), longest)
}

/// The digits of a number in a base, mirrored at the radix point: from 0 to 1.
fn radical_inverse(mut number: usize, base: usize) -> f64 {
    let (mut value, mut digit) = (0.0, 1.0 / base as f64);
    while number > 0 {
        value += (number % base) as f64 * digit;
        number /= base;
        digit /= base as f64;
    }
    value
}

/// The prime with this number, from 0.
fn prime(number: usize) -> usize {
    let is_prime = |n: &usize| (2..).take_while(|d| d * d <= *n).all(|d| !n.is_multiple_of(d));
    (2..).filter(is_prime).nth(number).unwrap_or(2)
}
