//! Bounds on the information of a problem's tasks at one design.

use supple_kernels::Matrices;
use supple_lqg::bound::{
    Achieved, BoundSettings, BoundStatus, Horizon, InUnits, Proof, Stationary, VirtualSensor, data_rate_floor,
    kostina_hassibi, law_distance, minimum_information, observed, product_growth, quantiser_bound, stationary_minimum,
    virtual_sensors,
};
use supple_lqg::dense::{congruence, dense, store};
use supple_model::{Channel, Named};

use super::own::Own;
use super::report::{BoundReport, TaskBound, order};
use super::sensor_report::sensor_report;
use super::steady::stationary;
use crate::Error;
use crate::branches::plan_at;
use crate::horizon::horizon_of_plan;
use crate::pipeline::TaskState;
use crate::plan::{PlanMode, PlanStatus};
use crate::problem::{Problem, Task};

const LN_2: f64 = std::f64::consts::LN_2;

/// What bounds are asked for.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BoundOptions {
    /// The task; default: all of them.
    pub task: Option<String>,
    /// D, the expected cost to keep: over the task, or per step where stationary; default: the design's own.
    pub cost: Option<f64>,
    /// Bounds by step of the steady state instead of those over the horizon; for linear models that do not change over time.
    pub stationary: bool,
    /// How the minimum is searched for.
    pub settings: BoundSettings,
}

impl Problem {
    /// How little information would do at a design, for each task that is asked for: all parameters in the order of
    /// declaration.
    ///
    /// # Errors
    /// Where `phi` has the wrong length, no task has the name, one cost is given for several tasks, a plan cannot be
    /// computed, the cost is below the least there is, or a stationary bound is asked for of a task that has none.
    pub fn bound(&self, phi: &[f64], options: &BoundOptions) -> Result<BoundReport, Error> {
        let tasks = self.bounding(phi, options)?;
        let tasks = tasks.iter().map(|bounding| bounding.report(options.cost)).collect::<Result<_, _>>()?;
        Ok(BoundReport { parameters: Named::new(&self.parameters, phi), tasks })
    }

    /// The first half of [`bound`](Self::bound): what all bounds of each task have in common, whatever the cost.
    ///
    /// # Errors
    /// As of [`bound`](Self::bound).
    pub fn bounding(&self, phi: &[f64], options: &BoundOptions) -> Result<Vec<Bounding>, Error> {
        self.check_design(phi)?;
        let names = || self.tasks.iter().map(|task| format!("`{}`", task.name)).collect::<Vec<_>>().join(", ");
        let wanted = |task: &&Task| options.task.as_ref().is_none_or(|name| *name == task.name);
        let tasks: Vec<&Task> = self.tasks.iter().filter(wanted).collect();
        if let (Some(name), []) = (&options.task, &tasks[..]) {
            return Err(Error::Unknown { what: "task", name: name.clone(), valid: names() });
        }
        if options.cost.is_some() && tasks.len() > 1 {
            return Err(Error::NoBound {
                what: format!("one cost is asked for, and there are several tasks: {}", names()),
                advice: "say which task the cost is of",
            });
        }
        tasks.into_iter().map(|task| Bounding::new((self, task), phi, options)).collect()
    }
}

/// What the bounds of one task at one design are found from.
pub struct Bounding {
    kind: Kind,
    settings: BoundSettings,
    own: Own,
    channels: Vec<Channel>,
    /// The floor, which is a bound where it is that of all that the cost sees.
    floor_nats: f64,
    /// The part of it that is a bound: over a horizon 0.
    certain_nats: f64,
    /// How far the cost is from one for which the regulator is exact; why it is none of it otherwise.
    regulator: Result<f64, String>,
    name: String,
    time_step: f64,
}

enum Kind {
    Horizon(Horizon),
    Stationary(Stationary),
}

