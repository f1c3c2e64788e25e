//! Joint positions that bring a frame to a pose.
#![allow(clippy::unwrap_used, clippy::expect_used)]

use supple_robot::{
    Kinematics, LoadOptions, Numbers, Pose, PoseGoal, Reach, Reached, Robot, Tree, inverse_kinematics, load, parse,
};

fn arm() -> Robot {
    load(concat!(env!("CARGO_MANIFEST_DIR"), "/../../models/iiwa14_door.urdf"), &LoadOptions::default()).unwrap()
}

/// A planar arm of two links of 1 m in the plane of x and y, with these limits of its elbow.
fn planar(lower: f64, upper: f64) -> Robot {
    let link = |name: &str| {
        format!(
            "<link name='{name}'><inertial><mass value='1'/><inertia ixx='1' iyy='1' izz='1' ixy='0' ixz='0' iyz='0'/></inertial></link>"
        )
    };
    let text = format!(
        "<robot name='r'>{}{}{}<link name='tip'/>\
         <joint name='shoulder' type='continuous'><parent link='base'/><child link='upper'/><axis xyz='0 0 1'/></joint>\
         <joint name='elbow' type='revolute'><parent link='upper'/><child link='fore'/><origin xyz='1 0 0'/><axis xyz='0 0 1'/>\
         <limit lower='{lower}' upper='{upper}' effort='1' velocity='1'/></joint>\
         <joint name='end' type='fixed'><parent link='fore'/><child link='tip'/><origin xyz='1 0 0'/></joint></robot>",
        link("base"),
        link("upper"),
        link("fore")
    );
    parse(&text, "r.urdf", &LoadOptions::default()).unwrap()
}

fn search(robot: &Robot, goal: &PoseGoal, start: &[f64], free: &[bool]) -> Reached {
    let tree = Tree::new(robot);
    let limits: Vec<_> = tree.joint_indices().iter().map(|&joint| robot.joints[joint].limits).collect();
    let lower: Vec<_> = limits.iter().map(|limits| limits.lower).collect();
    let upper: Vec<_> = limits.iter().map(|limits| limits.upper).collect();
    inverse_kinematics(&tree, &Numbers::of(robot, [0.0; 3]), goal, &Reach { start, lower: &lower, upper: &upper, free })
}

fn pose(robot: &Robot, q: &[f64], link: usize) -> Pose {
    let tree = Tree::new(robot);
    Kinematics::at_rest(&tree, &Numbers::of(robot, [0.0; 3]), q).poses()[link]
}

/// Points of a low-discrepancy sequence, from 0 to 1.
fn spread(sample: usize, place: usize) -> f64 {
    let ratios = [0.754_877_666, 0.569_840_29, 0.429_6, 0.671_04, 0.819_17, 0.312_33, 0.911_11];
    (0.5 + (sample + 1) as f64 * ratios[place % ratios.len()]).fract()
}

#[test]
fn every_pose_of_an_arm_is_reached_within_its_limits() {
    let robot = arm();
    let tree = Tree::new(&robot);
    let hand = robot.link("iiwa_link_7").unwrap();
    let frame = Pose::from_rpy([0.01, -0.02, 0.1], [0.3, 0.2, -0.4]);
    let free = vec![true; tree.dofs()];
    for sample in 0..60 {
        let q: Vec<f64> = (0..tree.dofs())
            .map(|dof| {
                let limits = robot.joints[tree.joint_indices()[dof]].limits;
                limits.lower + spread(sample, dof) * (limits.upper - limits.lower)
            })
            .collect();
        let there = pose(&robot, &q, hand).compose(&frame);
        let goal = PoseGoal { link: hand, frame, position: there.position, rotation: Some(there.rotation) };
        let found = search(&robot, &goal, &vec![0.0; tree.dofs()], &free);
        assert!(found.is_there(), "{sample}: {found:?}");
        let at = pose(&robot, &found.q, hand).compose(&frame);
        for i in 0..3 {
            assert!((at.position[i] - there.position[i]).abs() < 2e-6, "{sample}: {at:?} and {there:?}");
            for j in 0..3 {
                assert!((at.rotation[i][j] - there.rotation[i][j]).abs() < 2e-6, "{sample}: {at:?} and {there:?}");
            }
        }
        for (dof, q) in found.q.iter().enumerate() {
            let limits = robot.joints[tree.joint_indices()[dof]].limits;
            assert!((limits.lower..=limits.upper).contains(q), "{sample}: joint {dof} at {q}");
        }
        assert_eq!(search(&robot, &goal, &vec![0.0; tree.dofs()], &free), found, "it is the same every time");
    }
}

