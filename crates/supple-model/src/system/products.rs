//! Second derivatives of dynamics with many unknowns, times vectors.

use supple_kernels::graph::{Batch, Program};
use supple_kernels::rows::{add_scaled, dot};
use supple_kernels::{Job, Lanes, Matrices, Scratch, dispatch};

use super::Points;
use super::batch::after;
use super::second::respond;

/// Multiplies the second derivatives of `lambda_{t+1}' f` by `z` with vectors, at every stage of a trajectory.
#[derive(Debug)]
pub struct CurvatureProducts<'a> {
    program: &'a Program,
    at: Points<'a>,
    phi: &'a [f64],
    costates: &'a Matrices,
    /// How the unknowns respond to each variable of `z`, and what follows them.
    responses: Matrices,
    /// Directions `(dz, dw)`, and what they give, by `(z, w)`.
    directions: Matrices,
    rates: Matrices,
    joint: usize,
    unknowns: usize,
}

impl<'a> CurvatureProducts<'a> {
    /// The programs of the responses and of the curvature along one direction; lengths of `z` and of the unknowns; where.
    pub(super) fn new(
        [responses, program]: [&'a Program; 2],
        [joint, unknowns]: [usize; 2],
        (at, phi, costates): (Points<'a>, &'a [f64], &'a Matrices),
        scratch: &mut Scratch,
    ) -> Self {
        let sources = [at.states.into(), at.controls.into(), after(costates)];
        let batch = Batch { first: 0, count: at.stages };
        let responses = respond(responses, [joint, unknowns], (batch, &sources, phi), scratch);
        let of_both = || Matrices::zeros(at.stages, 1, joint + unknowns);
        let (directions, rates) = (of_both(), of_both());
        Self { program, at, phi, costates, responses, directions, rates, joint, unknowns }
    }

    /// Adds the products with `variation`, vectors of length n + m of every stage, to vectors of that length (theory,
    /// equation U.5): `D' (lambda' F + mu' r)'' D dz`.
    pub fn add(&mut self, variation: &Matrices, out: &mut Matrices, scratch: &mut Scratch) {
        let Self { program, at, phi, costates, responses, directions, rates, joint, unknowns } = self;
        let (sizes, batch) = ([*joint, *unknowns], Batch { first: 0, count: at.stages });
        dispatch(Respond { sizes, responses, variation, directions });
        let (x, u) = (at.states.into(), at.controls.into());
        // What is not read stands in for sources of other programs.
        let sources = [x, u, after(costates), (&*responses).into(), x, x, (&*directions).into()];
        program.run(batch, (&sources, phi), (Some(rates), &mut []), scratch);
        dispatch(Return { sizes, responses, rates, out });
    }
}

/// `dw = sum dz_b W_b` beside `dz`.
struct Respond<'a> {
    sizes: [usize; 2],
    responses: &'a Matrices,
    variation: &'a Matrices,
    directions: &'a mut Matrices,
}

impl Job for Respond<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self { sizes: [joint, unknowns], responses, variation, directions } = self;
        let stride = responses.stride();
        let mut dw = vec![0.0; stride];
        for t in 0..directions.count() {
            let dz = &variation.vector(t)[..joint];
            dw.fill(0.0);
            for (dz, row) in dz.iter().zip(responses.at(t).chunks_exact(stride)) {
                add_scaled::<L>(&mut dw, *dz, row);
            }
            let direction = directions.vector_mut(t);
            direction[..joint].copy_from_slice(dz);
            direction[joint..joint + unknowns].copy_from_slice(&dw[..unknowns]);
        }
    }
}

/// `rates_z + W' rates_w`, added.
struct Return<'a> {
    sizes: [usize; 2],
    responses: &'a Matrices,
    rates: &'a Matrices,
    out: &'a mut Matrices,
}

impl Job for Return<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self { sizes: [joint, unknowns], responses, rates, out } = self;
        let stride = responses.stride();
        for t in 0..rates.count() {
            let (by_z, by_w) = rates.vector(t).split_at(joint);
            let rows = responses.at(t).chunks_exact(stride);
            for ((out, by_z), row) in out.vector_mut(t).iter_mut().zip(by_z).zip(rows) {
                *out += by_z + dot(&row[..unknowns], &by_w[..unknowns]);
            }
        }
    }
}
