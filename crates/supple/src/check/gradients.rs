//! Gradients of information and cost with respect to the parameters, compared with finite differences.

use rayon::prelude::*;
use supple_kernels::{Matrices, Scratch};
use supple_lqg::Knots;
use supple_lqg::Noise;
use supple_lqg::control_information;
use supple_lqg::{Belief, kalman};
use supple_lqg::{Information, information};
use supple_model::parameters::Parameters;
use supple_model::system::Curvature;

use super::compare::Row;
use super::differences::{Difference, Differencing, OTHER_STEPS, differentiate, noise};
use super::parameters::{parameter_row, size_of};
use crate::Error;

use crate::aims::weighted_information;
use crate::gradient::{FrozenGradient, Functional};
use crate::knots::Linearise;
use crate::pipeline::TaskState;
use crate::plan::PlanSettings;
use crate::problem::{Problem, Task, TaskAt};
use crate::settings::InformationWeights;

const TOLERANCE: f64 = 1e-5;

/// Steps are shortened until a difference has this relative accuracy.
const GOAL: f64 = 1e-6;

/// The longest step of a parameter, relative to its size, with the plan held fixed and with a new plan at each point.
const LONGEST: f64 = 1e-2;
const LONGEST_PLANNED: f64 = 2e-3;

/// A gradient with respect to all parameters, and its finite differences.
///
/// Example: [`compare_gradients`].
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct ComparedGradient {
    /// The quantity whose gradient it is, and the kind of gradient.
    pub name: String,
    /// The gradient.
    pub analytic: Vec<f64>,
    /// Its finite differences; `None` if no point near the design could be evaluated.
    pub numeric: Vec<Option<Difference>>,
}

impl ComparedGradient {
    /// The comparison, in which every parameter has its own scale.
    #[must_use]
    pub fn row(&self, parameters: &Parameters) -> Row {
        parameter_row(&self.name, TOLERANCE, parameters, &self.analytic, &self.numeric)
    }
}

/// The gradients of a task at a plan, and the points near it that could not be evaluated.
///
/// Example: [`compare_gradients`].
#[derive(Clone, Debug, Default)]
#[non_exhaustive]
pub struct ComparedGradients {
    /// Frozen gradients and, where the plan has them, total ones.
    pub gradients: Vec<ComparedGradient>,
    /// Points that were left out of the differences, and why.
    pub left_out: Vec<String>,
}

/// The frozen and total gradients of a task, at the plan in `state`, compared with finite differences.
///
/// # Errors
/// Where a gradient does not exist.
///
/// ```
/// use supple::check::{compare_gradients, plan_for_check};
/// use supple::pipeline::TaskState;
/// # let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tasks/two_mass.toml");
/// let problem = supple_file::load(file)?;
/// let (task, phi) = (&problem.tasks[0], problem.parameters.initial());
/// let mut state = TaskState::new(task);
/// plan_for_check(&problem, task, &phi, &mut state)?;
/// let found = compare_gradients(&problem, task, &phi, &mut state)?;
/// for gradient in &found.gradients {
///     assert!(gradient.row(&problem.parameters).passed, "{}", gradient.name);
///     assert!(gradient.numeric.iter().flatten().all(|difference| difference.value.is_finite()));
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn compare_gradients(
    problem: &Problem,
    task: &Task,
    phi: &[f64],
    state: &mut TaskState,
) -> Result<ComparedGradients, Error> {
    if phi.is_empty() {
        return Ok(ComparedGradients::default());
    }
    let mut found = ComparedGradients::over(1.0, problem, task, phi, state)?;
    for lengthened in OTHER_STEPS {
        if found.gradients.iter().all(|gradient| gradient.row(&problem.parameters).passed) {
            break;
        }
        let again = ComparedGradients::over(lengthened, problem, task, phi, state)?;
        for (gradient, again) in found.gradients.iter_mut().zip(again.gradients) {
            if !gradient.row(&problem.parameters).passed && again.row(&problem.parameters).passed {
                *gradient = again;
            }
        }
    }
    Ok(found)
}

/// Differences of several values by one parameter, and the points that could not be evaluated.
type ByParameter = (Option<Vec<Difference>>, Vec<String>);

impl ComparedGradients {
    /// All gradients, with this factor on the longest steps of the differences.
    fn over(
        lengthened: f64,
        problem: &Problem,
        task: &Task,
        phi: &[f64],
        state: &mut TaskState,
    ) -> Result<Self, Error> {
        let mut found = Self::default();
        found.frozen(problem, task.at(phi), lengthened * LONGEST, state);
        if state.plan.mode.has_total_gradient() {
            found.total(problem, task.at(phi), lengthened * LONGEST_PLANNED, state)?;
        }
        Ok(found)
    }

    /// Appends gradients with their differences by each parameter.
    fn take(&mut self, gradients: Vec<(String, Vec<f64>)>, differences: Vec<ByParameter>) {
        for (index, (name, analytic)) in gradients.into_iter().enumerate() {
            let of = |(found, _): &ByParameter| found.as_ref().map(|found| found[index]);
            self.gradients.push(ComparedGradient { name, analytic, numeric: differences.iter().map(of).collect() });
        }
        self.left_out.extend(differences.into_iter().flat_map(|(_, left_out)| left_out));
    }

