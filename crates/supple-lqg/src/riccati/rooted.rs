//! Coordinates in which the Hessian of a sweep's problem is the identity.

use supple_kernels::rows::{add_scaled, dot};
use supple_kernels::{Job, Lanes, Matrices, dispatch, padded};

use super::policy::Policy;

/// Control changes under the law of a sweep over `F`, in the coordinates in which the problem of the sweep is
/// `1/2 |w|^2 + g' w` (theory, equation P.5b):
///
/// ```text
/// du = U^-1 w + K dx     Q_uu = U' U     g = -U k
/// ```
///
/// Vectors `w` hold m numbers of each of N steps.
///
/// ```
/// use supple_lqg::{Knots, LinearQuadratic, Matrices, Policy, Regularisation, Rooted, solve_riccati};
///
/// let plant = LinearQuadratic { a: &[[1.0]], b: &[[1.0]], c: &[[1.0]], q: &[[1.0]], r: &[[1.0]] };
/// let mut knots = Knots::linear(1, plant)?;
/// knots.cost.set(0, 1, 2, 4.0); // the slope in u
/// let mut policy = Policy::zeros(knots.dimensions, 1);
/// policy.keep_roots();
/// solve_riccati(&knots.dynamics, &knots.cost, Regularisation::default(), &mut policy)?;
///
/// // The steepest descent step, w = -g, is the feedforward of the sweep.
/// let rooted = Rooted::of(&knots.dynamics, &policy).ok_or("the policy keeps its roots")?;
/// let down: Vec<f64> = rooted.slope().iter().map(|g| -g).collect();
/// let mut step = Matrices::vectors(1, 1);
/// rooted.feed_forward(&down, &mut step);
/// assert!((step.get(0, 0, 0) - policy.feedforward.get(0, 0, 0)).abs() < 1e-12);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Rooted<'a> {
    dynamics: &'a Matrices,
    policy: &'a Policy,
    roots: &'a Matrices,
}

impl<'a> Rooted<'a> {
    /// The coordinates of the last sweep that led to `policy`, over `dynamics`, without limits or regularisation. `None` if
    /// the policy does not [keep its roots](Policy::keep_roots).
    #[must_use]
    pub fn of(dynamics: &'a Matrices, policy: &'a Policy) -> Option<Self> {
        let roots = policy.roots.as_ref()?;
        Some(Self { dynamics, policy, roots })
    }

    /// `g`
    #[must_use]
    pub fn slope(&self) -> Vec<f64> {
        let (m, stride) = (self.roots.rows(), self.roots.stride());
        let of_step = |t: usize| {
            let (root, k) = (self.roots.at(t), self.policy.feedforward.vector(t));
            (0..m).map(move |a| -dot(&root[a * stride + a..a * stride + m], &k[a..]))
        };
        (0..self.roots.count()).flat_map(of_step).collect()
    }

    /// Writes `U^-1 w`: the feedforward.
    pub fn feed_forward(&self, w: &[f64], out: &mut Matrices) {
        let (m, stride) = (self.roots.rows(), self.roots.stride());
        for (t, w) in w.chunks_exact(m).enumerate() {
            let out = &mut out.vector_mut(t)[..m];
            out.copy_from_slice(w);
            solve_root(self.roots.at(t), stride, out);
        }
    }

    /// Writes `dz` along linearised trajectories, vectors of length n + m, at the end with zeros for the controls.
    pub fn along(&self, w: &[f64], joint: &mut Matrices) {
        dispatch(AlongJob { of: *self, w, joint });
    }

    /// Adds to `w` the gradient of `sum q' dz` with respect to `w`, for vectors `q` of length n + m.
    pub fn add_gradient(&self, q: &Matrices, w: &mut [f64]) {
        dispatch(GradientJob { of: *self, q, w });
    }
}

/// `U^-1 x`
#[inline(always)]
fn solve_root(root: &[f64], stride: usize, x: &mut [f64]) {
    let m = x.len();
    for a in (0..m).rev() {
        let row = &root[a * stride..a * stride + m];
        x[a] = (x[a] - dot(&row[a + 1..], &x[a + 1..])) / row[a];
    }
}

/// `U'^-1 x`
#[inline(always)]
fn solve_transposed<L: Lanes>(root: &[f64], stride: usize, x: &mut [f64]) {
    let m = x.len();
    for a in 0..m {
        let row = &root[a * stride..a * stride + m];
        let (head, tail) = x.split_at_mut(a + 1);
        head[a] /= row[a];
        add_scaled::<L>(tail, -head[a], &row[a + 1..]);
    }
}

struct AlongJob<'a> {
    of: Rooted<'a>,
    w: &'a [f64],
    joint: &'a mut Matrices,
}

impl Job for AlongJob<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self { of: Rooted { dynamics, policy, roots }, w, joint } = self;
        let (n, m, steps) = (dynamics.rows(), roots.rows(), dynamics.count());
        let (stride, narrow) = (dynamics.stride(), policy.feedback.stride());
        joint.vector_mut(0)[..n].fill(0.0);
        for t in 0..steps {
            let (now, next) = joint.at_mut_pair(t);
            let (dx, du) = now.split_at_mut(n);
            du[..m].copy_from_slice(&w[t * m..(t + 1) * m]);
            solve_root(roots.at(t), roots.stride(), &mut du[..m]);
            let feedback = policy.feedback.at(t);
            for (a, du) in du[..m].iter_mut().enumerate() {
                *du += dot(&feedback[a * narrow..a * narrow + n], dx);
            }
            let f = dynamics.at(t);
            for (i, next) in next[..n].iter_mut().enumerate() {
                *next = dot(&f[i * stride..i * stride + n + m], &now[..n + m]);
            }
        }
        joint.vector_mut(steps)[n..].fill(0.0);
    }
}

