//! Time steps of several sub-steps: the derivatives of a whole step from those of its parts (theory, section "Sub-steps").

use std::ops::Range;

use supple_kernels::graph::{Batch, Program, Source};
use supple_kernels::rows::{Left, Long, Product, View, ViewMut, add_scaled, dot, transpose};
use supple_kernels::{Job, Lanes, Matrices, Scratch, dispatch, padded};
use supple_lqg::Dimensions;

use super::Points;
use super::batch::at_points;
use crate::trajectory::Times;

/// Limit on the total size of the Jacobians held at a time; a single stage may exceed it.
const MOST_NUMBERS: usize = 1 << 18;

/// A model's step of integration: the programs of the next state and of its Jacobian, at some parameters.
#[derive(Clone, Copy)]
pub(super) struct Step<'a> {
    pub next: &'a Program,
    pub jacobian: &'a Program,
    pub phi: &'a [f64],
    pub size: Dimensions,
    /// The number of these steps in a time step.
    pub substeps: usize,
}

impl Step<'_> {
    /// Blocks of stages whose sub-steps are kept together.
    pub fn blocks(&self, stages: usize) -> impl Iterator<Item = Batch> + use<> {
        let each = self.size.states * padded(self.size.joint()) * self.substeps;
        let most = (MOST_NUMBERS / each.max(1)).clamp(1, stages.max(1));
        (0..stages).step_by(most).map(move |first| Batch { first, count: most.min(stages - first) })
    }

    /// The Jacobians of the whole steps at all stages of a batch (theory, equation U.10).
    pub fn write_jacobians(&self, at: Points, out: &mut Matrices, scratch: &mut Scratch) {
        let &Self { next: step, jacobian: program, phi, size, substeps } = self;
        let (batch, stages) = (Batch { first: 0, count: at.stages }, at.stages);
        let vectors = || Matrices::vectors(stages, size.states);
        let (mut from, mut next) = (vectors(), vectors());
        let mut jacobians = Matrices::zeros(stages, size.states, size.joint());
        for k in 0..substeps {
            let x = if k == 0 { at.states.into() } else { Source::from(&from) };
            let sources = [x, at.controls.into()];
            program.run(batch, (&sources, phi), (Some(&mut jacobians), &mut []), scratch);
            if k + 1 < substeps {
                step.run(batch, (&sources, phi), (Some(&mut next), &mut []), scratch);
                std::mem::swap(&mut from, &mut next);
            }
            let before = (k > 0).then_some(0);
            dispatch(Compose { jacobians: &jacobians, first: 0, stages, before, products: &mut *out, after: 0 });
        }
    }

    /// The sub-steps of a block of stages.
    pub fn divide(&self, at: Points, block: Batch, scratch: &mut Scratch) -> Substeps {
        let &Self { next: step, jacobian, phi, size, substeps } = self;
        let (stages, n, joint) = (block.count, size.states, size.joint());
        let count = substeps * stages;
        let vectors = |len| Matrices::vectors(count, len);
        let (mut states, mut controls, mut next) = (vectors(n), vectors(size.controls), vectors(n));
        for i in 0..stages {
            states.vector_mut(i).copy_from_slice(at.states.vector(block.first + i));
            for k in 0..substeps {
                controls.vector_mut(k * stages + i).copy_from_slice(at.controls.vector(block.first + i));
            }
        }
        for k in 1..substeps {
            let before = Batch { first: (k - 1) * stages, count: stages };
            let sources = [Source::from(&states), (&controls).into()];
            step.run(before, (&sources, phi), (Some(&mut next), &mut []), scratch);
            for i in k * stages..(k + 1) * stages {
                states.vector_mut(i).copy_from_slice(next.vector(i - stages));
            }
        }
        let mut jacobians = Matrices::zeros(count, n, joint);
        let (all, sources) = (Batch { first: 0, count }, [Source::from(&states), (&controls).into()]);
        jacobian.run(all, (&sources, phi), (Some(&mut jacobians), &mut []), scratch);
        Substeps { substeps, stages, size, states, controls, jacobians }
    }
}

