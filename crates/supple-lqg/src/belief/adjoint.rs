use supple_kernels::rows::{
    Factored, Left, Product, Rows, Scaled, View, ViewMut, add_scaled, mirror, scale, solve_column, solve_lower,
    solve_upper, transpose,
};
use supple_kernels::{Job, Lanes, Matrices, dispatch, rows};

use super::kalman::one_at_a_time;
use super::sequential::{Memory, ReverseEach};
use super::state::{Belief, Form};
use crate::Error;
use crate::dense::{cholesky, dense};
use crate::given::{DYNAMICS, Given, OUTPUT, check_count};
use crate::knots::KnotAdjoints;
use crate::knots::Knots;
use crate::noise::Noise;
use crate::shape::{Shape, by_length};

/// What the reverse sweep differentiates: `information DI + 1/2 sum_{t<N} Tr(weights_t Sigma_t)`.
///
/// Example: [`reverse_kalman`].
#[derive(Clone, Copy, Debug, Default)]
pub struct BeliefSeeds<'a> {
    /// Weight of the directed information.
    pub information: f64,
    /// Weights of the corrected covariances, symmetric n x n, N of them, held constant; and a common factor.
    pub weights: Option<(&'a Matrices, f64)>,
    /// Derivatives of an additional objective with respect to all `P_t` and all `Sigma_t`, n x n, N + 1 of each.
    pub covariances: Option<(&'a Matrices, &'a Matrices)>,
}

/// Memory of the reverse sweep.
///
/// Example: [`reverse_kalman`].
#[derive(Clone, Debug)]
pub struct BeliefAdjoint {
    sigma: Matrices,
    square: Matrices,
    other: Matrices,
    cross: Matrices,
    inverse: Matrices,
    /// The factor of `S^y`, upper, and the reciprocals of its diagonal.
    factor: Matrices,
    reciprocals: Matrices,
    /// `L`, n x p.
    gain: Matrices,
    /// The adjoints of all `Sigma_t`, where they are kept.
    kept: Option<Matrices>,
}

impl BeliefAdjoint {
    /// Memory for given sizes.
    #[must_use]
    pub fn new(states: usize, measurements: usize) -> Self {
        let (n, p) = (states, measurements);
        Self {
            sigma: Matrices::zeros(1, n, n),
            square: Matrices::zeros(1, n, n),
            other: Matrices::zeros(1, n, n),
            cross: Matrices::zeros(1, p, n),
            inverse: Matrices::zeros(1, p, p),
            factor: Matrices::zeros(1, p, p),
            reciprocals: Matrices::vectors(1, p),
            gain: Matrices::zeros(1, n, p),
            kept: None,
        }
    }

    /// Memory that keeps the adjoints of all `Sigma_t` for [`corrected`](Self::corrected).
    #[must_use]
    pub fn keeping(states: usize, measurements: usize, steps: usize) -> Self {
        let kept = Some(Matrices::zeros(steps + 1, states, states));
        Self { kept, ..Self::new(states, measurements) }
    }

    /// The derivatives of the last sweep with respect to all `Sigma_t`, n x n, N + 1 of them, if they were kept: what a
    /// change of the covariance at `t`, as by one more measurement, does to all that follows.
    #[must_use]
    pub fn corrected(&self) -> Option<&Matrices> {
        self.kept.as_ref()
    }
}

