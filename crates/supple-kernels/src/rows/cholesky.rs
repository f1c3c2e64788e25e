//! Factors of symmetric positive definite matrices.

use super::blocks::{load_block, mirror_columns, store_block};
use super::product::subtract_product;
use super::solve::Block;
use super::{FEW, Long, Rows, ViewMut, add_scaled, scale};
use crate::{Job, LANES, Lanes, dispatch, halt, math, padded};

/// Factorisations of larger orders check for a stop request.
const LARGE: usize = 1000;

/// Factors a symmetric positive definite matrix in place: `a = U' U`, `U` upper triangular. Reads the lower triangle;
/// `U` overwrites the upper one, and numbers below the diagonal in its diagonal blocks of eight by eight are lost.
///
/// If rows are wider than the matrix, `width` numbers of each are used: those right of the padded matrix become `U'^-1`
/// times their old values. `reciprocals` receives the reciprocals of the diagonal of `U`.
///
/// # Errors
/// `Err(i)` where the leading minor of order `i + 1` is not positive.
///
/// ```
/// use supple_kernels::rows::{Factored, Long, View, ViewMut, factor, solve_lower, solve_upper};
/// use supple_kernels::{Job, Lanes, Matrices, dispatch, padded};
///
/// /// Solves `A x = b`; `A` is overwritten by its factor.
/// struct Solve<'a>(&'a mut Matrices, &'a mut Matrices);
///
/// impl Job for Solve<'_> {
///     type Output = Result<(), usize>;
///
///     #[inline(always)]
///     fn run<L: Lanes>(self) -> Self::Output {
///         let Self(a, b) = self;
///         let (n, stride) = (a.rows(), a.stride());
///         let mut reciprocals = vec![0.0; padded(n)];
///         factor::<L, Long>(ViewMut::new(a.at_mut(0), stride), n, stride, &mut reciprocals)?;
///         let factored = Factored { upper: View::new(a.at(0), stride), reciprocals: &reciprocals, n };
///         let right = b.stride();
///         solve_lower::<L, Long>(factored, ViewMut::new(b.at_mut(0), right));
///         solve_upper::<L, Long>(factored, ViewMut::new(b.at_mut(0), right));
///         Ok(())
///     }
/// }
///
/// // [[4, 2], [2, 5]] x = (6, 7)
/// let (mut a, mut b) = (Matrices::zeros(1, 2, 2), Matrices::zeros(1, 2, 1));
/// for (i, [left, right, b_i]) in [[4.0, 2.0, 6.0], [2.0, 5.0, 7.0]].into_iter().enumerate() {
///     (a.set(0, i, 0, left), a.set(0, i, 1, right), b.set(0, i, 0, b_i));
/// }
/// dispatch(Solve(&mut a, &mut b)).map_err(|row| format!("indefinite at row {row}"))?;
/// assert!((b.get(0, 0, 0) - 1.0).abs() < 1e-15 && (b.get(0, 1, 0) - 1.0).abs() < 1e-15);
/// # Ok::<(), String>(())
/// ```
#[inline(always)]
pub fn factor<L: Lanes, R: Rows>(a: ViewMut, n: usize, width: usize, reciprocals: &mut [f64]) -> Result<(), usize> {
    if R::SHORT || !R::CALLED && n <= FEW {
        by_rows::<L>(a, n, width, reciprocals)
    } else {
        run::<L>(Factor { a, n, width, given: Given::Lower, reciprocals })
    }
}

/// As [`factor`] for long rows, but reads the upper triangle.
///
/// # Errors
/// As [`factor`].
#[inline(always)]
pub(crate) fn factor_upper<L: Lanes>(a: ViewMut, n: usize, width: usize, reciprocals: &mut [f64]) -> Result<(), usize> {
    run::<L>(Factor { a, n, width, given: Given::Upper, reciprocals })
}

#[inline(always)]
fn run<L: Lanes>(job: Factor) -> Result<(), usize> {
    let Factor { a, n, width, reciprocals, .. } = &job;
    assert!(*width >= padded(*n) && width.is_multiple_of(LANES) && reciprocals.len() >= padded(*n));
    assert!(a.stride >= *width && a.numbers.len() >= n * a.stride);
    L::apart(job)
}

