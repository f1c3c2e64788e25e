use std::f64::consts::LN_2;

use serde::{Deserialize, Serialize};
use supple_model::or_nan;

use super::outcome::Outcome;
use super::setting::LoopSetting;
use super::student::half_width_95;
use super::watch::LimitShare;
use crate::problem::Task;

/// 95 % of a normal variable are within so many standard deviations of its mean.
const NORMAL_95: f64 = 1.96;

/// A task in closed loop, sampled.
///
/// Example: [`monte_carlo`](crate::simulate::monte_carlo).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct MonteCarlo {
    /// How many roll-outs.
    pub rollouts: usize,
    /// Their seed.
    pub seed: u64,
    /// How many of them diverged: their cost is infinite.
    #[serde(default)]
    pub diverged: usize,
    /// Mean cost; infinite where a roll-out diverged.
    #[serde(deserialize_with = "or_nan")]
    pub cost_mean: f64,
    /// Standard error of the mean; NaN of a single roll-out, or where one diverged.
    #[serde(deserialize_with = "or_nan")]
    pub cost_standard_error: f64,
    /// 95 % confidence interval of the expected cost, in its units, by Student's t: 1.97 standard errors to both sides of the
    /// mean of 256 roll-outs, 2.3 of ten; none of a single roll-out, or where one diverged.
    #[serde(default)]
    pub cost_interval_95: Option<[f64; 2]>,
    /// Mean cost less the predicted expected cost.
    #[serde(deserialize_with = "or_nan")]
    pub difference: f64,
    /// Whether the filter's covariance matches its errors; none in results of versions that did not check.
    #[serde(default)]
    pub consistency: Option<Consistency>,
    /// Information that the measurements of roll-outs gave, in bits; none of a single roll-out, where one diverged, and
    /// where a measurement's noise varies with the state.
    #[serde(default)]
    pub realised_bits: Option<Estimate>,
    /// Share of the roll-outs in which each contact touched, at 25 or so of their steps.
    #[serde(default)]
    pub touched: Vec<TouchShare>,
    /// The limits of the robot and the task; empty where a roll-out diverged, and in results of versions that did not
    /// look.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub limits: Vec<LimitShare>,
    /// Their results on a plant with finer steps; none for models whose integration steps cannot be refined, and
    /// if they were not computed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub finer: Option<FinerSteps>,
    /// Cost of every roll-out.
    #[serde(skip)]
    pub costs: Vec<f64>,
    /// Bits of every roll-out, of which [`realised_bits`](Self::realised_bits) is the mean; empty where that is none.
    #[serde(skip)]
    pub bits: Vec<f64>,
}

/// Roll-outs whose plant takes finer steps than the task; the steps of its controller and filter are as long as
/// before. Each has the noise of the roll-out of the same number on the task's own steps.
///
/// In results:
///
/// ```json
/// {
///   "times": 8,
///   "rollouts": 32,
///   "diverged": 0,
///   "cost_mean": 31.2,
///   "own_cost_mean": 31.0,
///   "median_difference": 0.1,
///   "difference_standard_error": 0.05
/// }
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct FinerSteps {
    /// Steps of the plant in one of the task's (or of its sub-steps).
    pub times: usize,
    /// How many roll-outs.
    pub rollouts: usize,
    /// How many of them diverged.
    pub diverged: usize,
    /// Mean cost; infinite where a roll-out diverged.
    #[serde(deserialize_with = "or_nan")]
    pub cost_mean: f64,
    /// Mean cost of the roll-outs of the same numbers on the task's own steps.
    #[serde(deserialize_with = "or_nan")]
    pub own_cost_mean: f64,
    /// Median of the differences between the two, which few roll-outs that nearly diverge do not hide.
    #[serde(deserialize_with = "or_nan")]
    pub median_difference: f64,
    /// Standard error of the mean difference; NaN of a single roll-out.
    #[serde(deserialize_with = "or_nan")]
    pub difference_standard_error: f64,
    /// Whether the filter's covariance, which is that of the task's own steps, is that of its errors; none in results of
    /// versions that did not look, and where a roll-out diverged.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub consistency: Option<Consistency>,
    /// Information that the measurements gave, in bits, to a filter of finer steps, which does not control; none in results of
    /// versions that did not look, and where [`MonteCarlo::realised_bits`] has none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub realised_bits: Option<Estimate>,
    /// The difference from the bits of the roll-outs of the same numbers on the task's own steps.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bits_difference: Option<Estimate>,
    /// The limits, at each of the finer steps; empty where a roll-out diverged, and in results of versions that did not
    /// look.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub limits: Vec<LimitShare>,
}