/// One reverse sweep through the Kalman recursion: adjoints with respect to `A`, `C`, `W`, `V` and `X_0` at every knot
/// (theory, equation G.3). With `M = I - L C` and the adjoints `Sb` of Sigma and `Pb` of P:
///
/// ```text
/// Pb = M' Sb M + i/2 C' (S^y)^-1 C      Cb = i L' - 2 L' Sb Sigma     Vb += L' Sb L + i/2 ((S^y)^-1 - V^-1)
/// Ab_{t-1} = 2 Pb A Sigma_{t-1}         Wb += Pb                      Sb_{t-1} = A' Pb A + 1/2 weights_{t-1}
/// ```
///
/// with `i` the weight of the information. Overwrites `adjoints.dynamics` (its A part; B has none) and
/// `adjoints.measurement` (except if measurements are single states processed sequentially: then `C` has no adjoint); adds
/// to `noise_adjoint`, whose constant matrices accumulate the sums over all steps.
///
/// # Panics
/// If arrays do not fit each other.
///
/// ```
/// use supple_lqg::{Belief, BeliefAdjoint, BeliefSeeds, KnotAdjoints, Knots, LinearQuadratic, Noise, constant, kalman, reverse_kalman};
///
/// // With A = 0, the 11 measurements are independent: each gives 1/2 ln((1 + V) / V) nats, here with V = 1.
/// let plant = LinearQuadratic { a: &[[0.0]], b: &[[0.0]], c: &[[1.0]], q: &[[1.0]], r: &[[1.0]] };
/// let knots = Knots::linear(10, plant)?;
/// let one = constant(&[[1.0]]);
/// let noise = Noise { initial: one.clone(), process: one.clone(), measurement: one };
/// let mut belief = Belief::zeros(1, 1, 10);
/// kalman(&knots, &noise, &mut belief)?;
/// let (mut adjoints, mut by_noise) = (KnotAdjoints::zeros(knots.dimensions, 10), Noise::zeros(1, 1));
/// let seeds = BeliefSeeds { information: 1.0, ..BeliefSeeds::default() };
/// reverse_kalman(&knots, &noise, &belief, seeds, &mut BeliefAdjoint::new(1, 1), &mut adjoints, &mut by_noise);
/// assert!((by_noise.measurement.get(0, 0, 0) + 11.0 / 4.0).abs() < 1e-9, "the derivative of the sum by V");
/// # Ok::<(), supple_lqg::Error>(())
/// ```
pub fn reverse_kalman(
    knots: &Knots,
    noise: &Noise,
    belief: &Belief,
    seeds: BeliefSeeds,
    work: &mut BeliefAdjoint,
    adjoints: &mut KnotAdjoints,
    noise_adjoint: &mut Noise,
) {
    let sweep = Sweep { knots, noise, belief, seeds, work, adjoints, noise_adjoint };
    let fits = sweep.check_shapes();
    assert!(fits.is_ok(), "arrays do not fit each other: {fits:?}");
    dispatch(sweep);
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
        by_length!(self.knots.dimensions, |R| self.sweep::<L, R>())
    }
}

/// [`Sweep::correct`] as a part of the sweep.
struct Correct<'s, 'a, R> {
    sweep: &'s mut Sweep<'a>,
    shape: Shape<R>,
    t: usize,
}

impl<R: Rows> Job for Correct<'_, '_, R> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        self.sweep.correct::<L, R>(self.shape, self.t);
    }
}

/// [`Sweep::predict`] as a part of the sweep.
struct Predict<'s, 'a, R> {
    sweep: &'s mut Sweep<'a>,
    shape: Shape<R>,
    t: usize,
}

impl<R: Rows> Job for Predict<'_, '_, R> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        self.sweep.predict::<L, R>(self.shape, self.t);
    }
}