struct GradientJob<'a> {
    of: Rooted<'a>,
    q: &'a Matrices,
    w: &'a mut [f64],
}

impl Job for GradientJob<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self { of: Rooted { dynamics, policy, roots }, q, w } = self;
        let (n, m, steps) = (dynamics.rows(), roots.rows(), dynamics.count());
        let (stride, narrow, wide) = (dynamics.stride(), policy.feedback.stride(), padded(n + m));
        // The costate of the next state, and `q + F' nu`.
        let (mut nu, mut by) = (vec![0.0; padded(n)], vec![0.0; wide]);
        nu[..n].copy_from_slice(&q.vector(steps)[..n]);
        for t in (0..steps).rev() {
            by.copy_from_slice(&q.at(t)[..wide]);
            for (nu, row) in nu[..n].iter().zip(dynamics.at(t).chunks_exact(stride)) {
                add_scaled::<L>(&mut by, *nu, &row[..wide]);
            }
            let (by_x, by_u) = by.split_at_mut(n);
            let by_u = &mut by_u[..m];
            nu[..n].copy_from_slice(by_x);
            for (g, row) in by_u.iter().zip(policy.feedback.at(t).chunks_exact(narrow)) {
                add_scaled::<L>(&mut nu, *g, row);
            }
            solve_transposed::<L>(roots.at(t), roots.stride(), by_u);
            w[t * m..(t + 1) * m].iter_mut().zip(&*by_u).for_each(|(w, g)| *w += g);
        }
    }
}

#[cfg(test)]
mod tests {
    use supple_kernels::Matrices;

    use super::Rooted;
    use crate::{Dimensions, Policy, Regularisation, solve_riccati};

    /// A system of three states and two controls over a few steps, with its cost.
    fn problem(steps: usize) -> [Matrices; 2] {
        let (n, m) = (3, 2);
        let number = |t: usize, i: usize, j: usize| ((7 * t + 5 * i + 3 * j) as f64).sin();
        let mut dynamics = Matrices::zeros(steps, n, n + m);
        let mut cost = Matrices::zeros(steps + 1, n + m, n + m + 1);
        for t in 0..=steps {
            for i in 0..n + m {
                for j in 0..n + m {
                    if t < steps && i < n {
                        dynamics.set(t, i, j, 0.4 * number(t, i, j));
                    }
                    let own = if i == j { 3.0 } else { 0.0 };
                    cost.set(t, i, j, own + 0.2 * (number(t, i, j) + number(t, j, i)));
                }
                cost.set(t, i, n + m, number(t, i, 9));
            }
        }
        [dynamics, cost]
    }

    /// `sum 1/2 dz' H dz + h' dz`
    fn value(cost: &Matrices, joint: &Matrices) -> f64 {
        let size = cost.rows();
        let mut sum = 0.0;
        for t in 0..cost.count() {
            let dz = joint.vector(t);
            for i in 0..size {
                let row: f64 = (0..size).map(|j| cost.get(t, i, j) * dz[j]).sum();
                sum += dz[i] * (0.5 * row + cost.get(t, i, size));
            }
        }
        sum
    }

    #[test]
    fn the_problem_of_a_sweep_has_the_identity_as_its_curvature() -> Result<(), Box<dyn std::error::Error>> {
        let steps = 4;
        let [dynamics, cost] = problem(steps);
        let size = Dimensions { states: 3, controls: 2, measurements: 0 };
        let mut policy = Policy::zeros(size, steps);
        assert!(Rooted::of(&dynamics, &policy).is_none());
        policy.keep_roots();
        solve_riccati(&dynamics, &cost, Regularisation::default(), &mut policy)?;
        let rooted = Rooted::of(&dynamics, &policy).ok_or("no roots")?;
        let slope = rooted.slope();
        let mut joint = Matrices::vectors(steps + 1, 5);
        let w: Vec<f64> = (0..2 * steps).map(|i| (3.0 * i as f64).cos()).collect();
        rooted.along(&w, &mut joint);
        let model: f64 = w.iter().zip(&slope).map(|(w, g)| w * (0.5 * w + g)).sum();
        assert!((value(&cost, &joint) - model).abs() < 1e-12);

        // The gradient of a linear function is its values along unit vectors.
        let mut q = Matrices::vectors(steps + 1, 5);
        for t in 0..=steps {
            let count = if t < steps { 5 } else { 3 };
            q.vector_mut(t)
                .iter_mut()
                .take(count)
                .enumerate()
                .for_each(|(i, q)| *q = (t as f64 + 2.0 * i as f64).sin());
        }
        let mut gradient = vec![0.0; w.len()];
        rooted.add_gradient(&q, &mut gradient);
        for (i, gradient) in gradient.iter().enumerate() {
            let mut unit = vec![0.0; w.len()];
            unit[i] = 1.0;
            rooted.along(&unit, &mut joint);
            let along: f64 =
                (0..=steps).map(|t| q.vector(t).iter().zip(joint.vector(t)).map(|(q, z)| q * z).sum::<f64>()).sum();
            assert!((along - gradient).abs() < 1e-13, "{along} {gradient}");
        }

        // The step of the sweep is the steepest descent step.
        let down: Vec<f64> = slope.iter().map(|g| -g).collect();
        let mut forward = Matrices::vectors(steps, 2);
        rooted.feed_forward(&down, &mut forward);
        for t in 0..steps {
            for (a, b) in forward.vector(t).iter().zip(policy.feedforward.vector(t)) {
                assert!((a - b).abs() < 1e-14);
            }
        }
        Ok(())
    }
}
