use supple_kernels::{Dual, Job, Lanes, Matrices, Scratch};

use super::block::{Block, Seeds, carve};
use super::jacobians::{HIGHER, Second, fix_parameters, gather};
use super::{Authored, KnotAdjoints, Points};
use crate::Model;
use crate::cost::Residual;

/// The gradient of `sum <F_bar, [A B]> + <C_bar, C>`: with `f_j = df/dz_j`, the second derivatives of
/// `h(z, phi) = sum_j <F_bar_j, f_j> + <C_bar_j, g_j>`.
pub(super) struct ContractDynamics<'a, M> {
    pub system: &'a Authored<M>,
    pub at: Points<'a>,
    pub phi: &'a [f64],
    pub adjoints: &'a KnotAdjoints,
    pub joint: &'a mut Matrices,
    pub parameters: &'a mut [f64],
    pub scratch: &'a mut Scratch,
}

impl<M: Model> Job for ContractDynamics<'_, M> {
    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self { system, at, phi, adjoints, joint: out, parameters, scratch } = self;
        let (n, joint, p) = (system.size.states, system.size.joint(), system.size.measurements);
        let mut buffer = scratch.zeros::<Second<L>>(joint + phi.len() + n + p);
        let mut seeds = Seeds::carve(&mut buffer, joint, phi.len());
        let next = carve(&mut buffer, n);
        let y = carve(&mut buffer, p);
        fix_parameters(&mut seeds, phi);
        let curved = &system.structure.joint_curved;
        let directions = &curved[..curved.partition_point(|&variable| variable < joint)];
        for block in Block::all(&at) {
            gather(&block, &at, &mut seeds);
            for inner in directions.chunks(HIGHER) {
                for (b, &variable) in inner.iter().enumerate() {
                    seeds.variable(variable).value.tangents[b] = L::one();
                }
                for outer in curved.chunks(HIGHER) {
                    for (a, &variable) in outer.iter().enumerate() {
                        seeds.variable(variable).tangents[a].value = L::one();
                    }
                    let point = seeds.point(n, system.time_step);
                    let mut sums = [L::zero(); HIGHER];
                    if !block.last {
                        system.model.step(&point, next);
                        weigh(&block, &adjoints.dynamics, inner, next, &mut sums);
                    }
                    system.model.observe(&point, y);
                    let states = &inner[..inner.partition_point(|&variable| variable < n)];
                    weigh(&block, &adjoints.measurement, states, y, &mut sums);
                    add_gradient(&block, outer, sums, joint, out, parameters);
                    for &variable in outer {
                        for tangent in &mut seeds.variable(variable).tangents {
                            tangent.value = L::zero();
                        }
                    }
                }
                for &variable in inner {
                    seeds.variable(variable).value.tangents = [L::zero(); HIGHER];
                }
            }
        }
    }
}

/// Adds `sum_ib adjoint[i, inner_b] d2 values_i / d outer_a d inner_b` to `sums[a]`.
#[inline(always)]
fn weigh<L: Lanes>(block: &Block, adjoint: &Matrices, inner: &[usize], values: &[Second<L>], sums: &mut [L; HIGHER]) {
    let stride = adjoint.stride();
    for (i, value) in values.iter().enumerate() {
        for (b, &variable) in inner.iter().enumerate() {
            let weight = block.load::<L>(adjoint, i * stride + variable);
            for (sum, tangent) in sums.iter_mut().zip(&value.tangents) {
                *sum = weight.mul_add(tangent.tangents[b], *sum);
            }
        }
    }
}

/// Adds derivatives by the variables `outer`: those of `z` to the last column of `out`, parameters to their sum.
#[inline(always)]
fn add_gradient<L: Lanes>(
    block: &Block,
    outer: &[usize],
    sums: [L; HIGHER],
    joint: usize,
    out: &mut Matrices,
    parameters: &mut [f64],
) {
    let stride = out.stride();
    for (&variable, sum) in outer.iter().zip(sums) {
        match variable.checked_sub(joint) {
            None => block.add(out, variable * stride + joint, sum),
            Some(parameter) => parameters[parameter] += block.sum(sum),
        }
    }
}

/// The gradient of `sum <H_bar, l_zz>`: third derivatives of the cost, along `e_j` and row j of `H_bar` at once.
pub(super) struct ContractCost<'a, M> {
    pub system: &'a Authored<M>,
    pub at: Points<'a>,
    pub phi: &'a [f64],
    pub adjoints: &'a KnotAdjoints,
    pub joint: &'a mut Matrices,
    pub parameters: &'a mut [f64],
    pub scratch: &'a mut Scratch,
}

/// A scalar with third derivatives: outer by `HIGHER` variables, middle and inner along one direction each.
type Third<L> = Dual<Dual<Dual<L, 1>, 1>, HIGHER>;

impl<M: Model> Job for ContractCost<'_, M> {
    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self { system, at, phi, adjoints, joint: out, parameters, scratch } = self;
        let (n, joint) = (system.size.states, system.size.joint());
        let mut buffer = scratch.zeros::<Third<L>>(joint + phi.len() + system.signals + system.residuals);
        let mut seeds = Seeds::carve(&mut buffer, joint, phi.len());
        let signals = carve(&mut buffer, system.signals);
        let residuals = carve(&mut buffer, system.residuals);
        fix_parameters(&mut seeds, phi);
        let stride = adjoints.cost.stride();
        for block in Block::all(&at) {
            let third = &system.structure.cost_third[usize::from(block.last)];
            gather(&block, &at, &mut seeds);
            for &row in third.iter().take_while(|&&variable| variable < joint) {
                seeds.z[row].value.value.tangents[0] = L::one();
                for (col, z) in seeds.z.iter_mut().enumerate() {
                    z.value.tangents[0].value = block.load(&adjoints.cost, row * stride + col);
                }
                for outer in third.chunks(HIGHER) {
                    for (a, &variable) in outer.iter().enumerate() {
                        seeds.variable(variable).tangents[a].value.value = L::one();
                    }
                    let point = seeds.point(n, system.time_step);
                    system.model.signal(&point, signals);
                    let mut sums = [L::zero(); HIGHER];
                    for cost in system.costs.iter().filter(|cost| !cost.weights(block.last).are_zero()) {
                        let r = &mut residuals[..cost.kind.len()];
                        cost.kind.evaluate(&point, signals, r);
                        let value = cost.of_residual(r, point.phi, block.last);
                        for (sum, tangent) in sums.iter_mut().zip(&value.tangents) {
                            *sum += tangent.tangents[0].tangents[0];
                        }
                    }
                    add_gradient(&block, outer, sums, joint, out, parameters);
                    for &variable in outer {
                        for tangent in &mut seeds.variable(variable).tangents {
                            tangent.value.value = L::zero();
                        }
                    }
                }
                seeds.z[row].value.value.tangents[0] = L::zero();
            }
        }
    }
}
