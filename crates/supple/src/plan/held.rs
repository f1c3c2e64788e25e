//! What plans that are held at limits pass on to others.

use supple_kernels::Matrices;

use super::Plan;

/// Factor by which penalties grow.
pub(super) const GROWTH: f64 = 10.0;
/// Maximum number of growths that are passed on: next to a plan that keeps its limits, stiff penalties only slow searches.
const MOST_PASSED_ON: usize = 2;

/// What a plan that is held at limits passes on to plans of problems that differ little, beside its controls.
#[derive(Clone, Debug)]
pub(crate) struct Held {
    /// The multipliers of its limits, as those of [`Plan::multipliers`].
    pub(super) multipliers: Matrices,
    /// The penalties of their excesses.
    pub(super) penalties: Vec<f64>,
    /// How often they grew.
    pub(super) growths: usize,
}

impl Held {
    /// That of a plan, if it is held at limits.
    pub fn of(plan: &Plan) -> Option<Self> {
        if !plan.is_at_limits() {
            return None;
        }
        let growths = plan.growths.min(MOST_PASSED_ON);
        let softer: f64 = std::iter::repeat_n(GROWTH, plan.growths - growths).product();
        let penalties = plan.penalties.iter().map(|rho| rho / softer).collect();
        Some(Self { multipliers: plan.multipliers.clone(), penalties, growths })
    }

    /// Whether it is that of a plan with so many points and limits.
    pub(super) fn fits(&self, points: usize, ends: usize) -> bool {
        self.penalties.len() == ends && (self.multipliers.count(), self.multipliers.cols()) == (points, ends)
    }
}
