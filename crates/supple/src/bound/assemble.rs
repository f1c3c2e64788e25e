//! Bound reports: for all tasks of a problem, and for one.

use std::f64::consts::LN_2;

use supple_lqg::bound::{BoundStatus, Proof, kostina_hassibi, quantiser_bound};
use supple_model::Named;
use supple_text::{digits, short};

use super::bounding::{BoundOptions, Bounding, Kind};
use super::report::{BoundReport, TaskBound, order, reason};
use super::sensor_report::sensor_report;
use crate::Error;
use crate::problem::Problem;

impl Problem {
    /// Computes the minimum information at a design for each requested task; `phi` has all parameters in the order of
    /// declaration.
    ///
    /// # Errors
    /// If `phi` has the wrong length, no task has the name, one cost is given for several tasks, a plan cannot be
    /// computed, the cost is below the least possible, or a stationary bound is requested for a task that has none.
    pub fn bound(&self, phi: &[f64], options: &BoundOptions) -> Result<BoundReport, Error> {
        let tasks = self.bounding(phi, options)?;
        let tasks = tasks.iter().map(|bounding| bounding.report(options.cost)).collect::<Result<_, _>>()?;
        Ok(BoundReport { parameters: Named::new(&self.parameters, phi), tasks })
    }
}

/// The information of a design's own filter and controller, bits per step.
struct OwnInformation {
    control: Option<f64>,
    measurement: Option<f64>,
    /// A value of the design that rounding put below a proved lower bound; all its values are then omitted.
    mistaken: Option<f64>,
}

/// # Errors
/// If a number of the report is not finite.
fn finite(report: TaskBound) -> Result<TaskBound, Error> {
    if report.is_finite() {
        return Ok(report);
    }
    Err(Error::no_bound(
        "a result is not a finite number",
        match report.stationary {
            true => "scale the states to similar sizes",
            false => "scale the states to similar sizes, or shorten the horizon",
        },
    ))
}

impl Bounding {
    /// All bounds at a cost, or at the design's own.
    ///
    /// # Errors
    /// Same as for [`point`](Self::point); also if no cost is given and the design's own is undefined.
    pub fn report(&self, cost: Option<f64>) -> Result<TaskBound, Error> {
        let own_price = if cost.is_none() { self.own.price } else { None };
        let cost = cost.map_or_else(|| self.required_own_cost(), Ok)?;
        let minimum = self.minimum(cost, own_price)?;
        let steps = self.steps();
        let (total, bits) = (|nats: f64| nats / LN_2, |nats: f64| nats / LN_2 / steps as f64);
        let list = |nats: &[f64]| nats.iter().map(|nats| nats / LN_2).collect::<Vec<f64>>();
        // The design's estimation-error cost may be much less than its total cost.
        let price = self.own.price.unwrap_or(f64::INFINITY);
        let at_own = self.own.cost.is_some_and(|own| (cost - own).abs() <= (1e-9 * own.abs()).min(1e-6 * price));
        let OwnInformation { control, measurement, mistaken } = self.own_information(minimum.lower_nats, at_own);
        let share = |of: Option<f64>| of.filter(|&of| at_own && of > 0.0).map(|of| bits(minimum.nats) / of);
        let sensor = sensor_report(&minimum.sensors, &minimum.predicted, &self.channels, self.time_step);
        let (kh, vacuous) = self.kostina_hassibi(cost);
        let mut report = TaskBound {
            name: self.name.clone(),
            stationary: matches!(self.kind, Kind::Stationary(_)),
            status: self.own.status,
            steps,
            time_step_s: self.time_step,
            cost,
            own_cost: self.own.cost,
            minimum_cost: self.minimum_cost(),
            open_loop_cost: self.open_loop_cost(),
            floor_bits_per_step: bits(self.floor_nats),
            floor_is_bound: matches!(self.kind, Kind::Stationary(_)) && self.floor_nats - self.certain_nats <= 1e-9,
            kostina_hassibi_bits_per_step: kh,
            kostina_hassibi_vacuous: vacuous,
            closed_form_bits_per_step: bits(self.closed_form_nats(cost)),
            minimum_bits_per_step: bits(minimum.nats),
            minimum_lower_bits_per_step: bits(minimum.lower_nats),
            minimum_bits: total(minimum.nats),
            proved: matches!(minimum.proof, Proof::Proved { .. }),
            not_proved: reason(&minimum.proof),
            proof_distance: match minimum.proof {
                Proof::Proved { distance } => Some(distance),
                Proof::NotProved { .. } => None,
            },
            achieved_bits_per_step: minimum.achieved.map(|achieved| bits(achieved.nats)),
            // At the design's own cost, the budget above the least cost is known directly.
            achieved_cost: minimum
                .achieved
                .map(|achieved| if own_price.is_some() { self.minimum_cost() + achieved.cost } else { achieved.cost }),
            duality_gap_bits: bits(minimum.nats - minimum.lower_nats),
            price_bits_per_cost: (-total(minimum.slope)).max(0.0),
            newton_steps: minimum.iterations,
            minimum_per_step_bits: list(&minimum.per_step_nats),
            quantiser_bits_per_step: quantiser_bound(total(minimum.nats), &sensor.rank_per_step) / steps as f64,
            control_bits_per_step: control,
            control_per_step_bits: list(self.own.control.as_deref().unwrap_or_default()),
            measurement_bits_per_step: measurement,
            measurement_per_step_bits: list(self.own.measurement.as_deref().unwrap_or_default()),
            last_measurement_bits: self.own.last_measurement.map(total),
            efficiency: share(measurement),
            control_efficiency: share(control),
            order: Vec::new(),
            remarks: self.own.remarks.clone(),
            warnings: self.own.check.as_ref().map_or_else(Vec::new, |check| check.warnings.clone()),
            trust: self.own.check.as_ref().and_then(|check| check.trust.clone()),
            virtual_sensor: sensor,
        };
        report.order = order(&report);
        report.remarks.extend(remarks(&report, minimum.status, at_own));
        if let Some(own) = mistaken {
            report.remarks.push(format!(
                "the information of this design, {own:.6} bits per step, is below the proved lower bound because of rounding in its filter; it is omitted"
            ));
        }
        finite(report)
    }

