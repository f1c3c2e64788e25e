//! Where a task begins: postures of a limb far from limits, singularities and large torques, and the wall that the
//! tool faces.

use std::f64::consts::PI;

use supple_robot::vector::{add, cross, dot, scale, sub};
use supple_robot::{
    Kinematics, Limits, Numbers, Pose, PoseGoal, Reach, Reached, bias, frame_jacobian, inverse_kinematics, mass_matrix,
};
use supple_text::significant;

use super::limb::Limb;
use crate::commands::robot::SMOOTHING;

/// Number of sampled postures; of inverse-kinematics attempts; and of attempts while none has succeeded.
const SAMPLES: usize = 400;
const TRIED: usize = 24;
const MOST_TRIED: usize = 120;
/// How far joints without limits are searched, rad or m.
const FAR: f64 = 0.5 * PI;
/// How often joints with drives follow joints with springs, each time by less.
const SETTLED: usize = 4;
/// Steps by which joints with springs approach where these hold them.
const SETTLING: usize = 60;
/// Share of an effort limit that holding a posture may take.
pub const LOADED: f64 = 0.8;
/// Limbs with fewer joints can only move their tool on a line or surface: their tasks specify joint positions,
/// and their tools press in a direction in which they can move.
pub const FEW: usize = 3;
/// Required reach, relative to the distance of the target: a fully stretched limb could move no further.
const SPARE: f64 = 1.1;
/// Postures that tell whether a limb moves its tool in all directions, as single ones may be singular; and the least
/// singular value of its Jacobian that counts, with lengths relative to the reach.
const FREE_SAMPLES: usize = 8;
const LEAST_MOTION: f64 = 1e-6;
/// How far the tool of a limb with few joints may miss a requested place, as a share of the reach: the line or surface
/// that it can reach seldom passes through it.
const NEAR: f64 = 0.01;
/// Minimum of the squared share of such a limb's tool motion that is along a wall's normal.
const FACING: f64 = 0.25;

/// A posture in which a task begins.
#[derive(Clone, Debug)]
pub struct Start {
    /// Where the tool is, m in the world.
    pub position: [f64; 3],
    /// Its roll, pitch and yaw in the world; `None` if the limb has too few joints to choose them.
    pub rpy: Option<[f64; 3]>,
    /// Outward normal of the wall that it looks at.
    pub normal: [f64; 3],
    /// The frame of the mount in the tool's frame: its z axis points into the wall, its x axis goes along it, level where
    /// it can.
    pub mount: [f64; 3],
    /// The x and y axes of the mount in the world.
    pub along: [[f64; 3]; 2],
    /// Joint positions, rad or m.
    pub q: Vec<f64>,
    /// Torques or forces that hold the robot up, N m or N.
    pub held: Vec<f64>,
    /// Inertia that each joint moves, kg m^2 or kg.
    pub inertia: Vec<f64>,
    /// How far the tool moves for a joint that moves by 1, m.
    pub levers: Vec<f64>,
    /// Force on the wall that the drives can sustain beside that, N; infinite where efforts have no limits.
    pub sustained: f64,
    /// How good a posture it is: greater is better.
    score: f64,
}

/// Postures to begin with, the best first; with `upright`, only vertical walls.
pub fn starts(limb: &Limb, wall: Option<[f64; 3]>, at: Option<[f64; 3]>, upright: bool) -> Vec<Start> {
    let search = Search::of(limb);
    // If the tool cannot reach the place in any orientation, it cannot reach it facing a wall either.
    if at.is_some_and(|at| search.reached(&limb.planning.start, at, None).distance > NEAR * limb.reach) {
        return Vec::new();
    }
    // Floors, and walls on all sides; no ceilings.
    let axes = [[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 1.0, 0.0]];
    let normals = |q: &[f64]| -> Vec<[f64; 3]> {
        match wall {
            Some(normal) => vec![normal],
            None => axes.into_iter().chain(search.motions(q)).filter(|n| !upright || n[2].abs() < 1e-9).collect(),
        }
    };
    let mut samples: Vec<(f64, Vec<f64>, [f64; 3])> = Vec::new();
    for index in 0..SAMPLES {
        let q = search.sample(index);
        let (pose, worth) = search.worth(&q);
        let nearness = at.map_or(1.0, |at| (-norm(sub(pose.position, at)) / limb.reach).exp());
        for normal in normals(&q) {
            samples.push((worth * nearness * search.facing(&q, &pose, normal), q.clone(), normal));
        }
    }
    samples.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut found: Vec<Start> = Vec::new();
    for (tried, (_, q, normal)) in samples.into_iter().take(MOST_TRIED).enumerate() {
        if tried >= TRIED && !found.is_empty() {
            break;
        }
        found.extend(search.start(&q, normal, at));
    }
    found.sort_by(|a, b| b.score.total_cmp(&a.score));
    found
}

