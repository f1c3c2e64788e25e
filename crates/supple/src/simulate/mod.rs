//! Closed-loop simulation: roll-outs with noise and an extended Kalman filter in the loop.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use supple_kernels::{Matrices, Scratch, halt};
use supple_lqg::{Dimensions, Noise};
use supple_model::noise::VaryingNoise;
use supple_model::system::{Points, Times};
use supple_model::{Trajectory, or_nan};

use crate::controller::Controller;

use crate::Error;
use crate::plan::Plan;
use crate::problem::Task;

mod along_plan;
mod ekf;
mod factors;
mod filter;
mod finer;
mod sample;
mod statistics;
mod student;
mod truth;
mod watch;

use ekf::ExtendedKalman;
pub use ekf::FilterBatch;
pub(crate) use factors::NoiseFactors;
use filter::Filter;
use finer::PARTS;
pub(crate) use finer::on_finer_steps;
pub use sample::{sample, sample_number};
pub(crate) use statistics::Outcome;
pub use statistics::{Consistency, Estimate, FinerSteps, MonteCarlo, TouchShare};
pub use student::{half_width_95, student_quantile, student_tails};
pub(crate) use truth::{Motion, Truth};
pub use truth::{Plant, World};
pub use watch::LimitShare;
use watch::Reach;
pub(crate) use watch::Watch;

/// One closed-loop run, up to the step where it diverges, if it does.
///
/// Example: [`Evaluation`](crate::Evaluation).
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Sample {
    /// Seed of its noise.
    pub seed: u64,
    /// True states, one row per time.
    pub states: Vec<Vec<f64>>,
    /// Estimates of the filter after each measurement, one row per time.
    pub estimates: Vec<Vec<f64>>,
    /// Standard deviations that the filter gives them.
    pub deviations: Vec<Vec<f64>>,
    /// Controls, one row per step.
    pub controls: Vec<Vec<f64>>,
    /// What was measured, one row per time; empty in results of versions that did not keep it.
    #[serde(default)]
    pub measurements: Vec<Vec<f64>>,
    /// Its cost; infinite where it diverged.
    #[serde(deserialize_with = "or_nan")]
    pub cost: f64,
}

/// Samples that run in step with one another.
pub(crate) struct ClosedLoop {
    filters: FilterBatch,
    /// Filters that use the plant's model, in addition to the controllers' filters; they only count information.
    knowing: Option<FilterBatch>,
    /// True states.
    pub states: Matrices,
    controls: Matrices,
    measured: Matrices,
    random: Vec<ChaCha8Rng>,
    /// Result of each sample so far.
    pub outcomes: Vec<Outcome>,
    /// Mean of the first state, as the filters assume it.
    first: Vec<f64>,
    /// Next true states, length n.
    next: Matrices,
    /// Cost of the step of each sample.
    stage_costs: Vec<f64>,
    scratch: Scratch,
}

/// What a closed-loop run needs.
#[derive(Clone, Copy)]
pub(crate) struct LoopSetting<'a> {
    pub task: &'a Task,
    pub plan: &'a Plan,
    /// What the filter assumes; its noise excludes what varies with the state.
    pub believed: World<'a>,
    /// The true system.
    pub truth: Truth<'a>,
    /// Factors of the true noise, except for what varies with the state.
    pub factors: &'a NoiseFactors,
    /// The controller whose filter runs in place of the extended one.
    pub along: Option<&'a Controller>,
    /// The limits that are looked at.
    pub watch: Option<&'a Watch>,
}