    /// The expected cost of the design's own filter and controller.
    fn required_own_cost(&self) -> Result<f64, Error> {
        self.own.cost.ok_or_else(|| {
            let name = &self.name;
            Error::no_bound(
                format!("the filter of task `{name}` has no steady state, so its expected cost per step is undefined"),
                "give a cost limit (`cost`), or sensors that detect every unstable state",
            )
        })
    }

    /// Information that the design's own filter measures and its controller uses, checked against a proved lower bound,
    /// nats, if that bound is at the design's own cost.
    fn own_information(&self, lower_nats: f64, at_own: bool) -> OwnInformation {
        let steps = self.steps();
        let bits = |nats: f64| nats / LN_2 / steps as f64;
        let sum = |nats: &Option<Vec<f64>>| nats.as_ref().map(|nats| bits(nats.iter().sum()));
        let (control, measurement) = (sum(&self.own.control), sum(&self.own.measurement));
        // A proved bound is right: if it is contradicted, rounding has corrupted the design's own filter.
        let contradicted = |own: &f64| at_own && bits(lower_nats) > own * (1.0 + 1e-6) + 1e-9;
        match control.filter(contradicted).or(measurement.filter(contradicted)) {
            None => OwnInformation { control, measurement, mistaken: None },
            mistaken => OwnInformation { control: None, measurement: None, mistaken },
        }
    }

    fn kostina_hassibi(&self, cost: f64) -> (Option<f64>, Option<super::Vacuous>) {
        match &self.kind {
            Kind::Horizon(..) => (None, None),
            Kind::Stationary(problem) => {
                let found = kostina_hassibi(problem, cost, self.certain_nats);
                let silent =
                    matches!(found.vacuous, Some(super::Vacuous::SingularProcess | super::Vacuous::SingularPrice));
                ((!silent).then_some(found.nats / LN_2), found.vacuous)
            }
        }
    }
}

/// A remaining gap that is no more than rounding, bits per step.
const NO_GAP: f64 = 2e-14;

/// Remarks on a result, in addition to its numbers.
fn remarks(report: &TaskBound, status: BoundStatus, at_own: bool) -> Vec<String> {
    let mut remarks = Vec::new();
    if status != BoundStatus::Converged && report.duality_gap_bits > NO_GAP {
        let end = if status == BoundStatus::MaxIterations {
            "the maximum number of steps was reached"
        } else {
            "of rounding"
        };
        remarks.push(format!(
            "the search for the minimum ended early, because {end}: the remaining gap is {:.3e} bits per step",
            report.duality_gap_bits
        ));
    }
    if let Some(reason) = &report.not_proved {
        remarks.push(format!("the lower bound is not proved: {reason}; the minimum is what the search found"));
    }
    if let Some(reason) = report.not_certified() {
        remarks.push(format!("the minimum is not certified: {reason}"));
    }
    let budget = (report.cost - report.minimum_cost).abs();
    let dearer = |cost: &f64| cost - report.cost > 1e-8 * budget + 1e-14 * report.minimum_cost.abs();
    if let Some(cost) = report.achieved_cost.filter(dearer) {
        remarks.push(format!(
            "the virtual sensor achieves an expected cost of {}, not {}",
            digits(cost),
            digits(report.cost)
        ));
    }
    let more = |bits: &f64| bits - report.minimum_bits_per_step > 1e-4 * report.minimum_bits_per_step + 1e-6;
    if let Some(bits) = report.achieved_bits_per_step.filter(more) {
        remarks.push(format!(
            "the virtual sensor measures {} bits per step, more than the minimum of {}",
            short(bits, 6),
            short(report.minimum_bits_per_step, 6)
        ));
    }
    if !at_own {
        remarks.push("efficiency is defined at the design's own cost; omit `cost` to see it".to_owned());
    }
    remarks
}
