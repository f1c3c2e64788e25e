//! A time step of several steps of integration against one that goes through all of them by itself.

use crate::common::reference::{fill_random, relative_error};
use crate::recorded::everything;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use supple::cost::Cost;
use supple::quantity::{Control, Known, Measurable, State, Vocabulary};
use supple::system::{Authored, Points, RollOut, System, Times};
use supple::{Channel, Dimensions, Matrices, Model, ParameterHandle, Point, Scalar, Scratch, Trajectory, Value};

/// Joints that pull at one another, each with an acceleration that depends on all.
#[derive(Clone, Copy, Debug)]
struct Coupled {
    joints: usize,
    substeps: usize,
    /// Whether a step solves for the accelerations of every sub-step itself, in place of leaving one step to be solved.
    whole: bool,
}

const STIFFNESS: usize = 0;
const MASS: usize = 1;
const TIME_STEP: usize = 2;
const DESIGN: [f64; 3] = [3.0, 0.4, 0.3];

impl Coupled {
    fn inertia<S: Scalar>(&self, x: &[S], phi: &[S]) -> Vec<Vec<S>> {
        let entry = |i: usize, j: usize| {
            let coupled = (x[i] - x[j]).cos() * 0.1;
            if i == j { coupled + phi[MASS] + x[i].cos() * 0.5 + 1.5 } else { coupled }
        };
        (0..self.joints).map(|i| (0..self.joints).map(|j| entry(i, j)).collect()).collect()
    }

    fn force<S: Scalar>(&self, x: &[S], u: &[S], phi: &[S]) -> Vec<S> {
        let of = |i: usize| {
            let (q, v) = (x[i], x[self.joints + i]);
            u[i % 2] - phi[STIFFNESS] * (q + x[(i + 1) % self.joints]).sin() + v * v * 0.2 - v * u[1] * 0.1
        };
        (0..self.joints).map(of).collect()
    }

    fn integrate<S: Scalar>(&self, x: &[S], a: &[S], dt: S, next: &mut [S]) {
        for i in 0..self.joints {
            next[self.joints + i] = x[self.joints + i] + dt * a[i];
            next[i] = x[i] + dt * next[self.joints + i];
        }
    }
}

/// By elimination.
fn solve<S: Scalar>(mut matrix: Vec<Vec<S>>, mut right: Vec<S>) -> Vec<S> {
    let count = right.len();
    for i in 0..count {
        let pivot = matrix[i].clone();
        for j in i + 1..count {
            let factor = matrix[j][i] / pivot[i];
            for (entry, &above) in matrix[j].iter_mut().zip(&pivot) {
                *entry -= factor * above;
            }
            let known = factor * right[i];
            right[j] -= known;
        }
    }
    for i in (0..count).rev() {
        let known = (i + 1..count).fold(right[i], |sum, j| sum - matrix[i][j] * right[j]);
        right[i] = known / matrix[i][i];
    }
    right
}

impl Model for Coupled {
    fn dimensions(&self) -> Dimensions {
        Dimensions { states: 2 * self.joints, controls: 2, measurements: 1 }
    }

    fn step<S: Scalar>(&self, at: &Point<S>, next: &mut [S]) {
        if !self.whole {
            return self.integrate(at.x, at.w, at.time_step, next);
        }
        let (dt, mut x) = (at.time_step / self.substeps as f64, at.x.to_vec());
        for _ in 0..self.substeps {
            let a = solve(self.inertia(&x, at.phi), self.force(&x, at.u, at.phi));
            self.integrate(&x, &a, dt, next);
            x.copy_from_slice(next);
        }
    }

    fn observe<S: Scalar>(&self, at: &Point<S>, y: &mut [S]) {
        y[0] = at.x[0].sin();
    }

    fn unknowns(&self) -> usize {
        if self.whole { 0 } else { self.joints }
    }

    fn balance<S: Scalar>(&self, at: &Point<S>, residual: &mut [S]) {
        let (inertia, force) = (self.inertia(at.x, at.phi), self.force(at.x, at.u, at.phi));
        for (i, residual) in residual.iter_mut().enumerate() {
            *residual = inertia[i].iter().zip(at.w).fold(-force[i], |sum, (&m, &a)| m.mul_add(a, sum));
        }
    }

    fn mass<S: Scalar>(&self, at: &Point<S>, matrix: &mut [S]) {
        if !self.whole {
            matrix.copy_from_slice(&self.inertia(at.x, at.phi).concat());
        }
    }

    fn substeps(&self) -> Option<usize> {
        (!self.whole).then_some(self.substeps)
    }
}

/// How much a velocity changes over the whole step: not linear in the next state, which is given, or which it goes to by
/// itself.
#[derive(Clone, Debug)]
struct Change {
    goes: Option<Coupled>,
}

impl Measurable for Change {
    const NAME: &'static str = "change";

    fn len(&self) -> usize {
        2
    }

    fn channels(&self, _: &Vocabulary) -> Vec<Channel> {
        vec![Channel::new("a", ""), Channel::new("b", "")]
    }

