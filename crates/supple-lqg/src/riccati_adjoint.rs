use supple_kernels::rows::{Left, Product, Rows, Scaled, View, ViewMut, add_scaled, scale, transpose};
use supple_kernels::{Job, Lanes, Matrices, dispatch};

use crate::belief::Belief;
use crate::carried::Carried;
use crate::knots::KnotAdjoints;
use crate::knots::Knots;
use crate::noise::Noise;
use crate::partials::Partials;
use crate::riccati::Policy;
use crate::shape::{Shape, by_length};
use crate::transport::{Mover, Transport};

/// Weights of the parts of the expected cost that depend on the Riccati recursion.
///
/// Example: [`reverse_riccati`].
#[derive(Clone, Copy, Debug, Default)]
pub struct RiccatiSeeds<'a> {
    /// Of `1/2 sum Tr(Xi_t Sigma_t)`, through `Xi`.
    pub belief: f64,
    /// Of `1/2 sum Tr(S_{t+1} W_t)`.
    pub process: f64,
    /// Of `1/2 Tr(S_0 X_0)`.
    pub initial: f64,
    /// Derivatives of an additional objective with respect to `Xi` and `K`.
    pub partials: Option<&'a Partials>,
}

/// Memory of the sweep.
///
/// Example: [`reverse_riccati`].
#[derive(Clone, Debug)]
pub struct RiccatiAdjoint {
    /// `Sb`.
    s: Matrices,
    /// `Qb`.
    q: Matrices,
    /// `K (Sb - Xb)`, m x n.
    moved: Matrices,
    /// `K'`, n x m.
    turned: Matrices,
    /// `K (Sb - Xb) K'`.
    controls: Matrices,
    transport: Transport,
}

impl RiccatiAdjoint {
    /// For states and `z = (x, u)` of these lengths.
    #[must_use]
    pub fn new(states: usize, joint: usize) -> Self {
        let controls = joint - states;
        Self {
            s: Matrices::zeros(1, states, states),
            q: Matrices::zeros(1, joint, joint),
            moved: Matrices::zeros(1, controls, states),
            turned: Matrices::zeros(1, states, controls),
            controls: Matrices::zeros(1, controls, controls),
            transport: Transport::new(states, joint),
        }
    }
}

/// The sweep through the Riccati recursion, forwards in time: adjoints with respect to `[A B]` (added to `adjoints`) and to
/// the cost's second derivatives (overwritten; theory, equations G.4 and G.9). With the adjoint `Sb` of S_t and `Xb
/// = belief/2 Sigma_t` of Xi_t, as `S` is the least of `[I K'] Q [I; K]` over K, and `Xi = Q_xx - S`:
///
/// ```text
/// Qb = [I; K] (Sb - Xb) [I K'] + blkdiag(Xb, 0)      l_zz,b = Qb
/// Fb += 2 S_{t+1} F Qb                               Sb_{t+1} = F Qb F' + process/2 W
/// ```
///
/// ```
/// use supple_lqg::{Belief, KnotAdjoints, Knots, LinearQuadratic, Noise, Policy, Regularisation, RiccatiAdjoint, RiccatiSeeds};
/// use supple_lqg::{constant, reverse_riccati, solve_riccati};
///
/// // Nothing carries over or can be controlled, x+ = w: S_t = Q, and the cost of the noise is W Q / 2 per step.
/// let plant = LinearQuadratic { a: &[[0.0]], b: &[[0.0]], c: &[[1.0]], q: &[[1.0]], r: &[[1.0]] };
/// let knots = Knots::linear(10, plant)?;
/// let mut policy = Policy::zeros(knots.dimensions, 10);
/// solve_riccati(&knots.dynamics, &knots.cost, Regularisation::default(), &mut policy)?;
/// let one = constant(&[[1.0]]);
/// let noise = Noise { initial: one.clone(), process: one.clone(), measurement: one };
/// let seeds = RiccatiSeeds { process: 1.0, ..RiccatiSeeds::default() };
/// let (mut work, mut adjoints) = (RiccatiAdjoint::new(1, 2), KnotAdjoints::zeros(knots.dimensions, 10));
/// reverse_riccati(&knots, &policy, &Belief::zeros(1, 1, 10), &noise, seeds, &mut work, &mut adjoints);
/// assert!((adjoints.cost.get(5, 0, 0) - 0.5).abs() < 1e-12, "the derivative with respect to Q at step 5: W / 2");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn reverse_riccati(
    knots: &Knots,
    policy: &Policy,
    belief: &Belief,
    noise: &Noise,
    seeds: RiccatiSeeds,
    work: &mut RiccatiAdjoint,
    adjoints: &mut KnotAdjoints,
) {
    adjoints.has_cost = true;
    dispatch(Sweep { knots, policy, belief, noise, seeds, work, adjoints });
}

struct Sweep<'a> {
    knots: &'a Knots,
    policy: &'a Policy,
    belief: &'a Belief,
    noise: &'a Noise,
    seeds: RiccatiSeeds<'a>,
    work: &'a mut RiccatiAdjoint,
    adjoints: &'a mut KnotAdjoints,
}

/// Number of states from which exploiting the position-rate structure pays off.
const LEAST: usize = 12;

impl Job for Sweep<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        by_length!(self.knots.dimensions, |R| self.sweep::<L, R>())
    }
}