/// As [`factor`], for use outside of sweeps, in the lower triangle: `a = G G'`, `G` lower triangular. The upper triangle may
/// be overwritten.
///
/// # Errors
/// As [`factor`].
///
/// ```
/// use supple_kernels::rows::{cholesky, log_determinant, solve_column};
///
/// // [[4, 2], [2, 5]] by rows of two numbers.
/// let mut factor = [4.0, 2.0, 2.0, 5.0];
/// cholesky(&mut factor, 2, 2).map_err(|row| format!("indefinite at row {row}"))?;
/// let mut x = [6.0, 7.0];
/// solve_column(&factor, 2, &mut x);
/// assert!((x[0] - 1.0).abs() < 1e-15 && (x[1] - 1.0).abs() < 1e-15);
/// assert!((log_determinant(&factor, 2, 2) - 16.0_f64.ln()).abs() < 1e-15);
/// # Ok::<(), String>(())
/// ```
pub fn cholesky(a: &mut [f64], n: usize, stride: usize) -> Result<(), usize> {
    if n < LANES || stride < padded(n) {
        return by_entries(a, n, stride);
    }
    dispatch(Whole { a, n, stride })?;
    for (i, j) in (1..n).flat_map(|i| (0..i).map(move |j| (i, j))) {
        a[i * stride + j] = a[j * stride + i];
    }
    Ok(())
}

/// `log |a|` from the factor that [`factor`] or [`cholesky`] left.
///
/// Example: [`cholesky`].
#[inline(always)]
#[must_use]
pub fn log_determinant(factor: &[f64], n: usize, stride: usize) -> f64 {
    2.0 * (0..n).map(|i| math::ln(factor[i * stride + i])).sum::<f64>()
}

struct Whole<'a> {
    a: &'a mut [f64],
    n: usize,
    stride: usize,
}

impl Job for Whole<'_> {
    type Output = Result<(), usize>;

    #[inline(always)]
    fn run<L: Lanes>(self) -> Self::Output {
        let mut reciprocals = vec![0.0; padded(self.n)];
        factor::<L, Long>(ViewMut::new(self.a, self.stride), self.n, padded(self.n), &mut reciprocals)
    }
}

/// Columns of `G` one after the other.
#[inline(always)]
fn by_entries(a: &mut [f64], n: usize, stride: usize) -> Result<(), usize> {
    for j in 0..n {
        let mut pivot = a[j * stride + j];
        for k in 0..j {
            pivot -= a[j * stride + k] * a[j * stride + k];
        }
        let root = if is_positive(pivot) { pivot.sqrt() } else { return Err(j) };
        a[j * stride + j] = root;
        let reciprocal = 1.0 / root;
        for i in j + 1..n {
            let mut sum = a[i * stride + j];
            for k in 0..j {
                sum -= a[i * stride + k] * a[j * stride + k];
            }
            a[i * stride + j] = sum * reciprocal;
        }
    }
    Ok(())
}

/// Like [`factor`], for a matrix in one set of lanes, one row after the other.
#[inline(always)]
fn by_rows<L: Lanes>(a: ViewMut, n: usize, width: usize, reciprocals: &mut [f64]) -> Result<(), usize> {
    let ViewMut { numbers: a, stride } = a;
    for i in 0..n {
        let mut pivot = a[i * stride + i];
        for k in 0..i {
            pivot -= a[k * stride + i] * a[k * stride + i];
        }
        if !is_positive(pivot) {
            return Err(i);
        }
        let root = pivot.sqrt();
        reciprocals[i] = 1.0 / root;
        a[i * stride + i] = root;
        for j in i + 1..n {
            let mut sum = a[j * stride + i];
            for k in 0..i {
                sum -= a[k * stride + i] * a[k * stride + j];
            }
            a[i * stride + j] = sum * reciprocals[i];
        }
        let (above, rest) = a.split_at_mut(i * stride);
        let beside = &mut rest[LANES..width];
        for k in 0..i {
            let factor = above[k * stride + i];
            add_scaled::<L>(beside, -factor, &above[k * stride + LANES..k * stride + width]);
        }
        scale::<L>(beside, reciprocals[i]);
    }
    Ok(())
}

#[inline(always)]
fn is_positive(pivot: f64) -> bool {
    pivot > 0.0 && pivot <= f64::MAX
}

/// The triangle that is read.
#[derive(Clone, Copy, PartialEq)]
enum Given {
    Lower,
    Upper,
}

struct Factor<'a> {
    a: ViewMut<'a>,
    n: usize,
    width: usize,
    given: Given,
    reciprocals: &'a mut [f64],
}

