use supple_kernels::Scratch;
use supple_lqg::{BeliefSeeds, reverse_kalman};
use supple_model::system::Adjoints;

use super::total::Planned;
use super::workspace::GradientWorkspace;

/// Gradients by the parameters with trajectory, `K` and `Xi` held fixed, as in the paper (theory, equation G.1).
///
/// Example: [`total_gradient`](crate::gradient::total_gradient).
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct FrozenGradient {
    /// Of the directed information, nats.
    pub information: Vec<f64>,
    /// Of the belief's part of the expected cost.
    pub belief_cost: Vec<f64>,
}

/// The paper's gradient, in its corrected form and by adjoints: only `A`, `C`, `V`, `W` and `X_0` vary. If `V` depends
/// on the state, only the parameters of that dependence change it.
///
/// Example: [`total_gradient`](crate::gradient::total_gradient).
pub fn frozen_gradient(task: &Planned, work: &mut GradientWorkspace, scratch: &mut Scratch, out: &mut FrozenGradient) {
    let &Planned { system, phi, noise_model, plan, belief, noise, .. } = task;
    let information = BeliefSeeds { information: 1.0, ..Default::default() };
    let cost =
        BeliefSeeds { information: 0.0, weights: Some((&plan.policy.value_of_information, 1.0)), covariances: None };
    for (seeds, gradient) in [(information, &mut out.information), (cost, &mut out.belief_cost)] {
        gradient.clear();
        gradient.resize(phi.len(), 0.0);
        noise_model.clear(&mut work.noise, plan.trajectory.steps());
        work.adjoints.has_cost = false;
        reverse_kalman(&plan.knots, noise, belief, seeds, &mut work.belief, &mut work.adjoints, &mut work.noise);
        let adjoints = Adjoints { knots: &work.adjoints, curvature: plan.curvature };
        system.contract(plan.trajectory.points(), phi, adjoints, &mut work.hessian, gradient, scratch);
        noise_model.add_gradient(phi, &plan.trajectory.states, &work.noise, gradient);
    }
}
