//! Costs of stages that depend on the next state, to which several sub-steps lead: their programs are given it, and what they
//! say of it goes through the sub-steps (theory, section "Costs of the next state").

use supple_kernels::graph::{Batch, Source};
use supple_kernels::{Matrices, Scratch};

use super::authored::Authored;
use super::programs::GradientOf;
use super::substeps::{Substeps, add_slopes};
use super::trace::source;
use super::{Curvature, Points};
use crate::Model;

/// Some stages with the states that they lead to.
#[derive(Debug)]
pub(super) struct GivenNext {
    steps: Substeps,
    /// The states after the stages.
    next: Matrices,
    /// `P_k`
    products: Matrices,
    /// Lengths of `z`, and of `z` with the next state.
    joint: usize,
    wide: usize,
}

impl GivenNext {
    /// What costs read: states, controls and next states.
    fn sources(&self) -> [Source<'_>; 3] {
        let Points { states, controls, .. } = self.steps.points();
        [states.into(), controls.into(), (&self.next).into()]
    }

    fn batch(&self) -> Batch {
        Batch { first: 0, count: self.steps.stages }
    }

    /// `E = [I; P_s]` of a stage, by rows.
    fn spread(&self, stage: usize) -> Vec<Vec<f64>> {
        let Self { steps, products, joint, .. } = self;
        let unit = |j: usize| (0..*joint).map(|a| f64::from(a == j)).collect();
        let whole = products.at(steps.last() + steps.stages + stage).chunks_exact(products.stride());
        (0..*joint).map(unit).chain(whole.map(|row| row[..*joint].to_vec())).collect()
    }

    /// Adds `l` by the next state to vectors of the last sub-steps.
    pub fn add_slopes_by_next(&self, quadratics: &Matrices, ends: &mut Matrices) {
        for i in 0..self.steps.stages {
            for (row, end) in ends.vector_mut(self.steps.last() + i).iter_mut().enumerate() {
                *end += quadratics.get(i, self.joint + row, self.wide);
            }
        }
    }

    /// The variations of `z` and the next state, from those of every sub-step's point.
    pub fn vary(&self, moved: &Matrices) -> Matrices {
        let mut out = Matrices::vectors(self.steps.stages, self.wide);
        for i in 0..self.steps.stages {
            let (dz, next) = out.vector_mut(i).split_at_mut(self.joint);
            dz.copy_from_slice(&moved.vector(i)[..self.joint]);
            self.steps.move_last(i, &moved.vector(self.steps.last() + i)[..self.joint], next);
        }
        out
    }

    /// Adds the products of second derivatives of `l` with variations, by the next state, to vectors of the last sub-steps.
    pub fn add_products_by_next(&self, quadratics: &Matrices, along: &Matrices, ends: &mut Matrices) {
        for i in 0..self.steps.stages {
            for (row, end) in ends.vector_mut(self.steps.last() + i).iter_mut().enumerate() {
                *end += times(quadratics, i, self.joint + row, along.vector(i));
            }
        }
    }
}

/// A row of a matrix times a vector.
fn times(matrices: &Matrices, index: usize, row: usize, vector: &[f64]) -> f64 {
    let stride = matrices.stride();
    matrices.at(index)[row * stride..].iter().zip(vector).map(|(entry, v)| entry * v).sum()
}

type Rows = Vec<Vec<f64>>;

/// `a b`
fn product(a: &Rows, b: &Rows) -> Rows {
    let width = b.first().map_or(0, Vec::len);
    let of_row = |row: &Vec<f64>| {
        let mut out = vec![0.0; width];
        for (&entry, b) in row.iter().zip(b).filter(|(entry, _)| **entry != 0.0) {
            out.iter_mut().zip(b).for_each(|(out, b)| *out += entry * b);
        }
        out
    };
    a.iter().map(of_row).collect()
}

fn transposed(a: &Rows) -> Rows {
    let width = a.first().map_or(0, Vec::len);
    (0..width).map(|j| a.iter().map(|row| row[j]).collect()).collect()
}

