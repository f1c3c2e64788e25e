//! The part of a robot that a task moves: the joints from the world to a frame.

use std::path::Path;

use supple_robot::{Joint, JointKind, Numbers, Pose, Tree};
use supple_text::{nearest, owned, quoted};

use crate::commands::robot::Planning;
use crate::failure::Failure;

/// Maximum number of joints that a task moves: those nearest the frame.
pub const MOST_JOINTS: usize = 7;
/// Minimum number of joints of an arm that carries fingers, and maximum number of joints of a finger.
const ARM: usize = 5;
const FINGER: usize = 7;
/// Maximum that a sliding joint adds to the reach, m: contact sizes should not scale with the length of a rail.
const SLIDE: f64 = 0.5;
/// Names of tool centre points, possibly prefixed by the arm's name: `panda_hand_tcp`.
const POINTS: [&str; 2] = ["tool0", "tcp"];
/// Names of the other frames that tools are mounted on, the likeliest first.
const TOOLS: [&str; 7] = ["ee_link", "flange", "end_effector", "attachment_site", "link_ee", "gripper", "hand"];

/// A limb.
pub struct Limb {
    /// The robot, joints that are not of the limb locked.
    pub planning: Planning,
    /// Where a tool is mounted: link or frame of the robot's file.
    pub frame: String,
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
        let robot = &whole.robot;
        let named = || {
            let links = robot.links.iter().map(|link| link.name.as_str());
            links.chain(robot.frames.iter().map(|frame| frame.name.as_str()))
        };
        let name = match frame {
            Some(name) => name.to_owned(),
            None => likeliest(whole),
        };
        let wrong = |why: String| Failure::usage(format!("--frame {name}: {why}"));
        let Some((link, pose)) = robot.frame(&name) else {
            let names: Vec<&str> = named().collect();
            let hint = nearest(&name, &names).map_or_else(String::new, |hint| format!(" ({hint})"));
            return Err(wrong(format!("{} has no such link or frame: {}{hint}", file.display(), owned(&names))));
        };
        let mut dofs = joints_to(whole, link);
        if dofs.is_empty() {
            return Err(wrong("no joint moves it".into()));
        }
        dofs.truncate(MOST_JOINTS);
        let others: Vec<usize> = (0..whole.tree.dofs()).filter(|dof| !dofs.contains(dof)).collect();
        let planning = whole.locking(&others);
        let gravity = planning.robot.gravity.unwrap_or([0.0, 0.0, -9.81]);
        let [reach, span] = [SLIDE, f64::INFINITY].map(|slide| length(&planning, link, &pose, slide));
        let mass = moved(&planning);
        Ok(Self { planning, frame: name, link, pose, gravity, reach, span, mass })
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

