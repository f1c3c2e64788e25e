//! What a robot file lacks or needs for planning.

use std::fmt::Write;

use supple::RobotModel;
use supple_robot::{LockedJoint, Numbers, Robot, Tree, massless_joints};
use supple_text::quoted;

use super::words::{name, number};

/// Mass below which a root link counts as a massless placeholder, kg.
const LIGHT: f64 = 1e-3;

/// What it takes to plan with a robot.
pub struct Planning {
    /// Joints to lock: they move nothing with inertia, or have a single position.
    pub lock: Vec<String>,
    /// Of these, the joints whose range in the file is a single position.
    pub still: Vec<String>,
    /// The robot without them.
    pub robot: Robot,
    pub tree: Tree,
    /// Where it starts, rad or m.
    pub start: Vec<f64>,
}

impl Planning {
    pub fn of(robot: &Robot) -> Self {
        let tree = Tree::new(robot);
        if tree.dofs() > RobotModel::MOST_JOINTS {
            return Self::without(robot.clone(), Vec::new());
        }
        let at = vec![0.1; tree.dofs()];
        let massless = massless_joints(&tree, &Numbers::of(robot, [0.0; 3]), &at);
        let joint = |dof: usize| &robot.joints[tree.joint_indices()[dof]];
        let is_still = |dof: usize| joint(dof).limits.lower == joint(dof).limits.upper;
        let still: Vec<usize> = (0..tree.dofs()).filter(|&dof| is_still(dof) && !massless.contains(&dof)).collect();
        let names = |dofs: &[usize]| dofs.iter().map(|&dof| tree.joints()[dof].clone()).collect::<Vec<_>>();
        let all = || massless.iter().chain(&still).copied();
        let locked: Vec<_> =
            all().map(|dof| LockedJoint { joint: tree.joint_indices()[dof], position: joint(dof).neutral() }).collect();
        let lock = [names(&massless), names(&still)].concat();
        Self { still: names(&still), ..Self::without(robot.locked(&locked), lock) }
    }

    /// The robot with these further joints locked where they start.
    pub fn locking(&self, more: &[usize]) -> Self {
        let held = |&dof: &usize| LockedJoint { joint: self.tree.joint_indices()[dof], position: self.start[dof] };
        let joints: Vec<_> = more.iter().map(held).collect();
        let names = more.iter().map(|&dof| self.tree.joints()[dof].clone());
        let planning = Self::without(self.robot.locked(&joints), self.lock.iter().cloned().chain(names).collect());
        Self { still: self.still.clone(), ..planning }
    }

    fn without(robot: Robot, lock: Vec<String>) -> Self {
        let tree = Tree::new(&robot);
        let start = tree.joint_indices().iter().map(|&joint| robot.joints[joint].neutral()).collect();
        Self { lock, still: Vec::new(), robot, tree, start }
    }

    /// The line of `[model]` that locks joints; `None` if there is nothing to lock.
    pub fn locked_line(&self) -> Option<String> {
        let names: Vec<_> = self.lock.iter().map(|name| format!("{name:?}")).collect();
        (!names.is_empty()).then(|| format!("locked = [{}]", names.join(", ")))
    }

