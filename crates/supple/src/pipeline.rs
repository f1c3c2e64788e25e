//! The whole chain, from a task at one design to its information, cost and gradients. The first file to read.
//!
//! ```text
//! task -> plan (iLQG) -> knots -> belief (Kalman) -> information and cost -> gradient
//! ```
//!
//! # A task at one design
//!
//! ```
//! use supple::cost_parts;
//! use supple::gradient::Functional;
//! use supple::pipeline::TaskState;
//! # let task = r#"
//! #     model = { kind = "linear", A = [[1.0, 0.1], [0.1, 1.0]], B = [[0.0], [0.1]], C = [[1.0, 0.0]] }
//! #     parameters.variance = { initial = 1e-4, bounds = [1e-6, 1e-2], scale = "log", unit = "m^2" }
//! #     [[tasks]]
//! #     name = "balance"
//! #     steps = 50
//! #     time_step = 0.1
//! #     bound = 15.0
//! #     initial_state = [1.0, 0.0]
//! #     noise = { initial = [1e-2, 1e-2], process = [0.0, 1e-3], measurement = ["variance"] }
//! #     costs = [{ kind = "quadratic", Q = [[1.0, 0.0], [0.0, 0.1]], R = [[0.1]] }]
//! # "#;
//!
//! // The task of the front page.
//! let problem = supple_file::parse(task, "balance.toml")?;
//! let (task, phi) = (&problem.tasks[0], problem.parameters.initial());
//! let mut state = TaskState::new(task);
//! state.evaluate(task, &phi, &problem.planning, None)?;
//! assert!(state.plan.status.is_converged());
//! assert!((state.information.total / std::f64::consts::LN_2 - 33.3).abs() < 0.01);
//! assert!((state.cost.expected() - 11.9).abs() < 0.01);
//! assert_eq!(cost_parts(state.plan.nominal_cost, &state.plan.policy, &state.belief, &state.noise)?, state.cost);
//!
//! // Noise of the sensor lowers its information.
//! let mut gradient = Vec::new();
//! state.total_gradient(task, &phi, Functional::INFORMATION, &mut gradient)?;
//! assert!(gradient[0] < 0.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use std::time::{Duration, Instant};
use supple_kernels::{Matrices, Scratch};
use supple_lqg::bound::Nearby;
use supple_lqg::{Belief, CostParts, Information, Noise, cost_parts, information, kalman};
use supple_model::system::Curvature;

use crate::Error;
use crate::belief_plan::{Memory, belief_plan_gradient, plan_belief};
use crate::gradient::{
    FrozenGradient, Functional, GradientWorkspace, Planned, Quantity, frozen_gradient, information_at_rest,
    total_gradient,
};
use crate::plan::{
    Asked, Held, Patience, Plan, PlanMode, PlanSettings, PlanStatus, PlanWorkspace, approach, draw_to_contacts,
    first_guess, has_descent, has_to_approach, plan_risk, search,
};
use crate::problem::{Task, TaskAt};
use crate::sampled_plan::plan_sampled;
use crate::settings::CostCurvature;

/// All results for one task at one design, and the workspace to compute them.
///
/// Example: the [module](crate::pipeline).
pub struct TaskState {
    /// The plan.
    pub plan: Plan,
    /// The noise.
    pub noise: Noise,
    /// The belief along the plan.
    pub belief: Belief,
    /// Its directed information.
    pub information: Information,
    /// Its expected cost in parts.
    pub cost: CostParts,
    plan_work: PlanWorkspace,
    /// `None` until gradients are computed.
    gradient_work: Option<Box<GradientWorkspace>>,
    /// `None` until a belief-space plan is computed.
    memory: Option<Box<Memory>>,
    scratch: Scratch,
    /// Iterations of all plans so far.
    pub(crate) effort: usize,
    /// Path of the last search for the needed information, for warm starts.
    pub(crate) nearby: Option<Nearby>,
}

/// Greatest number of states with which stationary plans are examined for directions in which their cost falls: more take long
/// to record.
const MOST_EXAMINED: usize = 24;

impl TaskState {
    /// Memory for a task.
    #[must_use]
    pub fn new(task: &Task) -> Self {
        let size = task.system.dimensions();
        let steps = task.steps;
        Self {
            plan: Plan::zeros(size, steps),
            noise: Noise::zeros(size.states, size.measurements),
            belief: Belief::zeros(size.states, size.measurements, steps),
            information: Information::default(),
            cost: CostParts::default(),
            plan_work: PlanWorkspace::new(size, steps),
            gradient_work: None,
            memory: None,
            scratch: Scratch::new(),
            effort: 0,
            nearby: None,
        }
    }

