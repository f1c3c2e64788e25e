//! Every derivative of an authored model against finite differences of the order below, over random designs.

use crate::common::reference;

use crate::common::reference::differences::{derivative, gradients};
use crate::common::reference::finger::{self, design, parameter, scales};
use crate::common::reference::{cases, fill_random, relative_error};
use proptest::prelude::*;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use supple::Linearise;
use supple::lqg::KnotAdjoints;
use supple::lqg::Knots;
use supple::system::{Adjoints, Curvature, Points, System, Variation};
use supple::{Matrices, Scratch, Trajectory};

/// Points anywhere, not a trajectory, with all that is differentiated along them.
struct Setting {
    system: Box<dyn System>,
    phi: Vec<f64>,
    points: Trajectory,
    curvature: Curvature,
    costates: Matrices,
    scratch: Scratch,
    rng: ChaCha8Rng,
}

impl Setting {
    fn new(phi: Vec<f64>, stages: usize, seed: u64) -> Self {
        let system = Box::new(finger::system());
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut points = Trajectory::zeros(system.dimensions(), stages);
        let mut costates = Matrices::vectors(stages + 1, 4);
        fill_random(&mut rng, &mut points.states);
        fill_random(&mut rng, &mut points.controls);
        fill_random(&mut rng, &mut costates);
        Self { system, phi, points, curvature: Curvature::Exact, costates, scratch: Scratch::new(), rng }
    }

    fn stages(&self) -> usize {
        self.points.steps()
    }

    /// States and controls of all points in one list, with the parameters behind.
    fn variables(&self) -> Vec<f64> {
        let points = (0..=self.stages()).flat_map(|t| self.points.states.vector(t));
        let controls = (0..self.stages()).flat_map(|t| self.points.controls.vector(t));
        points.chain(controls).chain(&self.phi).copied().collect()
    }

    /// The points and parameters of such a list.
    fn read(&self, variables: &[f64]) -> (Trajectory, Vec<f64>) {
        let mut points = self.points.clone();
        let mut rest = variables.iter().copied();
        for t in 0..=self.stages() {
            points.states.vector_mut(t).fill_with(|| rest.next().unwrap());
        }
        for t in 0..self.stages() {
            points.controls.vector_mut(t).fill_with(|| rest.next().unwrap());
        }
        (points, rest.collect())
    }

    /// A random direction in the space of such lists: in the points, in the parameters, or in both.
    fn direction(&mut self, points: bool, parameters: bool) -> Vec<f64> {
        let (all, behind) = (self.variables().len(), self.phi.len());
        let mut random = Matrices::vectors(1, all);
        fill_random(&mut self.rng, &mut random);
        let parameter_scales = scales();
        let entry = |(i, &d): (usize, &f64)| match (i + behind).checked_sub(all) {
            None => f64::from(u8::from(points)) * d,
            Some(parameter) => f64::from(u8::from(parameters)) * d * parameter_scales[parameter],
        };
        random.vector(0).iter().enumerate().map(entry).collect()
    }

    fn knots(&mut self, variables: &[f64]) -> Knots {
        let (points, phi) = self.read(variables);
        let mut knots = Knots::zeros(self.system.dimensions(), self.stages());
        knots.linearise_plan(&*self.system, points.points(), &phi, self.curvature, &mut self.scratch);
        knots.linearise_measurement(&*self.system, points.points(), &phi, &mut self.scratch);
        knots
    }
}

/// Entries of matrix `index`, padding left out, row by row.
fn entries(matrices: &Matrices, index: usize) -> impl Iterator<Item = f64> + '_ {
    (0..matrices.rows()).flat_map(move |i| (0..matrices.cols()).map(move |j| matrices.get(index, i, j)))
}

/// `sum <adjoint, matrix>`, over so many columns of each.
fn inner(adjoint: &Matrices, matrices: &Matrices, cols: usize) -> f64 {
    let entry = |t, i, j| adjoint.get(t, i, j) * matrices.get(t, i, j);
    (0..matrices.count())
        .flat_map(|t| (0..matrices.rows()).flat_map(move |i| (0..cols).map(move |j| (t, i, j))))
        .map(|(t, i, j)| entry(t, i, j))
        .sum()
}