/// The next states at all stages, by repeating a program for one integration step.
pub(super) fn step_repeatedly(
    program: &Program,
    times: usize,
    at: Points,
    phi: &[f64],
    next: &mut Matrices,
    scratch: &mut Scratch,
) {
    let (batch, [x, u]) = (Batch { first: 0, count: at.stages }, at_points(at));
    program.run(batch, (&[x, u], phi), (Some(&mut *next), &mut []), scratch);
    if times > 1 {
        let mut from = next.clone();
        for _ in 1..times {
            from.copy_from(next);
            program.run(batch, (&[(&from).into(), u], phi), (Some(&mut *next), &mut []), scratch);
        }
    }
}

/// The sub-steps of some stages; sub-step `k` of stage `i` is point `k * stages + i`.
#[derive(Clone, Debug)]
pub(super) struct Substeps {
    substeps: usize,
    pub stages: usize,
    size: Dimensions,
    states: Matrices,
    controls: Matrices,
    /// `[A_k B_k]`
    jacobians: Matrices,
}

/// Adjoints of sub-steps.
pub(super) struct SubstepAdjoints {
    /// Of their Jacobians.
    pub jacobians: Matrices,
    /// Slopes at their points.
    pub slopes: Matrices,
    /// Slopes at the stages' final states, vectors of the last sub-steps.
    pub ends: Matrices,
}

