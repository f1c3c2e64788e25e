use std::cell::RefCell;
use std::collections::BTreeSet;

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use supple_kernels::{Matrices, Scratch};
use supple_lqg::KnotAdjoints;
use supple_lqg::Knots;
use supple_model::Trajectory;
use supple_model::system::{Adjoints, Curvature};

use super::compare::{Entries, Row};
use super::differences::{Difference, Differencing, OTHER_STEPS, differentiate};
use crate::candidates::uniform;
use crate::knots::Linearise;
use crate::plan::Plan;
use crate::problem::{Problem, Task};

/// Every derivative of the task's system along its plan.
pub(super) fn rows(problem: &Problem, task: &Task, phi: &[f64], plan: &Plan) -> Vec<Row> {
    let mut check = SystemCheck {
        problem,
        task,
        phi,
        plan,
        lengthened: 1.0,
        contradicted: RefCell::default(),
        scratch: Scratch::new(),
    };
    let derivatives = [
        SystemCheck::dynamics,
        SystemCheck::measurement,
        SystemCheck::cost_gradient,
        SystemCheck::cost_hessian,
        SystemCheck::dynamics_curvature,
        SystemCheck::contraction_by_trajectory,
        SystemCheck::contraction_by_parameters,
        SystemCheck::lagrangian_by_parameters,
        SystemCheck::mixed,
    ];
    derivatives.into_iter().map(|derivative| check.compared(derivative)).collect()
}

pub(super) struct SystemCheck<'a> {
    pub(super) problem: &'a Problem,
    pub(super) task: &'a Task,
    pub(super) phi: &'a [f64],
    pub(super) plan: &'a Plan,
    /// Factor on all steps.
    pub(super) lengthened: f64,
    /// The entries of one derivative that all differences so far contradict.
    contradicted: RefCell<Option<BTreeSet<usize>>>,
    pub(super) scratch: Scratch,
}

pub(super) const FIRST_ORDER: f64 = 1e-7;
pub(super) const HIGHER_ORDER: f64 = 1e-5;

/// The longest step of a state or control, relative to 1 plus its value.
const STEP: f64 = 1e-4;

/// How a function along the trajectory is differenced, `block` values in a row being sums of terms of one size.
pub(super) fn differencing(step: f64, tolerance: f64, block: usize) -> Differencing<'static> {
    Differencing { step, goal: tolerance, noise: None, block: block.max(1) }
}

/// `z_t` of a trajectory, moved by `h` in entry `j`.
fn moved(trajectory: &Trajectory, t: usize, j: usize, h: f64) -> (Vec<f64>, Vec<f64>) {
    let mut x = trajectory.states.vector(t).to_vec();
    let mut u = if t < trajectory.steps() {
        trajectory.controls.vector(t).to_vec()
    } else {
        vec![0.0; trajectory.controls.cols()]
    };
    match j.checked_sub(x.len()) {
        None => x[j] += h,
        Some(control) => u[control] += h,
    }
    (x, u)
}

