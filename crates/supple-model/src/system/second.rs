//! Second derivatives of dynamics with many unknowns.

use supple_kernels::graph::{Batch, Program, Source};
use supple_kernels::rows::{Left, Long, Product, View, ViewMut, transpose};
use supple_kernels::{Job, Lanes, Matrices, Scratch, dispatch, padded};

use super::Points;
use super::programs::SecondDerivatives;

/// Finds second derivatives of `lambda' f` by `z` from those of its parts by `(z, w)`.
pub(super) struct DynamicsCurvature<'a> {
    /// The program of the [responses](super::programs::Recorder::responses).
    pub responses: &'a Program,
    pub second: &'a SecondDerivatives,
    /// Lengths of `z` and of the unknowns.
    pub joint: usize,
    pub unknowns: usize,
}

impl DynamicsCurvature<'_> {
    /// Adds `(lambda' f)_zz = D' (lambda' F + mu' r)'' D` at every stage (theory, equation U.5), given the costates `after`.
    pub fn add(&self, at: Points, phi: &[f64], after: Source, out: &mut Matrices, scratch: &mut Scratch) {
        let &Self { responses: program, second, joint, unknowns } = self;
        let batch = Batch { first: 0, count: at.stages };
        let (x, u) = (at.states.into(), at.controls.into());
        let responses = respond(program, [joint, unknowns], batch, &[x, u, after], phi, scratch);
        let mut parts = Matrices::zeros(at.stages, second.rows, unknowns);
        second.program.run(batch, (&[x, u, after, (&responses).into()], phi), (Some(&mut parts), &mut []), scratch);
        dispatch(Compose { second, joint, unknowns, responses: &responses, parts: &mut parts, out });
    }
}

/// The [responses](super::programs::Recorder::responses) at some stages: (n + m + 2) x k.
pub(super) fn respond(
    program: &Program,
    [joint, unknowns]: [usize; 2],
    batch: Batch,
    sources: &[Source],
    phi: &[f64],
    scratch: &mut Scratch,
) -> Matrices {
    let mut responses = Matrices::zeros(batch.count, joint + 2, unknowns);
    program.run(batch, (sources, phi), (Some(&mut responses), &mut []), scratch);
    responses
}

/// Adds `L_zz + L_zw W + W' L_wz + W' L_ww W`, `L = lambda' F + mu' r`, the columns of `W` being the responses.
struct Compose<'a> {
    second: &'a SecondDerivatives,
    joint: usize,
    unknowns: usize,
    responses: &'a Matrices,
    parts: &'a mut Matrices,
    out: &'a mut Matrices,
}

impl Job for Compose<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self { second, joint, unknowns, responses, parts, out } = self;
        let (narrow, wide, stride) = (padded(unknowns), padded(joint), out.stride());
        let mixed = &second.mixed[..];
        let mut moved = vec![0.0; unknowns * wide];
        let mut through = vec![0.0; mixed.len() * wide];
        for t in 0..responses.count() {
            let (responses, out) = (responses.at(t), out.at_mut(t));
            let (by_mixed, rest) = parts.at_mut(t).split_at_mut(mixed.len() * narrow);
            let (by_unknowns, by_pairs) = rest.split_at(if second.by_unknowns { unknowns * narrow } else { 0 });
            if second.by_unknowns {
                let (left, right) = (Left::plain(responses, narrow), View::new(by_unknowns, narrow));
                let halves = Product { left, right, rows: joint, inner: unknowns, width: narrow };
                halves.add::<L, Long>(ViewMut::new(by_mixed, narrow));
            }
            transpose::<L, Long>(ViewMut::new(&mut moved, wide), View::new(responses, narrow), joint, unknowns);
            let right = View::new(&moved, wide);
            let left = Left::plain(by_mixed, narrow);
            let product = Product { left, right, rows: mixed.len(), inner: unknowns, width: wide };
            product.set::<L, Long>(ViewMut::new(&mut through, wide));
            for (&a, through) in mixed.iter().zip(through.chunks_exact(wide)) {
                out[a * stride..][..joint].iter_mut().zip(through).for_each(|(to, through)| *to += through);
                out[a..].iter_mut().step_by(stride).zip(&through[..joint]).for_each(|(to, through)| *to += through);
            }
            for (&[a, b], &entry) in second.pairs.iter().zip(by_pairs) {
                out[a * stride + b] += entry;
                if a != b {
                    out[b * stride + a] += entry;
                }
            }
        }
    }
}
