use supple_kernels::graph::{Batch, Program, Source};
use supple_kernels::rows::{Left, Long, Product, View, ViewMut, mirror};
use supple_kernels::{Job, LANES, Lanes, Matrices, Scratch, dispatch, padded};

use super::Points;
use super::batch::after;
use super::programs::TOGETHER;

/// The programs of second derivatives for dynamics with many unknowns.
pub(super) struct Along<'a> {
    pub responses: &'a Program,
    pub curvature: &'a Program,
    /// Lengths of `z` and of the unknowns.
    pub joint: usize,
    /// Leading variables of `z` along which there is curvature: all, or the states.
    pub curved: usize,
    pub unknowns: usize,
}

impl Along<'_> {
    /// Adds `(lambda' f)_zz` at every stage (theory, equation U.5): column b of `D' (lambda' F + mu' r)'' D` is `D'` times the
    /// second derivatives along `D_b = (e_b, W_b)`.
    pub fn add(&self, at: Points, phi: &[f64], costates: &Matrices, out: &mut Matrices, scratch: &mut Scratch) {
        let Self { joint, curved, unknowns, .. } = *self;
        let stages = at.stages;
        let batch = Batch { first: 0, count: stages };
        let after = after(costates);
        let sources = [at.states.into(), at.controls.into(), after];
        let responses = respond(self.responses, [joint, unknowns], (batch, &sources, phi), scratch);
        let by_unknown = transposed(&responses, joint);
        let mut directions = Matrices::zeros(stages, TOGETHER, joint + unknowns);
        let mut rates = Matrices::zeros(stages, TOGETHER, joint + unknowns);
        for first in (0..curved).step_by(TOGETHER) {
            self.choose(first, &responses, &mut directions);
            // What is not read stands in for sources of other programs.
            let [x, u, _] = sources;
            let sources = [x, u, after, (&responses).into(), x, x, (&directions).into()];
            self.curvature.run(batch, (&sources, phi), (Some(&mut rates), &mut []), scratch);
            dispatch(Rows { joint, curved, unknowns, first, rates: &rates, by_unknown: &by_unknown, out });
        }
        dispatch(Mirror { joint, curved, out });
    }

    /// Writes the directions from number `first` on.
    fn choose(&self, first: usize, responses: &Matrices, directions: &mut Matrices) {
        let (stride, width) = (directions.stride(), responses.stride());
        for t in 0..directions.count() {
            let (to, from) = (directions.at_mut(t), responses.at(t));
            to.fill(0.0);
            for (place, b) in (first..self.curved).take(TOGETHER).enumerate() {
                let row = &mut to[place * stride..(place + 1) * stride];
                row[b] = 1.0;
                row[self.joint..self.joint + self.unknowns]
                    .copy_from_slice(&from[b * width..b * width + self.unknowns]);
            }
        }
    }
}

/// The [responses](super::programs::Recorder::responses) at some stages: (n + m + 2) x k.
pub(super) fn respond(
    program: &Program,
    [joint, unknowns]: [usize; 2],
    (batch, sources, phi): (Batch, &[Source], &[f64]),
    scratch: &mut Scratch,
) -> Matrices {
    let mut responses = Matrices::zeros(batch.count, joint + 2, unknowns);
    program.run(batch, (sources, phi), (Some(&mut responses), &mut []), scratch);
    responses
}

/// The first `rows` rows of each matrix as columns.
fn transposed(matrices: &Matrices, rows: usize) -> Matrices {
    let mut out = Matrices::zeros(matrices.count(), matrices.cols(), rows);
    for t in 0..matrices.count() {
        for i in 0..rows {
            for j in 0..matrices.cols() {
                out.set(t, j, i, matrices.get(t, i, j));
            }
        }
    }
    out
}

/// Adds `D'` times the rates along some directions to their rows, as far as the diagonal and from the variables without
/// curvature on.
struct Rows<'a> {
    joint: usize,
    curved: usize,
    unknowns: usize,
    first: usize,
    rates: &'a Matrices,
    by_unknown: &'a Matrices,
    out: &'a mut Matrices,
}

impl Job for Rows<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self { joint, curved, unknowns, first, rates, by_unknown, out } = self;
        let (narrow, wide, stride) = (padded(joint), rates.stride(), out.stride());
        let mut through = Matrices::zeros(1, TOGETHER, joint);
        for t in 0..rates.count() {
            let (rates, through) = (rates.at(t), through.at_mut(0));
            let left = Left::plain(&rates[joint..], wide);
            let right = View::new(by_unknown.at(t), narrow);
            let product = Product { left, right, rows: TOGETHER, inner: unknowns, width: narrow };
            product.set::<L, Long>(ViewMut::new(through, narrow));
            let out = out.at_mut(t);
            for (place, b) in (first..curved).take(TOGETHER).enumerate() {
                let row = &mut out[b * stride..b * stride + joint];
                let (rates, through) = (&rates[place * wide..][..joint], &through[place * narrow..][..joint]);
                for part in [0..b + 1, curved..joint] {
                    let (row, rates, through) = (&mut row[part.clone()], &rates[part.clone()], &through[part]);
                    row.iter_mut().zip(rates).zip(through).for_each(|((to, rate), through)| *to += rate + through);
                }
            }
        }
    }
}

/// Copies what [`Rows`] added to the rows that mirror it: symmetric matrices were.
struct Mirror<'a> {
    joint: usize,
    curved: usize,
    out: &'a mut Matrices,
}

impl Job for Mirror<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self { joint, curved, out } = self;
        let stride = out.stride();
        for t in 0..out.count() {
            let out = out.at_mut(t);
            // Whole lanes only: there are other numbers right of the matrix.
            let whole = curved - curved % LANES;
            mirror::<L, Long>(ViewMut::new(out, stride), whole);
            for a in whole..curved {
                for b in 0..a {
                    out[b * stride + a] = out[a * stride + b];
                }
            }
            for a in curved..joint {
                for b in 0..curved {
                    out[a * stride + b] = out[b * stride + a];
                }
            }
        }
    }
}
