//! Moments of inertia as symmetric 3 x 3 matrices.

use supple_kernels::math;

/// A diagonal matrix.
pub(super) fn diagonal_matrix([x, y, z]: [f64; 3]) -> [[f64; 3]; 3] {
    [[x, 0.0, 0.0], [0.0, y, 0.0], [0.0, 0.0, z]]
}

/// `R I R'`, exactly symmetric.
pub(super) fn turned(r: [[f64; 3]; 3], moment: [[f64; 3]; 3]) -> [[f64; 3]; 3] {
    let axes = [0, 1, 2];
    let half = r.map(|row| axes.map(|j| axes.map(|k| row[k] * moment[k][j]).iter().sum::<f64>()));
    let entry = |i: usize, j: usize| axes.map(|k| half[i][k] * r[j][k]).iter().sum::<f64>();
    axes.map(|i| axes.map(|j| if i <= j { entry(i, j) } else { entry(j, i) }))
}

/// The principal moments of a symmetric matrix, and the rotation whose columns are their axes, by Jacobi's rotations:
/// `A = R diag(moments) R'`.
pub(crate) fn principal(mut a: [[f64; 3]; 3]) -> ([f64; 3], [[f64; 3]; 3]) {
    let mut axes = diagonal_matrix([1.0; 3]);
    for _ in 0..8 {
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            if a[p][q] == 0.0 {
                continue;
            }
            let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
            let tangent = theta.signum() / (theta.abs() + math::hypot(theta, 1.0));
            let cosine = 1.0 / math::hypot(tangent, 1.0);
            let sine = tangent * cosine;
            let mix = |row: &mut [f64; 3]| {
                (row[p], row[q]) = (cosine * row[p] - sine * row[q], sine * row[p] + cosine * row[q]);
            };
            a.iter_mut().for_each(mix);
            axes.iter_mut().for_each(mix);
            let (first, second) = (a[p], a[q]);
            for j in 0..3 {
                a[p][j] = cosine * first[j] - sine * second[j];
                a[q][j] = sine * first[j] + cosine * second[j];
            }
        }
    }
    ([a[0][0], a[1][1], a[2][2]], axes)
}
