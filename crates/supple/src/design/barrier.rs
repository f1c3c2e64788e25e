use supple_kernels::math;

use super::entries::Units;
use super::outer::{Ending, Optimiser, OuterProblem};

/// The paper's descent with signs corrected (theory, equation D.4), in the parameters themselves:
///
/// ```text
/// phi <- phi - h (dDI/dphi + sum_i beta / (D_i - J_i) dJ_i/dphi)      h = tanh(min_i (D_i - J_i) + gamma)
/// ```
///
/// projected on the box; a budget of prices is one more `D_i`, with the prices' sum as its `J_i`. A step is limited to a
/// twentieth of the box (the paper gives no limit); the search ends when steps fall below the tolerance, or when it
/// has used up ten times the evaluations of the other optimisers.
pub(super) struct Barrier {
    /// `beta`
    pub weight: f64,
    /// `gamma`, in units of cost.
    pub margin: f64,
}

impl Optimiser for Barrier {
    fn units(&self) -> Units {
        Units::Natural
    }

    fn keeps_last(&self) -> bool {
        true
    }

    fn minimise(&self, problem: &mut OuterProblem) -> Ending {
        let bounds = problem.bounds();
        let first = problem.first();
        let Some(mut at) = problem.at(&first) else { return Ending::Stalled };
        for _ in 0..10 * problem.max_evaluations() {
            if let Some(ending) = problem.interrupted() {
                return ending;
            }
            let mut phi = at.variables.clone();
            problem.step_to(&phi, false);
            let mut direction = at.gradient.clone();
            let mut least = f64::INFINITY;
            for (constraint, gradient) in at.constraints.iter().zip(&at.jacobian) {
                let room = -constraint;
                // The barrier is infinite if a bound is met with equality.
                let factor = self.weight / if room.abs() < 1e-9 { 1e-9_f64.copysign(room) } else { room };
                for (direction, gradient) in direction.iter_mut().zip(gradient) {
                    *direction += factor * gradient;
                }
                least = least.min(room);
            }
            let rate = if least.is_finite() { math::tanh(least + self.margin) } else { 1.0 };
            let mut moved: f64 = 0.0;
            for ((value, &slope), &[lower, upper]) in phi.iter_mut().zip(&direction).zip(&bounds) {
                let longest = 0.05 * (upper - lower);
                let step = (-rate * slope).clamp(-longest, longest);
                let next = (*value + step).clamp(lower, upper);
                moved = moved.max((next - *value).abs() / (upper - lower));
                *value = next;
            }
            if moved <= problem.tolerance() {
                return Ending::Converged;
            }
            let Some(next) = problem.at(&phi) else { return Ending::Stalled };
            at = next;
        }
        Ending::MaxEvaluations
    }
}
