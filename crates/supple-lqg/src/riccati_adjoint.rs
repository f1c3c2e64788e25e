use supple_kernels::rows::{self, Into, Left, multiply};
use supple_kernels::{Job, Lanes, Matrices, dispatch};

use crate::belief::Belief;
use crate::knots::KnotAdjoints;
use crate::knots::Knots;
use crate::noise::Noise;
use crate::partials::Partials;
use crate::riccati::Policy;
use crate::shape::{Shape, with_shape};

/// Weights of the parts of the expected cost that depend on the Riccati recursion.
#[derive(Clone, Copy, Debug, Default)]
pub struct RiccatiSeeds<'a> {
    /// Of `1/2 sum Tr(Xi_t Sigma_t)`, through `Xi`.
    pub belief: f64,
    /// Of `1/2 sum Tr(S_{t+1} W_t)`.
    pub process: f64,
    /// Of `1/2 Tr(S_0 X_0)`.
    pub initial: f64,
    /// Derivatives of another number by `Xi` and `K`.
    pub partials: Option<&'a Partials>,
}

/// Memory of the sweep.
#[derive(Clone, Debug)]
pub struct RiccatiAdjoint {
    s: Matrices,
    q: Matrices,
    product: Matrices,
    closed: Matrices,
    transposed: Matrices,
}

impl RiccatiAdjoint {
    /// For states and `z = (x, u)` of these lengths.
    pub fn new(states: usize, joint: usize) -> Self {
        Self {
            s: Matrices::zeros(1, states, states),
            q: Matrices::zeros(1, joint, joint),
            product: Matrices::zeros(1, states, joint),
            closed: Matrices::zeros(1, joint, states),
            transposed: Matrices::zeros(1, joint, states),
        }
    }
}

/// The sweep through the Riccati recursion, forwards in time: adjoints by `[A B]` and the cost's second derivatives,
/// the first added to `adjoints`, the second written over (theory, equations G.4 and G.9). With the adjoint `Sb` of S_t and `Xb = belief/2 Sigma_t` of Xi_t, as
/// `S` is the least of `[I K'] Q [I; K]` over K, and `Xi = Q_xx - S`:
///
/// ```text
/// Qb = [I; K] (Sb - Xb) [I K'] + blkdiag(Xb, 0)      l_zz,b = Qb
/// Fb += 2 S_{t+1} F Qb                               Sb_{t+1} = F Qb F' + process/2 W
/// ```
pub fn reverse_riccati(
    (knots, policy, belief, noise): (&Knots, &Policy, &Belief, &Noise),
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

impl Job for Sweep<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        with_shape!(Shape::of(self.knots.dimensions), |shape| self.sweep::<L>(shape));
    }
}

impl Sweep<'_> {
    #[inline(always)]
    fn sweep<L: Lanes>(self, shape: Shape) {
        let Self { knots, policy, belief, noise, seeds, work, adjoints } = self;
        let RiccatiAdjoint { s, q, product, closed, transposed } = work;
        let (steps, n, joint) = (knots.steps(), shape.n, shape.joint());
        let (narrow, wide, full) = (shape.narrow(), shape.wide(), shape.full());
        let (s, q, product) = (s.at_mut(0), q.at_mut(0), product.at_mut(0));
        let (closed, transposed) = (closed.at_mut(0), transposed.at_mut(0));
        s.fill(0.0);
        rows::add_scaled::<L>(s, 0.5 * seeds.initial, noise.initial.at(0));
        for t in 0..steps {
            let sigma = belief.corrected.at(t);
            rows::add_scaled::<L>(s, -0.5 * seeds.belief, sigma);
            if let Some(partials) = seeds.partials {
                rows::add_scaled::<L>(s, -1.0, partials.value_of_information.at(t));
            }
            // closed = [I; K] (Sb - Xb), transposed = [I; K]; Qb = closed [I K'].
            let feedback = policy.feedback.at(t);
            closed[..n * narrow].copy_from_slice(s);
            multiply::<L>(
                &mut closed[n * narrow..],
                Left::plain(feedback, narrow),
                s,
                narrow,
                (joint - n, n),
                Into::Set,
            );
            for i in 0..joint {
                let row = &mut q[i * wide..(i + 1) * wide];
                let left = &closed[i * narrow..i * narrow + n];
                row[..n].copy_from_slice(left);
                for (a, entry) in row[n..joint].iter_mut().enumerate() {
                    *entry = rows::dot(left, &feedback[a * narrow..a * narrow + n]);
                }
            }
            for i in 0..n {
                let row = &mut q[i * wide..i * wide + n];
                for (entry, sigma) in row.iter_mut().zip(&sigma[i * narrow..]) {
                    *entry += 0.5 * seeds.belief * sigma;
                }
            }
            if let Some(partials) = seeds.partials {
                add_partials((knots, policy, partials), t, (&mut *q, wide));
            }
            let to = adjoints.cost.at_mut(t);
            for i in 0..joint {
                to[i * full..i * full + joint].copy_from_slice(&q[i * wide..i * wide + joint]);
            }
            // product = F Qb; Sb_{t+1} = product F' + W part; Fb += 2 S product.
            let f = knots.dynamics.at(t);
            multiply::<L>(product, Left::plain(f, wide), q, wide, (n, joint), Into::Set);
            rows::transpose::<L>(transposed, narrow, f, wide, (n, joint));
            multiply::<L>(s, Left::plain(product, wide), transposed, narrow, (n, joint), Into::Set);
            rows::symmetrise::<L>(s, n, narrow);
            rows::add_scaled::<L>(s, 0.5 * seeds.process, noise.process.at(t));
            rows::scale::<L>(product, 2.0);
            let next = policy.curvature.at(t + 1);
            multiply::<L>(adjoints.dynamics.at_mut(t), Left::plain(next, narrow), product, wide, (n, n), Into::Add);
        }
        let to = adjoints.cost.at_mut(steps);
        to.fill(0.0);
        for i in 0..n {
            to[i * full..i * full + n].copy_from_slice(&s[i * narrow..i * narrow + n]);
        }
    }
}

/// Adds to `Qb`, rows `stride` apart, what another number has by `Xi_t` and `K_t`.
fn add_partials((knots, policy, partials): (&Knots, &Policy, &Partials), t: usize, (q, stride): (&mut [f64], usize)) {
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