impl<'a> LoopSetting<'a> {
    /// The filter of the controllers.
    fn filter(&self) -> Filter<'a> {
        let World { phi, noise } = self.believed;
        let task = self.task;
        let extended = ExtendedKalman { system: &*task.system, phi, noise, parts: 1, varying: &task.noise.varying };
        self.along.map_or(Filter::Extended(extended), Filter::AlongPlan)
    }

    /// Where the plant is another than the task's model, a filter of finer steps.
    fn knowing(&self) -> Option<Filter<'a>> {
        let Truth { system, phi, motion } = self.truth;
        let substeps = system.substeps().filter(|_| !matches!(motion, Motion::Own))?;
        // Its error falls linearly with its step length, and the bits that this adds quadratically; with sub-steps, each
        // of which takes time, half of the plant's steps suffice.
        let parts = if substeps == 1 { PARTS } else { PARTS / 2 };
        let (noise, varying) = (self.believed.noise, &self.task.noise.varying[..]);
        Some(Filter::Extended(ExtendedKalman { system, phi, noise, parts, varying }))
    }

    /// Moves all states of step `t` on, without noise, and looks at limits on the way.
    fn move_on(
        &self,
        (t, states, controls): (usize, &Matrices, &Matrices),
        next: &mut Matrices,
        outcomes: &mut [Outcome],
        scratch: &mut Scratch,
    ) {
        let Truth { system, phi, motion } = self.truth;
        let at = Points { states, controls, stages: states.count(), has_end: false, times: Times::At(t) };
        let parts = motion.parts();
        // What depends on the next state is that of the plant's own, shorter steps.
        let steps = if parts == 1 { 1 } else { parts * system.substeps().unwrap_or(1) };
        let mut look = |states: &Matrices, scratch: &mut Scratch| {
            if let Some(watch) = self.watch {
                let reached = outcomes.iter_mut().map(|outcome| &mut outcome.limits[..]);
                watch.look((system, phi, steps), (t, states, controls, false), reached, scratch);
            }
        };
        look(states, scratch);
        match motion {
            Motion::Own => system.step_all(at, phi, next, scratch),
            Motion::Plant(plant) => plant(t, states, controls, next),
            Motion::InParts(_) => {
                system.step_part(parts, at, phi, next, scratch);
                let mut from = next.clone();
                for _ in 1..parts {
                    from.copy_from(next);
                    look(&from, scratch);
                    system.step_part(parts, Points { states: &from, ..at }, phi, next, scratch);
                }
            }
        }
    }

    /// The limits of roll-outs with these outcomes; none if they were not looked at.
    pub fn limits(&self, outcomes: &[Outcome]) -> Vec<LimitShare> {
        let Some(watch) = self.watch else { return Vec::new() };
        let reached: Vec<&[Reach]> = outcomes.iter().map(|outcome| &outcome.limits[..]).collect();
        watch.shares(&reached, self.task.steps * self.truth.motion.parts() + 1)
    }
}

/// Recorded data of the first closed-loop sample.
pub(crate) struct Record {
    /// Estimates and controls.
    pub run: Trajectory,
    /// True states, vectors of length n.
    pub truth: Matrices,
    /// Standard deviations of the estimates, vectors of length n.
    pub deviations: Matrices,
    /// Measurements, vectors of length p.
    pub measured: Matrices,
}

impl Record {
    pub fn new(dimensions: Dimensions, steps: usize) -> Self {
        let states = || Matrices::vectors(steps + 1, dimensions.states);
        let measured = Matrices::vectors(steps + 1, dimensions.measurements);
        Self { run: Trajectory::zeros(dimensions, steps), truth: states(), deviations: states(), measured }
    }
}

impl ClosedLoop {
    pub fn new(dimensions: Dimensions, count: usize) -> Self {
        Self {
            filters: FilterBatch::new(dimensions, count),
            knowing: None,
            states: Matrices::vectors(count, dimensions.states),
            controls: Matrices::vectors(count, dimensions.controls),
            measured: Matrices::vectors(count, dimensions.measurements),
            random: Vec::new(),
            outcomes: vec![Outcome::default(); count],
            first: vec![0.0; dimensions.states],
            next: Matrices::vectors(count, dimensions.states),
            stage_costs: vec![0.0; count],
            scratch: Scratch::new(),
        }
    }

