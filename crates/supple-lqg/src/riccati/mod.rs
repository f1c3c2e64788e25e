mod bounds;
mod box_qp;
mod quadratic;

use supple_kernels::rows::{self, Into, Left, multiply, multiply_lower};
use supple_kernels::{Job, Lanes, Matrices, dispatch, padded};

pub use self::bounds::ControlBounds;
pub use self::box_qp::Limits;
use self::box_qp::{BoxQp, Gains};
use self::quadratic::{Products, Quadratic};
use crate::carried::Carried;
use crate::knots::Dimensions;
use crate::shape::Shape;

/// The control law and the cost-to-go that a backward sweep finds: `u = ubar + k + K (mu - xbar)`.
#[derive(Clone, Debug)]
pub struct Policy {
    /// Feedback `K`, m x n, N of them.
    pub feedback: Matrices,
    /// Feedforward `k`, length m, N of them.
    pub feedforward: Matrices,
    /// Curvature of the cost-to-go `S = J_xx`, n x n, N + 1 of them.
    pub curvature: Matrices,
    /// Slope of the cost-to-go `J_x`, length n, N + 1 of them.
    pub slope: Matrices,
    /// Value of information `Xi = K' Q_uu K`, n x n, N of them.
    pub value_of_information: Matrices,
    /// Which controls are held at a bound, so that their rows of `K` are zero: m of each of N steps.
    pub clamped: Vec<bool>,
    box_qp: BoxQp,
    q: Matrices,
    gain: Matrices,
    factor: Matrices,
    products: Products,
    measurements: usize,
}

impl Policy {
    /// Zeros for `steps` steps.
    pub fn zeros(dimensions: Dimensions, steps: usize) -> Self {
        let (n, m, joint) = (dimensions.states, dimensions.controls, dimensions.joint());
        Self {
            feedback: Matrices::zeros(steps, m, n),
            feedforward: Matrices::vectors(steps, m),
            curvature: Matrices::zeros(steps + 1, n, n),
            slope: Matrices::vectors(steps + 1, n),
            value_of_information: Matrices::zeros(steps, n, n),
            clamped: vec![false; steps * m],
            box_qp: BoxQp::new(m),
            q: Matrices::zeros(1, joint, joint + 1),
            gain: Matrices::zeros(1, m, joint + 1),
            factor: Matrices::zeros(1, m, m),
            products: Products::new(n, joint),
            measurements: dimensions.measurements,
        }
    }

    /// The same controls held, for another sweep; `None` where all are free.
    pub fn held(&self) -> Option<Limits<'_>> {
        self.clamped.contains(&true).then_some(Limits::Held(&self.clamped))
    }
}

/// Levenberg-Marquardt terms in the gains (theory, equation P.2d): each entry of the diagonal of `Q_uu` and of `S_{t+1}` grows
/// by a share of its size.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Regularisation {
    /// `mu_u`, the share of the diagonal of `Q_uu`.
    pub control: f64,
    /// `mu_x`, the share of the diagonal of `S_{t+1}`.
    pub state: f64,
}

/// What a step `alpha` along the search direction should change the cost by: `alpha linear + alpha^2 quadratic`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Decrease {
    /// `sum k' Q_u`, negative.
    pub linear: f64,
    /// `1/2 sum k' Q_uu k`.
    pub quadratic: f64,
}

/// The Riccati sweep over knots (theory, equation P.2), joint in `z = (x, u)` with `F = [A B]`:
///
/// ```text
/// Q = l_zz + F' S_{t+1} F     Q_z = l_z + F' J_x,{t+1}     k = -Q_uu^-1 Q_u     K = -Q_uu^-1 Q_ux
/// S = [I K'] Q [I; K]         J_x = [I K'] (Q [0; k] + Q_z)         Xi = K' Q_uu K
/// ```
///
/// `cost` is `[l_zz | l_z]`, (n + m) x (n + m + 1). Only the gains see the regularisation.
///
/// # Errors
/// The step at which `Q_uu` is not positive definite.
pub fn solve_riccati(
    dynamics: &Matrices,
    cost: &Matrices,
    regularisation: Regularisation,
    policy: &mut Policy,
) -> Result<Decrease, usize> {
    solve_limited(Lq { dynamics, cost, regularisation, limits: None }, policy)
}

