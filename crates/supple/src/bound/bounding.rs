//! Bounds on the information of a problem's tasks at one design.

use supple_kernels::Matrices;
use supple_lqg::bound::{
    Achieved, BoundSettings, BoundStatus, Horizon, Proof, Spread, Stationary, VirtualSensor, data_rate_floor,
    kostina_hassibi, minimum_information_within, product_growth, stationary_minimum, virtual_sensors,
};
use supple_lqg::dense::{congruence, dense};
use supple_model::Channel;
use supple_text::digits;

use super::own::Own;
use super::report::{not_certified, reason};
use super::steady::stationary;
use crate::Error;
use crate::branches::{Attempts, plan_at};
use crate::evaluation::PlanCheck;
use crate::horizon::proved_horizon;
use crate::pipeline::TaskState;
use crate::problem::{Problem, Task};

const LN_2: f64 = std::f64::consts::LN_2;

/// Which bounds to compute.
///
/// Example: the [module](crate::bound).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BoundOptions {
    /// The task; default: all of them.
    pub task: Option<String>,
    /// D, the limit on the expected cost: over the task, or per step where stationary; default: the design's own.
    pub cost: Option<f64>,
    /// Bounds per step in steady state instead of over the horizon; for linear models that do not change over
    /// time.
    pub stationary: bool,
    /// How the minimum is searched for.
    pub settings: BoundSettings,
}

impl Problem {
    /// The first half of [`bound`](Self::bound): the data that all bounds of each task share, independent of the cost.
    ///
    /// # Errors
    /// Same as for [`bound`](Self::bound).
    pub fn bounding(&self, phi: &[f64], options: &BoundOptions) -> Result<Vec<Bounding>, Error> {
        self.check_design(phi)?;
        let names = || self.tasks.iter().map(|task| format!("`{}`", task.name)).collect::<Vec<_>>().join(", ");
        let wanted = |task: &&Task| options.task.as_ref().is_none_or(|name| *name == task.name);
        let tasks: Vec<&Task> = self.tasks.iter().filter(wanted).collect();
        if let (Some(name), []) = (&options.task, &tasks[..]) {
            return Err(Error::Unknown { what: "task", name: name.clone(), valid: names() });
        }
        if options.cost.is_some() && tasks.len() > 1 {
            return Err(Error::no_bound(
                format!("--cost was given, but there are several tasks: {}", names()),
                "choose the task with --task",
            ));
        }
        tasks.into_iter().map(|task| Bounding::new(self, task, phi, options)).collect()
    }
}

/// The data from which the bounds of one task at one design are computed.
///
/// Example: the [module](crate::bound).
pub struct Bounding {
    pub(super) kind: Kind,
    pub(super) settings: BoundSettings,
    pub(super) own: Own,
    pub(super) channels: Vec<Channel>,
    /// The floor, nats; a bound only if every growing state affects the cost.
    pub(super) floor_nats: f64,
    /// The part of the floor that is a bound; 0 for tasks over a horizon.
    pub(super) certain_nats: f64,
    /// How far the cost function is from one for which the regulator is exactly optimal; if unproved, the reason.
    pub(super) regulator: Result<f64, String>,
    pub(super) name: String,
    pub(super) time_step: f64,
}

pub(super) enum Kind {
    Horizon(Horizon, Spread),
    Stationary(Stationary),
}

/// The minimum at one cost.
///
/// Example: the [module](crate::bound).
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct BoundPoint {
    /// D, the expected cost: over the task, or per step where it is stationary.
    pub cost: f64,
    /// The minimum information, bits per decision.
    pub minimum_bits_per_step: f64,
    /// Its proved lower bound.
    pub minimum_lower_bits_per_step: f64,
    /// The best bound in closed form, bits per decision.
    pub closed_form_bits_per_step: f64,
    /// Why `minimum_lower_bits_per_step` is not proved and therefore 0; `None` if it is proved.
    pub not_proved: Option<String>,
    /// Why the minimum is not certified: how far the lower bound is below it; `None` if it is certified.
    pub not_certified: Option<String>,
}

/// The minimum of a bounding of either [`Kind`].
pub(super) struct Minimum {
    pub(super) nats: f64,
    pub(super) lower_nats: f64,
    pub(super) slope: f64,
    pub(super) per_step_nats: Vec<f64>,
    pub(super) sensors: Vec<VirtualSensor>,
    pub(super) predicted: Matrices,
    pub(super) iterations: usize,
    pub(super) status: BoundStatus,
    pub(super) proof: Proof,
    pub(super) achieved: Option<Achieved>,
}

