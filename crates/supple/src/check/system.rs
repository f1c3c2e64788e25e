use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use supple_kernels::{Matrices, Scratch};

use super::compare::{Row, Worst, derivative, step_at};
use crate::design::uniform;
use crate::knots::Knots;
use crate::plan::Plan;
use crate::problem::Task;
use crate::system::{Curvature, KnotAdjoints, Points, Variation};
use crate::trajectory::Trajectory;

/// Every derivative of the task's system along its plan.
pub(super) fn rows(task: &Task, phi: &[f64], plan: &Plan) -> Vec<Row> {
    let mut check = SystemCheck { task, phi, plan, scratch: Scratch::new() };
    vec![
        check.dynamics(),
        check.measurement(),
        check.cost_gradient(),
        check.cost_hessian(),
        check.dynamics_curvature(),
        check.contraction_by_trajectory(),
        check.contraction_by_parameters(),
        check.lagrangian_by_parameters(),
        check.mixed(),
    ]
}

struct SystemCheck<'a> {
    task: &'a Task,
    phi: &'a [f64],
    plan: &'a Plan,
    scratch: Scratch,
}

const FIRST_ORDER: f64 = 1e-7;
const HIGHER_ORDER: f64 = 1e-5;

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

impl SystemCheck<'_> {
    /// State `j` or control `j - n` at step `t`, for people.
    fn variable(&self, j: usize) -> String {
        let names = self.task.system.state_names();
        names.get(j).cloned().unwrap_or_else(|| format!("u{}", j + 1 - names.len()))
    }

    fn size(&self, t: usize, j: usize) -> f64 {
        let (x, u) = moved(&self.plan.trajectory, t, j, 0.0);
        step_at(x.into_iter().chain(u).nth(j).unwrap_or(0.0))
    }

    fn dynamics(&mut self) -> Row {
        let (n, joint) = (self.plan.knots.dimensions.states, self.plan.knots.dimensions.joint());
        let mut worst = Worst::new();
        for t in 0..self.plan.trajectory.steps() {
            for j in 0..joint {
                let numeric = derivative(self.size(t, j), |h| {
                    let (x, u) = moved(&self.plan.trajectory, t, j, h);
                    let mut next = vec![0.0; n];
                    self.task.system.step(t, &x, &u, self.phi, &mut next);
                    next
                });
                for (i, numeric) in numeric.into_iter().enumerate() {
                    let place = || format!("d{}+/d{}, step {t}", self.variable(i), self.variable(j));
                    worst.add(self.plan.knots.dynamics.get(t, i, j), numeric, place);
                }
            }
        }
        worst.row("A, B: dynamics", FIRST_ORDER)
    }

    fn measurement(&mut self) -> Row {
        let (n, p) = (self.plan.knots.dimensions.states, self.plan.knots.dimensions.measurements);
        let mut worst = Worst::new();
        for t in 0..=self.plan.trajectory.steps() {
            for j in 0..n {
                let numeric = derivative(self.size(t, j), |h| {
                    let (x, _) = moved(&self.plan.trajectory, t, j, h);
                    let mut y = vec![0.0; p];
                    self.task.system.observe(t, &x, self.phi, &mut y);
                    y
                });
                for (i, numeric) in numeric.into_iter().enumerate() {
                    let place = || format!("dy{}/d{}, step {t}", i + 1, self.variable(j));
                    worst.add(self.plan.knots.measurement.get(t, i, j), numeric, place);
                }
            }
        }
        worst.row("C: measurement", FIRST_ORDER)
    }

    /// Variables of the cost at step t: the control has no part in the end.
    fn cost_variables(&self, t: usize) -> usize {
        let size = self.plan.knots.dimensions;
        if t < self.plan.trajectory.steps() { size.joint() } else { size.states }
    }

    fn cost_gradient(&mut self) -> Row {
        let joint = self.plan.knots.dimensions.joint();
        let steps = self.plan.trajectory.steps();
        let mut worst = Worst::new();
        for t in 0..=steps {
            for j in 0..self.cost_variables(t) {
                let (task, phi, plan) = (self.task, self.phi, self.plan);
                let numeric = derivative(self.size(t, j), |h| {
                    let (x, u) = moved(&plan.trajectory, t, j, h);
                    vec![if t < steps {
                        task.system.stage_cost(t, &x, &u, phi, &mut self.scratch)
                    } else {
                        task.system.final_cost(&x, phi, &mut self.scratch)
                    }]
                });
                let place = || format!("d{}, step {t}", self.variable(j));
                worst.add(self.plan.knots.cost.get(t, j, joint), numeric[0], place);
            }
        }
        worst.row("cost, first order", FIRST_ORDER)
    }

    /// `[l_zz | l_z]` with `z_t` moved at every step at once.
    fn quadratics(&mut self, j: usize, h: &dyn Fn(usize) -> f64) -> Matrices {
        let mut trajectory = self.plan.trajectory.clone();
        move_all(&mut trajectory, j, h);
        let mut out = Knots::zeros(self.plan.knots.dimensions, trajectory.steps()).cost;
        let at = trajectory.points();
        self.task.system.cost_quadratics(at, self.phi, Curvature::Exact, &mut out, &mut self.scratch);
        out
    }

    fn cost_hessian(&mut self) -> Row {
        let joint = self.plan.knots.dimensions.joint();
        let mut worst = Worst::new();
        for j in 0..joint {
            let steps: Vec<f64> = (0..=self.plan.trajectory.steps()).map(|t| self.size(t, j)).collect();
            let numeric = derivative(1.0, |share| {
                let moved = self.quadratics(j, &|t| share * steps[t]);
                let entries = (0..=self.plan.trajectory.steps())
                    .flat_map(|t| (0..joint).map(move |i| (t, i)))
                    .map(|(t, i)| moved.get(t, i, joint));
                entries.collect()
            });
            for (index, numeric) in numeric.into_iter().enumerate() {
                let (t, i) = (index / joint, index % joint);
                if i < self.cost_variables(t) && j < self.cost_variables(t) {
                    let place = || format!("d{} d{}, step {t}", self.variable(i), self.variable(j));
                    worst.add(self.plan.knots.cost.get(t, i, j), numeric / steps[t], place);
                }
            }
        }
        worst.row("cost, second order", HIGHER_ORDER)
    }

    fn jacobians(&mut self, trajectory: &Trajectory, phi: &[f64]) -> Knots {
        let mut knots = Knots::zeros(self.plan.knots.dimensions, trajectory.steps());
        let system = &*self.task.system;
        knots.linearise_plan(system, trajectory.points(), phi, Curvature::Exact, &mut self.scratch);
        knots.linearise_measurement(system, trajectory.points(), phi, &mut self.scratch);
        knots
    }

    fn dynamics_curvature(&mut self) -> Row {
        let (n, joint) = (self.plan.knots.dimensions.states, self.plan.knots.dimensions.joint());
        let steps = self.plan.trajectory.steps();
        let mut analytic = Matrices::zeros(steps + 1, joint, joint + 1);
        let (at, costates) = (self.plan.trajectory.points(), &self.plan.costates);
        self.task.system.add_dynamics_curvature(at, self.phi, costates, &mut analytic, &mut self.scratch);
        let mut worst = Worst::new();
        for j in 0..joint {
            let sizes: Vec<f64> = (0..=steps).map(|t| self.size(t, j)).collect();
            let numeric = derivative(1.0, |share| {
                let mut trajectory = self.plan.trajectory.clone();
                move_all(&mut trajectory, j, &|t| share * sizes[t]);
                let knots = self.jacobians(&trajectory, self.phi);
                let through = |t: usize, i: usize| -> f64 {
                    let costate = self.plan.costates.vector(t + 1);
                    (0..n).map(|k| knots.dynamics.get(t, k, i) * costate[k]).sum()
                };
                (0..steps).flat_map(|t| (0..joint).map(move |i| (t, i))).map(|(t, i)| through(t, i)).collect()
            });
            for (index, numeric) in numeric.into_iter().enumerate() {
                let (t, i) = (index / joint, index % joint);
                let place = || format!("d{} d{}, step {t}", self.variable(i), self.variable(j));
                worst.add(analytic.get(t, i, j), numeric / sizes[t], place);
            }
        }
        worst.row("lambda' f, second order", HIGHER_ORDER)
    }

    /// Random adjoints of the knots, and their inner product with the knots at a trajectory and parameters.
    fn adjoints(&self) -> KnotAdjoints {
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

    fn inner_product(&mut self, adjoints: &KnotAdjoints, trajectory: &Trajectory, phi: &[f64]) -> Vec<f64> {
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

    fn contraction(&mut self, adjoints: &KnotAdjoints) -> (Matrices, Vec<f64>) {
        let joint = self.plan.knots.dimensions.joint();
        let mut by_joint = Matrices::zeros(self.plan.trajectory.steps() + 1, joint, joint + 1);
        let mut by_parameters = vec![0.0; self.phi.len()];
        let at = self.plan.trajectory.points();
        let system = &self.task.system;
        system.contract(at, self.phi, adjoints, &mut by_joint, &mut by_parameters, &mut self.scratch);
        (by_joint, by_parameters)
    }

    fn contraction_by_trajectory(&mut self) -> Row {
        let joint = self.plan.knots.dimensions.joint();
        let adjoints = self.adjoints();
        let (analytic, _) = self.contraction(&adjoints);
        let mut worst = Worst::new();
        for j in 0..joint {
            let sizes: Vec<f64> = (0..=self.plan.trajectory.steps()).map(|t| self.size(t, j)).collect();
            let numeric = derivative(1.0, |share| {
                let mut trajectory = self.plan.trajectory.clone();
                move_all(&mut trajectory, j, &|t| share * sizes[t]);
                self.inner_product(&adjoints, &trajectory, self.phi)
            });
            for (t, numeric) in numeric.into_iter().enumerate().filter(|&(t, _)| j < self.cost_variables(t)) {
                let place = || format!("d{}, step {t}", self.variable(j));
                worst.add(analytic.get(t, j, joint), numeric / sizes[t], place);
            }
        }
        worst.row("knots, contracted, by trajectory", HIGHER_ORDER)
    }

    fn contraction_by_parameters(&mut self) -> Row {
        let adjoints = self.adjoints();
        let (_, analytic) = self.contraction(&adjoints);
        let trajectory = self.plan.trajectory.clone();
        self.by_parameters("knots, contracted, by parameters", &analytic, HIGHER_ORDER, |check, phi| {
            check.inner_product(&adjoints, &trajectory, phi).into_iter().sum()
        })
    }

    fn by_parameters(
        &mut self,
        name: &str,
        analytic: &[f64],
        tolerance: f64,
        mut value: impl FnMut(&mut Self, &[f64]) -> f64,
    ) -> Row {
        let mut worst = Worst::new();
        for (index, &analytic) in analytic.iter().enumerate() {
            // Long steps where rounding counts, short ones beside a kink of a higher derivative: the best of them.
            let numeric = [1e-2, 1e-3, 1e-4].map(|share| {
                let step = share * self.phi[index].abs().max(1e-2);
                let moved = derivative(step, |h| {
                    let mut phi = self.phi.to_vec();
                    phi[index] += h;
                    vec![value(self, &phi)]
                });
                moved[0]
            });
            let error = |numeric: &f64| (numeric - analytic).abs();
            let better = numeric.into_iter().min_by(|a, b| error(a).total_cmp(&error(b))).unwrap_or(f64::NAN);
            worst.add(analytic, better, || format!("parameter {}", index + 1));
        }
        worst.row(name, tolerance)
    }

    /// `sum l + lambda_{t+1}' f` along a trajectory.
    fn lagrangian(&mut self, trajectory: &Trajectory, costates: &Matrices, phi: &[f64]) -> f64 {
        let n = self.plan.knots.dimensions.states;
        let mut next = vec![0.0; n];
        let mut sum = 0.0;
        for t in 0..trajectory.steps() {
            let (x, u) = (trajectory.states.vector(t), trajectory.controls.vector(t));
            sum += self.task.system.stage_cost(t, x, u, phi, &mut self.scratch);
            self.task.system.step(t, x, u, phi, &mut next);
            sum += next.iter().zip(costates.vector(t + 1)).map(|(f, costate)| f * costate).sum::<f64>();
        }
        sum + self.task.system.final_cost(trajectory.states.vector(trajectory.steps()), phi, &mut self.scratch)
    }

    fn parameter_gradient(
        &mut self,
        at: Points,
        phi: &[f64],
        costates: &Matrices,
        variation: Option<Variation>,
    ) -> Vec<f64> {
        let mut out = vec![0.0; phi.len()];
        self.task.system.add_parameter_gradient(at, phi, costates, variation, &mut out, &mut self.scratch);
        out
    }

    fn lagrangian_by_parameters(&mut self) -> Row {
        let trajectory = self.plan.trajectory.clone();
        let costates = self.plan.costates.clone();
        let analytic = self.parameter_gradient(trajectory.points(), self.phi, &costates, None);
        self.by_parameters("Lagrangian by parameters", &analytic, FIRST_ORDER, |check, phi| {
            check.lagrangian(&trajectory, &costates, phi)
        })
    }

    /// The derivative of the Lagrangian's gradient by the parameters along a random variation.
    fn mixed(&mut self) -> Row {
        let mut random = ChaCha8Rng::seed_from_u64(2);
        let (size, steps) = (self.plan.knots.dimensions, self.plan.trajectory.steps());
        let mut joint = Matrices::vectors(steps + 1, size.joint());
        let mut costates = Matrices::vectors(steps + 1, size.states);
        for t in 0..=steps {
            let used = self.cost_variables(t);
            joint.vector_mut(t)[..used].iter_mut().for_each(|value| *value = uniform(&mut random) - 0.5);
            costates.vector_mut(t).iter_mut().for_each(|value| *value = uniform(&mut random) - 0.5);
        }
        let variation = Variation { joint: &joint, costates: &costates };
        let (trajectory, lambda) = (self.plan.trajectory.clone(), self.plan.costates.clone());
        let analytic = self.parameter_gradient(trajectory.points(), self.phi, &lambda, Some(variation));
        let numeric = derivative(1e-6, |h| {
            let (mut trajectory, mut lambda) = (trajectory.clone(), lambda.clone());
            for t in 0..=steps {
                add(trajectory.states.vector_mut(t), h, &joint.vector(t)[..size.states]);
                add(lambda.vector_mut(t), h, costates.vector(t));
                if t < steps {
                    add(trajectory.controls.vector_mut(t), h, &joint.vector(t)[size.states..]);
                }
            }
            self.parameter_gradient(trajectory.points(), self.phi, &lambda, None)
        });
        let mut worst = Worst::new();
        for (index, (analytic, numeric)) in analytic.into_iter().zip(numeric).enumerate() {
            worst.add(analytic, numeric, || format!("parameter {}", index + 1));
        }
        worst.row("Lagrangian, mixed", HIGHER_ORDER)
    }
}

fn add(to: &mut [f64], factor: f64, from: &[f64]) {
    to.iter_mut().zip(from).for_each(|(to, from)| *to += factor * from);
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
