//! Gradients of functionals with the trajectory varying, and with the trajectory held fixed.

use supple_kernels::Scratch;
use supple_lqg::{Belief, BeliefSeeds, Noise, Partials, RiccatiSeeds, reverse_kalman, reverse_riccati};
use supple_model::Value;
use supple_model::noise::NoiseModel;
use supple_model::system::{Adjoints, Constraints, ExcessVariation, System, Variation};

use super::kept::vary_within_limits;
use super::workspace::GradientWorkspace;
use crate::Error;
use crate::plan::Plan;
use crate::problem::{Task, TaskAt};

/// A number that depends on the knots: a weighted sum of the directed information and of the noise's parts of the
/// expected cost.
///
/// Example: the [module](crate::pipeline).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Functional<'a> {
    /// Weight of the directed information, nats.
    pub information: f64,
    /// Weight of the belief's part.
    pub belief: f64,
    /// Weight of the process noise's part.
    pub process: f64,
    /// Weight of the initial uncertainty's part.
    pub initial: f64,
    /// Derivatives of another number, which is added.
    pub partials: Option<&'a Partials>,
}

impl Functional<'_> {
    /// The directed information.
    pub const INFORMATION: Self = Self { information: 1.0, belief: 0.0, process: 0.0, initial: 0.0, partials: None };
    /// The belief's part of the expected cost.
    pub const BELIEF: Self = Self { information: 0.0, belief: 1.0, process: 0.0, initial: 0.0, partials: None };
    /// The process noise's part of the expected cost.
    pub const PROCESS: Self = Self { information: 0.0, belief: 0.0, process: 1.0, initial: 0.0, partials: None };
    /// The initial uncertainty's part of the expected cost.
    pub const INITIAL: Self = Self { information: 0.0, belief: 0.0, process: 0.0, initial: 1.0, partials: None };
    /// All of the noise's parts of the expected cost.
    pub const NOISE: Self = Self { information: 0.0, belief: 1.0, process: 1.0, initial: 1.0, partials: None };

    fn depends_on_plan(&self) -> bool {
        self.belief != 0.0 || self.process != 0.0 || self.initial != 0.0 || self.partials.is_some()
    }
}

/// A planned task at one design, as far as gradients need it.
///
/// Example: [`total_gradient`].
#[derive(Clone, Copy)]
pub struct Planned<'a> {
    /// The system.
    pub system: &'a dyn System,
    /// All parameters.
    pub phi: &'a [f64],
    /// The noise model, whose noise may depend on parameters.
    pub noise_model: &'a NoiseModel,
    /// The first state, which may depend on parameters.
    pub initial_state: &'a [Value],
    /// The plan: converged.
    pub plan: &'a Plan,
    /// The belief along it.
    pub belief: &'a Belief,
    /// The noise.
    pub noise: &'a Noise,
}

impl<'a> Planned<'a> {
    /// A plan of a task at values of the parameters, with the belief along it and the noise.
    pub(crate) fn of(TaskAt { task, phi }: TaskAt<'a>, plan: &'a Plan, belief: &'a Belief, noise: &'a Noise) -> Self {
        let Task { system, noise: noise_model, initial_state, .. } = task;
        Self { system: &**system, phi, noise_model, initial_state, plan, belief, noise }
    }

    /// The active limits of the plan; `None` if none is active.
    fn limits(&self) -> Option<&'a dyn Constraints> {
        self.system.constraints().filter(|_| self.plan.is_at_limits())
    }

    /// The gradient of the nominal cost, by the envelope theorem (theory, equation G.2):
    /// `sum l_phi + lambda_{t+1}' f_phi + mu_t' e_phi + lambda_0' dx_0/dphi`.
    pub fn nominal(&self, scratch: &mut Scratch, out: &mut Vec<f64>) {
        out.clear();
        out.resize(self.phi.len(), 0.0);
        let (at, costates) = (self.plan.trajectory.points(), &self.plan.costates);
        self.system.add_parameter_gradient(at, self.phi, costates, None, out, scratch);
        if let Some(limits) = self.limits() {
            limits.add_excess_parameter_gradient(at, self.phi, &self.plan.multipliers, None, out, scratch);
        }
        add_initial_state(self.initial_state, self.phi, costates.vector(0), out);
    }
}

pub(super) fn add_initial_state(initial_state: &[Value], phi: &[f64], costate: &[f64], out: &mut [f64]) {
    for (value, costate) in initial_state.iter().zip(costate) {
        value.add_gradient(phi, *costate, out);
    }
}

