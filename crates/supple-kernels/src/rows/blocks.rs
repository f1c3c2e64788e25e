//! Blocks of eight by eight numbers in registers: transposes and symmetric matrices.

use super::{Rows, View, ViewMut};
use crate::{Job, LANES, Lanes};

/// `out (cols x rows) = a'` for `a` of `rows x cols`.
///
/// ```
/// use supple_kernels::rows::{Long, Scaled, View, ViewMut, add_scaled, clear_beyond, combine, scale};
/// use supple_kernels::rows::{mirror, mirror_single, mirror_upper, symmetrise, transpose};
/// use supple_kernels::{Job, Lanes, Matrices, dispatch};
///
/// /// Changes of a matrix of order 2, one after the other.
/// struct Changes<'a>(&'a Matrices, &'a mut Matrices);
///
/// impl Job for Changes<'_> {
///     type Output = ();
///
///     #[inline(always)]
///     fn run<L: Lanes>(self) {
///         let Self(a, out) = self;
///         let (from, stride) = (View::new(a.at(0), a.stride()), a.stride());
///         let out = out.at_mut(0);
///         transpose::<L, Long>(ViewMut::new(out, stride), from, 2, 2);
///         assert_eq!((out[1], out[stride]), (3.0, 2.0));
///         symmetrise::<L, Long>(ViewMut::new(out, stride), 2);
///         assert_eq!((out[1], out[stride]), (2.5, 2.5));
///         Scaled { from, factor: 2.0, rows: 2, count: 2 }.set::<L, Long>(ViewMut::new(out, stride));
///         assert_eq!((out[1], out[stride]), (4.0, 6.0));
///         mirror::<L, Long>(ViewMut::new(out, stride), 2);
///         mirror_single::<L, Long>(ViewMut::new(out, stride), 2);
///         assert_eq!((out[1], out[stride]), (6.0, 6.0));
///         mirror_upper::<L, Long>(ViewMut::new(out, stride), 2);
///
///         let (first, second) = out.split_at_mut(stride);
///         add_scaled::<L>(first, 10.0, second);
///         scale::<L>(second, 0.5);
///         clear_beyond::<L>(second, 1);
///         assert_eq!((first[0], second[0], second[1]), (62.0, 3.0, 0.0));
///         // The second row less the sum of both rows of the matrix.
///         combine::<L, Long>(first, Some(second), -1.0, &[1.0, 1.0], from);
///         assert_eq!(first[..2], [3.0 - 4.0, -6.0]);
///     }
/// }
///
/// // [[1, 2], [3, 4]]
/// let (mut a, mut out) = (Matrices::zeros(1, 2, 2), Matrices::zeros(1, 2, 2));
/// (0..4).for_each(|i| a.set(0, i / 2, i % 2, 1.0 + i as f64));
/// dispatch(Changes(&a, &mut out));
/// ```
#[inline(always)]
pub fn transpose<L: Lanes, R: Rows>(out: ViewMut, a: View, rows: usize, cols: usize) {
    if rows == 0 || cols == 0 {
        return;
    }
    assert!(out.numbers.len() > (cols - 1) * out.stride + rows - 1);
    assert!(a.numbers.len() > (rows - 1) * a.stride + cols - 1);
    let to = Place { at: out.numbers.as_mut_ptr(), stride: out.stride };
    let job = Transpose { to, from: a.numbers.as_ptr(), stride: a.stride, rows, cols };
    if R::CALLED {
        L::apart(job);
    } else {
        job.run::<L>();
    }
}

/// Copies the lower triangle of a square matrix of order `n` to its upper one, and sets what is right of both, up to whole
/// lanes, to 0; numbers there must be finite.
///
/// Example: [`transpose`].
#[inline(always)]
pub fn mirror<L: Lanes, R: Rows>(a: ViewMut, n: usize) {
    run_mirror::<L, R>(a, n, true);
}

/// As [`mirror`], for a matrix that is zero-padded on the right and whose numbers were just stored one by one: avoids
/// vector loads where these would stall on such stores.
///
/// Example: [`transpose`].
#[inline(always)]
pub fn mirror_single<L: Lanes, R: Rows>(a: ViewMut, n: usize) {
    run_mirror::<L, R>(a, n, false);
}

#[inline(always)]
fn run_mirror<L: Lanes, R: Rows>(a: ViewMut, n: usize, clear: bool) {
    assert!(n == 0 || a.stride >= R::stride(n) && a.numbers.len() >= n * a.stride);
    let Some(a) = square(a, n) else { return };
    if R::CALLED {
        L::apart(Mirror { a, n, clear });
    } else {
        Mirror { a, n, clear }.run::<L>();
    }
}

