//! What is constant, how much there is to compute, and what cannot be computed.

use supple_kernels::Scalar;
use supple_robot::*;

use crate::recorder::{Recorded, constant, operations, variable};
use crate::robots::{Case, joint, link};

fn variables(from: usize, count: usize) -> Vec<Recorded> {
    (from..from + count).map(variable).collect()
}

/// A robot with a link of one inertia on every joint.
fn robot(joints: Vec<Joint>, inertias: &[Option<Inertia>]) -> Robot {
    let links = std::iter::once(&None).chain(inertias).enumerate();
    let links = links.map(|(i, inertia)| link(&format!("l{i}"), *inertia)).collect();
    Robot { name: "r".into(), links, joints, ..Robot::default() }
}

fn rod() -> Inertia {
    let moment = [[0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [0.0, 0.0, 0.01]];
    Inertia { mass: 2.0, center: [0.0, 0.3, 0.0], moment }
}

#[test]
fn an_arm_and_a_door_take_few_operations() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../models/iiwa14_door.urdf");
    let robot = load(path, &LoadOptions::default()).unwrap();
    let tree = Tree::new(&robot);
    let numbers = Numbers::<Recorded>::of(&robot, [0.0, 0.0, -9.81]);
    let n = tree.dofs();
    let (q, v, a) = (variables(0, n), variables(n, n), variables(2 * n, n));
    let kinematics = Kinematics::of(&tree, &numbers, &q, &v);
    let inverse = inverse_dynamics(&tree, &numbers, &kinematics, &a, &[]);
    let held = inverse_dynamics(&tree, &numbers, &kinematics, &vec![Recorded::zero(); n], &[]);
    let mass = mass_matrix(&tree, &numbers, &kinematics);
    let hand = robot.link("iiwa_link_7").unwrap();
    let jacobian = frame_jacobian(&tree, &kinematics, hand, [Recorded::zero(); 3]);
    let counts = [
        ("inverse dynamics", 630, operations(inverse)),
        ("h", 600, operations(held)),
        ("mass matrix", 365, operations(mass.into_iter().flatten())),
        ("accelerations", 1155, operations(forward_dynamics(&tree, &numbers, &kinematics, &a, &[]))),
        ("articulated bodies", 1420, operations(articulated_bodies(&tree, &numbers, &kinematics, &a, &[]))),
        ("Jacobian of the hand", 175, operations(jacobian.into_iter().flatten())),
    ];
    for (what, most, count) in counts {
        assert!(count <= most, "{what}: {count} operations; {counts:?}");
    }
}

/// A chain of joints at right angles or at any.
fn chain(joints: usize, right: bool) -> Robot {
    let angle = if right { std::f64::consts::FRAC_PI_2 } else { 0.7 };
    let tilted = |index: usize| {
        let turn = if right { [angle, 0.0, 0.0] } else { [angle, 0.3, 1.1] };
        Joint { origin: Pose::from_rpy([0.0, 0.0, 0.2], turn), ..joint(&format!("j{index}"), index) }
    };
    robot((0..joints).map(tilted).collect(), &vec![Some(rod()); joints])
}

#[test]
fn accelerations_take_the_way_with_fewer_operations() {
    for (joints, right) in [(6, true), (9, true), (16, true), (6, false), (9, false), (16, false)] {
        let robot = chain(joints, right);
        let (tree, n) = (Tree::new(&robot), joints);
        let numbers = Numbers::<Recorded>::of(&robot, [0.0, 0.0, -9.81]);
        let kinematics = Kinematics::of(&tree, &numbers, &variables(0, n), &variables(n, n));
        let tau = variables(2 * n, n);
        let chosen = operations(forward_dynamics(&tree, &numbers, &kinematics, &tau, &[]));
        let swept = operations(articulated_bodies(&tree, &numbers, &kinematics, &tau, &[]));
        assert!(chosen <= swept && (joints > 9) == (chosen == swept), "{joints}, {right}: {chosen}, {swept}");
    }
}

#[test]
fn branches_do_not_couple() {
    for seed in 0..50 {
        let case = Case::new(seed, 8, false);
        let (tree, numbers) = (&case.tree, case.numbers());
        let kinematics = Kinematics::at_rest(tree, &numbers, &variables(0, tree.dofs()));
        let mass = mass_matrix(tree, &numbers, &kinematics);
        // Without joints that follow others, bodies are degrees of freedom.
        let carries = |above: usize, mut body: usize| loop {
            match tree.bodies()[body].parent {
                _ if body == above => return true,
                Some(parent) => body = parent,
                None => return false,
            }
        };
        for (i, row) in mass.iter().enumerate() {
            for (j, entry) in row.iter().enumerate() {
                let apart = !carries(i, j) && !carries(j, i);
                assert!(!apart || constant(*entry) == Some(0.0), "seed {seed}: {i}, {j}");
            }
        }
    }
}

