use supple_kernels::rows::Rows;
use supple_kernels::{Job, Lanes, dispatch, halt};

use super::array;
use super::predict::{LEAST, Predict};
use super::sequential::CorrectEach;
use super::state::{Belief, Form};
use super::together::{Correct, Digits};
use crate::Error;
use crate::carried::Carried;
use crate::dense::are_finite;
use crate::knots::Knots;
use crate::noise::Noise;
use crate::semidefinite::mend;
use crate::shape::{Shape, by_length};

/// The Kalman recursion over knots (theory, equation B.1), in Joseph form:
///
/// ```text
/// P_0 = X_0      P_{t+1} = A Sigma A' + W      S^y = C P C' + V      L = P C' (S^y)^-1
/// Sigma = (I - L C) P (I - L C)' + L V L'
/// ```
///
/// With `T = P - L C P` and `D = T C' - L V`, zero up to rounding, the last line is `T - D L'`: the same result in
/// n^2 p operations, with the same cancellation of rounding errors. `P`, `Sigma`, `W` and `X_0` may be singular.
/// Independent measurements of single states are processed sequentially, which is equivalent. If double precision is
/// not sufficient, for example with two sensors of very different precision, the square-root form is used (B.2d).
///
/// # Errors
/// If arrays do not fit each other, `X_0` or `W` is not symmetric and positive semidefinite, `V` is not symmetric and positive
/// definite, or a number that it reads is not finite; with many states, also if a stop is requested.
///
/// Example: the [front page](crate).
pub fn kalman(knots: &Knots, noise: &Noise, belief: &mut Belief) -> Result<(), Error> {
    knots.check_shapes()?;
    noise.check(knots.dimensions, knots.steps())?;
    belief.check_shapes(knots.dimensions, knots.steps())?;
    let swept = dispatch(Sweep { knots, noise, belief, heeds_stop: true });
    // A number that is not finite stays so to the end, or makes a factorisation fail.
    let failed = match swept {
        Ok(()) if are_finite(belief.corrected.at(knots.steps())) => return Ok(()),
        Ok(()) => Error::NotFinite { what: "the covariance of the state", step: first_not_finite(belief) },
        Err(Error::Stopped) => return Err(Error::Stopped),
        Err(error) => error,
    };
    // Measurements that are picked do not read C.
    let reads_output = one_at_a_time(knots, noise).is_none();
    Err(knots.not_finite_of_filter(reads_output).unwrap_or(failed))
}

/// The first step whose covariance is not finite.
#[cold]
fn first_not_finite(belief: &Belief) -> usize {
    let steps = 0..belief.corrected.count();
    steps.into_iter().find(|&t| !are_finite(belief.corrected.at(t))).unwrap_or_default()
}

/// As [`kalman`], also where a stop is requested: for searches that decide themselves when to end.
pub(crate) fn kalman_to_the_end(knots: &Knots, noise: &Noise, belief: &mut Belief) -> Result<(), Error> {
    dispatch(Sweep { knots, noise, belief, heeds_stop: false })
}

/// The states that are measured, if each measurement is of one state with noise of its own, so that measurements can be
/// taken one at a time; none at all if nothing is measured.
pub(super) fn one_at_a_time<'a>(knots: &'a Knots, noise: &Noise) -> Option<&'a [usize]> {
    match knots.dimensions.measurements {
        0 => Some(&[]),
        _ => knots.picks.as_deref().filter(|_| noise.measurements_are_independent()),
    }
}

struct Sweep<'a> {
    knots: &'a Knots,
    noise: &'a Noise,
    belief: &'a mut Belief,
    /// Whether large filters end where a stop is requested.
    heeds_stop: bool,
}

/// Filters with more states check for a stop request, because their steps take long.
const LARGE: usize = 32;

/// Steps between two full checks that `Sigma` is positive semidefinite.
const GUARD_INTERVAL: usize = 16;

