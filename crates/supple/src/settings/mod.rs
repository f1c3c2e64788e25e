//! How plans and designs are searched for.
//!
//! # Settings that differ from the defaults
//!
//! ```
//! use supple::settings::{BeliefSettings, CostCurvature, DesignSettings, GradientKind, InformationWeights};
//! use supple::settings::{Method, PlanMode, PlanSettings, RegularisationKind, SampledSettings};
//!
//! let planning = PlanSettings {
//!     plan: PlanMode::Belief,
//!     belief: BeliefSettings { starts: 3, ..BeliefSettings::default() },
//!     sampled: SampledSettings { iterations: 100, ..SampledSettings::default() },
//!     curvature: CostCurvature::GaussNewton,
//!     regularisation: RegularisationKind::State,
//!     ..PlanSettings::default()
//! };
//! let design = DesignSettings {
//!     method: Method::Cobyla,
//!     gradient: GradientKind::Total,
//!     information: InformationWeights::USED,
//!     starts: 8,
//!     ..DesignSettings::default()
//! };
//! assert!(planning.check().is_ok() && design.check().is_ok());
//!
//! let wrong = PlanSettings { risk_sensitivity: 0.1, ..PlanSettings::default() };
//! assert_eq!(wrong.check().err().map(|unfit| unfit.key()), Some("risk_sensitivity"), "only for plan = \"risk\"");
//! ```

mod design;
mod information;
mod plan;

pub use design::{DesignSettings, GradientKind, MOST_ROLLOUTS, Method, ROLLOUTS};
pub use information::InformationWeights;
pub use plan::{
    BeliefSettings, CostCurvature, PlanMode, PlanSettings, PlanStatus, RegularisationKind, SampledSettings,
};