impl Job for Factor<'_> {
    type Output = Result<(), usize>;

    /// Eight rows at a time: subtracts the contributions of those above, factors the diagonal block, and solves right of it.
    #[inline(always)]
    fn run<L: Lanes>(self) -> Self::Output {
        let Self { a: ViewMut { numbers, stride }, n, width, given, reciprocals: kept } = self;
        let a = numbers.as_mut_ptr();
        let mut first = 0;
        // SAFETY: `run` checked that there are `n` rows of `width` numbers, at least `padded(n)`.
        unsafe {
            while first < n {
                // Large matrices take long.
                if n > LARGE && halt::is_requested() {
                    return Err(first);
                }
                let (size, at) = (LANES.min(n - first), a.add(first * (stride + 1)));
                if given == Given::Lower {
                    if L::WIDE {
                        raise::<L>(a, stride, first, n);
                    } else {
                        mirror_columns::<L>((a, stride), (first, n), (first, first + size));
                    }
                }
                if first > 0 {
                    let (left, right) = ((a.add(first).cast_const(), stride), a.add(first).cast_const());
                    subtract_product::<L, true>((at, stride), left, right, (size, first, width - first));
                }
                let reciprocals = match L::WIDE {
                    true => pivots::<L>(at, stride, size),
                    false => eliminate::<L>(at, stride, size, width - first),
                };
                let reciprocals = match reciprocals {
                    Ok(reciprocals) => reciprocals,
                    Err(i) => return Err(first + i),
                };
                kept[first..first + LANES].copy_from_slice(&reciprocals);
                if L::WIDE {
                    let block = Block { factor: at, stride, size, reciprocals };
                    block.forward::<L>(at.add(LANES), stride, width - first - LANES);
                }
                first += LANES;
            }
        }
        Ok(())
    }
}

/// Copies the blocks on and below the diagonal from column `first` on to their mirrored places.
///
/// # Safety
/// There must be `n` rows of `padded(n)` numbers.
#[inline(always)]
unsafe fn raise<L: Lanes>(a: *mut f64, stride: usize, first: usize, n: usize) {
    let size = LANES.min(n - first);
    for below in (first..n).step_by(LANES) {
        // SAFETY: the caller's.
        unsafe {
            let block = L::transposed(load_block::<L>(a.add(below * stride + first), stride, n - below));
            store_block(block, a.add(first * stride + below), stride, size);
        }
    }
}

/// `U` of a diagonal block, and `U'^-1` times what is right of it, up to `width` numbers in all, with rows in memory, for
/// machines with few registers; otherwise as [`pivots`].
///
/// # Safety
/// There must be `size` rows of `width` numbers, whole lanes.
#[inline(always)]
unsafe fn eliminate<L: Lanes>(at: *mut f64, stride: usize, size: usize, width: usize) -> Result<[f64; LANES], usize> {
    let mut reciprocals = [1.0; LANES];
    // SAFETY: the caller's.
    unsafe {
        for (j, reciprocal) in reciprocals.iter_mut().enumerate().take(size) {
            let row = at.add(j * stride);
            let pivot = *row.add(j);
            if !is_positive(pivot) {
                return Err(j);
            }
            *reciprocal = 1.0 / pivot;
            let mut factors = [0.0; LANES];
            for (i, factor) in factors.iter_mut().enumerate().take(size).skip(j + 1) {
                *factor = *row.add(i);
            }
            let mut column = 0;
            while column < width {
                let scaled = L::load(row.add(column)) * L::constant(*reciprocal);
                for (i, factor) in factors.iter().enumerate().take(size).skip(j + 1) {
                    let to = at.add(i * stride + column);
                    L::constant(*factor).neg_mul_add(scaled, L::load(to)).store(to);
                }
                column += LANES;
            }
        }
        let roots = L::from_array(reciprocals).sqrt().to_array();
        for (j, root) in roots[..size].iter().enumerate() {
            let (mut column, root) = (0, L::constant(*root));
            while column < width {
                let to = at.add(j * stride + column);
                (L::load(to) * root).store(to);
                column += LANES;
            }
        }
        Ok(roots)
    }
}

/// `U` of a diagonal block, in registers, and the reciprocals of its diagonal. All pivots' roots are taken together, so
/// that no pivot waits for a root. `Err(i)` if the `i`th is not positive.
///
/// # Safety
/// There must be `size` rows of eight numbers.
#[inline(always)]
unsafe fn pivots<L: Lanes>(at: *mut f64, stride: usize, size: usize) -> Result<[f64; LANES], usize> {
    let mut reciprocals = [1.0; LANES];
    // SAFETY: the caller's.
    unsafe {
        let mut rows = load_block::<L>(at, stride, size);
        for j in 0..LANES {
            if j == size {
                break;
            }
            let row = rows[j].to_array();
            if !is_positive(row[j]) {
                return Err(j);
            }
            reciprocals[j] = 1.0 / row[j];
            let scaled = rows[j] * L::constant(reciprocals[j]);
            for i in j + 1..LANES {
                rows[i] = L::constant(row[i]).neg_mul_add(scaled, rows[i]);
            }
        }
        let roots = L::from_array(reciprocals).sqrt().to_array();
        for (row, root) in rows.iter_mut().zip(roots) {
            *row = *row * L::constant(root);
        }
        store_block(rows, at, stride, size);
        Ok(roots)
    }
}
