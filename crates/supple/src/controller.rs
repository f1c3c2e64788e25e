//! The executable controller of a plan: a linear, time-varying filter and control law around the plan.

use supple_kernels::rows::dot;
use supple_kernels::{Matrices, Scratch};
use supple_lqg::ControlBounds;
use supple_lqg::Dimensions;
use supple_lqg::Knots;
use supple_lqg::Noise;
use supple_lqg::{Belief, kalman};
use supple_model::Trajectory;
use supple_model::system::Curvature;

use crate::Error;
use crate::knots::Linearise;
use crate::plan::Plan;
use crate::problem::Task;

/// The Kalman filter along a plan with its control law (theory, equation B.6); `n` states, `m` controls, `p` measurements,
/// `N` steps.
///
/// With `d`, the estimated deviation from the plan, which is 0 before the first measurement, each step is
///
/// ```text
/// d <- d + L_t (y_t - ybar_t - C_t d)     u_t = clip(ubar_t + k_t + K_t d)     d <- A_t d + B_t (u_t - ubar_t)
/// ```
///
/// The clip is its only nonlinearity. Roll-outs run an *extended* filter instead, which linearises at its estimates:
/// if the system is linear and its noise does not vary with the state, both give the same controls.
///
/// ```
/// use supple::Controller;
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
/// let controller = Controller::of(task, &phi, &state.plan)?;
///
/// // While the measurements are those of the plan, so are the controls.
/// let mut run = controller.start();
/// for t in 0..controller.steps() {
///     controller.step(&mut run, controller.expected.vector(t))?;
///     assert!((run.controls[0] - state.plan.trajectory.controls.vector(t)[0]).abs() < 1e-6);
/// }
/// assert!(!controller.step(&mut run, &[0.0])?, "the plan is over");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Controller {
    /// Lengths of state, control and measurement.
    pub dimensions: Dimensions,
    /// The plan: `xbar`, N + 1 of n, and `ubar`, N of m.
    pub trajectory: Trajectory,
    /// `ybar`, the measurements expected at the plan's states, N + 1 of p.
    pub expected: Matrices,
    /// Feedforward `k`, N of m.
    pub feedforward: Matrices,
    /// Feedback `K`, N of m x n.
    pub feedback: Matrices,
    /// `[A B]`, N of n x (n + m).
    pub dynamics: Matrices,
    /// `C`, N + 1 of p x n.
    pub measurement: Matrices,
    /// `X_0`, `W` and `V` along the plan.
    pub noise: Noise,
    /// `P`, covariances before each measurement, N + 1 of n x n.
    pub predicted: Matrices,
    /// `Sigma`, covariances after each measurement, N + 1 of n x n.
    pub corrected: Matrices,
    /// Kalman gains `L`, N + 1 of n x p.
    pub filter_gain: Matrices,
    /// Bounds that controls are clipped to; `None` if the task has none.
    pub bounds: Option<ControlBounds>,
}

/// The run-time state of a controller: what it carries from one step to the next.
///
/// Example: [`Controller`].
#[derive(Clone, Debug, PartialEq)]
pub struct ControllerRun {
    /// The step whose measurement comes next; N once the plan is over.
    pub step: usize,
    /// The state at the last measurement, estimated with that measurement, n; before the first one, the plan's first state.
    pub estimate: Vec<f64>,
    /// The controls of the last step, m; zeros before the first one.
    pub controls: Vec<f64>,
    /// `d` as predicted for the next measurement, n.
    deviation: Vec<f64>,
    /// `d` after the measurement, n.
    corrected: Vec<f64>,
    /// `y - ybar - C d`, p.
    innovation: Vec<f64>,
}

impl Controller {
    /// The controller of a task's plan at the parameters `phi`.
    ///
    /// # Errors
    /// Where the linearisation is not finite or a covariance is indefinite.
    pub fn of(task: &Task, phi: &[f64], plan: &Plan) -> Result<Self, Error> {
        let (feedforward, feedback) = (plan.policy.feedforward.clone(), plan.policy.feedback.clone());
        Self::along(task, phi, plan.trajectory.clone(), feedforward, feedback)
    }