    /// Runs all samples under `u = ubar + k + K (mu - xbar)`, kept within the task's bounds of the controls; sample `i`
    /// draws from stream `first + i` of the seed. The cost of a sample that diverges is infinite.
    ///
    /// Where `record` is given, it receives the first sample.
    ///
    /// # Errors
    /// Where a filter fails from its first step, or the sample to record diverges.
    pub fn run(
        &mut self,
        setting: LoopSetting,
        seed: u64,
        first: u64,
        mut record: Option<&mut Record>,
    ) -> Result<(), Error> {
        let task = setting.task;
        let (filter, knowing) = (setting.filter(), setting.knowing());
        self.knowing = knowing.map(|_| FilterBatch::new(task.system.dimensions(), self.outcomes.len()));
        self.start(setting, seed, first);
        for t in 0..=task.steps {
            if halt::is_requested() {
                return Err(Error::Stopped);
            }
            self.measure(setting, t);
            self.correct(&filter, setting, (t, record.is_some()))?;
            if let Some(knowing) = &knowing {
                self.tell(knowing, setting, t)?;
            }
            self.count(setting, t);
            if let Some(record) = record.as_deref_mut() {
                record.run.states.vector_mut(t).copy_from_slice(self.filters.means.vector(0));
                record.truth.vector_mut(t).copy_from_slice(self.states.vector(0));
                record.measured.vector_mut(t).copy_from_slice(self.measured.vector(0));
                let variance = |i| self.filters.belief.corrected.get(0, i, i);
                for (i, deviation) in record.deviations.vector_mut(t).iter_mut().enumerate() {
                    *deviation = f64::max(variance(i), 0.0).sqrt();
                }
            }
            if t == task.steps {
                break;
            }
            self.act(setting, t);
            if let Some(record) = record.as_deref_mut() {
                record.run.controls.vector_mut(t).copy_from_slice(self.controls.vector(0));
            }
            filter.predict(t, &self.controls, &mut self.filters, &mut self.scratch);
            if let Some((filter, filters)) = knowing.as_ref().zip(self.knowing.as_mut()) {
                filter.predict(t, &self.controls, filters, &mut self.scratch);
            }
        }
        let Truth { system, phi, .. } = setting.truth;
        if let Some(watch) = setting.watch {
            let end = (task.steps, &self.states, &self.controls, true);
            let reached = self.outcomes.iter_mut().map(|outcome| &mut outcome.limits[..]);
            watch.look((system, phi, 1), end, reached, &mut self.scratch);
        }
        system.final_costs(&self.states, phi, &mut self.stage_costs, &mut self.scratch);
        for (outcome, last) in self.outcomes.iter_mut().zip(&self.stage_costs) {
            outcome.cost += last;
            if outcome.diverged || !outcome.cost.is_finite() {
                outcome.cost = f64::INFINITY;
            }
        }
        Ok(())
    }

    /// Draws the first states, and initialises the filters with the distribution that they assume.
    fn start(&mut self, setting: LoopSetting, seed: u64, first: u64) {
        let LoopSetting { task, believed, truth: Truth { system, phi, .. }, factors, .. } = setting;
        self.random.clear();
        for sample in 0..self.outcomes.len() {
            let mut generator = ChaCha8Rng::seed_from_u64(seed);
            generator.set_stream(first + sample as u64);
            let x = self.states.vector_mut(sample);
            for (x, value) in x.iter_mut().zip(&task.initial_state) {
                *x = value.resolve(phi);
            }
            factors.initial.at(0).add_sample(&mut generator, x);
            self.random.push(generator);
        }
        let contacts = system.contacts().len();
        let limits = setting.watch.map_or_else(Vec::new, Watch::start);
        self.outcomes.fill(Outcome { touched: vec![false; contacts], limits, ..Outcome::default() });
        for (mean, value) in self.first.iter_mut().zip(&task.initial_state) {
            *mean = value.resolve(believed.phi);
        }
        self.filters.start(&self.first, believed.noise);
        if let Some(knowing) = &mut self.knowing {
            knowing.start(&self.first, believed.noise);
        }
    }

