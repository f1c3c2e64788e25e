//! Knots: the linearisation of a trajectory.

use std::fmt;

use supple_kernels::Matrices;

use crate::Error;
use crate::arrays::{Entries, FromEntries, constant};
use crate::dense::are_finite;
use crate::given::{COST, DYNAMICS, Given, OUTPUT, check_count, check_some};

/// Lengths of a model's vectors.
///
/// ```
/// let lengths = supple_lqg::Dimensions { states: 4, controls: 2, measurements: 3 };
/// assert_eq!(lengths.joint(), 6);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Dimensions {
    /// Length of the state `x`.
    pub states: usize,
    /// Length of the control `u`.
    pub controls: usize,
    /// Length of the measurement `y`.
    pub measurements: usize,
}

impl Dimensions {
    /// Length of `z = (x, u)`.
    #[must_use]
    pub fn joint(self) -> usize {
        self.states + self.controls
    }
}

/// The central data structure of supple: a trajectory's linearisation. Everything downstream uses knots, nothing nonlinear.
///
/// Knot `t` has `[A B] = [f_x f_u]`, `C = g_x` and `[l_zz | l_z]` with `z = (x, u)`; the last knot has no dynamics
/// and no control.
///
/// Example: [`Knots::linear`].
#[derive(Clone, Debug)]
pub struct Knots {
    /// Lengths of state, control and measurement.
    pub dimensions: Dimensions,
    /// `[A B]`, n x (n + m), N of them.
    pub dynamics: Matrices,
    /// `C`, p x n, N + 1 of them.
    pub measurement: Matrices,
    /// `[l_zz | l_z]`, (n + m) x (n + m + 1), N + 1 of them; `l_zz` is symmetric, and sweeps read its lower triangle.
    pub cost: Matrices,
    /// Which state each measurement is, if every one is a single state, so that `C` only selects states.
    pub picks: Option<Vec<usize>>,
}

/// `x+ = A x + B u`, `y = C x` and the weights of the cost `1/2 (x' Q x + u' R u)`, the same at every step.
///
/// Example: [`Knots::linear`].
#[derive(Clone, Copy)]
pub struct LinearQuadratic<'a> {
    /// `A`, n x n.
    pub a: &'a (dyn Entries + Sync),
    /// `B`, n x m.
    pub b: &'a (dyn Entries + Sync),
    /// `C`, p x n.
    pub c: &'a (dyn Entries + Sync),
    /// `Q`, n x n.
    pub q: &'a (dyn Entries + Sync),
    /// `R`, m x m.
    pub r: &'a (dyn Entries + Sync),
}

impl fmt::Debug for LinearQuadratic<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { a, b, c, q, r } = *self;
        let mut shown = f.debug_struct("LinearQuadratic");
        for (name, of) in [("a", a), ("b", b), ("c", c), ("q", q), ("r", r)] {
            let (rows, cols) = of.shape();
            shown.field(name, &<Vec<Vec<f64>>>::from_entries(rows, cols, |i, j| of.entry(i, j)));
        }
        shown.finish()
    }
}

/// `x_{t+1} = A_t x_t + B_t u_t`, `y_t = C_t x_t` and the weights of the cost `1/2 (x' Q_t x + u' R_t u)`: sequences made by
/// [`sequence`](crate::sequence), or one matrix that holds at every step, made by [`constant`](crate::constant).
///
/// Example: [`Knots::varying`].
#[derive(Clone, Copy, Debug)]
pub struct TimeVarying<'a> {
    /// `A_t`, n x n, N of them.
    pub a: &'a Matrices,
    /// `B_t`, n x m, N of them.
    pub b: &'a Matrices,
    /// `C_t`, p x n, N + 1 of them.
    pub c: &'a Matrices,
    /// `Q_t`, n x n, N + 1 of them: the last is the weight of the final state.
    pub q: &'a Matrices,
    /// `R_t`, m x m, N of them.
    pub r: &'a Matrices,
}

/// Writes a matrix given by its entries into matrix `t` of a sequence, from this row and column on.
fn place(
    to: &mut Matrices,
    t: usize,
    (row, col): (usize, usize),
    (rows, cols): (usize, usize),
    entry: impl Fn(usize, usize) -> f64,
) {
    for (i, j) in (0..rows).flat_map(|i| (0..cols).map(move |j| (i, j))) {
        to.set(t, row + i, col + j, entry(i, j));
    }
}

/// The entries of matrix `t` of a sequence.
fn entries(of: &Matrices, t: usize) -> impl Fn(usize, usize) -> f64 {
    move |row, col| of.get(t, row, col)
}

/// The entries of the symmetric part of a square matrix.
fn symmetric(entry: impl Fn(usize, usize) -> f64) -> impl Fn(usize, usize) -> f64 {
    move |row, col| 0.5 * (entry(row, col) + entry(col, row))
}