    /// Plans a task at a design and finds its information and cost: from the given controls, or else from the task's own
    /// first guess, or, if it has none, from one near its first state (theory, equation P.3b).
    ///
    /// # Errors
    /// Where something is not finite or a covariance is indefinite. How the plan ended is in its status.
    pub fn evaluate(
        &mut self,
        task: &Task,
        phi: &[f64],
        settings: &PlanSettings,
        controls: Option<&Matrices>,
    ) -> Result<(), Error> {
        self.plan_only(task, phi, settings, controls)?;
        self.assess_with(task, phi, settings)
    }

    /// Sets the deadline of planning, this many seconds from now; `None` for no limit.
    pub(crate) fn limit_time(&mut self, seconds: Option<f64>) {
        let limit = seconds.and_then(|seconds| Duration::try_from_secs_f64(seconds).ok());
        self.plan_work.deadline = limit.and_then(|limit| Instant::now().checked_add(limit));
    }

    /// Whether the deadline of planning has passed.
    pub(crate) fn is_late(&self) -> bool {
        self.plan_work.deadline.is_some_and(|deadline| Instant::now() >= deadline)
    }

    /// Whether a task has contacts that do not touch in the first state.
    pub(crate) fn has_to_approach(&self, task: &Task, phi: &[f64]) -> bool {
        let first = task.first_state(phi);
        has_to_approach(&*task.system, &first, phi)
    }

    /// The controls of a plan that approached its contacts from a distance, starting from given controls; `None` if there is
    /// nothing to approach. Also returns how many iterations that took.
    pub(crate) fn approach(
        &mut self,
        task: &Task,
        phi: &[f64],
        settings: &PlanSettings,
        controls: &Matrices,
    ) -> Option<(Matrices, usize)> {
        self.begin(task, phi, Some(controls));
        let found = approach(task.at(phi), settings, &mut self.plan, &mut self.plan_work, &mut self.scratch);
        self.effort += found.as_ref().map_or(0, |(_, iterations)| *iterations);
        found
    }

    /// The controls of a plan that was drawn to its contacts, starting from the controls of one that misses one;
    /// `None` if that is of no use. Also returns how many iterations that took.
    pub(crate) fn draw_to_contacts(
        &mut self,
        task: &Task,
        phi: &[f64],
        settings: &PlanSettings,
        controls: &Matrices,
    ) -> Option<(Matrices, usize)> {
        self.begin(task, phi, Some(controls));
        let found = draw_to_contacts(task.at(phi), settings, &mut self.plan, &mut self.plan_work, &mut self.scratch);
        self.effort += found.as_ref().map_or(0, |(_, iterations)| *iterations);
        found
    }

    /// The cost and the controls of a motion from which a task that has no first guess of its own is planned.
    pub(crate) fn first_guess(&mut self, task: &Task, phi: &[f64]) -> (f64, Matrices) {
        self.begin(task, phi, None);
        first_guess(task.nominal(phi), &mut self.plan, &mut self.plan_work, &mut self.scratch)
    }

    /// Begins a plan from controls, or from the task's own guess, with nothing left of an earlier plan: limits write entries
    /// that the cost itself leaves 0.
    fn begin(&mut self, task: &Task, phi: &[f64], controls: Option<&Matrices>) {
        self.forget();
        self.plan.knots.cost.clear();
        task.write_guess(phi, controls, &mut self.plan.trajectory);
    }

    /// Whether the exact second derivatives of the cost about a stationary plan have directions in which it falls; the state's
    /// own plan is lost.
    pub(crate) fn is_saddle(&mut self, task: &Task, phi: &[f64], stationary: &Plan) -> bool {
        if task.system.dimensions().states > MOST_EXAMINED {
            return false;
        }
        self.forget();
        self.plan.clone_from(stationary);
        self.plan.knots.cost.clear();
        has_descent(task.nominal(phi), &mut self.plan, &mut self.plan_work, &mut self.scratch)
    }

    /// The first half of [`evaluate`](Self::evaluate): the plan.
    ///
    /// # Errors
    /// Where something is not finite.
    pub fn plan_only(
        &mut self,
        task: &Task,
        phi: &[f64],
        settings: &PlanSettings,
        controls: Option<&Matrices>,
    ) -> Result<(), Error> {
        let asked = Asked::of(settings, Patience::Full);
        if controls.is_none() && task.initial_control.is_empty() {
            let (_, found) = self.first_guess(task, phi);
            self.plan_with(task.at(phi), asked, &found)?;
            // The first guess takes a sweep.
            self.plan.iterations += 1;
            return Ok(());
        }
        task.write_guess(phi, controls, &mut self.plan.trajectory);
        self.plan_from_guess(task.at(phi), asked)
    }

