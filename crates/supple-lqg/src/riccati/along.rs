use supple_kernels::{Matrices, rows};

use super::policy::Policy;

/// The minimiser of `sum 1/2 dz' H dz + h' dz` over `dx+ = F dz`, `dx_0 = 0`, with its costates, from a sweep over
/// `[H | h]`: `du = k + K dx`, `dlambda = S dx + J_x`.
///
/// `joint` receives `dz` (its control part 0 at the end), `costates` receives `dlambda`.
///
/// ```
/// use supple_lqg::{Knots, LinearQuadratic, Matrices, Policy, Regularisation, solve_lq, solve_riccati};
///
/// // One step of x+ = x + u, with cost slope 4 and curvature 2 in u: 1 of the step, 1 of the end.
/// let plant = LinearQuadratic { a: &[[1.0]], b: &[[1.0]], c: &[[1.0]], q: &[[1.0]], r: &[[1.0]] };
/// let mut knots = Knots::linear(1, plant)?;
/// knots.cost.set(0, 1, 2, 4.0);
/// let mut policy = Policy::zeros(knots.dimensions, 1);
/// solve_riccati(&knots.dynamics, &knots.cost, Regularisation::default(), &mut policy)?;
/// let (mut joint, mut costates) = (Matrices::vectors(2, 2), Matrices::vectors(2, 1));
/// solve_lq(&knots.dynamics, &policy, &mut joint, &mut costates);
/// assert!((joint.vector(0)[1] + 2.0).abs() < 1e-12, "du = -4 / 2");
/// assert!((joint.vector(1)[0] + 2.0).abs() < 1e-12, "dx+ = du");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn solve_lq(dynamics: &Matrices, policy: &Policy, joint: &mut Matrices, costates: &mut Matrices) {
    let (steps, n) = (dynamics.count(), dynamics.rows());
    let stride = policy.feedback.stride();
    joint.vector_mut(0)[..n].fill(0.0);
    for t in 0..=steps {
        let (now, next) = if t < steps { joint.at_mut_pair(t) } else { (joint.at_mut(t), [].as_mut_slice()) };
        let (dx, du) = now.split_at_mut(n);
        let curvature = policy.curvature.at(t);
        for (i, costate) in costates.vector_mut(t).iter_mut().enumerate() {
            *costate = policy.slope.vector(t)[i] + rows::dot(&curvature[i * stride..i * stride + n], dx);
        }
        if t == steps {
            du.fill(0.0);
            continue;
        }
        let (feedback, feedforward) = (policy.feedback.at(t), policy.feedforward.vector(t));
        for (a, du) in du.iter_mut().take(feedforward.len()).enumerate() {
            *du = feedforward[a] + rows::dot(&feedback[a * stride..a * stride + n], dx);
        }
        let f = dynamics.at(t);
        let width = dynamics.stride();
        let used = dynamics.cols();
        for i in 0..n {
            next[i] = rows::dot(&f[i * width..i * width + used], &now[..used]);
        }
    }
}