impl Bounding {
    fn new(problem: &Problem, task: &Task, phi: &[f64], options: &BoundOptions) -> Result<Self, Error> {
        let mut state = TaskState::new(task);
        plan_at(problem, task, phi, None, Attempts::default(), &mut state)?;
        let (kind, own, (floor_nats, certain_nats), regulator) = if options.stationary {
            let (problem, regulator) = stationary(task, phi, &state)?;
            let own = Own::steady(&problem, task, &state)?;
            let floors = (data_rate_floor(&problem.dynamics)?, data_rate_floor(&problem.priced_dynamics())?);
            (Kind::Stationary(problem), own, floors, regulator)
        } else {
            let proved = proved_horizon(task, phi, &state.plan, &state.noise)?;
            let floor = product_growth(&proved.horizon.dynamics, task.steps)?;
            let check = PlanCheck::of(problem, task, phi, &state, 1.0)?;
            let own = Own::over_horizon(task, &state, &proved, check)?;
            (Kind::Horizon(proved.horizon, proved.spread), own, (floor, 0.0), proved.law)
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
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// T: number of decisions over which rates are averaged; 1 if stationary.
    #[must_use]
    pub fn steps(&self) -> usize {
        match &self.kind {
            Kind::Horizon(horizon, _) => horizon.prices.count(),
            Kind::Stationary(_) => 1,
        }
    }

    /// The expected cost of the design with its own sensors; `None` if its filter has no steady state.
    #[must_use]
    pub fn own_cost(&self) -> Option<f64> {
        self.own.cost
    }

    /// The expected cost with the state known exactly.
    #[must_use]
    pub fn minimum_cost(&self) -> f64 {
        match &self.kind {
            Kind::Horizon(horizon, _) => horizon.base_cost,
            Kind::Stationary(problem) => problem.base_cost,
        }
    }

    /// The expected cost with nothing measured; `None` if it is infinite.
    #[must_use]
    pub fn open_loop_cost(&self) -> Option<f64> {
        let cost = match &self.kind {
            Kind::Horizon(horizon, _) => {
                let (mut covariance, mut cost) = (dense(&horizon.initial, 0), horizon.base_cost);
                for t in 0..horizon.prices.count() {
                    cost += dense(&horizon.prices, t).dot(&covariance);
                    let noise = dense(&horizon.process, t);
                    covariance = congruence(&dense(&horizon.dynamics, t), &covariance) + noise;
                }
                cost
            }
            Kind::Stationary(problem) => problem.unmeasured_cost().ok().flatten().unwrap_or(f64::INFINITY),
        };
        cost.is_finite().then_some(cost)
    }

    /// The minimum at a cost.
    ///
    /// # Errors
    /// If the cost is not above the least possible, or nothing can be certified.
    pub fn point(&self, cost: f64) -> Result<BoundPoint, Error> {
        let minimum = self.minimum(cost, None)?;
        let bits = |nats: f64| nats / LN_2 / self.steps() as f64;
        Ok(BoundPoint {
            cost,
            minimum_bits_per_step: bits(minimum.nats),
            minimum_lower_bits_per_step: bits(minimum.lower_nats),
            closed_form_bits_per_step: bits(self.closed_form_nats(cost)),
            not_proved: reason(&minimum.proof),
            not_certified: not_certified(bits(minimum.nats), bits(minimum.lower_nats)),
        })
    }

    /// The best bound in closed form, nats per step: 0 if its regulator is not proved to be optimal.
    pub(super) fn closed_form_nats(&self, cost: f64) -> f64 {
        match &self.kind {
            Kind::Horizon(..) => 0.0,
            Kind::Stationary(_) if self.regulator.is_err() => 0.0,
            Kind::Stationary(problem) => kostina_hassibi(problem, cost, self.certain_nats).nats.max(self.certain_nats),
        }
    }

    /// The minimum at a cost. `own_price`, the design's own estimation-error cost, is more precise there than a
    /// difference of costs.
    pub(super) fn minimum(&self, cost: f64, own_price: Option<f64>) -> Result<Minimum, Error> {
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
            Error::Lqg(supple_lqg::Error::CostBelowLeast { .. }) => {
                supple_lqg::Error::CostBelowLeast { cost, least: self.minimum_cost() }.into()
            }
            Error::Lqg(supple_lqg::Error::NoBound { what, advice }) if cost.is_finite() => {
                Error::no_bound(format!("at an expected cost of {}, {what}", digits(cost)), advice)
            }
            other => other,
        })
    }

    fn search(&self, cost: f64, own_price: Option<f64>) -> Result<Minimum, Error> {
        match &self.kind {
            Kind::Horizon(horizon, spread) => {
                let beyond = own_price.map(|_| Horizon { base_cost: 0.0, ..horizon.clone() });
                let (horizon, cost) = (beyond.as_ref().unwrap_or(horizon), own_price.unwrap_or(cost));
                let found = minimum_information_within(horizon, spread, cost, &self.settings)?;
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
}
