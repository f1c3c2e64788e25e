use supple_kernels::{Lanes, Matrices, rows};

use super::ControlBounds;

/// What keeps controls from moving freely in a sweep.
#[derive(Clone, Copy)]
pub enum Limits<'a> {
    /// Bounds, and the controls of the trajectory that the sweep is about.
    Bounds(&'a ControlBounds, &'a Matrices),
    /// Which controls do not move at all: m of each step.
    Held(&'a [bool]),
}

/// The gains of one step under [`Limits`]: a quadratic program over a box by projected Newton (Bertsekas 1982; Tassa,
/// Mansard, Todorov 2014), and its memory.
///
/// ```text
/// min 1/2 k' H k + q' k   over   lower <= k <= upper
/// ```
#[derive(Clone, Debug)]
pub struct BoxQp {
    /// `H`, m x m, without padding; `factor` is the Cholesky factor of its free block.
    hessian: Vec<f64>,
    factor: Vec<f64>,
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

/// Where a step's numbers are: rows `[Q_ux Q_uu | Q_u]`, `wide` apart, `Q_uu` from column n on, `Q_u` in column `joint`.
pub struct Gains<'a> {
    pub rows: &'a mut [f64],
    pub wide: usize,
    pub n: usize,
    /// Receives `K`, rows `narrow` apart.
    pub feedback: &'a mut [f64],
    pub narrow: usize,
    /// Receives `k`.
    pub feedforward: &'a mut [f64],
    /// Receives which controls are held.
    pub clamped: &'a mut [bool],
}

/// Iterations at most; a handful is usual.
const MOST_ITERATIONS: usize = 100;
/// Halvings of a step at most.
const MOST_HALVINGS: usize = 40;