impl Substeps {
    /// All sub-steps, as if each were a stage.
    pub fn points(&self) -> Points<'_> {
        let Self { states, controls, .. } = self;
        Points { states, controls, stages: states.count(), has_end: false, times: Times::From(0) }
    }

    pub fn batch(&self) -> Batch {
        Batch { first: 0, count: self.states.count() }
    }

    /// The length of a state.
    pub fn states(&self) -> usize {
        self.size.states
    }

    /// The last sub-step of every stage.
    pub fn last_batch(&self) -> Batch {
        Batch { first: self.last(), count: self.stages }
    }

    /// Vectors of length `len` of every sub-step, zeros.
    pub fn vectors(&self, len: usize) -> Matrices {
        Matrices::vectors(self.states.count(), len)
    }

    /// `P_k`, the derivative of the state before a sub-step with respect to `z`; the last are those of whole steps (theory,
    /// equation U.10).
    pub fn products(&self) -> Matrices {
        let &Self { substeps, stages, size: Dimensions { states: n, .. }, ref jacobians, .. } = self;
        let mut products = Matrices::zeros((substeps + 1) * stages, n, self.size.joint());
        for i in 0..stages {
            (0..n).for_each(|j| products.set(i, j, j, 1.0));
        }
        for k in 1..=substeps {
            let first = (k - 1) * stages;
            let before = (k > 1).then_some(first);
            dispatch(Compose { jacobians, first, stages, before, products: &mut products, after: first + stages });
        }
        products
    }

    /// Vectors of length n of every sub-step, with those of `after` from number `first` on at the last sub-steps.
    pub fn ending_with(&self, after: &Matrices, first: usize) -> Matrices {
        let mut ends = self.vectors(self.size.states);
        let last = (self.substeps - 1) * self.stages;
        for i in 0..self.stages {
            ends.vector_mut(last + i).copy_from_slice(after.vector(first + i));
        }
        ends
    }

    /// The costates after every sub-step, given those after the stages; number `first + 1` of `after` is the
    /// first of these (theory, equation U.11).
    pub fn costates(&self, after: &Matrices, first: usize) -> Matrices {
        let mut costates = self.ending_with(after, first + 1);
        self.sweep_back(None, &mut costates, None);
        costates
    }

    /// From vectors `v_s` of the last sub-steps, those of all others: `v_k = A_k' v_{k+1}`, and with slopes by `z` at every
    /// sub-step `v_k = A_k' v_{k+1} + g_x` (theory, equation U.11). Adds what arrives at the stages' `z` to `total`.
    pub fn sweep_back(&self, slopes: Option<&Matrices>, ends: &mut Matrices, total: Option<&mut Matrices>) {
        dispatch(SweepBack { steps: self, slopes, ends, total });
    }

    /// The variations of every sub-step's `(x_k, u)`, from that of the stages, `variation` from number `first` on.
    pub fn sweep_forward(&self, variation: &Matrices, first: usize, out: &mut Matrices) {
        let Self { substeps, stages, size, jacobians, .. } = self;
        let joint = size.joint();
        for i in 0..*stages {
            let dz = &variation.vector(first + i)[..joint];
            for k in 0..*substeps {
                out.vector_mut(k * stages + i)[..joint].copy_from_slice(dz);
            }
            for before in (i..(substeps - 1) * stages).step_by(*stages) {
                for (row, jacobian) in jacobians.at(before).chunks_exact(jacobians.stride()).enumerate() {
                    let moved = dot(&jacobian[..joint], &out.vector(before)[..joint]);
                    out.vector_mut(before + stages)[row] = moved;
                }
            }
        }
    }

    /// The square parts of matrices of every sub-step times vectors, added.
    pub fn multiply(&self, matrices: &Matrices, vectors: &Matrices, out: &mut Matrices) {
        let joint = self.size.joint();
        for point in 0..self.states.count() {
            let rows = matrices.at(point).chunks_exact(matrices.stride());
            for (to, row) in out.vector_mut(point).iter_mut().zip(rows) {
                *to += dot(&row[..joint], &vectors.vector(point)[..joint]);
            }
        }
    }

    /// The adjoints of every `[A_k B_k]`, from those of the whole steps' Jacobians, `whole` from number `first` on (theory,
    /// equation U.12), and from `more`, of all `P_k`.
    pub fn adjoints(&self, products: &Matrices, whole: &Matrices, first: usize, more: Option<&Matrices>) -> Matrices {
        let mut out = Matrices::zeros(self.states.count(), self.size.states, self.size.joint());
        dispatch(Divide { steps: self, products, whole, first, more, out: &mut out });
        out
    }

    /// The number of the first point of the last sub-steps.
    pub fn last(&self) -> usize {
        (self.substeps - 1) * self.stages
    }

    /// Propagates vectors `v_1` after the first sub-steps to the end: `v_{k+1} = A_k v_k + b_k`, with `b_k` given in place.
    pub fn sweep_states(&self, vectors: &mut Matrices) {
        let n = self.size.states;
        for after in self.stages..self.states.count() {
            for (row, jacobian) in self.jacobians.at(after).chunks_exact(self.jacobians.stride()).enumerate() {
                let moved = dot(&jacobian[..n], &vectors.vector(after - self.stages)[..n]);
                vectors.vector_mut(after)[row] += moved;
            }
        }
    }

    /// `[A_k B_k]` times a vector, of the last sub-step of a stage.
    pub fn move_last(&self, stage: usize, dz: &[f64], out: &mut [f64]) {
        let rows = self.jacobians.at(self.last() + stage).chunks_exact(self.jacobians.stride());
        out.iter_mut().zip(rows).for_each(|(out, row)| *out = dot(&row[..dz.len()], dz));
    }

    /// Adds `sum S_k' H_k S_k`, `S_k = [P_k; 0 I]`, to the square part of the matrices of the stages, `out` from number
    /// `first` on (theory, equation U.13).
    pub fn add_curvature(&self, products: &Matrices, curvature: &Matrices, out: &mut Matrices, first: usize) {
        dispatch(Collect { steps: self, products, curvature, out, first });
    }
}

