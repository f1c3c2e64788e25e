//! The part of a robot that a task moves: the joints from the world to a frame.

use std::path::Path;

use supple_robot::{Joint, JointKind, Numbers, Pose};
use supple_text::{nearest, owned, quoted};

use super::joints::{driven, joints_to};
use super::tool::Tool;
use crate::commands::robot::Planning;
use crate::failure::Failure;

/// Maximum number of joints that a task moves: those nearest the frame.
pub const MOST_JOINTS: usize = 7;
/// Maximum that a sliding joint adds to the reach, m: contact sizes should not scale with the length of a rail.
const SLIDE: f64 = 0.5;

/// A limb.
pub struct Limb {
    /// The robot, joints that are not of the limb locked.
    pub planning: Planning,
    /// Where a tool is mounted.
    pub tool: Tool,
    /// Whether joints of it are locked, as there are more than [`MOST_JOINTS`].
    pub is_long: bool,
    pub link: usize,
    /// The frame in its link.
    pub pose: Pose,
    /// Acceleration by gravity, m/s^2.
    pub gravity: [f64; 3],
    /// Length of the limb from its first joint to the frame, m, with at most half a metre for each slide.
    pub reach: f64,
    /// The same length, but with half of the full range of each slide, m.
    pub span: f64,
    /// Mass that it moves, kg.
    pub mass: f64,
}

impl Limb {
    /// The limb that ends at a frame, or at the one that looks most like that of a tool.
    ///
    /// # Errors
    /// Where there is no such frame, or no joint moves it.
    pub fn of(whole: &Planning, frame: Option<&str>, file: &Path) -> Result<Self, Failure> {
        let likeliest = Tool::likeliest(whole);
        let tool = frame.filter(|frame| *frame != likeliest.frame).map_or(likeliest, Tool::named);
        let (robot, name) = (&whole.robot, &tool.frame);
        let wrong = |why: String| Failure::usage(format!("--frame {name}: {why}"));
        let Some((link, pose)) = tool.place(robot) else {
            let links = robot.links.iter().map(|link| link.name.as_str());
            let names: Vec<&str> = links.chain(robot.frames.iter().map(|frame| frame.name.as_str())).collect();
            let hint = nearest(name, &names).map_or_else(String::new, |hint| format!(" ({hint})"));
            return Err(wrong(format!("{} has no such link or frame: {}{hint}", file.display(), owned(&names))));
        };
        let mut dofs = joints_to(whole, link);
        if dofs.is_empty() {
            return Err(wrong("no joint moves it".into()));
        }
        let is_long = dofs.len() > MOST_JOINTS;
        dofs.truncate(MOST_JOINTS);
        let others: Vec<usize> = (0..whole.tree.dofs()).filter(|dof| !dofs.contains(dof)).collect();
        let mut planning = whole.locking(&others);
        tool.add_to(&mut planning.robot);
        let gravity = planning.robot.gravity.unwrap_or([0.0, 0.0, -9.81]);
        let [reach, span] = [SLIDE, f64::INFINITY].map(|slide| length(&planning, link, &pose, slide));
        let mass = moved(&planning);
        Ok(Self { planning, tool, is_long, link, pose, gravity, reach, span, mass })
    }

    /// The name of the frame on which a tool is mounted.
    pub fn frame(&self) -> &str {
        &self.tool.frame
    }

    /// Whether all of its joints slide.
    pub fn slides(&self) -> bool {
        self.of_kind(false).next().is_none()
    }

    /// Whether no joint of it slides without end.
    pub fn is_bounded(&self) -> bool {
        self.of_kind(true).all(|joint| (joint.limits.upper - joint.limits.lower).is_finite())
    }

    /// How far the tool moves at most for joints that move by 1, m: the reach, or 1 where all joints slide.
    pub fn lever(&self) -> f64 {
        if self.slides() { 1.0 } else { self.reach }
    }

