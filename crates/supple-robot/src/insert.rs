//! Joints inserted into a robot at a frame: the compliance of a mount, or a door in the world.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use crate::{Inertia, Joint, JointKind, Link, Measured, Pose, Robot};

/// The motion of an inserted joint: a translation along an axis of its frame, or a rotation about one.
///
/// Example: [`Insert`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InsertedAxis {
    /// Suffix of the joint's name: with `x`, the joint of insert `NAME` is called `NAME_x`.
    pub name: &'static str,
    /// Whether it slides or turns.
    pub kind: JointKind,
    /// The axis in the frame, of length 1.
    pub axis: [f64; 3],
}

impl InsertedAxis {
    /// Slides along x, y and z, and turns about them.
    pub const ALL: [Self; 6] = {
        const fn along(name: &'static str, axis: [f64; 3]) -> InsertedAxis {
            InsertedAxis { name, kind: JointKind::Prismatic, axis }
        }
        const fn about(name: &'static str, axis: [f64; 3]) -> InsertedAxis {
            InsertedAxis { name, kind: JointKind::Continuous, axis }
        }
        let [x, y, z] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        [along("x", x), along("y", y), along("z", z), about("rx", x), about("ry", y), about("rz", z)]
    };
}

/// Joints to insert, one after the other.
///
/// ```
/// use supple_robot::{Insert, InsertedAxis, LoadOptions, Pose};
/// # let text = r#"<robot name="pendulum"><link name="world"/>
/// #     <joint name="hinge" type="continuous"><parent link="world"/><child link="rod"/><axis xyz="0 1 0"/></joint>
/// #     <link name="rod"><inertial><origin xyz="0 0 -0.5"/><mass value="2"/>
/// #         <inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link></robot>"#;
/// // The pendulum of the front page.
/// let robot = supple_robot::parse(text, "pendulum.urdf", &LoadOptions::default())?;
/// // A mount that is compliant along z.
/// let axes = vec![InsertedAxis::ALL[2]];
/// let (pose, carries) = (Pose::IDENTITY, vec![1]);
/// let mount = Insert { name: "mount".into(), link: 0, pose, axes, inertia: None, carries, line: 0 };
/// let mounted = robot.with_insert(&mount);
/// let joints: Vec<_> = mounted.joints.iter().map(|joint| joint.name.as_str()).collect();
/// assert_eq!(joints, ["mount_z", "hinge"]);
/// # Ok::<(), supple_text::FileError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Insert {
    /// Name of the link beyond the joints. The joints are named `NAME_x` and so on, and links between them `NAME_x_side`.
    pub name: String,
    /// The link that they are mounted on.
    pub link: usize,
    /// The mount's frame in that link; the axes are given in this frame.
    pub pose: Pose,
    /// The joints, the first one nearest to the link; at least one.
    pub axes: Vec<InsertedAxis>,
    /// Inertia of the link beyond, in its frame, which is that of the mount when all joints are at 0.
    pub inertia: Option<Inertia>,
    /// Links to reattach to the mount. They must be children of `link`; its other children stay where they are.
    pub carries: Vec<usize>,
    /// Line of the file that requests it.
    pub line: usize,
}

impl Insert {
    /// Names of the joints.
    pub fn joints(&self) -> impl Iterator<Item = String> + '_ {
        self.axes.iter().map(|axis| format!("{}_{}", self.name, axis.name))
    }

    /// Names of the links, the last of which is the one beyond.
    pub fn links(&self) -> impl Iterator<Item = String> + '_ {
        let last = self.axes.len().saturating_sub(1);
        let between = self.joints().take(last).map(|joint| format!("{joint}_side"));
        between.chain(std::iter::once(self.name.clone()))
    }
}

impl Robot {
    /// The robot with joints inserted, without drives and limits; at joint positions 0 the robot is unchanged. Other links,
    /// joints and frames keep their names and numbers, but links that the mount carries come after the new joints.
    #[must_use]
    pub fn with_insert(&self, insert: &Insert) -> Self {
        let (links, joints) = (self.links.len(), self.joints.len());
        let mut robot = self.clone();
        let beyond = links + insert.axes.len() - 1;
        for (i, ((axis, joint), link)) in insert.axes.iter().zip(insert.joints()).zip(insert.links()).enumerate() {
            let (parent, origin) = if i == 0 { (insert.link, insert.pose) } else { (links + i - 1, Pose::IDENTITY) };
            let inertia = insert.inertia.filter(|_| links + i == beyond);
            robot.links.push(Link {
                name: link,
                inertia,
                meshes: Vec::new(),
                primitives: Vec::new(),
                line: insert.line,
            });
            let free = Joint::free(joint, axis.kind, parent);
            robot.joints.push(Joint { origin, axis: axis.axis, line: insert.line, ..free });
        }
        let to_mount = insert.pose.inverse();
        for &link in &insert.carries {
            if let Some(joint) = link.checked_sub(1).filter(|&joint| joint < joints)
                && robot.joints[joint].parent == insert.link
            {
                let joint = &mut robot.joints[joint];
                joint.parent = beyond;
                joint.origin = to_mount.compose(&joint.origin);
            }
        }
        for key in &mut robot.keys {
            key.positions.resize(robot.joints.len(), 0.0);
            key.velocities.resize(robot.joints.len(), 0.0);
        }
        for sensor in &mut robot.sensors {
            if let Measured::FramePosition(number) | Measured::FrameOrientation(number) = &mut sensor.measures
                && *number >= links
            {
                *number += insert.axes.len();
            }
        }
        robot.sorted()
    }

    /// The same robot with every link after its parent, otherwise in their present order.
    fn sorted(mut self) -> Self {
        let count = self.links.len();
        let mut children = vec![Vec::new(); count];
        for (index, joint) in self.joints.iter().enumerate() {
            children[joint.parent].push(index + 1);
        }
        let mut order = Vec::with_capacity(count);
        let mut ready = BinaryHeap::from([Reverse(0)]);
        while let Some(Reverse(link)) = ready.pop() {
            order.push(link);
            ready.extend(children[link].iter().copied().map(Reverse));
        }
        let mut place = vec![0; count];
        for (new, &old) in order.iter().enumerate() {
            place[old] = new;
        }
        let joint_place = |joint: usize| place[joint + 1] - 1;
        self.links = order.iter().map(|&old| self.links[old].clone()).collect();
        let joints = order.iter().skip(1).map(|&old| self.joints[old - 1].clone());
        self.joints = joints.collect();
        for joint in &mut self.joints {
            joint.parent = place[joint.parent];
            if let Some(mimic) = &mut joint.mimic {
                mimic.joint = joint_place(mimic.joint);
            }
        }
        for frame in &mut self.frames {
            frame.link = place[frame.link];
        }
        for actuator in &mut self.actuators {
            actuator.joint = joint_place(actuator.joint);
        }
        for sensor in &mut self.sensors {
            match &mut sensor.measures {
                Measured::JointPosition(joint) | Measured::JointVelocity(joint) | Measured::JointTorque(joint) => {
                    *joint = joint_place(*joint);
                }
                Measured::FramePosition(number) | Measured::FrameOrientation(number) => {
                    if let Some(&link) = place.get(*number) {
                        *number = link;
                    }
                }
            }
        }
        for key in &mut self.keys {
            let of = |list: &[f64]| order.iter().skip(1).map(|&old| list[old - 1]).collect();
            (key.positions, key.velocities) = (of(&key.positions), of(&key.velocities));
        }
        self
    }
}