struct Search<'a> {
    limb: &'a Limb,
    numbers: Numbers<f64>,
    limits: Vec<Limits>,
    efforts: Vec<f64>,
    /// The axis of the tool's frame in which the limb points outwards.
    push: [f64; 3],
    /// Whether the limb can give its tool any orientation at a place: with six joints, unless some move it alike, as
    /// parallel slides do.
    turns: bool,
}

impl<'a> Search<'a> {
    fn of(limb: &'a Limb) -> Self {
        let planning = &limb.planning;
        let limits = planning.tree.joint_indices().iter().map(|&joint| planning.robot.joints[joint].limits).collect();
        let (numbers, efforts) = (limb.numbers(), limb.efforts());
        let mut search = Self { limb, numbers, limits, efforts, push: [0.0, 0.0, 1.0], turns: false };
        search.push = search.pushing();
        search.turns = (0..FREE_SAMPLES).any(|index| search.is_free(&search.sample(index)));
        search
    }

    /// Whether the joints move the tool in all six directions.
    fn is_free(&self, q: &[f64]) -> bool {
        let tree = &self.limb.planning.tree;
        let kinematics = Kinematics::at_rest(tree, &self.numbers, q);
        let jacobian = frame_jacobian(tree, &kinematics, self.limb.link, self.limb.pose.position);
        let size = |row: usize| if row < 3 { 1.0 } else { self.limb.reach };
        let rows = nalgebra::DMatrix::from_fn(6, q.len(), |row, dof| jacobian[row][dof] / size(row));
        rows.rank(LEAST_MOTION) == 6
    }

    /// The axis of the tool's frame closest to the direction from the last joint to the tool; z if they coincide.
    fn pushing(&self) -> [f64; 3] {
        let (tree, robot) = (&self.limb.planning.tree, &self.limb.planning.robot);
        let kinematics = Kinematics::at_rest(tree, &self.numbers, &self.limb.planning.start);
        let Some(body) = tree.body_of(self.limb.link) else { return [0.0, 0.0, 1.0] };
        let joint = tree.bodies()[body].joint;
        let carrier = &kinematics.poses()[robot.joints[joint].parent];
        let from = carrier.compose(&robot.joints[joint].origin).position;
        let frame = kinematics.poses()[self.limb.link].compose(&self.limb.pose);
        let seen = frame.unrotate(sub(frame.position, from));
        let most = (0..3).fold(2, |most, axis| if seen[axis].abs() > seen[most].abs() { axis } else { most });
        let mut axis = [0.0; 3];
        axis[if seen[most].abs() < 1e-3 * self.limb.reach { 2 } else { most }] =
            if seen[most] < -1e-3 * self.limb.reach { -1.0 } else { 1.0 };
        axis
    }

    /// A posture within limits: points of a Halton sequence, away from the ends of ranges.
    fn sample(&self, index: usize) -> Vec<f64> {
        const BASES: [usize; 7] = [2, 3, 5, 7, 11, 13, 17];
        let place = |(dof, limits): (usize, &Limits)| {
            let start = self.limb.planning.start[dof];
            let lower = limits.lower.max(start - FAR.max(0.5 * (limits.upper - limits.lower).min(PI)));
            let upper = limits.upper.min(start + FAR.max(0.5 * (limits.upper - limits.lower).min(PI)));
            let (mut number, mut share, mut at) = (index + 1, 1.0, 0.0);
            let base = BASES[dof % BASES.len()];
            while number > 0 {
                share /= base as f64;
                at += share * (number % base) as f64;
                number /= base;
            }
            lower + (0.1 + 0.8 * at) * (upper - lower)
        };
        self.limits.iter().enumerate().map(place).collect()
    }