impl<'a> SystemCheck<'a> {
    /// Compares a derivative with differences; entries that they contradict, also with those over other steps.
    fn compared(&mut self, derivative: impl Fn(&mut SystemCheck<'a>) -> Row) -> Row {
        self.contradicted = RefCell::default();
        let first = derivative(self);
        if first.passed {
            return first;
        }
        let again = OTHER_STEPS.into_iter().map(|lengthened| {
            self.lengthened = lengthened;
            derivative(self)
        });
        let found = again.into_iter().find(|row| row.passed);
        self.lengthened = 1.0;
        found.unwrap_or(first)
    }

    /// Display name of state `j` or control `j - n`.
    fn variable(&self, j: usize) -> String {
        let names = self.task.system.state_names();
        names.get(j).cloned().unwrap_or_else(|| format!("u{}", j + 1 - names.len()))
    }

    /// The longest step of entry `j` of `z_t`.
    fn size(&self, t: usize, j: usize) -> f64 {
        let (x, u) = moved(&self.plan.trajectory, t, j, 0.0);
        self.lengthened * STEP * (1.0 + x.into_iter().chain(u).nth(j).unwrap_or(0.0).abs())
    }

    /// The row for a sequence of matrices, one per step: entry `(i, j)` has one scale over all steps.
    fn matrix_row(
        &self,
        name: &str,
        tolerance: f64,
        rows: usize,
        cols: usize,
        entries: impl IntoIterator<Item = ([usize; 3], f64, Option<Difference>)>,
        place: impl Fn(usize, usize) -> String,
    ) -> Row {
        let mut list = Entries::default();
        for ([t, i, j], analytic, numeric) in entries {
            let group = i * cols + j;
            list.add(group, t * rows * cols + group, analytic, numeric);
        }
        let row = list.row(name, tolerance, &mut self.contradicted.borrow_mut(), |key| {
            let (t, i, j) = (key / (rows * cols), key / cols % rows, key % cols);
            format!("{}, step {t}", place(i, j))
        });
        // Because of the common scale, entries that vanish at some steps need not be listed.
        Row { unresolved: Vec::new(), ..row }
    }

    fn dynamics(&mut self) -> Row {
        let (n, joint) = (self.plan.knots.dimensions.states, self.plan.knots.dimensions.joint());
        let mut entries = Vec::new();
        for (t, j) in (0..self.plan.trajectory.steps()).flat_map(|t| (0..joint).map(move |j| (t, j))) {
            let numeric = differentiate(differencing(self.size(t, j), FIRST_ORDER, n), |h| {
                let (x, u) = moved(&self.plan.trajectory, t, j, h);
                let mut next = vec![0.0; n];
                self.task.system.step(t, &x, &u, self.phi, &mut next);
                Some(next)
            });
            for i in 0..n {
                let numeric = numeric.as_ref().map(|numeric| numeric[i]);
                entries.push(([t, i, j], self.plan.knots.dynamics.get(t, i, j), numeric));
            }
        }
        let place = |i, j| format!("d{}+/d{}", self.variable(i), self.variable(j));
        self.matrix_row("A, B: dynamics", FIRST_ORDER, n, joint, entries, place)
    }

    fn measurement(&mut self) -> Row {
        let (n, p) = (self.plan.knots.dimensions.states, self.plan.knots.dimensions.measurements);
        let mut entries = Vec::new();
        for (t, j) in (0..=self.plan.trajectory.steps()).flat_map(|t| (0..n).map(move |j| (t, j))) {
            let numeric = differentiate(differencing(self.size(t, j), FIRST_ORDER, p), |h| {
                let (x, _) = moved(&self.plan.trajectory, t, j, h);
                let mut y = vec![0.0; p];
                self.task.system.observe(t, &x, self.phi, &mut y);
                Some(y)
            });
            for i in 0..p {
                let numeric = numeric.as_ref().map(|numeric| numeric[i]);
                entries.push(([t, i, j], self.plan.knots.measurement.get(t, i, j), numeric));
            }
        }
        let place = |i, j| format!("dy{}/d{}", i + 1, self.variable(j));
        self.matrix_row("C: measurement", FIRST_ORDER, p, n, entries, place)
    }

    /// Number of variables of the cost at step t; the final cost does not depend on controls.
    pub(super) fn cost_variables(&self, t: usize) -> usize {
        let size = self.plan.knots.dimensions;
        if t < self.plan.trajectory.steps() { size.joint() } else { size.states }
    }

    fn cost_gradient(&mut self) -> Row {
        let joint = self.plan.knots.dimensions.joint();
        let steps = self.plan.trajectory.steps();
        let mut entries = Vec::new();
        for t in 0..=steps {
            for j in 0..self.cost_variables(t) {
                let how = differencing(self.size(t, j), FIRST_ORDER, 1);
                let (task, phi, plan) = (self.task, self.phi, self.plan);
                let numeric = differentiate(how, |h| {
                    let (x, u) = moved(&plan.trajectory, t, j, h);
                    Some(vec![if t < steps {
                        task.system.stage_cost(t, &x, &u, phi, &mut self.scratch)
                    } else {
                        task.system.final_cost(&x, phi, &mut self.scratch)
                    }])
                });
                let analytic = self.plan.knots.cost.get(t, j, joint);
                entries.push(([t, 0, j], analytic, numeric.map(|numeric| numeric[0])));
            }
        }
        let place = |_, j| format!("d{}", self.variable(j));
        self.matrix_row("cost, first order", FIRST_ORDER, 1, joint, entries, place)
    }

    /// Differences of `width` values per step by entry `j` of `z`, which is moved at every step at once.
    fn at_every_step(
        &mut self,
        j: usize,
        width: usize,
        mut values: impl FnMut(&mut Self, &Trajectory) -> Vec<f64>,
    ) -> Option<Vec<Difference>> {
        let sizes: Vec<f64> = (0..=self.plan.trajectory.steps()).map(|t| self.size(t, j)).collect();
        let mut found = differentiate(differencing(1.0, HIGHER_ORDER, width), |share| {
            let mut trajectory = self.plan.trajectory.clone();
            move_all(&mut trajectory, j, &|t| share * sizes[t]);
            Some(values(self, &trajectory))
        })?;
        for (found, size) in found.chunks_mut(width).zip(&sizes) {
            found.iter_mut().for_each(|found| *found = found.over(*size));
        }
        Some(found)
    }

    /// A row of second derivatives: differences of gradients, `joint` entries per step, compared with a matrix per step.
    fn second_order(
        &mut self,
        name: &str,
        analytic: &Matrices,
        steps: usize,
        mut gradients: impl FnMut(&mut Self, &Trajectory) -> Vec<f64>,
    ) -> Row {
        let joint = self.plan.knots.dimensions.joint();
        let mut entries = Vec::new();
        for j in 0..joint {
            let numeric = self.at_every_step(j, joint, &mut gradients);
            for t in 0..steps {
                let used = self.cost_variables(t);
                for i in (0..used).filter(|_| j < used) {
                    let numeric = numeric.as_ref().map(|numeric| numeric[t * joint + i]);
                    entries.push(([t, i, j], analytic.get(t, i, j), numeric));
                }
            }
        }
        let place = |i, j| format!("d{} d{}", self.variable(i), self.variable(j));
        self.matrix_row(name, HIGHER_ORDER, joint, joint, entries, place)
    }

    fn cost_hessian(&mut self) -> Row {
        let joint = self.plan.knots.dimensions.joint();
        let stages = self.plan.trajectory.steps() + 1;
        let mut analytic = Matrices::zeros(stages, joint, joint + 1);
        let (system, at) = (&self.task.system, self.plan.trajectory.points());
        system.cost_quadratics(at, self.phi, Curvature::Exact, &mut analytic, &mut self.scratch);
        self.second_order("cost, second order", &analytic, stages, |check, trajectory| {
            let mut out = Knots::zeros(check.plan.knots.dimensions, trajectory.steps()).cost;
            let (system, at) = (&check.task.system, trajectory.points());
            system.cost_quadratics(at, check.phi, Curvature::Exact, &mut out, &mut check.scratch);
            (0..stages).flat_map(|t| (0..joint).map(move |i| (t, i))).map(|(t, i)| out.get(t, i, joint)).collect()
        })
    }

    pub(super) fn jacobians(&mut self, trajectory: &Trajectory, phi: &[f64]) -> Knots {
        let mut knots = Knots::zeros(self.plan.knots.dimensions, trajectory.steps());
        let system = &*self.task.system;
        knots.linearise_plan(system, trajectory.points(), phi, self.plan.curvature, &mut self.scratch);
        knots.linearise_measurement(system, trajectory.points(), phi, &mut self.scratch);
        knots
    }

    fn dynamics_curvature(&mut self) -> Row {
        let (n, joint) = (self.plan.knots.dimensions.states, self.plan.knots.dimensions.joint());
        let steps = self.plan.trajectory.steps();
        let mut analytic = Matrices::zeros(steps + 1, joint, joint + 1);
        let (at, costates) = (self.plan.trajectory.points(), &self.plan.costates);
        self.task.system.add_dynamics_curvature(at, self.phi, costates, &mut analytic, &mut self.scratch);
        self.second_order("lambda' f, second order", &analytic, steps, |check, trajectory| {
            let knots = check.jacobians(trajectory, check.phi);
            let through = |t: usize, i: usize| -> f64 {
                let costate = check.plan.costates.vector(t + 1);
                (0..n).map(|k| knots.dynamics.get(t, k, i) * costate[k]).sum()
            };
            (0..steps).flat_map(|t| (0..joint).map(move |i| (t, i))).map(|(t, i)| through(t, i)).collect()
        })
    }

    /// Random adjoints of the knots.
    pub(super) fn adjoints(&self) -> KnotAdjoints {
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let mut adjoints = KnotAdjoints::zeros(self.plan.knots.dimensions, self.plan.trajectory.steps());
        let mut fill = |matrices: &mut Matrices, cols: usize, symmetric: bool| {
            for t in 0..matrices.count() {
                for i in 0..matrices.rows() {
                    for j in 0..if symmetric { i + 1 } else { cols } {
                        let value = uniform(&mut random) - 0.5;
                        matrices.set(t, i, j, value);
                        if symmetric {
                            matrices.set(t, j, i, value);
                        }
                    }
                }
            }
        };
        let size = self.plan.knots.dimensions;
        fill(&mut adjoints.dynamics, size.joint(), false);
        fill(&mut adjoints.measurement, size.states, false);
        fill(&mut adjoints.cost, size.joint(), true);
        adjoints.has_cost = true;
        adjoints
    }

    /// The inner product of adjoints with the knots at a trajectory and parameters, per step.
    pub(super) fn inner_product(&mut self, adjoints: &KnotAdjoints, trajectory: &Trajectory, phi: &[f64]) -> Vec<f64> {
        let knots = self.jacobians(trajectory, phi);
        let size = self.plan.knots.dimensions;
        let per_step = |t: usize| {
            let mut sum = 0.0;
            if t < trajectory.steps() {
                sum += product(&adjoints.dynamics, &knots.dynamics, t, size.joint());
            }
            sum += product(&adjoints.measurement, &knots.measurement, t, size.states);
            sum + product(&adjoints.cost, &knots.cost, t, size.joint())
        };
        (0..=trajectory.steps()).map(per_step).collect()
    }

    pub(super) fn contraction(&mut self, adjoints: &KnotAdjoints) -> (Matrices, Vec<f64>) {
        let joint = self.plan.knots.dimensions.joint();
        let mut by_joint = Matrices::zeros(self.plan.trajectory.steps() + 1, joint, joint + 1);
        let mut by_parameters = vec![0.0; self.phi.len()];
        let at = self.plan.trajectory.points();
        let system = &self.task.system;
        let adjoints = Adjoints { knots: adjoints, curvature: self.plan.curvature };
        system.contract(at, self.phi, adjoints, &mut by_joint, &mut by_parameters, &mut self.scratch);
        (by_joint, by_parameters)
    }

    fn contraction_by_trajectory(&mut self) -> Row {
        let joint = self.plan.knots.dimensions.joint();
        let adjoints = self.adjoints();
        let (analytic, _) = self.contraction(&adjoints);
        let mut entries = Vec::new();
        for j in 0..joint {
            let numeric =
                self.at_every_step(j, 1, |check, trajectory| check.inner_product(&adjoints, trajectory, check.phi));
            for t in (0..=self.plan.trajectory.steps()).filter(|&t| j < self.cost_variables(t)) {
                let numeric = numeric.as_ref().map(|numeric| numeric[t]);
                entries.push(([t, 0, j], analytic.get(t, j, joint), numeric));
            }
        }
        let place = |_, j| format!("d{}", self.variable(j));
        self.matrix_row("contraction of the knots, by trajectory", HIGHER_ORDER, 1, joint, entries, place)
    }
}

fn product(a: &Matrices, b: &Matrices, t: usize, cols: usize) -> f64 {
    (0..a.rows()).flat_map(|i| (0..cols).map(move |j| (i, j))).map(|(i, j)| a.get(t, i, j) * b.get(t, i, j)).sum()
}

/// Moves entry `j` of `z_t` at every step by `h(t)`; there is no control at the end.
fn move_all(trajectory: &mut Trajectory, j: usize, h: &dyn Fn(usize) -> f64) {
    let (n, steps) = (trajectory.states.cols(), trajectory.steps());
    for t in 0..=steps {
        match j.checked_sub(n) {
            None => trajectory.states.vector_mut(t)[j] += h(t),
            Some(control) if t < steps => trajectory.controls.vector_mut(t)[control] += h(t),
            Some(_) => {}
        }
    }
}
