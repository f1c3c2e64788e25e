use crate::Scalar;

/// The factors of a symmetric positive definite matrix, `M = L' D L` with `L` unit lower triangular, over any scalar.
///
/// Eliminating from the last row up adds no non-zero entries to the mass matrix of a tree of bodies (Featherstone 2008,
/// section 6.5). A matrix that is not positive definite gives numbers that are not finite or have a `D` that is not
/// positive.
///
/// ```
/// use supple_kernels::Ldl;
///
/// let factors = Ldl::new(&[vec![2.0, 1.0], vec![1.0, 2.0]]);
/// let x = factors.solve(vec![3.0, 3.0]);
/// assert!(x.iter().all(|x| (x - 1.0_f64).abs() < 1e-15));
/// ```
#[derive(Clone, Debug)]
pub struct Ldl<S> {
    /// Rows of `L` left of the diagonal, with 1 / D at their end.
    rows: Vec<Vec<S>>,
}

impl<S: Scalar> Ldl<S> {
    /// Factors a matrix given by rows, of which only the lower triangle is read.
    #[must_use]
    pub fn new(matrix: &[Vec<S>]) -> Self {
        let mut rows: Vec<Vec<S>> = matrix.iter().enumerate().map(|(i, row)| row[..=i].to_vec()).collect();
        for k in (0..rows.len()).rev() {
            let (above, row) = rows.split_at_mut(k);
            let row = &mut row[0];
            let reciprocal = row[k].recip();
            for i in 0..k {
                let factor = row[i] * reciprocal;
                for j in 0..=i {
                    above[i][j] -= factor * row[j];
                }
            }
            for entry in &mut row[..k] {
                *entry = *entry * reciprocal;
            }
            row[k] = reciprocal;
        }
        Self { rows }
    }

    /// Solves `M x = b`.
    #[must_use]
    pub fn solve(&self, mut b: Vec<S>) -> Vec<S> {
        for (k, row) in self.rows.iter().enumerate().rev() {
            for i in 0..k {
                b[i] = b[i] - row[i] * b[k];
            }
        }
        for (k, row) in self.rows.iter().enumerate() {
            b[k] = b[k] * row[k];
            for i in 0..k {
                b[k] = b[k] - row[i] * b[i];
            }
        }
        b
    }

    /// The entries of `1 / D`: all positive and finite exactly where the matrix is positive definite.
    pub fn reciprocals(&self) -> impl Iterator<Item = S> + '_ {
        self.rows.iter().enumerate().map(|(k, row)| row[k])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn solves_what_it_factored() {
        let matrix = vec![vec![4.0, 1.0, 0.5], vec![1.0, 3.0, -0.2], vec![0.5, -0.2, 2.0]];
        let x = Ldl::new(&matrix).solve(vec![1.0, -2.0, 0.3]);
        for (row, b) in matrix.iter().zip([1.0, -2.0, 0.3]) {
            let product: f64 = row.iter().zip(&x).map(|(a, x)| a * x).sum();
            assert!((product - b).abs() < 1e-15);
        }
        assert!(Ldl::new(&matrix).reciprocals().all(|d| d > 0.0));
        assert!(Ldl::new(&[vec![1.0], vec![2.0, 1.0]]).reciprocals().any(|d| d <= 0.0));
    }
}