/// Differences are rounded by about 1e-11 whatever they are of, so numbers below 1 count as 1.
fn check(what: &str, found: &[f64], expected: &[f64], tolerance: f64) -> Result<(), TestCaseError> {
    let error = relative_error(&[found, &[1.0]].concat(), &[expected, &[1.0]].concat());
    prop_assert!(error < tolerance, "{what}: off by {error:.1e}: {found:?}, not {expected:?}");
    Ok(())
}

proptest! {
    #![proptest_config(cases(48))]

    #[test]
    fn first_derivatives_are_those_of_the_functions(phi in design(), stages in 1usize..20, seed in any::<u64>()) {
        let mut setting = Setting::new(phi, stages, seed);
        let knots = setting.knots(&setting.variables());
        let Setting { system, phi, points, scratch, .. } = &mut setting;
        let joint = 6;
        for t in 0..=stages {
            let end = t == stages;
            let z: Vec<f64> = if end {
                points.states.vector(t).to_vec()
            } else {
                [points.states.vector(t), points.controls.vector(t)].concat()
            };
            // All functions at once: f, g and l.
            let found = gradients(&z, &vec![3e-5; z.len()], |z| {
                let (x, u) = z.split_at(4);
                let (mut next, mut y) = (vec![0.0; 4], vec![0.0; 2]);
                system.observe(t, x, phi, &mut y);
                let cost = if end {
                    system.final_cost(x, phi, scratch)
                } else {
                    system.step(t, x, u, phi, &mut next);
                    system.stage_cost(t, x, u, phi, scratch)
                };
                [next, y, vec![cost]].concat()
            });
            for (i, expected) in found[..4].iter().enumerate().filter(|_| !end) {
                let row: Vec<f64> = (0..joint).map(|j| knots.dynamics.get(t, i, j)).collect();
                check("f_z", &row, expected, 1e-9)?;
            }
            for (i, expected) in found[4..6].iter().enumerate() {
                let row: Vec<f64> = (0..4).map(|j| knots.measurement.get(t, i, j)).collect();
                check("g_x", &row, &expected[..4], 1e-9)?;
            }
            let slope: Vec<f64> = (0..z.len()).map(|i| knots.cost.get(t, i, joint)).collect();
            check("l_z", &slope, &found[6][..], 1e-9)?;
        }
    }

    #[test]
    fn second_derivatives_of_the_cost_are_those_of_its_slope(
        phi in design(), stages in 1usize..20, seed in any::<u64>(),
    ) {
        let mut setting = Setting::new(phi, stages, seed);
        let at = setting.variables();
        let knots = setting.knots(&at);
        let direction = setting.direction(true, false);
        let slope = |knots: &Knots| -> Vec<f64> {
            (0..=stages).flat_map(|t| (0..6).map(move |i| (t, i))).map(|(t, i)| knots.cost.get(t, i, 6)).collect()
        };
        let expected = derivative(&at, &direction, 3e-5, |at| slope(&setting.knots(at)));
        let (dx, _) = setting.read(&direction);
        let mut found = Vec::new();
        for t in 0..=stages {
            let du = if t < stages { dx.controls.vector(t) } else { &[0.0, 0.0] };
            let dz = [dx.states.vector(t), du].concat();
            found.extend((0..6).map(|i| (0..6).map(|j| knots.cost.get(t, i, j) * dz[j]).sum::<f64>()));
            for (i, j) in (0..6).flat_map(|i| (0..i).map(move |j| (i, j))) {
                prop_assert_eq!(knots.cost.get(t, i, j), knots.cost.get(t, j, i), "l_zz is symmetric");
            }
        }
        check("l_zz dz", &found, &expected, 1e-8)?;
    }

    /// Gauss-Newton has the slope of the cost and the part of its curvature that is never indefinite.
    #[test]
    fn gauss_newton_curvature_is_semidefinite_and_has_the_same_slope(
        mut phi in design(), stages in 1usize..20, seed in any::<u64>(),
    ) {
        phi[parameter::CROSS_WEIGHT] = 0.1;
        let mut setting = Setting::new(phi, stages, seed);
        let exact = setting.knots(&setting.variables()).cost;
        let mut found = exact.clone();
        found.clear();
        let Setting { system, phi, points, scratch, .. } = &mut setting;
        system.cost_quadratics(points.points(), phi, Curvature::GaussNewton, &mut found, scratch);
        for t in 0..=stages {
            for i in 0..6 {
                prop_assert_eq!(found.get(t, i, 6), exact.get(t, i, 6));
            }
            let hessian = reference::dense(&found, t).columns(0, 6).into_owned();
            let eigenvalues = hessian.symmetric_eigenvalues();
            prop_assert!(eigenvalues.min() >= -1e-12 * eigenvalues.max(), "{}", eigenvalues);
        }
    }

    #[test]
    fn dynamics_curvature_is_added_and_is_that_of_the_jacobians(
        phi in design(), stages in 1usize..20, seed in any::<u64>(),
    ) {
        let mut setting = Setting::new(phi, stages, seed);
        let at = setting.variables();
        let direction = setting.direction(true, false);
        let costates = setting.costates.clone();
        // F' lambda_{t+1} at every stage.
        let expected = derivative(&at, &direction, 3e-5, |at| {
            let f = setting.knots(at).dynamics;
            let entry = |t, j| (0..4).map(|i| costates.vector(t + 1)[i] * f.get(t, i, j)).sum::<f64>();
            (0..stages).flat_map(|t| (0..6).map(move |j| (t, j))).map(|(t, j)| entry(t, j)).collect()
        });
        let (dz, _) = setting.read(&direction);
        let Setting { system, phi, points, scratch, rng, .. } = &mut setting;
        let mut out = Matrices::zeros(stages + 1, 6, 7);
        fill_random(rng, &mut out);
        let before = out.clone();
        system.add_dynamics_curvature(points.points(), phi, &costates, &mut out, scratch);
        let mut found = Vec::new();
        for t in 0..stages {
            let dz = [dz.states.vector(t), dz.controls.vector(t)].concat();
            let added = |i, j| out.get(t, i, j) - before.get(t, i, j);
            found.extend((0..6).map(|i| (0..6).map(|j| added(i, j) * dz[j]).sum::<f64>()));
        }
        check("lambda' f_zz dz", &found, &expected, 1e-8)?;
        for t in 0..=stages {
            let slopes_kept = (0..6).all(|i| out.get(t, i, 6) == before.get(t, i, 6));
            prop_assert!(slopes_kept && (t < stages || entries(&out, t).eq(entries(&before, t))));
        }
    }

    #[test]
    fn contraction_is_the_gradient_of_the_weighted_sum_of_all_knots(
        phi in design(), stages in 1usize..20, seed in any::<u64>(), has_cost in any::<bool>(), exact in any::<bool>(),
    ) {
        let mut setting = Setting::new(phi, stages, seed);
        setting.curvature = if exact { Curvature::Exact } else { Curvature::GaussNewton };
        prop_assert!(setting.system.has_smooth_gauss_newton());
        let at = setting.variables();
        let mut adjoints = KnotAdjoints::zeros(setting.system.dimensions(), stages);
        fill_random(&mut setting.rng, &mut adjoints.dynamics);
        fill_random(&mut setting.rng, &mut adjoints.measurement);
        fill_random(&mut setting.rng, &mut adjoints.cost);
        for (t, i, j) in (0..=stages).flat_map(|t| (0..6).flat_map(move |i| (0..i).map(move |j| (t, i, j)))) {
            adjoints.cost.set(t, i, j, adjoints.cost.get(t, j, i));
        }
        // The end has no control, and the last column is not used.
        for i in 4..6 {
            for j in 0..7 {
                adjoints.cost.set(stages, i, j, 0.0);
                adjoints.cost.set(stages, j.min(5), i, 0.0);
            }
        }
        adjoints.has_cost = has_cost;
        let mut joint = Matrices::zeros(stages + 1, 6, 7);
        fill_random(&mut setting.rng, &mut joint);
        let before = joint.clone();
        let mut found = vec![0.5; parameter::COUNT];
        let Setting { system, phi, points, scratch, curvature, .. } = &mut setting;
        let weighed = Adjoints { knots: &adjoints, curvature: *curvature };
        system.contract(points.points(), phi, weighed, &mut joint, &mut found, scratch);
        for part in [true, false] {
            let direction = setting.direction(part, !part);
            let expected = derivative(&at, &direction, 3e-5, |at| {
                let knots = setting.knots(at);
                let dynamics = inner(&adjoints.dynamics, &knots.dynamics, 6);
                let measurement = inner(&adjoints.measurement, &knots.measurement, 4);
                let cost = if has_cost { inner(&adjoints.cost, &knots.cost, 6) } else { 0.0 };
                vec![dynamics + measurement + cost]
            });
            let (dz, dphi) = setting.read(&direction);
            let slope = |t: usize, i: usize| joint.get(t, i, 6) - before.get(t, i, 6);
            let by_states = (0..=stages).flat_map(|t| (0..4).map(move |i| (t, i)));
            let by_controls = (0..stages).flat_map(|t| (0..2).map(move |a| (t, a)));
            let sum = by_states.map(|(t, i)| slope(t, i) * dz.states.vector(t)[i]).sum::<f64>()
                + by_controls.map(|(t, a)| slope(t, 4 + a) * dz.controls.vector(t)[a]).sum::<f64>()
                + found.iter().zip(dphi).map(|(found, d)| (found - 0.5) * d).sum::<f64>();
            let scale = 1.0 + expected[0].abs();
            prop_assert!((sum - expected[0]).abs() < 1e-8 * scale, "by points {part}: {sum} and {}", expected[0]);
        }
        prop_assert_eq!(found[parameter::UNUSED], 0.5);
    }

    #[test]
    fn parameter_gradient_is_that_of_the_lagrangian_and_its_variation_that_of_the_gradient(
        phi in design(), stages in 1usize..20, seed in any::<u64>(), has_end in any::<bool>(),
    ) {
        let mut setting = Setting::new(phi, stages, seed);
        let (phi, costates) = (setting.phi.clone(), setting.costates.clone());
        let direction = setting.direction(true, false);
        let (dx, _) = setting.read(&direction);
        let mut dlambda = costates.clone();
        fill_random(&mut setting.rng, &mut dlambda);
        let mut dz = Matrices::vectors(stages + 1, 6);
        for t in 0..=stages {
            dz.vector_mut(t)[..4].copy_from_slice(dx.states.vector(t));
            if t < stages {
                dz.vector_mut(t)[4..].copy_from_slice(dx.controls.vector(t));
            }
        }
        let Setting { system, points, scratch, .. } = &mut setting;
        fn cut(points: &Trajectory, has_end: bool) -> Points<'_> {
            Points { has_end, ..points.points() }
        }

        let expected = gradients(&phi, &scales().iter().map(|scale| 3e-5 * scale).collect::<Vec<_>>(), |phi| {
            let mut sum = if has_end { system.final_cost(points.states.vector(stages), phi, scratch) } else { 0.0 };
            let mut next = [0.0; 4];
            for t in 0..stages {
                let (x, u) = (points.states.vector(t), points.controls.vector(t));
                sum += system.stage_cost(t, x, u, phi, scratch);
                system.step(t, x, u, phi, &mut next);
                sum += next.iter().zip(costates.vector(t + 1)).map(|(next, costate)| next * costate).sum::<f64>();
            }
            vec![sum]
        });
        let mut found = vec![0.0; phi.len()];
        system.add_parameter_gradient(cut(points, has_end), &phi, &costates, None, &mut found, scratch);
        check("L_phi", &found, &expected[0], 1e-8)?;

        let gradient_along = derivative(&[0.0], &[1.0], 3e-5, |step| {
            let mut moved = points.clone();
            let mut costates = costates.clone();
            for t in 0..=stages {
                let move_by = |to: &mut [f64], by: &[f64]| {
                    to.iter_mut().zip(by).for_each(|(to, by)| *to += step[0] * by);
                };
                move_by(moved.states.vector_mut(t), dx.states.vector(t));
                move_by(costates.vector_mut(t), dlambda.vector(t));
                if t < stages {
                    move_by(moved.controls.vector_mut(t), dx.controls.vector(t));
                }
            }
            let mut gradient = vec![0.0; phi.len()];
            system.add_parameter_gradient(cut(&moved, has_end), &phi, &costates, None, &mut gradient, scratch);
            gradient
        });
        let mut found = vec![0.0; phi.len()];
        let variation = Variation { joint: &dz, costates: &dlambda };
        system.add_parameter_gradient(cut(points, has_end), &phi, &costates, Some(variation), &mut found, scratch);
        check("L_phi along (dz, dlambda)", &found, &gradient_along, 1e-8)?;
    }
}
