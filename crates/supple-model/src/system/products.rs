//! Second derivatives of dynamics with many unknowns, times vectors.

use supple_kernels::graph::{Batch, Program, Source};
use supple_kernels::rows::{add_scaled, dot};
use supple_kernels::{Job, Lanes, Matrices, Scratch, dispatch};

use super::Points;
use super::batch::after;
use super::second::respond;
use super::substeps::Substeps;

/// Multiplies the second derivatives of `lambda_{t+1}' f` by `z` with vectors, at every stage of a trajectory.
#[derive(Debug)]
pub struct CurvatureProducts<'a> {
    of_steps: StepProducts<'a>,
    phi: &'a [f64],
    steps: Steps<'a>,
}

/// The stages or sub-steps whose second derivatives are multiplied.
#[derive(Debug)]
enum Steps<'a> {
    /// Stages of one step of integration, with their costates.
    Whole(Points<'a>, &'a Matrices),
    /// Sub-steps with their costates, and scratch space for the variations of all of them and the resulting products.
    Divided(Box<(Substeps, Matrices, [Matrices; 2])>),
}

impl<'a> CurvatureProducts<'a> {
    /// From the programs of the responses and of the curvature along a direction, the sizes of `z` and `w`, and the points.
    pub(super) fn new(
        programs: [&'a Program; 2],
        sizes: [usize; 2],
        at: Points<'a>,
        phi: &'a [f64],
        costates: &'a Matrices,
        scratch: &mut Scratch,
    ) -> Self {
        let of_steps = StepProducts::new(programs, sizes, at, phi, after(costates), scratch);
        Self { of_steps, phi, steps: Steps::Whole(at, costates) }
    }

    /// The same of stages that are divided, with the costates after every sub-step.
    pub(super) fn of_substeps(
        programs: [&'a Program; 2],
        sizes: [usize; 2],
        steps: Substeps,
        phi: &'a [f64],
        costates: Matrices,
        scratch: &mut Scratch,
    ) -> Self {
        let of_steps = StepProducts::new(programs, sizes, steps.points(), phi, (&costates).into(), scratch);
        let room = [(); 2].map(|()| steps.vectors(sizes[0]));
        Self { of_steps, phi, steps: Steps::Divided(Box::new((steps, costates, room))) }
    }

    /// Adds the products with `variation`, vectors of length n + m of every stage, to vectors of that length (theory,
    /// equations U.5 and U.13).
    pub fn add(&mut self, variation: &Matrices, out: &mut Matrices, scratch: &mut Scratch) {
        let Self { of_steps, phi, steps } = self;
        match steps {
            Steps::Whole(at, costates) => of_steps.add(*at, phi, after(costates), variation, out, scratch),
            Steps::Divided(divided) => {
                let (steps, costates, [moved, slopes]) = &mut **divided;
                steps.sweep_forward(variation, 0, moved);
                slopes.clear();
                of_steps.add(steps.points(), phi, (&*costates).into(), moved, slopes, scratch);
                steps.sweep_back(Some(slopes), &mut steps.vectors(steps.states()), Some(out));
            }
        }
    }
}

/// Multiplies the second derivatives of `lambda' f` of a step of integration.
#[derive(Debug)]
pub(super) struct StepProducts<'a> {
    program: &'a Program,
    /// Responses of the unknowns to each variable of `z`, then the multipliers `mu`, then `w`.
    responses: Matrices,
    /// Directions `(dz, dw)`, and the resulting products with respect to `(z, w)`.
    directions: Matrices,
    rates: Matrices,
    joint: usize,
    unknowns: usize,
}

impl<'a> StepProducts<'a> {
    pub fn new(
        [responses, program]: [&'a Program; 2],
        [joint, unknowns]: [usize; 2],
        at: Points,
        phi: &[f64],
        after: Source,
        scratch: &mut Scratch,
    ) -> Self {
        let sources = [at.states.into(), at.controls.into(), after];
        let batch = Batch { first: 0, count: at.stages };
        let responses = respond(responses, [joint, unknowns], batch, &sources, phi, scratch);
        let of_both = || Matrices::zeros(at.stages, 1, joint + unknowns);
        let (directions, rates) = (of_both(), of_both());
        Self { program, responses, directions, rates, joint, unknowns }
    }

    /// Adds `D' (lambda' F + mu' r)'' D dz` (theory, equation U.5) at the points and costates that it was made for.
    pub fn add(
        &mut self,
        at: Points,
        phi: &[f64],
        after: Source,
        variation: &Matrices,
        out: &mut Matrices,
        scratch: &mut Scratch,
    ) {
        let Self { program, responses, directions, rates, joint, unknowns } = self;
        let (sizes, batch) = ([*joint, *unknowns], Batch { first: 0, count: at.stages });
        dispatch(Respond { sizes, responses, variation, directions });
        let (x, u) = (at.states.into(), at.controls.into());
        // Sources that this program does not read are filled with placeholders.
        let sources = [x, u, after, (&*responses).into(), x, x, (&*directions).into()];
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
