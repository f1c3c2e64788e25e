//! The linearisation of a task along its plan, as plain arrays.

use serde::Serialize;
use supple_kernels::Matrices;

use crate::Error;
use crate::branches::{Attempts, plan_at};
use crate::pipeline::TaskState;
use crate::plan::PlanStatus;
use crate::problem::Problem;

/// A matrix as its rows.
///
/// Example: [`Linearisation`].
pub type Rows = Vec<Vec<f64>>;

/// A task along its plan: `dx+ = A dx + B du + w`, `dy = C dx + v`, the quadratic model of its costs, and the law
/// `du = K dx` that minimises them; `n` states, `m` controls, `p` measurements, `N` steps.
///
/// ```
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
/// let found = problem.linearise(&problem.parameters.initial(), "balance")?;
/// assert_eq!((found.dynamics.len(), found.states.len()), (50, 51));
/// assert_eq!(found.dynamics[0], [[1.0, 0.1], [0.1, 1.0]]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, Serialize)]
#[non_exhaustive]
pub struct Linearisation {
    /// How the plan ended.
    pub status: PlanStatus,
    /// Length of a step, s.
    pub time_step: f64,
    /// States of the plan, N + 1 of n.
    pub states: Rows,
    /// Its controls, N of m.
    pub controls: Rows,
    /// `A = f_x`, N of n x n.
    pub dynamics: Vec<Rows>,
    /// `B = f_u`, N of n x m.
    pub input: Vec<Rows>,
    /// `C = g_x`, N + 1 of p x n.
    pub measurement: Vec<Rows>,
    /// Second derivatives of the costs by state and control, N + 1 of (n + m) x (n + m); the last has no control.
    pub cost_hessian: Vec<Rows>,
    /// First derivatives of the costs by state and control, N + 1 of n + m.
    pub cost_gradient: Rows,
    /// `X_0`, n x n.
    pub initial_covariance: Rows,
    /// `W`, N of n x n.
    pub process_covariance: Vec<Rows>,
    /// `V`, N + 1 of p x p.
    pub measurement_covariance: Vec<Rows>,
    /// `K`, N of m x n.
    pub feedback: Vec<Rows>,
    /// `S`, the curvature of the cost-to-go, N + 1 of n x n.
    pub cost_to_go: Vec<Rows>,
    /// `Sigma`, the covariance of the belief after each measurement, N + 1 of n x n.
    pub belief_covariance: Vec<Rows>,
}

/// The columns `cols` of the first `count` matrices of a sequence.
fn rows_of(matrices: &Matrices, count: usize, cols: std::ops::Range<usize>) -> Vec<Rows> {
    let row = |t: usize, i: usize| cols.clone().map(|j| matrices.get(t, i, j)).collect();
    (0..count).map(|t| (0..matrices.rows()).map(|i| row(t, i)).collect()).collect()
}

impl Problem {
    /// The linearisation of the named task along its plan at a design.
    ///
    /// # Errors
    /// Where there is no task of this name, or the design cannot be evaluated.
    pub fn linearise(&self, phi: &[f64], name: &str) -> Result<Linearisation, Error> {
        self.check_design(phi)?;
        let task = self.task(name)?;
        let mut state = TaskState::new(task);
        plan_at(self, task, phi, None, Attempts::default(), &mut state)?;
        let TaskState { plan, noise, belief, .. } = &state;
        let (n, joint, p) = (plan.knots.dimensions.states, plan.knots.dimensions.joint(), noise.measurement.rows());
        let (steps, knots) = (task.steps, &plan.knots);
        let gradient = rows_of(&knots.cost, steps + 1, joint..joint + 1);
        Ok(Linearisation {
            status: plan.status,
            time_step: task.time_step.resolve(phi),
            states: plan.trajectory.states.to_rows(),
            controls: plan.trajectory.controls.to_rows(),
            dynamics: rows_of(&knots.dynamics, steps, 0..n),
            input: rows_of(&knots.dynamics, steps, n..joint),
            measurement: rows_of(&knots.measurement, steps + 1, 0..n),
            cost_hessian: rows_of(&knots.cost, steps + 1, 0..joint),
            cost_gradient: gradient.into_iter().map(|rows| rows.into_iter().flatten().collect()).collect(),
            initial_covariance: rows_of(&noise.initial, 1, 0..n).remove(0),
            process_covariance: rows_of(&noise.process, steps, 0..n),
            measurement_covariance: rows_of(&noise.measurement, steps + 1, 0..p),
            feedback: rows_of(&plan.policy.feedback, steps, 0..n),
            cost_to_go: rows_of(&plan.policy.curvature, steps + 1, 0..n),
            belief_covariance: rows_of(&belief.corrected, steps + 1, 0..n),
        })
    }
}
