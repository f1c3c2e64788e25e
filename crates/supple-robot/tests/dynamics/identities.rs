//! Identities that hold for every robot, with and without joints that follow others.

use proptest::prelude::*;
use supple_kernels::{Dual, Scalar};
use supple_robot::*;

use crate::robots::{Case, GRAVITY};
use crate::{assert_close, dot, product};

/// A value and its rate.
type Moving = Dual<f64, 1>;

fn moving(values: &[f64], rates: &[f64]) -> Vec<Moving> {
    values.iter().zip(rates).map(|(&value, &rate)| Dual { value, tangents: [rate] }).collect()
}

/// Kinetic energy and that in gravity and springs, J, from the motion of links, drives and joints.
fn energy<S: Scalar>(case: &Case, q: &[S], v: &[S]) -> (S, S) {
    let (numbers, half) = (case.numbers::<S>(), S::constant(0.5));
    let kinematics = Kinematics::of(&case.tree, &numbers, q, v);
    let (mut kinetic, mut potential) = (S::zero(), S::zero());
    for (index, link) in numbers.links.iter().enumerate() {
        let twist = kinematics.velocity(index);
        let (w, u) = (twist.angular, twist.at(link.center));
        for i in 0..3 {
            kinetic += half * link.mass * u[i] * u[i];
            for j in 0..3 {
                kinetic += half * w[i] * link.moment[i][j] * w[j];
            }
            let height = kinematics.poses()[index].apply(link.center)[i];
            potential -= link.mass * height * GRAVITY[i];
        }
    }
    for body in case.tree.bodies() {
        let joint = &numbers.joints[body.joint];
        let (rate, stretch) = (v[body.dof] * body.ratio, q[body.dof] * body.ratio + body.offset - joint.rest);
        kinetic += half * joint.armature * rate * rate;
        potential += half * joint.stiffness * stretch * stretch;
    }
    (kinetic, potential)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn forces_are_linear_in_accelerations(seed: u64, joints in 1_usize..10, mimic: bool) {
        let Case { tree, q, v, a, .. } = &Case::new(seed, joints, mimic);
        let numbers = Case::new(seed, joints, mimic).numbers::<f64>();
        let kinematics = Kinematics::of(tree, &numbers, q, v);
        let mass = mass_matrix(tree, &numbers, &kinematics);
        let held = inverse_dynamics(tree, &numbers, &kinematics, &vec![0.0; a.len()], &[]);
        let sum: Vec<f64> = product(&mass, a).iter().zip(held).map(|(a, b)| a + b).collect();
        assert_close("M a + h", &inverse_dynamics(tree, &numbers, &kinematics, a, &[]), &sum, 1e-11);
    }

    #[test]
    fn the_mass_matrix_is_symmetric_and_positive_definite(seed: u64, joints in 1_usize..10, mimic: bool) {
        let case = Case::new(seed, joints, mimic);
        let (tree, numbers) = (&case.tree, case.numbers());
        let mut mass = mass_matrix(tree, &numbers, &Kinematics::at_rest(tree, &numbers, &case.q));
        check_inertia(tree, &numbers, &case.q).unwrap();
        for (i, row) in mass.iter().enumerate() {
            let column: Vec<f64> = mass.iter().map(|row| row[i]).collect();
            prop_assert_eq!(row, &column);
        }
        for k in 0..mass.len() {
            prop_assert!(mass[k][k] > 0.0);
            for i in k + 1..mass.len() {
                for j in k + 1..mass.len() {
                    mass[i][j] -= mass[i][k] * mass[k][j] / mass[k][k];
                }
            }
        }
    }

    #[test]
    fn accelerations_come_back_from_their_forces(seed: u64, joints in 1_usize..16, mimic: bool) {
        let mut case = Case::new(seed, joints, mimic);
        let mut wrench = || LinkWrench {
            link: case.random.below(joints + 1),
            wrench: Wrench { torque: case.random.vector(3.0), force: case.random.vector(3.0) },
        };
        let external = [wrench(), wrench()];
        let (tree, numbers) = (&case.tree, case.numbers());
        let kinematics = Kinematics::of(tree, &numbers, &case.q, &case.v);
        let tau = inverse_dynamics(tree, &numbers, &kinematics, &case.a, &external);
        let forward = forward_dynamics(tree, &numbers, &kinematics, &tau, &external);
        assert_close("forward of inverse", &forward, &case.a, 1e-8);
        if !tree.has_mimic() {
            let swept = articulated_bodies(tree, &numbers, &kinematics, &tau, &external);
            assert_close("articulated bodies", &swept, &case.a, 1e-8);
        }
    }

    #[test]
    fn the_mass_matrix_gives_the_kinetic_energy_of_the_links(seed: u64, joints in 1_usize..10, mimic: bool) {
        let case = Case::new(seed, joints, mimic);
        let (tree, numbers) = (&case.tree, case.numbers());
        let mass = mass_matrix(tree, &numbers, &Kinematics::at_rest(tree, &numbers, &case.q));
        let (kinetic, _) = energy(&case, &case.q, &case.v);
        assert_close("energy", &[0.5 * dot(&case.v, &product(&mass, &case.v))], &[kinetic], 1e-11);
    }

    #[test]
    fn energy_grows_by_the_power_of_forces(seed: u64, joints in 1_usize..10, mimic: bool) {
        let case = Case::new(seed, joints, mimic);
        let (tree, numbers) = (&case.tree, case.numbers());
        let kinematics = Kinematics::of(tree, &numbers, &case.q, &case.v);
        // Drives give what is needed beyond springs; dampers and friction are left to them too.
        let needed = inverse_dynamics(tree, &numbers, &kinematics, &case.a, &[]);
        let springs = passive_forces(tree, &numbers, &case.q, &vec![0.0; tree.dofs()], 1e-3);
        let power = dot(&needed, &case.v) - dot(&springs, &case.v);
        let (kinetic, potential) = energy(&case, &moving(&case.q, &case.v), &moving(&case.v, &case.a));
        assert_close("power", &[power], &[kinetic.tangents[0] + potential.tangents[0]], 1e-10);
    }

    #[test]
    fn jacobians_are_derivatives_of_poses(seed: u64, joints in 1_usize..10, mimic: bool) {
        let mut case = Case::new(seed, joints, mimic);
        let (link, point) = (case.random.below(joints + 1), case.random.vector(1.0));
        let (tree, numbers) = (&case.tree, case.numbers());
        let kinematics = Kinematics::of(tree, &numbers, &case.q, &case.v);
        let jacobian = frame_jacobian(tree, &kinematics, link, point);
        let constant = point.map(Moving::constant);
        for dof in 0..tree.dofs() {
            let mut rates = vec![0.0; tree.dofs()];
            rates[dof] = 1.0;
            let pose = Kinematics::at_rest(tree, &case.numbers(), &moving(&case.q, &rates)).poses()[link];
            let column: Vec<f64> = jacobian.iter().map(|row| row[dof]).collect();
            // [w]x = (d R / d q) R'
            let r = pose.rotation;
            let spin = |i: usize, j: usize| (0..3).map(|k| r[i][k].tangents[0] * r[j][k].value).sum();
            let linear = pose.apply(constant).map(|entry| entry.tangents[0]);
            let expected = [spin(2, 1), spin(0, 2), spin(1, 0), linear[0], linear[1], linear[2]];
            assert_close("Jacobian", &column, &expected, 1e-12);
        }
        let twist = frame_velocity(&kinematics, link, point);
        let expected = product(&jacobian, &case.v);
        assert_close("velocity", &[twist.angular, twist.linear].concat(), &expected, 1e-12);
    }

    #[test]
    fn wrenches_act_by_the_transposed_jacobian(seed: u64, joints in 1_usize..10, mimic: bool) {
        let mut case = Case::new(seed, joints, mimic);
        let (link, torque, force) = (case.random.below(joints + 1), case.random.vector(3.0), case.random.vector(3.0));
        let (tree, numbers) = (&case.tree, case.numbers());
        let kinematics = Kinematics::of(tree, &numbers, &case.q, &case.v);
        let forces = |external: &[_]| inverse_dynamics(tree, &numbers, &kinematics, &case.a, external);
        let (alone, less) = (forces(&[]), forces(&[LinkWrench { link, wrench: Wrench { torque, force } }]));
        let pose = kinematics.poses()[link];
        let wrench = [pose.rotate(torque), pose.rotate(force)].concat();
        let jacobian = frame_jacobian(tree, &kinematics, link, [0.0; 3]);
        for dof in 0..tree.dofs() {
            let column: Vec<f64> = jacobian.iter().map(|row| row[dof]).collect();
            assert_close("J' wrench", &[alone[dof] - less[dof]], &[dot(&column, &wrench)], 1e-10);
        }
    }
}