/// The total gradient of a functional by all parameters, with everything varying (theory, equations G.3 to G.6):
///
/// 1. reverse sweeps give the adjoints of the knots;
/// 2. these contracted with the derivatives of the knots, and of `V` where it varies with the state, give the
///    functional's gradient `h` by the trajectory, and its direct one by the parameters;
/// 3. the trajectory changes with the parameters such that it stays optimal: one LQ problem with the exact Hessians
///    `H = (l + lambda' f)_zz` and linear terms `h` gives `(dz, dlambda)`, and
///    `dF/dphi = F_phi + sum dz' (l + lambda' f)_{z phi} + dlambda_{t+1}' f_phi + dlambda_0' dx_0/dphi`.
///
/// Controls that the plan holds at a bound do not move (theory, equation P.7c), and limits that it is at stay met
/// (theory, equation G.11).
///
/// Only the derivative evaluations take longer with more parameters. `work` keeps the quantities that are the
/// same for every functional of a plan, until [`forget`](GradientWorkspace::forget) is called.
///
/// # Errors
/// If the trajectory is not a strict local optimum, so that it has no derivative.
///
/// ```
/// use supple::Scratch;
/// use supple::gradient::{FrozenGradient, Functional, GradientWorkspace, Planned};
/// use supple::gradient::{frozen_gradient, total_gradient};
/// use supple::pipeline::TaskState;
/// # let task = r#"
/// #     model = { kind = "linear", A = [[1.0, 0.1], [0.1, 1.0]], B = [[0.0], [0.1]], C = [[1.0, 0.0]] }
/// #     parameters.variance = { initial = 1e-4, bounds = [1e-6, 1e-2], scale = "log", unit = "m^2" }
/// #     [[tasks]]
/// #     name = "balance"
/// #     steps = 50
/// #     time_step = 0.1
/// #     bound = 15.0
/// #     initial_state = [1.0, 0.0]
/// #     noise = { initial = [1e-2, 1e-2], process = [0.0, 1e-3], measurement = ["variance"] }
/// #     costs = [{ kind = "quadratic", Q = [[1.0, 0.0], [0.0, 0.1]], R = [[0.1]] }]
/// # "#;
///
/// // The task of the front page.
/// let problem = supple_file::parse(task, "balance.toml")?;
/// let (task, phi) = (&problem.tasks[0], problem.parameters.initial());
/// let mut state = TaskState::new(task);
/// state.evaluate(task, &phi, &problem.planning, None)?;
/// let (mut work, mut scratch) = (GradientWorkspace::new(task.system.dimensions(), task.steps), Scratch::new());
/// let at = Planned {
///     system: &*task.system,
///     phi: &phi,
///     noise_model: &task.noise,
///     initial_state: &task.initial_state,
///     plan: &state.plan,
///     belief: &state.belief,
///     noise: &state.noise,
/// };
/// let (mut total, mut frozen) = (Vec::new(), FrozenGradient::default());
/// total_gradient(&at, Functional::INFORMATION, &mut work, &mut scratch, &mut total)?;
/// frozen_gradient(&at, &mut work, &mut scratch, &mut frozen);
///
/// // The variance of the sensor does not change the plan, so both are the same.
/// assert!(total[0] < 0.0 && (total[0] / frozen.information[0] - 1.0).abs() < 1e-6);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn total_gradient(
    task: &Planned,
    functional: Functional,
    work: &mut GradientWorkspace,
    scratch: &mut Scratch,
    out: &mut Vec<f64>,
) -> Result<(), Error> {
    let &Planned { system, phi, initial_state, plan, .. } = task;
    let at = plan.trajectory.points();
    out.clear();
    out.resize(phi.len(), 0.0);
    work.start_hessian(system, phi, plan, task.limits(), scratch);
    add_functional(task, functional, work, scratch, out);
    if let Some(limits) = task.limits() {
        let multipliers = &vary_within_limits(plan, phi, limits, work, scratch)?;
        let moved = Some(ExcessVariation { joint: &work.variation, multipliers });
        limits.add_excess_parameter_gradient(at, phi, &plan.multipliers, moved, out, scratch);
    } else {
        work.vary(plan)?;
    }
    let variation = Variation { joint: &work.variation, costates: &work.costates };
    system.add_parameter_gradient(at, phi, &plan.costates, Some(variation), out, scratch);
    add_initial_state(initial_state, phi, work.costates.vector(0), out);
    Ok(())
}

