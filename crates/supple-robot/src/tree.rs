//! Moving parts of a robot, and their coordinates.

use crate::{Joint, JointKind, Key, Robot};

/// The moving bodies of a robot: only structure, without any numbers that a design may change.
///
/// A body is a set of links that are fixed to one another, carried by one moving joint. Its frame is the moved frame of
/// that joint, rotated such that the axis of the joint is z. Body frames are internal to the algorithms:
/// [`Kinematics`](crate::Kinematics) gives poses and velocities of links. Links that are fixed to the root belong to
/// the world.
///
/// The coordinates are those of the joints that move and follow no other, the *degrees of freedom*, in the order of the
/// robot's joints. A joint that follows another shares its degree of freedom.
///
/// Example: the [front page](crate).
#[derive(Clone, Debug)]
pub struct Tree {
    bodies: Vec<Body>,
    links: Vec<Place>,
    names: Vec<String>,
    masters: Vec<usize>,
}

/// The motion of a body at its joint.
///
/// Example: [`Body`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Motion {
    /// Turns about the axis.
    Turn,
    /// Slides along the axis.
    Slide,
}

/// A moving body and its joint.
///
/// ```
/// use supple_robot::{LoadOptions, Motion, Tree};
/// # let text = r#"<robot name="pendulum"><link name="world"/>
/// #     <joint name="hinge" type="continuous"><parent link="world"/><child link="rod"/><axis xyz="0 1 0"/></joint>
/// #     <link name="rod"><inertial><origin xyz="0 0 -0.5"/><mass value="2"/>
/// #         <inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link></robot>"#;
/// // The pendulum of the front page.
/// let robot = supple_robot::parse(text, "pendulum.urdf", &LoadOptions::default())?;
/// let tree = Tree::new(&robot);
/// let body = &tree.bodies()[0];
/// assert_eq!((body.parent, body.joint, body.motion), (None, 0, Motion::Turn));
/// # Ok::<(), supple_text::FileError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Body {
    /// Index of its parent body, which is less than its own; `None` if its parent is the world.
    pub parent: Option<usize>,
    /// Index of its joint in the robot.
    pub joint: usize,
    /// What it does at its joint.
    pub motion: Motion,
    /// Index of the degree of freedom that moves it.
    pub dof: usize,
    /// Ratio of its joint's position to that of the degree of freedom: 1 except for joints that follow another.
    pub ratio: f64,
    /// Position of its joint when the degree of freedom is at 0, rad or m.
    pub offset: f64,
    /// Position at which its joint's moved frame coincides with the joint's frame, rad or m.
    pub reference: f64,
    /// Axes of the body in the joint's moved frame: a rotation by rows, whose third column is the axis of the joint.
    pub axes: [[f64; 3]; 3],
}

/// Where a link belongs.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Place {
    /// The link that carries it; none for the root.
    pub parent: Option<usize>,
    /// The body it belongs to; none for the world.
    pub body: Option<usize>,
    /// Whether its own joint moves.
    pub moves: bool,
}

impl Tree {
    /// The tree of a robot, which must be structured as by [`load`](crate::load()): links after their parents, joint `i`
    /// carrying link `i + 1`, and every joint that follows another leading to a joint that moves and follows none. A
    /// joint that does not lead to one, for example because joints follow one another in a cycle, is treated as following
    /// none.
    #[must_use]
    pub fn new(robot: &Robot) -> Self {
        let mut dofs = vec![None; robot.joints.len()];
        let (mut names, mut masters) = (Vec::new(), Vec::new());
        for (index, joint) in robot.joints.iter().enumerate() {
            if joint.kind != JointKind::Fixed && followed(robot, index).is_none() {
                dofs[index] = Some(names.len());
                names.push(joint.name.clone());
                masters.push(index);
            }
        }
        let mut links = vec![Place { parent: None, body: None, moves: false }];
        let mut bodies = Vec::new();
        for (index, joint) in robot.joints.iter().enumerate() {
            let carrier = links[joint.parent].body;
            let (master, ratio, offset) = followed(robot, index).unwrap_or((index, 1.0, 0.0));
            let moves = joint.kind != JointKind::Fixed;
            let body = match dofs[master] {
                Some(dof) if moves => {
                    bodies.push(Body::new(joint, index, carrier, dof, ratio, offset));
                    Some(bodies.len() - 1)
                }
                _ => carrier,
            };
            links.push(Place { parent: Some(joint.parent), body, moves });
        }
        Self { bodies, links, names, masters }
    }

