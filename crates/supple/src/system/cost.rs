use supple_kernels::{Job, Lanes, Matrices, Scalar, Scratch};

use super::block::{Block, Seeds, carve};
use super::jacobians::{FIRST, First, Pairs, Second, fix_parameters, gather, seed, unseed};
use super::{Authored, Curvature, Points};
use crate::Model;
use crate::cost::{Cost, Norm, Residual, Weights};

/// `[l_zz | l_z]` at every point, from the residuals `r` and their norms `l = sum phi(r)`:
///
/// ```text
/// l_z  = J' phi_r      l_zz = J' phi_rr J + sum_i phi_r,i d2r_i/dz dz     J = dr/dz
/// ```
///
/// Gauss-Newton leaves the last sum out.
pub(super) struct CostQuadratics<'a, M> {
    pub system: &'a Authored<M>,
    pub at: Points<'a>,
    pub phi: &'a [f64],
    pub curvature: Curvature,
    pub out: &'a mut Matrices,
    pub scratch: &'a mut Scratch,
}

impl<M: Model> Job for CostQuadratics<'_, M> {
    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self { system, at, phi, curvature, out, scratch } = self;
        let sums = Sums::<L>::len(system);
        let mut local = scratch.take();
        let mut buffer = local.zeros::<L>(sums + phi.len());
        let mut sums = Sums::carve(&mut buffer, system);
        let fixed = buffer;
        for (fixed, &value) in fixed.iter_mut().zip(phi) {
            *fixed = L::constant(value);
        }
        {
            let mut run = Run { system, at, phi, fixed, curvature };
            for block in Block::all(&at) {
                run.residuals(&block, &mut sums, scratch);
                run.norms(&block, &mut sums);
                run.curvature(&block, &mut sums, scratch);
                sums.store(&block, system.size.joint(), out);
            }
        }
        scratch.give_back(local);
    }
}

/// What is summed up in the lanes at one block.
struct Sums<'a, L> {
    residual: &'a mut [L],
    /// dr/dz, residuals x joint.
    jacobian: &'a mut [L],
    /// phi_r of each residual entry.
    slope: &'a mut [L],
    gradient: &'a mut [L],
    hessian: &'a mut [L],
}

impl<'a, L: Lanes> Sums<'a, L> {
    fn len<M>(system: &Authored<M>) -> usize {
        let (joint, r) = (system.size.joint(), system.residuals);
        r * (2 + joint) + joint * (joint + 1)
    }

    #[inline(always)]
    fn carve<M>(buffer: &mut &'a mut [L], system: &Authored<M>) -> Self {
        let (joint, r) = (system.size.joint(), system.residuals);
        Self {
            residual: carve(buffer, r),
            jacobian: carve(buffer, r * joint),
            slope: carve(buffer, r),
            gradient: carve(buffer, joint),
            hessian: carve(buffer, joint * joint),
        }
    }

    #[inline(always)]
    fn store(&self, block: &Block, joint: usize, out: &mut Matrices) {
        let stride = out.stride();
        for i in 0..joint {
            for j in 0..=i {
                block.store(out, i * stride + j, self.hessian[i * joint + j]);
                if i != j {
                    block.store(out, j * stride + i, self.hessian[i * joint + j]);
                }
            }
            block.store(out, i * stride + joint, self.gradient[i]);
        }
    }
}

/// What stays the same over all blocks of a run.
struct Run<'a, M, L> {
    system: &'a Authored<M>,
    at: Points<'a>,
    phi: &'a [f64],
    fixed: &'a [L],
    curvature: Curvature,
}

/// Evaluates all residuals, over any scalar.
#[inline(always)]
fn evaluate<M: Model, S: Scalar>(system: &Authored<M>, seeds: &Seeds<S>, signals: &mut [S], residuals: &mut [S]) {
    let at = seeds.point(system.size.states, system.time_step);
    system.model.signal(&at, signals);
    let mut rest = residuals;
    for cost in &system.costs {
        cost.kind.evaluate(&at, signals, carve(&mut rest, cost.kind.len()));
    }
}

