//! Knots of a system along a trajectory.

use supple_kernels::Scratch;
use supple_lqg::Knots;

use supple_model::system::{Curvature, Points, System};

/// Fills knots from a system at all points of a trajectory.
///
/// ```
/// use supple::lqg::Knots;
/// use supple::system::Curvature;
/// use supple::{Linearise, Scratch, Trajectory};
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
/// let size = task.system.dimensions();
/// let (rest, mut knots) = (Trajectory::zeros(size, task.steps), Knots::zeros(size, task.steps));
/// knots.linearise_plan(&*task.system, rest.points(), &phi, Curvature::Exact, &mut Scratch::new());
/// assert_eq!(knots.dynamics.get(0, 1, 2), 0.1);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub trait Linearise {
    /// Fills the knots at all points of a trajectory: dynamics and cost for the plan.
    fn linearise_plan(
        &mut self,
        system: &dyn System,
        at: Points,
        phi: &[f64],
        curvature: Curvature,
        scratch: &mut Scratch,
    );

    /// Fills `C` at all points of a trajectory.
    fn linearise_measurement(&mut self, system: &dyn System, at: Points, phi: &[f64], scratch: &mut Scratch);
}

impl Linearise for Knots {
    fn linearise_plan(
        &mut self,
        system: &dyn System,
        at: Points,
        phi: &[f64],
        curvature: Curvature,
        scratch: &mut Scratch,
    ) {
        system.dynamics_jacobians(at, phi, &mut self.dynamics, scratch);
        system.cost_quadratics(at, phi, curvature, &mut self.cost, scratch);
    }

    fn linearise_measurement(&mut self, system: &dyn System, at: Points, phi: &[f64], scratch: &mut Scratch) {
        system.measurement_jacobians(at, phi, &mut self.measurement, scratch);
        let picks = system.picks();
        if self.picks.as_deref() != picks {
            self.picks = picks.map(<[usize]>::to_vec);
        }
    }
}