/// What a sweep is about.
#[derive(Clone, Copy)]
pub struct Lq<'a> {
    /// `[A B]`, n x (n + m), N of them.
    pub dynamics: &'a Matrices,
    /// `[l_zz | l_z]`, (n + m) x (n + m + 1), N + 1 of them.
    pub cost: &'a Matrices,
    /// What gains are regularised by.
    pub regularisation: Regularisation,
    /// Limits of the controls.
    pub limits: Option<Limits<'a>>,
}

/// As [`solve_riccati`], under limits of the controls (theory, equation P.7).
///
/// # Errors
/// The step at which `Q_uu` is not positive definite on the controls that are free.
pub fn solve_limited(lq: Lq, policy: &mut Policy) -> Result<Decrease, usize> {
    dispatch(Sweep { lq, policy })
}

/// States from which the matrices of a horizon are more than a core's own memory holds.
const LARGE: usize = 24;

struct Sweep<'a> {
    lq: Lq<'a>,
    policy: &'a mut Policy,
}

impl Job for Sweep<'_> {
    type Output = Result<Decrease, usize>;

    #[inline(always)]
    fn run<L: Lanes>(self) -> Self::Output {
        let Self { lq, policy } = self;
        let n = lq.dynamics.rows();
        let shape = Shape::new(n, lq.dynamics.cols() - n, policy.measurements);
        if lq.limits.is_none() {
            policy.clamped.fill(false);
        }
        match (shape.is_small(), lq.limits) {
            (false, _) => sweep::<L>(shape, lq, policy),
            (true, Some(_)) => sweep::<L>(shape.small_rows(), lq, policy),
            // Said once more, so that the compiler leaves limits out.
            (true, None) => sweep::<L>(shape.small_rows(), Lq { limits: None, ..lq }, policy),
        }
    }
}

#[inline(always)]
fn sweep<L: Lanes>(shape: Shape, lq: Lq, policy: &mut Policy) -> Result<Decrease, usize> {
    let Lq { dynamics, cost, .. } = lq;
    let steps = dynamics.count();
    let (n, joint, stride) = (shape.n, shape.joint(), shape.full());
    let end = cost.at(steps);
    for i in 0..n {
        for j in 0..n {
            policy.curvature.set(steps, i, j, end[i * stride + j]);
        }
        policy.slope.vector_mut(steps)[i] = end[i * stride + joint];
    }
    let suggested = Carried::suggested(dynamics);
    let mut total = Decrease::default();
    for t in (0..steps).rev() {
        // Not by a closure, which would not run in lanes.
        let carried = match suggested {
            Some(carried) if carried.holds(dynamics.at(t), shape.wide()) => Some(carried),
            _ => None,
        };
        let Policy { curvature, slope, q, products, .. } = policy;
        let next = (curvature.at(t + 1), slope.vector(t + 1));
        let knot = (dynamics.at(t), cost.at(t));
        shape.part::<L, _>(Quadratic { shape, carried, knot, next, q: q.at_mut(0), products });
        if shape.n >= LARGE && t > 0 {
            rows::fetch(dynamics.at(t - 1));
            rows::fetch_lower(cost.at(t - 1), stride);
        }
        let decrease = if lq.limits.is_none() && lq.regularisation == Regularisation::default() {
            shape.part::<L, _>(Minimise { shape, t, policy })
        } else {
            shape.part::<L, _>(Follow { shape, t, lq, policy })
        };
        let decrease = decrease.map_err(|()| t)?;
        total.linear += decrease.linear;
        total.quadratic += decrease.quadratic;
    }
    Ok(total)
}

/// [`minimise`] as a part of a sweep.
struct Minimise<'a> {
    shape: Shape,
    t: usize,
    policy: &'a mut Policy,
}

