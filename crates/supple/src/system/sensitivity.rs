use supple_kernels::{Dual, Job, Lanes, Matrices, Scratch};

use super::block::{Block, Seeds, carve};
use super::jacobians::{HIGHER, fix_parameters, gather};
use super::{Authored, Points, Variation};
use crate::Model;
use crate::cost::Residual;

/// The gradient by the parameters of the Lagrangian `sum l + lambda_{t+1}' f`, or its derivative along a variation
/// `(dz, dlambda)`: `dz' (l + lambda' f)_{z phi} + dlambda_{t+1}' f_phi`.
pub(super) struct ParameterGradient<'a, M> {
    pub system: &'a Authored<M>,
    pub at: Points<'a>,
    pub phi: &'a [f64],
    pub costates: &'a Matrices,
    pub variation: Option<Variation<'a>>,
    pub parameters: &'a mut [f64],
    pub scratch: &'a mut Scratch,
}

/// A scalar with derivatives by `HIGHER` parameters (outer) along one variation (inner).
type Along<L> = Dual<Dual<L, 1>, HIGHER>;

impl<M: Model> Job for ParameterGradient<'_, M> {
    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self { system, at, phi, costates, variation, parameters, scratch } = self;
        let (n, joint) = (system.size.states, system.size.joint());
        let len = joint + phi.len() + n + system.signals + system.residuals;
        let mut buffer = scratch.zeros::<Along<L>>(len);
        let mut seeds = Seeds::carve(&mut buffer, joint, phi.len());
        let next = carve(&mut buffer, n);
        let signals = carve(&mut buffer, system.signals);
        let residuals = carve(&mut buffer, system.residuals);
        fix_parameters(&mut seeds, phi);
        for block in Block::all(&at) {
            let after = Block { first: block.first + 1, ..block };
            gather(&block, &at, &mut seeds);
            if let Some(Variation { joint: dz, .. }) = variation {
                for (i, z) in seeds.z.iter_mut().enumerate() {
                    z.value.tangents[0] = block.load(dz, i);
                }
            }
            for chunk in system.structure.gradient_parameters.chunks(HIGHER) {
                for (a, &parameter) in chunk.iter().enumerate() {
                    seeds.phi[parameter].tangents[a].value = L::one();
                }
                let point = seeds.point(n, system.time_step);
                let mut sums = [L::zero(); HIGHER];
                system.model.signal(&point, signals);
                for cost in system.costs.iter().filter(|cost| !cost.weights(block.last).are_zero()) {
                    let r = &mut residuals[..cost.kind.len()];
                    cost.kind.evaluate(&point, signals, r);
                    let value = cost.of_residual(r, point.phi, block.last);
                    for (sum, tangent) in sums.iter_mut().zip(&value.tangents) {
                        *sum += if variation.is_some() { tangent.tangents[0] } else { tangent.value };
                    }
                }
                if !block.last {
                    system.model.step(&point, next);
                    for (i, next) in next.iter().enumerate() {
                        let costate = after.load::<L>(costates, i);
                        for (sum, tangent) in sums.iter_mut().zip(&next.tangents) {
                            *sum = match variation {
                                Some(Variation { costates: dl, .. }) => costate
                                    .mul_add(tangent.tangents[0], after.load::<L>(dl, i).mul_add(tangent.value, *sum)),
                                None => costate.mul_add(tangent.value, *sum),
                            };
                        }
                    }
                }
                for (a, &parameter) in chunk.iter().enumerate() {
                    parameters[parameter] += block.sum(sums[a]);
                    seeds.phi[parameter].tangents[a].value = L::zero();
                }
            }
        }
    }
}
