use serde::{Deserialize, Serialize};

/// How a robot's motion is integrated over a time step (theory, equations R.5 and R.20 to R.22).
#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub(super) enum Integrator {
    /// Forces of springs, dampers, friction and contacts are those at the end of the step, linearised: stable at any time
    /// step, however stiff they are.
    #[default]
    Implicit,
    /// All forces are evaluated at the beginning of the step: stiff springs and strong damping require a short step.
    SemiImplicit,
}
