use supple_kernels::Matrices;

use supple_lqg::mend;

/// Makes non-convex second derivatives of costs convex, for [`Curvature::GaussNewton`](super::Curvature): each square
/// part of the `[l_zz | l_z]` matrices, `joint` x `joint`, becomes the nearest positive semidefinite one. Returns how
/// many were changed.
///
/// Matrices that are semidefinite up to rounding are unchanged, which is checked by one factorisation each. So are those
/// with non-finite entries, which plans report. A system that calls this must write every entry of its matrices
/// each time, including zeros.
///
/// ```
/// use supple_model::system::make_convex;
///
/// // One matrix [l_zz | l_z] whose square part has the eigenvalues 3 and -1.
/// let mut quadratics = supple_lqg::sequence(&[[[1.0, 2.0, 0.0], [2.0, 1.0, 0.0]]]);
/// assert_eq!(make_convex(&mut quadratics, 2), 1);
/// assert!((quadratics.get(0, 0, 0) - 1.5).abs() < 1e-12);
/// ```
pub fn make_convex(quadratics: &mut Matrices, joint: usize) -> usize {
    let stride = quadratics.stride();
    let mut changed = 0;
    for index in 0..quadratics.count() {
        let matrix = quadratics.at_mut(index);
        if matrix.iter().all(|entry| entry.is_finite()) {
            changed += usize::from(mend(matrix, joint, stride));
        }
    }
    changed
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn saddles_lose_their_descent_and_all_else_stays() {
        let mut quadratics = Matrices::zeros(3, 2, 3);
        let rows = [[[0.0, 2.0], [2.0, 0.0]], [[1.0, 2.0], [2.0, 4.0]], [[f64::NAN, 0.0], [0.0, -1.0]]];
        for (t, rows) in rows.iter().enumerate() {
            for (i, row) in rows.iter().enumerate() {
                row.iter().enumerate().for_each(|(j, &entry)| quadratics.set(t, i, j, entry));
                quadratics.set(t, i, 2, 7.0);
            }
        }
        assert_eq!(make_convex(&mut quadratics, 2), 1);
        for (i, j) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            assert!((quadratics.get(0, i, j) - 1.0).abs() < 1e-12, "of the saddle 2 x y only (x + y)^2 / 2 is left");
            assert_eq!(quadratics.get(1, i, j), rows[1][i][j]);
        }
        assert!(quadratics.get(2, 0, 0).is_nan());
        assert!((0..3).all(|t| quadratics.get(t, 0, 2) == 7.0 && quadratics.get(t, 1, 2) == 7.0));
    }
}