/// The first rows and columns of a matrix.
fn square(matrices: &Matrices, index: usize, size: usize) -> Rows {
    matrices.at(index).chunks_exact(matrices.stride()).take(size).map(|row| row[..size].to_vec()).collect()
}

impl<M: Model> Authored<M> {
    pub(super) fn given_next(&self, steps: Substeps, phi: &[f64], scratch: &mut Scratch) -> GivenNext {
        let Points { states, controls, .. } = steps.points();
        let mut after = steps.vectors(self.size.states);
        let sources = [Source::from(states), controls.into()];
        self.step_program().run(steps.last_batch(), (&sources, phi), (Some(&mut after), &mut []), scratch);
        let mut next = Matrices::vectors(steps.stages, self.size.states);
        for i in 0..steps.stages {
            next.vector_mut(i).copy_from_slice(after.vector(steps.last() + i));
        }
        let (products, joint) = (steps.products(), self.size.joint());
        GivenNext { steps, next, products, joint, wide: joint + self.size.states }
    }

    /// `[l'' | l']` by `z` and the next state.
    fn quadratics(&self, given: &GivenNext, curvature: Curvature, phi: &[f64], scratch: &mut Scratch) -> Matrices {
        let mut out = Matrices::zeros(given.steps.stages, given.wide, given.wide + 1);
        let program = self.quadratic_program(curvature);
        program.run(given.batch(), (&given.sources(), phi), (Some(&mut out), &mut []), scratch);
        out
    }

    /// The same with all second derivatives.
    pub(super) fn quadratics_by_next(&self, given: &GivenNext, phi: &[f64], scratch: &mut Scratch) -> Matrices {
        self.quadratics(given, Curvature::Exact, phi, scratch)
    }

    /// `[l_zz | l_z]` of all stages (theory, equation U.15).
    pub(super) fn write_quadratics_of_next(
        &self,
        at: Points,
        phi: &[f64],
        curvature: Curvature,
        out: &mut Matrices,
        scratch: &mut Scratch,
    ) {
        let step = self.step_of(phi);
        for block in step.blocks(at.stages) {
            let given = self.given_next(step.divide(at, block, scratch), phi, scratch);
            let quadratics = self.quadratics(&given, curvature, phi, scratch);
            for i in 0..block.count {
                let turned = transposed(&given.spread(i));
                let curved = product(&product(&turned, &square(&quadratics, i, given.wide)), &given.spread(i));
                let slope =
                    |row: &Vec<f64>| row.iter().enumerate().map(|(a, e)| e * quadratics.get(i, a, given.wide)).sum();
                for (a, (row, turned)) in curved.iter().zip(&turned).enumerate() {
                    row.iter().enumerate().for_each(|(b, &entry)| out.set(block.first + i, a, b, entry));
                    out.set(block.first + i, a, given.joint, slope(turned));
                }
            }
            if curvature == Curvature::Exact {
                let costates = self.costates_of_cost(&given, &quadratics);
                let curved = self.curvature_of(&given.steps, &costates, phi, scratch);
                given.steps.add_curvature(&given.products, &curved, out, block.first);
            }
        }
    }

    /// The costates of sub-steps that the cost of a stage alone begins.
    fn costates_of_cost(&self, given: &GivenNext, quadratics: &Matrices) -> Matrices {
        let mut costates = given.steps.vectors(self.size.states);
        given.add_slopes_by_next(quadratics, &mut costates);
        given.steps.sweep_back(None, &mut costates, None);
        costates
    }

    /// The gradient of the cost of stages by the parameters, `z` and the next state held fixed, or its derivative along a
    /// variation of both.
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