    fn evaluate<S: Scalar>(&self, at: &Point<S>, known: &Known<S>, out: &mut [S]) {
        let next = match self.goes {
            Some(model) => {
                let mut next = vec![S::zero(); at.x.len()];
                model.step(at, &mut next);
                next
            }
            None => known.next.to_vec(),
        };
        out[0] = (next[3] - at.x[3]) / at.time_step;
        out[1] = next[0] * at.x[1].sin() * at.phi[STIFFNESS] + next[1] * at.u[0];
    }

    fn depends_on_control(&self) -> bool {
        true
    }

    fn needs_next(&self) -> bool {
        self.goes.is_none()
    }
}

fn system(joints: usize, substeps: usize, whole: bool, changes: bool) -> Authored<Coupled> {
    let mut costs = vec![Cost::new(State::new([0, 1]), 0.7).with_targets([0.3, 0.1]), Cost::new(Control::all(2), 0.2)];
    let model = Coupled { joints, substeps, whole };
    if changes {
        costs.push(Cost::new(Change { goes: whole.then_some(model) }, 0.4).with_targets([0.2, 0.1]));
    }
    let time_step: Value = ParameterHandle::at(TIME_STEP).into();
    Authored::new(model, costs, time_step, DESIGN.len())
}

/// What goes through steps: trajectories, steps of many points, and those over other time steps.
fn moved(system: &dyn System) -> Vec<(&'static str, Vec<f64>)> {
    let (size, steps) = (system.dimensions(), 19);
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let mut path = Trajectory::zeros(size, steps);
    fill_random(&mut rng, &mut path.states);
    fill_random(&mut rng, &mut path.controls);
    let at = Points { has_end: false, times: Times::At(0), ..path.points() };
    let scratch = &mut Scratch::new();
    let mut next = Matrices::vectors(steps + 1, size.states);
    system.step_all(at, &DESIGN, &mut next, scratch);
    let mut found = vec![("steps", next.as_slice().to_vec())];
    system.step_all_in(3, at, &DESIGN, &mut next, scratch);
    found.push(("finer steps", next.as_slice().to_vec()));
    let mut jacobians = Matrices::zeros(steps + 1, size.states, size.joint());
    system.dynamics_jacobians_in(3, at, &DESIGN, &mut jacobians, scratch);
    found.push(("[A B] of finer steps", jacobians.as_slice().to_vec()));
    let (x, u) = (path.states.vector(4), path.controls.vector(4));
    let jacobian = system.dynamics_jacobian_with(0, x, u, &DESIGN, 0.1).unwrap();
    found.push(("[A B] over another time step", jacobian.as_slice().to_vec()));
    let cost = system.roll_out(RollOut::Controls, &DESIGN, &mut path, scratch);
    found.push(("roll-out", [path.states.as_slice(), &[cost]].concat()));
    found
}

/// Every function and derivative is that of the whole step, with few unknowns and with many, whose curvature is found in
/// another way.
#[test]
fn substeps_are_composed_exactly() {
    for (joints, substeps, changes) in [(2, 1, true), (2, 2, false), (2, 5, true), (17, 2, false), (17, 1, true)] {
        let [parts, whole] = [false, true].map(|whole| system(joints, substeps, whole, changes));
        assert_eq!(parts.depends_on(3), [true; 3]);
        let all = |system: &Authored<Coupled>| [moved(system), everything(system, &DESIGN, 7)].concat();
        for ((what, found), (_, expected)) in all(&parts).into_iter().zip(all(&whole)) {
            let error = relative_error(&found, &expected);
            assert!(error < 1e-11, "{what} of {joints} joints and {substeps} sub-steps is off by {error:.1e}");
        }
    }
}

/// Products with second derivatives are those of the matrices.
#[test]
fn products_with_the_curvature_of_substeps() {
    let system = system(17, 3, false, false);
    let size = system.dimensions();
    let (stages, joint) = (5, size.joint());
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let mut path = Trajectory::zeros(size, stages);
    let mut costates = Matrices::vectors(stages + 1, size.states);
    let mut variation = Matrices::vectors(stages + 1, joint);
    for matrices in [&mut path.states, &mut path.controls, &mut costates, &mut variation] {
        fill_random(&mut rng, matrices);
    }
    let scratch = &mut Scratch::new();
    let mut all = Matrices::zeros(stages + 1, joint, joint + 1);
    system.add_dynamics_curvature(path.points(), &DESIGN, &costates, &mut all, scratch);
    let mut out = Matrices::vectors(stages + 1, joint);
    let mut products = system.curvature_products(path.points(), &DESIGN, &costates, scratch).unwrap();
    products.add(&variation, &mut out, scratch);
    let row = |t: usize, a: usize| (0..joint).map(|b| all.get(t, a, b) * variation.vector(t)[b]).sum::<f64>();
    let expected: Vec<f64> =
        (0..stages).flat_map(|t| (0..joint).map(move |a| (t, a))).map(|(t, a)| row(t, a)).collect();
    let found: Vec<f64> = (0..stages).flat_map(|t| out.vector(t).to_vec()).collect();
    assert!(relative_error(&found, &expected) < 1e-12);
    assert!(out.vector(stages).iter().all(|&entry| entry == 0.0));
}
