//! Whether roll-outs agree with the predictions of a plan.

use std::fmt;

use serde::{Deserialize, Serialize};
use supple_model::ContactReport;
use supple_text::short;

use crate::feasibility::meets;
use crate::growth::MOST_SUBSTEPS;
use crate::pipeline::TaskState;
use crate::plan::PlanStatus;
use crate::problem::Task;
use crate::settings::MOST_ROLLOUTS;
use crate::simulate::{Consistency, Estimate, FinerSteps, LimitShare, MonteCarlo, student_quantile};

/// Differences below this share of a prediction do not matter.
const TOLERATED: f64 = 0.1;
/// What noise adds to the cost may be off by this share of its prediction, unless that is a smaller share of the whole cost
/// than the next.
const TOLERATED_OF_NOISE: f64 = 1.0;
const UNSEEN: f64 = 2e-3;
/// Differences below this share of a prediction are rounding.
const NO_DIFFERENCE: f64 = 1e-9;
/// Differences below this many bits do not matter either.
const TOLERATED_BITS: f64 = 0.5;
/// How likely a sampled mean may be off by more than by chance: by three standard errors of many samples.
const CHANCE: f64 = 2.7e-3;
/// Margin on the recommended number of roll-outs, because their spread is only estimated from a sample.
const MORE: f64 = 1.2;
/// Roll-outs to advise where those made tell nothing of their spread.
const FEW_ROLLOUTS: usize = 32;
/// Ratio to which the number is found.
const FINELY: f64 = 1.005;
/// Three standard deviations, as a share of a band with 95 %.
const THREE: f64 = 3.0 / 1.96;
/// How far the filter's consistency may be from 1.
const INCONSISTENT: f64 = 0.2;
/// Consistency above which the filter's covariance has nothing to do with its errors.
const LOST: f64 = 10.0;
/// Factor on the sub-steps that is advised where finer steps change what roll-outs do.
const SUBSTEPS: usize = 8;
/// Share of the roll-outs in which a contact of the plan should touch.
const TOUCHING: f64 = 0.9;

/// Whether roll-outs agree with the predictions; if not, why.
///
/// Example: [`Evaluation`](crate::Evaluation).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Trust {
    /// The verdict.
    pub verdict: Verdict,
    /// What was found, and what to try; where the linearisation holds, what differs by little, but more than chance.
    pub reasons: Vec<String>,
    /// Where there are too few roll-outs to tell, which is then one of the reasons: about how many are needed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rollouts_needed: Option<usize>,
    /// Whether there are too few to know their information, which is then one of the reasons.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub bits_unknown: bool,
    /// If roll-outs behave differently on finer steps, which is then one of the reasons: the sub-steps of the model to
    /// try.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub substeps_advised: Option<usize>,
    /// If they do, and the model has as many sub-steps as it may: whether to try a smaller time step.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub shorter_steps_advised: bool,
}

/// Whether the linearisation used to compute information and expected cost is valid.
///
/// Example: [`Evaluation`](crate::Evaluation).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum Verdict {
    /// Roll-outs agree with the predictions.
    Holds,
    /// Some prediction is off by more than chance and more than a tenth, or what noise adds to the cost by as much as it is
    /// and 0.2 % of the whole, half of the roll-outs are as far beyond a limit
    /// that the plan keeps, or there are too few roll-outs to tell.
    Doubtful,
    /// Roll-outs diverge, exceed the cost limit that the expected cost keeps, twice that cost or 11 times the predicted
    /// information, or have innovations whose squares are above 10 times what is expected; or the plan is indefinite: its
    /// numbers must not be used.
    Broken,
}

impl Verdict {
    /// Sampled information above this many times the predicted one has nothing to do with it.
    pub const FAR_MORE: f64 = 11.0;
    /// Sampled costs above this many times the predicted ones are not those of the plan.
    pub const MUCH_MORE: f64 = 2.0;
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(match self {
            Self::Holds => "linearisation holds",
            Self::Doubtful => "doubtful",
            Self::Broken => "broken",
        })
    }
}

impl fmt::Display for Trust {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match &self.reasons[..] {
            [] => write!(f, "{}", self.verdict),
            reasons => write!(f, "{}: {}", self.verdict, reasons.join("; ")),
        }
    }
}

