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

/// One matrix that applies at every step.
///
/// ```
/// let identity = supple_lqg::constant(&[[1.0, 0.0], [0.0, 1.0]]);
/// assert!(identity.is_constant() && identity.get(17, 1, 1) == 1.0);
/// ```
pub fn constant(from: &impl Entries) -> Matrices {
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

fn fill(out: &mut Matrices, t: usize, from: &impl Entries) {
    let (rows, cols) = from.shape();
    for (i, j) in (0..rows).flat_map(|i| (0..cols).map(move |j| (i, j))) {
        out.set(t, i, j, from.entry(i, j));
    }
}

#[cfg(all(test, feature = "nalgebra", feature = "ndarray", feature = "faer"))]
mod tests {
    use super::*;

    #[test]
    fn matrices_of_all_libraries_are_the_same() {
        let rows = [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]];
        let expected = constant(&rows).to_rows();
        assert_eq!(constant(&nalgebra::DMatrix::from_fn(2, 3, |i, j| rows[i][j])).to_rows(), expected);
        assert_eq!(constant(&nalgebra::Matrix2x3::from_fn(|i, j| rows[i][j])).to_rows(), expected);
        assert_eq!(constant(&ndarray::arr2(&rows)).to_rows(), expected);
        assert_eq!(constant(&ndarray::arr2(&rows).view()).to_rows(), expected);
        assert_eq!(constant(&faer::Mat::from_fn(2, 3, |i, j| rows[i][j])).to_rows(), expected);
    }
}
