//! Plans that others follow.

use supple_kernels::Scratch;
use supple_lqg::{Dimensions, Policy};
use supple_model::Trajectory;
use supple_model::system::RollOut;

use super::{NominalProblem, Plan, PlanWorkspace};

/// The parts of a plan that are needed to follow it.
pub(super) struct Kept {
    pub trajectory: Trajectory,
    pub policy: Policy,
}

impl Kept {
    pub fn of(plan: &Plan) -> Self {
        Self { trajectory: plan.trajectory.clone(), policy: plan.policy.clone() }
    }

    /// The same over more and shorter steps: states in between, and controls and gains of the step that each is part of.
    pub fn over(&self, steps: usize) -> Self {
        let Trajectory { states, controls } = &self.trajectory;
        let size = Dimensions { states: states.cols(), controls: controls.cols(), measurements: 0 };
        let mut finer = Self { trajectory: Trajectory::zeros(size, steps), policy: Policy::zeros(size, steps) };
        for t in 0..=steps {
            let (now, rest) = (t * controls.count() / steps, t * controls.count() % steps);
            let share = rest as f64 / steps as f64;
            let next = states.vector((now + 1).min(controls.count()));
            let between = finer.trajectory.states.vector_mut(t).iter_mut().zip(states.vector(now).iter().zip(next));
            between.for_each(|(x, (now, next))| *x = now + share * (next - now));
            if t < steps {
                finer.trajectory.controls.vector_mut(t).copy_from_slice(controls.vector(now));
                finer.policy.feedback.at_mut(t).copy_from_slice(self.policy.feedback.at(now));
            }
        }
        finer
    }

    /// Writes controls for a problem that differs little from that of this plan: those that track its trajectory with
    /// its feedback, or the plan's own controls if that fails.
    pub fn follow(&self, problem: NominalProblem, found: &mut Plan, work: &mut PlanWorkspace, scratch: &mut Scratch) {
        let NominalProblem { system, phi, bounds } = problem;
        let law = RollOut::Law { reference: &self.trajectory, policy: &self.policy, step: 0.0, bounds };
        let cost = system.roll_out(law, phi, &mut work.candidate, scratch);
        let controls = if cost.is_finite() { &work.candidate.controls } else { &self.trajectory.controls };
        found.trajectory.controls.copy_from(controls);
    }
}

#[cfg(test)]
mod tests {
    use supple_lqg::Dimensions;

    use super::{Kept, Plan};

    #[test]
    fn a_plan_over_more_steps_passes_through_the_same_states() {
        let mut plan = Plan::zeros(Dimensions { states: 1, controls: 1, measurements: 0 }, 2);
        for t in 0..=2 {
            plan.trajectory.states.set(t, 0, 0, [0.0, 2.0, 8.0][t]);
            if t < 2 {
                plan.trajectory.controls.set(t, 0, 0, 1.0 + t as f64);
                plan.policy.feedback.set(t, 0, 0, 3.0 + t as f64);
            }
        }
        let finer = Kept::of(&plan).over(4);
        let states: Vec<f64> = (0..=4).map(|t| finer.trajectory.states.vector(t)[0]).collect();
        assert_eq!(states, [0.0, 1.0, 2.0, 5.0, 8.0]);
        let controls: Vec<f64> = (0..4).map(|t| finer.trajectory.controls.vector(t)[0]).collect();
        assert_eq!(controls, [1.0, 1.0, 2.0, 2.0]);
        let gains: Vec<f64> = (0..4).map(|t| finer.policy.feedback.get(t, 0, 0)).collect();
        assert_eq!(gains, [3.0, 3.0, 4.0, 4.0]);
        // Also where one number is no multiple of the other.
        let states: Vec<f64> = (0..=3).map(|t| Kept::of(&plan).over(3).trajectory.states.vector(t)[0]).collect();
        assert!(states.iter().zip([0.0, 4.0 / 3.0, 4.0, 8.0]).all(|(x, exact)| (x - exact).abs() < 1e-14));
    }
}
