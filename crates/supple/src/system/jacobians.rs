use supple_kernels::{Dual, Job, Lanes, Matrices, Scalar, Scratch};

use super::block::{Block, Seeds, carve};
use super::{Authored, Points};
use crate::Model;

/// Tangents carried at once in first derivatives.
pub(super) const FIRST: usize = 4;
/// Tangents carried at once at each level of higher derivatives.
pub(super) const HIGHER: usize = 2;

/// A scalar with first derivatives.
pub(super) type First<L> = Dual<L, FIRST>;
/// A scalar with second derivatives: `tangents[i].tangents[j]` by direction i of the outer and j of the inner set.
pub(super) type Second<L> = Dual<Dual<L, HIGHER>, HIGHER>;

/// A function of a model.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Function {
    /// `f`, at every stage.
    Dynamics,
    /// `g`, at every state.
    Measurement,
}

/// First derivatives of a function: `[A B]` or `C`.
pub(super) struct Jacobians<'a, M> {
    pub system: &'a Authored<M>,
    pub function: Function,
    pub at: Points<'a>,
    pub phi: &'a [f64],
    pub out: &'a mut Matrices,
    pub scratch: &'a mut Scratch,
}

impl<M: Model> Job for Jacobians<'_, M> {
    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self { system, function, at, phi, out, scratch } = self;
        let (size, structure) = (system.size, &system.structure);
        let (rows, variables, pattern, at) = match function {
            Function::Dynamics => {
                let stages = Points { has_end: false, ..at };
                (size.states, &structure.dynamics_variables, &structure.dynamics, stages)
            }
            Function::Measurement => (size.measurements, &structure.measurement_variables, &structure.measurement, at),
        };
        let mut buffer = scratch.zeros::<First<L>>(size.joint() + phi.len() + rows);
        let mut seeds = Seeds::carve(&mut buffer, size.joint(), phi.len());
        let values = carve(&mut buffer, rows);
        fix_parameters(&mut seeds, phi);
        let stride = out.stride();
        for block in Block::all(&at) {
            gather(&block, &at, &mut seeds);
            for chunk in variables.chunks(FIRST) {
                seed(&mut seeds, chunk);
                let point = seeds.point(size.states, system.time_step);
                match function {
                    Function::Dynamics => system.model.step(&point, values),
                    Function::Measurement => system.model.observe(&point, values),
                }
                unseed(&mut seeds, chunk);
                scatter(&block, out, stride, chunk, values, pattern);
            }
        }
    }
}

/// Adds `sum_i lambda_i d2f_i/dz dz` at every stage.
pub(super) struct DynamicsCurvature<'a, M> {
    pub system: &'a Authored<M>,
    pub at: Points<'a>,
    pub phi: &'a [f64],
    pub costates: &'a Matrices,
    pub out: &'a mut Matrices,
    pub scratch: &'a mut Scratch,
}

impl<M: Model> Job for DynamicsCurvature<'_, M> {
    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self { system, at, phi, costates, out, scratch } = self;
        let (n, joint) = (system.size.states, system.size.joint());
        let mut buffer = scratch.zeros::<Second<L>>(joint + phi.len() + n);
        let mut seeds = Seeds::carve(&mut buffer, joint, phi.len());
        let next = carve(&mut buffer, n);
        fix_parameters(&mut seeds, phi);
        let stride = out.stride();
        for block in Block::stages(&at) {
            gather(&block, &at, &mut seeds);
            let after = Block { first: block.first + 1, ..block };
            let mut pairs = Pairs::new(&system.structure.dynamics_curved);
            while let Some((outer, inner)) = pairs.next(&mut seeds) {
                system.model.step(&seeds.point(n, system.time_step), next);
                for (a, &row) in outer.iter().enumerate() {
                    for (b, &col) in inner.iter().enumerate() {
                        if col > row {
                            continue;
                        }
                        let mut sum = L::zero();
                        for (i, next) in next.iter().enumerate() {
                            sum = after.load::<L>(costates, i).mul_add(next.tangents[a].tangents[b], sum);
                        }
                        block.add(out, row * stride + col, sum);
                        if row != col {
                            block.add(out, col * stride + row, sum);
                        }
                    }
                }
            }
        }
    }
}

/// Walks all pairs of chunks of variables, the second at or before the first, seeding their tangents.
pub(super) struct Pairs<'a> {
    variables: &'a [usize],
    outer: usize,
    inner: usize,
}

impl<'a> Pairs<'a> {
    #[inline(always)]
    pub fn new(variables: &'a [usize]) -> Self {
        Self { variables, outer: 0, inner: 0 }
    }