#[test]
fn parameters_enter_where_numbers_are_overwritten() {
    let robot = robot(vec![joint("j", 0)], &[Some(rod())]);
    let tree = Tree::new(&robot);
    let mut numbers = Numbers::<Recorded>::of(&robot, [0.0; 3]);
    let inertia = |numbers: &_| mass_matrix(&tree, numbers, &Kinematics::at_rest(&tree, numbers, &[variable(0)]))[0][0];
    assert!((constant(inertia(&numbers)).unwrap() - (0.01 + 2.0 * 0.3 * 0.3)).abs() < 1e-15);
    numbers.joints[0].armature = variable(1);
    assert_eq!(constant(inertia(&numbers)), None);
}

#[test]
fn joints_that_move_no_inertia_are_named() {
    let named = |robot: &Robot| {
        let tree = Tree::new(robot);
        let q = vec![0.3; tree.dofs()];
        check_inertia(&tree, &Numbers::of(robot, [0.0; 3]), &q).map_err(|error| error.joints)
    };
    let mut tip = joint("tip", 1);
    tip.origin.position = [0.0, 0.5, 0.0];
    assert_eq!(named(&robot(vec![joint("base", 0), tip.clone()], &[Some(rod()), Some(rod())])), Ok(()));
    assert_eq!(named(&robot(vec![joint("base", 0), tip.clone()], &[None, Some(rod())])), Ok(()));
    let bare = robot(vec![joint("base", 0), tip.clone()], &[Some(rod()), None]);
    assert_eq!(named(&bare), Err(vec!["tip".to_owned()]));
    // Two joints on one axis with nothing in between: each moves inertia, but not both at once in opposite ways.
    let twice = robot(vec![joint("one", 0), joint("two", 1), joint("three", 0)], &[None, Some(rod()), Some(rod())]);
    assert_eq!(named(&twice), Err(vec!["one".to_owned(), "two".to_owned()]));
    let mut driven = bare.clone();
    driven.joints[1].armature = 0.01;
    assert_eq!(named(&driven), Ok(()));
    let message = SingularMass { joints: vec!["tip".into()] }.to_string();
    assert_eq!(message, "joint `tip` moves no inertia, so its acceleration is undefined");
}

/// Time and memory grow with the entries of the mass matrix that are not always 0.
#[test]
fn inertia_of_many_arms_is_checked_fast() {
    const ARMS: usize = 5000;
    let mut joints = Vec::new();
    for arm in 0..ARMS {
        let mut tip = joint(&format!("tip {arm}"), 2 * arm + 1);
        tip.origin.position = [0.0, 0.5, 0.0];
        joints.extend([joint(&format!("base {arm}"), 0), tip]);
    }
    let mut inertias = vec![Some(rod()); 2 * ARMS];
    let check = |inertias: &[Option<Inertia>]| {
        let robot = robot(joints.clone(), inertias);
        let tree = Tree::new(&robot);
        check_inertia(&tree, &Numbers::of(&robot, [0.0; 3]), &vec![0.3; 2 * ARMS]).map_err(|error| error.joints)
    };
    let start = std::time::Instant::now();
    assert_eq!(check(&inertias), Ok(()));
    inertias[77] = None;
    assert_eq!(check(&inertias), Err(vec!["tip 38".to_owned()]));
    assert!(start.elapsed().as_secs() < 10, "{:?}", start.elapsed());
}

/// Joints that follow others share entries that no single chain of bodies has.
#[test]
fn inertia_is_checked_where_joints_follow_others() {
    // The tips of two arms follow one joint: the mass matrix couples both arms with it.
    let arms = |inertias: &[Option<Inertia>]| {
        let mut joints = vec![joint("one", 0), joint("two", 0), joint("tip", 1), joint("other tip", 2)];
        for tip in &mut joints[2..] {
            tip.origin.position = [0.0, 0.5, 0.0];
        }
        joints[3].mimic = Some(Mimic { joint: 2, ratio: 0.5, offset: 0.0 });
        let robot = robot(joints, inertias);
        let tree = Tree::new(&robot);
        check_inertia(&tree, &Numbers::of(&robot, [0.0; 3]), &[0.3; 3]).map_err(|error| error.joints)
    };
    assert_eq!(arms(&[Some(rod()), Some(rod()), Some(rod()), Some(rod())]), Ok(()));
    assert_eq!(arms(&[None, None, Some(rod()), Some(rod())]), Ok(()));
    assert_eq!(arms(&[Some(rod()), Some(rod()), None, Some(rod())]), Ok(()));
    assert_eq!(arms(&[Some(rod()), Some(rod()), None, None]), Err(vec!["tip".to_owned()]));
    assert_eq!(arms(&[Some(rod()), None, Some(rod()), None]), Err(vec!["two".to_owned()]));
    // Three joints, and two bodies that can only be turned: one motion turns neither.
    let wheel = Inertia { mass: 0.0, center: [0.0; 3], moment: [[0.0; 3], [0.0; 3], [0.0, 0.0, 1.0]] };
    let all = ["one", "two", "tip"].map(str::to_owned).to_vec();
    assert_eq!(arms(&[None, None, Some(wheel), Some(wheel)]), Err(all));
}
