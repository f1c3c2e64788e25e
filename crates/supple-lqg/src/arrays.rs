//! Converts matrices of other libraries, and of plain Rust, to [`Matrices`].

use supple_kernels::Matrices;

/// A matrix whose entries can be read: nested arrays and, with the features of the same names, matrices of `nalgebra`,
/// `ndarray` and `faer`.
///
/// Example: [`constant`].
pub trait Entries {
    /// Rows and columns.
    fn shape(&self) -> (usize, usize);

    /// The entry in a row and a column, counted from 0.
    fn entry(&self, row: usize, col: usize) -> f64;
}

impl<const R: usize, const C: usize> Entries for [[f64; C]; R] {
    fn shape(&self) -> (usize, usize) {
        (R, C)
    }

    fn entry(&self, row: usize, col: usize) -> f64 {
        self[row][col]
    }
}

#[cfg(feature = "nalgebra")]
impl<R, C, S> Entries for nalgebra::Matrix<f64, R, C, S>
where
    R: nalgebra::Dim,
    C: nalgebra::Dim,
    S: nalgebra::RawStorage<f64, R, C>,
{
    fn shape(&self) -> (usize, usize) {
        Self::shape(self)
    }

    fn entry(&self, row: usize, col: usize) -> f64 {
        self[(row, col)]
    }
}

#[cfg(feature = "ndarray")]
impl<S: ndarray::Data<Elem = f64>> Entries for ndarray::ArrayBase<S, ndarray::Ix2> {
    fn shape(&self) -> (usize, usize) {
        self.dim()
    }

    fn entry(&self, row: usize, col: usize) -> f64 {
        self[[row, col]]
    }
}

#[cfg(feature = "faer")]
impl Entries for faer::Mat<f64> {
    fn shape(&self) -> (usize, usize) {
        (self.nrows(), self.ncols())
    }

    fn entry(&self, row: usize, col: usize) -> f64 {
        self[(row, col)]
    }
}

/// A matrix that can be made of its entries: nested `Vec`s and, with the features of the same names, matrices of `nalgebra`,
/// `ndarray` and `faer`.
///
/// Example: [`matrix`].
pub trait FromEntries {
    /// The matrix of so many rows and columns with these entries, by row and column.
    fn from_entries(rows: usize, cols: usize, entry: impl Fn(usize, usize) -> f64) -> Self;
}

impl FromEntries for Vec<Vec<f64>> {
    fn from_entries(rows: usize, cols: usize, entry: impl Fn(usize, usize) -> f64) -> Self {
        (0..rows).map(|i| (0..cols).map(|j| entry(i, j)).collect()).collect()
    }
}

#[cfg(feature = "nalgebra")]
impl FromEntries for nalgebra::DMatrix<f64> {
    fn from_entries(rows: usize, cols: usize, entry: impl Fn(usize, usize) -> f64) -> Self {
        Self::from_fn(rows, cols, entry)
    }
}

#[cfg(feature = "ndarray")]
impl FromEntries for ndarray::Array2<f64> {
    fn from_entries(rows: usize, cols: usize, entry: impl Fn(usize, usize) -> f64) -> Self {
        Self::from_shape_fn((rows, cols), |(i, j)| entry(i, j))
    }
}

#[cfg(feature = "faer")]
impl FromEntries for faer::Mat<f64> {
    fn from_entries(rows: usize, cols: usize, entry: impl Fn(usize, usize) -> f64) -> Self {
        Self::from_fn(rows, cols, entry)
    }
}

