use supple_kernels::rows::{self, Into, Left, multiply};
use supple_kernels::{Job, Lanes, Matrices, dispatch};

use super::Belief;
use super::kalman::Form;
use super::sequential::ReverseEach;
use crate::dense::{cholesky, dense};
use crate::knots::KnotAdjoints;
use crate::knots::Knots;
use crate::noise::Noise;
use crate::shape::{Shape, with_shape};

/// What the reverse sweep differentiates: `information DI + 1/2 sum_{t<N} Tr(weights_t Sigma_t)`.
#[derive(Clone, Copy, Debug, Default)]
pub struct BeliefSeeds<'a> {
    /// Weight of the directed information.
    pub information: f64,
    /// Weights of the corrected covariances, symmetric n x n, N of them, held fixed; their factor.
    pub weights: Option<(&'a Matrices, f64)>,
    /// Derivatives of another number, which is added, by all `P_t` and by all `Sigma_t`, n x n, N + 1 of each.
    pub covariances: Option<(&'a Matrices, &'a Matrices)>,
}

/// Memory of the reverse sweep.
#[derive(Clone, Debug)]
pub struct BeliefAdjoint {
    pub(super) sigma: Matrices,
    square: Matrices,
    pub(super) other: Matrices,
    pub(super) cross: Matrices,
    inverse: Matrices,
}

impl BeliefAdjoint {
    /// Memory for given sizes.
    pub fn new(states: usize, measurements: usize) -> Self {
        let (n, p) = (states, measurements);
        Self {
            sigma: Matrices::zeros(1, n, n),
            square: Matrices::zeros(1, n, n),
            other: Matrices::zeros(1, n, n),
            cross: Matrices::zeros(1, p, n),
            inverse: Matrices::zeros(1, p, p),
        }
    }
}

/// One reverse sweep through the Kalman recursion: adjoints of a number by `A`, `C`, `W`, `V` and `X_0` at every knot
/// (theory, equation G.3). With `M = I - L C` and the adjoints `Sb` of Sigma and `Pb` of P:
///
/// ```text
/// Pb = M' Sb M + i/2 C' (S^y)^-1 C      Cb = i L' - 2 L' Sb Sigma     Vb += L' Sb L + i/2 ((S^y)^-1 - V^-1)
/// Ab_{t-1} = 2 Pb A Sigma_{t-1}         Wb += Pb                      Sb_{t-1} = A' Pb A + 1/2 weights_{t-1}
/// ```
///
/// with `i` the weight of the information. Overwrites `adjoints.dynamics` (its A part; B has none) and
/// `adjoints.measurement` (but where measurements are states, taken one at a time: `C` has no adjoint then); adds to
/// `noise_adjoint`, whose constant matrices become sums over all steps.
pub fn reverse_kalman(
    (knots, noise, belief): (&Knots, &Noise, &Belief),
    seeds: BeliefSeeds,
    work: &mut BeliefAdjoint,
    adjoints: &mut KnotAdjoints,
    noise_adjoint: &mut Noise,
) {
    dispatch(Sweep { knots, noise, belief, seeds, work, adjoints, noise_adjoint });
}

struct Sweep<'a> {
    knots: &'a Knots,
    noise: &'a Noise,
    belief: &'a Belief,
    seeds: BeliefSeeds<'a>,
    work: &'a mut BeliefAdjoint,
    adjoints: &'a mut KnotAdjoints,
    noise_adjoint: &'a mut Noise,
}

impl Job for Sweep<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(mut self) {
        with_shape!(Shape::of(self.knots.dimensions), |shape| self.sweep::<L>(shape));
    }
}

/// [`Sweep::correct`] as a part of the sweep.
struct Correct<'s, 'a> {
    sweep: &'s mut Sweep<'a>,
    shape: Shape,
    t: usize,
}

impl Job for Correct<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        self.sweep.correct::<L>(self.shape, self.t);
    }
}

/// [`Sweep::predict`] as a part of the sweep.
struct Predict<'s, 'a> {
    sweep: &'s mut Sweep<'a>,
    shape: Shape,
    t: usize,
}

impl Job for Predict<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        self.sweep.predict::<L>(self.shape, self.t);
    }
}

