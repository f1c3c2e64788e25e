//! Stage costs that depend on the next state: their programs take it as an input, and derivatives with respect to it
//! are propagated through the integration steps that lead there (theory, section "Costs of the next state").

use supple_kernels::graph::{Batch, Source};
use supple_kernels::rows::{Left, Long, Product, View, ViewMut, transpose};
use supple_kernels::{Job, Lanes, Matrices, Scratch, dispatch, padded};

use super::authored::Authored;
use super::programs::GradientOf;
use super::substeps::{StackedRows, SubstepAdjoints, Substeps, add_slopes};
use super::trace::source;
use super::{Adjoints, Curvature, Points};
use crate::Model;

/// Some stages with the states that they lead to.
#[derive(Debug)]
pub(super) struct GivenNext<'a> {
    pub steps: Substeps,
    /// The states after the stages.
    next: Matrices,
    /// `P_k`
    pub products: Matrices,
    /// The entries of the next state that costs depend on.
    counting: &'a [usize],
    /// Lengths of `z`, and of `z` with these entries.
    pub joint: usize,
    pub wide: usize,
}

impl GivenNext<'_> {
    /// Inputs of costs: states, controls and next states.
    pub fn sources(&self) -> [Source<'_>; 3] {
        let Points { states, controls, .. } = self.steps.points();
        [states.into(), controls.into(), (&self.next).into()]
    }

    pub fn batch(&self) -> Batch {
        Batch { first: 0, count: self.steps.stages }
    }

    /// The rows of a stage's `P_s` for entries of the next state that costs depend on.
    pub fn rows(&self, stage: usize) -> impl Iterator<Item = &[f64]> {
        let (product, stride) =
            (self.products.at(self.steps.last() + self.steps.stages + stage), self.products.stride());
        self.counting.iter().map(move |&row| &product[row * stride..][..stride])
    }

    /// `E = [I; P_s]` of every stage.
    fn spread(&self) -> Matrices {
        let mut out = Matrices::zeros(self.steps.stages, self.wide, self.joint);
        for i in 0..self.steps.stages {
            (0..self.joint).for_each(|j| out.set(i, j, j, 1.0));
            let stride = out.stride();
            let below = out.at_mut(i)[self.joint * stride..].chunks_exact_mut(stride);
            below.zip(self.rows(i)).for_each(|(to, row)| to.copy_from_slice(row));
        }
        out
    }

    /// `S_k = [P_k; 0 I]` of every sub-step.
    fn follow(&self) -> Matrices {
        let Self { steps, products, joint, .. } = self;
        let mut out = Matrices::zeros(steps.batch().count, *joint, *joint);
        for point in 0..out.count() {
            (products.rows()..*joint).for_each(|j| out.set(point, j, j, 1.0));
            let product = products.at(point);
            out.at_mut(point)[..product.len()].copy_from_slice(product);
        }
        out
    }

    /// Adds the gradient of `l` with respect to the next state to vectors of the last sub-steps.
    pub fn add_slopes_by_next(&self, quadratics: &Matrices, ends: &mut Matrices) {
        for i in 0..self.steps.stages {
            let end = ends.vector_mut(self.steps.last() + i);
            for (number, &row) in self.counting.iter().enumerate() {
                end[row] += quadratics.get(i, self.joint + number, self.wide);
            }
        }
    }

    /// The variations of `z` and the next state, from those of every sub-step's point.
    pub fn vary(&self, moved: &Matrices) -> Matrices {
        let mut out = Matrices::vectors(self.steps.stages, self.wide);
        let mut all = vec![0.0; self.next.cols()];
        for i in 0..self.steps.stages {
            self.steps.move_last(i, &moved.vector(self.steps.last() + i)[..self.joint], &mut all);
            let (dz, next) = out.vector_mut(i).split_at_mut(self.joint);
            dz.copy_from_slice(&moved.vector(i)[..self.joint]);
            self.pick(&all, next);
        }
        out
    }

    /// Adds the products of second derivatives of `l` with variations, by the next state, to vectors of the last sub-steps.
    pub fn add_products_by_next(&self, quadratics: &Matrices, along: &Matrices, ends: &mut Matrices) {
        for i in 0..self.steps.stages {
            let end = ends.vector_mut(self.steps.last() + i);
            for (number, &row) in self.counting.iter().enumerate() {
                end[row] += times(quadratics, i, self.joint + number, along.vector(i));
            }
        }
    }

    /// Picks the entries that costs depend on.
    fn pick(&self, next: &[f64], out: &mut [f64]) {
        out.iter_mut().zip(self.counting).for_each(|(to, &row)| *to = next[row]);
    }
}

