//! Singular values of long products of matrices, as logarithms, so that the largest do not overflow and the others are not
//! lost in their rounding.

use nalgebra::{DMatrix, DVector};
use supple_kernels::math;

/// `Phi = Q D U` with orthonormal columns in `Q`, a diagonal `D` known by its logarithms, and rows of `U` whose directions
/// are well apart: factors of a product that stay exact whatever it does.
struct Product {
    /// Columns of `Q`, r of them, of length n.
    basis: Vec<DVector<f64>>,
    /// Logarithms of the diagonal of `D`, r.
    scales: Vec<f64>,
    /// Rows of `U`, r of them, of length n.
    rows: Vec<DVector<f64>>,
}

/// Maximum number of sweeps; they converge quadratically, so ten are more than enough.
const SWEEPS: usize = 60;

/// Natural logarithms of the singular values of `A_{T-1} ... A_0`, those that are not 0, in no order.
///
/// Each matrix is n x n. By Gram-Schmidt with pivots on columns whose scales are kept as logarithms, then one-sided Jacobi
/// rotations, which find small singular values of a graded matrix as exactly as great ones.
pub(super) fn log_singular_values(matrices: impl Iterator<Item = DMatrix<f64>>, order: usize) -> Vec<f64> {
    let unit = |i: usize| DVector::from_fn(order, |row, _| f64::from(row == i));
    let start: Vec<DVector<f64>> = (0..order).map(unit).collect();
    let mut product = Product { basis: start.clone(), scales: vec![0.0; order], rows: start };
    for matrix in matrices {
        product = product.times(&matrix);
    }
    product.log_singular_values()
}

impl Product {
    /// `A Phi`: columns of `A Q`, each with its scale, made orthogonal from the greatest to the least.
    fn times(self, matrix: &DMatrix<f64>) -> Self {
        let mut left: Vec<(DVector<f64>, f64, DVector<f64>)> = self
            .basis
            .iter()
            .zip(self.scales)
            .zip(self.rows)
            .map(|((column, scale), row)| (matrix * column, scale, row))
            .collect();
        let mut next = Self { basis: Vec::new(), scales: Vec::new(), rows: Vec::new() };
        let size = |(column, scale, _): &(DVector<f64>, f64, DVector<f64>)| math::ln(column.norm()) + scale;
        while let Some(greatest) = (0..left.len()).max_by(|&a, &b| size(&left[a]).total_cmp(&size(&left[b]))) {
            let (column, scale, mut row) = left.swap_remove(greatest);
            let norm = column.norm();
            if norm == 0.0 {
                // The remaining columns are mapped to 0.
                break;
            }
            let direction = column / norm;
            for (other, other_scale, other_row) in &mut left {
                // Twice, so that rounding leaves nothing along the direction.
                let (mut along, whole) = (0.0, other.norm());
                for _ in 0..2 {
                    let part = direction.dot(other);
                    other.axpy(-part, &direction, 1.0);
                    along += part;
                }
                if other.norm() <= 4.0 * f64::EPSILON * whole {
                    other.fill(0.0);
                }
                row.axpy(along / norm * math::exp(*other_scale - scale), other_row, 1.0);
            }
            next.basis.push(direction);
            next.scales.push(scale + math::ln(norm));
            next.rows.push(row);
        }
        next
    }

    /// The logarithms of the singular values of `D U`, by rotations of its rows until they are orthogonal.
    fn log_singular_values(mut self) -> Vec<f64> {
        for _ in 0..SWEEPS {
            let mut rotated = false;
            for i in 0..self.rows.len() {
                for j in i + 1..self.rows.len() {
                    rotated |= self.rotate(i, j);
                }
            }
            if !rotated {
                break;
            }
        }
        self.rows.iter().zip(&self.scales).map(|(row, scale)| math::ln(row.norm()) + scale).collect()
    }

    /// Makes two rows of `D U` orthogonal; returns whether a rotation was necessary.
    fn rotate(&mut self, i: usize, j: usize) -> bool {
        let (i, j) = if self.scales[i] >= self.scales[j] { (i, j) } else { (j, i) };
        let (great, small) = (self.rows[i].clone(), self.rows[j].clone());
        let share = math::exp(self.scales[j] - self.scales[i]);
        let (a, b, g) = (great.norm_squared(), small.norm_squared(), great.dot(&small));
        if g == 0.0 || g * g <= 1e-30 * a * b {
            return false;
        }
        // With the rows v and share w: tan of the angle over the share, which has a limit as the share vanishes.
        let difference = share * share * b - a;
        let tangent = 2.0 * g.abs() / (difference.abs() + (difference * difference + (2.0 * share * g).powi(2)).sqrt());
        let tangent = if (difference > 0.0) == (g > 0.0) { tangent } else { -tangent };
        let cosine = (1.0 + (share * tangent).powi(2)).sqrt().recip();
        self.rows[i] = (&great - &small * (share * share * tangent)) * cosine;
        self.rows[j] = (&small + &great * tangent) * cosine;
        true
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    fn sorted(mut values: Vec<f64>) -> Vec<f64> {
        values.sort_by(f64::total_cmp);
        values
    }

    fn random(seed: u64, order: usize) -> DMatrix<f64> {
        let mut state = seed;
        DMatrix::from_fn(order, order, |_, _| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) as f64 / f64::from(1_u32 << 30) - 1.0
        })
    }

    #[test]
    fn short_products_have_the_singular_values_of_their_matrix() {
        for order in 1..6 {
            let matrices: Vec<_> = (0..4).map(|t| random(17 * order as u64 + t, order)).collect();
            let product = matrices.iter().fold(DMatrix::identity(order, order), |product, a| a * product);
            let expected = sorted(product.singular_values().iter().map(|s| s.ln()).collect());
            let found = sorted(log_singular_values(matrices.into_iter(), order));
            for (found, expected) in found.iter().zip(&expected) {
                assert!((found - expected).abs() < 1e-9, "{found} and {expected}");
            }
        }
    }

    #[test]
    fn a_product_of_10_000_matrices_keeps_its_small_singular_values() {
        // Q_{t+1} diag(3, 1/2, 1e-3) Q_t': the product is Q_T diag(3^T, 2^-T, 1e-3T) Q_0', far beyond 1e308.
        let factors = DMatrix::from_diagonal(&DVector::from_vec(vec![3.0, 0.5, 1e-3]));
        let turned: Vec<DMatrix<f64>> = (0..=10_000).map(|t| random(t + 5, 3).qr().q()).collect();
        let matrices = turned.windows(2).map(|q| &q[1] * &factors * q[0].transpose());
        let found = sorted(log_singular_values(matrices, 3));
        for (found, factor) in found.iter().zip([1e-3_f64, 0.5, 3.0]) {
            let expected = 10_000.0 * factor.ln();
            assert!((found - expected).abs() < 1e-9 * expected.abs(), "{found} and {expected}");
        }
    }

    #[test]
    fn what_is_mapped_to_0_has_no_logarithm() {
        let singular = DMatrix::from_row_slice(2, 2, &[1.0, 1.0, 1.0, 1.0]);
        let found = log_singular_values([singular.clone(), singular].into_iter(), 2);
        assert_eq!(found.len(), 1);
        assert!((found[0] - 4.0_f64.ln()).abs() < 1e-14);
    }
}