impl<M: Model, L: Lanes> Run<'_, M, L> {
    #[inline(always)]
    fn residuals(&mut self, block: &Block, sums: &mut Sums<L>, scratch: &mut Scratch) {
        let system = self.system;
        let joint = system.size.joint();
        let mut buffer = scratch.zeros::<First<L>>(joint + self.phi.len() + system.signals + system.residuals);
        let mut seeds = Seeds::carve(&mut buffer, joint, self.phi.len());
        let signals = carve(&mut buffer, system.signals);
        let residuals = carve(&mut buffer, system.residuals);
        fix_parameters(&mut seeds, self.phi);
        gather(block, &self.at, &mut seeds);
        for chunk in system.structure.residual_variables.chunks(FIRST) {
            seed(&mut seeds, chunk);
            evaluate(system, &seeds, signals, residuals);
            unseed(&mut seeds, chunk);
            for (i, r) in residuals.iter().enumerate() {
                sums.residual[i] = r.value;
                for (k, &variable) in chunk.iter().enumerate() {
                    sums.jacobian[i * joint + variable] = r.tangents[k];
                }
            }
        }
    }

    #[inline(always)]
    fn norms(&mut self, block: &Block, sums: &mut Sums<L>) {
        let joint = self.system.size.joint();
        sums.gradient.fill(L::zero());
        sums.hessian.fill(L::zero());
        sums.slope.fill(L::zero());
        let mut start = 0;
        for cost in &self.system.costs {
            let range = start..start + cost.kind.len();
            start = range.end;
            if cost.weights(block.last).are_zero() {
                continue;
            }
            for i in range.clone() {
                self.norm(cost, block.last, range.start, i, sums);
                for &a in &self.system.structure.residuals[i] {
                    let slope = sums.slope[i];
                    sums.gradient[a] = slope.mul_add(sums.jacobian[i * joint + a], sums.gradient[a]);
                }
            }
        }
    }

    /// The slope of a cost by its residual entry `i`, and its curvature's part of the Hessian.
    #[inline(always)]
    fn norm(&self, cost: &Cost, last: bool, start: usize, i: usize, sums: &mut Sums<L>) {
        let r = sums.residual[i];
        match (cost.weights(last), cost.norm) {
            (Weights::Equal(weight), Norm::Quadratic) => {
                let twice = weight.resolve(self.fixed) * 2.0;
                sums.slope[i] = twice * r;
                self.add_outer(i, i, twice, sums);
            }
            (Weights::Equal(weight), Norm::Absolute { smoothing }) => {
                let s: L = smoothing.resolve(self.fixed);
                let weight: L = weight.resolve(self.fixed);
                let inverse = r.mul_add(r, s * s).sqrt().recip();
                sums.slope[i] = weight * r * inverse;
                self.add_outer(i, i, weight * s * s * inverse * inverse * inverse, sums);
            }
            (Weights::Matrix(rows), _) => {
                for (offset, &weight) in rows[i - start].iter().enumerate().filter(|(_, weight)| !weight.is_zero()) {
                    let twice = weight.resolve(self.fixed) * 2.0;
                    sums.slope[i] = twice.mul_add(sums.residual[start + offset], sums.slope[i]);
                    self.add_outer(i, start + offset, twice, sums);
                }
            }
        }
    }

    /// `hessian += weight J_i' J_j`, lower triangle.
    #[inline(always)]
    fn add_outer(&self, i: usize, j: usize, weight: L, sums: &mut Sums<L>) {
        let joint = self.system.size.joint();
        let variables = &self.system.structure.residuals;
        for &a in &variables[i] {
            let left = weight * sums.jacobian[i * joint + a];
            for &b in variables[j].iter().filter(|&&b| b <= a) {
                let sum = &mut sums.hessian[a * joint + b];
                *sum = left.mul_add(sums.jacobian[j * joint + b], *sum);
            }
        }
    }

    #[inline(always)]
    fn curvature(&mut self, block: &Block, sums: &mut Sums<L>, scratch: &mut Scratch) {
        let system = self.system;
        let curved = &system.structure.residual_curved;
        if self.curvature == Curvature::GaussNewton || curved.is_empty() {
            return;
        }
        let joint = system.size.joint();
        let mut buffer = scratch.zeros::<Second<L>>(joint + self.phi.len() + system.signals + system.residuals);
        let mut seeds = Seeds::carve(&mut buffer, joint, self.phi.len());
        let signals = carve(&mut buffer, system.signals);
        let residuals = carve(&mut buffer, system.residuals);
        fix_parameters(&mut seeds, self.phi);
        gather(block, &self.at, &mut seeds);
        let mut pairs = Pairs::new(curved);
        while let Some((outer, inner)) = pairs.next(&mut seeds) {
            evaluate(system, &seeds, signals, residuals);
            for (a, &row) in outer.iter().enumerate() {
                for (b, &col) in inner.iter().enumerate() {
                    if col > row {
                        continue;
                    }
                    let sum = &mut sums.hessian[row * joint + col];
                    for (slope, r) in sums.slope.iter().zip(residuals.iter()) {
                        *sum = slope.mul_add(r.tangents[a].tangents[b], *sum);
                    }
                }
            }
        }
    }
}
