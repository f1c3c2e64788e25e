use supple_kernels::Matrices;
use supple_kernels::rows::{self, View, ViewMut, solve_column};

use super::bounds::ControlBounds;
use super::limits::Limits;

/// The gains of one step under [`Limits`]: a quadratic program over a box by projected Newton (Bertsekas 1982; Tassa,
/// Mansard, Todorov 2014), and its memory.
///
/// ```text
/// min 1/2 k' H k + q' k   over   lower <= k <= upper
/// ```
#[derive(Clone, Debug)]
pub struct BoxQp {
    /// `H`, m x m, without padding.
    hessian: Vec<f64>,
    /// The Cholesky factor of its free block, lower.
    factor: Matrices,
    linear: Vec<f64>,
    lower: Vec<f64>,
    upper: Vec<f64>,
    k: Vec<f64>,
    slope: Vec<f64>,
    step: Vec<f64>,
    trial: Vec<f64>,
    /// The controls that are not held, in order.
    free: Vec<usize>,
    held: Vec<bool>,
}

/// Maximum number of iterations; a handful is usual.
const MOST_ITERATIONS: usize = 100;
/// Maximum number of halvings of a step.
const MOST_HALVINGS: usize = 40;

impl BoxQp {
    /// Memory for m controls.
    pub fn new(m: usize) -> Self {
        let numbers = || vec![0.0; m];
        Self {
            hessian: vec![0.0; m * m],
            factor: Matrices::zeros(1, m, m),
            linear: numbers(),
            lower: numbers(),
            upper: numbers(),
            k: numbers(),
            slope: numbers(),
            step: numbers(),
            trial: numbers(),
            free: Vec::with_capacity(m),
            held: vec![false; m],
        }
    }

    /// Finds the controls held at step `t`, and the solution `k` of the quadratic program, from the lower triangle of `Q_uu`
    /// and `Q_u` (theory, equation P.7).
    ///
    /// # Errors
    /// Where `H` is not positive definite on the free controls.
    pub fn find(&mut self, limits: Limits, t: usize, q_uu: View, q_u: &[f64]) -> Result<(), ()> {
        let m = self.linear.len();
        self.linear.copy_from_slice(q_u);
        for (a, b) in (0..m).flat_map(|a| (0..=a).map(move |b| (a, b))) {
            let entry = q_uu.numbers[a * q_uu.stride + b];
            (self.hessian[a * m + b], self.hessian[b * m + a]) = (entry, entry);
        }
        match limits {
            Limits::Bounds(bounds, controls) => {
                self.open_box(bounds, controls.vector(t));
                self.minimise()
            }
            Limits::Held(held) => {
                self.held.copy_from_slice(&held[t * m..(t + 1) * m]);
                self.k.fill(0.0);
                // Controls that cannot move are held; the others are unlimited.
                self.lower.fill(f64::NEG_INFINITY);
                self.upper.fill(f64::INFINITY);
                self.list_free();
                self.factorise()
            }
        }
    }

    /// Reduces rows `[Q_uu | Q_ux | Q_u]` to the free controls, moved up: `[U | Q_fx | Q_f + H_fc k_c]`,
    /// with `H_ff = U'U` and the reciprocals of its diagonal; returns their number. `Q_ux`, of n columns, begins at column
    /// `first`.
    pub fn keep_free(&self, rows: ViewMut, first: usize, n: usize, reciprocals: &mut [f64]) -> usize {
        let (m, ViewMut { numbers, stride }) = (self.linear.len(), rows);
        let (factor, width) = (self.factor.at(0), self.factor.stride());
        for (i, &a) in self.free.iter().enumerate() {
            numbers.copy_within(a * stride + first..(a + 1) * stride, i * stride + first);
            let held: f64 = (0..m).filter(|&b| self.held[b]).map(|b| self.hessian[a * m + b] * self.k[b]).sum();
            numbers[i * stride + first + n] += held;
            reciprocals[i] = 1.0 / factor[i * width + i];
        }
        let free = self.free.len();
        for (i, j) in (0..free).flat_map(|i| (i..free).map(move |j| (i, j))) {
            numbers[i * stride + j] = factor[j * width + i];
        }
        free
    }

