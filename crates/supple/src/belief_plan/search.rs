use supple_kernels::{Scratch, rows};
use supple_lqg::Dimensions;
use supple_lqg::{Regularisation, solve_riccati};

use super::hessian::{Around, Hessian};
use super::point::Point;
use crate::gradient::{GradientWorkspace, Quantity, Steepness, slope_by_controls};
use crate::plan::{PlanSettings, PlanStatus};
use crate::problem::Task;

/// The shift of the Hessian, relative to 1, from the first failure on, and where it is given up.
const LEAST_SHIFT: f64 = 1e-6;
const MOST_SHIFT: f64 = 1e12;

/// Products with the Hessian in one iteration at most.
const PRODUCTS: usize = 60;

/// Memory of searches for the least expected cost.
pub(crate) struct Memory {
    pub centre: Point,
    pub trial: Point,
    pub hessian: Hessian,
    pub gradient: GradientWorkspace,
}

impl Memory {
    pub fn new(task: &Task) -> Self {
        let size: Dimensions = task.system.dimensions();
        Self {
            centre: Point::new(task),
            trial: Point::new(task),
            hessian: Hessian::new(size, task.steps),
            gradient: GradientWorkspace::new(size, task.steps),
        }
    }
}

/// How an iteration went.
enum Outcome {
    Accepted,
    /// Accepted, though rounding hides the decrease of the cost.
    Resolved,
    Rejected,
}

/// Lowers the expected cost from `memory.centre`, which is assessed, by Newton's method with conjugate gradients and a
/// line search (theory, section "Belief-space plans"); leaves the plan there.
///
/// Where the directions of negative curvature or rejected steps appear, the Hessian is shifted, as in the method of
/// Levenberg and Marquardt.
pub(crate) struct Descent<'a> {
    pub task: &'a Task,
    pub phi: &'a [f64],
    pub settings: &'a PlanSettings,
    pub memory: &'a mut Memory,
    pub scratch: &'a mut Scratch,
}

impl Descent<'_> {
    pub fn run(&mut self) -> PlanStatus {
        let (mut shift, mut unresolved, mut last) = (0.0, 0, f64::INFINITY);
        self.memory.centre.plan.iterations = 0;
        self.memory.centre.plan.regularised = 0;
        loop {
            let stationarity = self.measure();
            if stationarity <= self.settings.tolerance {
                return PlanStatus::Converged;
            }
            let plan = &mut self.memory.centre.plan;
            if plan.iterations >= self.settings.max_iterations {
                return self.ended(PlanStatus::MaxIterations);
            }
            plan.iterations += 1;
            match self.iterate(shift) {
                Outcome::Accepted => {
                    unresolved = 0;
                    shift = if shift <= LEAST_SHIFT { 0.0 } else { 0.1 * shift };
                }
                Outcome::Resolved => {
                    unresolved = if stationarity < 0.5 * last { 0 } else { unresolved + 1 };
                    last = last.min(stationarity);
                    if unresolved > 3 {
                        self.measure();
                        return self.ended(PlanStatus::LineSearchStalled);
                    }
                }
                Outcome::Rejected => {
                    self.memory.centre.plan.regularised += 1;
                    shift = (10.0 * shift).max(LEAST_SHIFT);
                    if shift > MOST_SHIFT {
                        return self.ended(PlanStatus::LineSearchStalled);
                    }
                }
            }
        }
    }

    /// Converged, where the plan is stationary but for rounding.
    fn ended(&self, status: PlanStatus) -> PlanStatus {
        let loose = self.memory.centre.plan.relative_stationarity <= 1e3 * self.settings.tolerance;
        if loose { PlanStatus::Converged } else { status }
    }

    /// Costates and stationarity of the centre, and its law: `k` and `J_x` of the expected cost.
    fn measure(&mut self) -> f64 {
        let Self { task, phi, memory, scratch, .. } = self;
        let Memory { centre, gradient, .. } = &mut **memory;
        let mut slope = vec![0.0; task.steps * task.system.dimensions().controls];
        let work = (&mut *gradient, &mut **scratch);
        let along = centre.gradient(task, phi);
        let Steepness { residual, scale } =
            slope_by_controls(&along, Quantity::EXPECTED_COST, None, work, &mut slope, None);
        let plan = &mut centre.plan;
        plan.costates.copy_from(&gradient.costates);
        plan.stationarity = residual;
        plan.relative_stationarity = residual / (1.0 + scale);
        // Its curvature is that of the assessment, which succeeded.
        let swept = solve_riccati(&plan.knots.dynamics, &gradient.hessian, Regularisation::default(), &mut plan.policy);
        if swept.is_ok() { plan.relative_stationarity } else { f64::INFINITY }
    }

    fn iterate(&mut self, shift: f64) -> Outcome {
        let Self { task, phi, settings, memory, scratch } = self;
        let Memory { centre, trial, hessian, gradient } = &mut **memory;
        let given = (*task, *phi);
        if hessian.prepare(given, centre, (&centre.plan.costates, shift), scratch).is_err() {
            return Outcome::Rejected;
        }
        let mut slope = vec![0.0; task.steps * task.system.dimensions().controls];
        let feedback = Some(&hessian.law.feedback);
        let along = centre.gradient(task, phi);
        slope_by_controls(
            &along,
            Quantity::EXPECTED_COST,
            feedback,
            (&mut *gradient, &mut **scratch),
            &mut slope,
            None,
        );
        let downhill: Vec<f64> = slope.iter().map(|g| -g).collect();
        // The closer, the more exactly: convergence is quadratic but for rounding.
        let relative = centre.plan.relative_stationarity.sqrt().clamp(1e-6, 0.1);
        let mut step = Vec::new();
        let mut around = Around { task, phi, centre, trial, gradient, scratch };
        if hessian.solve(&downhill, (relative, PRODUCTS), &mut around, &mut step).is_err() {
            return Outcome::Rejected;
        }
        let slope_along = rows::dot(&slope, &step);
        if slope_along >= 0.0 || slope_along.is_nan() {
            return Outcome::Rejected;
        }
        hessian.set(&step, 1.0);
        let (before, resolution) = (centre.plan.objective, 1e-14 * (1.0 + centre.plan.objective.abs()));
        let resolved = -0.5 * slope_along <= 10.0 * resolution;
        let mut share = 1.0;
        for _ in 0..=settings.max_halvings {
            let law = (&hessian.law, share);
            let assessed = trial.follow(given, &centre.plan.trajectory, law, scratch);
            let actual = before - trial.plan.objective;
            let enough = actual > 0.0 && actual >= -settings.sufficient_decrease * share * slope_along;
            if assessed.is_ok() && (enough || resolved && actual >= -10.0 * resolution) {
                trial.plan.iterations = centre.plan.iterations;
                trial.plan.regularised = centre.plan.regularised;
                std::mem::swap(centre, trial);
                return if resolved { Outcome::Resolved } else { Outcome::Accepted };
            }
            share *= 0.5;
        }
        Outcome::Rejected
    }
}
