//! Planning: the reference trajectory and the feedback of partially observed iLQG (method: docs/theory/plan.md).

mod approach;
mod augmented;
mod bounds;
mod conjugate_gradients;
mod costates;
mod descent;
mod first_guess;
mod held;
mod kept;
mod nominal;
mod result;
mod risk;
mod search;
mod sweeps;
mod truncated;
mod within_limits;
mod workspace;

pub use crate::problem::NominalProblem;
pub use crate::settings::{
    BeliefSettings, CostCurvature, PlanMode, PlanSettings, PlanStatus, RegularisationKind, SampledSettings,
};
pub(crate) use approach::{approach, draw_to_contacts, has_to_approach};
pub use bounds::bounds_of;
pub(crate) use conjugate_gradients::{Found, Goal, Operator, Solved, conjugate_gradients};
pub(crate) use costates::{Stationarity, sweep_costates};
pub(crate) use descent::{Descent, Model, Step, descend, is_over};
pub(crate) use first_guess::{add_wave, first_guess};
pub(crate) use held::Held;
pub use result::{Plan, VALID_STATIONARITY};
pub(crate) use risk::plan_risk;
pub(crate) use search::{Asked, Patience, has_descent};
pub(crate) use sweeps::{finish, linearise, roll_out, sweep};
pub use within_limits::plan;
pub(crate) use within_limits::search;
pub use workspace::PlanWorkspace;
