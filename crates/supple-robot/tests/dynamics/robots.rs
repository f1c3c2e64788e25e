//! Robots at random: branches, slides and turns about any axis, fixed links in between, massless links, drives.

use supple_kernels::Scalar;
use supple_robot::{Inertia, Joint, JointKind, Link, Mimic, Numbers, Pose, Robot, Tree};

/// A stream of random numbers from a seed: splitmix64.
pub struct Random(u64);

impl Random {
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Between `low` and `high`.
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * (self.bits() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Less than `end`.
    pub fn below(&mut self, end: usize) -> usize {
        (self.bits() % end as u64) as usize
    }

    pub fn happens(&mut self, probability: f64) -> bool {
        self.between(0.0, 1.0) < probability
    }

    pub fn vector<const N: usize>(&mut self, size: f64) -> [f64; N] {
        [(); N].map(|()| self.between(-size, size))
    }

    pub fn list(&mut self, length: usize, size: f64) -> Vec<f64> {
        (0..length).map(|_| self.between(-size, size)).collect()
    }

    fn pose(&mut self) -> Pose {
        let position = self.vector(0.4);
        let right = |times: f64| times.round() * std::f64::consts::FRAC_PI_2;
        let rpy = self.vector::<3>(2.0);
        Pose::from_rpy(position, if self.happens(0.5) { rpy.map(right) } else { rpy })
    }

    fn axis(&mut self) -> [f64; 3] {
        let mut axis = [0.0; 3];
        if self.happens(0.6) {
            axis[self.below(3)] = if self.happens(0.5) { 1.0 } else { -1.0 };
            return axis;
        }
        axis = self.vector(1.0);
        let length = axis.iter().map(|x| x * x).sum::<f64>().sqrt();
        axis.map(|x| x / length)
    }

    /// The inertia of a few points of mass.
    fn inertia(&mut self) -> Inertia {
        let mut moment = [[0.0; 3]; 3];
        for _ in 0..4 {
            let (m, p) = (self.between(0.1, 1.0), self.vector::<3>(0.2));
            let square: f64 = p.iter().map(|x| x * x).sum();
            for (i, row) in moment.iter_mut().enumerate() {
                for (j, entry) in row.iter_mut().enumerate() {
                    *entry += m * (if i == j { square } else { 0.0 } - p[i] * p[j]);
                }
            }
        }
        Inertia { mass: self.between(0.5, 3.0), center: self.vector(0.3), moment }
    }
}

/// A link of that name without anything.
pub fn link(name: &str, inertia: Option<Inertia>) -> Link {
    Link { name: name.to_owned(), inertia, meshes: vec![], primitives: vec![], line: 0 }
}

/// A joint of that name without anything, which turns about z in the origin of its parent.
pub fn joint(name: &str, parent: usize) -> Joint {
    Joint { axis: [0.0, 0.0, 1.0], ..Joint::free(name.to_owned(), JointKind::Revolute, parent) }
}

/// A robot at random. Links that carry nothing have inertia, and joints of those without have drives, so its mass
/// matrix is positive definite.
pub fn robot(random: &mut Random, joints: usize, mimic: bool) -> Robot {
    let parents: Vec<usize> = (0..joints).map(|i| if random.happens(0.7) { i } else { random.below(i + 1) }).collect();
    let links = (0..=joints).map(|i| {
        let carries = parents.contains(&i);
        link(&format!("l{i}"), (!carries || random.happens(0.8)).then(|| random.inertia()))
    });
    let links: Vec<Link> = links.collect();
    let joints = parents.iter().enumerate().map(|(i, &parent)| {
        let mut made = joint(&format!("j{i}"), parent);
        // A link without inertia that carries nothing but fixed links would move nothing, so tips do not stay fixed.
        let tip = !parents.contains(&(i + 1));
        made.kind = match random.below(if tip { 3 } else { 4 }) {
            0 => JointKind::Prismatic,
            1 => JointKind::Revolute,
            2 => JointKind::Continuous,
            _ => JointKind::Fixed,
        };
        (made.origin, made.axis) = (random.pose(), random.axis());
        if random.happens(0.3) {
            (made.child_pose, made.reference) = (random.pose(), random.between(-1.0, 1.0));
        }
        if random.happens(0.5) {
            (made.damping, made.friction) = (random.between(0.0, 1.0), random.between(0.0, 1.0));
            (made.stiffness, made.rest) = (random.between(0.0, 5.0), random.between(-1.0, 1.0));
            made.armature = random.between(0.0, 0.5);
        }
        if links[i + 1].inertia.is_none() {
            // Or two slides along one axis with nothing in between would move nothing.
            made.armature = random.between(0.1, 0.5);
        }
        made
    });
    let mut joints: Vec<Joint> = joints.collect();
    if mimic {
        follow(random, &mut joints);
    }
    Robot { name: "random".into(), links, joints, ..Robot::default() }
}

/// Lets some joints follow others, before or after them, also in chains.
fn follow(random: &mut Random, joints: &mut [Joint]) {
    let moving: Vec<usize> = (0..joints.len()).filter(|&i| joints[i].kind != JointKind::Fixed).collect();
    let turned = random.below(moving.len());
    let order: Vec<usize> = moving[turned..].iter().chain(&moving[..turned]).copied().collect();
    for place in 1..order.len() {
        if random.happens(0.4) {
            let (ratio, offset) = (random.between(-2.0, 2.0), random.between(-0.5, 0.5));
            joints[order[place]].mimic = Some(Mimic { joint: order[random.below(place)], ratio, offset });
        }
    }
}

/// A robot at some position, velocity and acceleration.
pub struct Case {
    pub robot: Robot,
    pub tree: Tree,
    pub q: Vec<f64>,
    pub v: Vec<f64>,
    pub a: Vec<f64>,
    pub random: Random,
}

/// Gravity that is along no axis.
pub const GRAVITY: [f64; 3] = [0.3, -1.2, -9.7];

impl Case {
    pub fn new(seed: u64, joints: usize, mimic: bool) -> Self {
        let mut random = Random::new(seed);
        let robot = robot(&mut random, joints, mimic);
        let tree = Tree::new(&robot);
        let n = tree.dofs();
        let (q, v, a) = (random.list(n, 3.0), random.list(n, 2.0), random.list(n, 5.0));
        Self { robot, tree, q, v, a, random }
    }

    pub fn numbers<S: Scalar>(&self) -> Numbers<S> {
        Numbers::of(&self.robot, GRAVITY)
    }
}
