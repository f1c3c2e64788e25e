use supple_kernels::{LANES, Lanes, Matrices, Scalar};

use super::Points;
use crate::{Point, Value};

/// Up to eight points side by side in the lanes; missing ones repeat the last.
#[derive(Clone, Copy, Debug)]
pub(super) struct Block {
    /// Index of the first point.
    pub first: usize,
    /// How many points there are.
    pub count: usize,
    /// Whether this is the end of a trajectory.
    pub last: bool,
}

impl Block {
    /// All blocks of a batch: the stages, then the end by itself.
    #[inline(always)]
    pub fn all(at: &Points) -> impl Iterator<Item = Self> + use<> {
        let (stages, has_end) = (at.stages, at.has_end);
        let stage =
            (0..stages).step_by(LANES).map(move |first| Self { first, count: LANES.min(stages - first), last: false });
        stage.chain(has_end.then_some(Self { first: stages, count: 1, last: true }))
    }

    /// Blocks of the stages only.
    #[inline(always)]
    pub fn stages(at: &Points) -> impl Iterator<Item = Self> + use<> {
        Self::all(&Points { has_end: false, ..*at })
    }

    /// Entry `offset` of the matrices of all points, in the lanes.
    #[inline(always)]
    pub fn load<L: Lanes>(&self, from: &Matrices, offset: usize) -> L {
        let (data, size) = (from.as_slice(), from.rows() * from.stride());
        let mut values = [0.0; LANES];
        for (lane, value) in values.iter_mut().enumerate() {
            *value = data[(self.first + lane.min(self.count - 1)) * size + offset];
        }
        L::from_array(values)
    }

    /// Writes lanes to entry `offset` of the matrices of all points.
    #[inline(always)]
    pub fn store<L: Lanes>(&self, to: &mut Matrices, offset: usize, values: L) {
        let size = to.rows() * to.stride();
        let data = &mut to.as_mut_slice()[self.first * size + offset..];
        for (lane, value) in values.to_array().into_iter().take(self.count).enumerate() {
            data[lane * size] = value;
        }
    }

    /// Adds lanes to entry `offset` of the matrices of all points.
    #[inline(always)]
    pub fn add<L: Lanes>(&self, to: &mut Matrices, offset: usize, values: L) {
        let size = to.rows() * to.stride();
        let data = &mut to.as_mut_slice()[self.first * size + offset..];
        for (lane, value) in values.to_array().into_iter().take(self.count).enumerate() {
            data[lane * size] += value;
        }
    }

    /// The sum over the block's points, in their order.
    #[inline(always)]
    pub fn sum<L: Lanes>(&self, values: L) -> f64 {
        values.to_array().into_iter().take(self.count).sum()
    }
}

/// Cuts the first `len` numbers off a buffer.
#[inline(always)]
pub(super) fn carve<'a, S>(buffer: &mut &'a mut [S], len: usize) -> &'a mut [S] {
    let (head, tail) = std::mem::take(buffer).split_at_mut(len);
    *buffer = tail;
    head
}

/// All variables of a point over some scalar: `z = (x, u)`, then the parameters.
pub(super) struct Seeds<'a, S> {
    pub z: &'a mut [S],
    pub phi: &'a mut [S],
}

impl<'a, S: Scalar> Seeds<'a, S> {
    /// Room for the variables, cut off a buffer.
    #[inline(always)]
    pub fn carve(buffer: &mut &'a mut [S], joint: usize, parameters: usize) -> Self {
        Self { z: carve(buffer, joint), phi: carve(buffer, parameters) }
    }

    /// Variable `index` of `(z, phi)`.
    #[inline(always)]
    pub fn variable(&mut self, index: usize) -> &mut S {
        let joint = self.z.len();
        if index < joint { &mut self.z[index] } else { &mut self.phi[index - joint] }
    }

    /// The point that the variables stand for.
    #[inline(always)]
    pub fn point(&self, states: usize, time_step: Value) -> Point<'_, S> {
        let (x, u) = self.z.split_at(states);
        Point { x, u, phi: self.phi, time_step: time_step.resolve(self.phi) }
    }
}
