use nalgebra::DMatrix;
use supple_kernels::math;
use supple_kernels::rows::{self, Left, Long, Product, View, ViewMut};
use supple_kernels::{Job, Lanes, Matrices, dispatch, padded};
use supple_lqg::Noise;

use crate::Error;
use crate::cost_parts::CostParts;
use crate::pipeline::TaskState;

/// What a filter sees of one task along its plan when each candidate sensor counts with a weight: a candidate with the
/// weight `z` has `1 / z` times its noise, at 0 it is absent (theory, equation N.1).
#[derive(Clone, Debug)]
pub(super) struct Sight {
    /// `[A B]`, n x (n + m), N of them.
    dynamics: Matrices,
    /// `X_0` and `W`.
    initial: Matrices,
    process: Matrices,
    /// `Xi_t`, n x n, N of them.
    value: Matrices,
    /// Rows `c` of the measurement divided by their noise's root, p x n, N + 1 of them: unit noise, independent.
    rows: Matrices,
    /// Owner of each row: a candidate, or `None` for a sensor that is always there.
    owners: Vec<Option<usize>>,
    /// The parts of the cost that no sensor changes.
    fixed: f64,
}

/// What a set of sensors is worth in one task, or in several together.
///
/// Example: [`Searched`](crate::sensors::Searched).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Worth {
    /// Expected cost, along the plan as it is.
    pub cost: f64,
    /// Directed information from the state to the measurements, nats.
    pub information: f64,
}

/// Memory of the sweeps, for one thread.
#[derive(Clone, Debug)]
pub(super) struct Memory {
    predicted: Matrices,
    corrected: Matrices,
    square: Matrices,
    other: Matrices,
    adjoint: Matrices,
    vectors: Matrices,
    /// `Sigma_t` of all steps, for the backward sweep.
    kept: Matrices,
}

/// Which number is differentiated: `cost` times the cost plus `information` times the directed information.
#[derive(Clone, Copy, Debug)]
pub(super) struct Weights {
    pub cost: f64,
    pub information: f64,
}

impl Sight {
    /// Builds it for a planned task. `owners` maps each measurement row to its owner: a
    /// candidate, a sensor that is always there (`Some(None)`), or none if it is unused (`None`).
    ///
    /// # Errors
    /// Where noise is not positive definite, is shared between owners, or the value of information is indefinite.
    pub fn new(state: &TaskState, owners: &[Option<Option<usize>>]) -> Result<Self, Error> {
        let Noise { initial, process, measurement } = &state.noise;
        let CostParts { nominal, process: of_process, initial: of_start, .. } = state.cost;
        let value = &state.plan.policy.value_of_information;
        check_semidefinite(value)?;
        let used: Vec<usize> = (0..owners.len()).filter(|&row| owners[row].is_some()).collect();
        let rows = whitened(&state.plan.knots.measurement, measurement, owners, &used)?;
        Ok(Self {
            dynamics: state.plan.knots.dynamics.clone(),
            initial: initial.clone(),
            process: process.clone(),
            value: value.clone(),
            rows,
            owners: used.iter().filter_map(|&row| owners[row]).collect(),
            fixed: nominal + of_process + of_start,
        })
    }

    /// Memory for [`worth`](Self::worth) and, with `gradients`, for [`gradient`](Self::gradient).
    pub fn memory(&self, gradients: bool) -> Memory {
        let n = self.initial.rows();
        let square = || Matrices::zeros(1, n, n);
        Memory {
            predicted: square(),
            corrected: square(),
            square: square(),
            other: square(),
            adjoint: square(),
            vectors: Matrices::zeros(1, 4, n),
            kept: if gradients { Matrices::zeros(self.dynamics.count() + 1, n, n) } else { square() },
        }
    }

    /// Cost and information with given weights of the candidates, each from 0 to 1.
    pub fn worth(&self, z: &[f64], memory: &mut Memory) -> Worth {
        dispatch(Forward { sight: self, z, memory, keep: false })
    }