/// Copies the upper triangle of a square matrix of order `n` to its lower one.
///
/// Example: [`transpose`].
#[inline(always)]
pub fn mirror_upper<L: Lanes, R: Rows>(a: ViewMut, n: usize) {
    let Some(a) = square(a, n) else { return };
    if R::CALLED {
        L::apart(MirrorUpper { a, n });
    } else {
        MirrorUpper { a, n }.run::<L>();
    }
}

/// `a = (a + a') / 2` for a square matrix of order `n`.
///
/// Example: [`transpose`].
#[inline(always)]
pub fn symmetrise<L: Lanes, R: Rows>(a: ViewMut, n: usize) {
    let Some(a) = square(a, n) else { return };
    if R::CALLED {
        L::apart(Symmetrise { a, n });
    } else {
        Symmetrise { a, n }.run::<L>();
    }
}

/// Where a matrix is.
#[derive(Clone, Copy)]
struct Place {
    at: *mut f64,
    stride: usize,
}

impl Place {
    /// The place of an entry.
    ///
    /// # Safety
    /// It must exist.
    #[inline(always)]
    unsafe fn entry(self, row: usize, col: usize) -> *mut f64 {
        // SAFETY: the caller's.
        unsafe { self.at.add(row * self.stride + col) }
    }

    /// The block of eight by eight from an entry on.
    ///
    /// # Safety
    /// It must lie inside.
    #[inline(always)]
    unsafe fn block<L: Lanes>(self, row: usize, col: usize) -> [L; LANES] {
        // SAFETY: the caller's.
        unsafe { load_block::<L>(self.entry(row, col), self.stride, LANES) }
    }

    /// Writes what [`Place::block`] reads.
    ///
    /// # Safety
    /// It must lie inside.
    #[inline(always)]
    unsafe fn set_block<L: Lanes>(self, row: usize, col: usize, block: [L; LANES]) {
        // SAFETY: the caller's.
        unsafe { store_block(block, self.entry(row, col), self.stride, LANES) };
    }
}

/// The first `rows` rows of eight numbers; zeros in place of others up to eight.
///
/// # Safety
/// They must be readable.
#[inline(always)]
pub(super) unsafe fn load_block<L: Lanes>(from: *const f64, stride: usize, rows: usize) -> [L; LANES] {
    let mut block = [L::zero(); LANES];
    for (i, row) in block.iter_mut().enumerate() {
        if i < rows {
            // SAFETY: the caller's.
            *row = unsafe { L::load(from.add(i * stride)) };
        }
    }
    block
}

/// Writes what [`load_block`] reads.
///
/// # Safety
/// The first `rows` rows must be writable.
#[inline(always)]
pub(super) unsafe fn store_block<L: Lanes>(block: [L; LANES], to: *mut f64, stride: usize, rows: usize) {
    for (i, row) in block.into_iter().enumerate() {
        if i < rows {
            // SAFETY: the caller's.
            unsafe { row.store(to.add(i * stride)) };
        }
    }
}

/// A square matrix of order `n`, all of whose entries exist; `None` if it has none.
#[inline(always)]
fn square(a: ViewMut, n: usize) -> Option<Place> {
    assert!(n == 0 || a.numbers.len() > (n - 1) * a.stride + n - 1);
    (n > 0).then_some(Place { at: a.numbers.as_mut_ptr(), stride: a.stride })
}

/// How many of `len` numbers fill whole blocks, if blocks pay off; 0 otherwise.
#[inline(always)]
fn whole<L: Lanes>(len: usize) -> usize {
    if L::WIDE { len - len % LANES } else { 0 }
}

struct Transpose {
    to: Place,
    from: *const f64,
    stride: usize,
    rows: usize,
    cols: usize,
}

impl Job for Transpose {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self { to, from, stride, rows, cols } = self;
        let (whole_rows, whole_cols) = (whole::<L>(rows), whole::<L>(cols));
        // SAFETY: `transpose` checked the sizes.
        unsafe {
            for i in (0..whole_rows).step_by(LANES) {
                for j in (0..whole_cols).step_by(LANES) {
                    to.set_block(j, i, L::transposed(load_block::<L>(from.add(i * stride + j), stride, LANES)));
                }
            }
            for i in 0..rows {
                for j in if i < whole_rows { whole_cols } else { 0 }..cols {
                    *to.entry(j, i) = *from.add(i * stride + j);
                }
            }
        }
    }
}

/// Up to this many rows, moving entries is faster than moving blocks.
const FEW: usize = 3;

#[derive(Clone, Copy)]
struct Mirror {
    a: Place,
    n: usize,
    /// Whether numbers right of the matrix may differ from 0.
    clear: bool,
}

impl Job for Mirror {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        // SAFETY: `mirror` checked the sizes.
        unsafe { if L::WIDE && (self.clear || self.n >= LANES) { self.blocks::<L>() } else { self.entries::<L>(0) } }
    }
}

