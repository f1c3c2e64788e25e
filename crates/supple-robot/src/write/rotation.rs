//! Rotation matrices as quaternions.

/// The quaternion `[w, x, y, z]` of a rotation matrix, using its greatest entry to stay accurate at any angle.
pub(super) fn quaternion(r: &[[f64; 3]; 3]) -> [f64; 4] {
    let trace = r[0][0] + r[1][1] + r[2][2];
    let off = [r[2][1] - r[1][2], r[0][2] - r[2][0], r[1][0] - r[0][1]];
    let greatest = [0, 1, 2].into_iter().fold(0, |best, i| if r[i][i] > r[best][best] { i } else { best });
    let mut q = if trace > r[greatest][greatest] {
        [1.0 + trace, off[0], off[1], off[2]]
    } else {
        let (i, j, k) = (greatest, (greatest + 1) % 3, (greatest + 2) % 3);
        let mut q = [off[i], 0.0, 0.0, 0.0];
        q[1 + i] = 1.0 + r[i][i] - r[j][j] - r[k][k];
        q[1 + j] = r[j][i] + r[i][j];
        q[1 + k] = r[k][i] + r[i][k];
        q
    };
    let size = q.iter().map(|entry| entry * entry).sum::<f64>().sqrt();
    q.iter_mut().for_each(|entry| *entry /= size);
    q
}