/// Adds the functional's gradient by the trajectory to the last column of `work.hessian`, and its direct one by the
/// parameters to `out`, the trajectory held fixed (theory, equations G.3 to G.5).
pub(crate) fn add_functional(
    task: &Planned,
    functional: Functional,
    work: &mut GradientWorkspace,
    scratch: &mut Scratch,
    out: &mut [f64],
) {
    let &Planned { system, phi, noise_model, plan, belief, noise, .. } = task;
    noise_model.clear(&mut work.noise, plan.trajectory.steps());
    work.adjoints.has_cost = false;
    let weights = (functional.belief != 0.0).then_some((&plan.policy.value_of_information, functional.belief));
    let covariances = functional.partials.map(|partials| (&partials.predicted, &partials.corrected));
    let seeds = BeliefSeeds { information: functional.information, weights, covariances };
    reverse_kalman(&plan.knots, noise, belief, seeds, &mut work.belief, &mut work.adjoints, &mut work.noise);
    if let Some(partials) = functional.partials {
        partials.add_to(&plan.knots, &mut work.adjoints, &mut work.noise);
    }
    if functional.depends_on_plan() {
        let Functional { belief: belief_weight, process, initial, partials, .. } = functional;
        let seeds = RiccatiSeeds { belief: belief_weight, process, initial, partials };
        let (knots, adjoints) = (&plan.knots, &mut work.adjoints);
        reverse_riccati(knots, &plan.policy, belief, noise, seeds, &mut work.riccati, adjoints);
        add_direct_noise(plan, functional, &mut work.noise);
    }
    let adjoints = Adjoints { knots: &work.adjoints, curvature: plan.curvature };
    system.contract(plan.trajectory.points(), phi, adjoints, &mut work.hessian, out, scratch);
    let states = &plan.trajectory.states;
    noise_model.add_gradient(phi, states, &work.noise, out);
    noise_model.add_state_gradient(phi, states, &work.noise, &mut work.hessian);
}

/// The direct dependence of the cost's parts on the noise: `1/2 sum S_{t+1}` by W, `1/2 S_0` by X_0.
fn add_direct_noise(plan: &Plan, functional: Functional, noise: &mut Noise) {
    let s = &plan.policy.curvature;
    let add = |to: &mut [f64], factor: f64, t: usize| {
        for (to, s) in to.iter_mut().zip(s.at(t)) {
            *to += 0.5 * factor * s;
        }
    };
    if functional.process != 0.0 {
        for t in 1..s.count() {
            add(noise.process.at_mut(t - 1), functional.process, t);
        }
    }
    if functional.initial != 0.0 {
        add(noise.initial.at_mut(0), functional.initial, 0);
    }
}

/// Gradients of the directed information by all parameters with the trajectory held fixed: through the sensors,
/// `C` and `V`, and through the propagation of uncertainty, `A`, `W` and `X_0` (theory, equation G.10).
pub(crate) fn information_at_rest(
    task: &Planned,
    work: &mut GradientWorkspace,
    scratch: &mut Scratch,
) -> [Vec<f64>; 2] {
    let &Planned { system, phi, noise_model, plan, belief, noise, .. } = task;
    let (points, states) = (plan.trajectory.points(), &plan.trajectory.states);
    noise_model.clear(&mut work.noise, plan.trajectory.steps());
    work.adjoints.has_cost = false;
    work.adjoints.measurement.clear();
    let seeds = BeliefSeeds { information: 1.0, ..BeliefSeeds::default() };
    reverse_kalman(&plan.knots, noise, belief, seeds, &mut work.belief, &mut work.adjoints, &mut work.noise);
    let (adjoints, by_noise) = (work.adjoints.clone(), work.noise.clone());
    [true, false].map(|sensors| {
        work.adjoints.clone_from(&adjoints);
        work.noise.clone_from(&by_noise);
        if sensors {
            work.adjoints.dynamics.clear();
            work.noise.process.clear();
            work.noise.initial.clear();
        } else {
            work.adjoints.measurement.clear();
            work.noise.measurement.clear();
        }
        let mut out = vec![0.0; phi.len()];
        let adjoints = Adjoints { knots: &work.adjoints, curvature: plan.curvature };
        system.contract(points, phi, adjoints, &mut work.hessian, &mut out, scratch);
        noise_model.add_gradient(phi, states, &work.noise, &mut out);
        out
    })
}
