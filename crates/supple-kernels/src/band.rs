//! Symmetric positive definite matrices that are block tridiagonal: factored in blocks, in lanes, and solved.

use crate::rows::{Left, Long, Product, View, ViewMut, factor_upper};
use crate::{Job, LANES, Lanes, Matrices, dispatch, halt, padded};

/// How many right sides a [`Band`] solves for at once.
///
/// Example: [`Band`].
pub const RIGHT_SIDES: usize = 2;

/// A symmetric positive definite block tridiagonal matrix with its right-hand sides.
///
/// Block `t` is of order `orders[t]`, and may be empty. Its rows are `[H_t, C_t, b_t]`, each padded to whole lanes: the
/// upper triangle of the diagonal block, the block between `t` and `t + 1`, and the right sides.
///
/// ```
/// use supple_kernels::Band;
///
/// // Blocks of order 1: the matrix [[2, 1], [1, 2]], and the right sides (3, 3) and (1, 2).
/// let mut band = Band::zeros(&[1, 1]);
/// for (t, right) in [[3.0, 1.0], [3.0, 2.0]].into_iter().enumerate() {
///     let row = band.row_mut(t, 0);
///     row.diagonal[0] = 2.0;
///     row.right.copy_from_slice(&right);
///     if t == 0 {
///         row.next[0] = 1.0;
///     }
/// }
/// let mut found = [vec![Vec::new(); 2], vec![Vec::new(); 2]];
/// band.solve(&mut found).map_err(|block| format!("indefinite at block {block}"))?;
/// assert!((found[0][0][0] - 1.0).abs() < 1e-15 && (found[1][1][0] - 1.0).abs() < 1e-15);
/// # Ok::<(), String>(())
/// ```
#[derive(Clone, Debug, Default)]
pub struct Band {
    orders: Vec<usize>,
    blocks: Vec<Matrices>,
}

/// The parts of one row of a block.
///
/// Example: [`Band`].
pub struct BandRow<'a> {
    /// Row of `H_t`, of which the entries from the diagonal on are read; the padding must stay zero.
    pub diagonal: &'a mut [f64],
    /// Row of `C_t`, empty at the last block; the padding must stay zero.
    pub next: &'a mut [f64],
    /// Right sides of this row, [`RIGHT_SIDES`] of them.
    pub right: &'a mut [f64],
}

impl Band {
    /// A matrix of zeros with blocks of these orders.
    #[must_use]
    pub fn zeros(orders: &[usize]) -> Self {
        let width = |t: usize| orders.get(t).map_or(0, |n| n.next_multiple_of(LANES));
        let blocks =
            (0..orders.len()).map(|t| Matrices::zeros(1, orders[t], width(t) + width(t + 1) + LANES)).collect();
        Self { orders: orders.to_vec(), blocks }
    }

    /// Where `C_t` begins in a row, and where the right sides begin.
    #[inline(always)]
    fn offsets(&self, t: usize) -> (usize, usize) {
        let width = |t: usize| self.orders.get(t).map_or(0, |n| n.next_multiple_of(LANES));
        (width(t), width(t) + width(t + 1))
    }

    /// Row `row` of block `t`, to be written; initially holds leftovers of the last factorisation.
    #[inline(always)]
    pub fn row_mut(&mut self, t: usize, row: usize) -> BandRow<'_> {
        let (next, right) = self.offsets(t);
        let stride = self.blocks[t].stride();
        let whole = &mut self.blocks[t].at_mut(0)[row * stride..(row + 1) * stride];
        let (head, tail) = whole.split_at_mut(right);
        let (diagonal, between) = head.split_at_mut(next);
        BandRow { diagonal, next: between, right: &mut tail[..RIGHT_SIDES] }
    }

    /// Factors the matrix in place and solves for the right sides: `out[side][t]`, of length `orders[t]`.
    ///
    /// # Errors
    /// The block at which the matrix is not positive definite to rounding, or which was next when a stop was requested.
    pub fn solve(&mut self, out: &mut [Vec<Vec<f64>>; RIGHT_SIDES]) -> Result<(), usize> {
        dispatch(Factor(&mut *self))?;
        self.substitute(out);
        Ok(())
    }

    /// `x_t = R^-1 (y - X x_{t+1})`, from the last block to the first.
    fn substitute(&self, out: &mut [Vec<Vec<f64>>; RIGHT_SIDES]) {
        for (side, out) in out.iter_mut().enumerate() {
            out.resize_with(self.orders.len(), Vec::new);
            for t in (0..self.orders.len()).rev() {
                let (n, (next, right)) = (self.orders[t], self.offsets(t));
                let (block, stride) = (self.blocks[t].at(0), self.blocks[t].stride());
                let (head, tail) = out.split_at_mut(t + 1);
                let (x, after) = (&mut head[t], tail.first().map_or(&[][..], Vec::as_slice));
                x.clear();
                x.resize(n, 0.0);
                for i in (0..n).rev() {
                    let row = &block[i * stride..(i + 1) * stride];
                    let known = sum_of_products(&row[i + 1..n], &x[i + 1..]);
                    let coupled = sum_of_products(&row[next..next + after.len()], after);
                    x[i] = (row[right + side] - known - coupled) / row[i];
                }
            }
        }
    }
}