/// The predictions of a plan.
pub(super) struct Predicted<'a> {
    pub status: PlanStatus,
    pub cost: f64,
    /// The cost without noise.
    pub nominal: f64,
    /// The cost limit, if the predicted cost meets it.
    pub kept_limit: Option<f64>,
    pub bits: f64,
    pub contacts: &'a [ContactReport],
    /// Whether noise varies with the state.
    pub has_varying_noise: bool,
    /// Whether controls have bounds.
    pub has_bounds: bool,
}

impl<'a> Predicted<'a> {
    /// Of a plan with this status, information in bits and contacts, whose cost has a limit.
    pub fn of(
        task: &Task,
        state: &TaskState,
        status: PlanStatus,
        bits: f64,
        contacts: &'a [ContactReport],
        limit: Option<f64>,
        feasibility: f64,
    ) -> Self {
        let cost = state.cost.expected();
        Self {
            status,
            cost,
            nominal: state.plan.nominal_cost,
            kept_limit: limit.filter(|_| meets(cost, limit, feasibility)),
            bits,
            contacts,
            has_varying_noise: !task.noise.varying.is_empty(),
            has_bounds: task.control_bounds.is_some(),
        }
    }
}

impl Trust {
    /// The verdict on a plan from its roll-outs, for a model with `substeps` sub-steps.
    pub(super) fn of(predicted: &Predicted, sampled: &MonteCarlo, substeps: Option<usize>) -> Self {
        let mut broken = Vec::new();
        if predicted.status == PlanStatus::Indefinite {
            broken.push("the plan is indefinite; do not use its feedback".to_owned());
        }
        if sampled.diverged > 0 {
            broken.push(format!("{} of {} roll-outs diverge", sampled.diverged, sampled.rollouts));
        }
        if !(predicted.cost.is_finite() && predicted.bits.is_finite()) {
            broken.push("a prediction is not finite".to_owned());
        }
        if !broken.is_empty() {
            let advice = "try less initial uncertainty or process noise, softer contacts (`stiffness`, `smoothing`), or a \
                          smaller weight on the quantity that the feedback tracks";
            broken.push(advice.to_owned());
            return Self {
                verdict: Verdict::Broken,
                reasons: broken,
                rollouts_needed: None,
                bits_unknown: false,
                substeps_advised: None,
                shorter_steps_advised: false,
            };
        }
        let substeps = more_substeps(substeps.unwrap_or(1));
        let coarse = sampled.finer.as_ref().and_then(|finer| too_coarse(predicted, sampled, finer, substeps));
        let substeps_advised = coarse.as_ref().and(substeps);
        let shorter_steps_advised = coarse.is_some() && substeps.is_none();
        let of_limit = limit_exceeded(predicted, sampled);
        let broken_by_steps = coarse.as_ref().filter(|(verdict, _)| *verdict == Verdict::Broken);
        if let Some(reason) = broken_by_steps.map(|(_, reason)| reason.clone()).or(of_limit) {
            let reasons = runaways(sampled).into_iter().chain([reason]).collect();
            let (verdict, rollouts_needed, bits_unknown) = (Verdict::Broken, None, false);
            return Self { verdict, reasons, rollouts_needed, bits_unknown, substeps_advised, shorter_steps_advised };
        }
        let rollouts_needed = rollouts_needed(predicted, sampled);
        let mut reasons = doubts(predicted, sampled, rollouts_needed);
        let bits_unknown = bits_unknown(predicted, sampled);
        reasons.extend(coarse.map(|(_, reason)| reason));
        let verdict = if is_lost(predicted, sampled) {
            Verdict::Broken
        } else if reasons.is_empty() {
            Verdict::Holds
        } else {
            Verdict::Doubtful
        };
        if verdict == Verdict::Holds {
            reasons = small_differences(predicted, sampled);
        }
        Self { verdict, reasons, rollouts_needed, bits_unknown, substeps_advised, shorter_steps_advised }
    }

    /// Whether roll-outs contradict the predictions, which must not be used then.
    #[must_use]
    pub fn is_broken(&self) -> bool {
        self.verdict == Verdict::Broken
    }

    /// Whether the only doubt is that there are too few roll-outs, to know their cost, and perhaps their information too.
    #[must_use]
    pub fn needs_only_rollouts(&self) -> bool {
        self.rollouts_needed.is_some() && self.reasons.len() == 1 + usize::from(self.bits_unknown)
    }
}