    /// Measures the true states at step `t`.
    fn measure(&mut self, setting: LoopSetting, t: usize) {
        let Self { states, controls, measured, scratch, .. } = self;
        let at = Points { states, controls, stages: states.count(), has_end: false, times: Times::At(t) };
        let Truth { system, phi, .. } = setting.truth;
        system.observe_all(at, phi, measured, scratch);
        let noise = setting.factors.measurement.at(t);
        let log_determinant = noise.log_determinant();
        for (sample, random) in self.random.iter_mut().enumerate() {
            // A measurement's information is its log-likelihood given the state minus that given the past.
            let squared = noise.add_sample(random, self.measured.vector_mut(sample));
            self.outcomes[sample].nats -= 0.5 * (log_determinant + squared);
        }
        // The sum of two independent noises, one of the variance that varies, has the sum of their variances.
        for varying in &setting.task.noise.varying {
            let varying = VaryingNoise::of(varying, phi);
            for (sample, random) in self.random.iter_mut().enumerate() {
                let normal: f64 = StandardNormal.sample(random);
                let deviation = varying.at(self.states.vector(sample)).sqrt();
                self.measured.vector_mut(sample)[varying.measurement] += deviation * normal;
            }
        }
    }

    /// Lets the controllers' filters take in the measurement of step `t`. A sample that is not finite has diverged: it
    /// restarts without disturbing the others, and no longer counts.
    fn correct(&mut self, filter: &Filter, setting: LoopSetting, (t, recorded): (usize, bool)) -> Result<(), Error> {
        for sample in 0..self.outcomes.len() {
            if !(is_finite(self.filters.means.vector(sample)) && is_finite(self.measured.vector(sample))) {
                self.set_aside(setting, (t, sample));
            }
        }
        if recorded && self.outcomes[0].diverged {
            return Err(Error::not_finite("a run in closed loop", t));
        }
        // Each sample is reset at most once: its filter did not fail at the state to which it is reset.
        let mut aside = 0;
        loop {
            let corrected = filter.correct(t, &self.measured, &mut self.filters, &mut self.scratch);
            let Err(Error::Lqg(supple_lqg::Error::NotPositiveDefinite { what, step: sample })) = corrected else {
                return corrected;
            };
            if t == 0 || aside == self.outcomes.len() || recorded && sample == 0 {
                return Err(Error::not_definite(what, t));
            }
            self.set_aside(setting, (t, sample));
            aside += 1;
        }
    }

    /// Updates the filters that use the plant's model. If one fails, only the bits of its sample are lost.
    fn tell(&mut self, knowing: &Filter, setting: LoopSetting, t: usize) -> Result<(), Error> {
        let Some(filters) = &mut self.knowing else { return Ok(()) };
        let mut lose = |filters: &mut FilterBatch, sample: usize| {
            self.outcomes[sample].nats = f64::NAN;
            filters.start_one(sample, &self.first, setting.believed.noise);
        };
        for sample in 0..filters.count() {
            if !is_finite(filters.means.vector(sample)) {
                lose(filters, sample);
            }
        }
        let mut lost = 0;
        loop {
            let corrected = knowing.correct(t, &self.measured, filters, &mut self.scratch);
            let Err(Error::Lqg(supple_lqg::Error::NotPositiveDefinite { what, step: sample })) = corrected else {
                return corrected;
            };
            if lost == filters.count() {
                return Err(Error::not_definite(what, t));
            }
            lose(filters, sample);
            lost += 1;
        }
    }

    /// Accumulates statistics of the filters' innovations and, at some of the steps, of which contacts touch.
    fn count(&mut self, setting: LoopSetting, t: usize) {
        let LoopSetting { task, truth: Truth { system, phi, .. }, .. } = setting;
        let telling = self.knowing.as_ref().unwrap_or(&self.filters);
        let innovations = self.filters.innovations.iter().zip(&telling.innovations);
        for (outcome, (innovation, telling)) in self.outcomes.iter_mut().zip(innovations) {
            outcome.squared += innovation.squared;
            outcome.nats += 0.5 * (telling.log_determinant + telling.squared);
        }
        if !t.is_multiple_of(task.steps.div_ceil(LOOKED_AT).max(1)) {
            return;
        }
        for (sample, outcome) in self.outcomes.iter_mut().enumerate().filter(|(_, outcome)| !outcome.touched.is_empty())
        {
            let states = system.contact_states(self.states.vector(sample), phi);
            outcome.touched.iter_mut().zip(&states).for_each(|(touched, state)| *touched |= state.touches());
        }
    }