    /// Where the tool is in a posture, and how good that is: how freely it moves in the worst direction, how much of the
    /// efforts is left, and how far joints are from their limits.
    fn worth(&self, q: &[f64]) -> (Pose, f64) {
        let tree = &self.limb.planning.tree;
        let kinematics = Kinematics::at_rest(tree, &self.numbers, q);
        let pose = kinematics.poses()[self.limb.link].compose(&self.limb.pose);
        let jacobian = frame_jacobian(tree, &kinematics, self.limb.link, self.limb.pose.position);
        let freedom = least_motion(&jacobian[3..]) / self.limb.reach;
        let held = bias(tree, &self.numbers, &kinematics, q, &vec![0.0; q.len()], SMOOTHING);
        let load = held.iter().zip(&self.efforts).map(|(held, effort)| held.abs() / effort).fold(0.0, f64::max);
        let margin = q.iter().zip(&self.limits).map(|(&q, limits)| {
            let half = 0.5 * (limits.upper - limits.lower);
            if half.is_finite() { ((q - limits.lower).min(limits.upper - q) / half).clamp(0.0, 1.0) } else { 1.0 }
        });
        let margin = margin.fold(1.0, f64::min);
        // Prefer places above the floor and in front of the robot: below or behind it, there is seldom room.
        let above = if pose.position[2] > 0.05 * self.limb.reach { 1.0 } else { 0.3 };
        let before = if pose.position[0] > 0.0 { 1.0 } else { 0.7 };
        (pose, (freedom + 1e-3) * (LOADED - load).max(1e-3) * margin.sqrt().max(1e-3) * above * before)
    }

    /// How the tool moves in the world for each joint that moves by 1, m.
    fn columns(&self, q: &[f64]) -> Vec<[f64; 3]> {
        let tree = &self.limb.planning.tree;
        let kinematics = Kinematics::at_rest(tree, &self.numbers, q);
        let jacobian = frame_jacobian(tree, &kinematics, self.limb.link, self.limb.pose.position);
        (0..q.len()).map(|dof| [3, 4, 5].map(|row: usize| jacobian[row][dof])).collect()
    }

    /// Of a limb of few joints: the directions in which joints move the tool, both ways.
    fn motions(&self, q: &[f64]) -> Vec<[f64; 3]> {
        if q.len() >= FEW {
            return Vec::new();
        }
        let moving = self.columns(q).into_iter().filter(|column| norm(*column) > 1e-6 * self.limb.reach);
        // Four digits, so that small entries of an axis are 0.
        let unit = |column: [f64; 3]| column.map(|entry| four_decimals(entry / norm(column)));
        moving.map(unit).flat_map(|unit| [unit, scale(-1.0, unit)]).collect()
    }

    /// How well a tool is placed to press on a wall, at least 0: whether the limb points at the wall or, with few joints,
    /// whether its joints move the tool along the wall's normal.
    fn facing(&self, q: &[f64], pose: &Pose, normal: [f64; 3]) -> f64 {
        if q.len() >= FEW {
            return 1.1 - dot(pose.rotate(self.push), normal);
        }
        let columns = self.columns(q);
        let most = columns.iter().map(|column| norm(*column)).fold(1e-12, f64::max);
        let along = columns.iter().map(|column| dot(*column, normal).abs()).fold(0.0, f64::max);
        (along / most).powi(2)
    }

    /// How near the joints bring the tool to a place, in any orientation where none is given.
    fn reached(&self, from: &[f64], position: [f64; 3], rpy: Option<[f64; 3]>) -> Reached {
        self.reached_by(&vec![true; from.len()], from, position, rpy)
    }

    /// The same by some joints only.
    fn reached_by(&self, free: &[bool], from: &[f64], position: [f64; 3], rpy: Option<[f64; 3]>) -> Reached {
        let limb = self.limb;
        let rotation = rpy.map(|rpy| Pose::from_rpy([0.0; 3], rpy).rotation);
        let goal = PoseGoal { link: limb.link, frame: limb.pose, position, rotation };
        let reach = Reach {
            start: from,
            lower: &self.limits.iter().map(|limits| limits.lower).collect::<Vec<_>>(),
            upper: &self.limits.iter().map(|limits| limits.upper).collect::<Vec<_>>(),
            free,
        };
        inverse_kinematics(&limb.planning.tree, &self.numbers, &goal, &reach)
    }

    /// Moves joints with a spring and without a drive to where their springs hold them, within their limits. Springs that
    /// are too weak leave them elsewhere.
    fn settle(&self, q: &mut [f64]) {
        let (limb, tree) = (self.limb, &self.limb.planning.tree);
        let sprung = limb.sprung();
        if sprung.is_empty() {
            return;
        }
        for _ in 0..SETTLING {
            let kinematics = Kinematics::at_rest(tree, &self.numbers, q);
            let held = bias(tree, &self.numbers, &kinematics, q, &vec![0.0; q.len()], SMOOTHING);
            for &dof in &sprung {
                let Limits { lower, upper, .. } = self.limits[dof];
                q[dof] = (q[dof] - held[dof] / limb.stiffness(dof)).clamp(lower, upper);
            }
        }
        sprung.into_iter().for_each(|dof| q[dof] = significant(q[dof], 6));
    }