/// The sub-steps to try where finer steps change what roll-outs do; `None` if the model has about as many as it may.
fn more_substeps(now: usize) -> Option<usize> {
    (2 * now <= MOST_SUBSTEPS).then(|| MOST_SUBSTEPS.min(SUBSTEPS * now))
}

/// A number in a message.
fn said(number: f64) -> String {
    short(number, 6)
}

/// If roll-outs do not cost what was predicted, and exceed the limit that the prediction meets: a message with both, and
/// what to try.
fn limit_exceeded(predicted: &Predicted, sampled: &MonteCarlo) -> Option<String> {
    let limit = predicted.kept_limit?;
    (costs_more(predicted, sampled) && surely(sampled) > limit).then(|| {
        format!(
            "roll-outs cost {}, above the limit of {}, although {} is expected; try less noise, costs and \
             contacts with more smoothing, or a smaller `time_step`",
            said(sampled.cost_mean),
            said(limit),
            said(predicted.cost)
        )
    })
}

/// What roll-outs do beyond a limit that the plan keeps, and what to try.
fn limit_left(sampled: &MonteCarlo) -> Option<String> {
    let own = LimitShare::furthest(sampled.limits.iter());
    let finer =
        sampled.finer.as_ref().and_then(|finer| Some((finer.times, LimitShare::furthest(finer.limits.iter())?)));
    let beyond = |found: &LimitShare| found.beyond(found.median);
    let within_steps = finer.filter(|(_, finer)| own.is_none_or(|own| beyond(finer) > beyond(own) + TOLERATED));
    let (LimitShare { name, unit, limit, median, worst, .. }, place, advice) = match (own, within_steps) {
        (_, Some((times, finer))) => (
            finer,
            format!(" on a plant of {times} times finer steps"),
            "plans keep limits at the ends of their steps, and without noise; try a smaller `time_step`, a control that \
             changes less from step to step, or a stricter limit, as a margin",
        ),
        (Some(own), None) => {
            (own, String::new(), "plans keep limits without noise; try a stricter limit, as a margin, or less noise")
        }
        (None, None) => return None,
    };
    let [median, worst, limit] = [*median, *worst, *limit].map(|value| format!("{} {unit}", short(value, 4)));
    let [median, worst, limit] = [&median, &worst, &limit].map(|text| text.trim_end());
    Some(format!(
        "{name} reaches {median} in half of the roll-outs{place}, and {worst} in the worst, although its limit is {limit}: \
         {advice}"
    ))
}

/// Whether roll-outs have nothing in common with the predictions: innovations, information or cost.
fn is_lost(predicted: &Predicted, sampled: &MonteCarlo) -> bool {
    let finer = sampled.finer.as_ref().and_then(|finer| finer.consistency);
    let of_filter = [sampled.consistency, finer].into_iter().flatten().any(|found| found.mean > LOST);
    let by_chance = chance(sampled.rollouts);
    let bits = sampled.realised_bits.as_ref().map_or(0.0, |bits| bits.mean - by_chance * bits.standard_error);
    let twice = Verdict::MUCH_MORE * predicted.cost.abs();
    let costs = costs_more(predicted, sampled) && surely(sampled) > twice;
    let costs_on_finer_steps = sampled.finer.as_ref().is_some_and(|finer| {
        finer.cost_mean - chance(finer.rollouts) * finer.difference_standard_error
            > twice.max(Verdict::MUCH_MORE * finer.own_cost_mean)
    });
    of_filter || bits > Verdict::FAR_MORE * predicted.bits.max(1.0) || costs || costs_on_finer_steps
}

