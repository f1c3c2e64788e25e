use supple_kernels::Matrices;

use super::ControlBounds;

/// How far a trajectory is from stationary.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Stationarity {
    /// The largest `|l_u + B' lambda_{t+1}|`, 0 where a bound holds the control.
    pub residual: f64,
    /// The largest `|l_u|`, the scale of the residual.
    pub scale: f64,
}

/// The costates `lambda_t = l_x + A' lambda_{t+1}`, `lambda_N = l_{N,x}` (theory, equation P.4), and how far the
/// controls are from stationary. `cost` is `[l_zz | l_z]`; `bounded` has bounds with the controls, where there are any.
pub(crate) fn sweep_costates(
    dynamics: &Matrices,
    cost: &Matrices,
    bounded: Option<(&ControlBounds, &Matrices)>,
    costates: &mut Matrices,
) -> Stationarity {
    match bounded {
        None => sweep(dynamics, cost, costates, |_, _, slope| slope),
        Some((bounds, controls)) => {
            sweep(dynamics, cost, costates, |t, a, slope| bounds.project(a, controls.vector(t)[a], slope))
        }
    }
}

/// The sweep, with what is left at step t of the slope by control a.
fn sweep(
    dynamics: &Matrices,
    cost: &Matrices,
    costates: &mut Matrices,
    left: impl Fn(usize, usize, f64) -> f64,
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
        for j in n..joint {
            let own = slope(t, j);
            let through: f64 = (0..n).map(|k| f[k * stride + j] * next[k]).sum();
            let residual = left(t, j - n, own + through).abs();
            if residual > result.residual || residual.is_nan() {
                result.residual = residual;
            }
            result.scale = result.scale.max(own.abs());
        }
    }
    result
}
