//! The part of a robot that a task moves: the joints from the world to a frame.

use std::path::Path;

use supple_robot::{JointKind, Numbers, Pose};
use supple_text::{nearest, owned};

use crate::commands::robot::Planning;
use crate::failure::Failure;

/// Joints that a task moves at most: those next to the frame.
pub const MOST_JOINTS: usize = 7;
/// Names of the frames that tools are mounted on, the likeliest first.
const TOOLS: [&str; 9] =
    ["tool0", "tcp", "ee_link", "flange", "end_effector", "attachment_site", "link_ee", "gripper", "hand"];

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
    /// Length of the limb from its first joint to the frame, m.
    pub reach: f64,
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
        let (reach, mass) = (length(&planning, link, &pose), moved(&planning));
        Ok(Self { planning, frame: name, link, pose, gravity, reach, mass })
    }

    /// Whether all of its joints slide.
    pub fn slides(&self) -> bool {
        let joints = self.planning.tree.joint_indices();
        joints.iter().all(|&joint| self.planning.robot.joints[joint].kind == JointKind::Prismatic)
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

    /// Greatest effort of the drive of each joint, N m or N; infinite where the file has none.
    pub fn efforts(&self) -> Vec<f64> {
        let robot = &self.planning.robot;
        let of = |&joint: &usize| match robot.joints[joint].limits.effort {
            effort if effort > 0.0 => effort,
            _ => f64::INFINITY,
        };
        self.planning.tree.joint_indices().iter().map(of).collect()
    }

    /// The least speed limit of its joints, rad/s or m/s; infinite where the file has none.
    pub fn slowest(&self) -> f64 {
        let speeds =
            self.planning.tree.joint_indices().iter().map(|&joint| self.planning.robot.joints[joint].limits.velocity);
        speeds.filter(|speed| *speed > 0.0).fold(f64::INFINITY, f64::min)
    }

    /// A name that the robot has not taken.
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

/// The frame that a tool is most likely mounted on: the first of the usual names that most joints move, or else the last
/// link that most joints move.
pub fn likeliest(whole: &Planning) -> String {
    let robot = &whole.robot;
    let depth = |name: &str| robot.frame(name).map_or(0, |(link, _)| joints_to(whole, link).len());
    let most = (0..robot.links.len()).map(|link| joints_to(whole, link).len()).max().unwrap_or(0);
    // Fingers beyond the tool's mount do not count against it.
    let usual = TOOLS.iter().copied().filter(|name| depth(name) >= 3.max(most.saturating_sub(2)));
    if let Some(name) = usual.into_iter().next() {
        return name.to_owned();
    }
    let last = (0..robot.links.len()).rfind(|&link| joints_to(whole, link).len() == most.min(MOST_JOINTS));
    robot.links[last.unwrap_or(robot.links.len() - 1)].name.clone()
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

/// Length of the chain from the first joint that moves to a frame, m; slides count with half of their range.
fn length(planning: &Planning, link: usize, pose: &Pose) -> f64 {
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
                total += 0.5 * range;
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