/// What is wrong, and what to try, if the same roll-outs have another cost on a plant with finer steps, the filter
/// is inconsistent there, or measurements give different information.
fn too_coarse(
    predicted: &Predicted,
    sampled: &MonteCarlo,
    finer: &FinerSteps,
    substeps: Option<usize>,
) -> Option<(Verdict, String)> {
    let &FinerSteps { times, rollouts, diverged, cost_mean, own_cost_mean, .. } = finer;
    let advice = match substeps {
        Some(substeps) => format!("try `substeps = {substeps}` in [model], or a smaller `time_step`"),
        None => "try a smaller `time_step`".to_owned(),
    };
    if diverged > 0 {
        let what = format!("{diverged} of {rollouts} roll-outs diverge on a plant of {times} times finer steps");
        return Some((
            Verdict::Broken,
            format!("{what}; the longer steps of this task hide this by damping; {advice}"),
        ));
    }
    let tolerated = TOLERATED * own_cost_mean.abs();
    let error = chance(rollouts) * finer.difference_standard_error;
    let difference = cost_mean - own_cost_mean;
    let mean_differs = error.is_finite() && difference.abs() > error.max(tolerated);
    // A mean dominated by a few large costs is poorly known; the median is more reliable.
    let most_differ = finer.median_difference.abs() > tolerated;
    let surely = if most_differ { finer.median_difference } else { difference - error };
    let exceeds = predicted.kept_limit.is_some_and(|limit| predicted.cost + surely > limit);
    let verdict = if exceeds { Verdict::Broken } else { Verdict::Doubtful };
    let (here, own_cost) = (said(cost_mean), said(own_cost_mean));
    let costs = format!("roll-outs cost {here} on a plant of {times} times finer steps, but {own_cost}");
    let limit = if exceeds { ", which exceeds the limit" } else { "" };
    let innovations = finer.consistency.filter(|found| found.mean > LOST).map_or_else(String::new, |found| {
        format!(", and the filter's squared innovations are {} times their expected value there", said(found.mean))
    });
    if mean_differs || most_differ {
        return Some((verdict, format!("{costs} on the steps of this task{limit}{innovations}; {advice}")));
    }
    let own = sampled.consistency?.mean;
    // Roll-outs that cost the same on finer steps, and not what is predicted, are not off because of the steps.
    if own > LOST || differs(predicted, sampled) {
        return None;
    }
    let of_filter = finer.consistency.filter(|found| is_inconsistent(found) && (found.mean - own).abs() > INCONSISTENT);
    if let Some(Consistency { mean, .. }) = of_filter {
        let what = format!(
            "the filter's squared innovations are {mean:.3} times their expected value on a plant of {times} times \
             finer steps: its model misses what the robot does within a step"
        );
        return Some((Verdict::Doubtful, format!("{what}; {advice}, or a less precise sensor")));
    }
    let (bits, more) = (finer.realised_bits?.mean, finer.bits_difference?);
    let own = bits - more.mean;
    (more.mean.abs() > least_bits(own, &more, rollouts)).then(|| {
        let (bits, own) = (said(bits), said(own));
        let what = format!("measurements give {bits} bits on a plant of {times} times finer steps, but {own}");
        (Verdict::Doubtful, format!("{what} on the steps of this task; {advice}"))
    })
}

/// Standard errors by which the mean of so many roll-outs may be off by chance.
fn chance(rollouts: usize) -> f64 {
    student_quantile(CHANCE, rollouts as f64 - 1.0)
}

/// By how many bits roll-outs may differ from the prediction, either by chance or because it does not matter.
fn least_bits(expected: f64, found: &Estimate, rollouts: usize) -> f64 {
    tolerated_bits(expected).max(chance(rollouts) * found.standard_error)
}

/// By how many bits roll-outs may differ from the prediction without a word.
fn tolerated_bits(expected: f64) -> f64 {
    (TOLERATED * expected).max(TOLERATED_BITS)
}

/// Whether there are too few roll-outs to tell whether their information is as predicted.
fn bits_unknown(predicted: &Predicted, sampled: &MonteCarlo) -> bool {
    sampled.realised_bits.is_some_and(|bits| {
        let difference = (bits.mean - predicted.bits).abs();
        difference > tolerated_bits(predicted.bits) && difference <= least_bits(predicted.bits, &bits, sampled.rollouts)
    })
}

/// Whether squared innovations deviate from their expected value by more than chance and more than the tolerance.
fn is_inconsistent(found: &Consistency) -> bool {
    (found.mean - 1.0).abs() > INCONSISTENT.max(inconsistent_by_chance(found))
}

/// By how much squared innovations may be off by chance.
fn inconsistent_by_chance(found: &Consistency) -> f64 {
    THREE * 0.5 * (found.upper_95 - found.lower_95)
}