    /// The gradient of `<H_bar, l_zz>` of all stages (theory, equation U.16).
    pub(super) fn contract_cost_of_next(
        &self,
        (at, phi): (Points, &[f64]),
        (adjoint, curvature): (&Matrices, Curvature),
        joint: &mut Matrices,
        parameters: &mut [f64],
        scratch: &mut Scratch,
    ) {
        let (step, n, size) = (self.step_of(phi), self.size.states, self.size.joint());
        for block in step.blocks(at.stages) {
            let given = self.given_next(step.divide(at, block, scratch), phi, scratch);
            let (steps, wide, stages) = (&given.steps, given.wide, block.count);
            let quadratics = self.quadratics(&given, curvature, phi, scratch);
            let weights: Vec<Rows> = (0..stages).map(|i| symmetric(adjoint, block.first + i, size)).collect();
            let mut spread = Matrices::zeros(stages, wide, wide + 1);
            let mut whole = Matrices::zeros(stages, n, size);
            for (i, weights) in weights.iter().enumerate() {
                let half = product(&given.spread(i), weights);
                fill(&mut spread, i, &product(&half, &transposed(&given.spread(i))));
                let moved = product(&square(&quadratics, i, wide), &half);
                fill(&mut whole, i, &doubled(&moved[size..]));
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
                let costates = self.costates_of_cost(&given, &quadratics);
                let curved = self.curvature_of(steps, &costates, phi, scratch);
                let (mut inner, mut of_products) =
                    (Matrices::zeros(steps.batch().count, size, size), Matrices::zeros(steps.batch().count, n, size));
                for point in 0..steps.batch().count {
                    let followed = given.follow(point);
                    let half = product(&followed, &weights[point % stages]);
                    fill(&mut inner, point, &product(&half, &transposed(&followed)));
                    fill(&mut of_products, point, &doubled(&product(&square(&curved, point, size), &half)[..n]));
                }
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
                    varied.vector_mut(i)[size..wide].copy_from_slice(&moved.vector(steps.last() + i)[..n]);
                }
                self.add_cost_gradient_of_next(&given, Some(&varied), phi, parameters, scratch);
                more = Some(of_products);
                moving = Some((costates, moved));
            }
            let mut adjoints = steps.adjoints(&given.products, &whole, 0, more.as_ref());
            if let Some((costates, moved)) = &moving {
                for point in stages..steps.batch().count {
                    for (row, &costate) in costates.vector(point)[..n].iter().enumerate() {
                        for (column, v) in moved.vector(point - stages)[..n].iter().enumerate() {
                            let entry = adjoints.get(point, row, column) + costate * v;
                            adjoints.set(point, row, column, entry);
                        }
                    }
                }
            }
            let (mut total, mut ends) = (Matrices::vectors(stages, size), steps.vectors(n));
            for i in 0..stages {
                let by = |a: usize| by_both.get(i, a, wide) + times(&quadratics, i, a, varied.vector(i));
                (0..size).for_each(|a| total.vector_mut(i)[a] = by(a));
                (0..n).for_each(|a| ends.vector_mut(steps.last() + i)[a] = by(size + a));
            }
            self.collect((steps, phi), (&adjoints, slopes, ends), (&mut total, &mut *parameters), scratch);
            add_slopes(&total, joint, block.first);
        }
    }
}

impl GivenNext {
    /// `S_k = [P_k; 0 I]` of a sub-step, by rows.
    fn follow(&self, point: usize) -> Rows {
        let Self { products, joint, .. } = self;
        let unit = |j: usize| (0..*joint).map(|a| f64::from(a == j)).collect();
        let rows = products.at(point).chunks_exact(products.stride()).map(|row| row[..*joint].to_vec());
        rows.chain((products.rows()..*joint).map(unit)).collect()
    }
}

/// The symmetric matrix of which the upper triangle is given.
fn symmetric(matrices: &Matrices, index: usize, size: usize) -> Rows {
    (0..size).map(|a| (0..size).map(|b| matrices.get(index, a.min(b), a.max(b))).collect()).collect()
}

fn doubled(rows: &[Vec<f64>]) -> Rows {
    rows.iter().map(|row| row.iter().map(|entry| 2.0 * entry).collect()).collect()
}

fn fill(to: &mut Matrices, index: usize, rows: &Rows) {
    for (i, row) in rows.iter().enumerate() {
        row.iter().enumerate().for_each(|(j, &entry)| to.set(index, i, j, entry));
    }
}
