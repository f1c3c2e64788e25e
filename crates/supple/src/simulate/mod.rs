//! Closed-loop simulation: roll-outs with noise and an extended Kalman filter in the loop.

use supple_lqg::Noise;

use crate::Error;
use crate::controller::Controller;
use crate::plan::Plan;
use crate::problem::Task;

mod along_plan;
mod closed_loop;
mod ekf;
mod factors;
mod filter;
mod finer;
mod outcome;
mod sample;
mod setting;
mod statistics;
mod student;
mod truth;
mod watch;

pub use closed_loop::Rollouts;
pub(crate) use closed_loop::{BATCH, ClosedLoop, Record, in_batches};
pub use ekf::FilterBatch;
pub(crate) use factors::NoiseFactors;
pub(crate) use finer::on_finer_steps;
pub use sample::{Sample, SampleId, sample, sample_number};
pub(crate) use setting::LoopSetting;
pub use statistics::{Consistency, Estimate, FinerSteps, MonteCarlo, TouchShare};
pub use student::{half_width_95, student_quantile, student_tails};
pub(crate) use truth::{Motion, Truth};
pub use truth::{Plant, World};
pub use watch::LimitShare;
pub(crate) use watch::Watch;

/// What the filter of a closed loop assumes, and what its plant is.
///
/// Example: [`monte_carlo`].
#[derive(Clone, Copy)]
pub struct Worlds<'a> {
    /// Parameters and noise that the filter assumes.
    pub believed: World<'a>,
    /// Those of the plant.
    pub truth: World<'a>,
}

impl<'a> Worlds<'a> {
    /// A filter that assumes what is true.
    #[must_use]
    pub fn same(world: World<'a>) -> Self {
        Self { believed: world, truth: world }
    }
}

/// Rolls a plan out in closed loop with an extended Kalman filter, on all threads.
///
/// Sample i draws from stream i of the seed: the same seed gives the same bits on any number of threads.
///
/// # Errors
/// Where a covariance is indefinite.
///
/// ```
/// use supple::pipeline::TaskState;
/// use supple::simulate::{Rollouts, SampleId, World, Worlds};
/// use supple::simulate::{monte_carlo, sample, sample_number, sampled_costs};
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
/// let (rollouts, expected) = (Rollouts { count: 200, seed: 1 }, state.cost.expected());
/// let found = monte_carlo(task, &phi, &state.plan, &state.noise, expected, rollouts)?;
/// assert!((found.cost_mean / expected - 1.0).abs() < 0.1);
/// assert!(found.consistency.is_some_and(|consistency| (consistency.mean - 1.0).abs() < 0.1));
/// assert!(found.realised_bits.is_some_and(|bits| bits.mean > 0.0));
///
/// // The first run by itself, and the costs of all.
/// let run = sample(task, &phi, &state.plan, &state.noise, 1)?;
/// let first = SampleId { seed: 1, number: 0 };
/// assert_eq!(sample_number(task, &phi, &state.plan, &state.noise, first)?, run);
/// let worlds = Worlds::same(World { phi: &phi, noise: &state.noise });
/// assert_eq!(sampled_costs(task, &state.plan, worlds, rollouts)?.len(), 200);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn monte_carlo(
    task: &Task,
    phi: &[f64],
    plan: &Plan,
    noise: &Noise,
    predicted: f64,
    rollouts: Rollouts,
) -> Result<MonteCarlo, Error> {
    sampled(task, plan, None, World { phi, noise }, predicted, rollouts)
}

/// Costs of roll-outs of a plan whose filter assumes one world while another one is true; infinite where they
/// diverge. The same samples for every plan, design and world: sample i draws from stream i of the seed.
///
/// # Errors
/// Where a covariance is indefinite.
///
/// Example: [`monte_carlo`].
pub fn sampled_costs(task: &Task, plan: &Plan, worlds: Worlds, rollouts: Rollouts) -> Result<Vec<f64>, Error> {
    let Worlds { believed, truth } = worlds;
    let factors = NoiseFactors::of(&*truth.fixed_noise(task)?)?;
    let noise = believed.fixed_noise(task)?;
    let believed = World { phi: believed.phi, noise: &noise };
    let truth = Truth::of(task, truth.phi);
    let setting = LoopSetting { task, plan, believed, truth, factors: &factors, along: None, watch: None };
    let costs = |closed: ClosedLoop| closed.outcomes.into_iter().map(|outcome| outcome.cost).collect::<Vec<_>>();
    Ok(in_batches(setting, rollouts, BATCH, costs)?.concat())
}

/// Roll-outs in the world that the filter assumes: with the extended filter, or with a controller's.
fn sampled(
    task: &Task,
    plan: &Plan,
    along: Option<&Controller>,
    world: World,
    predicted: f64,
    rollouts: Rollouts,
) -> Result<MonteCarlo, Error> {
    let noise = world.fixed_noise(task)?;
    let believed = World { phi: world.phi, noise: &noise };
    let factors = NoiseFactors::of(&noise)?;
    let truth = Truth::of(task, world.phi);
    let watch = Watch::of(task.at(world.phi), &plan.trajectory);
    let setting = LoopSetting { task, plan, believed, truth, factors: &factors, along, watch: Some(&watch) };
    let outcomes = in_batches(setting, rollouts, BATCH, |closed| closed.outcomes)?.concat();
    Ok(MonteCarlo::of(setting, outcomes, predicted, rollouts.seed))
}