impl Job for Minimise<'_> {
    type Output = Result<Decrease, ()>;

    #[inline(always)]
    fn run<L: Lanes>(self) -> Self::Output {
        minimise::<L>(self.shape, self.t, self.policy)
    }
}

/// [`follow`] as a part of a sweep.
struct Follow<'a> {
    shape: Shape,
    t: usize,
    lq: Lq<'a>,
    policy: &'a mut Policy,
}

impl Job for Follow<'_> {
    type Output = Result<Decrease, ()>;

    #[inline(always)]
    fn run<L: Lanes>(self) -> Self::Output {
        follow::<L>(self.shape, self.t, self.lq, self.policy)
    }
}

/// The minimiser at a step, by `Q_uu = G G'` and `Y = G^-1 Q_ux`: `K = -G^-T Y`, `S = Q_xx - Y' Y`, `Xi = Y' Y`.
#[inline(always)]
fn minimise<L: Lanes>(shape: Shape, t: usize, policy: &mut Policy) -> Result<Decrease, ()> {
    let Shape { n, m, .. } = shape;
    let (joint, narrow, wide, small) = (shape.joint(), shape.narrow(), shape.full(), shape.of_controls());
    let Policy { feedback, feedforward, curvature, slope, value_of_information, q, factor, .. } = policy;
    let (q, factor) = (q.at(0), factor.at_mut(0));
    let (y, k) = (feedback.at_mut(t), &mut feedforward.at_mut(t)[..m]);
    for a in 0..m {
        let row = &q[(n + a) * wide..(n + a + 1) * wide];
        factor[a * small..=a * small + a].copy_from_slice(&row[n..=n + a]);
        y[a * narrow..a * narrow + n].copy_from_slice(&row[..n]);
        k[a] = row[joint];
    }
    rows::cholesky(factor, m, small).map_err(drop)?;
    rows::solve_lower::<L>(factor, small, y, narrow, m);
    for a in 0..m {
        let done: f64 = rows::dot(&factor[a * small..a * small + a], &k[..a]);
        k[a] = (k[a] - done) / factor[a * small + a];
    }

    let (xi, curvature) = (value_of_information.at_mut(t), curvature.at_mut(t));
    multiply_lower::<L>((xi, narrow), Left::transposed(y, narrow), (y, narrow), (n, m), Into::Set);
    for i in 0..n {
        let (q, xi) = (&q[i * wide..=i * wide + i], &xi[i * narrow..=i * narrow + i]);
        for ((to, q), xi) in curvature[i * narrow..=i * narrow + i].iter_mut().zip(q).zip(xi) {
            *to = q - xi;
        }
    }
    rows::mirror::<L>(xi, n, narrow);
    rows::mirror::<L>(curvature, n, narrow);
    let slope = slope.at_mut(t);
    for i in 0..n {
        slope[i] = q[i * wide + joint];
    }
    for (a, &k) in k.iter().enumerate() {
        rows::add_scaled::<L>(&mut slope[..narrow], -k, &y[a * narrow..(a + 1) * narrow]);
    }
    let square = rows::dot(k, k);

    rows::solve_upper::<L>(factor, small, y, narrow, m);
    rows::scale::<L>(&mut y[..m * narrow], -1.0);
    for a in (0..m).rev() {
        let done: f64 = (a + 1..m).map(|b| factor[b * small + a] * k[b]).sum();
        k[a] = (k[a] - done) / factor[a * small + a];
    }
    k.iter_mut().for_each(|k| *k = -*k);
    Ok(Decrease { linear: -square, quadratic: 0.5 * square })
}