/// By how much the sampled cost may be off by chance, and by how much it may differ from the predicted one.
fn cost_error(predicted: &Predicted, sampled: &MonteCarlo) -> (f64, f64) {
    (chance(sampled.rollouts) * sampled.cost_standard_error, TOLERATED * predicted.cost.abs())
}

/// Whether the sampled cost differs from the predicted one by more than chance and more than the tolerance.
fn differs(predicted: &Predicted, sampled: &MonteCarlo) -> bool {
    let (error, tolerated) = cost_error(predicted, sampled);
    // With a single roll-out, the error is unknown.
    error.is_finite() && sampled.difference.abs() > tolerated.max(error)
}

/// Whether the sampled cost is above the predicted one by more than chance and more than the tolerance.
fn costs_more(predicted: &Predicted, sampled: &MonteCarlo) -> bool {
    let (_, tolerated) = cost_error(predicted, sampled);
    surely(sampled) > predicted.cost + tolerated || sampled.difference > 0.0 && differs(predicted, sampled)
}

/// A cost below which the mean is not, but by chance. Where a few roll-outs decide the mean, it is poorly known; the mean of the
/// costs cut off at one of them is lower, and well known.
fn surely(sampled: &MonteCarlo) -> f64 {
    let mut costs = sampled.costs.clone();
    costs.sort_by(f64::total_cmp);
    let by_chance = chance(costs.len());
    let least = |share: f64| {
        let most = *costs.get((share * costs.len() as f64) as usize)?;
        let cut = Estimate::of(costs.iter().map(|cost| cost.min(most)));
        Some(cut.mean - by_chance * cut.standard_error)
    };
    let whole = sampled.cost_mean - chance(sampled.rollouts) * sampled.cost_standard_error;
    CUTS.into_iter().filter_map(least).fold(whole, f64::max)
}

/// Shares of the roll-outs that cost less than where the others are cut off.
const CUTS: [f64; 4] = [0.5, 0.75, 0.9, 0.97];

/// Whether what noise adds to the cost is far from what is predicted, although the cost as a whole is not: most of it may be
/// that of the plan.
fn noise_differs(predicted: &Predicted, sampled: &MonteCarlo) -> bool {
    let (error, _) = cost_error(predicted, sampled);
    let tolerated = TOLERATED_OF_NOISE * (predicted.cost - predicted.nominal).abs();
    error.is_finite() && sampled.difference.abs() > error.max(tolerated).max(UNSEEN * predicted.cost.abs())
}

/// What differs from predictions by more than chance, and by no more than is tolerated.
fn small_differences(predicted: &Predicted, sampled: &MonteCarlo) -> Vec<String> {
    let (error, _) = cost_error(predicted, sampled);
    let by_cost = error.is_finite() && sampled.difference.abs() > error.max(NO_DIFFERENCE * predicted.cost.abs());
    let by_filter = sampled.consistency.is_some_and(|found| (found.mean - 1.0).abs() > inconsistent_by_chance(&found));
    let said = |what: &str, tolerated: f64| {
        format!(
            "{what} differs from its expected value by more than chance, but by less than {:.0} %",
            100.0 * tolerated
        )
    };
    let cost = by_cost.then(|| said("the sampled cost", TOLERATED));
    let filter = by_filter.then(|| said("the filter's consistency", INCONSISTENT));
    cost.into_iter().chain(filter).collect()
}

/// How many roll-outs would estimate the cost to within [`TOLERATED`], to two digits; `None` if those made suffice or
/// already show that it is not as predicted, and if more than [`MOST_ROLLOUTS`] would be needed.
fn rollouts_needed(predicted: &Predicted, sampled: &MonteCarlo) -> Option<usize> {
    let (error, tolerated) = cost_error(predicted, sampled);
    if error <= tolerated || differs(predicted, sampled) {
        return None;
    }
    let made = sampled.rollouts.max(1) as f64;
    if !error.is_finite() {
        return Some(FEW_ROLLOUTS.max(2 * sampled.rollouts));
    }
    // The standard error falls with the square root of the number. It is itself an estimate.
    let deviation = sampled.cost_standard_error * made.sqrt();
    let suffices = |count: f64| student_quantile(CHANCE, count - 1.0) * deviation / count.sqrt() <= tolerated;
    let (mut few, mut enough) = (made, MOST_ROLLOUTS as f64 / MORE);
    if !suffices(enough) {
        return None;
    }
    while enough > FINELY * few {
        let between = (few * enough).sqrt();
        *(if suffices(between) { &mut enough } else { &mut few }) = between;
    }
    let needed = MORE * enough;
    let unit = 10.0_f64.powf(needed.log10().floor() - 1.0).max(1.0);
    Some(((needed / unit).ceil() * unit) as usize)
}

