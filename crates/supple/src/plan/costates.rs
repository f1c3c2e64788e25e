use supple_kernels::Matrices;

/// How far a trajectory is from stationary.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Stationarity {
    /// The largest `|l_u + B' lambda_{t+1}|`, 0 where a bound holds the control.
    pub residual: f64,
    /// The largest `|l_u|`, the scale of the residual.
    pub scale: f64,
    /// The step and the control of the largest residual.
    pub step: usize,
    pub control: usize,
}

/// The costates `lambda_t = l_x + A' lambda_{t+1} + K' r_t`, `lambda_N = l_{N,x}`, and how far the controls are from
/// stationary: the residuals `r_t = l_u + B' lambda_{t+1}` (theory, equations P.4, P.4a and P.13). `cost` is
/// `[l_zz | l_z]`, and `feedback` has the `K`, which are 0 without it. `left` is given the residual of control `a` at step
/// `t`, and returns the part of it that no bound cancels.
///
/// Along a stationary trajectory `K` does not matter. Elsewhere the residual is the slope of the cost by the controls while
/// the feedback acts, so rounding errors do not grow even if the open loop is unstable.
pub(crate) fn sweep_costates(
    dynamics: &Matrices,
    cost: &Matrices,
    feedback: Option<&Matrices>,
    costates: &mut Matrices,
    mut left: impl FnMut(usize, usize, f64) -> f64,
) -> Stationarity {
    let (steps, n, joint) = (dynamics.count(), dynamics.rows(), dynamics.cols());
    let (stride, wide) = (dynamics.stride(), cost.stride());
    let slope = |t: usize, i: usize| cost.at(t)[i * wide + joint];
    let mut result = Stationarity::default();
    for i in 0..n {
        costates.vector_mut(steps)[i] = slope(steps, i);
    }
    for t in (0..steps).rev() {
        let f = dynamics.at(t);
        let (now, next) = costates.at_mut_and_next(t);
        for (i, now) in now[..n].iter_mut().enumerate() {
            *now = slope(t, i);
        }
        for (row, &next) in f.chunks_exact(stride).zip(next) {
            for (now, f) in now[..n].iter_mut().zip(row) {
                *now += next * f;
            }
        }
        for a in 0..joint - n {
            let own = slope(t, n + a);
            let through: f64 = (0..n).map(|k| f[k * stride + n + a] * next[k]).sum();
            let slope = own + through;
            let residual = left(t, a, slope).abs();
            if residual > result.residual || residual.is_nan() {
                result = Stationarity { residual, step: t, control: a, ..result };
            }
            result.scale = result.scale.max(own.abs());
            if let Some(feedback) = feedback {
                let row = &feedback.at(t)[a * feedback.stride()..];
                now[..n].iter_mut().zip(row).for_each(|(now, gain)| *now += gain * slope);
            }
        }
    }
    result
}
