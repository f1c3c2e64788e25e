//! The steady covariance of a Kalman filter.

use supple_kernels::halt;

use crate::dense::{Dense, congruence, symmetric};

/// Steps taken before doubling begins, in addition to two for every state.
const FIRST_STEPS: usize = 30;

/// Maximum number of doublings.
const DOUBLINGS: usize = 60;

/// Maximum number of restarts: if most of a covariance cancels, the remainder is rounding, and the search restarts there.
const RESTARTS: usize = 30;
const MOSTLY: f64 = 1e-3;

/// The limit of `P <- A (P^-1 + G)^-1 A' + W` from a covariance `start`; `None` if there is none.
///
/// Takes some steps, then doubles their number for the deviation from the covariance reached: in the
/// closed loop of a filter with this covariance, modes that grow without noise are stable.
pub(super) fn settled(a: &Dense, precision: &Dense, process: &Dense, start: &Dense) -> Option<Dense> {
    let n = a.nrows();
    let mut found = start.clone();
    for _ in 0..RESTARTS {
        let mut first = found;
        for _ in 0..FIRST_STEPS + 2 * n {
            if halt::is_requested() {
                return None;
            }
            first = step(a, precision, process, &first)?.0;
        }
        let (next, kept) = step(a, precision, process, &first)?;
        let gained = symmetric(precision * &kept);
        let more = doubled((a * &kept).transpose(), gained, symmetric(next - &first), first.norm())?;
        found = symmetric(&first + more);
        if found.norm() >= MOSTLY * first.norm() {
            break;
        }
    }
    Some(found)
}

/// One step, and `(I + P G)^-1`: the factor that the measurement leaves of an error.
fn step(a: &Dense, precision: &Dense, process: &Dense, p: &Dense) -> Option<(Dense, Dense)> {
    let kept = (Dense::identity(p.nrows(), p.nrows()) + p * precision).try_inverse()?;
    let next = congruence(a, &symmetric(&kept * p)) + process;
    next.iter().all(|entry| entry.is_finite()).then_some((symmetric(next), kept))
}

/// The limit of `X <- Q + A'X (I + G X)^-1 A` from 0, by doubling the number of steps. Changes within rounding of a
/// matrix of the size `beside` do not count.
fn doubled(mut a: Dense, mut g: Dense, q: Dense, beside: f64) -> Option<Dense> {
    let n = a.nrows();
    let mut h = q;
    for _ in 0..DOUBLINGS {
        if halt::is_requested() {
            return None;
        }
        let lu = (Dense::identity(n, n) + &g * &h).lu();
        let (a_next, g_next) = (lu.solve(&a)?, lu.solve(&g)?);
        let more = symmetric(a.transpose() * &h * &a_next);
        h += &more;
        if !h.iter().all(|entry| entry.is_finite()) {
            return None;
        }
        if more.norm() <= 1e-15 * (h.norm() + beside) {
            return Some(h);
        }
        g += symmetric(&a * g_next * a.transpose());
        a = &a * a_next;
    }
    Some(h)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Modes that grow without noise: filter steps from a positive covariance reach the result, steps from 0 would not.
    #[test]
    fn modes_that_grow_without_noise_stay_uncertain() {
        let a = Dense::from_row_slice(3, 3, &[2.0, 1.0, 0.5, 0.0, -1.5, 0.25, 0.0, 0.0, 0.5]);
        let process = Dense::from_diagonal(&nalgebra::DVector::from_vec(vec![0.0, 0.0, 1.0]));
        let c = Dense::from_row_slice(1, 3, &[1.0, -0.7, 0.4]);
        let identity = Dense::identity(3, 3);
        let found = settled(&a, &(c.transpose() * &c), &process, &identity).unwrap();
        let mut steps = identity;
        for _ in 0..400 {
            let gain = &steps * c.transpose() / (1.0 + (&c * &steps * c.transpose())[(0, 0)]);
            let kept = Dense::identity(3, 3) - &gain * &c;
            steps = &a * (&kept * &steps * kept.transpose() + &gain * gain.transpose()) * a.transpose() + &process;
        }
        assert!((&found - &steps).norm() < 1e-9 * steps.norm(), "{found} {steps}");
        // At least the growth `2 * 1.5` of the unstable modes is needed as information.
        let innovation = 1.0 + (&c * &found * c.transpose())[(0, 0)];
        assert!(0.5 * innovation.ln() > 3f64.ln(), "{innovation}");
    }
}
