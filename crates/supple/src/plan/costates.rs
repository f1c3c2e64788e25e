use supple_kernels::Matrices;

use supple_lqg::ControlBounds;

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
/// stationary: the residuals `r_t = l_u + B' lambda_{t+1}` (theory, equations P.4 and P.4a). `cost` is `[l_zz | l_z]`,
/// `feedback` has the `K`, and `bounded` bounds with the controls, where there are any.
///
/// Along a stationary trajectory `K` does not matter. Elsewhere the residual is the slope of the cost by the controls while
/// the feedback acts, so rounding errors do not grow even if the open loop is unstable.
pub(crate) fn sweep_costates(
    (dynamics, cost): (&Matrices, &Matrices),
    feedback: &Matrices,
    bounded: Option<(&ControlBounds, &Matrices)>,
    costates: &mut Matrices,
) -> Stationarity {
    match bounded {
        None => sweep((dynamics, cost), feedback, costates, |_, _, slope| slope),
        Some((bounds, controls)) => {
            let left = |t: usize, a: usize, slope| bounds.project(a, controls.vector(t)[a], slope);
            sweep((dynamics, cost), feedback, costates, left)
        }
    }
}

/// The sweep; `left` returns the part of the slope by control a at step t that no bound cancels.
fn sweep(
    (dynamics, cost): (&Matrices, &Matrices),
    feedback: &Matrices,
    costates: &mut Matrices,
    left: impl Fn(usize, usize, f64) -> f64,
) -> Stationarity {
    let (steps, n, joint) = (dynamics.count(), dynamics.rows(), dynamics.cols());
    let (stride, wide, narrow) = (dynamics.stride(), cost.stride(), feedback.stride());
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
        for j in n..joint {
            let own = slope(t, j);
            let through: f64 = (0..n).map(|k| f[k * stride + j] * next[k]).sum();
            let slope = own + through;
            let residual = left(t, j - n, slope).abs();
            if residual > result.residual || residual.is_nan() {
                result = Stationarity { residual, step: t, control: j - n, ..result };
            }
            result.scale = result.scale.max(own.abs());
            for (now, gain) in now[..n].iter_mut().zip(&feedback.at(t)[(j - n) * narrow..]) {
                *now += gain * slope;
            }
        }
    }
    result
}