    /// The same; adds to `gradient` the derivatives, by the weights, of the quantity that `of` defines.
    pub fn gradient(&self, z: &[f64], of: Weights, memory: &mut Memory, gradient: &mut [f64]) -> Worth {
        let found = dispatch(Forward { sight: self, z, memory, keep: true });
        dispatch(Backward { sight: self, z, of, memory, gradient });
        found
    }

    fn weight(&self, row: usize, z: &[f64]) -> f64 {
        self.owners[row].map_or(1.0, |owner| z[owner])
    }
}

/// Checks that the value of information is positive semidefinite up to rounding, as convexity requires.
fn check_semidefinite(value: &Matrices) -> Result<(), Error> {
    let n = value.rows();
    let (mut least, mut step, mut greatest) = (0.0, 0, 0.0_f64);
    for t in 0..value.count() {
        let eigenvalues = DMatrix::from_fn(n, n, |i, j| value.get(t, i, j)).symmetric_eigenvalues();
        greatest = greatest.max(eigenvalues.max());
        if eigenvalues.min() < least {
            (least, step) = (eigenvalues.min(), t);
        }
    }
    let what = "the value of information";
    if least < -INDEFINITE * greatest { Err(Error::not_definite(what, step)) } else { Ok(()) }
}

/// Eigenvalues of the value of information down to this, relative to the greatest of all steps, are rounding.
const INDEFINITE: f64 = 1e-9;

/// `L^-1 C` with the Cholesky factor `L` of the noise of all used rows, step by step.
fn whitened(c: &Matrices, v: &Matrices, owners: &[Option<Option<usize>>], used: &[usize]) -> Result<Matrices, Error> {
    let (steps, n, p) = (c.count(), c.cols(), used.len());
    let mut rows = Matrices::zeros(steps, p, n);
    let mut factor = vec![0.0; p * p];
    for t in 0..steps {
        for (i, &row) in used.iter().enumerate() {
            for (j, &col) in used.iter().enumerate().take(i + 1) {
                let shared = v.get(t, row, col);
                if shared != 0.0 && owners[row] != owners[col] {
                    return Err(Error::CorrelatedSensors { first: col, second: row });
                }
                factor[i * p + j] = shared;
            }
        }
        let indefinite = |_| Error::not_definite("the measurement covariance", t);
        rows::cholesky(&mut factor, p, p).map_err(indefinite)?;
        for (i, &row) in used.iter().enumerate() {
            for a in 0..n {
                let above: f64 = (0..i).map(|j| factor[i * p + j] * rows.get(t, j, a)).sum();
                rows.set(t, i, a, (c.get(t, row, a) - above) / factor[i * p + i]);
            }
        }
    }
    Ok(rows)
}

struct Forward<'a> {
    sight: &'a Sight,
    z: &'a [f64],
    memory: &'a mut Memory,
    keep: bool,
}

impl Job for Forward<'_> {
    type Output = Worth;

    #[inline(always)]
    fn run<L: Lanes>(self) -> Worth {
        let Self { sight, z, memory, keep } = self;
        let (steps, n, stride) = (sight.dynamics.count(), sight.initial.rows(), sight.initial.stride());
        let (mut belief, mut information) = (0.0, 0.0);
        memory.corrected.at_mut(0).copy_from_slice(sight.initial.at(0));
        for t in 0..=steps {
            if t > 0 {
                predict::<L>(sight, t - 1, memory);
            }
            for row in 0..sight.owners.len() {
                let weight = sight.weight(row, z);
                if weight > 0.0 {
                    let c = &sight.rows.at(t)[row * stride..(row + 1) * stride];
                    information += correct::<L>((n, stride), (c, weight), memory);
                }
            }
            if t < steps {
                belief += 0.5 * rows::dot(sight.value.at(t), memory.corrected.at(0));
            }
            if keep {
                let Memory { kept, corrected, .. } = memory;
                kept.at_mut(t).copy_from_slice(corrected.at(0));
            }
        }
        Worth { cost: sight.fixed + belief, information }
    }
}