impl Sweep<'_> {
    #[inline(always)]
    fn sweep<L: Lanes, R: Rows>(self) {
        let Self { knots, policy, belief, noise, seeds, work, adjoints } = self;
        let (steps, shape) = (knots.steps(), Shape::<R>::of(knots.dimensions));
        let (n, joint, narrow, wide, full) = (shape.n, shape.joint(), shape.narrow(), shape.wide(), shape.full());
        let suggested = if !R::CALLED { None } else { Carried::suggested(&knots.dynamics, LEAST) };
        work.s.clear();
        add_scaled::<L>(work.s.at_mut(0), 0.5 * seeds.initial, noise.initial.at(0));
        for t in 0..steps {
            let sigma = belief.corrected.at(t);
            let s = work.s.at_mut(0);
            add_scaled::<L>(s, -0.5 * seeds.belief, sigma);
            if let Some(partials) = seeds.partials {
                add_scaled::<L>(s, -1.0, partials.value_of_information.at(t));
            }
            let by_value = Scaled { from: View::new(sigma, narrow), factor: 0.5 * seeds.belief, rows: n, count: n };
            work.close::<L, R>(shape, policy.feedback.at(t), by_value);
            let RiccatiAdjoint { s, q, transport, .. } = &mut *work;
            let (s, q) = (s.at_mut(0), q.at_mut(0));
            if let Some(partials) = seeds.partials {
                add_partials(knots, policy, partials, t, ViewMut::new(q, wide));
            }
            let q = View::new(q, wide);
            let kept = Scaled { from: q, factor: 1.0, rows: joint, count: joint };
            kept.set::<L, R>(ViewMut::new(adjoints.cost.at_mut(t), full));
            // Sb_{t+1} = F Qb F' + W part; Fb += 2 S F Qb.
            let f = knots.dynamics.at(t);
            let carried = Carried::at_step::<L>(suggested, f, wide);
            let mover = Mover { f: View::new(f, wide), rows: n, columns: joint, carried };
            mover.transport::<L, R>(q, None, s, transport);
            add_scaled::<L>(s, 0.5 * seeds.process, noise.process.at(t));
            mover.carry::<L, R>(q, transport);
            let product = transport.product.at_mut(0);
            scale::<L>(product, 2.0);
            let (left, right) = (Left::transposed(policy.curvature.at(t + 1), narrow), View::new(product, wide));
            let by_dynamics = Product { left, right, rows: n, inner: n, width: wide };
            by_dynamics.add::<L, R>(ViewMut::new(adjoints.dynamics.at_mut(t), wide));
        }
        let to = adjoints.cost.at_mut(steps);
        to.fill(0.0);
        let kept = Scaled { from: View::new(work.s.at(0), narrow), factor: 1.0, rows: n, count: n };
        kept.set::<L, R>(ViewMut::new(to, full));
    }
}

impl RiccatiAdjoint {
    /// `Qb = [I; K] M [I K'] + blkdiag(Xb, 0)` with the symmetric `M` in `s`.
    #[inline(always)]
    fn close<L: Lanes, R: Rows>(&mut self, shape: Shape<R>, feedback: &[f64], by_value: Scaled) {
        let Shape { n, m, .. } = shape;
        let (narrow, wide, small) = (shape.narrow(), shape.wide(), shape.of_controls());
        let Self { s, q, moved, turned, controls, .. } = self;
        let (s, q, moved) = (s.at(0), q.at_mut(0), moved.at_mut(0));
        let (turned, controls) = (turned.at_mut(0), controls.at_mut(0));
        let (left, right) = (Left::plain(feedback, narrow), View::new(s, narrow));
        Product { left, right, rows: m, inner: n, width: narrow }.set::<L, R>(ViewMut::new(moved, narrow));
        transpose::<L, R>(ViewMut::new(turned, small), View::new(feedback, narrow), m, n);
        let (left, right) = (Left::plain(moved, narrow), View::new(turned, small));
        Product { left, right, rows: m, inner: n, width: small }.set::<L, R>(ViewMut::new(controls, small));

        by_value.add_to::<L, R>(View::new(s, narrow), ViewMut::new(q, wide));
        let kept = Scaled { from: View::new(moved, narrow), factor: 1.0, rows: m, count: n };
        kept.set::<L, R>(ViewMut::new(&mut q[n * wide..], wide));
        transpose::<L, R>(ViewMut::new(&mut q[n..], wide), View::new(moved, narrow), m, n);
        for a in 0..m {
            let to = (n + a) * wide + n;
            q[to..to + m].copy_from_slice(&controls[a * small..a * small + m]);
        }
    }
}

/// Adds to `Qb` the derivatives of the additional objective through `Xi_t` and `K_t`.
fn add_partials(knots: &Knots, policy: &Policy, partials: &Partials, t: usize, q: ViewMut) {
    let ViewMut { numbers: q, stride } = q;
    let n = knots.dimensions.states;
    for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
        q[i * stride + j] += partials.value_of_information.get(t, i, j);
    }
    if let Some(through) = partials.through_feedback(knots, policy, t) {
        for (i, j) in (0..through.nrows()).flat_map(|i| (0..through.ncols()).map(move |j| (i, j))) {
            q[i * stride + j] += through[(i, j)];
        }
    }
}