    /// Number of degrees of freedom.
    #[must_use]
    pub fn dofs(&self) -> usize {
        self.names.len()
    }

    /// Names of the joints that are the degrees of freedom, in their order.
    #[must_use]
    pub fn joints(&self) -> &[String] {
        &self.names
    }

    /// Indices in the robot of the joints that are the degrees of freedom, in their order.
    #[must_use]
    pub fn joint_indices(&self) -> &[usize] {
        &self.masters
    }

    /// The moving bodies, each after the one that carries it.
    #[must_use]
    pub fn bodies(&self) -> &[Body] {
        &self.bodies
    }

    /// The body that a link belongs to; `None` if that is the world, or there is no such link.
    #[must_use]
    pub fn body_of(&self, link: usize) -> Option<usize> {
        self.links.get(link)?.body
    }

    /// Whether some joint follows another.
    #[must_use]
    pub fn has_mimic(&self) -> bool {
        self.bodies.len() > self.names.len()
    }

    /// Depth of the tree: greatest number of bodies on a path to the world.
    #[must_use]
    pub fn depth(&self) -> usize {
        (0..self.bodies.len()).map(|body| self.path(Some(body)).count()).max().unwrap_or(0)
    }

    /// A body, its parent body, and so on to the world.
    pub(crate) fn path(&self, body: Option<usize>) -> impl Iterator<Item = usize> {
        std::iter::successors(body, |&body| self.bodies[body].parent)
    }

    /// Where each link belongs.
    pub(crate) fn places(&self) -> &[Place] {
        &self.links
    }
}

impl Body {
    fn new(joint: &Joint, index: usize, parent: Option<usize>, dof: usize, ratio: f64, offset: f64) -> Self {
        let motion = if joint.kind == JointKind::Prismatic { Motion::Slide } else { Motion::Turn };
        let (reference, axes) = (joint.reference, axes_about(joint.axis));
        Self { parent, joint: index, motion, dof, ratio, offset, reference, axes }
    }
}

/// The moving joint at the end of the chain of joints that a joint follows, with the ratio and offset of the whole
/// chain; `None` if it follows none, or the chain does not end at a moving joint.
fn followed(robot: &Robot, joint: usize) -> Option<(usize, f64, f64)> {
    let (mut master, mut ratio, mut offset) = (joint, 1.0, 0.0);
    // A chain longer than the list of joints is a cycle.
    for _ in 0..robot.joints.len() {
        let Joint { mimic, kind, .. } = robot.joints.get(master)?;
        let Some(mimic) = mimic else {
            return (master != joint && *kind != JointKind::Fixed).then_some((master, ratio, offset));
        };
        (master, ratio, offset) = (mimic.joint, ratio * mimic.ratio, ratio * mimic.offset + offset);
    }
    None
}

/// A rotation, by rows, whose third column is the unit vector `axis`, with as many zeros as possible.
fn axes_about(axis: [f64; 3]) -> [[f64; 3]; 3] {
    let least = (0..3).fold(0, |least, i| if axis[i].abs() < axis[least].abs() { i } else { least });
    let mut helper = [0.0; 3];
    helper[least] = 1.0;
    // If entries are equally small, such as the zeros of a coordinate axis, the first is used: x and y for z.
    let across = crate::pose::sub(helper, crate::pose::scale(axis[least], axis));
    let first = crate::pose::scale(1.0 / crate::pose::dot(across, across).sqrt(), across);
    let second = crate::pose::cross(axis, first);
    [0, 1, 2].map(|row| [first[row], second[row], axis[row]])
}

impl Key {
    /// Positions of the degrees of freedom of a tree, in their order, rad or m.
    #[must_use]
    pub fn q(&self, tree: &Tree) -> Vec<f64> {
        tree.joint_indices().iter().map(|&joint| self.positions[joint]).collect()
    }

    /// Velocities of the degrees of freedom of a tree, in their order, rad/s or m/s.
    #[must_use]
    pub fn v(&self, tree: &Tree) -> Vec<f64> {
        tree.joint_indices().iter().map(|&joint| self.velocities[joint]).collect()
    }
}