/// Matrix `t` of a sequence, as nested `Vec`s or as a matrix of another library: the feedback gain `K_t`, of m rows and n
/// columns, or a covariance at a step. For the Kalman gain, [`Belief::gain`](crate::Belief::gain).
///
/// # Panics
/// If there is no such matrix.
///
/// ```
/// use supple_lqg::{Knots, LinearQuadratic, Policy, Regularisation, matrix, solve_riccati};
///
/// let (a, b, c) = ([[1.0, 0.1], [0.0, 1.0]], [[0.005], [0.1]], [[1.0, 0.0]]);
/// let plant = LinearQuadratic { a: &a, b: &b, c: &c, q: &[[1.0, 0.0], [0.0, 0.1]], r: &[[0.01]] };
/// let knots = Knots::linear(50, plant)?;
/// let mut policy = Policy::zeros(knots.dimensions, 50);
/// solve_riccati(&knots.dynamics, &knots.cost, Regularisation::default(), &mut policy)?;
/// let gain: Vec<Vec<f64>> = matrix(&policy.feedback, 0);
/// assert_eq!((gain.len(), gain[0].len()), (1, 2));
/// assert!(gain[0][0] < -5.0 && gain[0][1] < -3.0, "against position and velocity");
/// # Ok::<(), supple_lqg::Error>(())
/// ```
#[must_use]
pub fn matrix<M: FromEntries>(of: &Matrices, t: usize) -> M {
    M::from_entries(of.rows(), of.cols(), |row, col| of.get(t, row, col))
}

/// One matrix that applies at every step.
///
/// ```
/// let identity = supple_lqg::constant(&[[1.0, 0.0], [0.0, 1.0]]);
/// assert!(identity.is_constant() && identity.get(17, 1, 1) == 1.0);
/// ```
pub fn constant(from: &(impl Entries + ?Sized)) -> Matrices {
    let (rows, cols) = from.shape();
    let mut out = Matrices::constant(rows, cols);
    fill(&mut out, 0, from);
    out
}

/// One matrix for each step.
///
/// # Panics
/// If their shapes differ.
///
/// ```
/// let two = supple_lqg::sequence(&[[[1.0]], [[2.0]]]);
/// assert_eq!((two.count(), two.get(1, 0, 0)), (2, 2.0));
/// ```
pub fn sequence<M: Entries>(from: &[M]) -> Matrices {
    let (rows, cols) = from.first().map_or((0, 0), Entries::shape);
    let mut out = Matrices::zeros(from.len(), rows, cols);
    for (t, matrix) in from.iter().enumerate() {
        assert!(
            matrix.shape() == (rows, cols),
            "matrix {t} is {:?}, and the first is {:?}",
            matrix.shape(),
            (rows, cols)
        );
        fill(&mut out, t, matrix);
    }
    out
}

fn fill(out: &mut Matrices, t: usize, from: &(impl Entries + ?Sized)) {
    let (rows, cols) = from.shape();
    for (i, j) in (0..rows).flat_map(|i| (0..cols).map(move |j| (i, j))) {
        out.set(t, i, j, from.entry(i, j));
    }
}

#[cfg(all(test, feature = "nalgebra", feature = "ndarray", feature = "faer"))]
mod tests {
    use super::*;

    const ROWS: [[f64; 3]; 2] = [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]];

    #[test]
    fn matrices_of_all_libraries_are_the_same() {
        let rows = ROWS;
        let expected = constant(&rows);
        assert!(expected.rows_of(0).eq(rows), "both rows");
        assert_eq!(constant(&nalgebra::DMatrix::from_fn(2, 3, |i, j| rows[i][j])), expected);
        assert_eq!(constant(&nalgebra::Matrix2x3::from_fn(|i, j| rows[i][j])), expected);
        assert_eq!(constant(&ndarray::arr2(&rows)), expected);
        assert_eq!(constant(&ndarray::arr2(&rows).view()), expected);
        assert_eq!(constant(&faer::Mat::from_fn(2, 3, |i, j| rows[i][j])), expected);
    }

    #[test]
    fn results_are_converted_to_matrices_of_all_libraries() {
        let (rows, from) = (ROWS, sequence(&[[[0.0; 3]; 2], ROWS]));
        assert_eq!(matrix::<Vec<Vec<f64>>>(&from, 1), rows);
        assert_eq!(matrix::<nalgebra::DMatrix<f64>>(&from, 1), nalgebra::DMatrix::from_fn(2, 3, |i, j| rows[i][j]));
        assert_eq!(matrix::<ndarray::Array2<f64>>(&from, 1), ndarray::arr2(&rows));
        assert_eq!(matrix::<faer::Mat<f64>>(&from, 1), faer::Mat::from_fn(2, 3, |i, j| rows[i][j]));
    }
}
