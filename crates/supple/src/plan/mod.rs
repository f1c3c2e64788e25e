//! Planning: the reference trajectory and the feedback of partially observed iLQG (method: docs/theory/plan.md).

mod costates;
mod nominal;
mod riccati;
mod rollout;
mod sampled;
mod settings;

pub(crate) use costates::sweep_costates;
pub use nominal::{Plan, PlanWorkspace, plan};
pub(crate) use riccati::solve_lq;
pub use riccati::{Policy, Regularisation, solve_riccati};
pub use rollout::{rollout, simulate_controls};
pub(crate) use sampled::plan_sampled;
pub use settings::{PlanMode, PlanSettings, PlanStatus, RegularisationKind, SampledSettings};