impl Mirror {
    /// # Safety
    /// All entries and the padding must exist.
    #[inline(always)]
    unsafe fn blocks<L: Lanes>(self) {
        let Self { a: Place { at, stride }, n, .. } = self;
        let mut first = 0;
        while first < n {
            let (rows, kept) = (LANES.min(n - first), at.wrapping_add(first * stride));
            let mut column = 0;
            // SAFETY: the caller's.
            unsafe {
                if rows <= FEW {
                    self.entries::<L>(first);
                    return;
                }
                while column < first {
                    let block = L::transposed(load_block::<L>(kept.add(column), stride, rows));
                    store_block(block, at.add(column * stride + first), stride, LANES);
                    column += LANES;
                }
                let mut block = load_block::<L>(kept.add(first), stride, rows);
                // Zero-padded on the right of the matrix, where there are no rows.
                let transposed = L::transposed(block);
                for i in 0..LANES {
                    block[i] = block[i].followed_by(transposed[i], i + 1);
                }
                store_block(block, kept.add(first), stride, rows);
            }
            first += LANES;
        }
    }

    /// From row `first` on.
    ///
    /// # Safety
    /// As [`Mirror::blocks`].
    #[inline(always)]
    unsafe fn entries<L: Lanes>(self, first: usize) {
        let Self { a, n, clear } = self;
        // SAFETY: the caller's.
        unsafe {
            // First, because processors stall if lanes are loaded soon after single numbers are stored there.
            if clear && !n.is_multiple_of(LANES) {
                let last = n / LANES * LANES;
                for row in 0..n {
                    let to = a.entry(row, last);
                    L::load(to).first(n % LANES).store(to);
                }
            }
            // Few entries are moved fastest one by one.
            if n > LANES {
                return mirror_columns::<L>((a.at, a.stride), (first, n), (0, n));
            }
            for i in first.max(1)..n {
                for j in 0..i {
                    *a.entry(j, i) = *a.entry(i, j);
                }
            }
        }
    }
}

/// Copies entries below the diagonal to their mirrored places: those of rows from `first` to `n` and of columns from one to
/// another, all multiples of four but the ends.
///
/// # Safety
/// All these entries must exist, and their mirrored places too.
#[inline(always)]
pub(super) unsafe fn mirror_columns<L: Lanes>(
    (a, stride): (*mut f64, usize),
    (first, n): (usize, usize),
    (from, to): (usize, usize),
) {
    let mut row = first;
    // SAFETY: the caller's.
    unsafe {
        while row < n {
            let end = (row + FOUR).min(n);
            let mut column = from;
            while column < row.min(to) {
                let (below, above) = (a.add(row * stride + column), a.add(column * stride + row));
                if end - row == FOUR {
                    L::transpose_four((below, stride), (above, stride));
                } else {
                    for i in 0..end - row {
                        for j in 0..FOUR {
                            *above.add(j * stride + i) = *below.add(i * stride + j);
                        }
                    }
                }
                column += FOUR;
            }
            if row < to {
                for i in row + 1..end {
                    for j in row..i {
                        *a.add(j * stride + i) = *a.add(i * stride + j);
                    }
                }
            }
            row = end;
        }
    }
}

/// Rows and columns of a small block.
const FOUR: usize = LANES / 2;

struct MirrorUpper {
    a: Place,
    n: usize,
}

impl Job for MirrorUpper {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self { a, n } = self;
        let whole = whole::<L>(n);
        // SAFETY: `square` checked the sizes.
        unsafe {
            for i in (LANES..whole).step_by(LANES) {
                for j in (0..i).step_by(LANES) {
                    a.set_block(i, j, L::transposed(a.block::<L>(j, i)));
                }
            }
            for i in 1..n {
                for j in if i < whole { i / LANES * LANES } else { 0 }..i {
                    *a.entry(i, j) = *a.entry(j, i);
                }
            }
        }
    }
}

struct Symmetrise {
    a: Place,
    n: usize,
}

impl Job for Symmetrise {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self { a, n } = self;
        let (whole, half) = (whole::<L>(n), L::constant(0.5));
        // SAFETY: `square` checked the sizes.
        unsafe {
            for i in (0..whole).step_by(LANES) {
                for j in (0..=i).step_by(LANES) {
                    let (mut mean, mirror) = (a.block::<L>(i, j), L::transposed(a.block::<L>(j, i)));
                    for (mean, mirror) in mean.iter_mut().zip(mirror) {
                        *mean = (*mean + mirror) * half;
                    }
                    a.set_block(i, j, mean);
                    if i != j {
                        a.set_block(j, i, L::transposed(mean));
                    }
                }
            }
            for i in whole.max(1)..n {
                for j in 0..i {
                    let mean = 0.5 * (*a.entry(i, j) + *a.entry(j, i));
                    (*a.entry(i, j), *a.entry(j, i)) = (mean, mean);
                }
            }
        }
    }
}