/// `P_{k+1} = A_k P_k + [0 B_k]` at the stages of a sub-step, whose Jacobians begin at number `first`.
struct Compose<'a> {
    jacobians: &'a Matrices,
    first: usize,
    stages: usize,
    /// The number of the first `P_k`; `None` if they are `[I 0]`.
    before: Option<usize>,
    products: &'a mut Matrices,
    /// The number of the first `P_{k+1}`, which may be that of `P_k`.
    after: usize,
}

impl Job for Compose<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self { jacobians, first, stages, before, products, after } = self;
        let (n, stride) = (jacobians.rows(), jacobians.stride());
        let mut product = vec![0.0; n * stride];
        for i in 0..stages {
            let jacobian = jacobians.at(first + i);
            product.copy_from_slice(jacobian);
            if let Some(before) = before {
                product.chunks_exact_mut(stride).for_each(|row| row[..n].fill(0.0));
                let (left, right) = (Left::plain(jacobian, stride), View::new(products.at(before + i), stride));
                let moved = Product { left, right, rows: n, inner: n, width: stride };
                moved.add::<L, Long>(ViewMut::new(&mut product, stride));
            }
            products.at_mut(after + i).copy_from_slice(&product);
        }
    }
}

struct SweepBack<'a> {
    steps: &'a Substeps,
    slopes: Option<&'a Matrices>,
    ends: &'a mut Matrices,
    total: Option<&'a mut Matrices>,
}

impl Job for SweepBack<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self { steps: Substeps { substeps, stages, size, jacobians, .. }, slopes, ends, mut total } = self;
        let (n, joint, stride) = (size.states, size.joint(), jacobians.stride());
        let mut back = vec![0.0; stride];
        for i in 0..*stages {
            for k in (0..*substeps).rev() {
                let point = k * stages + i;
                back.fill(0.0);
                if let Some(slopes) = slopes {
                    back[..joint].copy_from_slice(&slopes.vector(point)[..joint]);
                }
                for (&end, row) in ends.vector(point).iter().zip(jacobians.at(point).chunks_exact(stride)) {
                    add_scaled::<L>(&mut back, end, row);
                }
                if k > 0 {
                    ends.vector_mut(point - stages).copy_from_slice(&back[..n]);
                }
                if let Some(total) = &mut total {
                    let arrived = if k == 0 { 0..joint } else { n..joint };
                    let to = total.vector_mut(i)[arrived.clone()].iter_mut();
                    to.zip(&back[arrived]).for_each(|(to, back)| *to += back);
                }
            }
        }
    }
}

struct Divide<'a> {
    steps: &'a Substeps,
    products: &'a Matrices,
    whole: &'a Matrices,
    first: usize,
    more: Option<&'a Matrices>,
    out: &'a mut Matrices,
}

impl Job for Divide<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self { steps: Substeps { substeps, stages, size, jacobians, .. }, products, whole, first, more, out } =
            self;
        let (n, joint, stride) = (size.states, size.joint(), jacobians.stride());
        let narrow = padded(n);
        let (mut adjoint, mut earlier) = (vec![0.0; n * stride], vec![0.0; n * stride]);
        let (mut turned, mut by_states) = (vec![0.0; joint * narrow], vec![0.0; n * narrow]);
        for i in 0..*stages {
            adjoint.copy_from_slice(whole.at(first + i));
            for k in (0..*substeps).rev() {
                let point = k * stages + i;
                transpose::<L, Long>(
                    ViewMut::new(&mut turned, narrow),
                    View::new(products.at(point), stride),
                    n,
                    joint,
                );
                let (left, right) = (Left::plain(&adjoint, stride), View::new(&turned, narrow));
                let moved = Product { left, right, rows: n, inner: joint, width: narrow };
                moved.set::<L, Long>(ViewMut::new(&mut by_states, narrow));
                let to = out.at_mut(point);
                to.copy_from_slice(&adjoint);
                for (row, by_states) in to.chunks_exact_mut(stride).zip(by_states.chunks_exact(narrow)) {
                    row[..n].copy_from_slice(&by_states[..n]);
                }
                let (left, right) = (Left::transposed(jacobians.at(point), stride), View::new(&adjoint, stride));
                let back = Product { left, right, rows: n, inner: n, width: stride };
                back.set::<L, Long>(ViewMut::new(&mut earlier, stride));
                if let Some(more) = more {
                    earlier.iter_mut().zip(more.at(point)).for_each(|(to, more)| *to += more);
                }
                std::mem::swap(&mut adjoint, &mut earlier);
            }
        }
    }
}