impl Job for Sweep<'_> {
    type Output = Result<(), Error>;

    #[inline(always)]
    fn run<L: Lanes>(self) -> Self::Output {
        by_length!(self.knots.dimensions, |R| sweep::<L, R>(self))
    }
}

#[inline(always)]
fn sweep<L: Lanes, R: Rows>(Sweep { knots, noise, belief, heeds_stop }: Sweep) -> Result<(), Error> {
    let heeds_stop = heeds_stop && knots.dimensions.states > LARGE;
    let (steps, shape) = (knots.steps(), Shape::<R>::of(knots.dimensions));
    belief.repairs = 0;
    let picks = one_at_a_time(knots, noise);
    belief.form = if picks.is_some() { Form::EachAlone } else { Form::Together };
    let suggested = if !R::CALLED { None } else { Carried::suggested(&knots.dynamics, LEAST) };
    belief.predicted.at_mut(0).copy_from_slice(noise.initial.at(0));
    for t in 0..=steps {
        if heeds_stop && halt::is_requested() {
            return Err(Error::Stopped);
        }
        if t > 0 {
            let (from, w) = (t - 1, noise.process.at(t - 1));
            shape.part::<L, _>(Predict { shape, suggested, from, to: t, knots, w, belief });
        }
        let v = noise.measurement.at(t);
        match picks {
            Some(picks) => {
                let corrected = shape.part::<L, _>(CorrectEach { shape, t, picks, variances: v, belief });
                if corrected.is_err() {
                    return Err(Error::NotPositiveDefinite { what: "the innovation covariance", step: t });
                }
            }
            None => {
                if shape.part::<L, _>(Correct { shape, t, knots, v, belief }) != Ok(Digits::Enough) {
                    return array::sweep(knots, noise, belief);
                }
            }
        }
        if t % GUARD_INTERVAL == 0 || t == steps {
            belief.repairs += usize::from(mend(belief.corrected.at_mut(t), shape.n, shape.narrow()));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::knots::Dimensions;

    /// The form that a one-step filter uses whose sensors measure sums of all states, with shared or independent noise.
    fn form_of(n: usize, p: usize, precision: f64, shared: f64) -> Form {
        let mut knots = Knots::zeros(Dimensions { states: n, controls: 1, measurements: p }, 1);
        let mut noise = Noise::zeros(n, p);
        for i in 0..n {
            noise.initial.set(0, i, i, 1.0);
            noise.process.set(0, i, i, 0.1);
            (0..n).for_each(|j| knots.dynamics.set(0, i, j, if i == j { 0.9 } else { 0.05 }));
        }
        for (i, j) in (0..p).flat_map(|i| (0..p).map(move |j| (i, j))) {
            noise.measurement.set(0, i, j, precision * if i == j { 1.0 } else { shared });
        }
        for (t, i, j) in (0..=1).flat_map(|t| (0..p).flat_map(move |i| (0..n).map(move |j| (t, i, j)))) {
            knots.measurement.set(t, i, j, if i == j { 1.0 } else { 0.1 });
        }
        let mut belief = Belief::zeros(n, p, 1);
        assert_eq!(kalman(&knots, &noise, &mut belief), Ok(()));
        belief.form
    }

    /// The square-root form costs many times as much: sensors of ordinary precision must not trigger it.
    #[test]
    fn square_roots_are_taken_only_where_digits_are_lost() {
        for (n, p) in [(1, 1), (3, 2), (5, 4), (9, 6), (20, 9)] {
            for shared in [0.0, 0.3] {
                for precision in [1e2, 1.0, 1e-4, 1e-6] {
                    assert_eq!(form_of(n, p, precision, shared), Form::Together, "{n} {p} {precision} {shared}");
                }
                let (few, blurred) = (form_of(n, p, 1e-26, shared), form_of(n, n, 1e-26, shared));
                assert_eq!((few, blurred), (Form::Roots, Form::Roots), "{n} {p} {shared}");
            }
        }
    }
}
