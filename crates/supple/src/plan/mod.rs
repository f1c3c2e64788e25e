//! Planning: the reference trajectory and the feedback of partially observed iLQG (method: docs/theory/plan.md).

mod approach;
mod belief;
mod bounds;
mod box_qp;
mod costates;
mod hold;
mod nominal;
mod riccati;
mod risk;
mod rollout;
mod sampled;
mod search;
mod settings;

pub(crate) use approach::{approach, has_to_approach};
pub(crate) use belief::{Around, Memory, Solved, plan_belief};
pub use bounds::ControlBounds;
pub(crate) use costates::sweep_costates;
pub(crate) use hold::holding_controls;
pub(crate) use nominal::search;
pub use nominal::{NominalProblem, Plan, PlanWorkspace, plan};
pub use riccati::{Decrease, Policy, Regularisation, solve_riccati};
pub(crate) use riccati::{Lq, solve_limited, solve_lq};
pub(crate) use risk::plan_risk;
pub(crate) use rollout::rollout_within;
pub use rollout::{rollout, simulate_controls};
pub(crate) use sampled::plan_sampled;
pub(crate) use search::Patience;
pub use settings::{BeliefSettings, PlanMode, PlanSettings, PlanStatus, RegularisationKind, SampledSettings};
