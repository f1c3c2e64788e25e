//! Joints that follow others: the dynamics are those of the free robot, projected by the constraint
//! `p = G q + offset`, `M_r = G' M G`, `tau_r = G' tau`.

use proptest::prelude::*;
use supple_robot::*;

use crate::robots::{Case, joint, link};
use crate::{assert_close, product};

/// The same robot with every joint free, its `G` by rows, and its offsets.
fn freed(case: &Case) -> (Case, Vec<Vec<f64>>, Vec<f64>) {
    let mut robot = case.robot.clone();
    robot.joints.iter_mut().for_each(|joint| joint.mimic = None);
    let tree = Tree::new(&robot);
    let (mut rows, mut offsets) = (Vec::new(), Vec::new());
    for body in case.tree.bodies() {
        let mut row = vec![0.0; case.tree.dofs()];
        row[body.dof] = body.ratio;
        rows.push(row);
        offsets.push(body.offset);
    }
    let mut free = Case::new(0, 1, false);
    free.q = product(&rows, &case.q).iter().zip(&offsets).map(|(q, offset)| q + offset).collect();
    (free.v, free.a) = (product(&rows, &case.v), product(&rows, &case.a));
    (free.robot, free.tree) = (robot, tree);
    (free, rows, offsets)
}

/// `G' x`
fn projected(rows: &[Vec<f64>], x: &[f64]) -> Vec<f64> {
    let columns = rows.first().map_or(0, Vec::len);
    (0..columns).map(|column| rows.iter().zip(x).map(|(row, x)| row[column] * x).sum()).collect()
}

/// Position, by the robot's own words, of a joint.
fn position(robot: &Robot, index: usize, tree: &Tree, q: &[f64]) -> f64 {
    match robot.joints[index].mimic {
        Some(mimic) => mimic.ratio * position(robot, mimic.joint, tree, q) + mimic.offset,
        None => q[tree.joint_indices().iter().position(|&joint| joint == index).unwrap()],
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn following_joints_project_the_free_robot(seed: u64, joints in 2_usize..10) {
        let case = Case::new(seed, joints, true);
        let (free, rows, _) = freed(&case);
        for (body, &q) in case.tree.bodies().iter().zip(&free.q) {
            let expected = position(&case.robot, body.joint, &case.tree, &case.q);
            assert_close("position", &[q], &[expected], 1e-12);
        }
        let (numbers, s) = (case.numbers(), 0.1);
        let here = Kinematics::of(&case.tree, &numbers, &case.q, &case.v);
        let there = Kinematics::of(&free.tree, &numbers, &free.q, &free.v);
        for (a, b) in here.poses().iter().zip(there.poses()) {
            assert_close("pose", &a.position, &b.position, 1e-12);
        }
        let mass = mass_matrix(&free.tree, &numbers, &there);
        for (dof, row) in mass_matrix(&case.tree, &numbers, &here).iter().enumerate() {
            let column: Vec<f64> = rows.iter().map(|row| row[dof]).collect();
            assert_close("mass matrix", row, &projected(&rows, &product(&mass, &column)), 1e-11);
        }
        let forces = inverse_dynamics(&free.tree, &numbers, &there, &free.a, &[]);
        let own = inverse_dynamics(&case.tree, &numbers, &here, &case.a, &[]);
        assert_close("forces", &own, &projected(&rows, &forces), 1e-11);
        let passive = passive_forces(&free.tree, &numbers, &free.q, &free.v, s);
        let own = passive_forces(&case.tree, &numbers, &case.q, &case.v, s);
        assert_close("passive", &own, &projected(&rows, &passive), 1e-11);
        let held = bias(&free.tree, &numbers, &there, &free.q, &free.v, s);
        let own = bias(&case.tree, &numbers, &here, &case.q, &case.v, s);
        assert_close("bias", &own, &projected(&rows, &held), 1e-11);
    }
}

#[test]
fn joints_that_follow_in_a_circle_are_free() {
    let mut joints: Vec<Joint> = (0..3).map(|i| joint(&format!("j{i}"), i)).collect();
    for (index, master) in [(0, 1), (1, 0), (2, 1)] {
        joints[index].mimic = Some(Mimic { joint: master, ratio: 2.0, offset: 0.0 });
    }
    let links = (0..4).map(|i| link(&format!("l{i}"), None)).collect();
    let robot = Robot { name: "r".into(), links, joints, ..Robot::default() };
    assert_eq!(Tree::new(&robot).joints(), ["j0", "j1", "j2"]);
}
