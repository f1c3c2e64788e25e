//! Where a robot carries its tool.

use std::cmp::Reverse;
use std::fmt::Write;

use supple_robot::vector::{dot, sub};
use supple_robot::{Frame, Kinematics, Numbers, Pose, Robot, Tree};
use supple_text::significant;

use super::joints::{driven, joints_to, joints_up_to};
use crate::commands::robot::Planning;

/// Minimum number of joints of an arm that carries fingers, and maximum number of joints of a finger.
const ARM: usize = 5;
const FINGER: usize = 7;
/// Words of links that hold things, and do not carry a tool; and a word of joints of such links only.
const JAWS: [&str; 5] = ["finger", "jaw", "thumb", "knuckle", "claw"];
const GRIPPER: &str = "gripper";
/// Minimum number of driven joints of a limb that carries a single jaw.
const LIMB: usize = 3;
/// Last words of the names of frames on which tools are mounted, the likeliest first, as in `panda_hand_tcp`; and of frames
/// on which they are only if these are not at the last joint.
const TOOLS: [&str; 13] = [
    "tool0",
    "tcp",
    "tool_center_point",
    "grasp",
    "ee",
    "eef",
    "flange",
    "end_effector",
    "attachment",
    "tool_tip",
    "tip",
    "fingertip",
    TOOL,
];
const TOOL: &str = "tool";
const HANDS: [&str; 3] = [GRIPPER, "hand", "foot"];
/// Words after them that say nothing.
const ADDED: [&str; 4] = ["link", "frame", "site", "point"];
/// Words of frames at which nothing is mounted.
const SENSORS: [&str; 6] = ["camera", "imu", "sensor", "optical", "lidar", "ft"];
/// Places closer than this are the same, m.
const SAME: f64 = 1e-3;

/// Where a tool is mounted.
pub struct Tool {
    /// Link or frame of the robot's file, or the frame that the task adds.
    pub frame: String,
    /// Where the task adds it.
    pub added: Option<Added>,
}

/// A frame of the task where the robot's file has none.
#[derive(Clone)]
pub struct Added {
    /// The link that it is on, and its index.
    on: String,
    link: usize,
    /// Its place in the link, m.
    position: [f64; 3],
    /// How that is known.
    at: End,
}

/// How the end of a link is known.
#[derive(Clone, Copy)]
enum End {
    /// From its visual shapes.
    OfShapes,
    /// From its mass and inertia.
    OfRod,
}

impl Tool {
    /// A frame by its name.
    pub fn named(frame: &str) -> Self {
        Self { frame: frame.to_owned(), added: None }
    }

    /// The link that it is on, and where; `None` if the robot has no such frame.
    pub fn place(&self, robot: &Robot) -> Option<(usize, Pose)> {
        match self.added {
            Some(Added { link, position, .. }) => Some((link, Pose::at(position))),
            None => robot.frame(&self.frame),
        }
    }

    /// Adds to a robot the frame that the task adds.
    pub fn add_to(&self, robot: &mut Robot) {
        if let Some(Added { link, position, .. }) = self.added {
            robot.frames.push(Frame { name: self.frame.clone(), link, pose: Pose::at(position) });
        }
    }

    /// The lines of a task file that mount joints on it; frames of the task itself carry none.
    pub fn mount(&self) -> String {
        match &self.added {
            Some(Added { on, position, .. }) => format!("frame = {on:?}\nposition = [{}]", numbers(*position)),
            None => format!("frame = {:?}", self.frame),
        }
    }

    /// Its lines in a task file, after those of `[model]`.
    pub fn write(&self, text: &mut String) {
        if let Some(Added { on, position, at, .. }) = &self.added {
            let position = numbers(*position);
            let end = match at {
                End::OfShapes => "the link's shape ends",
                End::OfRod => "a rod of the link's mass and inertia ends",
            };
            let _ = write!(
                text,
                "\n# The robot file has no frame beyond the last joint: this one is where {end}.\n\
                 [model.frames.{}]\non = {on:?}\nposition = [{position}]             # m\n",
                self.frame
            );
        }
    }