    /// `K_f = -X` and `k_f = -x`, within the box, from rows `[X | x]` of the free controls; held ones have zero rows in
    /// `K`, and their `k`.
    pub fn give(&self, rows: View, n: usize, feedback: ViewMut, feedforward: &mut [f64]) {
        let ViewMut { numbers: feedback, stride: narrow } = feedback;
        feedforward.copy_from_slice(&self.k);
        for row in feedback.chunks_exact_mut(narrow) {
            row[..n].fill(0.0);
        }
        for (row, &a) in rows.numbers.chunks(rows.stride).zip(&self.free) {
            for (to, from) in feedback[a * narrow..a * narrow + n].iter_mut().zip(row) {
                *to = -from;
            }
            feedforward[a] = (-row[n]).max(self.lower[a]).min(self.upper[a]);
        }
    }

    /// Which controls are held.
    pub fn held(&self) -> &[bool] {
        &self.held
    }

    /// The box of `k` around the controls, and the start of the search, `k = 0`: close to the optimum the
    /// trajectory itself indicates which controls are held.
    fn open_box(&mut self, bounds: &ControlBounds, controls: &[f64]) {
        for (a, &u) in controls.iter().enumerate() {
            self.lower[a] = bounds.lower()[a] - u;
            self.upper[a] = bounds.upper()[a] - u;
            self.k[a] = 0f64.max(self.lower[a]).min(self.upper[a]);
        }
    }

    fn minimise(&mut self) -> Result<(), ()> {
        let mut settled = false;
        for iteration in 0..MOST_ITERATIONS {
            let changed = self.find_held();
            if settled && !changed {
                return Ok(());
            }
            if changed || iteration == 0 {
                self.list_free();
                self.factorise()?;
            }
            if self.free.is_empty() {
                return Ok(());
            }
            settled = self.newton_step()?;
        }
        Err(())
    }

    /// Holds the controls that are at a bound with the slope `q + H k` pushing outward, or between bounds that are equal; returns
    /// whether that changed.
    fn find_held(&mut self) -> bool {
        let m = self.linear.len();
        let mut changed = false;
        for a in 0..m {
            self.slope[a] = self.linear[a] + rows::dot(&self.hessian[a * m..(a + 1) * m], &self.k);
            let (k, slope) = (self.k[a], self.slope[a]);
            let (lower, upper) = (self.lower[a], self.upper[a]);
            let held = lower == upper || k <= lower && slope > 0.0 || k >= upper && slope < 0.0;
            changed |= held != self.held[a];
            self.held[a] = held;
        }
        changed
    }

    fn list_free(&mut self) {
        self.free.clear();
        self.free.extend((0..self.held.len()).filter(|&a| !self.held[a]));
    }

    /// Factors the free block of `H`.
    fn factorise(&mut self) -> Result<(), ()> {
        let (m, stride) = (self.linear.len(), self.factor.stride());
        let factor = self.factor.at_mut(0);
        for (i, &a) in self.free.iter().enumerate() {
            for (j, &b) in self.free[..=i].iter().enumerate() {
                factor[i * stride + j] = self.hessian[a * m + b];
            }
        }
        let free = self.free.len();
        rows::cholesky(factor, free, stride).map_err(drop)
    }

    /// A Newton step in the free controls, clipped to the box and shortened until it lowers the objective enough;
    /// returns whether it was a full step, so that the free controls are at their optimum.
    fn newton_step(&mut self) -> Result<bool, ()> {
        for (i, &a) in self.free.iter().enumerate() {
            self.step[i] = -self.slope[a];
        }
        solve_column(self.factor.at(0), self.factor.stride(), &mut self.step[..self.free.len()]);
        let mut length = 1.0;
        for _ in 0..MOST_HALVINGS {
            let mut whole = length == 1.0;
            self.trial.copy_from_slice(&self.k);
            for (i, &a) in self.free.iter().enumerate() {
                let to = self.k[a] + length * self.step[i];
                self.trial[a] = to.max(self.lower[a]).min(self.upper[a]);
                whole &= self.trial[a] == to;
            }
            if whole || self.is_lower() {
                self.k.copy_from_slice(&self.trial);
                return Ok(whole);
            }
            length *= 0.5;
        }
        Err(())
    }