    /// The unit of its joints' speeds.
    pub fn speed_unit(&self) -> &'static str {
        if self.slides() { "m/s" } else { "rad/s" }
    }

    /// Names of its joints.
    pub fn joints(&self) -> &[String] {
        self.planning.tree.joints()
    }

    /// The numbers of its robot.
    pub fn numbers(&self) -> Numbers<f64> {
        Numbers::of(&self.planning.robot, self.gravity)
    }

    /// Greatest effort of the drive of each joint, N m or N, by its own limit and that of the actuators of the file;
    /// infinite where the file has none.
    pub fn efforts(&self) -> Vec<f64> {
        let indices = self.planning.tree.joint_indices().iter();
        indices.map(|&joint| self.planning.robot.greatest_effort(joint)).collect()
    }

    /// Stiffness of the spring of a joint, N m/rad or N/m; 0 if it has none.
    pub fn stiffness(&self, dof: usize) -> f64 {
        self.planning.robot.joints[self.planning.tree.joint_indices()[dof]].stiffness
    }

    /// The joints with a spring and without a drive.
    pub fn sprung(&self) -> Vec<usize> {
        let driven = self.driven();
        (0..self.joints().len()).filter(|dof| !driven.contains(dof) && self.stiffness(*dof) > 0.0).collect()
    }

    /// What moves the tool, for people; `what` is there.
    pub fn chosen(&self, what: &str) -> String {
        let joints = self.joints();
        let driven = self.driven();
        let passive: Vec<&String> =
            (0..joints.len()).filter(|dof| !driven.contains(dof)).map(|dof| &joints[dof]).collect();
        let moved: Vec<&String> = driven.into_iter().map(|dof| &joints[dof]).collect();
        let still =
            if passive.is_empty() { String::new() } else { format!(", and without drives {}", quoted(&passive)) };
        format!("{what} `{}`, moved by {}{still}; --frame chooses another place", self.frame(), quoted(&moved))
    }

    /// The least speed limit of its joints that slide, m/s, or of those that turn, rad/s; infinite where the file has none.
    pub fn slowest(&self, slides: bool) -> f64 {
        self.of_kind(slides)
            .map(|joint| joint.limits.velocity)
            .filter(|speed| *speed > 0.0)
            .fold(f64::INFINITY, f64::min)
    }

    /// Names of its joints that slide, or of those that turn.
    pub fn joints_that(&self, slides: bool) -> Vec<&str> {
        self.of_kind(slides).map(|joint| joint.name.as_str()).collect()
    }

    /// Its joints that move.
    fn moving(&self) -> impl Iterator<Item = &Joint> {
        self.planning.tree.joint_indices().iter().map(|&joint| &self.planning.robot.joints[joint])
    }

    /// Its joints that slide, or those that turn.
    pub fn of_kind(&self, slides: bool) -> impl Iterator<Item = &Joint> {
        self.moving().filter(move |joint| (joint.kind == JointKind::Prismatic) == slides)
    }

    /// The joints with drives: those that actuators of the file drive, or else those with an effort, or else all.
    pub fn driven(&self) -> Vec<usize> {
        driven(&self.planning)
    }

    /// A name that is not yet used in the robot.
    pub fn free_name(&self, wanted: &str) -> String {
        let robot = &self.planning.robot;
        let taken = |name: &str| {
            robot.frame(name).is_some() || robot.joints.iter().any(|joint| joint.name.starts_with(&format!("{name}_")))
        };
        std::iter::once(wanted.to_owned())
            .chain((2..).map(|number| format!("{wanted}_{number}")))
            .find(|name| !taken(name))
            .unwrap_or_default()
    }
}

/// The joints without a drive that gravity moves: those that more than `least`, N m or N, of each joint holds.
pub fn falling(planning: &Planning, held: &[f64], least: impl Fn(usize) -> f64) -> Vec<usize> {
    let driven = driven(planning);
    (0..held.len()).filter(|dof| !driven.contains(dof) && held[*dof].abs() > least(*dof)).collect()
}

/// Length of the chain from the first joint that moves to a frame, m; slides count with half of their range, and with no
/// more than `most`.
fn length(planning: &Planning, link: usize, pose: &Pose, most: f64) -> f64 {
    let robot = &planning.robot;
    let norm = |v: [f64; 3]| v.iter().map(|entry| entry * entry).sum::<f64>().sqrt();
    let mut total = norm(pose.position);
    let mut at = link;
    let mut since_last = 0.0;
    while let Some(joint) = at.checked_sub(1).map(|joint| &robot.joints[joint]) {
        since_last += norm(joint.child_pose.position);
        if joint.kind != JointKind::Fixed {
            total += std::mem::take(&mut since_last);
            let range = joint.limits.upper - joint.limits.lower;
            if joint.kind == JointKind::Prismatic && range.is_finite() {
                total += (0.5 * range).min(most);
            }
        }
        since_last += norm(joint.origin.position);
        at = joint.parent;
    }
    if total > 1e-3 { total } else { 0.3 }
}

/// Mass of everything that moves, kg.
fn moved(planning: &Planning) -> f64 {
    let links = planning.robot.links.iter().enumerate();
    let moved = links.filter(|(link, _)| planning.tree.body_of(*link).is_some());
    let mass: f64 = moved.filter_map(|(_, link)| link.inertia).map(|inertia| inertia.mass).sum();
    if mass > 0.0 { mass } else { 1.0 }
}