    /// The frame that a tool is most likely mounted on: the first of the usual names that most joints move; otherwise
    /// the link that carries fingers; otherwise the last link moved by most joints, or what is beyond its joint. Only driven
    /// joints count, and not those of a gripper; among links moved by equally many drives, those moved by the fewest
    /// undriven joints are preferred.
    pub fn likeliest(whole: &Planning) -> Self {
        let robot = &whole.robot;
        let reach = Moved::of(whole);
        let palm = palm_link(whole);
        let links = 0..robot.links.len();
        let most = links.clone().map(|link| reach.drives(link)).max().unwrap_or(0);
        // If there is a palm, compare with its joints only, not with those of the fingers.
        let most = palm.map_or(most, |link| reach.drives(link));
        let enough = most.min(3).max(most.saturating_sub(2));
        let (places, carriers) = (reach.places(), reach.carriers(palm));
        for (rank, tool) in TOOLS.iter().chain(&HANDS).enumerate() {
            let least = if rank < TOOLS.len() { 0.0 } else { SAME };
            // What carries jaws may be beyond a tool, such as a sensor of force.
            let carries = |place: &Place| *tool == TOOL && place.distance >= SAME && carriers.contains(&place.name);
            let called = places.iter().filter(|place| {
                let is_tool = is_called(place.name, tool) || carries(place);
                is_tool && reach.drives(place.link) >= enough && place.distance >= least
            });
            if let Some(place) = farthest(called) {
                return Self::named(place.name);
            }
        }
        let rank = |&link: &usize| (reach.drives(link), Reverse(reach.undriven(link)));
        let last = palm.or_else(|| links.max_by_key(rank)).unwrap_or(0);
        let (None, Some(body)) = (palm, whole.tree.body_of(last)) else {
            return Self::named(&robot.links[last].name);
        };
        let beyond = places.iter().filter(|place| {
            let beside = whole.tree.body_of(place.link) == Some(body) && place.distance >= SAME;
            beside && !words(place.name).iter().any(|word| SENSORS.contains(&word.as_str()))
        });
        match farthest(beyond) {
            Some(place) => Self::named(place.name),
            None => Self::beyond_mass(whole, body),
        }
    }

    /// A frame where the link of a body ends: its visual shapes or, if it has none, a rod of its mass and inertia; the link
    /// itself where that is at its joint. The end is towards the centre of mass or, if that is a counterweight, away from the
    /// joint before.
    fn beyond_mass(whole: &Planning, body: usize) -> Self {
        let (robot, bodies) = (&whole.robot, whole.tree.bodies());
        let link = bodies[body].joint + 1;
        let on = robot.links[link].name.clone();
        let Some(inertia) = robot.links[link].inertia.filter(|inertia| inertia.mass > 0.0) else {
            return Self::named(&on);
        };
        let outward = outward(whole, body);
        let towards = if dot(inertia.center, outward) < 0.0 { outward } else { inertia.center };
        let size = norm(towards);
        if size < SAME {
            return Self::named(&on);
        }
        let along = towards.map(|entry| entry / size);
        let primitives = &robot.links[link].primitives;
        let shown = primitives.iter().max_by(|one, other| one.reach(along).total_cmp(&other.reach(along)));
        let moment = inertia.moment;
        let turned: f64 = (0..3).map(|i| along[i] * dot(moment[i], along)).sum();
        let spread = (0.5 * (moment[0][0] + moment[1][1] + moment[2][2]) - turned).max(0.0) / inertia.mass;
        let rod = dot(inertia.center, along) + (3.0 * spread).sqrt();
        let of_rod = (along.map(|entry| rod * entry), End::OfRod);
        let (end, at) = shown.map_or(of_rod, |shown| (shown.end(along), End::OfShapes));
        if dot(end, along) < SAME {
            return Self::named(&on);
        }
        // Without the sign of a 0.
        let position = end.map(|entry| significant(entry, 4) + 0.0);
        let taken = |name: &str| robot.frame(name).is_some() || robot.joints.iter().any(|joint| joint.name == name);
        let mut names = std::iter::once("tip".to_owned()).chain((2..).map(|number| format!("tip_{number}")));
        let frame = names.find(|name| !taken(name)).unwrap_or_default();
        Self { frame, added: Some(Added { on, link, position, at }) }
    }
}

/// A link or frame of a robot.
struct Place<'a> {
    name: &'a str,
    link: usize,
    /// How far it is from the last joint that moves it, m.
    distance: f64,
}

/// Which joints move links.
struct Moved<'a> {
    whole: &'a Planning,
    driven: Vec<usize>,
    /// For each body, whether it is a jaw.
    jaws: Vec<bool>,
}

impl<'a> Moved<'a> {
    fn of(whole: &'a Planning) -> Self {
        let mut moved = Self { whole, driven: driven(whole), jaws: vec![false; whole.tree.bodies().len()] };
        let bodies = whole.tree.bodies();
        for body in (0..bodies.len()).rev() {
            let joint = &whole.robot.joints[bodies[body].joint];
            let child = &whole.robot.links[bodies[body].joint + 1].name;
            let (joint, child) = (joint.name.to_lowercase(), child.to_lowercase());
            let holds = |name: &str| JAWS.iter().any(|jaw| name.contains(jaw));
            let carries = (0..bodies.len()).any(|other| bodies[other].parent == Some(body) && !moved.jaws[other]);
            let limb = bodies[body].parent.map_or(0, |parent| moved.drives_of(Some(parent)));
            let is_jaw = joint.contains(GRIPPER) || holds(&joint) || holds(&child);
            moved.jaws[body] = !carries && limb >= LIMB && is_jaw;
        }
        moved
    }

