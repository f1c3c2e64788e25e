use supple_kernels::math;

/// The statistics of the innovation `nu = y - g(mu)` of one measurement that its likelihood depends on.
///
/// ```
/// use supple_lqg::Innovation;
///
/// // An innovation of 3 with the variance 4.
/// let found = Innovation::of(&mut [3.0], &[2.0], 1);
/// assert!((found.squared - 2.25).abs() < 1e-12);
/// assert!((found.log_determinant - 4f64.ln()).abs() < 1e-12);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Innovation {
    /// `nu' S^-1 nu`, with the innovation covariance `S`: its mean is p if the filter is consistent.
    pub squared: f64,
    /// `ln |S|`
    pub log_determinant: f64,
}

impl Innovation {
    /// From the lower Cholesky factor of `S`, rows `stride` apart; the solution overwrites `nu`.
    pub fn of(nu: &mut [f64], factor: &[f64], stride: usize) -> Self {
        let mut found = Self::default();
        for i in 0..nu.len() {
            let row = &factor[i * stride..=i * stride + i];
            let done: f64 = row.iter().zip(&nu[..i]).map(|(g, w)| g * w).sum();
            nu[i] = (nu[i] - done) / row[i];
            found.squared += nu[i] * nu[i];
            found.log_determinant += 2.0 * math::ln(row[i]);
        }
        found
    }
}