/// A dot product in four running sums.
fn sum_of_products(a: &[f64], b: &[f64]) -> f64 {
    let (mut sums, (a4, b4)) = ([0.0; 4], (a.chunks_exact(4), b.chunks_exact(4)));
    let rest: f64 = a4.remainder().iter().zip(b4.remainder()).map(|(x, y)| x * y).sum();
    for (a, b) in a4.zip(b4) {
        for i in 0..4 {
            sums[i] += a[i] * b[i];
        }
    }
    sums[0] + sums[1] + (sums[2] + sums[3]) + rest
}

/// `H_t = R'R`, with `R'^-1` applied to `C_t` and the right sides as the rows are made, and the update that this causes in
/// the next block.
struct Factor<'a>(&'a mut Band);

impl Job for Factor<'_> {
    /// `Err(t)` if block t is not positive definite, or if a stop is requested.
    type Output = Result<(), usize>;

    #[inline(always)]
    fn run<L: Lanes>(self) -> Self::Output {
        let Self(band) = self;
        let most = band.orders.iter().copied().max().unwrap_or(0);
        let mut reciprocals = vec![0.0; padded(most)];
        for t in 0..band.orders.len() {
            if halt::is_requested() {
                return Err(t);
            }
            if t > 0 {
                band.take_coupling::<L>(t);
                // A factorisation that was interrupted is invalid.
                if halt::is_requested() {
                    return Err(t);
                }
            }
            let (n, stride) = (band.orders[t], band.blocks[t].stride());
            let rows = ViewMut::new(band.blocks[t].at_mut(0), stride);
            if factor_upper::<L>(rows, n, stride, &mut reciprocals).is_err() {
                return Err(t);
            }
        }
        Ok(())
    }
}

impl Band {
    /// `H_t -= X'X` and `b_t -= X'y`, with `X` and `y` of block `t - 1`.
    #[inline(always)]
    fn take_coupling<L: Lanes>(&mut self, t: usize) {
        let ((from, from_right), (_, right)) = (self.offsets(t - 1), self.offsets(t));
        let (inner, n) = (self.orders[t - 1], self.orders[t]);
        if inner == 0 {
            return;
        }
        let (head, tail) = self.blocks.split_at_mut(t);
        let (before, now) = (&head[t - 1], &mut tail[0]);
        let (before_stride, stride) = (before.stride(), now.stride());
        let (x, out) = (before.at(0), now.at_mut(0));
        for i in (0..n).step_by(LANES) {
            if halt::is_requested() {
                return;
            }
            let (left, rows) = (Left::transposed(&x[from + i..], before_stride), LANES.min(n - i));
            let taken = |from: usize, width: usize| {
                let right = View::new(&x[from..], before_stride);
                Product { left, right, rows, inner, width }
            };
            let rest = ViewMut::new(&mut out[i * stride + i..], stride);
            taken(from + i, padded(n) - i).subtract::<L, Long>(rest);
            let sides = ViewMut::new(&mut out[i * stride + right..], stride);
            taken(from_right, LANES).subtract::<L, Long>(sides);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Level;

    /// A band of blocks of these orders that is diagonally dominant, its dense form, and right sides.
    fn example(orders: &[usize]) -> (Band, Vec<Vec<f64>>, [Vec<f64>; RIGHT_SIDES]) {
        let total: usize = orders.iter().sum();
        let mut dense = vec![vec![0.0; total]; total];
        let mut sides = [vec![0.0; total], vec![0.0; total]];
        let mut band = Band::zeros(orders);
        let mut first = 0;
        for (t, &n) in orders.iter().enumerate() {
            let after = orders.get(t + 1).copied().unwrap_or(0);
            for i in 0..n {
                let row = band.row_mut(t, i);
                for j in i..n {
                    let value = if i == j { 60.0 } else { ((3 * i + 7 * j + t) % 5) as f64 - 2.0 };
                    row.diagonal[j] = value;
                    (dense[first + i][first + j], dense[first + j][first + i]) = (value, value);
                }
                for j in 0..after {
                    let value = ((5 * i + 2 * j + t) % 7) as f64 - 3.0;
                    row.next[j] = value;
                    (dense[first + i][first + n + j], dense[first + n + j][first + i]) = (value, value);
                }
                for (side, sides) in sides.iter_mut().enumerate() {
                    row.right[side] = (first + i) as f64 * 0.1 + side as f64;
                    sides[first + i] = row.right[side];
                }
            }
            first += n;
        }
        (band, dense, sides)
    }

    #[test]
    fn bands_are_solved_at_every_level() {
        for level in Level::ALL.into_iter().filter(|level| level.force()) {
            for orders in [&[3usize][..], &[10, 10, 10], &[1, 21, 6, 0, 15], &[36, 3, 28]] {
                let (mut band, dense, sides) = example(orders);
                let mut out = [vec![], vec![]];
                band.solve(&mut out).unwrap();
                for (side, right) in sides.iter().enumerate() {
                    let x = out[side].concat();
                    for (row, b) in dense.iter().zip(right) {
                        let product: f64 = row.iter().zip(&x).map(|(a, x)| a * x).sum();
                        assert!((product - b).abs() < 1e-10, "{level:?} {orders:?}: {product} {b}");
                    }
                }
            }
        }
    }

    #[test]
    fn the_block_that_is_not_positive_is_named() {
        let (mut band, _, _) = example(&[4, 4, 4]);
        band.row_mut(1, 2).diagonal[2] = -1.0;
        assert_eq!(band.solve(&mut [vec![], vec![]]), Err(1));
    }
}