    /// A posture that reaches a place with joints that have a spring and no drive where their springs hold them; `None` if
    /// the others do not reach it then.
    fn settled(&self, mut q: Vec<f64>, position: [f64; 3], rpy: Option<[f64; 3]>) -> Option<Vec<f64>> {
        let (start, sprung) = (&self.limb.planning.start, self.limb.sprung());
        if sprung.is_empty() {
            return Some(q);
        }
        let free: Vec<bool> = (0..q.len()).map(|dof| !sprung.contains(&dof)).collect();
        for _ in 0..SETTLED {
            self.settle(&mut q);
            let from: Vec<f64> = (0..q.len()).map(|dof| if free[dof] { start[dof] } else { q[dof] }).collect();
            let reached = self.reached_by(&free, &from, position, rpy);
            if !reached.is_there() {
                return None;
            }
            q = reached.q;
        }
        Some(q)
    }

    /// A start near a posture, with the tool before the wall.
    fn start(&self, near: &[f64], normal: [f64; 3], at: Option<[f64; 3]>) -> Option<Start> {
        let limb = self.limb;
        let (pose, _) = self.worth(near);
        let few = limb.joints().len() < FEW;
        let turn = upright(normal, &pose, self.push);
        let rpy = turn.map(rounded_rpy);
        let chosen = rpy.filter(|_| self.turns);
        let tree = &limb.planning.tree;
        // Round numbers, unless the tool moves on a surface that does not pass through them.
        let round = at.unwrap_or(pose.position).map(|entry| round(entry, limb.reach));
        let exact = at.is_none().then_some(pose.position);
        let places = if few { [exact.or(Some(round)), None] } else { [Some(round), exact] };
        let (position, reached) = places
            .into_iter()
            .flatten()
            .map(|position| (position, self.reached(&limb.planning.start, position, chosen)))
            .find(|(_, reached)| reached.is_there() || few && reached.distance < NEAR * limb.reach)?;
        let mut q = reached.q;
        if few {
            q.iter_mut().for_each(|q| *q = four_decimals(*q));
            self.settle(&mut q);
        } else {
            q = self.settled(q, position, chosen)?;
        }
        let (pose, worth) = self.worth(&q);
        // The tool could only slide along this wall, never press on it.
        if few && self.facing(&q, &pose, normal) < FACING {
            return None;
        }
        let position = if few { pose.position } else { position };
        let kinematics = Kinematics::at_rest(tree, &self.numbers, &q);
        let held = bias(tree, &self.numbers, &kinematics, &q, &vec![0.0; q.len()], SMOOTHING);
        let jacobian = frame_jacobian(tree, &kinematics, limb.link, limb.pose.position);
        let along_normal: Vec<f64> =
            (0..held.len()).map(|dof| dot([3, 4, 5].map(|row: usize| jacobian[row][dof]), normal).abs()).collect();
        let loads = held.iter().zip(&self.efforts).zip(&along_normal).filter(|(_, lever)| **lever > 1e-9);
        let sustained = loads.map(|((held, effort), lever)| (LOADED * effort - held.abs()).max(0.0) / lever);
        let sustained = sustained.fold(f64::INFINITY, f64::min);
        let overloaded = held.iter().zip(&self.efforts).any(|(held, effort)| held.abs() > LOADED * effort);
        let inertia = mass_matrix(tree, &self.numbers, &kinematics);
        let inertia = (0..q.len()).map(|dof| inertia[dof][dof]).collect();
        let levers = (0..q.len()).map(|dof| norm([3, 4, 5].map(|row: usize| jacobian[row][dof]))).collect();
        let (mount, along) = mounted(&pose, normal);
        let score = if overloaded || sustained <= 0.0 { 1e-3 * worth } else { worth };
        Some(Start { position, rpy: chosen, normal, mount, along, q, held, inertia, levers, sustained, score })
    }
}

impl Start {
    /// Position of the tool after moving along the wall by `travel`, m, or half of it: the first such position within
    /// reach, with some margin.
    pub fn along_wall(&self, limb: &Limb, travel: f64) -> [f64; 3] {
        self.way(limb, travel).0
    }

    /// How far that is, m.
    pub fn travelled(&self, limb: &Limb, travel: f64) -> f64 {
        self.way(limb, travel).1
    }