/// A row of a matrix times a vector.
fn times(matrices: &Matrices, index: usize, row: usize, vector: &[f64]) -> f64 {
    let stride = matrices.stride();
    matrices.at(index)[row * stride..].iter().zip(vector).map(|(entry, v)| entry * v).sum()
}

impl<M: Model> Authored<M> {
    /// Some stages with the states that they lead to, of which those entries count.
    pub(super) fn given_next<'a>(
        &self,
        steps: Substeps,
        counting: &'a [usize],
        phi: &[f64],
        scratch: &mut Scratch,
    ) -> GivenNext<'a> {
        let Points { states, controls, .. } = steps.points();
        let mut after = steps.vectors(self.size.states);
        let sources = [Source::from(states), controls.into()];
        self.step_program().run(steps.last_batch(), (&sources, phi), (Some(&mut after), &mut []), scratch);
        let mut next = Matrices::vectors(steps.stages, self.size.states);
        for i in 0..steps.stages {
            next.vector_mut(i).copy_from_slice(after.vector(steps.last() + i));
        }
        let (products, joint) = (steps.products(), self.size.joint());
        GivenNext { steps, next, products, counting, joint, wide: joint + counting.len() }
    }

    /// `[l'' | l']` by `z` and the next state.
    pub(super) fn quadratics(
        &self,
        given: &GivenNext,
        curvature: Curvature,
        phi: &[f64],
        scratch: &mut Scratch,
    ) -> Matrices {
        let mut out = Matrices::zeros(given.steps.stages, given.wide, given.wide + 1);
        let program = self.quadratic_program(curvature);
        program.run(given.batch(), (&given.sources(), phi), (Some(&mut out), &mut []), scratch);
        out
    }

    /// `[l_zz | l_z]` of all stages (theory, equation U.15); with costates, exact and with `(lambda' f)_zz` added.
    pub(super) fn write_quadratics_of_next(
        &self,
        at: Points,
        phi: &[f64],
        curvature: Curvature,
        after: Option<&Matrices>,
        out: &mut Matrices,
        scratch: &mut Scratch,
    ) {
        let step = self.step_of(phi);
        for block in step.blocks(at.stages) {
            let steps = step.divide(at, block, scratch);
            let given = self.given_next(steps, self.counting_of_next(), phi, scratch);
            let quadratics = self.quadratics(&given, curvature, phi, scratch);
            dispatch(Spread { given: &given, quadratics: &quadratics, out: &mut *out, first: block.first });
            if curvature == Curvature::Exact {
                let ends = after.map(|after| given.steps.ending_with(after, block.first + 1));
                let costates = self.costates_of_cost(&given, &quadratics, ends);
                let curved = self.curvature_of(&given.steps, &costates, phi, scratch);
                given.steps.add_curvature(&given.products, &curved, out, block.first);
            }
        }
    }

    /// The costates of sub-steps that originate from the stage cost, alone or added to those given at the ends.
    pub(super) fn costates_of_cost(
        &self,
        given: &GivenNext,
        quadratics: &Matrices,
        ends: Option<Matrices>,
    ) -> Matrices {
        let mut costates = ends.unwrap_or_else(|| given.steps.vectors(self.size.states));
        given.add_slopes_by_next(quadratics, &mut costates);
        given.steps.sweep_back(None, &mut costates, None);
        costates
    }

    /// The gradient of the stage costs with respect to the parameters, with `z` and the next state held fixed, or its
    /// derivative along a variation of both.
    pub(super) fn add_cost_gradient_of_next(
        &self,
        given: &GivenNext,
        along: Option<&Matrices>,
        phi: &[f64],
        parameters: &mut [f64],
        scratch: &mut Scratch,
    ) {
        let [x, u, next] = given.sources();
        let mut sources = [x, u, next, x, x, x, x];
        if let Some(along) = along {
            sources[source::VARIATION] = along.into();
        }
        let program = self.gradient_program(GradientOf::StageCost, along.is_some());
        program.run(given.batch(), (&sources, phi), (None, parameters), scratch);
    }

    /// The gradient of `<F_bar, [A B]> + <H_bar, l_zz>` of all stages (theory, equations U.12, U.16 and U.17).
    pub(super) fn contract_with_next(
        &self,
        at: Points,
        phi: &[f64],
        Adjoints { knots: of_knots, curvature }: Adjoints,
        joint: &mut Matrices,
        parameters: &mut [f64],
        scratch: &mut Scratch,
    ) {
        let (step, n, size) = (self.step_of(phi), self.size.states, self.size.joint());
        for block in step.blocks(at.stages) {
            let steps = step.divide(at, block, scratch);
            let given = self.given_next(steps, self.counting_of_next(), phi, scratch);
            let (steps, wide, stages) = (&given.steps, given.wide, block.count);
            let quadratics = self.quadratics(&given, curvature, phi, scratch);
            let mut spread = Matrices::zeros(stages, wide, wide + 1);
            let mut by_rows = Matrices::zeros(stages, given.counting.len(), size);
            dispatch(Weigh {
                rows: &given.spread(),
                weights: &of_knots.cost,
                first: block.first,
                stages,
                curvature: &quadratics,
                from: size,
                weighed: &mut spread,
                moved: &mut by_rows,
            });
            let mut whole = Matrices::zeros(stages, n, size);
            for i in 0..stages {
                let (to, stride) = (whole.at_mut(i), by_rows.stride());
                to.copy_from_slice(of_knots.dynamics.at(block.first + i));
                for (&row, more) in given.counting.iter().zip(by_rows.at(i).chunks_exact(stride)) {
                    to[row * stride..][..stride].iter_mut().zip(more).for_each(|(to, more)| *to += more);
                }
            }
            let [x, u, next] = given.sources();
            let (mut by_both, sources) =
                (Matrices::zeros(stages, wide, wide + 1), [x, u, next, x, x, (&spread).into()]);
            let program = self.contract_cost_program(curvature);
            program.run(given.batch(), (&sources, phi), (Some(&mut by_both), &mut *parameters), scratch);

            let (mut slopes, mut more) = (steps.vectors(size), None);
            let mut varied = Matrices::vectors(stages, wide);
            let mut moving = None;
            if curvature == Curvature::Exact {
                let costates = self.costates_of_cost(&given, &quadratics, None);
                let curved = self.curvature_of(steps, &costates, phi, scratch);
                let (mut inner, mut of_products) =
                    (Matrices::zeros(steps.batch().count, size, size), Matrices::zeros(steps.batch().count, n, size));
                dispatch(Weigh {
                    rows: &given.follow(),
                    weights: &of_knots.cost,
                    first: block.first,
                    stages,
                    curvature: &curved,
                    from: 0,
                    weighed: &mut inner,
                    moved: &mut of_products,
                });
                let Points { states, controls, .. } = steps.points();
                let x = Source::from(states);
                let sources = [x, controls.into(), (&costates).into(), x, x, (&inner).into()];
                let mut by_point = steps.vectors(size + n);
                let program = self.contract_curvature_program();
                program.run(steps.batch(), (&sources, phi), (Some(&mut by_point), &mut *parameters), scratch);
                let mut moved = steps.vectors(n);
                for point in 0..steps.batch().count {
                    let (by_z, by_costate) = by_point.vector(point).split_at(size);
                    slopes.vector_mut(point)[..size].copy_from_slice(by_z);
                    moved.vector_mut(point)[..n].copy_from_slice(by_costate);
                }
                steps.sweep_states(&mut moved);
                for i in 0..stages {
                    given.pick(moved.vector(steps.last() + i), &mut varied.vector_mut(i)[size..wide]);
                }
                self.add_cost_gradient_of_next(&given, Some(&varied), phi, parameters, scratch);
                more = Some(of_products);
                moving = Some((costates, moved));
            }
            let mut jacobians = steps.adjoints(&given.products, &whole, 0, more.as_ref());
            if let Some((costates, moved)) = &moving {
                for point in stages..steps.batch().count {
                    for (row, &costate) in costates.vector(point)[..n].iter().enumerate() {
                        for (column, v) in moved.vector(point - stages)[..n].iter().enumerate() {
                            let entry = jacobians.get(point, row, column) + costate * v;
                            jacobians.set(point, row, column, entry);
                        }
                    }
                }
            }
            let (mut total, mut ends) = (Matrices::vectors(stages, size), steps.vectors(n));
            for i in 0..stages {
                let by = |a: usize| by_both.get(i, a, wide) + times(&quadratics, i, a, varied.vector(i));
                (0..size).for_each(|a| total.vector_mut(i)[a] = by(a));
                let end = ends.vector_mut(steps.last() + i);
                given.counting.iter().enumerate().for_each(|(number, &row)| end[row] = by(size + number));
            }
            let adjoints = SubstepAdjoints { jacobians, slopes, ends };
            self.collect(steps, phi, adjoints, &mut total, &mut *parameters, scratch);
            add_slopes(&total, joint, block.first);
        }
    }
}