    /// What moves the tool, for people.
    pub fn chosen(&self) -> String {
        let joints = self.joints();
        let driven = self.driven();
        let passive: Vec<&String> =
            (0..joints.len()).filter(|dof| !driven.contains(dof)).map(|dof| &joints[dof]).collect();
        let moved: Vec<&String> = driven.into_iter().map(|dof| &joints[dof]).collect();
        let still =
            if passive.is_empty() { String::new() } else { format!(", and without drives {}", quoted(&passive)) };
        format!("the tool is on `{}`, moved by {}{still}; --frame chooses another place", self.frame, quoted(&moved))
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

/// The joints of a robot with drives: those that actuators of the file drive, or else those with an effort, or else all.
pub fn driven(planning: &Planning) -> Vec<usize> {
    let (robot, tree) = (&planning.robot, &planning.tree);
    let joint = |dof: &usize| tree.joint_indices()[*dof];
    let all = || 0..tree.dofs();
    let with_actuator: Vec<_> =
        all().filter(|dof| robot.actuators.iter().any(|actuator| actuator.joint == joint(dof))).collect();
    let with_effort: Vec<_> = all().filter(|dof| robot.joints[joint(dof)].limits.effort > 0.0).collect();
    [with_actuator, with_effort].into_iter().find(|found| !found.is_empty()).unwrap_or_else(|| all().collect())
}

/// The frame that a tool is most likely mounted on: the first of the usual names that most joints move; otherwise the link
/// that carries fingers; otherwise the last link moved by most joints. Only driven joints count; among links moved by
/// equally many drives, those moved by the fewest undriven joints are preferred.
pub fn likeliest(whole: &Planning) -> String {
    let robot = &whole.robot;
    let driven = driven(whole);
    // How many drives move a link, and how many joints without a drive do.
    let moved = |link: usize| {
        let dofs = joints_to(whole, link);
        let count = dofs.iter().filter(|dof| driven.contains(dof)).count();
        (count, dofs.len() - count)
    };
    let depth = |name: &str| robot.frame(name).map_or(0, |(link, _)| moved(link).0);
    let most = (0..robot.links.len()).map(|link| moved(link).0).max().unwrap_or(0);
    // The link that carries the first joint of a finger.
    let bodies = whole.tree.bodies();
    let palm = palm(&whole.tree).and_then(|palm| bodies.iter().find(|body| body.parent == Some(palm)));
    let palm = palm.map(|finger| robot.joints[finger.joint].parent);
    // If there is a palm, compare with its joints only, not with those of the fingers.
    let most = palm.map_or(most, |link| moved(link).0);
    let links = robot.links.iter().map(|link| link.name.as_str());
    let names: Vec<&str> = links.chain(robot.frames.iter().map(|frame| frame.name.as_str())).collect();
    let is_called =
        |name: &str, tool: &str| name == tool || name.strip_suffix(tool).is_some_and(|arm| arm.ends_with('_'));
    let points = POINTS.iter().filter_map(|tool| names.iter().copied().find(|name| is_called(name, tool)));
    let usual = points.chain(TOOLS).find(|name| depth(name) >= 3.max(most.saturating_sub(2)));
    if let Some(name) = usual {
        return name.to_owned();
    }
    let rank = |&link: &usize| (moved(link).0, std::cmp::Reverse(moved(link).1));
    let last = palm.or_else(|| (0..robot.links.len()).max_by_key(rank));
    robot.links[last.unwrap_or(robot.links.len() - 1)].name.clone()
}

/// The palm: the body at the end of an arm that carries at least two limbs with few joints each; `None` if
/// there is none. Fingers may branch too, so the candidate closest to the world is chosen.
fn palm(tree: &Tree) -> Option<usize> {
    let bodies = tree.bodies();
    // For each body: its depth, the number of limbs it carries, and the number of joints in the longest of them.
    let (mut depths, mut limbs, mut beyond) = (vec![0; bodies.len()], vec![0; bodies.len()], vec![0; bodies.len()]);
    for (body, found) in bodies.iter().enumerate() {
        depths[body] = found.parent.map_or(1, |parent| depths[parent] + 1);
    }
    for (body, found) in bodies.iter().enumerate().rev() {
        if let Some(parent) = found.parent {
            limbs[parent] += 1;
            beyond[parent] = beyond[parent].max(beyond[body] + 1);
        }
    }
    let is_palm = |body: &usize| depths[*body] >= ARM && limbs[*body] > 1 && beyond[*body] <= FINGER;
    (0..bodies.len()).filter(is_palm).min_by_key(|&body| depths[body])
}

/// The degrees of freedom that move a link, the nearest first.
fn joints_to(planning: &Planning, link: usize) -> Vec<usize> {
    let mut dofs = Vec::new();
    let mut body = planning.tree.body_of(link);
    while let Some(found) = body.map(|body| &planning.tree.bodies()[body]) {
        if !dofs.contains(&found.dof) {
            dofs.push(found.dof);
        }
        body = found.parent;
    }
    dofs
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
