//! Designs in scaled coordinates, and plans continued from one design to another.

use supple_kernels::Matrices;
use supple_model::Value;
use supple_model::parameters::{Parameters, Scale};

use crate::Error;
use crate::growth::explain;
use crate::pipeline::TaskState;
use crate::plan::{Asked, Held, Patience, Plan};
use crate::problem::Task;
use crate::settings::{PlanMode, PlanSettings};

/// The design parameters in the search's coordinates: each from 0 at its lower bound to 1 at its upper one, linear or
/// logarithmic.
#[derive(Clone, Debug)]
pub(crate) struct Scaling {
    /// Indices of the design parameters.
    pub indices: Vec<usize>,
    list: Vec<(Scale, [f64; 2])>,
}

impl Scaling {
    pub fn of(parameters: &Parameters) -> Self {
        let indices = parameters.design();
        let list = indices.iter().map(|&i| (parameters.get(i).scale, parameters.get(i).bounds)).collect();
        Self { indices, list }
    }

    /// Scaled coordinates of the design parameters in `phi`.
    pub fn scaled(&self, phi: &[f64]) -> Vec<f64> {
        let one = |(&index, &(scale, bounds)): (&usize, &(Scale, [f64; 2]))| scale.share(bounds, phi[index]);
        self.indices.iter().zip(&self.list).map(one).collect()
    }

    /// `phi` with the design parameters at scaled coordinates, clipped to their bounds.
    pub fn unscaled(&self, phi: &[f64], scaled: &[f64]) -> Vec<f64> {
        let mut phi = phi.to_vec();
        for ((&index, (scale, bounds)), &share) in self.indices.iter().zip(&self.list).zip(scaled) {
            phi[index] = scale.value(*bounds, share);
        }
        phi
    }

    /// A gradient with respect to the scaled coordinates, from one with respect to all parameters at `phi`.
    pub fn gradient(&self, phi: &[f64], by_parameter: &[f64]) -> Vec<f64> {
        let one = |(&index, &(scale, bounds)): (&usize, &(Scale, [f64; 2]))| {
            scale.slope(bounds, phi[index], by_parameter[index])
        };
        self.indices.iter().zip(&self.list).map(one).collect()
    }

    /// The slope at `phi` per whole segment between two points in scaled coordinates, from a gradient with
    /// respect to all parameters.
    pub fn slope_along(&self, start: &[f64], end: &[f64], phi: &[f64], by_parameter: &[f64]) -> f64 {
        let slopes = self.gradient(phi, by_parameter);
        slopes.iter().zip(start.iter().zip(end)).map(|(slope, (a, b))| slope * (b - a)).sum()
    }
}

/// The point at a fraction of the way from one to another, in scaled coordinates.
pub(crate) fn between(start: &[f64], end: &[f64], share: f64) -> Vec<f64> {
    start.iter().zip(end).map(|(a, b)| a + share * (b - a)).collect()
}

/// Continuation steps are at most this long in scaled coordinates, so that a plan stays on its branch.
const CONTINUATION_STEP: f64 = 0.04;

/// Tolerance of nominal plans without limits before the last one: close enough to their branch to start the next from.
const LOOSE: f64 = 1e-4;

/// What plans of problems that differ little start from.
#[derive(Clone, Debug)]
pub(crate) struct Neighbour {
    /// The controls of a plan.
    pub controls: Matrices,
    /// What it passes on if it is held at limits, where that is known.
    held: Option<Held>,
}

impl Neighbour {
    pub fn of(plan: &Plan) -> Self {
        Self { controls: plan.trajectory.controls.clone(), held: Held::of(plan) }
    }

    /// A plan of which only the controls are known.
    pub fn with(controls: &Matrices) -> Self {
        Self { controls: controls.clone(), held: None }
    }

    /// The same for the plan of each task.
    pub fn of_each(controls: &[Matrices]) -> Vec<Self> {
        controls.iter().map(Self::with).collect()
    }
}

/// A plan that could not be computed on the way to a design.
pub(crate) struct Failed {
    /// All parameters where it failed.
    phi: Vec<f64>,
    error: Error,
}

impl Failed {
    /// The reason, with advice if the time step is too large.
    pub fn explain(self, task: &Task, state: &TaskState) -> Error {
        explain(task, &self.phi, self.error, &state.plan.trajectory)
    }

    /// The reason, without the analysis that `explain` makes.
    pub fn error(self) -> Error {
        self.error
    }
}

/// The largest difference between two designs in any parameter, in scaled coordinates.
pub(crate) fn largest_difference(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// Whether two designs differ in noise alone, of which nominal plans know nothing.
fn is_of_noise(task: &Task, from: &[f64], to: &[f64]) -> bool {
    let depends = task.system.depends_on(from.len());
    let is_same = |value: &Value| value.resolve::<f64>(from) == value.resolve::<f64>(to);
    let limits = task.system.constraints();
    from.iter().zip(to).zip(depends).all(|((from, to), depends)| from == to || !depends)
        && task.initial_state.iter().all(is_same)
        && limits.is_none_or(|limits| limits.bounds(from) == limits.bounds(to))
}

/// The straight line from one design to another, along which plans of a task are continued.
pub(crate) struct Continuation<'a> {
    pub settings: &'a PlanSettings,
    pub task: &'a Task,
    pub scaling: &'a Scaling,
    /// Parameters of the first design.
    pub from: &'a [f64],
    /// Parameters of the second design.
    pub to: &'a [f64],
    /// By which factor steps are finer than the usual ones.
    pub finer: usize,
}

impl Continuation<'_> {
    /// Plans the task along the line, starting from a neighbour's plan and then from the plan before; the state is left
    /// at the second design, whose plan alone has the tolerance asked for.
    pub fn plan(&self, neighbour: &Neighbour, state: &mut TaskState) -> Result<(), Failed> {
        let &Self { settings, task, scaling, from, to, finer } = self;
        let (start, end) = (scaling.scaled(from), scaling.scaled(to));
        let steps = match settings.plan == PlanMode::Nominal && is_of_noise(task, from, to) {
            // The plan of the second design is that of the first.
            true => 1,
            false => (largest_difference(&start, &end) / CONTINUATION_STEP).ceil().max(1.0) as usize * finer,
        };
        // Limits, beliefs and risks have tolerances of their own, which follow from that of the plan.
        let is_plain = settings.plan == PlanMode::Nominal && task.system.constraints().is_none();
        let loose = settings.to_tolerance(if is_plain { settings.tolerance.max(LOOSE) } else { settings.tolerance });
        let mut before: Option<Neighbour> = None;
        for step in 1..=steps {
            let is_last = step == steps;
            let share = step as f64 / steps as f64;
            let phi = if is_last { to.to_vec() } else { scaling.unscaled(to, &between(&start, &end, share)) };
            let stage = if is_last { settings } else { &loose };
            let Neighbour { controls, held } = before.as_ref().unwrap_or(neighbour);
            let asked = Asked { held: held.as_ref(), ..Asked::of(stage, Patience::Full) };
            if let Err(error) = state.plan_with(task.at(&phi), asked, controls) {
                return Err(Failed { phi, error });
            }
            if let Err(error) = Error::check_stop() {
                return Err(Failed { phi, error });
            }
            before = (!is_last).then(|| Neighbour::of(&state.plan));
        }
        state.assess_with(task, to, settings).map_err(|error| Failed { phi: to.to_vec(), error })
    }
}