/// `[E' l'' E | E' l']` of stages, `out` from number `first` on.
pub(super) struct Spread<'a> {
    pub given: &'a GivenNext<'a>,
    pub quadratics: &'a Matrices,
    pub out: &'a mut Matrices,
    pub first: usize,
}

impl Job for Spread<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self { given, quadratics, out, first } = self;
        let &GivenNext { joint, wide, .. } = given;
        let (stride, from, to) = (given.products.stride(), quadratics.stride(), out.stride());
        let (mut moved, mut sum) = (vec![0.0; wide * stride], vec![0.0; joint * stride]);
        let mut product = vec![0.0; given.counting.len() * stride];
        for i in 0..given.steps.stages {
            let quadratic = quadratics.at(i);
            let rows = product.chunks_exact_mut(stride).zip(given.rows(i));
            rows.for_each(|(to, row)| to.copy_from_slice(row));
            sum.fill(0.0);
            let rows = StackedRows { product: &product, stride, moved: joint..wide, kept: 0..joint, columns: joint };
            rows.add_congruence::<L>(View::new(quadratic, from), &mut moved, &mut sum);
            for (a, out) in out.at_mut(first + i).chunks_exact_mut(to).enumerate() {
                out[..joint].copy_from_slice(&sum[a * stride..][..joint]);
                let by_next = product.chunks_exact(stride).zip(quadratic[joint * from..].chunks_exact(from));
                let by_next = by_next.map(|(row, of_next)| row[a] * of_next[wide]);
                out[joint] = quadratic[a * from + wide] + by_next.sum::<f64>();
            }
        }
    }
}