impl Knots {
    /// Zero knots for `steps` steps.
    #[must_use]
    pub fn zeros(dimensions: Dimensions, steps: usize) -> Self {
        let (n, joint) = (dimensions.states, dimensions.joint());
        Self {
            dimensions,
            dynamics: Matrices::zeros(steps, n, joint),
            measurement: Matrices::zeros(steps + 1, dimensions.measurements, n),
            cost: Matrices::zeros(steps + 1, joint, joint + 1),
            picks: None,
        }
    }

    /// Knots of `x+ = A x + B u`, `y = C x` over `steps` steps, with the cost `1/2 (x' Q x + u' R u)` at each and `1/2 x' Q
    /// x` at the end. Of `Q` and `R` only the symmetric parts count, as in the cost. For another weight at the end,
    /// [`Knots::with_final_weight`]; for one of every step, [`Knots::varying`].
    ///
    /// # Errors
    /// If the shapes do not fit.
    ///
    /// ```
    /// use supple_lqg::{Knots, LinearQuadratic};
    ///
    /// let plant = LinearQuadratic { a: &[[0.9]], b: &[[1.0]], c: &[[1.0]], q: &[[2.0]], r: &[[0.1]] };
    /// let knots = Knots::linear(10, plant)?;
    /// assert_eq!((knots.steps(), knots.dynamics.get(3, 0, 1)), (10, 1.0));
    /// # Ok::<(), supple_lqg::Error>(())
    /// ```
    pub fn linear(steps: usize, LinearQuadratic { a, b, c, q, r }: LinearQuadratic) -> Result<Self, Error> {
        let [a, b, c, q, r] = [a, b, c, q, r].map(constant);
        Self::varying(steps, TimeVarying { a: &a, b: &b, c: &c, q: &q, r: &r })
    }

    /// Knots of `x_{t+1} = A_t x_t + B_t u_t`, `y_t = C_t x_t` over `steps` steps, with the cost `1/2 (x' Q_t x + u' R_t u)` at
    /// each and that of the last `Q` at the end. Of `Q` and `R` only the symmetric parts count, as in the cost.
    ///
    /// # Errors
    /// If the shapes do not fit, or a sequence is too short.
    ///
    /// ```
    /// use supple_lqg::{Knots, Policy, Regularisation, TimeVarying, constant, sequence, solve_riccati};
    ///
    /// // x+ = a x + u over three steps, with a growing; the final state costs 100 times as much as the others.
    /// let plant = TimeVarying {
    ///     a: &sequence(&[[[1.0]], [[1.5]], [[2.0]]]),
    ///     b: &constant(&[[1.0]]),
    ///     c: &constant(&[[1.0]]),
    ///     q: &sequence(&[[[1.0]], [[1.0]], [[1.0]], [[100.0]]]),
    ///     r: &constant(&[[1.0]]),
    /// };
    /// let knots = Knots::varying(3, plant)?;
    /// let mut policy = Policy::zeros(knots.dimensions, 3);
    /// solve_riccati(&knots.dynamics, &knots.cost, Regularisation::default(), &mut policy)?;
    /// // K = -S a / (S + 1) with S = 100.
    /// assert!((policy.feedback.get(2, 0, 0) + 200.0 / 101.0).abs() < 1e-12);
    /// # Ok::<(), supple_lqg::Error>(())
    /// ```
    pub fn varying(steps: usize, TimeVarying { a, b, c, q, r }: TimeVarying) -> Result<Self, Error> {
        let (n, m, p) = (b.rows(), b.cols(), c.rows());
        for (what, array, shape, count) in [
            ("A", a, (n, n), steps),
            ("B", b, (n, m), steps),
            ("C", c, (p, n), steps + 1),
            ("Q", q, (n, n), steps + 1),
            ("R", r, (m, m), steps),
        ] {
            Given { what, array, shape, count }.check_shape()?;
        }
        let mut knots = Self::zeros(Dimensions { states: n, controls: m, measurements: p }, steps);
        for t in 0..=steps {
            place(&mut knots.measurement, t, (0, 0), (p, n), entries(c, t));
            place(&mut knots.cost, t, (0, 0), (n, n), symmetric(entries(q, t)));
            if t < steps {
                place(&mut knots.cost, t, (n, n), (m, m), symmetric(entries(r, t)));
                place(&mut knots.dynamics, t, (0, 0), (n, n), entries(a, t));
                place(&mut knots.dynamics, t, (0, n), (n, m), entries(b, t));
            }
        }
        Ok(knots)
    }