impl BoxQp {
    /// Memory for m controls.
    pub fn new(m: usize) -> Self {
        let numbers = || vec![0.0; m];
        Self {
            hessian: vec![0.0; m * m],
            factor: vec![0.0; m * m],
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

    /// The gains at step `t` (theory, equation P.7): `k` solves the quadratic program; held controls have zero rows in
    /// `K`, the others `K_f = -H_ff^-1 Q_fx`.
    ///
    /// # Errors
    /// Where `H` is not positive definite on the free controls.
    #[inline(always)]
    pub fn solve<L: Lanes>(&mut self, limits: Limits, t: usize, gains: Gains) -> Result<(), ()> {
        let m = self.linear.len();
        let Gains { rows: right, wide, n, feedback, narrow, feedforward, clamped } = gains;
        let joint = n + m;
        for a in 0..m {
            for b in 0..=a {
                let entry = right[a * wide + n + b];
                self.hessian[a * m + b] = entry;
                self.hessian[b * m + a] = entry;
            }
            self.linear[a] = right[a * wide + joint];
        }
        match limits {
            Limits::Bounds(bounds, controls) => {
                self.open_box(bounds, controls.vector(t));
                self.minimise::<L>()?;
            }
            Limits::Held(held) => {
                self.held.copy_from_slice(&held[t * m..(t + 1) * m]);
                self.k.fill(0.0);
                self.list_free();
                self.factor()?;
            }
        }
        clamped.copy_from_slice(&self.held);
        feedforward.copy_from_slice(&self.k);

        // [K_f | k_f] = -H_ff^-1 [Q_fx | Q_f + H_fc k_c], the free rows moved up.
        let free = self.free.len();
        for (i, &a) in self.free.iter().enumerate() {
            right.copy_within(a * wide..(a + 1) * wide, i * wide);
            let held: f64 = (0..m).filter(|&b| self.held[b]).map(|b| self.hessian[a * m + b] * self.k[b]).sum();
            right[i * wide + joint] += held;
        }
        rows::cholesky_solve::<L>(&self.factor, m, right, wide, free);
        for a in 0..m {
            feedback[a * narrow..a * narrow + n].fill(0.0);
        }
        for (i, &a) in self.free.iter().enumerate() {
            for (to, from) in feedback[a * narrow..a * narrow + n].iter_mut().zip(&right[i * wide..]) {
                *to = -from;
            }
            feedforward[a] = -right[i * wide + joint];
            if let Limits::Bounds(..) = limits {
                feedforward[a] = feedforward[a].max(self.lower[a]).min(self.upper[a]);
            }
        }
        Ok(())
    }

    /// The box of `k` around the controls, and `k = 0` in it, where the search begins: close to the optimum the
    /// trajectory itself says which controls are held.
    fn open_box(&mut self, bounds: &ControlBounds, controls: &[f64]) {
        for (a, &u) in controls.iter().enumerate() {
            self.lower[a] = bounds.lower()[a] - u;
            self.upper[a] = bounds.upper()[a] - u;
            self.k[a] = 0f64.max(self.lower[a]).min(self.upper[a]);
        }
    }

    #[inline(always)]
    fn minimise<L: Lanes>(&mut self) -> Result<(), ()> {
        let mut settled = false;
        for iteration in 0..MOST_ITERATIONS {
            let changed = self.find_held();
            if settled && !changed {
                return Ok(());
            }
            if changed || iteration == 0 {
                self.list_free();
                self.factor()?;
            }
            if self.free.is_empty() {
                return Ok(());
            }
            settled = self.newton_step::<L>()?;
        }
        Err(())
    }

    /// Holds the controls that are at a bound with the slope `q + H k` pushing outward; whether that changed.
    fn find_held(&mut self) -> bool {
        let m = self.linear.len();
        let mut changed = false;
        for a in 0..m {
            self.slope[a] = self.linear[a] + rows::dot(&self.hessian[a * m..(a + 1) * m], &self.k);
            let (k, slope) = (self.k[a], self.slope[a]);
            let held = k <= self.lower[a] && slope > 0.0 || k >= self.upper[a] && slope < 0.0;
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
    fn factor(&mut self) -> Result<(), ()> {
        let m = self.linear.len();
        for (i, &a) in self.free.iter().enumerate() {
            for (j, &b) in self.free[..=i].iter().enumerate() {
                self.factor[i * m + j] = self.hessian[a * m + b];
            }
        }
        rows::cholesky(&mut self.factor, self.free.len(), m).map_err(drop)
    }

    /// A Newton step in the free controls, shortened until what the box leaves of it lowers the objective enough;
    /// whether it was a whole step, so that the free controls are at their optimum.
    #[inline(always)]
    fn newton_step<L: Lanes>(&mut self) -> Result<bool, ()> {
        let m = self.linear.len();
        for (i, &a) in self.free.iter().enumerate() {
            self.step[i] = -self.slope[a];
        }
        rows::cholesky_solve::<L>(&self.factor, m, &mut self.step, 1, self.free.len());
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

    /// Whether the trial lowers the objective by a tenth of what its slope promises.
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
    use supple_kernels::{Job, Matrices, dispatch, padded};

    use super::*;

    struct Solve<'a> {
        qp: &'a mut BoxQp,
        bounds: &'a ControlBounds,
        gains: Gains<'a>,
    }

    impl Job for Solve<'_> {
        type Output = Result<(), ()>;

        #[inline(always)]
        fn run<L: Lanes>(self) -> Self::Output {
            let m = self.gains.feedforward.len();
            let controls = Matrices::vectors(1, m);
            self.qp.solve::<L>(Limits::Bounds(self.bounds, &controls), 0, self.gains)
        }
    }

    proptest! {
        /// The minimiser obeys the conditions of Karush, Kuhn and Tucker, and only free controls answer the state.
        #[test]
        fn the_minimiser_is_one(m in 1usize..9, seeds in proptest::collection::vec(-1.0..1.0f64, 200)) {
            let n = 2;
            let wide = padded(n + m + 1);
            let seed = |i: usize| seeds[i % seeds.len()];
            let (mut rows, narrow) = (vec![0.0; m * wide], padded(n));
            for a in 0..m {
                for b in 0..m {
                    let product: f64 = (0..m).map(|c| seed(a * m + c) * seed(b * m + c)).sum();
                    rows[a * wide + n + b] = product + if a == b { 0.11 } else { 0.0 };
                }
                rows[a * wide] = seed(90 + a);
                rows[a * wide + n + m] = 3.0 * seed(100 + a);
            }
            let given = rows.clone();
            let bounds: Vec<_> = (0..m).map(|a| (-seed(120 + a).abs(), seed(140 + a).abs())).collect();
            let bounds = ControlBounds::new(&bounds);
            let (mut feedback, mut k, mut clamped) = (vec![9.0; m * narrow], vec![0.0; m], vec![false; m]);
            let mut qp = BoxQp::new(m);
            let gains = Gains {
                rows: &mut rows, wide, n,
                feedback: &mut feedback, narrow, feedforward: &mut k, clamped: &mut clamped,
            };
            dispatch(Solve { qp: &mut qp, bounds: &bounds, gains }).unwrap();
            let h = |a: usize, b: usize| given[a * wide + n + b];
            for a in 0..m {
                let slope: f64 = given[a * wide + n + m] + (0..m).map(|b| h(a, b) * k[b]).sum::<f64>();
                prop_assert!(k[a] >= bounds.lower()[a] && k[a] <= bounds.upper()[a]);
                prop_assert!(bounds.project(a, k[a], slope).abs() < 1e-11, "{a}: {slope}");
                let row: f64 = given[a * wide] + (0..m).map(|b| h(a, b) * feedback[b * narrow]).sum::<f64>();
                prop_assert!(if clamped[a] { feedback[a * narrow] == 0.0 } else { row.abs() < 1e-11 }, "{a}: {row}");
            }
        }
    }
}