#[test]
fn what_is_not_to_be_moved_stays() {
    let robot = planar(-3.0, 3.0);
    let tip = robot.link("tip").unwrap();
    let goal = PoseGoal { link: tip, frame: Pose::IDENTITY, position: [0.0, 2.0, 0.0], rotation: None };
    let found = search(&robot, &goal, &[0.0, 0.5], &[true, false]);
    assert_eq!(found.q[1], 0.5);
    // The tip is 2 cos(0.25) from the shoulder.
    assert!((found.distance - (2.0 - 2.0 * 0.25_f64.cos())).abs() < 1e-6, "{found:?}");
    let goal = PoseGoal { position: [1.0, 1.0, 0.0], ..goal };
    let found = search(&robot, &goal, &[0.0, 0.5], &[true, true]);
    assert!(found.is_there() && found.angle == 0.0, "{found:?}");
}

#[test]
fn out_of_reach_the_nearest_positions_are_found() {
    let robot = planar(-3.0, 3.0);
    let tip = robot.link("tip").unwrap();
    let far = PoseGoal { link: tip, frame: Pose::IDENTITY, position: [0.0, 3.0, 0.0], rotation: None };
    let found = search(&robot, &far, &[0.0, 0.3], &[true; 2]);
    assert!(!found.is_there() && (found.distance - 1.0).abs() < 1e-6, "{found:?}");
    assert_eq!(found.at_limits, [0; 0]);
    // The elbow stays bent by at least 1 rad, so the tip comes to 2 cos(0.5) from the shoulder at most.
    let robot = planar(1.0, 2.0);
    let found = search(&robot, &far, &[0.0, 1.5], &[true; 2]);
    assert!((found.distance - (3.0 - 2.0 * 0.5_f64.cos())).abs() < 1e-6, "{found:?}");
    assert_eq!(found.at_limits, [1]);
    // A turn that a planar arm cannot make.
    let tilted = Pose::from_rpy([0.0; 3], [0.4, 0.0, 0.0]).rotation;
    let robot = planar(-3.0, 3.0);
    let goal = PoseGoal { position: [1.0, 1.0, 0.0], rotation: Some(tilted), ..far };
    let found = search(&robot, &goal, &[0.0, 0.3], &[true; 2]);
    assert!(!found.is_there() && found.angle > 0.39, "{found:?}");
}

/// People type five or six digits: a planar arm then cannot turn exactly as a pose says, and comes as near as it can.
#[test]
fn poses_with_the_digits_that_people_type_are_reached() {
    let robot = planar(-3.0, 3.0);
    let tip = robot.link("tip").unwrap();
    let goal = |tilt: f64| PoseGoal {
        link: tip,
        frame: Pose::IDENTITY,
        position: [1.0, 1.0, 2.0 * tilt / 10.0],
        rotation: Some(Pose::from_rpy([0.0; 3], [tilt, 0.0, 0.5 * std::f64::consts::PI]).rotation),
    };
    let found = search(&robot, &goal(2e-4), &[0.0, 0.3], &[true; 2]);
    assert!(found.is_there() && found.angle > 1e-4 && found.distance > 1e-5, "{found:?}");
    // As near as it can come: what is left is what no joint can change.
    assert!((found.angle - 2e-4).abs() < 1e-8 && (found.distance - 4e-5).abs() < 1e-8, "{found:?}");
    assert!(!search(&robot, &goal(2e-3), &[0.0, 0.3], &[true; 2]).is_there());
}

/// Roll, pitch and yaw are those that make the same rotation.
#[test]
fn roll_pitch_and_yaw_come_back() {
    for sample in 0..50 {
        let rpy = [0, 1, 2].map(|place| (2.0 * spread(sample, place) - 1.0) * [3.1, 1.5, 3.1][place]);
        let back = Pose::from_rpy([0.0; 3], rpy).rpy();
        assert!((0..3).all(|i| (back[i] - rpy[i]).abs() < 1e-12), "{rpy:?} {back:?}");
    }
}