/// `P = A Sigma A' + W`, in the place of `Sigma`.
#[inline(always)]
fn predict<L: Lanes>(sight: &Sight, from: usize, memory: &mut Memory) {
    let (n, stride, wide) = (sight.initial.rows(), sight.initial.stride(), sight.dynamics.stride());
    let f = sight.dynamics.at(from);
    let Memory { predicted, corrected, square, other, .. } = memory;
    let moved = square_product(n, Left::plain(f, wide), View::new(corrected.at(0), stride));
    moved.set::<L, Long>(ViewMut::new(square.at_mut(0), stride));
    rows::transpose::<L, Long>(ViewMut::new(other.at_mut(0), stride), View::new(f, wide), n, n);
    let moved = square_product(n, Left::plain(square.at(0), stride), View::new(other.at(0), stride));
    let noise = View::new(sight.process.at(from), stride);
    moved.add_to::<L, Long>(noise, ViewMut::new(predicted.at_mut(0), stride));
    rows::symmetrise::<L, Long>(ViewMut::new(predicted.at_mut(0), stride), n);
    std::mem::swap(predicted, corrected);
}

/// The product of two matrices of order `n`.
#[inline(always)]
fn square_product<'a>(n: usize, left: Left<'a>, right: View<'a>) -> Product<'a> {
    Product { left, right, rows: n, inner: n, width: padded(n) }
}

/// One row of unit noise with a weight, in Joseph form (theory, equation N.2); its information, nats:
///
/// ```text
/// g = P c   s = c' g   k = z g / (1 + z s)   T = P - k g'   Sigma = T - (T c - g / (1 + z s)) k'
/// ```
#[inline(always)]
fn correct<L: Lanes>((n, stride): (usize, usize), (c, weight): (&[f64], f64), memory: &mut Memory) -> f64 {
    let Memory { corrected, vectors, .. } = memory;
    let p = corrected.at_mut(0);
    let (g, rest) = vectors.at_mut(0).split_at_mut(stride);
    let (k, defect) = rest.split_at_mut(stride);
    let defect = &mut defect[..stride];
    times::<L>(g, p, c, (n, stride));
    let seen = rows::dot(&g[..n], &c[..n]);
    let share = 1.0 / (1.0 + weight * seen);
    k.copy_from_slice(g);
    rows::scale::<L>(k, weight * share);
    for i in 0..n {
        rows::add_scaled::<L>(&mut p[i * stride..(i + 1) * stride], -k[i], g);
    }
    times::<L>(defect, p, c, (n, stride));
    rows::add_scaled::<L>(defect, -share, g);
    for i in 0..n {
        rows::add_scaled::<L>(&mut p[i * stride..(i + 1) * stride], -defect[i], k);
    }
    rows::symmetrise::<L, Long>(ViewMut::new(p, stride), n);
    0.5 * math::ln_1p(weight * seen)
}

/// `out = P c` for a symmetric `P`, by its rows.
#[inline(always)]
fn times<L: Lanes>(out: &mut [f64], p: &[f64], c: &[f64], (n, stride): (usize, usize)) {
    out.fill(0.0);
    for j in (0..n).filter(|&j| c[j] != 0.0) {
        rows::add_scaled::<L>(out, c[j], &p[j * stride..(j + 1) * stride]);
    }
}

struct Backward<'a> {
    sight: &'a Sight,
    z: &'a [f64],
    of: Weights,
    memory: &'a mut Memory,
    gradient: &'a mut [f64],
}

