//! One step of the filters of a batch of samples, processed together: matrices are indexed by sample.

use supple_kernels::rows::Long;
use supple_kernels::{Job, Lanes, Matrices, dispatch};

use super::array;
use super::predict::{LEAST, Predict};
use super::sequential::CorrectEach;
use super::state::Belief;
use super::together::{Correct, Digits};
use crate::Error;
use crate::carried::Carried;
use crate::dense::{dense, of_rows};
use crate::knots::Knots;
use crate::semidefinite::mend;
use crate::shape::Shape;

/// Covariance `V` of the measurement noise of a batch of samples, by padded rows.
///
/// Example: [`correct_each`].
#[derive(Clone, Copy, Debug)]
pub enum SampleNoise<'a> {
    /// One for all samples.
    Shared(&'a [f64]),
    /// One for each sample.
    Each(&'a Matrices),
}

impl<'a> SampleNoise<'a> {
    /// That of a sample.
    fn of(self, sample: usize) -> &'a [f64] {
        match self {
            Self::Shared(v) => v,
            Self::Each(each) => each.at(sample),
        }
    }
}

/// Updates the covariances of all samples with the measurements of one step, each with its own `C`: from `predicted` to
/// `corrected`, with one `V` for all samples or one for each; `knots` has one entry per sample. If `picks` gives the
/// state that each measurement is, `C` is not read.
///
/// # Errors
/// If an innovation covariance is not positive definite; the error's step is the index of the sample.
///
/// ```
/// use supple_lqg::{Belief, Knots, LinearQuadratic, SampleNoise, constant, correct_each, predict_each};
///
/// // Two samples with the prior variances 1 and 3; measurement noise of variance 1, process noise of variance 0.5.
/// let plant = LinearQuadratic { a: &[[1.0]], b: &[[1.0]], c: &[[1.0]], q: &[[1.0]], r: &[[1.0]] };
/// let knots = Knots::linear(2, plant)?;
/// let mut belief = Belief::zeros(1, 1, 1);
/// belief.predicted.set(0, 0, 0, 1.0);
/// belief.predicted.set(1, 0, 0, 3.0);
/// correct_each(&knots, None, SampleNoise::Shared(constant(&[[1.0]]).at(0)), &mut belief)?;
/// predict_each(&knots, constant(&[[0.5]]).at(0), &mut belief);
/// assert!((belief.predicted.get(0, 0, 0) - 1.0).abs() < 1e-12, "1/2 + 0.5");
/// assert!((belief.predicted.get(1, 0, 0) - 1.25).abs() < 1e-12, "3/4 + 0.5");
/// # Ok::<(), supple_lqg::Error>(())
/// ```
pub fn correct_each(knots: &Knots, picks: Option<&[usize]>, v: SampleNoise, belief: &mut Belief) -> Result<(), Error> {
    let failed = dispatch(CorrectAll { knots, picks, v, belief });
    let what = "the innovation covariance of a filter";
    failed.map_or(Ok(()), |step| Err(Error::NotPositiveDefinite { what, step }))
}

/// Propagates the covariances of all samples by one step with the noise `w`, each with its own dynamics: from `corrected` to
/// `predicted`.
///
/// Example: [`correct_each`].
pub fn predict_each(knots: &Knots, w: &[f64], belief: &mut Belief) {
    dispatch(PredictAll { knots, w, belief });
}

struct CorrectAll<'a> {
    knots: &'a Knots,
    /// The state that each measurement measures, if they are processed sequentially.
    picks: Option<&'a [usize]>,
    /// One `V` for all samples, or one for each.
    v: SampleNoise<'a>,
    belief: &'a mut Belief,
}

impl Job for CorrectAll<'_> {
    /// The first sample whose update failed.
    type Output = Option<usize>;

    #[inline(always)]
    fn run<L: Lanes>(self) -> Self::Output {
        let shape = Shape::<Long>::of(self.knots.dimensions);
        for sample in 0..self.belief.corrected.count() {
            let v = self.v.of(sample);
            let is_corrected = match self.picks {
                Some(picks) => {
                    let belief = &mut *self.belief;
                    shape.part::<L, _>(CorrectEach { shape, t: sample, picks, variances: v, belief }).is_ok()
                }
                None => {
                    let belief = &mut *self.belief;
                    let corrected = shape.part::<L, _>(Correct { shape, t: sample, knots: self.knots, v, belief });
                    corrected == Ok(Digits::Enough) || {
                        let c = dense(&self.knots.measurement, sample);
                        let v = of_rows(v, shape.p, shape.small());
                        array::correct(sample, &c, &v, self.belief).is_some()
                    }
                }
            };
            if !is_corrected {
                return Some(sample);
            }
            let corrected = self.belief.corrected.at_mut(sample);
            self.belief.repairs += usize::from(mend(corrected, shape.n, shape.narrow()));
        }
        None
    }
}

struct PredictAll<'a> {
    knots: &'a Knots,
    w: &'a [f64],
    belief: &'a mut Belief,
}

impl Job for PredictAll<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let shape = Shape::<Long>::of(self.knots.dimensions);
        let suggested = Carried::suggested(&self.knots.dynamics, LEAST);
        let Self { knots, w, belief } = self;
        for sample in 0..belief.corrected.count() {
            shape.part::<L, _>(Predict { shape, suggested, from: sample, to: sample, knots, w, belief });
        }
    }
}