/// The minimum at one cost.
#[derive(Clone, Debug, PartialEq)]
pub struct BoundPoint {
    /// D, the expected cost: over the task, or per step where it is stationary.
    pub cost: f64,
    /// The least information, bits by decision.
    pub minimum_bits_per_step: f64,
    /// What it is certainly not below.
    pub minimum_lower_bits_per_step: f64,
    /// The best bound in closed form, bits by decision.
    pub closed_form_bits_per_step: f64,
    /// Why `minimum_lower_bits_per_step` is not proved, and 0; none where it is.
    pub not_proved: Option<String>,
}

/// The minimum of either kind.
struct Minimum {
    nats: f64,
    lower_nats: f64,
    slope: f64,
    per_step_nats: Vec<f64>,
    sensors: Vec<VirtualSensor>,
    predicted: Matrices,
    iterations: usize,
    status: BoundStatus,
    proof: Proof,
    achieved: Option<Achieved>,
}

impl Bounding {
    fn new((problem, task): (&Problem, &Task), phi: &[f64], options: &BoundOptions) -> Result<Self, Error> {
        let mut state = TaskState::new(task);
        plan_at((problem, task), phi, None, (0, 0), &mut state)?;
        let (kind, own, (floor_nats, certain_nats), regulator) = if options.stationary {
            let (problem, regulator) = stationary(task, phi, &state)?;
            let own = Own::steady(&problem, task, &state)?;
            let floors = (data_rate_floor(&problem.dynamics)?, data_rate_floor(&priced(&problem))?);
            (Kind::Stationary(problem), own, floors, regulator)
        } else {
            let horizon = horizon_of_plan(&state.plan, &state.noise)?;
            let floor = product_growth(&horizon.dynamics, task.steps)?;
            // Remarks name laws other than the regulator's: the bounds are those of their prices.
            let plan = &state.plan;
            let plain =
                matches!(plan.mode, PlanMode::Nominal | PlanMode::Sampled) && !plan.policy.clamped.contains(&true);
            let regulator = if plain && plan.status != PlanStatus::Indefinite {
                law_distance(&horizon, &plan.knots, &plan.policy.curvature)
            } else {
                Ok(0.0)
            };
            (Kind::Horizon(horizon), Own::over_horizon(task, &state)?, (floor, 0.0), regulator)
        };
        Ok(Self {
            kind,
            settings: options.settings,
            own,
            channels: task.system.channels().states,
            floor_nats,
            certain_nats,
            regulator,
            name: task.name.clone(),
            time_step: task.time_step.resolve(phi),
        })
    }

    /// The task.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// T: decisions that rates are over; 1 where it is stationary.
    pub fn steps(&self) -> usize {
        match &self.kind {
            Kind::Horizon(horizon) => horizon.prices.count(),
            Kind::Stationary(_) => 1,
        }
    }

    /// The expected cost of the design with its own sensors; none where its filter has no steady state.
    pub fn own_cost(&self) -> Option<f64> {
        self.own.cost
    }

    /// The expected cost with the state known exactly.
    pub fn minimum_cost(&self) -> f64 {
        match &self.kind {
            Kind::Horizon(horizon) => horizon.base_cost,
            Kind::Stationary(problem) => problem.base_cost,
        }
    }

    /// The expected cost with nothing measured; none where it is infinite.
    pub fn open_loop_cost(&self) -> Option<f64> {
        let cost = match &self.kind {
            Kind::Horizon(horizon) => {
                let (mut covariance, mut cost) = (dense(&horizon.initial, 0), horizon.base_cost);
                for t in 0..horizon.prices.count() {
                    cost += dense(&horizon.prices, t).dot(&covariance);
                    let noise = dense(&horizon.process, t);
                    covariance = congruence(&dense(&horizon.dynamics, t), &covariance) + noise;
                }
                cost
            }
            // Powers of A by squaring: sum of A^k W A'^k.
            Kind::Stationary(problem) => {
                let (mut a, mut covariance) = (dense(&problem.dynamics, 0), dense(&problem.process, 0));
                for _ in 0..60 {
                    covariance += congruence(&a, &covariance);
                    a = &a * &a;
                }
                let settled = a.iter().all(|entry| entry.abs() < 1e-9);
                let cost = problem.base_cost + dense(&problem.price, 0).dot(&covariance);
                if settled { cost } else { f64::INFINITY }
            }
        };
        cost.is_finite().then_some(cost)
    }

