//! The search for nominal plans: Gauss-Newton steps, or Newton steps where second derivatives are of use.

use supple_kernels::Scratch;
use supple_lqg::{Regularisation, Rooted};
use supple_model::system::{Curvature, RollOut};

use super::descent::{Descent, Model, Step, descend, search_along};
use super::sweeps::{linearise, sweep};
use super::truncated::{Truncated, truncated_newton};
use super::{Held, NominalProblem, Plan, PlanSettings, PlanStatus, PlanWorkspace};

/// How often the second-derivative correction to Gauss-Newton is halved, if it is not positive or leads nowhere.
const CURVATURE_HALVINGS: usize = 5;
/// Maximum number of halvings of a Newton step: if more are needed, Gauss-Newton does better.
const NEWTON_HALVINGS: usize = 3;
/// Base-2 logarithm of the factor by which a search waits longer after costly second derivatives were of no use.
const COSTLY_WAIT: u32 = 2;
/// Below this share of a Gauss-Newton step second derivatives matter, however far the optimum is.
const SHORT: f64 = 0.25;
/// How often trust in Newton's model is lowered in one iteration.
const ATTEMPTS_BY_PRODUCTS: usize = 2;
/// Number of consecutive whole steps by products after which all second derivatives are computed.
const WHOLE: usize = 2;
/// What remains of the trust in Newton's model if no step along it succeeds.
const LEAST_TRUST: f64 = 1.0 / 16.0;
/// Maximum number of doublings of a Newton step that leaves a region where the curvature is not positive.
const NEWTON_DOUBLINGS: usize = 20;
/// Below this share of the curvature regularisation is dropped.
const LEAST_MU: f64 = 1e-6;

/// Maximum number of iterations of a search that gives up early.
const FEW_ITERATIONS: usize = 12;

/// How long a search continues.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Patience {
    /// As long as the settings say.
    Full,
    /// As long as the settings say, from close to an optimum: second derivatives are of use from the start.
    Close,
    /// A few iterations, from close to an optimum.
    CloseOrNever,
    /// A few iterations, from the plan of a problem that differs little.
    Continued,
}

/// What is asked of a search.
#[derive(Clone, Copy)]
pub(crate) struct Asked<'a> {
    pub settings: &'a PlanSettings,
    pub patience: Patience,
    /// Whether feedback is added to the first guess if its cost overflows.
    pub fed_back: bool,
    /// Whether limits are narrowed step by step, from where a plan without them is.
    pub narrowed: bool,
    /// What a plan passes on whose controls are the first guess, if it is held at limits.
    pub held: Option<&'a Held>,
}

impl<'a> Asked<'a> {
    /// A search from a first guess without feedback.
    pub fn of(settings: &'a PlanSettings, patience: Patience) -> Self {
        Self { settings, patience, fed_back: false, narrowed: false, held: None }
    }
}

/// Searches for a plan from the trajectory in `plan`, which is rolled out; leaves the best one there.
pub(super) fn minimise(
    problem: NominalProblem,
    asked: Asked,
    plan: &mut Plan,
    work: &mut PlanWorkspace,
    scratch: &mut Scratch,
) -> PlanStatus {
    let Asked { settings, patience, .. } = asked;
    let close = patience != Patience::Full;
    let by_products = problem.bounds.is_none() && problem.system.has_costly_curvature();
    let costly = !by_products && problem.system.has_costly_curvature();
    let (deadline, newton) = (work.deadline, Readiness { close, costly, by_products, ..Readiness::default() });
    descend(&mut Search { problem, settings, patience, plan, work, scratch, newton }, settings, deadline)
}

/// Whether the exact second derivatives of the cost about a plan have directions in which it falls.
pub(crate) fn has_descent(
    problem: NominalProblem,
    plan: &mut Plan,
    work: &mut PlanWorkspace,
    scratch: &mut Scratch,
) -> bool {
    linearise(problem, plan, Curvature::GaussNewton, scratch);
    find_curvature(problem, plan, work, scratch);
    sweep(problem, Regularisation::default(), Some(&work.hessian), plan).is_err()
}

