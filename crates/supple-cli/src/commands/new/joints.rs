//! Which joints of a robot have drives, and which move a link.

use crate::commands::robot::Planning;

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

/// The degrees of freedom that move a link, the nearest first.
pub fn joints_to(planning: &Planning, link: usize) -> Vec<usize> {
    joints_up_to(planning, planning.tree.body_of(link))
}

/// The degrees of freedom that move a body, the nearest first.
pub fn joints_up_to(planning: &Planning, mut body: Option<usize>) -> Vec<usize> {
    let mut dofs = Vec::new();
    while let Some(found) = body.map(|body| &planning.tree.bodies()[body]) {
        if !dofs.contains(&found.dof) {
            dofs.push(found.dof);
        }
        body = found.parent;
    }
    dofs
}