    fn way(&self, limb: &Limb, travel: f64) -> ([f64; 3], f64) {
        let search = Search::of(limb);
        let [x, y] = self.along;
        let place = |by: f64, along: [f64; 3]| add(self.position, scale(by, along));
        let ways = [x, scale(-1.0, x), y, scale(-1.0, y)];
        let mut tries = [travel, 0.5 * travel].into_iter().flat_map(|by| ways.map(|along| (by, along)));
        let found = tries.find(|&(by, along)| search.reached(&self.q, place(SPARE * by, along), None).is_there());
        let (by, along) = found.unwrap_or((travel, x));
        (place(by, along), by)
    }

    /// Position of the tool after moving by `travel`, m: along the wall or, for a limb with few joints, by moving the
    /// joint with the greatest effect on the tool away from its nearer limit.
    pub fn moved(&self, limb: &Limb, travel: f64) -> [f64; 3] {
        if self.q.len() >= FEW {
            return self.along_wall(limb, travel);
        }
        let search = Search::of(limb);
        let lengths: Vec<f64> = search.columns(&self.q).into_iter().map(norm).collect();
        let most = (0..lengths.len()).fold(0, |most, dof| if lengths[dof] > lengths[most] { dof } else { most });
        let Limits { lower, upper, .. } = search.limits[most];
        let by = travel / lengths[most].max(1e-6 * limb.reach);
        let up = upper - self.q[most] >= self.q[most] - lower;
        let mut q = self.q.clone();
        q[most] += if up { by.min(0.9 * (upper - q[most])) } else { -by.min(0.9 * (q[most] - lower)) };
        search.worth(&q).0.position
    }
}

/// The least motion of the tool, in any direction, for a unit motion of the joints: the least singular value of the
/// Jacobian `rows`, restricted to directions in which the tool can move.
fn least_motion(rows: &[Vec<f64>]) -> f64 {
    let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let gram = nalgebra::Matrix3::from_fn(|i, j| product(&rows[i], &rows[j]));
    let free = rows.first().map_or(0, Vec::len);
    let mut values: [f64; 3] = gram.symmetric_eigenvalues().map(|value| value.max(0.0).sqrt()).into();
    values.sort_by(|a, b| b.total_cmp(a));
    values[free.clamp(1, 3) - 1]
}

/// The rotation of the tool's frame nearest to that of `pose` for which axis `push` points into the wall.
fn upright(normal: [f64; 3], pose: &Pose, push: [f64; 3]) -> Option<[[f64; 3]; 3]> {
    let into = scale(-1.0, normal);
    let now = pose.rotate(push);
    // The shortest turn from one direction to another: R = c I + [a] + a a' / (1 + c), a = now x into.
    let (axis, cosine) = (cross(now, into), dot(now, into));
    if cosine < -0.999 {
        return None;
    }
    let turn = |v: [f64; 3]| {
        let (across, along) = (cross(axis, v), dot(axis, v) / (1.0 + cosine));
        [0, 1, 2].map(|i| cosine * v[i] + across[i] + along * axis[i])
    };
    let columns = [0, 1, 2].map(|column| turn(pose.rotation.map(|row| row[column])));
    Some([0, 1, 2].map(|row| [0, 1, 2].map(|column| columns[column][row])))
}

/// Roll, pitch and yaw of the mount in the tool's frame, and its x and y axes in the world.
fn mounted(pose: &Pose, normal: [f64; 3]) -> ([f64; 3], [[f64; 3]; 2]) {
    let z = scale(-1.0, normal);
    let helper = if normal[2].abs() < 0.9 { [0.0, 0.0, 1.0] } else { [0.0, 1.0, 0.0] };
    let x = cross(helper, normal);
    let x = scale(1.0 / norm(x), x);
    let y = cross(z, x);
    let columns = [x, y, z].map(|axis| pose.unrotate(axis));
    let turn = [0, 1, 2].map(|row| [0, 1, 2].map(|column| columns[column][row]));
    (rounded_rpy(turn), [x, y])
}

/// Roll, pitch and yaw of a rotation to four decimals, as of the pose; what lies below comes from rounding.
fn rounded_rpy(rotation: [[f64; 3]; 3]) -> [f64; 3] {
    Pose { rotation, position: [0.0; 3] }.rpy().map(four_decimals)
}

/// Four decimals.
fn four_decimals(number: f64) -> f64 {
    (number * 1e4).round() / 1e4
}

fn norm(v: [f64; 3]) -> f64 {
    dot(v, v).sqrt()
}

/// Rounded to about a hundredth of a length.
fn round(value: f64, length: f64) -> f64 {
    let step = 10.0_f64.powf((0.02 * length).log10().floor());
    let rounded = (value / step).round() * step;
    // Digits that binary fractions add.
    format!("{rounded:.6}").parse::<f64>().unwrap_or(rounded) + 0.0
}
