//! Planning: the reference trajectory and the feedback of partially observed iLQG (method: docs/theory/plan.md).

mod costates;
mod nominal;
mod riccati;
mod rollout;
mod sampled;
mod settings;

pub use nominal::{Plan, PlanWorkspace, plan};
pub use riccati::{Policy, Regularisation, solve_riccati};
pub use rollout::{rollout, simulate_controls};
pub use settings::{PlanMode, PlanSettings, PlanStatus, SampledSettings};
pub(crate) use costates::sweep_costates;
pub(crate) use riccati::solve_lq;
pub(crate) use sampled::plan_sampled;
