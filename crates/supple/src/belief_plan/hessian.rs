use supple_kernels::{Matrices, Scratch, rows};
use supple_lqg::Dimensions;
use supple_lqg::solve_column;
use supple_lqg::{Lq, Policy, Regularisation, solve_limited};
use supple_model::system::{Curvature, RollOut};

use super::point::Point;
use crate::Error;
use crate::gradient::{GradientWorkspace, Quantity, slope_by_controls};
use crate::plan::{Found, Goal, Operator, Solved, conjugate_gradients};
use crate::problem::{Task, TaskAt};

/// Steps of finite differences, relative to the size of the controls.
const DIFFERENCE: f64 = 1e-5;

/// The Hessian of the expected cost around a trajectory, computed only as products with vectors, never as a matrix.
///
/// Its coordinates are changes `v` of the controls under `u = ubar + v + K (x - xbar)`, with the gains `K` of the LQ
/// problem whose Hessian is that of the nominal cost: there the latter is block-diagonal, with the blocks `Q_uu` of the
/// Riccati sweep, which are therefore the preconditioner (theory, equation P.14). The feedback also keeps roll-outs of
/// unstable systems from diverging.
pub(crate) struct Hessian {
    /// `K`, and in `feedforward` the vector of the last roll-out.
    pub law: Policy,
    /// Cholesky factors of `Q_uu`, m x m, N of them.
    factors: Matrices,
    cost: Matrices,
    /// Typical magnitude of the controls, which scales the difference steps.
    scale: f64,
    /// Added to every diagonal entry.
    pub shift: f64,
}

/// The point at which products are computed, and work memory.
pub(crate) struct Around<'a> {
    pub task: &'a Task,
    pub phi: &'a [f64],
    /// The trajectory about which differences are taken, already assessed.
    pub centre: &'a Point,
    /// A trial point, overwritten.
    pub trial: &'a mut Point,
    pub gradient: &'a mut GradientWorkspace,
    pub scratch: &'a mut Scratch,
}

impl Hessian {
    pub fn new(size: Dimensions, steps: usize) -> Self {
        let joint = size.joint();
        Self {
            law: Policy::zeros(size, steps),
            factors: Matrices::zeros(steps, size.controls, size.controls),
            cost: Matrices::zeros(steps + 1, joint, joint + 1),
            scale: 1.0,
            shift: 0.0,
        }
    }

    /// Sets gains and blocks for a trajectory: those of the Lagrangian's Hessian with the given costates where it is
    /// positive definite, otherwise those of the Gauss-Newton one, whichever curvature its expected cost has. `shift` is added to
    /// the blocks.
    ///
    /// # Errors
    /// Where neither is positive definite.
    pub fn prepare(
        &mut self,
        TaskAt { task, phi }: TaskAt,
        centre: &Point,
        costates: &Matrices,
        shift: f64,
        scratch: &mut Scratch,
    ) -> Result<(), Error> {
        let (plan, system) = (&centre.plan, &*task.system);
        self.shift = shift;
        plan.lagrangian_hessian(system, phi, costates, &mut self.cost, scratch);
        let dynamics = &plan.knots.dynamics;
        if self.factorise(dynamics).is_err() {
            self.cost.clear();
            let at = plan.trajectory.points();
            system.cost_quadratics(at, phi, Curvature::GaussNewton, &mut self.cost, scratch);
            self.factorise(dynamics)?;
        }
        let squares: f64 = plan.trajectory.controls.as_slice().iter().map(|u| u * u).sum();
        let count = (plan.trajectory.steps() * system.dimensions().controls) as f64;
        self.scale = if squares > 0.0 { (squares / count).sqrt() } else { 1.0 };
        Ok(())
    }

