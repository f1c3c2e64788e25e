//! How plans and designs are searched for.

mod design;
mod information;
mod plan;

pub use design::{DesignSettings, GradientKind, MOST_ROLLOUTS, Method, ROLLOUTS};
pub use information::InformationWeights;
pub use plan::{
    BeliefSettings, CostCurvature, PlanMode, PlanSettings, PlanStatus, RegularisationKind, SampledSettings,
};