    /// What joints have that are to be locked.
    fn why_locked(&self) -> &'static str {
        match (self.lock.len() - self.still.len(), self.still.len()) {
            (1, 0) => "a joint that moves no inertia",
            (_, 0) => "joints that move no inertia",
            (0, 1) => "a joint whose range is a single position",
            (0, _) => "joints whose range is a single position",
            _ => "joints that move no inertia, or whose range is a single position",
        }
    }

    /// Why planning is impossible, if it is.
    pub fn obstacle(&self) -> Option<String> {
        match (self.tree.dofs(), self.lock.is_empty()) {
            (0, true) => Some("no joint moves, so there is nothing to control".into()),
            (0, false) if self.still.is_empty() => {
                Some("no joint moves a link with inertia; add `inertial` elements to the links".into())
            }
            (0, false) => Some(format!(
                "the range of every joint that moves a link with inertia is a single position: correct `lower` and `upper` \
                 of {}",
                quoted(&self.still)
            )),
            (count, _) if count > RobotModel::MOST_JOINTS => {
                Some(format!("{count} joints are too many; `locked` in [model] removes those that do not have to move"))
            }
            _ => None,
        }
    }

    /// The section of `supple robot`.
    pub fn text(&self, whole: &Robot) -> String {
        let mut text = String::from("\nPlanning with this robot\n");
        let mut line = |line: String| {
            let _ = writeln!(text, "- {line}");
        };
        match (self.obstacle(), self.lock.is_empty()) {
            (None, true) if !whole.left_out_forces.is_empty() => line(format!(
                "moves differently than its file says, so that results warn and exit with 1: {}",
                whole.left_out_forces.join("; ")
            )),
            (None, true) => line("ready: `supple new NAME --robot FILE` writes a task file that runs".into()),
            (None, false) => line(format!(
                "lock {}: write `{}` in [model], as `supple new NAME --robot FILE` does",
                self.why_locked(),
                self.locked_line().unwrap_or_default()
            )),
            (Some(why), _) => line(format!("not possible: {why}")),
        }
        let root = &whole.links[0];
        if let Some(inertia) = root.inertia.filter(|inertia| inertia.mass > LIGHT) {
            let mass = number(inertia.mass);
            line(format!(
                "link `{}` of {mass} kg is fixed in the world: floating bases are not \
                 supported",
                name(&root.name)
            ));
        }
        if self.obstacle().is_none() {
            self.joints(&mut line);
        }
        text
    }

    /// Remarks on individual joints.
    fn joints(&self, line: &mut dyn FnMut(String)) {
        let joints: Vec<_> = self.tree.joint_indices().iter().map(|&joint| &self.robot.joints[joint]).collect();
        let named = |holds: &dyn Fn(f64) -> bool| -> Vec<_> {
            joints.iter().filter(|joint| holds(joint.limits.effort)).map(|joint| name(&joint.name)).collect()
        };
        let still = |index: &&usize| !self.robot.actuators.iter().any(|one| one.joint == **index);
        let undriven: Vec<_> = self.tree.joint_indices().iter().filter(still).collect();
        if !self.robot.actuators.is_empty() && !undriven.is_empty() {
            let names: Vec<_> = undriven.into_iter().map(|&joint| name(&self.robot.joints[joint].name)).collect();
            line(format!(
                "no actuator: {}; `supple new` writes tasks in which gravity does not move such joints, or springs hold them",
                quoted(&names)
            ));
        }
        let (free, none) = (named(&f64::is_infinite), named(&|effort| effort == 0.0));
        if self.robot.actuators.is_empty() && !free.is_empty() {
            line(format!("no effort limit: {}; plans may use any torque", quoted(&free)));
        }
        if self.robot.actuators.is_empty() && !none.is_empty() {
            line(format!(
                "effort limit of 0: {}; if these joints have no drives, list the driven joints in `actuated`",
                quoted(&none)
            ));
        }
        for (drawn, place) in
            [(true, "where the file draws it, at its `ref`"), (false, "at the middle of its range, which excludes 0")]
        {
            let moved = joints.iter().zip(&self.start).filter(|(_, start)| **start != 0.0);
            let moved = moved.filter(|(joint, start)| (**start == joint.reference) == drawn);
            let moved: Vec<_> =
                moved.map(|(joint, start)| format!("`{}` at {}", name(&joint.name), number(*start))).collect();
            if !moved.is_empty() {
                let rest = moved.len().saturating_sub(10);
                let more = if rest > 0 { format!(" and {rest} more") } else { String::new() };
                let moved = moved[..moved.len() - rest].join(", ");
                line(format!("starts {place}: {moved}{more}"));
            }
        }
    }
}
