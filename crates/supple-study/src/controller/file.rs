use serde::Serialize;
use supple::plan::PlanStatus;
use supple::{Channel, Matrices, Named, Rows, time_of};

use super::exported::ExportedController;

/// What `format` says in the files of controllers.
///
/// Example: the [module](crate::controller).
pub const CONTROLLER_FORMAT: &str = "supple-controller";
/// The version of their keys; it grows where a key changes its meaning.
pub const CONTROLLER_VERSION: u32 = 1;

/// A controller as plain arrays, under the names that JSON, NumPy and Python have for them; `n` states, `m` controls, `p`
/// measurements, `N` steps.
///
/// Example: the [module](crate::controller).
#[derive(Clone, Debug, Serialize)]
#[non_exhaustive]
pub struct ControllerFile {
    /// [`CONTROLLER_FORMAT`].
    pub format: &'static str,
    /// [`CONTROLLER_VERSION`].
    pub version: u32,
    /// Version of supple.
    pub supple: &'static str,
    /// Name of the task.
    pub task: String,
    /// How its plan ended; the controller is only useful if it `converged`.
    pub status: PlanStatus,
    /// All parameters of the design.
    pub parameters: Named,
    /// Time step, s.
    pub time_step: f64,
    /// N.
    pub steps: usize,
    /// Time of each state, s, N + 1.
    pub time: Vec<f64>,
    /// Names of the states.
    pub state_names: Vec<String>,
    /// Their units; empty where they are not known.
    pub state_units: Vec<String>,
    /// Names of the controls.
    pub control_names: Vec<String>,
    /// Their units.
    pub control_units: Vec<String>,
    /// Names of the measurements.
    pub measurement_names: Vec<String>,
    /// Their units.
    pub measurement_units: Vec<String>,
    /// `xbar`, N + 1 of n.
    pub states: Rows,
    /// `ubar`, N of m.
    pub controls: Rows,
    /// `ybar`, N + 1 of p.
    pub expected_measurements: Rows,
    /// `k`, N of m.
    pub feedforward: Rows,
    /// `K`, N of m x n.
    pub feedback: Vec<Rows>,
    /// `L`, N + 1 of n x p.
    pub filter_gain: Vec<Rows>,
    /// `A`, N of n x n.
    pub dynamics: Vec<Rows>,
    /// `B`, N of n x m.
    pub input: Vec<Rows>,
    /// `C`, N + 1 of p x n.
    pub measurement: Vec<Rows>,
    /// `X_0`, n x n.
    pub initial_covariance: Rows,
    /// `W`, N of n x n.
    pub process_covariance: Vec<Rows>,
    /// `V`, N + 1 of p x p.
    pub measurement_covariance: Vec<Rows>,
    /// `P`, before each measurement, N + 1 of n x n.
    pub predicted_covariance: Vec<Rows>,
    /// `Sigma`, after each measurement, N + 1 of n x n.
    pub belief_covariance: Vec<Rows>,
    /// The least controls, m; negative infinity where there is no bound, in JSON `null`.
    pub control_lower: Vec<f64>,
    /// The greatest controls, m; infinity where there is no bound, in JSON `null`.
    pub control_upper: Vec<f64>,
}

impl ControllerFile {
    /// Of a controller.
    #[must_use]
    pub fn of(exported: &ExportedController) -> Self {
        let ExportedController { controller, task, status, parameters, time_step, channels, .. } = exported;
        let steps = controller.steps();
        let (n, m) = (controller.dimensions.states, controller.dimensions.controls);
        let whole = |matrices: &Matrices, count: usize| columns(matrices, count, 0..matrices.cols());
        let (state_names, state_units) = split(&channels.states);
        let (control_names, control_units) = split(&channels.controls);
        let (measurement_names, measurement_units) = split(&channels.measurements);
        let bounds = controller.bounds.as_ref();
        Self {
            format: CONTROLLER_FORMAT,
            version: CONTROLLER_VERSION,
            supple: env!("CARGO_PKG_VERSION"),
            task: task.name.clone(),
            status: *status,
            parameters: parameters.clone(),
            time_step: *time_step,
            steps,
            time: (0..=steps).map(|t| time_of(t, *time_step)).collect(),
            state_names,
            state_units,
            control_names,
            control_units,
            measurement_names,
            measurement_units,
            states: controller.trajectory.states.to_rows(),
            controls: controller.trajectory.controls.to_rows(),
            expected_measurements: controller.expected.to_rows(),
            feedforward: controller.feedforward.to_rows(),
            feedback: whole(&controller.feedback, steps),
            filter_gain: whole(&controller.filter_gain, steps + 1),
            dynamics: columns(&controller.dynamics, steps, 0..n),
            input: columns(&controller.dynamics, steps, n..n + m),
            measurement: whole(&controller.measurement, steps + 1),
            initial_covariance: whole(&controller.noise.initial, 1).remove(0),
            process_covariance: whole(&controller.noise.process, steps),
            measurement_covariance: whole(&controller.noise.measurement, steps + 1),
            predicted_covariance: whole(&controller.predicted, steps + 1),
            belief_covariance: whole(&controller.corrected, steps + 1),
            control_lower: bounds.map_or_else(|| vec![f64::NEG_INFINITY; m], |bounds| bounds.lower().to_vec()),
            control_upper: bounds.map_or_else(|| vec![f64::INFINITY; m], |bounds| bounds.upper().to_vec()),
        }
    }
}

/// Names and units of channels.
fn split(channels: &[Channel]) -> (Vec<String>, Vec<String>) {
    channels.iter().map(|channel| (channel.name.clone(), channel.unit.clone())).unzip()
}

/// Columns of `count` matrices of a sequence, row by row.
pub(super) fn columns(matrices: &Matrices, count: usize, cols: std::ops::Range<usize>) -> Vec<Rows> {
    let row = |t: usize, i: usize| cols.clone().map(|j| matrices.get(t, i, j)).collect();
    (0..count).map(|t| (0..matrices.rows()).map(|i| row(t, i)).collect()).collect()
}