    /// The controller of a trajectory with a control law: feedforward `k`, N of m, and feedback `K`, N of m x n.
    ///
    /// # Errors
    /// If a length does not match the task, the linearisation is not finite, or a covariance is indefinite.
    pub fn along(
        task: &Task,
        phi: &[f64],
        trajectory: Trajectory,
        feedforward: Matrices,
        feedback: Matrices,
    ) -> Result<Self, Error> {
        let dimensions = task.system.dimensions();
        let Dimensions { states: n, controls: m, measurements: p, .. } = dimensions;
        let steps = task.steps;
        let shapes = [
            ("the list of states", &trajectory.states, (steps + 1, 1, n)),
            ("the list of controls", &trajectory.controls, (steps, 1, m)),
            ("the feedforward", &feedforward, (steps, 1, m)),
            ("the feedback", &feedback, (steps, m, n)),
        ];
        for (what, found, (count, rows, cols)) in shapes {
            let what = |part: &str| format!("{part}{what} of a controller of task `{}`", task.name);
            check(&what(""), found.count(), count)?;
            check(&what("a column in "), found.rows(), rows)?;
            check(&what("a row in "), found.cols(), cols)?;
        }
        let (system, mut scratch) = (&*task.system, Scratch::new());
        let mut knots = Knots::zeros(dimensions, steps);
        knots.linearise_plan(system, trajectory.points(), phi, Curvature::GaussNewton, &mut scratch);
        knots.linearise_measurement(system, trajectory.points(), phi, &mut scratch);
        knots.check_finite()?;
        let mut noise = Noise::zeros(n, p);
        task.noise.resolve_along(phi, &trajectory.states, &mut noise)?;
        let mut belief = Belief::zeros(n, p, steps);
        kalman(&knots, &noise, &mut belief)?;
        let mut expected = Matrices::vectors(steps + 1, p);
        for t in 0..=steps {
            system.observe(t, trajectory.states.vector(t), phi, expected.vector_mut(t));
        }
        let mut filter_gain = Matrices::zeros(steps + 1, n, p);
        for (t, i, j) in (0..=steps).flat_map(|t| (0..n).flat_map(move |i| (0..p).map(move |j| (t, i, j)))) {
            filter_gain.set(t, i, j, belief.gain_transposed.get(t, j, i));
        }
        let Knots { dynamics, measurement, .. } = knots;
        let Belief { predicted, corrected, .. } = belief;
        let bounds = task.control_bounds.clone();
        Ok(Self {
            dimensions,
            trajectory,
            expected,
            feedforward,
            feedback,
            dynamics,
            measurement,
            noise,
            predicted,
            corrected,
            filter_gain,
            bounds,
        })
    }

    /// How many steps it runs, N.
    #[must_use]
    pub fn steps(&self) -> usize {
        self.trajectory.steps()
    }

    /// A new run, before its first measurement.
    #[must_use]
    pub fn start(&self) -> ControllerRun {
        let Dimensions { states, controls, measurements, .. } = self.dimensions;
        ControllerRun {
            step: 0,
            estimate: self.trajectory.states.vector(0).to_vec(),
            controls: vec![0.0; controls],
            deviation: vec![0.0; states],
            corrected: vec![0.0; states],
            innovation: vec![0.0; measurements],
        }
    }

    /// Takes in the measurement `y` of the next step, p numbers, and computes the step's controls; allocates nothing.
    ///
    /// After N steps the plan is over: the method then returns `false` and changes nothing.
    ///
    /// # Errors
    /// If `y` has the wrong length or is not finite; the run is then unchanged.
    pub fn step(&self, run: &mut ControllerRun, y: &[f64]) -> Result<bool, Error> {
        let p = self.dimensions.measurements;
        if y.len() != p {
            check("the measurement", y.len(), p)?;
        }
        let t = run.step;
        if y.iter().any(|y| !y.is_finite()) {
            return Err(Error::not_finite("the measurement", t));
        }
        if t >= self.steps() {
            return Ok(false);
        }
        let ControllerRun { step, estimate, controls, deviation, corrected, innovation } = run;
        self.correct(t, y, deviation, innovation, corrected);
        let xbar = self.trajectory.states.vector(t);
        estimate.iter_mut().zip(xbar).zip(&*corrected).for_each(|((x, xbar), d)| *x = xbar + d);
        let (ubar, feedforward) = (self.trajectory.controls.vector(t), self.feedforward.vector(t));
        for (a, u) in controls.iter_mut().enumerate() {
            *u = ubar[a] + feedforward[a] + dot(row(&self.feedback, t, a), corrected);
        }
        if let Some(bounds) = &self.bounds {
            bounds.clamp(controls);
        }
        self.predict(t, corrected, controls, deviation);
        *step += 1;
        Ok(true)
    }

    /// Computes `d` after the measurement of step `t` from `d` before it; `innovation` receives `y - ybar - C d`.
    pub(crate) fn correct(&self, t: usize, y: &[f64], before: &[f64], innovation: &mut [f64], corrected: &mut [f64]) {
        let ybar = self.expected.vector(t);
        for (i, innovation) in innovation.iter_mut().enumerate() {
            *innovation = y[i] - ybar[i] - dot(row(&self.measurement, t, i), before);
        }
        for (i, corrected) in corrected.iter_mut().enumerate() {
            *corrected = before[i] + dot(row(&self.filter_gain, t, i), innovation);
        }
    }

    /// Predicts `d` before the next measurement from `d` at step `t` under the controls `u`.
    pub(crate) fn predict(&self, t: usize, corrected: &[f64], u: &[f64], next: &mut [f64]) {
        let ubar = self.trajectory.controls.vector(t);
        for (i, next) in next.iter_mut().enumerate() {
            let (a, b) = row(&self.dynamics, t, i).split_at(self.dimensions.states);
            *next = dot(a, corrected) + b.iter().zip(u).zip(ubar).map(|((b, u), ubar)| b * (u - ubar)).sum::<f64>();
        }
    }
}

fn check(what: &str, found: usize, expected: usize) -> Result<(), Error> {
    if found == expected { Ok(()) } else { Err(Error::shape(what.to_owned(), found, expected)) }
}

/// Row `i` of matrix `t`, without padding.
fn row(matrices: &Matrices, t: usize, i: usize) -> &[f64] {
    &matrices.at(t)[i * matrices.stride()..][..matrices.cols()]
}