/// Normalised squared innovations `nu' S^-1 nu / p`, without unit, mean over measurements and roll-outs: 1 where the
/// filter's covariance is that of its errors, more if it is overconfident, less if it is underconfident (theory, equation
/// I.12).
///
/// Example: [`monte_carlo`](crate::simulate::monte_carlo).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Consistency {
    /// The mean.
    #[serde(deserialize_with = "or_nan")]
    pub mean: f64,
    /// Lower end of the band with 95 % of the means of a consistent filter.
    #[serde(alias = "lower")]
    pub lower_95: f64,
    /// Upper end of this band.
    #[serde(alias = "upper")]
    pub upper_95: f64,
}

/// A mean of samples, in their unit.
///
/// Example: [`monte_carlo`](crate::simulate::monte_carlo).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Estimate {
    /// The mean.
    #[serde(deserialize_with = "or_nan")]
    pub mean: f64,
    /// Its standard error; NaN of a single sample.
    #[serde(deserialize_with = "or_nan")]
    pub standard_error: f64,
    /// 95 % confidence interval of the expectation, by Student's t; none of a single sample.
    #[serde(default)]
    pub interval_95: Option<[f64; 2]>,
}

/// In how many roll-outs a contact touched.
///
/// Example: [`ContactCurve`](crate::ContactCurve).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct TouchShare {
    /// The contact.
    pub name: String,
    /// Share of the roll-outs.
    pub share: f64,
}

impl Consistency {
    /// `None` if nothing is measured.
    fn of(task: &Task, outcomes: &[Outcome]) -> Option<Self> {
        let measured = task.system.dimensions().measurements * (task.steps + 1);
        let squared = Estimate::of(outcomes.iter().map(|outcome| outcome.squared / measured as f64));
        // A sum of k squares of normal numbers has variance 2 k.
        let scatter = NORMAL_95 * (2.0 / (measured * outcomes.len()) as f64).sqrt();
        (measured > 0).then_some(Self { mean: squared.mean, lower_95: 1.0 - scatter, upper_95: 1.0 + scatter })
    }
}

/// Whether the bits of all roll-outs are known.
fn are_told(outcomes: &[Outcome]) -> bool {
    outcomes.iter().all(|outcome| outcome.nats.is_finite())
}

impl Estimate {
    /// The mean of samples, with its standard error and its interval.
    ///
    /// ```
    /// use supple::simulate::Estimate;
    ///
    /// let mean = Estimate::of([1.0, 2.0, 3.0].into_iter());
    /// let [low, high] = mean.interval_95.ok_or("of more than one sample")?;
    /// // Two degrees of freedom: 4.3 standard errors to both sides.
    /// assert!((mean.mean - 2.0).abs() < 1e-12 && (high - low - 2.0 * 4.302653 / 3f64.sqrt()).abs() < 1e-5);
    /// # Ok::<(), &str>(())
    /// ```
    #[must_use]
    pub fn of(samples: impl Iterator<Item = f64> + Clone) -> Self {
        let made = samples.clone().count();
        let count = made as f64;
        let mean = samples.clone().sum::<f64>() / count;
        let squares: f64 = samples.map(|sample| (sample - mean).powi(2)).sum();
        let standard_error = if count > 1.0 { (squares / (count - 1.0) / count).sqrt() } else { f64::NAN };
        let half = half_width_95(standard_error, made);
        let interval_95 = half.is_finite().then_some([mean - half, mean + half]);
        Self { mean, standard_error, interval_95 }
    }
}