struct Collect<'a> {
    steps: &'a Substeps,
    products: &'a Matrices,
    curvature: &'a Matrices,
    out: &'a mut Matrices,
    first: usize,
}

impl Job for Collect<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self { steps: Substeps { substeps, stages, size, .. }, products, curvature, out, first } = self;
        let (n, joint, stride, wide) = (size.states, size.joint(), products.stride(), curvature.stride());
        let to_stride = out.stride();
        let (mut moved, mut sum) = (vec![0.0; joint * stride], vec![0.0; joint * stride]);
        for i in 0..*stages {
            sum.fill(0.0);
            for k in 0..*substeps {
                let (product, curvature) = (products.at(k * stages + i), curvature.at(k * stages + i));
                let rows = StackedRows { product, stride, moved: 0..n, kept: n..joint, columns: joint };
                rows.add_congruence::<L>(View::new(curvature, wide), &mut moved, &mut sum);
            }
            for (to, row) in out.at_mut(first + i).chunks_exact_mut(to_stride).zip(sum.chunks_exact(stride)) {
                to[..joint].iter_mut().zip(&row[..joint]).for_each(|(to, sum)| *to += sum);
            }
        }
    }
}

/// A matrix `R` with some rows of the identity, at the same indices, and the other rows taken from a product.
pub(super) struct StackedRows<'a> {
    pub product: &'a [f64],
    pub stride: usize,
    /// The rows from the product and those from the identity; together they are all rows.
    pub moved: Range<usize>,
    pub kept: Range<usize>,
    pub columns: usize,
}

impl StackedRows<'_> {
    /// Leaves `Q R` in `through`, and adds `R' Q R` to `sum`.
    #[inline(always)]
    pub fn add_congruence<L: Lanes>(self, curvature: View, through: &mut [f64], sum: &mut [f64]) {
        let Self { product, stride, moved, kept, columns } = self;
        let (numbers, inner) = (curvature.numbers, moved.len());
        let (left, right) = (Left::plain(&numbers[moved.start..], curvature.stride), View::new(product, stride));
        let product_part = Product { left, right, rows: inner + kept.len(), inner, width: stride };
        product_part.set::<L, Long>(ViewMut::new(through, stride));
        for (to, row) in through.chunks_exact_mut(stride).zip(numbers.chunks_exact(curvature.stride)) {
            to[kept.clone()].iter_mut().zip(&row[kept.clone()]).for_each(|(to, entry)| *to += entry);
        }
        let (left, right) = (Left::transposed(product, stride), View::new(&through[moved.start * stride..], stride));
        let back = Product { left, right, rows: columns, inner, width: stride };
        back.add::<L, Long>(ViewMut::new(sum, stride));
        let kept = kept.start * stride..kept.end * stride;
        sum[kept.clone()].iter_mut().zip(&through[kept]).for_each(|(to, through)| *to += through);
    }
}

/// Adds slopes by `z` of some stages to the last columns of joint matrices, from number `first` on.
pub(super) fn add_slopes(slopes: &Matrices, joint: &mut Matrices, first: usize) {
    let (size, stride) = (slopes.cols(), joint.stride());
    for i in 0..slopes.count() {
        let rows = joint.at_mut(first + i)[size..].iter_mut().step_by(stride);
        rows.zip(slopes.vector(i)).for_each(|(to, slope)| *to += slope);
    }
}
