use std::time::Instant;
use supple_kernels::{Scratch, rows};
use supple_lqg::{Regularisation, solve_riccati};
use supple_model::system::{Curvature, RollOut};

use super::hessian::{Around, Hessian};
use super::point::Point;
use crate::gradient::{GradientWorkspace, Quantity, slope_by_controls};
use crate::plan::{Descent, Found, Goal, Model, Plan, PlanSettings, PlanStatus, Stationarity, Step, descend};
use crate::problem::Task;

/// Maximum number of products with the Hessian in one iteration.
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
        let size = task.system.dimensions();
        Self {
            centre: Point::new(task),
            trial: Point::new(task),
            hessian: Hessian::new(size, task.steps),
            gradient: GradientWorkspace::new(size, task.steps),
        }
    }

    /// The curvature of the cost in the control law, and so in the expected cost, at all points from now on.
    pub fn set_curvature(&mut self, curvature: Curvature) {
        for point in [&mut self.centre, &mut self.trial] {
            point.plan.curvature = curvature;
            // Each curvature writes entries that the other leaves 0.
            point.plan.knots.cost.clear();
        }
    }
}

/// Lowers the expected cost from `memory.centre`, already assessed, by Newton's method with conjugate gradients and a
/// line search (theory, section "Belief-space plans"); leaves the plan in `memory.centre`.
///
/// If directions of negative curvature or rejected steps appear, the Hessian is shifted, as in the method of
/// Levenberg and Marquardt.
pub(crate) struct Search<'a> {
    pub task: &'a Task,
    pub phi: &'a [f64],
    pub settings: &'a PlanSettings,
    pub memory: &'a mut Memory,
    pub scratch: &'a mut Scratch,
}

impl Search<'_> {
    /// Searches until the deadline, if there is one; sets the status of the plan.
    pub fn run(&mut self, deadline: Option<Instant>) {
        let plan = self.plan();
        (plan.iterations, plan.regularised) = (0, 0);
        self.plan().status = descend(self, self.settings, deadline);
    }
}

impl Descent for Search<'_> {
    /// The shift of the Hessian, relative to 1.
    const MU: (f64, f64) = (1e-6, 1e12);
    /// One attempt takes many products, so it counts as an iteration.
    const ATTEMPTS: usize = 1;
    const MOST_HIDDEN_AT_END: usize = 3;

    fn plan(&mut self) -> &mut Plan {
        &mut self.memory.centre.plan
    }

    fn merit(&self) -> f64 {
        self.memory.centre.plan.objective
    }

    /// Computes costates and stationarity of the centre, and its control law: `k` and `J_x` of the expected cost.
    fn measure(&mut self) {
        let Self { task, phi, memory, scratch, .. } = self;
        let Memory { centre, gradient, .. } = &mut **memory;
        let mut slope = vec![0.0; task.steps * task.system.dimensions().controls];
        let along = centre.gradient(task, phi);
        let Stationarity { residual, scale, .. } =
            slope_by_controls(&along, Quantity::EXPECTED_COST, None, gradient, scratch, &mut slope, None);
        let plan = &mut centre.plan;
        plan.costates.copy_from(&gradient.costates);
        plan.stationarity = residual;
        // The Riccati sweep has the same curvature as in the assessment, which succeeded.
        let swept = solve_riccati(&plan.knots.dynamics, &gradient.hessian, Regularisation::default(), &mut plan.policy);
        plan.relative_stationarity = if swept.is_ok() { residual / (1.0 + scale) } else { f64::INFINITY };
    }

    /// Stores the step as the feedforward of the Hessian's control law.
    fn solve(&mut self, shift: f64) -> Result<Model, PlanStatus> {
        let Self { task, phi, memory, scratch, .. } = self;
        let Memory { centre, trial, hessian, gradient } = &mut **memory;
        let failed = |_| PlanStatus::LineSearchStalled;
        hessian.prepare(task.at(phi), centre, &centre.plan.costates, shift, scratch).map_err(failed)?;
        let mut slope = vec![0.0; task.steps * task.system.dimensions().controls];
        let (along, feedback) = (centre.gradient(task, phi), Some(&hessian.law.feedback));
        slope_by_controls(&along, Quantity::EXPECTED_COST, feedback, gradient, scratch, &mut slope, None);
        let downhill: Vec<f64> = slope.iter().map(|g| -g).collect();
        // Solve more precisely the closer the plan is to stationary: convergence is quadratic up to rounding.
        let relative = centre.plan.relative_stationarity.sqrt().clamp(1e-6, 0.1);
        let mut found = Found::default();
        let mut around = Around { task, phi, centre, trial, gradient, scratch };
        hessian.solve(&downhill, Goal::free(relative, PRODUCTS), &mut around, &mut found).map_err(failed)?;
        hessian.set(&found.x, 1.0);
        let along = rows::dot(&slope, &found.x);
        if along < 0.0 { Ok(Model::Slope(along)) } else { Err(PlanStatus::LineSearchStalled) }
    }

    fn try_share(&mut self, share: f64) -> f64 {
        let Memory { centre, trial, hessian, .. } = &mut *self.memory;
        let law = RollOut::Law { reference: &centre.plan.trajectory, policy: &hessian.law, step: share, bounds: None };
        let assessed = trial.follow(self.task.at(self.phi), law, self.scratch);
        assessed.map_or(f64::INFINITY, |()| trial.plan.objective)
    }

    fn accept(&mut self, _: Step) {
        let Memory { centre, trial, .. } = &mut *self.memory;
        (trial.plan.iterations, trial.plan.regularised) = (centre.plan.iterations, centre.plan.regularised);
        std::mem::swap(centre, trial);
    }

    fn ease(&self, shift: f64, step: Step) -> f64 {
        match shift {
            _ if step.hidden => shift,
            _ if shift <= Self::MU.0 => 0.0,
            _ => 0.1 * shift,
        }
    }
}
