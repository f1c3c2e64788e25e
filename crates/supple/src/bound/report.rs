//! Reports of information bounds.

use serde::{Deserialize, Serialize};
use supple_lqg::bound::{Proof, Vacuous};
use supple_model::Named;
use supple_text::short;

use super::sensor_report::SensorReport;
use crate::evaluation::Trust;
use crate::plan::PlanStatus;

/// Minimum information required for each task at one design.
///
/// Example: the [module](crate::bound).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BoundReport {
    /// All parameters.
    pub parameters: Named,
    /// Each requested task.
    pub tasks: Vec<TaskBound>,
}

/// Minimum information required for one task.
///
/// All rates are in bits per decision: over the T = N controls of a task of N steps, or over one step if stationary.
///
/// Example: the [module](crate::bound).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct TaskBound {
    /// The task.
    pub name: String,
    /// Whether everything here refers, per step, to the steady state of a time-invariant system.
    pub stationary: bool,
    /// How its plan ended.
    pub status: PlanStatus,
    /// T, the number of decisions that costs and totals cover; 1 if stationary.
    pub steps: usize,
    /// Time step, s.
    pub time_step_s: f64,
    /// D, the limit on the expected cost: over the task, or per step if stationary.
    pub cost: f64,
    /// The expected cost of the design with its own sensors; `None` if its filter has no steady state.
    pub own_cost: Option<f64>,
    /// The expected cost with the state known exactly: no amount of information achieves less.
    pub minimum_cost: f64,
    /// The expected cost with nothing measured; `None` if it is infinite.
    pub open_loop_cost: Option<f64>,
    /// Stationary: the data-rate theorem. Otherwise the growth of the open-loop product, which is not a bound.
    pub floor_bits_per_step: f64,
    /// Whether the floor is a bound.
    pub floor_is_bound: bool,
    /// The bound of Kostina and Hassibi by itself, for stationary tasks; `None` if a singular matrix makes it
    /// vacuous.
    pub kostina_hassibi_bits_per_step: Option<f64>,
    /// Why that bound is vacuous; `None` if it is not vacuous or does not apply.
    pub kostina_hassibi_vacuous: Option<Vacuous>,
    /// The greater of the floor and that bound, as far as they are bounds; at least 0.
    pub closed_form_bits_per_step: f64,
    /// The least directed information at the cost D over all sensors and controllers.
    pub minimum_bits_per_step: f64,
    /// A proved lower bound on the minimum; 0 if nothing is proved.
    pub minimum_lower_bits_per_step: f64,
    /// Whether that lower bound is proved: by interval arithmetic with outward rounding, from the problem and a dual point.
    pub proved: bool,
    /// Why it is not proved; `None` if it is.
    pub not_proved: Option<String>,
    /// Relative distance between the given problem and the one of the proof: 0 unless coordinates are left out.
    pub proof_distance: Option<f64>,
    /// Rate that the virtual sensor achieves, by its Kalman filter on the given problem; `None` if it does not converge.
    pub achieved_bits_per_step: Option<f64>,
    /// The expected cost that the virtual sensor achieves.
    pub achieved_cost: Option<f64>,
    /// The minimum over all T decisions.
    pub minimum_bits: f64,
    /// Gap between `minimum_bits_per_step` and its lower bound, bits per decision.
    pub duality_gap_bits: f64,
    /// Bits saved over all T decisions per unit increase in the cost limit, at least 0.
    pub price_bits_per_cost: f64,
    /// Newton steps of the search.
    pub newton_steps: usize,
    /// The minimum at each decision, bits, T of them.
    pub minimum_per_step_bits: Vec<f64>,
    /// Upper bound on the rate of a prefix-free code with scalar quantisers for the virtual sensor.
    pub quantiser_bits_per_step: f64,
    /// `DI(x -> u)` of the design; `None` if it is not known.
    pub control_bits_per_step: Option<f64>,
    /// `DI(x -> u)` at each decision, bits, T of them.
    pub control_per_step_bits: Vec<f64>,
    /// `DI(x -> y)` of the design over the T measurements that precede a decision; `None` if there is no steady state.
    pub measurement_bits_per_step: Option<f64>,
    /// The same at each of these measurements, bits, T of them.
    pub measurement_per_step_bits: Vec<f64>,
    /// Information of the last measurement, which no decision follows, bits; `None` if the task is stationary.
    pub last_measurement_bits: Option<f64>,
    /// The minimum divided by `DI(x -> y)`, at the design's own cost; `None` at another cost.
    pub efficiency: Option<f64>,
    /// The minimum divided by `DI(x -> u)`, at the design's own cost; `None` at another cost.
    pub control_efficiency: Option<f64>,
    /// The bounds from the least to the greatest, each with its assumption.
    pub order: Vec<OrderLine>,
    /// Remarks on these numbers, for the user.
    pub remarks: Vec<String>,
    /// Why the plan about which they hold cannot be trusted.
    #[serde(default)]
    pub warnings: Vec<String>,
    /// What roll-outs say of the linearisation about it; `None` where there are none, and in a steady state.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub trust: Option<Trust>,
    /// A sensor that attains the minimum.
    pub virtual_sensor: SensorReport,
}

/// One row of the ordered list of bounds.
///
/// Example: the [module](crate::bound).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct OrderLine {
    /// Name of the quantity.
    pub what: String,
    /// Bits per decision; `None` if it is not known.
    pub bits_per_step: Option<f64>,
    /// The conditions under which it holds.
    pub assumption: String,
    /// Whether this row takes part in the ordering: the values of such rows never decrease from one to the next.
    pub ordered: bool,
}

/// A minimum is certified if its proved lower bound is within this share of it, or within the requested gap, bits.
const CERTIFIED: f64 = 0.01;
const ASKED: f64 = 1e-7 / std::f64::consts::LN_2;