    /// Whether the trial lowers the objective by at least a tenth of what its slope predicts.
    fn is_lower(&self) -> bool {
        let m = self.linear.len();
        let moved = |a: usize| self.trial[a] - self.k[a];
        let (mut promised, mut curved) = (0.0, 0.0);
        for a in 0..m {
            let row = &self.hessian[a * m..(a + 1) * m];
            promised += self.slope[a] * moved(a);
            curved += moved(a) * row.iter().enumerate().map(|(b, entry)| entry * moved(b)).sum::<f64>();
        }
        promised + 0.5 * curved <= 0.1 * promised
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use proptest::prelude::*;
    use supple_kernels::rows::Long;
    use supple_kernels::{Job, Lanes, Matrices, dispatch, padded};

    use super::*;

    /// The last part of the gain computation, as sweeps run it.
    struct Solve<'a>(ViewMut<'a>, usize, (usize, usize), &'a [f64]);

    impl Job for Solve<'_> {
        type Output = ();

        #[inline(always)]
        fn run<L: Lanes>(self) {
            let Self(ViewMut { numbers, stride }, free, beside, reciprocals) = self;
            rows::solve_lower_beside::<L, Long>(ViewMut::new(numbers, stride), free, beside, reciprocals);
            rows::solve_upper_beside::<L, Long>(ViewMut::new(numbers, stride), free, beside, reciprocals);
        }
    }

    proptest! {
        /// The minimiser satisfies the Karush-Kuhn-Tucker conditions, and only free controls respond to the state.
        #[test]
        fn the_minimiser_is_one(m in 1usize..9, seeds in proptest::collection::vec(-1.0..1.0f64, 200)) {
            let n = 2;
            let seed = |i: usize| seeds[i % seeds.len()];
            let first = padded(m);
            let (mut hessian, mut gains) = (Matrices::zeros(1, m, m), Matrices::zeros(1, m, first + n + 1));
            for a in 0..m {
                for b in 0..m {
                    let product: f64 = (0..m).map(|c| seed(a * m + c) * seed(b * m + c)).sum();
                    hessian.set(0, a, b, product + if a == b { 0.11 } else { 0.0 });
                }
                gains.set(0, a, first, seed(90 + a));
                gains.set(0, a, first + n, 3.0 * seed(100 + a));
            }
            let given = gains.clone();
            let bounds: Vec<_> = (0..m).map(|a| [-seed(120 + a).abs(), seed(140 + a).abs()]).collect();
            let bounds = ControlBounds::new(&bounds);
            let (mut feedback, mut k) = (Matrices::zeros(1, m, n), vec![0.0; m]);
            let (mut qp, controls) = (BoxQp::new(m), Matrices::vectors(1, m));
            let linear: Vec<_> = (0..m).map(|a| gains.get(0, a, first + n)).collect();
            let (width, stride, narrow) = (hessian.stride(), gains.stride(), feedback.stride());
            qp.find(Limits::Bounds(&bounds, &controls), 0, View::new(hessian.at(0), width), &linear).unwrap();
            let mut reciprocals = [0.0; 16];
            let free = qp.keep_free(ViewMut::new(gains.at_mut(0), stride), first, n, &mut reciprocals);
            dispatch(Solve(ViewMut::new(gains.at_mut(0), stride), free, (first, stride - first), &reciprocals));
            qp.give(View::new(&gains.at(0)[first..], stride), n, ViewMut::new(feedback.at_mut(0), narrow), &mut k);
            let h = |a: usize, b: usize| hessian.get(0, a, b);
            for a in 0..m {
                let slope: f64 = given.get(0, a, first + n) + (0..m).map(|b| h(a, b) * k[b]).sum::<f64>();
                prop_assert!(k[a] >= bounds.lower()[a] && k[a] <= bounds.upper()[a]);
                prop_assert!(bounds.project(a, k[a], slope).abs() < 1e-11, "{a}: {slope}");
                let row: f64 = given.get(0, a, first) + (0..m).map(|b| h(a, b) * feedback.get(0, b, 0)).sum::<f64>();
                prop_assert!(if qp.held()[a] { feedback.get(0, a, 0) == 0.0 } else { row.abs() < 1e-11 }, "{a}: {row}");
            }
        }
    }
}
