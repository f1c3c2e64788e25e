//! Robots without some of their joints.

use supple_robot::*;

use crate::assert_close;
use crate::robots::{Case, GRAVITY, joint, link};

fn at(joint: usize, position: f64) -> LockedJoint {
    LockedJoint { joint, position }
}

/// The dynamics without some joints are those of the whole robot at rest in these joints.
#[test]
fn a_locked_robot_moves_as_the_whole_one_with_these_joints_at_rest() {
    let mut followers = 0;
    for seed in 0..200 {
        let mut case = Case::new(seed, 8, seed % 2 == 0);
        let n = case.tree.dofs();
        if n < 3 {
            continue;
        }
        let locked: Vec<usize> = (0..n).filter(|dof| (dof + seed as usize).is_multiple_of(3)).collect();
        let kept: Vec<usize> = (0..n).filter(|dof| !locked.contains(dof)).collect();
        let joints: Vec<_> = locked.iter().map(|&dof| at(case.tree.joint_indices()[dof], case.q[dof])).collect();
        let robot = case.robot.locked(&joints);
        let tree = Tree::new(&robot);
        let names: Vec<_> = kept.iter().map(|&dof| case.tree.joints()[dof].clone()).collect();
        assert_eq!(tree.joints(), names, "{seed}");
        followers += case
            .robot
            .joints
            .iter()
            .zip(&robot.joints)
            .filter(|(whole, now)| whole.mimic.is_some() && now.mimic.is_none())
            .count();

        locked.iter().for_each(|&dof| (case.v[dof], case.a[dof]) = (0.0, 0.0));
        let of_kept = |list: &[f64]| kept.iter().map(|&dof| list[dof]).collect::<Vec<_>>();
        let whole_numbers = case.numbers();
        let numbers = Numbers::of(&robot, GRAVITY);
        let whole = Kinematics::of(&case.tree, &whole_numbers, &case.q, &case.v);
        let now = Kinematics::of(&tree, &numbers, &of_kept(&case.q), &of_kept(&case.v));
        for (a, b) in whole.poses().iter().zip(now.poses()) {
            assert_close(
                "pose",
                &[a.position, a.rotation[0], a.rotation[1]].concat(),
                &[b.position, b.rotation[0], b.rotation[1]].concat(),
                1e-12,
            );
        }
        let needed = inverse_dynamics(&case.tree, &whole_numbers, &whole, &case.a, &[]);
        let found = inverse_dynamics(&tree, &numbers, &now, &of_kept(&case.a), &[]);
        assert_close("forces", &found, &of_kept(&needed), 1e-11);
    }
    assert!(followers > 50, "joints that follow locked ones are among them: {followers}");
}

#[test]
fn neutral_positions_are_0_where_limits_allow_it() {
    let at = |lower, upper| Limits { lower, upper, ..Limits::default() }.neutral();
    let far = f64::INFINITY;
    let found =
        [at(-far, far), at(-1.0, 2.0), at(0.0, 2.0), at(0.5, 2.5), at(-3.0, -1.0), at(0.5, far), at(-far, -0.5)];
    assert_eq!(found, [0.0, 0.0, 0.0, 1.5, -2.0, 0.5, -0.5]);
}

#[test]
fn actuators_and_sensors_of_locked_joints_are_omitted() {
    let actuator = |name: &str, joint| Actuator {
        name: name.into(),
        joint,
        gear: 1.0,
        law: Law::new(1.0, 0.0, 0.0, 0.0),
        control: [-1.0, 1.0],
        force: [-1.0, 1.0],
        line: 3,
    };
    let sensor = |name: &str, measures| Sensor { name: name.into(), measures, noise: 0.0, line: 4 };
    let key = Key {
        name: "home".into(),
        positions: vec![0.1, 0.2],
        velocities: vec![0.0; 2],
        controls: vec![1.0, 2.0],
        line: 5,
    };
    let robot = Robot {
        links: vec![link("a", None), link("b", None), link("c", None)],
        joints: vec![joint("first", 0), joint("second", 1)],
        actuators: vec![actuator("m1", 0), actuator("m2", 1)],
        sensors: vec![
            sensor("s1", Measured::JointPosition(0)),
            sensor("s2", Measured::JointVelocity(1)),
            sensor("s3", Measured::FramePosition(0)),
        ],
        keys: vec![key],
        ..Robot::default()
    };
    let locked = robot.locked(&[at(0, 0.3)]);
    let names = |robot: &Robot| {
        robot
            .actuators
            .iter()
            .map(|a| &a.name)
            .chain(robot.sensors.iter().map(|s| &s.name))
            .cloned()
            .collect::<Vec<_>>()
    };
    assert_eq!(names(&locked), ["m2", "s2", "s3"]);
    assert_eq!(locked.keys[0].controls, [2.0]);
    let omitted: Vec<_> = locked.omitted.iter().map(|o| (o.what, o.name.as_str(), o.why.as_str(), o.line)).collect();
    assert_eq!(omitted, [("actuator", "m1", "its joint is locked", 3), ("sensor", "s1", "its joint is locked", 4)]);
    assert_eq!(locked.keys[0].q(&Tree::new(&locked)), [0.2]);
}

#[test]
fn joints_that_move_no_inertia_are_found_until_none_is_left() {
    let unit =
        Inertia { mass: 1.0, center: [0.1, 0.0, 0.0], moment: [[0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [0.0, 0.0, 0.1]] };
    // Two coaxial joints with nothing in between before a body, and a tip with nothing.
    let robot = Robot {
        links: vec![link("base", None), link("l1", None), link("l2", Some(unit)), link("l3", None)],
        joints: vec![joint("j1", 0), joint("j2", 1), joint("j3", 2)],
        ..Robot::default()
    };
    let (tree, numbers) = (Tree::new(&robot), Numbers::of(&robot, GRAVITY));
    let found = massless_joints(&tree, &numbers, &[0.1; 3]);
    assert_eq!(found, [1, 2]);
    let locked = robot.locked(&found.iter().map(|&dof| at(tree.joint_indices()[dof], 0.0)).collect::<Vec<_>>());
    let tree = Tree::new(&locked);
    assert_eq!(check_inertia(&tree, &Numbers::of(&locked, GRAVITY), &[0.1]), Ok(()));
}