    /// Counts a sample as diverged at step `t`, and resets it to a state where it can be computed.
    fn set_aside(&mut self, setting: LoopSetting, (t, sample): (usize, usize)) {
        let LoopSetting { task, believed, truth: Truth { system, phi, .. }, .. } = setting;
        self.outcomes[sample].diverged = true;
        for (x, value) in self.states.vector_mut(sample).iter_mut().zip(&task.initial_state) {
            *x = value.resolve(phi);
        }
        for filters in self.knowing.iter_mut().chain([&mut self.filters]) {
            filters.start_one(sample, &self.first, believed.noise);
        }
        system.observe(t, self.states.vector(sample), phi, self.measured.vector_mut(sample));
    }

    /// Applies the controls of step `t`, adds their cost, and propagates the true states.
    fn act(&mut self, setting: LoopSetting, t: usize) {
        let LoopSetting { task, plan, truth, factors, .. } = setting;
        let stride = plan.policy.feedback.stride();
        let (feedback, feedforward) = (plan.policy.feedback.at(t), plan.policy.feedforward.vector(t));
        let (xbar, ubar) = (plan.trajectory.states.vector(t), plan.trajectory.controls.vector(t));
        for sample in 0..self.outcomes.len() {
            let mean = self.filters.means.vector(sample);
            let u = self.controls.vector_mut(sample);
            for (a, u) in u.iter_mut().enumerate() {
                let gains = &feedback[a * stride..];
                let deviation: f64 = gains.iter().zip(mean).zip(xbar).map(|((g, x), xbar)| g * (x - xbar)).sum();
                *u = ubar[a] + feedforward[a] + deviation;
            }
            if let Some(bounds) = &task.control_bounds {
                bounds.clamp(u);
            }
        }
        let Self { states, controls, next, stage_costs, outcomes, scratch, .. } = self;
        let at = Points { states, controls, stages: states.count(), has_end: false, times: Times::At(t) };
        truth.system.stage_costs(at, truth.phi, stage_costs, scratch);
        setting.move_on((t, states, controls), next, outcomes, scratch);
        states.copy_from(next);
        let noise = factors.process.at(t);
        for (sample, random) in self.random.iter_mut().enumerate() {
            self.outcomes[sample].cost += self.stage_costs[sample];
            noise.add_sample(random, self.states.vector_mut(sample));
        }
    }
}

fn is_finite(values: &[f64]) -> bool {
    values.iter().all(|value| value.is_finite())
}

/// Approximate number of steps at which roll-outs are checked for contacts.
const LOOKED_AT: usize = 25;
/// Samples that share a batch.
pub(crate) const BATCH: usize = 32;

/// How many closed-loop roll-outs, and the seed of their noise.
///
/// Example: [`monte_carlo`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rollouts {
    /// Their number.
    pub count: usize,
    /// The seed: sample i draws from stream i.
    pub seed: u64,
}

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
/// use supple::simulate::{Rollouts, World, Worlds, monte_carlo, sample, sample_number, sampled_costs};
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
/// assert_eq!(sample_number(task, &phi, &state.plan, &state.noise, (1, 0))?, run);
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
    sampled(task, (plan, None), World { phi, noise }, predicted, rollouts)
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
    (plan, along): (&Plan, Option<&Controller>),
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

/// Runs all roll-outs in batches on all threads; stores only what `keep` returns for each batch.
pub(crate) fn in_batches<T: Send>(
    setting: LoopSetting,
    Rollouts { count, seed }: Rollouts,
    batch: usize,
    keep: impl Fn(ClosedLoop) -> T + Sync + Send,
) -> Result<Vec<T>, Error> {
    let size = setting.task.system.dimensions();
    let run = |number: usize| {
        let first = number * batch;
        let mut closed = ClosedLoop::new(size, batch.min(count - first));
        closed.run(setting, seed, first as u64, None)?;
        Ok(keep(closed))
    };
    (0..count.div_ceil(batch)).into_par_iter().map(run).collect()
}