    /// Like [`plan_only`](Self::plan_only) from given controls, with the given patience.
    ///
    /// # Errors
    /// Where something is not finite.
    pub(crate) fn plan_with(
        &mut self,
        TaskAt { task, phi }: TaskAt,
        asked: Asked,
        controls: &Matrices,
    ) -> Result<(), Error> {
        task.write_guess(phi, Some(controls), &mut self.plan.trajectory);
        self.plan_from_guess(task.at(phi), asked)
    }

    fn plan_from_guess(&mut self, at: TaskAt, asked: Asked) -> Result<(), Error> {
        self.forget();
        let planned = self.plan_in_mode(at, asked);
        self.effort += self.plan.iterations;
        planned
    }

    fn plan_in_mode(&mut self, TaskAt { task, phi }: TaskAt, asked: Asked) -> Result<(), Error> {
        let settings = asked.settings;
        check_limits(task, settings.plan)?;
        match settings.plan {
            PlanMode::Nominal => {
                search(task.nominal(phi), asked, &mut self.plan, &mut self.plan_work, &mut self.scratch)
            }
            PlanMode::Sampled => {
                task.noise.resolve(phi, &mut self.noise)?;
                plan_sampled(task.at(phi), &self.noise, settings, &mut self.plan, &mut self.scratch)
            }
            PlanMode::Belief => {
                let Self { plan: found, plan_work, memory, scratch, .. } = self;
                let memory = memory.get_or_insert_with(|| Box::new(Memory::new(task)));
                let first = found.trajectory.controls.clone();
                search(task.nominal(phi), asked, found, plan_work, scratch)?;
                plan_belief(task.at(phi), &first, settings, plan_work.deadline, found, memory, scratch);
                Ok(())
            }
            PlanMode::Risk => {
                let Self { plan: found, plan_work, scratch, .. } = self;
                search(task.nominal(phi), asked, found, plan_work, scratch)?;
                plan_risk(task.at(phi), settings, plan_work.deadline, found, scratch)
            }
        }
    }

    /// The second half: belief, information and cost of the plan.
    ///
    /// # Errors
    /// Where a covariance is indefinite.
    pub fn assess(&mut self, task: &Task, phi: &[f64]) -> Result<(), Error> {
        self.forget();
        task.noise.resolve_along(phi, &self.plan.trajectory.states, &mut self.noise)?;
        Error::check_stop()?;
        kalman(&self.plan.knots, &self.noise, &mut self.belief)?;
        information(&self.belief, &self.noise, &mut self.information)?;
        self.cost = cost_parts(self.plan.nominal_cost, &self.plan.policy, &self.belief, &self.noise)?;
        if self.lowered().is_some() && self.plan.status.is_converged() {
            self.plan.status = PlanStatus::Indefinite;
        }
        Ok(())
    }

    /// Assesses the plan of a search with these settings. Where noise would lower the cost, as the exact second derivatives of
    /// the cost may be indefinite at limits, and the choice of curvature is automatic, with the law of Gauss-Newton's if that
    /// is valid.
    ///
    /// # Errors
    /// Where a covariance is indefinite.
    pub(crate) fn assess_with(&mut self, task: &Task, phi: &[f64], settings: &PlanSettings) -> Result<(), Error> {
        self.assess(task, phi)?;
        let is_exact = self.plan.curvature == Curvature::Exact && self.plan.mode == PlanMode::Nominal;
        let may_change = settings.curvature == CostCurvature::Auto && task.system.has_smooth_gauss_newton();
        if self.lowered().is_none() || !is_exact || !may_change {
            return Ok(());
        }
        let exact = self.plan.clone();
        let settings = PlanSettings { curvature: CostCurvature::GaussNewton, ..settings.clone() };
        let held = Held::of(&exact);
        let asked = Asked { held: held.as_ref(), ..Asked::of(&settings, Patience::Close) };
        let planned = self.plan_with(task.at(phi), asked, &exact.trajectory.controls);
        let is_valid = planned.and_then(|()| self.assess(task, phi)).is_ok() && self.plan.status.is_converged();
        if is_valid {
            self.plan.iterations += exact.iterations;
            return Ok(());
        }
        self.plan = exact;
        self.assess(task, phi)
    }

    /// The amount by which noise lowers the cost of a plan that is held at limits, or at bounds of its controls: see
    /// [`CostParts::lowered`].
    pub(crate) fn lowered(&self) -> Option<f64> {
        self.cost.lowered().filter(|_| self.plan.is_at_limits() || self.plan.policy.held().is_some())
    }

    /// Discards the data that gradients stored for the last plan.
    fn forget(&mut self) {
        if let Some(work) = &mut self.gradient_work {
            work.forget();
        }
    }