    /// How many drives move a link; none where it is part of a jaw.
    fn drives(&self, link: usize) -> usize {
        let body = self.whole.tree.body_of(link);
        if body.is_some_and(|body| self.jaws[body]) { 0 } else { self.drives_of(body) }
    }

    fn drives_of(&self, body: Option<usize>) -> usize {
        joints_up_to(self.whole, body).iter().filter(|dof| self.driven.contains(dof)).count()
    }

    /// Names of the links that carry jaws, and of the palm.
    fn carriers(&self, palm: Option<usize>) -> Vec<&'a str> {
        let bodies = self.whole.tree.bodies().iter().zip(&self.jaws);
        let of_jaws = bodies.filter(|(_, is_jaw)| **is_jaw).map(|(body, _)| self.whole.robot.joints[body.joint].parent);
        of_jaws.chain(palm).map(|link| &*self.whole.robot.links[link].name).collect()
    }

    /// How many joints without a drive move a link.
    fn undriven(&self, link: usize) -> usize {
        joints_to(self.whole, link).iter().filter(|dof| !self.driven.contains(dof)).count()
    }

    /// All links and frames.
    fn places(&self) -> Vec<Place<'a>> {
        let Planning { robot, tree, .. } = self.whole;
        let poses = poses(self.whole);
        let place = |name: &'a str, link: usize, pose: &Pose| {
            let at = poses[link].compose(pose).position;
            let joint = tree.body_of(link).map_or([0.0; 3], |body| poses[tree.bodies()[body].joint + 1].position);
            Place { name, link, distance: norm(sub(at, joint)) }
        };
        let links = robot.links.iter().enumerate().map(|(link, found)| place(&found.name, link, &Pose::IDENTITY));
        let frames = robot.frames.iter().map(|frame| place(&frame.name, frame.link, &frame.pose));
        links.chain(frames).collect()
    }
}

/// Poses of all links in the world, at the start.
fn poses(Planning { robot, tree, start, .. }: &Planning) -> Vec<Pose> {
    Kinematics::at_rest(tree, &Numbers::of(robot, [0.0; 3]), start).poses().to_vec()
}

/// The way to the joint of a body from the one before, in the axes of its link, m; 0 for the first.
fn outward(whole: &Planning, body: usize) -> [f64; 3] {
    let (bodies, poses) = (whole.tree.bodies(), poses(whole));
    let pose = |body: usize| &poses[bodies[body].joint + 1];
    let from = |parent| pose(body).unrotate(sub(pose(body).position, pose(parent).position));
    bodies[body].parent.map_or([0.0; 3], from)
}

/// The place that is farthest from its joint, the first of several.
fn farthest<'a, 'b: 'a>(places: impl Iterator<Item = &'a Place<'b>>) -> Option<&'a Place<'b>> {
    places.fold(None, |best: Option<&Place>, place| match best {
        Some(best) if place.distance <= best.distance + SAME => Some(best),
        _ => Some(place),
    })
}

/// The link that carries the first joint of a finger.
fn palm_link(whole: &Planning) -> Option<usize> {
    let bodies = whole.tree.bodies();
    let finger = palm(&whole.tree).and_then(|palm| bodies.iter().find(|body| body.parent == Some(palm)));
    finger.map(|finger| whole.robot.joints[finger.joint].parent)
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

/// Numbers of a task file, with commas.
fn numbers(list: [f64; 3]) -> String {
    list.map(|entry| format!("{entry:?}")).join(", ")
}

/// The words of a name, in small letters.
fn words(name: &str) -> Vec<String> {
    name.split(|letter: char| !letter.is_alphanumeric()).map(str::to_lowercase).collect()
}

/// Whether a name ends with that of a tool.
fn is_called(name: &str, tool: &str) -> bool {
    let ends = |words: &[String]| words.join("_") == tool || words.join("_").ends_with(&format!("_{tool}"));
    let mut words = words(name);
    if ends(&words) {
        return true;
    }
    while words.last().is_some_and(|word| ADDED.contains(&word.as_str())) {
        words.pop();
    }
    ends(&words)
}

fn norm(v: [f64; 3]) -> f64 {
    dot(v, v).sqrt()
}

#[cfg(test)]
mod tests {
    use super::is_called;

    #[test]
    fn names_of_tools_may_have_words_before_and_after() {
        for (name, tool) in [
            ("tool0", "tool0"),
            ("panda_hand_tcp", "tcp"),
            ("FL_FOOT", "foot"),
            ("link_eef", "eef"),
            ("ee_link", "ee"),
            ("gripper_frame_link", "gripper"),
            ("attachment_site", "attachment"),
            ("tool_center_point", "tool_center_point"),
            ("Tip", "tip"),
        ] {
            assert!(is_called(name, tool), "{name}");
        }
        for (name, tool) in [("link_finger_tip_1", "tip"), ("multitool", "tool"), ("knee", "ee"), ("link", "ee")] {
            assert!(!is_called(name, tool), "{name}");
        }
    }
}