    /// Appends frozen gradients: trajectory, gains and value of information held fixed.
    fn frozen(&mut self, problem: &Problem, TaskAt { task, phi }: TaskAt, longest: f64, state: &mut TaskState) {
        let mut analytic = FrozenGradient::default();
        state.frozen_gradient(task, phi, &mut analytic);
        let state = &*state;
        let differences = differences(problem, phi, longest, || {
            let mut scratch = Scratch::new();
            move |phi: &[f64]| frozen_values(task, phi, state, &mut scratch).map_err(|error| error.to_string())
        });
        let gradients = [("information", analytic.information), ("belief cost", analytic.belief_cost)];
        let named = gradients.map(|(name, gradient)| (format!("frozen gradient, {name}"), gradient));
        self.take(named.into(), differences);
    }

    /// Appends total gradients: everything varies, and at every step the plan is recomputed from the same start.
    fn total(
        &mut self,
        problem: &Problem,
        TaskAt { task, phi }: TaskAt,
        longest: f64,
        state: &mut TaskState,
    ) -> Result<(), Error> {
        let named = [
            ("information", Some(Functional::INFORMATION)),
            ("belief cost", Some(Functional::BELIEF)),
            ("process cost", Some(Functional::PROCESS)),
            ("initial cost", Some(Functional::INITIAL)),
            ("nominal cost", None),
        ];
        let mut gradients = Vec::new();
        for (name, functional) in named {
            let mut out = Vec::new();
            match functional {
                Some(functional) => state.total_gradient(task, phi, functional, &mut out)?,
                None => state.nominal_gradient(task, phi, &mut out)?,
            }
            gradients.push((format!("total gradient, {name}"), out));
        }
        let mut used = Vec::new();
        weighted_information(task, phi, InformationWeights::USED, state, &mut used)?;
        gradients.push(("total gradient, information used".to_owned(), used));
        let controls = state.plan.trajectory.controls.clone();
        let planning = tight(&problem.planning);
        let differences = differences(problem, phi, longest, || {
            let mut again = TaskState::new(task);
            let (controls, planning) = (&controls, &planning);
            move |phi: &[f64]| planned_values(task.at(phi), planning, controls, &mut again)
        });
        self.take(gradients, differences);
        Ok(())
    }
}

/// Settings that make plans precise enough for finite differences.
pub(super) fn tight(planning: &PlanSettings) -> PlanSettings {
    let tolerance = planning.tolerance.min(PlanSettings::default().tolerance);
    PlanSettings { tolerance, ..planning.clone() }
}

/// Finite differences with respect to each parameter of a function that each thread creates for itself.
fn differences<F: FnMut(&[f64]) -> Result<Vec<f64>, String>>(
    problem: &Problem,
    phi: &[f64],
    longest: f64,
    make: impl Fn() -> F + Sync + Send,
) -> Vec<ByParameter> {
    let sizes: Vec<f64> = (0..phi.len()).map(|index| size_of(&problem.parameters, phi, index)).collect();
    let mut at = make();
    // Move all parameters at once: the noise does not depend on which one moves.
    let noise = noise(longest, &mut |h| {
        let phi: Vec<f64> = phi.iter().zip(&sizes).map(|(phi, size)| phi + h * size).collect();
        at(&phi).ok()
    });
    let of = |at: &mut F, index: usize| {
        let name = &problem.parameters.get(index).name;
        let mut left_out = Vec::new();
        let how = Differencing { step: longest * sizes[index], goal: GOAL, noise: noise.as_deref(), block: 1 };
        let found = differentiate(how, |h| {
            let mut phi = phi.to_vec();
            phi[index] += h;
            at(&phi).map_err(|why| left_out.push(format!("{name} = {}: {why}", phi[index]))).ok()
        });
        (found, left_out)
    };
    (0..phi.len()).into_par_iter().map_init(make, of).collect()
}

/// Information and belief cost along a plan that is held fixed.
fn frozen_values(task: &Task, phi: &[f64], state: &TaskState, scratch: &mut Scratch) -> Result<Vec<f64>, Error> {
    let size = task.system.dimensions();
    let mut noise = Noise::zeros(size.states, size.measurements);
    task.noise.resolve_along(phi, &state.plan.trajectory.states, &mut noise)?;
    let mut knots = Knots::zeros(size, task.steps);
    let points = state.plan.trajectory.points();
    knots.linearise_plan(&*task.system, points, phi, Curvature::Exact, scratch);
    knots.linearise_measurement(&*task.system, points, phi, scratch);
    let mut belief = Belief::zeros(size.states, size.measurements, task.steps);
    kalman(&knots, &noise, &mut belief)?;
    let mut found = Information::default();
    information(&belief, &noise, &mut found)?;
    let xi = &state.plan.policy.value_of_information;
    let traces = (0..task.steps).map(|t| xi.at(t).iter().zip(belief.corrected.at(t)).map(|(a, b)| a * b).sum::<f64>());
    Ok(vec![found.total, 0.5 * traces.sum::<f64>()])
}

/// Information and the parts of the cost at a design, after planning it again from given controls.
fn planned_values(
    TaskAt { task, phi }: TaskAt,
    planning: &PlanSettings,
    controls: &Matrices,
    state: &mut TaskState,
) -> Result<Vec<f64>, String> {
    state.evaluate(task, phi, planning, Some(controls)).map_err(|error| error.to_string())?;
    if !state.plan.status.is_converged() {
        return Err(format!("the plan ended as {} after {} iterations", state.plan.status, state.plan.iterations));
    }
    let cost = &state.cost;
    let TaskState { plan, belief, noise, .. } = &*state;
    let used = control_information(&plan.knots, &plan.policy, belief, noise).map_err(|error| error.to_string())?;
    let used = used.iter().sum();
    Ok(vec![state.information.total, cost.belief, cost.process, cost.initial, cost.nominal, used])
}