    /// The minimum at a cost.
    ///
    /// # Errors
    /// Where the cost is not above the least there is, or nothing can be certified.
    pub fn point(&self, cost: f64) -> Result<BoundPoint, Error> {
        let minimum = self.minimum(cost, None)?;
        let bits = |nats: f64| nats / LN_2 / self.steps() as f64;
        Ok(BoundPoint {
            cost,
            minimum_bits_per_step: bits(minimum.nats),
            minimum_lower_bits_per_step: bits(minimum.lower_nats),
            closed_form_bits_per_step: bits(self.closed_form_nats(cost)),
            not_proved: reason(&minimum.proof),
        })
    }

    /// The best bound in closed form: nats per step.
    fn closed_form_nats(&self, cost: f64) -> f64 {
        match &self.kind {
            Kind::Horizon(_) => 0.0,
            Kind::Stationary(problem) => kostina_hassibi(problem, cost, self.certain_nats).nats.max(self.certain_nats),
        }
    }

    /// At a cost; at the design's own, what it pays for not knowing the state is known better than the difference of costs.
    fn minimum(&self, cost: f64, own_price: Option<f64>) -> Result<Minimum, Error> {
        let proved = |minimum: Minimum| match (&self.regulator, &minimum.proof) {
            (Err(reason), _) => {
                Minimum { lower_nats: 0.0, proof: Proof::NotProved { reason: reason.clone() }, ..minimum }
            }
            (Ok(of_cost), Proof::Proved { distance }) => {
                let distance = distance.max(*of_cost);
                Minimum { proof: Proof::Proved { distance }, ..minimum }
            }
            _ => minimum,
        };
        self.search(cost, own_price).map(proved).map_err(|error| match error {
            Error::CostBelowLeast { .. } => Error::CostBelowLeast { cost, least: self.minimum_cost() },
            Error::NoBound { what, advice } if cost.is_finite() => {
                Error::NoBound { what: format!("at an expected cost of {cost:.7}, {what}"), advice }
            }
            other => other,
        })
    }

    fn search(&self, cost: f64, own_price: Option<f64>) -> Result<Minimum, Error> {
        match &self.kind {
            Kind::Horizon(horizon) => {
                let beyond = own_price.map(|_| Horizon { base_cost: 0.0, ..horizon.clone() });
                let (horizon, cost) = (beyond.as_ref().unwrap_or(horizon), own_price.unwrap_or(cost));
                let found = minimum_information(horizon, cost, &self.settings)?;
                Ok(Minimum {
                    nats: found.nats,
                    lower_nats: found.lower_nats,
                    slope: found.slope,
                    sensors: virtual_sensors(&found),
                    per_step_nats: found.per_step_nats,
                    predicted: found.predicted,
                    iterations: found.iterations,
                    status: found.status,
                    proof: found.proof,
                    achieved: found.achieved,
                })
            }
            Kind::Stationary(problem) => {
                let beyond = own_price.map(|_| Stationary { base_cost: 0.0, ..problem.clone() });
                let (problem, cost) = (beyond.as_ref().unwrap_or(problem), own_price.unwrap_or(cost));
                let found = stationary_minimum(problem, cost, &self.settings)?;
                Ok(Minimum {
                    nats: found.nats,
                    lower_nats: found.lower_nats,
                    slope: found.slope,
                    per_step_nats: vec![found.nats],
                    sensors: vec![found.virtual_sensor()],
                    predicted: found.predicted,
                    iterations: found.iterations,
                    status: found.status,
                    proof: found.proof,
                    achieved: found.achieved,
                })
            }
        }
    }