impl FinerSteps {
    /// Compares outcomes on a plant with `times` times finer steps with costs and bits on the task's own steps.
    pub(crate) fn of(setting: LoopSetting, times: usize, outcomes: &[Outcome], own: &[f64], own_bits: &[f64]) -> Self {
        let task = setting.task;
        let count = own.len() as f64;
        let mean = |costs: &mut dyn Iterator<Item = f64>| costs.sum::<f64>() / count;
        let differences = || outcomes.iter().zip(own).map(|(finer, own)| finer.cost - own);
        let mut sorted: Vec<f64> = differences().collect();
        sorted.sort_by(f64::total_cmp);
        let diverged = outcomes.iter().filter(|outcome| !outcome.cost.is_finite()).count();
        let bits = || outcomes.iter().zip(own_bits).map(|(finer, own)| (finer.nats / LN_2, own));
        let has_bits = diverged == 0 && own_bits.len() > 1 && are_told(outcomes);
        Self {
            times,
            median_difference: sorted.get(sorted.len() / 2).copied().unwrap_or(f64::NAN),
            rollouts: own.len(),
            diverged,
            cost_mean: mean(&mut outcomes.iter().map(|outcome| outcome.cost)),
            own_cost_mean: mean(&mut own.iter().copied()),
            difference_standard_error: Estimate::of(differences()).standard_error,
            consistency: Consistency::of(task, outcomes).filter(|_| diverged == 0),
            realised_bits: has_bits.then(|| Estimate::of(bits().map(|(finer, _)| finer))),
            bits_difference: has_bits.then(|| Estimate::of(bits().map(|(finer, own)| finer - own))),
            limits: if diverged == 0 { setting.limits(outcomes) } else { Vec::new() },
        }
    }
}

impl MonteCarlo {
    /// The limits that some roll-outs exceed, on the task's own steps or on finer ones: there, and on finer steps if these
    /// were computed.
    pub fn limits_exceeded(&self) -> impl Iterator<Item = (&LimitShare, Option<&LimitShare>)> {
        let finer = self.finer.as_ref().map_or(&[][..], |finer| &finer.limits);
        let both = self.limits.iter().enumerate().map(|(index, own)| (own, finer.get(index)));
        both.filter(|(own, finer)| own.share > 0.0 || finer.is_some_and(|finer| finer.share > 0.0))
    }

    pub(crate) fn of(setting: LoopSetting, outcomes: Vec<Outcome>, predicted: f64, seed: u64) -> Self {
        let task = setting.task;
        let rollouts = outcomes.len();
        let diverged = outcomes.iter().filter(|outcome| !outcome.cost.is_finite()).count();
        let cost = Estimate::of(outcomes.iter().map(|outcome| outcome.cost));
        let whole = diverged == 0;
        let has_bits = whole && rollouts > 1 && task.noise.varying.is_empty() && are_told(&outcomes);
        let bits = || outcomes.iter().map(|outcome| outcome.nats / LN_2);
        let touched = task.system.contacts().into_iter().enumerate().map(|(place, contact)| {
            let count = outcomes.iter().filter(|outcome| outcome.touched[place]).count();
            TouchShare { name: contact.name, share: count as f64 / rollouts as f64 }
        });
        Self {
            rollouts,
            seed,
            diverged,
            cost_mean: cost.mean,
            cost_standard_error: cost.standard_error,
            cost_interval_95: cost.interval_95,
            difference: cost.mean - predicted,
            consistency: Consistency::of(task, &outcomes).filter(|_| whole),
            realised_bits: has_bits.then(|| Estimate::of(bits())),
            touched: touched.collect(),
            limits: if whole { setting.limits(&outcomes) } else { Vec::new() },
            finer: None,
            bits: if has_bits { bits().collect() } else { Vec::new() },
            costs: outcomes.into_iter().map(|outcome| outcome.cost).collect(),
        }
    }
}
