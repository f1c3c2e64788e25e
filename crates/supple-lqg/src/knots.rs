//! Knots: the linearisation of a trajectory.

use supple_kernels::Matrices;

use crate::Error;
use crate::arrays::Entries;
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
    pub a: &'a dyn Entries,
    /// `B`, n x m.
    pub b: &'a dyn Entries,
    /// `C`, p x n.
    pub c: &'a dyn Entries,
    /// `Q`, n x n.
    pub q: &'a dyn Entries,
    /// `R`, m x m.
    pub r: &'a dyn Entries,
}

/// The symmetric part of a square matrix.
struct Symmetric<'a>(&'a dyn Entries);

impl Entries for Symmetric<'_> {
    fn shape(&self) -> (usize, usize) {
        self.0.shape()
    }

    fn entry(&self, row: usize, col: usize) -> f64 {
        0.5 * (self.0.entry(row, col) + self.0.entry(col, row))
    }
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
    /// x` at the end. Of `Q` and `R` only the symmetric parts count, as in the cost.
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
        let ((n, m), p) = (b.shape(), c.shape().0);
        let shapes = [
            ("a row of A", a.shape().1, n),
            ("a column of A", a.shape().0, n),
            ("a row of C", c.shape().1, n),
            ("a row of Q", q.shape().1, n),
            ("a column of Q", q.shape().0, n),
            ("a row of R", r.shape().1, m),
            ("a column of R", r.shape().0, m),
        ];
        if let Some((what, found, expected)) = shapes.into_iter().find(|(_, found, expected)| found != expected) {
            return Err(Error::Shape { what: what.into(), found, expected });
        }
        let mut knots = Self::zeros(Dimensions { states: n, controls: m, measurements: p }, steps);
        for t in 0..=steps {
            let place = |to: &mut Matrices, (row, col): (usize, usize), from: &dyn Entries| {
                let (rows, cols) = from.shape();
                for (i, j) in (0..rows).flat_map(|i| (0..cols).map(move |j| (i, j))) {
                    to.set(t, row + i, col + j, from.entry(i, j));
                }
            };
            place(&mut knots.measurement, (0, 0), c);
            place(&mut knots.cost, (0, 0), &Symmetric(q));
            if t < steps {
                place(&mut knots.cost, (n, n), &Symmetric(r));
                place(&mut knots.dynamics, (0, 0), a);
                place(&mut knots.dynamics, (0, n), b);
            }
        }
        Ok(knots)
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