impl Sweep<'_> {
    #[inline(always)]
    fn sweep<L: Lanes>(&mut self, shape: Shape) {
        let steps = self.knots.steps();
        self.work.sigma.clear();
        if let Some((_, by_corrected)) = self.seeds.covariances {
            rows::add_scaled::<L>(self.work.sigma.at_mut(0), 1.0, by_corrected.at(steps));
        }
        let picks = self.knots.picks.as_deref().filter(|_| self.noise.measurements_are_independent());
        for t in (0..=steps).rev() {
            match picks {
                Some(picks) => {
                    let (belief, information) = (self.belief, self.seeds.information);
                    let (work, noise_adjoint) = (&mut *self.work, &mut *self.noise_adjoint);
                    shape.part::<L, _>(ReverseEach { shape, t, picks, information, belief, work, noise_adjoint });
                }
                None => {
                    shape.part::<L, _>(Correct { sweep: self, shape, t });
                    if self.belief.form == Form::Roots {
                        self.add_information_in_roots(t);
                    }
                }
            }
            if let Some((by_predicted, _)) = self.seeds.covariances {
                rows::add_scaled::<L>(self.work.other.at_mut(0), 1.0, by_predicted.at(t));
            }
            if t > 0 {
                shape.part::<L, _>(Predict { sweep: self, shape, t });
            }
        }
        let predicted = self.work.other.at(0);
        rows::add_scaled::<L>(self.noise_adjoint.initial.at_mut(0), 1.0, predicted);
        if self.seeds.information != 0.0 && self.belief.form != Form::Roots {
            self.subtract_noise_information();
        }
    }

    /// From the adjoint of Sigma_t in `sigma` to that of P_t in `other`.
    #[inline(always)]
    fn correct<L: Lanes>(&mut self, shape: Shape, t: usize) {
        let Self { knots, belief, seeds, work, adjoints, noise_adjoint, .. } = self;
        let (n, p, stride, small) = (shape.n, shape.p, shape.narrow(), shape.small());
        let BeliefAdjoint { sigma, square, other, cross, inverse } = &mut **work;
        let (sigma, square, predicted) = (sigma.at(0), square.at_mut(0), other.at_mut(0));
        let (cross, inverse) = (cross.at_mut(0), inverse.at_mut(0));
        let (c, gain) = (knots.measurement.at(t), belief.gain_transposed.at(t));
        let information = seeds.information;
        // In square roots the parts of the information cancel too far: they come apart.
        let joint = if belief.form == Form::Roots { 0.0 } else { 0.5 * information };

        // cross = L' Sb; Cb = i L' - 2 cross Sigma.
        multiply::<L>(cross, Left::plain(gain, stride), sigma, stride, (p, n), Into::Set);
        let measurement = adjoints.measurement.at_mut(t);
        let corrected = belief.corrected.at(t);
        multiply::<L>(measurement, Left::plain(cross, stride), corrected, stride, (p, n), Into::Set);
        for i in 0..p {
            let row = &mut measurement[i * stride..(i + 1) * stride];
            rows::scale::<L>(row, -2.0);
            rows::add_scaled::<L>(row, information, &gain[i * stride..(i + 1) * stride]);
        }

        // (S^y)^-1, and Vb += L' Sb L + i/2 (S^y)^-1.
        for i in 0..p {
            for j in 0..p {
                inverse[i * small + j] = f64::from(u8::from(i == j));
            }
        }
        rows::cholesky_solve::<L>(belief.innovation_factor.at(t), small, inverse, small, p);
        let v = noise_adjoint.measurement.at_mut(t);
        for i in 0..p {
            for j in 0..p {
                let through = rows::dot(&cross[i * stride..i * stride + n], &gain[j * stride..j * stride + n]);
                v[i * small + j] += through + joint * inverse[i * small + j];
            }
        }

        // square = Sb M = Sb - (Sb L) C; Pb = M' square = square - C' (L' square - i/2 (S^y)^-1 C).
        let base = Into::SubtractFrom(sigma);
        multiply::<L>(square, Left::transposed(cross, stride), c, stride, (n, p), base);
        multiply::<L>(cross, Left::plain(gain, stride), square, stride, (p, n), Into::Set);
        for i in 0..p {
            let row = &mut cross[i * stride..(i + 1) * stride];
            for j in 0..p {
                let factor = -joint * inverse[i * small + j];
                rows::add_scaled::<L>(row, factor, &c[j * stride..(j + 1) * stride]);
            }
        }
        let base = Into::SubtractFrom(square);
        multiply::<L>(predicted, Left::transposed(c, stride), cross, stride, (n, p), base);
        rows::symmetrise::<L>(predicted, n, stride);
    }

    /// With `S^y = Y Y'`: `Pb += i/2 (Y^-1 C)' Y^-1 C` and `Vb -= i/2 L' C' V^-1`, which is `i/2 ((S^y)^-1 - V^-1)`.
    #[cold]
    fn add_information_in_roots(&mut self, t: usize) {
        let Self { knots, noise, belief, seeds, work, noise_adjoint, .. } = self;
        let (c, half) = (dense(&knots.measurement, t), 0.5 * seeds.information);
        let whitened = dense(&belief.innovation_factor, t).solve_lower_triangular(&c);
        let factor = cholesky(&dense(&noise.measurement, t));
        let precise = factor.and_then(|g| g.tr_solve_lower_triangular(&g.solve_lower_triangular(&c)?));
        let (Some(whitened), Some(precise)) = (whitened, precise) else { return };
        let predicted = whitened.tr_mul(&whitened) * half;
        let to = &mut work.other;
        for (i, j) in (0..c.ncols()).flat_map(|i| (0..c.ncols()).map(move |j| (i, j))) {
            to.set(0, i, j, to.get(0, i, j) + predicted[(i, j)]);
        }
        let measured = dense(&belief.gain_transposed, t) * precise.transpose() * half;
        let to = &mut noise_adjoint.measurement;
        for (i, j) in (0..c.nrows()).flat_map(|i| (0..c.nrows()).map(move |j| (i, j))) {
            to.set(t, i, j, to.get(t, i, j) - 0.5 * (measured[(i, j)] + measured[(j, i)]));
        }
    }

    /// From the adjoint of P_t in `other` to that of Sigma_{t-1} in `sigma`.
    #[inline(always)]
    fn predict<L: Lanes>(&mut self, shape: Shape, t: usize) {
        let Self { knots, belief, seeds, work, adjoints, noise_adjoint, .. } = self;
        let (n, stride, wide) = (shape.n, shape.narrow(), shape.wide());
        let BeliefAdjoint { sigma, square, other, .. } = &mut **work;
        let (sigma, square, predicted) = (sigma.at_mut(0), square.at_mut(0), other.at(0));
        let f = knots.dynamics.at(t - 1);

        let process = noise_adjoint.process.at_mut(t - 1);
        for i in 0..n {
            let range = i * stride..(i + 1) * stride;
            rows::add_scaled::<L>(&mut process[range.clone()], 1.0, &predicted[range]);
        }
        // square = Pb A, by rows of A cut off the control's columns.
        rows::multiply_strided::<L>(square, Left::plain(predicted, stride), (f, wide), stride, (n, n));
        for i in 0..n {
            square[i * stride + n..(i + 1) * stride].fill(0.0);
        }
        // Ab = 2 Pb A Sigma; B has no part in the belief.
        let (a, corrected) = (adjoints.dynamics.at_mut(t - 1), belief.corrected.at(t - 1));
        if wide != stride {
            a.fill(0.0);
        }
        rows::multiply_into_strided::<L>((a, wide), Left::plain(square, stride), corrected, stride, (n, n), 2.0);

        multiply::<L>(sigma, Left::transposed(f, wide), square, stride, (n, n), Into::Set);
        rows::symmetrise::<L>(sigma, n, stride);
        if let Some((weights, factor)) = seeds.weights {
            rows::add_scaled::<L>(sigma, 0.5 * factor, weights.at(t - 1));
        }
        if let Some((_, by_corrected)) = seeds.covariances {
            rows::add_scaled::<L>(sigma, 1.0, by_corrected.at(t - 1));
        }
    }

    /// `Vb_t -= i/2 V_t^-1` at every step: `i (N + 1)/2 V^-1` at once where neither differs from step to step.
    #[inline(always)]
    fn subtract_noise_information(&mut self) {
        let Self { knots, noise, seeds, noise_adjoint, work, .. } = self;
        let (p, small) = (knots.dimensions.measurements, work.inverse.stride());
        let steps = knots.steps() + 1;
        let is_same = noise.measurement.is_constant() && noise_adjoint.measurement.is_constant();
        let (groups, each) = if is_same { (1, steps) } else { (steps, 1) };
        let total = seeds.information * 0.5 * each as f64;
        let mut factor = noise.measurement.clone();
        for t in 0..groups {
            if (t == 0 || !factor.is_constant()) && rows::cholesky(factor.at_mut(t), p, small).is_err() {
                return;
            }
            for j in 0..p {
                let column = &mut work.inverse.at_mut(0)[..p];
                column.fill(0.0);
                column[j] = 1.0;
                solve_column(factor.at(t), small, column);
                let to = noise_adjoint.measurement.at_mut(t);
                for (i, value) in column.iter().enumerate() {
                    to[i * small + j] -= total * value;
                }
            }
        }
    }
}

/// Solves `G G' x = b` in place for one column.
pub fn solve_column(factor: &[f64], stride: usize, x: &mut [f64]) {
    let n = x.len();
    for i in 0..n {
        for k in 0..i {
            x[i] -= factor[i * stride + k] * x[k];
        }
        x[i] /= factor[i * stride + i];
    }
    for i in (0..n).rev() {
        for k in i + 1..n {
            x[i] -= factor[k * stride + i] * x[k];
        }
        x[i] /= factor[i * stride + i];
    }
}