    #[inline(always)]
    fn chunk(&self, start: usize) -> &'a [usize] {
        &self.variables[start..self.variables.len().min(start + HIGHER)]
    }

    /// The next pair, with the seeds of the last one taken back.
    #[inline(always)]
    pub fn next<L: Lanes>(&mut self, seeds: &mut Seeds<Second<L>>) -> Option<(&'a [usize], &'a [usize])> {
        if self.inner > 0 {
            for &variable in self.chunk(self.inner - HIGHER) {
                seeds.variable(variable).value.tangents = [L::zero(); HIGHER];
            }
        }
        if self.inner > self.outer {
            for &variable in self.chunk(self.outer) {
                for a in 0..HIGHER {
                    seeds.variable(variable).tangents[a].value = L::zero();
                }
            }
            self.inner = 0;
            self.outer += HIGHER;
        }
        if self.outer >= self.variables.len() {
            return None;
        }
        let (outer, inner) = (self.chunk(self.outer), self.chunk(self.inner));
        if self.inner == 0 {
            for (a, &variable) in outer.iter().enumerate() {
                seeds.variable(variable).tangents[a].value = L::one();
            }
        }
        for (b, &variable) in inner.iter().enumerate() {
            seeds.variable(variable).value.tangents[b] = L::one();
        }
        self.inner += HIGHER;
        Some((outer, inner))
    }
}

/// A scalar that carries eight plain numbers at its core.
pub(super) trait Carrier<L: Lanes>: Scalar {
    /// A fixed value.
    fn carry(value: L) -> Self;
}

impl<L: Lanes> Carrier<L> for L {
    #[inline(always)]
    fn carry(value: L) -> Self {
        value
    }
}

impl<L: Lanes, const K: usize> Carrier<L> for Dual<L, K> {
    #[inline(always)]
    fn carry(value: L) -> Self {
        Self::fixed(value)
    }
}

impl<L: Lanes, const K: usize, const J: usize> Carrier<L> for Dual<Dual<L, K>, J> {
    #[inline(always)]
    fn carry(value: L) -> Self {
        Self::fixed(Dual::fixed(value))
    }
}

impl<L: Lanes, const K: usize, const J: usize, const I: usize> Carrier<L> for Dual<Dual<Dual<L, K>, J>, I> {
    #[inline(always)]
    fn carry(value: L) -> Self {
        Self::fixed(Dual::fixed(Dual::fixed(value)))
    }
}

/// Sets the parameters, moving with nothing.
#[inline(always)]
pub(super) fn fix_parameters<S: Scalar>(seeds: &mut Seeds<S>, phi: &[f64]) {
    for (seed, &value) in seeds.phi.iter_mut().zip(phi) {
        *seed = S::constant(value);
    }
}

/// Sets state and control to those of a block, moving with nothing; the control is zero at the end.
#[inline(always)]
pub(super) fn gather<L: Lanes, S: Carrier<L>>(block: &Block, at: &Points, seeds: &mut Seeds<S>) {
    let n = at.states.cols();
    let (x, u) = seeds.z.split_at_mut(n);
    for (i, x) in x.iter_mut().enumerate() {
        *x = S::carry(block.load(at.states, i));
    }
    for (i, u) in u.iter_mut().enumerate() {
        *u = S::carry(if block.last { L::zero() } else { block.load(at.controls, i) });
    }
}

#[inline(always)]
pub(super) fn seed<L: Lanes>(seeds: &mut Seeds<First<L>>, chunk: &[usize]) {
    for (k, &variable) in chunk.iter().enumerate() {
        seeds.variable(variable).tangents[k] = L::one();
    }
}

#[inline(always)]
pub(super) fn unseed<L: Lanes>(seeds: &mut Seeds<First<L>>, chunk: &[usize]) {
    for &variable in chunk {
        seeds.variable(variable).tangents = [L::zero(); FIRST];
    }
}

/// Writes the derivatives of `values` by the variables of `chunk` where they can be non-zero.
#[inline(always)]
fn scatter<L: Lanes>(
    block: &Block,
    out: &mut Matrices,
    stride: usize,
    chunk: &[usize],
    values: &[First<L>],
    structure: &[Vec<usize>],
) {
    for (i, (value, variables)) in values.iter().zip(structure).enumerate() {
        for (k, variable) in chunk.iter().enumerate() {
            if variables.contains(variable) {
                block.store(out, i * stride + variable, value.tangents[k]);
            }
        }
    }
}
