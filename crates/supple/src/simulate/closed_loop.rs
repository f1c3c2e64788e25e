use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;
use supple_kernels::{Matrices, Scratch, halt};
use supple_lqg::Dimensions;
use supple_model::Trajectory;
use supple_model::noise::VaryingNoise;
use supple_model::system::{Points, Times};

use super::ekf::FilterBatch;
use super::filter::Filter;
use super::outcome::Outcome;
use super::setting::LoopSetting;
use super::truth::Truth;
use super::watch::Watch;
use crate::Error;

/// Approximate number of steps at which roll-outs are checked for contacts.
const LOOKED_AT: usize = 25;
/// Samples that share a batch.
pub(crate) const BATCH: usize = 32;

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
            self.correct(&filter, setting, t, record.is_some())?;
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
            let Self { states, controls, .. } = self;
            let times = Times::At(task.steps);
            let at = Points { states, controls, stages: states.count(), has_end: false, times };
            let reached = self.outcomes.iter_mut().map(|outcome| &mut outcome.limits[..]);
            watch.look(setting.truth, 1, at, true, reached, &mut self.scratch);
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
    fn correct(&mut self, filter: &Filter, setting: LoopSetting, t: usize, recorded: bool) -> Result<(), Error> {
        for sample in 0..self.outcomes.len() {
            if !(is_finite(self.filters.means.vector(sample)) && is_finite(self.measured.vector(sample))) {
                self.set_aside(setting, t, sample);
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
            self.set_aside(setting, t, sample);
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
    fn set_aside(&mut self, setting: LoopSetting, t: usize, sample: usize) {
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
        setting.move_on(t, states, controls, next, outcomes, scratch);
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

/// How many closed-loop roll-outs, and the seed of their noise.
///
/// Example: [`monte_carlo`](super::monte_carlo).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rollouts {
    /// Their number.
    pub count: usize,
    /// The seed: sample i draws from stream i.
    pub seed: u64,
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