    /// All bounds at a cost, or at the design's own.
    ///
    /// # Errors
    /// As of [`point`](Self::point), or where the design has no cost of its own and none is given.
    pub fn report(&self, cost: Option<f64>) -> Result<TaskBound, Error> {
        let own_price = if cost.is_none() { self.own.price } else { None };
        let cost = cost.or(self.own.cost).ok_or_else(|| Error::NoBound {
            what: format!("the filter of task `{}` has no steady state, and so no expected cost per step", self.name),
            advice: "give the cost to keep, or sensors that see every unstable state",
        })?;
        let minimum = self.minimum(cost, own_price)?;
        let steps = self.steps();
        let (total, bits) = (|nats: f64| nats / LN_2, |nats: f64| nats / LN_2 / steps as f64);
        let list = |nats: &[f64]| nats.iter().map(|nats| nats / LN_2).collect::<Vec<f64>>();
        let sum = |nats: &Option<Vec<f64>>| nats.as_ref().map(|nats| bits(nats.iter().sum()));
        let (control, measurement) = (sum(&self.own.control), sum(&self.own.measurement));
        let at_own = self.own.cost.is_some_and(|own| (cost - own).abs() <= 1e-9 * own.abs());
        let share = |of: Option<f64>| of.filter(|&of| at_own && of > 0.0).map(|of| bits(minimum.nats) / of);
        // What is proved is right: then rounding has got into the design's own filter.
        let contradicted = |own: &f64| at_own && bits(minimum.lower_nats) > own * (1.0 + 1e-6) + 1e-9;
        let mistaken = control.filter(contradicted).or(measurement.filter(contradicted));
        let (control, measurement) = if mistaken.is_some() { (None, None) } else { (control, measurement) };
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
            // At the design's own cost, the budget is known apart from the least cost.
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
            virtual_sensor: sensor,
        };
        report.order = order(&report);
        report.remarks.extend(remarks(&report, minimum.status, at_own));
        if let Some(own) = mistaken {
            report.remarks.push(format!(
                "this design's own information came out as {own:.6} bits per step, below what is proved of all: rounding in its \
                 filter; it is left out"
            ));
        }
        if report.is_finite() {
            return Ok(report);
        }
        Err(Error::NoBound {
            what: "a result is not a finite number".into(),
            advice: "scale the states to similar sizes, or shorten the horizon",
        })
    }

    fn kostina_hassibi(&self, cost: f64) -> (Option<f64>, Option<super::Vacuous>) {
        match &self.kind {
            Kind::Horizon(_) => (None, None),
            Kind::Stationary(problem) => {
                let found = kostina_hassibi(problem, cost, self.certain_nats);
                let silent =
                    matches!(found.vacuous, Some(super::Vacuous::SingularProcess | super::Vacuous::SingularPrice));
                ((!silent).then_some(found.nats / LN_2), found.vacuous)
            }
        }
    }
}

/// `A` of what the cost sees, now or later: what grows unseen needs no information.
fn priced(problem: &Stationary) -> Matrices {
    let InUnits { a, price, .. } = InUnits::of(problem);
    let seen = observed(&a, &price);
    let mut out = Matrices::constant(seen.ncols(), seen.ncols());
    store(&mut out, 0, &(seen.transpose() * a * seen));
    out
}

/// Why a lower bound is not proved.
fn reason(proof: &Proof) -> Option<String> {
    match proof {
        Proof::Proved { .. } => None,
        Proof::NotProved { reason } => Some(reason.clone()),
    }
}

/// What to know of a result beside its numbers.
fn remarks(report: &TaskBound, status: BoundStatus, at_own: bool) -> Vec<String> {
    let mut remarks = Vec::new();
    if status != BoundStatus::Converged {
        let end = if status == BoundStatus::MaxIterations { "its steps were used up" } else { "of rounding" };
        remarks.push(format!(
            "the search for the minimum ended early, because {end}: the gap that is left is {:.3e} bits per step",
            report.duality_gap_bits
        ));
    }
    if let Some(reason) = &report.not_proved {
        remarks.push(format!("the lower bound is not proved: {reason}; the minimum is what the search found"));
    }
    let dearer = |cost: &f64| cost - report.cost > 1e-6 * (report.cost - report.minimum_cost).abs();
    if let Some(cost) = report.achieved_cost.filter(dearer) {
        remarks.push(format!("the virtual sensor keeps an expected cost of {cost:.7} only, not {:.7}", report.cost));
    }
    if !at_own {
        remarks.push("the efficiency is that at the design's own cost: leave the cost out to see it".to_owned());
    }
    remarks
}