impl Sweep<'_> {
    fn check_shapes(&self) -> Result<(), Error> {
        let Self { knots, noise, belief, seeds, work, adjoints, noise_adjoint } = self;
        let (dimensions, steps) = (knots.dimensions, knots.steps());
        let (n, p, joint) = (dimensions.states, dimensions.measurements, dimensions.joint());
        belief.check_shapes(dimensions, steps)?;
        noise.check_shapes(dimensions, steps)?;
        noise_adjoint.check_shapes(dimensions, steps)?;
        check_count("a column of the memory of the reverse sweep", work.sigma.rows(), n)?;
        check_count("a row of the memory of the reverse sweep", work.gain.cols(), p)?;
        let check = |what, array, shape, count| Given { what, array, shape, count }.check_shape();
        check(DYNAMICS, &knots.dynamics, (n, joint), steps)?;
        check(OUTPUT, &knots.measurement, (p, n), steps + 1)?;
        check("the adjoint of the dynamics", &adjoints.dynamics, (n, joint), steps)?;
        check("the adjoint of C", &adjoints.measurement, (p, n), steps + 1)?;
        if let Some(kept) = &work.kept {
            check("the memory of the covariances", kept, (n, n), steps + 1)?;
        }
        if let Some((weights, _)) = seeds.weights {
            check("the weights of the covariances", weights, (n, n), steps)?;
        }
        let Some((predicted, corrected)) = seeds.covariances else { return Ok(()) };
        check("the derivative with respect to P", predicted, (n, n), steps + 1)?;
        check("the derivative with respect to Sigma", corrected, (n, n), steps + 1)
    }

    #[inline(always)]
    fn sweep<L: Lanes, R: Rows>(&mut self) {
        let (steps, shape) = (self.knots.steps(), Shape::<R>::of(self.knots.dimensions));
        self.work.sigma.clear();
        if let Some((_, by_corrected)) = self.seeds.covariances {
            add_scaled::<L>(self.work.sigma.at_mut(0), 1.0, by_corrected.at(steps));
        }
        let picks = one_at_a_time(self.knots, self.noise);
        for t in (0..=steps).rev() {
            if let Some(kept) = &mut self.work.kept {
                kept.at_mut(t).copy_from_slice(self.work.sigma.at(0));
            }
            match picks {
                Some(picks) => {
                    let (belief, information) = (self.belief, self.seeds.information);
                    let noise_adjoint = &mut *self.noise_adjoint;
                    let BeliefAdjoint { sigma, other: predicted, cross: row, .. } = &mut *self.work;
                    let memory = Memory { sigma, predicted, row };
                    shape.part::<L, _>(ReverseEach { shape, t, picks, information, belief, memory, noise_adjoint });
                }
                None => {
                    shape.part::<L, _>(Correct { sweep: self, shape, t });
                    if self.belief.form == Form::Roots {
                        self.add_information_in_roots(t);
                    }
                }
            }
            if let Some((by_predicted, _)) = self.seeds.covariances {
                add_scaled::<L>(self.work.other.at_mut(0), 1.0, by_predicted.at(t));
            }
            if t > 0 {
                shape.part::<L, _>(Predict { sweep: self, shape, t });
            }
        }
        let predicted = self.work.other.at(0);
        add_scaled::<L>(self.noise_adjoint.initial.at_mut(0), 1.0, predicted);
        if self.seeds.information != 0.0 && self.belief.form != Form::Roots {
            self.subtract_noise_information();
        }
    }

    /// From the adjoint of Sigma_t in `sigma` to that of P_t in `other`.
    #[inline(always)]
    fn correct<L: Lanes, R: Rows>(&mut self, shape: Shape<R>, t: usize) {
        let Self { knots, belief, seeds, work, adjoints, noise_adjoint, .. } = self;
        let (n, p, stride, small) = (shape.n, shape.p, shape.narrow(), shape.small());
        invert::<L, R>(shape, belief.innovation_factor.at(t), work);
        let BeliefAdjoint { sigma, square, other, cross, inverse, gain: turned, .. } = &mut **work;
        let (sigma, square, predicted) = (View::new(sigma.at(0), stride), square.at_mut(0), other.at_mut(0));
        let (cross, inverse, turned) = (cross.at_mut(0), inverse.at_mut(0), turned.at_mut(0));
        let (c, gain) = (View::new(knots.measurement.at(t), stride), View::new(belief.gain_transposed.at(t), stride));
        let information = seeds.information;
        // In square-root form the parts of the information would cancel too strongly, so they are handled separately.
        let joint = if belief.form == Form::Roots { 0.0 } else { 0.5 * information };
        let of_gain = Left::plain(gain.numbers, stride);

        // cross = L' Sb; Cb = i L' - 2 cross Sigma.
        let width = stride;
        Product { left: of_gain, right: sigma, rows: p, inner: n, width }.set::<L, R>(ViewMut::new(cross, stride));
        let (measurement, corrected) = (adjoints.measurement.at_mut(t), View::new(belief.corrected.at(t), stride));
        let left = Left::plain(cross, stride);
        Product { left, right: corrected, rows: p, inner: n, width }.set::<L, R>(ViewMut::new(measurement, stride));
        scale::<L>(measurement, -2.0);
        add_scaled::<L>(measurement, information, gain.numbers);

        // Vb += L' Sb L + i/2 (S^y)^-1.
        let v = noise_adjoint.measurement.at_mut(t);
        if R::SHORT {
            for (i, j) in (0..p).flat_map(|i| (0..p).map(move |j| (i, j))) {
                let (row, other) = (&cross[i * stride..i * stride + n], &gain.numbers[j * stride..j * stride + n]);
                v[i * small + j] += rows::dot(row, other);
            }
        } else {
            transpose::<L, R>(ViewMut::new(turned, small), gain, p, n);
            let (left, right) = (Left::plain(cross, stride), View::new(turned, small));
            Product { left, right, rows: p, inner: n, width: small }.add::<L, R>(ViewMut::new(v, small));
        }
        add_scaled::<L>(v, joint, inverse);

        // square = Sb M = Sb - (Sb L) C; Pb = M' square = square - C' (L' square - i/2 (S^y)^-1 C).
        let left = Left::transposed(cross, stride);
        Product { left, right: c, rows: n, inner: p, width }.subtract_from::<L, R>(sigma, ViewMut::new(square, stride));
        let squared = View::new(square, stride);
        Product { left: of_gain, right: squared, rows: p, inner: n, width }.set::<L, R>(ViewMut::new(cross, stride));
        if joint != 0.0 {
            // The inverse, computed in place, times the weight.
            scale::<L>(inverse, joint);
            let left = Left::transposed(inverse, small);
            Product { left, right: c, rows: p, inner: p, width }.subtract::<L, R>(ViewMut::new(cross, stride));
        }
        let (left, right) = (Left::transposed(c.numbers, stride), View::new(cross, stride));
        let product = Product { left, right, rows: n, inner: p, width }.lower();
        product.subtract_from::<L, R>(squared, ViewMut::new(predicted, stride));
        mirror::<L, R>(ViewMut::new(predicted, stride), n);
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
    fn predict<L: Lanes, R: Rows>(&mut self, shape: Shape<R>, t: usize) {
        let Self { knots, belief, seeds, work, adjoints, noise_adjoint, .. } = self;
        let (n, stride, wide) = (shape.n, shape.narrow(), shape.wide());
        let BeliefAdjoint { sigma, square, other, .. } = &mut **work;
        let (sigma, square, predicted) = (sigma.at_mut(0), square.at_mut(0), other.at(0));
        let f = knots.dynamics.at(t - 1);
        add_scaled::<L>(noise_adjoint.process.at_mut(t - 1), 1.0, predicted);

        // square = Pb A, zero-padded on the right, where F has the control columns.
        let (left, right) = (Left::transposed(predicted, stride), View::new(f, wide));
        Product { left, right, rows: n, inner: n, width: stride }.set::<L, R>(ViewMut::new(square, stride));
        for i in 0..n {
            rows::clear_beyond::<L>(&mut square[i * stride..(i + 1) * stride], n);
        }
        let (left, right) = (Left::transposed(f, wide), View::new(square, stride));
        let product = Product { left, right, rows: n, inner: n, width: stride };
        product.lower().set::<L, R>(ViewMut::new(sigma, stride));
        mirror::<L, R>(ViewMut::new(sigma, stride), n);

        // Ab = 2 Pb A Sigma; the belief does not depend on B.
        let (a, corrected) = (adjoints.dynamics.at_mut(t - 1), View::new(belief.corrected.at(t - 1), stride));
        if wide != stride {
            a.fill(0.0);
        }
        scale::<L>(square, 2.0);
        let left = Left::plain(square, stride);
        Product { left, right: corrected, rows: n, inner: n, width: stride }.set::<L, R>(ViewMut::new(a, wide));
        if let Some((weights, factor)) = seeds.weights {
            add_scaled::<L>(sigma, 0.5 * factor, weights.at(t - 1));
        }
        if let Some((_, by_corrected)) = seeds.covariances {
            add_scaled::<L>(sigma, 1.0, by_corrected.at(t - 1));
        }
    }

    /// `Vb_t -= i/2 V_t^-1` at every step; if both matrices are constant, `i (N + 1)/2 V^-1` in one operation.
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

/// `(S^y)^-1` from the lower factor of `S^y`.
#[inline(always)]
fn invert<L: Lanes, R: Rows>(shape: Shape<R>, lower: &[f64], work: &mut BeliefAdjoint) {
    let (p, small) = (shape.p, shape.small());
    let BeliefAdjoint { inverse, factor, reciprocals, .. } = work;
    let (inverse, factor, reciprocals) = (inverse.at_mut(0), factor.at_mut(0), reciprocals.at_mut(0));
    let given = Scaled { from: View::new(lower, small), factor: 1.0, rows: p, count: p };
    given.set::<L, R>(ViewMut::new(factor, small));
    mirror::<L, R>(ViewMut::new(factor, small), p);
    inverse.fill(0.0);
    for i in 0..p {
        inverse[i * small + i] = 1.0;
        reciprocals[i] = 1.0 / factor[i * small + i];
    }
    let factored = Factored { upper: View::new(factor, small), reciprocals, n: p };
    solve_lower::<L, R>(factored, ViewMut::new(inverse, small));
    solve_upper::<L, R>(factored, ViewMut::new(inverse, small));
}