/// `R H R'` with the symmetric weights `H` of a point's stage, given by their upper triangles, and `2 Q R H`.
struct Weigh<'a> {
    /// `R` of every point.
    rows: &'a Matrices,
    /// `H` of every stage, from number `first` on.
    weights: &'a Matrices,
    first: usize,
    stages: usize,
    /// `Q` of every point; only its rows from `from` on are used.
    curvature: &'a Matrices,
    from: usize,
    weighed: &'a mut Matrices,
    moved: &'a mut Matrices,
}

impl Job for Weigh<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self { rows: all, weights, first, stages, curvature, from, weighed, moved } = self;
        let (count, joint, stride, narrow) = (all.rows(), all.cols(), all.stride(), padded(all.rows()));
        let (to, curved) = (weighed.stride(), curvature.stride());
        let (mut symmetric, mut half) = (vec![0.0; joint * stride], vec![0.0; count * stride]);
        let mut turned = vec![0.0; joint * narrow];
        for point in 0..all.count() {
            let stage = first + point % stages;
            for a in 0..joint {
                (0..joint).for_each(|b| symmetric[a * stride + b] = weights.get(stage, a.min(b), a.max(b)));
            }
            let rows = all.at(point);
            let (left, right) = (Left::plain(rows, stride), View::new(&symmetric, stride));
            let through = Product { left, right, rows: count, inner: joint, width: stride };
            through.set::<L, Long>(ViewMut::new(&mut half, stride));
            transpose::<L, Long>(ViewMut::new(&mut turned, narrow), View::new(rows, stride), count, joint);
            let (left, right) = (Left::plain(&half, stride), View::new(&turned, narrow));
            let both = Product { left, right, rows: count, inner: joint, width: narrow };
            both.set::<L, Long>(ViewMut::new(weighed.at_mut(point), to));
            let left = Left::plain(&curvature.at(point)[from * curved..], curved);
            let right = View::new(&half, stride);
            let back = Product { left, right, rows: moved.rows(), inner: count, width: stride };
            let moved = moved.at_mut(point);
            back.set::<L, Long>(ViewMut::new(moved, stride));
            moved.iter_mut().for_each(|entry| *entry *= 2.0);
        }
    }
}