impl Job for Backward<'_> {
    type Output = ();

    /// With the adjoint `Sb` of `Sigma_t`, `h = Sigma c`, `M = I - sum z h c'` and `i` the weight of the information
    /// (theory, equation N.4):
    ///
    /// ```text
    /// zb += i/2 c' h - h' Sb h      Pb = M' Sb M + i/2 (sum z c c') M      Sb_{t-1} = A' Pb A + 1/2 Xi_{t-1}
    /// ```
    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self { sight, z, of, memory, gradient } = self;
        let (steps, n, stride) = (sight.dynamics.count(), sight.initial.rows(), sight.initial.stride());
        memory.adjoint.clear();
        for t in (0..=steps).rev() {
            let Memory { square, other, adjoint, vectors, kept, .. } = memory;
            if t < steps {
                rows::add_scaled::<L>(adjoint.at_mut(0), 0.5 * of.cost, sight.value.at(t));
            }
            // M in `square`, the precision of the measurements in `other`.
            let (m, precision) = (square.at_mut(0), other.at_mut(0));
            m.fill(0.0);
            precision.fill(0.0);
            (0..n).for_each(|i| m[i * stride + i] = 1.0);
            let (h, rest) = vectors.at_mut(0).split_at_mut(stride);
            let weighed = &mut rest[..stride];
            for row in 0..sight.owners.len() {
                let c = &sight.rows.at(t)[row * stride..(row + 1) * stride];
                times::<L>(h, kept.at(t), c, (n, stride));
                if let Some(owner) = sight.owners[row] {
                    times::<L>(weighed, adjoint.at(0), h, (n, stride));
                    let through = rows::dot(&weighed[..n], &h[..n]);
                    gradient[owner] += 0.5 * of.information * rows::dot(&c[..n], &h[..n]) - through;
                }
                let weight = sight.weight(row, z);
                for i in 0..n {
                    rows::add_scaled::<L>(&mut m[i * stride..(i + 1) * stride], -weight * h[i], c);
                    rows::add_scaled::<L>(&mut precision[i * stride..(i + 1) * stride], weight * c[i], c);
                }
            }
            if t == 0 {
                break;
            }
            back::<L>(sight, t, 0.5 * of.information, memory);
        }
    }
}

/// From `Sb_t` in `adjoint`, `M` in `square` and the precision in `other` to `A' Pb A` in `adjoint`.
#[inline(always)]
fn back<L: Lanes>(sight: &Sight, t: usize, information: f64, memory: &mut Memory) {
    let (n, stride, wide) = (sight.initial.rows(), sight.initial.stride(), sight.dynamics.stride());
    let Memory { predicted, corrected, square, other, adjoint, .. } = memory;
    let m = View::new(square.at(0), stride);
    let by_right = square_product(n, Left::plain(adjoint.at(0), stride), m);
    by_right.set::<L, Long>(ViewMut::new(corrected.at_mut(0), stride));
    let both = square_product(n, Left::transposed(m.numbers, stride), View::new(corrected.at(0), stride));
    both.set::<L, Long>(ViewMut::new(predicted.at_mut(0), stride));
    if information != 0.0 {
        rows::scale::<L>(other.at_mut(0), information);
        let told = square_product(n, Left::plain(other.at(0), stride), m);
        told.add::<L, Long>(ViewMut::new(predicted.at_mut(0), stride));
    }
    rows::symmetrise::<L, Long>(ViewMut::new(predicted.at_mut(0), stride), n);
    let f = sight.dynamics.at(t - 1);
    let through = corrected.at_mut(0);
    let moved = square_product(n, Left::plain(predicted.at(0), stride), View::new(f, wide));
    moved.set::<L, Long>(ViewMut::new(through, stride));
    // The first numbers of rows of `[A B]` may hold columns of B.
    for i in 0..n {
        through[i * stride + n..(i + 1) * stride].fill(0.0);
    }
    let moved = square_product(n, Left::transposed(f, wide), View::new(through, stride));
    moved.set::<L, Long>(ViewMut::new(adjoint.at_mut(0), stride));
    rows::symmetrise::<L, Long>(ViewMut::new(adjoint.at_mut(0), stride), n);
}