    /// The sweep over `cost`, and the factors of its `Q_uu`.
    fn factorise(&mut self, dynamics: &Matrices) -> Result<(), Error> {
        let regularisation = Regularisation { control: self.shift, state: 0.0 };
        let Self { law, factors, cost, .. } = self;
        solve_limited(Lq { dynamics, cost, regularisation, limits: None, with_value: false }, law)?;
        let (n, m) = (dynamics.rows(), factors.rows());
        let (width, stride, small) = (dynamics.stride(), law.curvature.stride(), factors.stride());
        let mut product = vec![0.0; n * m];
        for t in 0..factors.count() {
            let (f, s) = (dynamics.at(t), law.curvature.at(t + 1));
            for (i, row) in product.chunks_exact_mut(m).enumerate() {
                row.fill(0.0);
                for k in 0..n {
                    let b = &f[k * width + n..k * width + n + m];
                    row.iter_mut().zip(b).for_each(|(sum, b)| *sum += s[i * stride + k] * b);
                }
            }
            for a in 0..m {
                for b in 0..=a {
                    let own = cost.get(t, n + a, n + b) + if a == b { self.shift } else { 0.0 };
                    let through = (0..n).map(|i| f[i * width + n + a] * product[i * m + b]).sum::<f64>();
                    factors.at_mut(t)[a * small + b] = own + through;
                }
            }
            rows::cholesky(factors.at_mut(t), m, small)
                .map_err(|_| Error::not_definite("the control's curvature", t))?;
        }
        Ok(())
    }

    /// `v` times the inverse of the blocks.
    fn precondition(&self, v: &mut [f64]) {
        let m = self.factors.rows();
        for (t, v) in v.chunks_exact_mut(m).enumerate() {
            solve_column(self.factors.at(t), self.factors.stride(), v);
        }
    }

    /// Sets the vector of the next roll-out.
    pub fn set(&mut self, v: &[f64], factor: f64) {
        let m = self.factors.rows();
        for (t, v) in v.chunks_exact(m).enumerate() {
            self.law.feedforward.vector_mut(t).iter_mut().zip(v).for_each(|(k, v)| *k = factor * v);
        }
    }

    /// The central difference along `v` of the values that `at` computes at trajectories on both sides of the centre.
    pub fn difference(
        &mut self,
        v: &[f64],
        around: &mut Around,
        mut at: impl FnMut(&Self, &mut Around) -> Vec<f64>,
    ) -> Result<Vec<f64>, Error> {
        let largest = v.iter().fold(0.0, |most: f64, v| most.max(v.abs()));
        if largest == 0.0 || !largest.is_finite() {
            return Err(Error::NotFinite { what: "a direction of the controls" });
        }
        let step = DIFFERENCE * self.scale / largest;
        let mut sides = [Vec::new(), Vec::new()];
        for (side, sign) in sides.iter_mut().zip([1.0, -1.0]) {
            self.set(v, sign * step);
            let reference = &around.centre.plan.trajectory;
            let law = RollOut::Law { reference, policy: &self.law, step: 1.0, bounds: None };
            around.trial.follow(around.task.at(around.phi), law, around.scratch)?;
            *side = at(self, around);
        }
        let [up, down] = &sides;
        Ok(up.iter().zip(down).map(|(up, down)| (up - down) / (2.0 * step)).collect())
    }

    /// The Hessian times `v`.
    fn times(&mut self, v: &[f64], around: &mut Around) -> Result<Vec<f64>, Error> {
        let slope = |this: &Self, around: &mut Around| {
            let mut slope = vec![0.0; v.len()];
            let Around { task, phi, trial, gradient, scratch, .. } = around;
            let (task, feedback) = (trial.gradient(task, phi), Some(&this.law.feedback));
            slope_by_controls(&task, Quantity::EXPECTED_COST, feedback, gradient, scratch, &mut slope, None);
            slope
        };
        let mut product = self.difference(v, around, slope)?;
        product.iter_mut().zip(v).for_each(|(product, v)| *product += self.shift * v);
        Ok(product)
    }

    /// Solves `H x = b` by conjugate gradients, to the accuracy that `goal` sets.
    ///
    /// # Errors
    /// If a trajectory near the centre has no finite expected cost.
    pub fn solve(&mut self, b: &[f64], goal: Goal, around: &mut Around, found: &mut Found) -> Result<Solved, Error> {
        conjugate_gradients(&mut Products { hessian: self, around }, b, goal, found)
    }
}

/// The Hessian together with the point at which its products are computed, as the solver's matrix.
struct Products<'a, 'b> {
    hessian: &'a mut Hessian,
    around: &'a mut Around<'b>,
}

impl Operator for Products<'_, '_> {
    type Error = Error;

    fn times(&mut self, v: &[f64]) -> Result<Vec<f64>, Error> {
        self.hessian.times(v, self.around)
    }

    fn precondition(&self, v: &mut [f64]) {
        self.hessian.precondition(v);
    }
}