/// Second derivatives of the Lagrangian at the trajectory of a plan with costates, in the workspace.
fn find_curvature(problem: NominalProblem, plan: &Plan, work: &mut PlanWorkspace, scratch: &mut Scratch) {
    work.hessian.clear();
    let at = plan.trajectory.points();
    problem.system.lagrangian_quadratics(at, problem.phi, &plan.costates, &mut work.hessian, scratch);
}

/// The search's state between iterations.
struct Search<'a> {
    problem: NominalProblem<'a>,
    settings: &'a PlanSettings,
    patience: Patience,
    plan: &'a mut Plan,
    work: &'a mut PlanWorkspace,
    scratch: &'a mut Scratch,
    newton: Readiness,
}

/// When second derivatives are used: where the last step changed the cost little, and not just after they failed.
#[derive(Clone, Copy, Debug, Default)]
struct Readiness {
    close: bool,
    /// Whether computing them takes as long as several iterations without them.
    costly: bool,
    /// Whether they are only multiplied with vectors, which is cheap.
    by_products: bool,
    failures: u32,
    wait: usize,
    /// Maximum length of the next step by products; none before the first.
    radius: Option<f64>,
    /// Number of consecutive whole steps by products to the minimum of Newton's model.
    whole: usize,
}

impl Readiness {
    fn is_ready(&self) -> bool {
        self.close && self.wait == 0
    }

    fn tried(&mut self, succeeded: bool) {
        self.failures = if succeeded { 0 } else { self.failures + 1 };
        if !succeeded {
            self.whole = 0;
        }
        let longer = if self.costly { COSTLY_WAIT } else { 0 };
        self.wait = if succeeded { 0 } else { (1 << (self.failures + longer).min(5)) - 1 };
    }
}

impl Search<'_> {
    /// Second derivatives of the Lagrangian at the trajectory, in the workspace.
    fn find_curvature(&mut self) {
        find_curvature(self.problem, self.plan, self.work, self.scratch);
    }

    /// Halves what second derivatives add to Gauss-Newton's.
    fn halve_curvature(&mut self) {
        let (hessian, base) = (self.work.hessian.as_mut_slice(), self.plan.knots.cost.as_slice());
        hessian.iter_mut().zip(base).for_each(|(h, b)| *h = 0.5 * (*h + b));
    }
}

impl Descent for Search<'_> {
    /// As shares of the curvature.
    const MU: (f64, f64) = (1e-4, 1e8);
    const ATTEMPTS: usize = usize::MAX;
    const MOST_HIDDEN_AT_END: usize = 0;

    fn plan(&mut self) -> &mut Plan {
        self.plan
    }

    fn merit(&self) -> f64 {
        self.plan.nominal_cost
    }

    fn measure(&mut self) {
        linearise(self.problem, self.plan, Curvature::GaussNewton, self.scratch);
    }

    fn solve(&mut self, mu: f64) -> Result<Model, PlanStatus> {
        let swept = sweep(self.problem, self.settings.regularisation.of(mu), None, self.plan);
        swept.map(Model::Quadratic).map_err(|_| PlanStatus::Indefinite)
    }

    fn try_share(&mut self, share: f64) -> f64 {
        let Self { problem, plan, work, scratch, .. } = self;
        let Plan { trajectory, policy, .. } = &**plan;
        let law = RollOut::Law { reference: trajectory, policy, step: share, bounds: problem.bounds };
        problem.system.roll_out(law, problem.phi, &mut work.candidate, scratch)
    }

    fn accept(&mut self, step: Step) {
        let little = self.plan.nominal_cost - step.merit <= 0.05 * (1.0 + step.merit.abs());
        self.newton.close = little || self.newton.by_products && step.share < SHORT;
        std::mem::swap(&mut self.plan.trajectory, &mut self.work.candidate);
        self.plan.nominal_cost = step.merit;
    }

    /// Lowers the regularisation after a whole step, raises it after a very short one.
    fn ease(&self, mu: f64, step: Step) -> f64 {
        let next = match step.share {
            1.0 => mu * 0.1,
            share if share < 0.1 => (mu * 3.0).max(Self::MU.0),
            _ => mu,
        };
        if next < LEAST_MU { 0.0 } else { next }
    }

    /// A step with second derivatives, or as large a part of them as works, when their use is due.
    fn refine(&mut self) -> Option<Step> {
        let on_the_way = self.patience == Patience::Continued;
        let worth_it = self.settings.newton && !(on_the_way && self.newton.costly);
        let ready = worth_it && self.newton.is_ready();
        self.newton.wait = self.newton.wait.saturating_sub(1);
        if !ready {
            self.newton.whole = 0;
            return None;
        }
        let step = match self.newton.by_products {
            true if self.newton.whole >= WHOLE => self.whole_step().or_else(|| self.step_by_products()),
            true => self.step_by_products(),
            false => self.step_by_curvature(),
        };
        self.newton.tried(step.is_some());
        step
    }

    fn gives_up(&self) -> bool {
        let is_brief = matches!(self.patience, Patience::CloseOrNever | Patience::Continued);
        is_brief && self.plan.iterations > FEW_ITERATIONS
    }
}