/// Roll-outs that cost more than this many times the median run away.
const RUN_AWAY: f64 = 10.0;

/// A few roll-outs that run away, which decide the mean; where the other roll-outs tell more of the plan.
fn runaways(sampled: &MonteCarlo) -> Option<String> {
    let mut costs = sampled.costs.clone();
    costs.sort_by(f64::total_cmp);
    let median = *costs.get(costs.len() / 2)?;
    let far = costs.iter().filter(|cost| **cost > RUN_AWAY * median).count();
    let others = &costs[..costs.len() - far];
    let mean = others.iter().sum::<f64>() / others.len() as f64;
    let decides = sampled.cost_mean - mean > TOLERATED * mean.abs();
    (median > 0.0 && far > 0 && decides).then(|| {
        let them = if far == 1 { "it" } else { "them" };
        format!(
            "{far} of {} roll-outs cost{} more than {RUN_AWAY} times the median, {}, and decide the mean: without {them} it is \
             {}",
            costs.len(),
            if far == 1 { "s" } else { "" },
            said(median),
            said(mean)
        )
    })
}

fn doubts(predicted: &Predicted, sampled: &MonteCarlo, rollouts_needed: Option<usize>) -> Vec<String> {
    let mut reasons = Vec::new();
    reasons.extend(runaways(sampled));
    if !predicted.status.is_converged() {
        reasons.push(format!("the plan did not converge ({})", predicted.status));
    }
    let (error, tolerated) = cost_error(predicted, sampled);
    if differs(predicted, sampled) {
        let (found, expected) = (said(sampled.cost_mean), said(predicted.cost));
        let cause = match (predicted.has_varying_noise, predicted.has_bounds) {
            (true, _) => {
                "the noise varies with the state, but is expected as it is along the plan, or the cost is not quadratic over the \
                 spread of states"
            }
            (false, true) => {
                "bounds of controls cut feedback off, or the cost is not quadratic over the spread of states"
            }
            (false, false) => "the cost is not quadratic over the spread of states",
        };
        reasons.push(format!(
            "roll-outs cost {found}, but {expected} is expected: {cause}; try less noise, or costs and contacts with more \
             smoothing"
        ));
    } else if noise_differs(predicted, sampled) {
        let [found, expected] = [sampled.cost_mean, predicted.cost].map(|cost| said(cost - predicted.nominal));
        reasons.push(format!(
            "noise adds {found} to the cost of roll-outs, but {expected} is expected: the controller or the cost is not what its \
             linearisation says over the spread of states; try less noise, or costs, contacts and bounds of controls that the \
             plan stays away from"
        ));
    } else if let Some(needed) = rollouts_needed {
        let made = match sampled.rollouts {
            1 => "one roll-out is".to_owned(),
            many => format!("{many} roll-outs are"),
        };
        reasons.push(format!(
            "{made} too few to be sure of the cost to within 10 % (three standard errors): use about {needed}, `rollouts` in \
             [design]"
        ));
    } else if error > tolerated {
        reasons.push(format!(
            "roll-outs differ so much in cost that even {MOST_ROLLOUTS} would not estimate it to within 10 %; try less noise, or \
             costs and contacts with more smoothing"
        ));
    }
    if let Some(consistency) = sampled.consistency.filter(is_inconsistent) {
        let (way, cause) = match (consistency.mean > 1.0, predicted.has_varying_noise) {
            (true, false) => {
                ("overconfident", "measurements or dynamics are nonlinear within the filter's uncertainty")
            }
            (true, true) => {
                ("overconfident", "the noise is greater away from the plan, or the model is nonlinear there")
            }
            (false, false) => ("underconfident", "measurements or dynamics are less sensitive away from the plan"),
            (false, true) => {
                ("underconfident", "the noise is less away from the plan, or the model is less sensitive there")
            }
        };
        reasons.push(format!(
            "the filter is {way}: its squared innovations are {:.3} times their expected value; {cause}. Try less \
             initial uncertainty, or a sensor that measures the uncertain states",
            consistency.mean
        ));
    }
    if let Some(bits) = sampled.realised_bits {
        let (found, expected) = (said(bits.mean), said(predicted.bits));
        let difference = (bits.mean - predicted.bits).abs();
        if difference > least_bits(predicted.bits, &bits, sampled.rollouts) {
            reasons.push(format!(
                "roll-outs gave {found} bits, but {expected} are predicted: the sensors behave differently away from the plan"
            ));
        } else if bits_unknown(predicted, sampled) {
            let by_chance = said(chance(sampled.rollouts) * bits.standard_error);
            reasons.push(format!(
                "roll-outs gave {found} bits, but {expected} are predicted, and their mean may be off by {by_chance} (three \
                 standard errors): too few to tell; use more `rollouts`"
            ));
        }
    }
    reasons.extend(limit_left(sampled));
    // A contact that only grazes, by its smoothing, is none to rely on.
    let presses = |contact: &&ContactReport| contact.touches && contact.least_clearance_m < 0.0;
    for contact in predicted.contacts.iter().filter(presses) {
        let of = sampled.touched.iter().find(|touched| touched.name == contact.name);
        if let Some(touched) = of.filter(|touched| touched.share < TOUCHING) {
            reasons.push(format!(
                "contact `{}` touches in only {:.0} % of the roll-outs; try less uncertainty in its position, or a \
                 greater force",
                contact.name,
                100.0 * touched.share
            ));
        }
    }
    reasons
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    /// Roll-outs of `cost`, whose filter is off on finer steps as on the task's own.
    fn sampled(cost: f64, consistency: f64) -> MonteCarlo {
        let found = |mean: f64| serde_json::json!({ "mean": mean, "lower_95": 0.99, "upper_95": 1.01 });
        let finer = serde_json::json!({
            "times": 16, "rollouts": 32, "diverged": 0, "cost_mean": cost, "own_cost_mean": cost,
            "median_difference": 0.0, "difference_standard_error": 0.01, "consistency": found(7.5),
        });
        let all = serde_json::json!({
            "rollouts": 256, "seed": 1, "cost_mean": cost, "cost_standard_error": 0.1, "difference": cost - 20.0,
            "consistency": found(consistency), "finer": finer,
        });
        serde_json::from_value(all).unwrap()
    }

    fn trust(sampled: &MonteCarlo, substeps: usize) -> Trust {
        let predicted = Predicted {
            status: PlanStatus::Converged,
            cost: 20.0,
            nominal: 19.0,
            kept_limit: None,
            bits: 10.0,
            contacts: &[],
            has_varying_noise: false,
            has_bounds: false,
        };
        Trust::of(&predicted, sampled, Some(substeps))
    }

    #[test]
    fn advice_on_substeps_ends_at_their_maximum() {
        let coarse = sampled(20.0, 1.0);
        for (substeps, advised) in [(1, Some(8)), (160, Some(1000)), (500, Some(1000)), (800, None), (1000, None)] {
            let trust = trust(&coarse, substeps);
            assert_eq!((trust.substeps_advised, trust.shorter_steps_advised), (advised, advised.is_none()));
            assert_eq!(trust.to_string().contains("substeps"), advised.is_some(), "{trust}");
            assert!(trust.to_string().contains("a smaller `time_step`"), "{trust}");
        }
    }

    /// Roll-outs that surely cost more than twice what is expected are not those of the plan.
    #[test]
    fn twice_the_cost_breaks_a_prediction() {
        for (cost, verdict) in [(20.5, Verdict::Holds), (35.0, Verdict::Doubtful), (41.0, Verdict::Broken)] {
            let mut sampled = sampled(cost, 1.0);
            sampled.finer = None;
            assert_eq!(trust(&sampled, 1).verdict, verdict, "{cost}");
        }
    }

    /// Where roll-outs are as far off on the task's own steps, the steps are not the cause.
    #[test]
    fn substeps_are_not_advised_where_finer_steps_change_nothing() {
        for sampled in [sampled(4000.0, 1.0), sampled(20.0, 4000.0)] {
            let trust = trust(&sampled, 4);
            assert_eq!(trust.verdict, Verdict::Broken, "{trust}");
            assert!(trust.substeps_advised.is_none() && !trust.shorter_steps_advised, "{trust}");
        }
    }
}