    /// The same knots with the cost `1/2 x' Q x` at the end.
    ///
    /// # Errors
    /// If `Q` is not n x n.
    ///
    /// ```
    /// use supple_lqg::{Knots, LinearQuadratic};
    ///
    /// let plant = LinearQuadratic { a: &[[0.9]], b: &[[1.0]], c: &[[1.0]], q: &[[2.0]], r: &[[0.1]] };
    /// let knots = Knots::linear(10, plant)?.with_final_weight(&[[50.0]])?;
    /// assert_eq!((knots.cost.get(9, 0, 0), knots.cost.get(10, 0, 0)), (2.0, 50.0));
    /// # Ok::<(), supple_lqg::Error>(())
    /// ```
    pub fn with_final_weight(mut self, q: &dyn Entries) -> Result<Self, Error> {
        let (n, steps) = (self.dimensions.states, self.steps());
        check_count("a row of Q", q.shape().1, n)?;
        check_count("a column of Q", q.shape().0, n)?;
        place(&mut self.cost, steps, (0, 0), (n, n), symmetric(|i, j| q.entry(i, j)));
        Ok(self)
    }

    /// The number of steps: one less than the number of knots.
    #[must_use]
    pub fn steps(&self) -> usize {
        self.dynamics.count()
    }

    /// Whether the arrays fit the dimensions and each other.
    ///
    /// # Errors
    /// Which one does not; or that there is no state.
    pub fn check_shapes(&self) -> Result<(), Error> {
        let Dimensions { states: n, measurements: p, .. } = self.dimensions;
        let (joint, steps) = (self.dimensions.joint(), self.steps());
        check_some("the state", n)?;
        let arrays = [
            Given { what: DYNAMICS, array: &self.dynamics, shape: (n, joint), count: 0 },
            Given { what: OUTPUT, array: &self.measurement, shape: (p, n), count: steps + 1 },
            Given { what: COST, array: &self.cost, shape: (joint, joint + 1), count: steps + 1 },
        ];
        arrays.iter().try_for_each(Given::check_shape)?;
        let Some(picks) = &self.picks else { return Ok(()) };
        check_count("the list of picked states", picks.len(), p)?;
        match picks.iter().find(|&&state| state >= n) {
            Some(&found) => Err(Error::TooMany { what: "the index of a picked state".into(), found, most: n - 1 }),
            None => Ok(()),
        }
    }

    /// The first step with an entry that is not finite, as an error.
    pub fn check_finite(&self) -> Result<(), Error> {
        let parts = [
            (&self.dynamics, "the dynamics' derivative"),
            (&self.measurement, "the measurement's derivative"),
            (&self.cost, "the cost's derivative"),
        ];
        for (matrices, what) in parts {
            let bad = (0..matrices.count()).find(|&t| !are_finite(matrices.at(t)));
            if let Some(step) = bad {
                return Err(Error::NotFinite { what, step });
            }
        }
        Ok(())
    }

    /// The first array and step that a Kalman filter reads and that is not finite, as an error.
    #[cold]
    pub(crate) fn not_finite_of_filter(&self, reads_output: bool) -> Option<Error> {
        let (n, stride) = (self.dimensions.states, self.dynamics.stride());
        let has_bad_row = |t: &usize| self.dynamics.at(*t).chunks(stride).any(|row| !are_finite(&row[..n]));
        if let Some(step) = (0..self.steps()).find(has_bad_row) {
            return Some(Error::NotFinite { what: DYNAMICS, step });
        }
        let mut outputs = 0..if reads_output { self.measurement.count() } else { 0 };
        let step = outputs.find(|&t| !are_finite(self.measurement.at(t)))?;
        Some(Error::NotFinite { what: OUTPUT, step })
    }
}

/// Adjoints with respect to the entries of the knots, at every point.
///
/// Example: [`reverse_kalman`](crate::reverse_kalman).
#[derive(Clone, Debug)]
pub struct KnotAdjoints {
    /// With respect to `[A B]`, n x (n + m), stages.
    pub dynamics: Matrices,
    /// With respect to `C`, p x n, stages and end.
    pub measurement: Matrices,
    /// With respect to the second derivatives of the cost, symmetric, (n + m) x (n + m + 1) with an unused last column.
    pub cost: Matrices,
    /// Whether any adjoint with respect to the cost's second derivatives may be non-zero.
    pub has_cost: bool,
}

impl KnotAdjoints {
    /// Zero adjoints for `stages` stages and an end.
    #[must_use]
    pub fn zeros(dimensions: Dimensions, stages: usize) -> Self {
        let (n, joint) = (dimensions.states, dimensions.joint());
        Self {
            dynamics: Matrices::zeros(stages, n, joint),
            measurement: Matrices::zeros(stages + 1, dimensions.measurements, n),
            cost: Matrices::zeros(stages + 1, joint, joint + 1),
            has_cost: false,
        }
    }
}