impl Search<'_> {
    /// A Newton step, or one with as large a part of the second derivatives as works.
    fn step_by_curvature(&mut self) -> Option<Step> {
        self.find_curvature();
        let settings = self.settings;
        (0..=CURVATURE_HALVINGS).find_map(|halved| {
            if halved > 0 {
                self.halve_curvature();
            }
            let hessian = Some(&self.work.hessian);
            let model = sweep(self.problem, settings.regularisation.of(0.0), hessian, self.plan).ok()?;
            // If the curvature had to be made positive, the cost may decrease further beyond the minimum of that model.
            let doublings = if halved > 0 { NEWTON_DOUBLINGS } else { 0 };
            let halvings = settings.max_halvings.min(NEWTON_HALVINGS);
            search_along(self, settings, Model::Quadratic(model), halvings, doublings)
        })
    }

    /// A whole Newton step, by all second derivatives: close to an optimum this is faster than by many products.
    fn whole_step(&mut self) -> Option<Step> {
        self.find_curvature();
        let model = sweep(self.problem, Regularisation::default(), Some(&self.work.hessian), self.plan).ok();
        let step = model.and_then(|model| search_along(self, self.settings, Model::Quadratic(model), 0, 0));
        if step.is_none() {
            self.newton.whole = 0;
        }
        step
    }

    /// A step towards the minimum of Newton's model, as far as it is trusted: less far if no step along it succeeds.
    fn step_by_products(&mut self) -> Option<Step> {
        self.plan.policy.keep_roots();
        sweep(self.problem, Regularisation::default(), None, self.plan).ok()?;
        let slope = Rooted::of(&self.plan.knots.dynamics, &self.plan.policy)?.slope();
        (0..ATTEMPTS_BY_PRODUCTS).find_map(|_| {
            let Self { problem, plan, work, scratch, newton, settings, .. } = self;
            let Truncated { feedforward, decrease, length, ends } =
                truncated_newton(*problem, plan, &slope, newton.radius, &mut work.hessian, scratch)?;
            plan.policy.feedforward.copy_from(&feedforward);
            let (halvings, doublings) =
                (settings.max_halvings.min(NEWTON_HALVINGS), if ends { NEWTON_DOUBLINGS } else { 0 });
            let settings = *settings;
            let step = search_along(self, settings, Model::Quadratic(decrease), halvings, doublings);
            let made = step.map_or(LEAST_TRUST, |step| step.share);
            self.newton.whole = if made == 1.0 && !ends { self.newton.whole + 1 } else { 0 };
            // A whole step may be longer next time.
            self.newton.radius = Some(if made < 1.0 { made * length } else { 2.0 * made * length });
            step
        })
    }
}