/// Explains why a lower bound is too far below a minimum to certify it; `None` if it is close enough.
pub(super) fn not_certified(minimum: f64, lower: f64) -> Option<String> {
    let gap = minimum - lower;
    (gap > (CERTIFIED * minimum).max(ASKED)).then(|| {
        format!(
            "the proved lower bound is {} bits per step, {:.0} % below the minimum found",
            short(lower, 4),
            100.0 * gap / minimum
        )
    })
}

impl TaskBound {
    /// Whether nothing speaks against the plan about which the bounds hold but, at most, doubts.
    #[must_use]
    pub fn has_sound_plan(&self) -> bool {
        self.status.is_converged() && self.warnings.is_empty() && !self.trust.as_ref().is_some_and(Trust::is_broken)
    }

    /// Why the minimum is not certified, if its proved lower bound is far below; `None` otherwise, or if nothing is proved.
    #[must_use]
    pub fn not_certified(&self) -> Option<String> {
        not_certified(self.minimum_bits_per_step, self.minimum_lower_bits_per_step).filter(|_| self.proved)
    }

    /// Whether the proved lower bound is close enough to certify the minimum found.
    #[must_use]
    pub fn is_certified(&self) -> bool {
        self.proved && self.not_certified().is_none()
    }

    /// Whether all of its numbers are finite.
    pub fn is_finite(&self) -> bool {
        let always = [
            self.cost,
            self.minimum_cost,
            self.minimum_bits_per_step,
            self.minimum_lower_bits_per_step,
            self.duality_gap_bits,
            self.price_bits_per_cost,
            self.quantiser_bits_per_step,
            self.floor_bits_per_step,
        ];
        let sometimes = [
            self.own_cost,
            self.open_loop_cost,
            self.control_bits_per_step,
            self.measurement_bits_per_step,
            self.achieved_bits_per_step,
            self.achieved_cost,
        ];
        always.into_iter().chain(sometimes.into_iter().flatten()).all(f64::is_finite)
    }

    /// Whether the numbers are in the required order, up to the duality gap and rounding.
    #[must_use]
    pub fn is_ordered(&self) -> bool {
        let gap = self.minimum_bits_per_step - self.minimum_lower_bits_per_step;
        let rates = self.order.iter().filter(|line| line.ordered).filter_map(|line| line.bits_per_step);
        let rates: Vec<f64> = rates.collect();
        rates.windows(2).all(|pair| pair[0] <= pair[1] + gap + 1e-9 * (1.0 + pair[1].abs()))
    }
}

pub(super) fn order(bound: &TaskBound) -> Vec<OrderLine> {
    let line = |what: &str, bits_per_step: Option<f64>, ordered: bool, assumption: &str| OrderLine {
        what: what.to_owned(),
        bits_per_step,
        assumption: assumption.to_owned(),
        ordered: ordered && bits_per_step.is_some(),
    };
    let floor = if bound.stationary {
        let unseen = "any controller that keeps all states bounded; some growing states do not affect the cost, so this is not comparable";
        let says = if bound.floor_is_bound { "any controller that keeps the state bounded" } else { unseen };
        line("data-rate floor", Some(bound.floor_bits_per_step), bound.floor_is_bound, says)
    } else {
        let what = "growth of A_{T-1} ... A_0";
        line(what, Some(bound.floor_bits_per_step), false, "for comparison: not a bound over a finite horizon")
    };
    let mut lines = vec![floor];
    if bound.stationary {
        let says = match bound.kostina_hassibi_vacuous {
            Some(vacuous) => format!("{vacuous}; the floor is shown"),
            None => "any sensors and any controller at the cost D".to_owned(),
        };
        lines.push(line("Kostina and Hassibi, or the floor", Some(bound.closed_form_bits_per_step), true, &says));
    }
    let along = if bound.stationary { "" } else { ", linearised along the plan" };
    let any = format!("any sensors and any controller at the cost D{along}");
    let from_below = match &bound.not_proved {
        None => format!("{any}, proved by interval arithmetic"),
        Some(reason) => format!("not proved: {reason}"),
    };
    lines.push(line(
        "proved lower bound",
        Some(bound.minimum_lower_bits_per_step).filter(|_| bound.proved),
        false,
        &from_below,
    ));
    lines.push(line("minimum", Some(bound.minimum_bits_per_step), true, &any));
    let kept = bound.achieved_cost.map_or_else(
        || "its filter does not converge".to_owned(),
        |cost| format!("the virtual sensor below, computed by its filter, at an expected cost of {}", short(cost, 8)),
    );
    lines.push(line("virtual sensor", bound.achieved_bits_per_step, false, &kept));
    // The design meets the cost D only if D is not below its own cost.
    let keeps = bound.own_cost.is_some_and(|own| {
        let rounding = (1e-12 * own.abs()).min(1e-6 * (own - bound.minimum_cost).abs());
        bound.cost >= own - rounding - f64::MIN_POSITIVE
    });
    let whose = if keeps {
        format!("this design's sensors and controller{along}")
    } else if bound.own_cost.is_none() {
        "this design, whose cost is not known; not comparable".to_owned()
    } else {
        "this design, whose cost exceeds D; not comparable".to_owned()
    };
    lines.push(line("DI(x -> u)", bound.control_bits_per_step, keeps, &whose));
    lines.push(line("DI(x -> y)", bound.measurement_bits_per_step, keeps, &whose));
    lines
}

/// Why a lower bound is not proved.
pub(super) fn reason(proof: &Proof) -> Option<String> {
    match proof {
        Proof::Proved { .. } => None,
        Proof::NotProved { reason } => Some(reason.clone()),
    }
}
