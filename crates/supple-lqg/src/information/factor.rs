//! Factors `G` of covariances `G G'`, which are rotated from the right.

use supple_kernels::rows::{Left, Long, Product, View, ViewMut, add_scaled, combine, dot};
use supple_kernels::{LANES, Lanes, padded};

use crate::dense::Dense;

/// A factor `G`, n x k, as `k` rows of `n` numbers in whole lanes: its columns.
#[derive(Clone, Debug)]
pub(super) struct Factor {
    n: usize,
    stride: usize,
    count: usize,
    rows: Vec<f64>,
    other: Vec<f64>,
    /// Work space: a column of the rows, and a row.
    normal: Vec<f64>,
    along: Vec<f64>,
}

impl Factor {
    /// A zero factor with room for `n + more` columns, to be conditioned on at most `controls` rows.
    pub fn zero(n: usize, more: usize, controls: usize) -> Self {
        let (most, stride) = (n + more, padded(n));
        let rows = || vec![0.0; most * stride];
        let along = vec![0.0; padded(n.max(controls))];
        Self { n, stride, count: 0, rows: rows(), other: rows(), normal: vec![0.0; most], along }
    }

    /// How many columns it has.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Its columns as rows.
    pub fn transposed(&self) -> View<'_> {
        View::new(&self.rows, self.stride)
    }

    /// As a matrix, n x k.
    pub fn dense(&self) -> Dense {
        Dense::from_fn(self.n, self.count, |i, k| self.rows[k * self.stride + i])
    }

    /// The length of each of its n rows.
    pub fn sizes(&self, out: &mut [f64]) {
        out.fill(0.0);
        for row in self.rows.chunks_exact(self.stride).take(self.count) {
            out.iter_mut().zip(row).for_each(|(sum, value)| *sum += value * value);
        }
        out.iter_mut().for_each(|sum| *sum = sum.sqrt());
    }

    /// Replaces `G` with a factor of `M G G' M' + H H'` with at most `n` columns, given `M'` and the columns of `H` as rows.
    #[inline(always)]
    pub fn advance<L: Lanes>(&mut self, map_transposed: &[f64], news: &[f64]) {
        let (n, stride, kept) = (self.n, self.stride, self.count);
        let right = View::new(map_transposed, stride);
        let product = Product { left: Left::plain(&self.rows, stride), right, rows: kept, inner: n, width: stride };
        product.set::<L, Long>(ViewMut::new(&mut self.other, stride));
        std::mem::swap(&mut self.rows, &mut self.other);
        let end = kept * stride + news.len();
        self.rows[kept * stride..end].copy_from_slice(news);
        self.count = end / stride;
        if self.count > n {
            self.turn_upright::<L>();
            self.count = n;
        }
    }

    /// Rotates `G` into lower-trapezoidal form: its columns are zero above their own place, and those after the n-th vanish.
    #[inline(always)]
    fn turn_upright<L: Lanes>(&mut self) {
        let (stride, count) = (self.stride, self.count);
        for j in 0..self.n.min(count - 1) {
            let (rows, normal) = (&mut self.rows[j * stride..count * stride], &mut self.normal[..count - j]);
            normal.iter_mut().zip(rows.chunks_exact(stride)).for_each(|(entry, row)| *entry = row[j]);
            let Some(Reflection { moved_to, scale }) = Reflection::to_first(normal) else { continue };
            reflect::<L>(ViewMut::new(rows, stride), j - j % LANES, normal, scale, &mut self.along);
            rows.chunks_exact_mut(stride).for_each(|row| row[j] = 0.0);
            rows[j] = moved_to;
        }
    }

    /// Rotates columns from `first` on so that only the first of them affects a row `k`; column `a` of `seen` holds `G' k'`.
    /// Rotates `seen` with them. Returns the variance that `k` has through these columns, 0 if they do not affect it.
    #[inline(always)]
    pub fn bring_first<L: Lanes>(&mut self, first: usize, seen: &mut [f64], a: usize) -> f64 {
        let (stride, count) = (self.stride, self.count);
        let width = seen.len() / self.normal.len();
        let (seen, normal) = (&mut seen[first * width..count * width], &mut self.normal[..count - first]);
        normal.iter_mut().zip(seen.chunks_exact(width)).for_each(|(entry, row)| *entry = row[a]);
        let Some(Reflection { moved_to, scale }) = Reflection::to_first(normal) else { return 0.0 };
        let rows = ViewMut::new(&mut self.rows[first * stride..count * stride], stride);
        reflect::<L>(rows, 0, normal, scale, &mut self.along);
        reflect::<L>(ViewMut::new(seen, width), 0, normal, scale, &mut self.along);
        moved_to * moved_to
    }

    /// Leaves out the first columns.
    pub fn leave_out(&mut self, first: usize) {
        let stride = self.stride;
        self.rows.copy_within(first * stride..self.count * stride, 0);
        self.count -= first;
    }

    /// Removes directions whose length is at most `least`, after each row is divided by its `unit`.
    #[inline(always)]
    pub fn leave_rounding_out<L: Lanes>(&mut self, units: &[f64], least: f64) {
        let rank = self.rank_above::<L>(units, least);
        if rank < self.count {
            self.reduce(units, least);
        }
    }

    /// The number of pivots above `least` in a column-pivoted decomposition.
    #[inline(always)]
    fn rank_above<L: Lanes>(&mut self, units: &[f64], least: f64) -> usize {
        let stride = self.stride;
        let mut left = &mut self.other[..self.count * stride];
        for (scaled, row) in left.chunks_exact_mut(stride).zip(self.rows.chunks_exact(stride)) {
            scaled.iter_mut().zip(row).zip(units).for_each(|((scaled, value), unit)| *scaled = value / unit);
        }
        for rank in 0..self.count {
            let (mut longest, mut square) = (0, -1.0);
            for (place, row) in left.chunks_exact(stride).enumerate() {
                let own = dot(row, row);
                if own > square {
                    (longest, square) = (place, own);
                }
            }
            if square.sqrt() <= least {
                return rank;
            }
            let (first, others) = left.split_at_mut(stride);
            if let Some(place) = longest.checked_sub(1) {
                first.swap_with_slice(&mut others[place * stride..(place + 1) * stride]);
            }
            for row in others.chunks_exact_mut(stride) {
                add_scaled::<L>(row, -dot(first, row) / square, first);
            }
            left = others;
        }
        self.count
    }

    /// Reduces `G` to as many columns as directions above `least`, the rank that derivatives assume.
    fn reduce(&mut self, units: &[f64], least: f64) {
        let scaled = Dense::from_fn(self.n, self.count, |i, k| self.rows[k * self.stride + i] / units[i]);
        let found = scaled.col_piv_qr();
        let (q, r) = (found.q(), found.r());
        let rank = (0..r.nrows()).take_while(|&k| r[(k, k)].abs() > least).count();
        // A triangular factor of R R' for the first rows.
        let rows = r.rows(0, rank).transpose();
        let kept = q.columns(0, rank) * rows.qr().r().transpose();
        let stride = self.stride;
        self.count = rank;
        for (i, k) in (0..self.n).flat_map(|i| (0..rank).map(move |k| (i, k))) {
            self.rows[k * stride + i] = kept[(i, k)] * units[i];
        }
    }
}

/// A Householder reflection of a vector onto the first axis.
struct Reflection {
    /// The first entry after the reflection.
    moved_to: f64,
    /// 2 over the square of the normal.
    scale: f64,
}

impl Reflection {
    /// Overwrites a vector with the normal of its reflection; `None` if it is 0.
    #[inline(always)]
    fn to_first(vector: &mut [f64]) -> Option<Self> {
        let size = dot(vector, vector).sqrt();
        if size == 0.0 {
            return None;
        }
        let first = vector[0];
        let moved_to = -size.copysign(first);
        vector[0] = first - moved_to;
        Some(Self { moved_to, scale: 1.0 / (size * (size + first.abs())) })
    }
}

/// Reflects whole rows, from a column on that is a multiple of the lanes.
#[inline(always)]
fn reflect<L: Lanes>(rows: ViewMut, column: usize, normal: &[f64], scale: f64, along: &mut [f64]) {
    let ViewMut { numbers: rows, stride } = rows;
    let along = &mut along[..stride - column];
    combine::<L, Long>(along, None, scale, normal, View::new(&rows[column..], stride));
    for (row, entry) in rows.chunks_exact_mut(stride).zip(normal) {
        add_scaled::<L>(&mut row[column..], -entry, along);
    }
}