    /// The total gradient of a functional at the evaluated design.
    ///
    /// # Errors
    /// If the plan is not a strict local optimum, or its kind of plan does not minimise a cost over trajectories.
    pub fn total_gradient(
        &mut self,
        task: &Task,
        phi: &[f64],
        functional: Functional,
        out: &mut Vec<f64>,
    ) -> Result<(), Error> {
        if self.plan.mode == PlanMode::Belief {
            return self.belief_gradient(task, phi, Quantity::of(functional), out);
        }
        self.has_total_gradient()?;
        let Self { plan, belief, noise, gradient_work, scratch, .. } = self;
        let work = gradient_work.get_or_insert_with(|| workspace(task));
        let given = Planned::of(task.at(phi), plan, belief, noise);
        total_gradient(&given, functional, work, scratch, out)
    }

    /// The total gradient of the nominal cost at the evaluated design.
    ///
    /// # Errors
    /// For belief-space plans, if the plan is not a strict local optimum.
    pub fn nominal_gradient(&mut self, task: &Task, phi: &[f64], out: &mut Vec<f64>) -> Result<(), Error> {
        if self.plan.mode == PlanMode::Belief {
            return self.belief_gradient(task, phi, Quantity::NOMINAL_COST, out);
        }
        self.has_total_gradient()?;
        let Self { plan, belief, noise, scratch, .. } = self;
        Planned::of(task.at(phi), plan, belief, noise).nominal(scratch, out);
        Ok(())
    }

    /// The total gradient of the expected cost at the evaluated design; along belief-space plans by the envelope
    /// theorem, at the cost of one sweep.
    ///
    /// # Errors
    /// As those of its parts.
    pub fn cost_gradient(&mut self, task: &Task, phi: &[f64], out: &mut Vec<f64>) -> Result<(), Error> {
        if self.plan.mode == PlanMode::Belief {
            return self.belief_gradient(task, phi, Quantity::EXPECTED_COST, out);
        }
        self.total_gradient(task, phi, Functional::NOISE, out)?;
        let mut nominal = Vec::new();
        self.nominal_gradient(task, phi, &mut nominal)?;
        out.iter_mut().zip(&nominal).for_each(|(sum, nominal)| *sum += nominal);
        Ok(())
    }

    /// An error for risk-sensitive plans, which have none. (Sampled plans formally have one, which their stationarity marks
    /// as not valid.)
    fn has_total_gradient(&self) -> Result<(), Error> {
        match self.plan.mode {
            PlanMode::Risk => Err(Error::NoTotalGradient { plan: PlanMode::Risk.name() }),
            _ => Ok(()),
        }
    }

    fn belief_gradient(
        &mut self,
        task: &Task,
        phi: &[f64],
        quantity: Quantity,
        out: &mut Vec<f64>,
    ) -> Result<(), Error> {
        let Self { plan, memory, scratch, .. } = self;
        let memory = memory.get_or_insert_with(|| Box::new(Memory::new(task)));
        belief_plan_gradient(task.at(phi), plan, quantity, memory, scratch, out)
    }

    /// Gradients of the directed information at the evaluated design with the trajectory held fixed: through what
    /// sensors, and through the propagation of uncertainty.
    pub(crate) fn information_at_rest(&mut self, task: &Task, phi: &[f64]) -> [Vec<f64>; 2] {
        let Self { plan, belief, noise, gradient_work, scratch, .. } = self;
        let work = gradient_work.get_or_insert_with(|| workspace(task));
        let given = Planned::of(task.at(phi), plan, belief, noise);
        information_at_rest(&given, work, scratch)
    }

    /// The frozen gradient at the evaluated design.
    pub fn frozen_gradient(&mut self, task: &Task, phi: &[f64], out: &mut FrozenGradient) {
        let Self { plan, belief, noise, gradient_work, scratch, .. } = self;
        let work = gradient_work.get_or_insert_with(|| workspace(task));
        frozen_gradient(&Planned::of(task.at(phi), plan, belief, noise), work, scratch, out);
    }
}

/// # Errors
/// If the kind of plan cannot keep a limit that the task enforces.
fn check_limits(task: &Task, plan: PlanMode) -> Result<(), Error> {
    let (problem, advice) = match () {
        () if task.system.constraints().is_some() && !plan.keeps_limits() => {
            ("does not support enforced limits", "leave out `enforce` in `[[tasks.limits]]`, or use plan = \"nominal\"")
        }
        () if task.control_bounds.is_some() && !plan.keeps_control_limits() => (
            "does not support control limits",
            "leave out `enforce_effort_limits`, `enforce` of controls and `control_bounds`, or use plan = \"nominal\"",
        ),
        () => return Ok(()),
    };
    Err(Error::Planning { plan: plan.name(), problem: problem.to_owned(), advice })
}

fn workspace(task: &Task) -> Box<GradientWorkspace> {
    Box::new(GradientWorkspace::new(task.system.dimensions(), task.steps))
}