/// The gains of a regularised problem or one with limits, and the cost-to-go of following them:
/// `S = [I K'] Q [I; K]`.
#[inline(always)]
fn follow<L: Lanes>(shape: Shape, t: usize, lq: Lq, policy: &mut Policy) -> Result<Decrease, ()> {
    let Lq { dynamics, regularisation, limits, .. } = lq;
    let Shape { n, m, .. } = shape;
    let (joint, narrow, stride, wide) = (shape.joint(), shape.narrow(), shape.wide(), shape.full());
    let small = padded(m);
    let Policy { feedback, feedforward, curvature, slope, value_of_information, .. } = policy;
    let Policy { q, gain, products, factor, clamped, box_qp, .. } = policy;
    let (q, gain, factor_rows) = (q.at_mut(0), gain.at_mut(0), factor.at_mut(0));
    rows::mirror::<L>(q, joint, wide);
    let (f, next) = (dynamics.at(t), curvature.at(t + 1));

    // From the regularised lower rows [Q_ux Q_uu | Q_u]. F's padding is zero: the gradient is untouched.
    gain[..m * wide].copy_from_slice(&q[n * wide..joint * wide]);
    if regularisation.state > 0.0 {
        for a in 0..m {
            for k in 0..n {
                let factor = regularisation.state * next[k * narrow + k].abs() * f[k * stride + n + a];
                rows::add_scaled::<L>(&mut gain[a * wide..a * wide + stride], factor, &f[k * stride..(k + 1) * stride]);
            }
        }
    }
    if regularisation.control > 0.0 {
        for a in 0..m {
            let entry = &mut gain[a * wide + n + a];
            *entry += regularisation.control * entry.abs().max(f64::MIN_POSITIVE);
        }
    }
    let (feedback, feedforward) = (feedback.at_mut(t), &mut feedforward.at_mut(t)[..m]);
    if let Some(limits) = limits {
        let clamped = &mut clamped[t * m..(t + 1) * m];
        let gains = Gains { rows: gain, wide, n, feedback, narrow, feedforward, clamped };
        box_qp.solve::<L>(limits, t, gains)?;
    } else {
        for a in 0..m {
            for b in 0..=a {
                factor_rows[a * small + b] = gain[a * wide + n + b];
            }
        }
        rows::cholesky(factor_rows, m, small).map_err(drop)?;
        rows::cholesky_solve::<L>(factor_rows, small, gain, wide, m);
        for a in 0..m {
            for i in 0..n {
                feedback[a * narrow + i] = -gain[a * wide + i];
            }
            feedforward[a] = -gain[a * wide + joint];
        }
    }
    let mut decrease = Decrease::default();
    for a in 0..m {
        let lower = &q[(n + a) * wide..];
        decrease.linear += feedforward[a] * lower[joint];
        decrease.quadratic += 0.5 * feedforward[a] * rows::dot(&lower[n..joint], feedforward);
    }

    // Xi = K' Q_uu K, by rows of Q_uu K.
    let xi = value_of_information.at_mut(t);
    let quu_k = products.of_controls(m * narrow);
    multiply::<L>(quu_k, Left::plain(&q[n * wide + n..], wide), feedback, narrow, (m, m), Into::Set);
    multiply::<L>(xi, Left::transposed(feedback, narrow), quu_k, narrow, (n, m), Into::Set);
    rows::symmetrise::<L>(xi, n, narrow);

    // T = [I K'] Q, then [S | J_x] = T [I; K | k].
    let (upper, lower) = q.split_at_mut(n * wide);
    multiply::<L>(upper, Left::transposed(feedback, narrow), lower, wide, (n, m), Into::Add);
    let slope = &mut slope.at_mut(t)[..n];
    let curvature = curvature.at_mut(t);
    for i in 0..n {
        let row = &upper[i * wide..(i + 1) * wide];
        let to = &mut curvature[i * narrow..(i + 1) * narrow];
        to[..n].copy_from_slice(&row[..n]);
        for a in 0..m {
            rows::add_scaled::<L>(to, row[n + a], &feedback[a * narrow..(a + 1) * narrow]);
        }
        slope[i] = row[joint] + rows::dot(&row[n..joint], feedforward);
    }
    rows::symmetrise::<L>(curvature, n, narrow);
    Ok(decrease)
}

/// The minimiser of `sum 1/2 dz' H dz + h' dz` over `dx+ = F dz`, `dx_0 = 0`, with its costates, from a sweep over
/// `[H | h]`: `du = k + K dx`, `dlambda = S dx + J_x`.
///
/// `joint` receives `dz` (its control part 0 at the end), `costates` receives `dlambda`.
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
