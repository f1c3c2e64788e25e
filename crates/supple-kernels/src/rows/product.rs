use super::fetch::ask_nearest;
use super::{Rows, View, ViewMut, holds};
use crate::{Job, LANES, Lanes, padded};

/// The left factor of a product. A symmetric one is best passed as its transpose, which takes fewer instructions.
///
/// Example: [`Product`].
#[derive(Clone, Copy, Debug)]
pub struct Left<'a> {
    data: &'a [f64],
    stride: usize,
    transposed: bool,
}

impl<'a> Left<'a> {
    /// The matrix itself.
    #[inline(always)]
    #[must_use]
    pub fn plain(data: &'a [f64], stride: usize) -> Self {
        Self { data, stride, transposed: false }
    }

    /// Its transpose.
    #[inline(always)]
    #[must_use]
    pub fn transposed(data: &'a [f64], stride: usize) -> Self {
        Self { data, stride, transposed: true }
    }
}

/// A product `left (rows x inner) * right (inner x width)`.
///
/// ```
/// use supple_kernels::rows::{Left, Long, Product, View, ViewMut};
/// use supple_kernels::{Job, Lanes, Matrices, dispatch, padded};
///
/// /// The square of a matrix.
/// struct Square<'a>(&'a Matrices, &'a mut Matrices);
///
/// impl Job for Square<'_> {
///     type Output = ();
///
///     #[inline(always)]
///     fn run<L: Lanes>(self) {
///         let Self(a, out) = self;
///         let (n, stride) = (a.rows(), a.stride());
///         let (left, right) = (Left::plain(a.at(0), stride), View::new(a.at(0), stride));
///         let product = Product { left, right, rows: n, inner: n, width: padded(n) };
///         product.set::<L, Long>(ViewMut::new(out.at_mut(0), stride));
///     }
/// }
///
/// // [[1, 2], [3, 4]]
/// let (mut a, mut square) = (Matrices::zeros(1, 2, 2), Matrices::zeros(1, 2, 2));
/// (0..4).for_each(|i| a.set(0, i / 2, i % 2, 1.0 + i as f64));
/// dispatch(Square(&a, &mut square));
/// assert_eq!((square.get(0, 0, 0), square.get(0, 1, 0)), (7.0, 15.0));
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Product<'a> {
    /// The left factor.
    pub left: Left<'a>,
    /// The right factor.
    pub right: View<'a>,
    /// Rows of the product.
    pub rows: usize,
    /// Columns of `left` and rows of `right`.
    pub inner: usize,
    /// Numbers of each row, padding included: a multiple of [`LANES`].
    pub width: usize,
}

/// Which part of a product is computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Part {
    Whole,
    Lower,
}

impl<'a> Product<'a> {
    /// `out = left right`
    #[inline(always)]
    pub fn set<L: Lanes, R: Rows>(self, out: ViewMut) {
        let base = (std::ptr::null(), 0);
        self.run::<L, R>(Part::Whole, out, base, 1.0);
    }

    /// `out += left right`
    #[inline(always)]
    pub fn add<L: Lanes, R: Rows>(self, out: ViewMut) {
        let base = (out.numbers.as_ptr(), out.stride);
        self.run::<L, R>(Part::Whole, out, base, 1.0);
    }

    /// `out -= left right`
    #[inline(always)]
    pub fn subtract<L: Lanes, R: Rows>(self, out: ViewMut) {
        let base = (out.numbers.as_ptr(), out.stride);
        self.run::<L, R>(Part::Whole, out, base, -1.0);
    }

    /// `out = base + left right`
    #[inline(always)]
    pub fn add_to<L: Lanes, R: Rows>(self, base: View, out: ViewMut) {
        self.run::<L, R>(Part::Whole, out, self.base(base), 1.0);
    }

    /// `out = base - left right`
    #[inline(always)]
    pub fn subtract_from<L: Lanes, R: Rows>(self, base: View, out: ViewMut) {
        self.run::<L, R>(Part::Whole, out, self.base(base), -1.0);
    }

    /// The lower triangle, where the product is symmetric. Numbers right of the diagonal, up to the next multiple of
    /// [`LANES`], are those of the product too; what is further right stays as it was.
    #[inline(always)]
    #[must_use]
    pub fn lower(self) -> Lower<'a> {
        Lower(self)
    }

    #[inline(always)]
    fn base(&self, base: View) -> (*const f64, usize) {
        assert!(holds(base.numbers, base.stride, (self.rows, self.width)));
        (base.numbers.as_ptr(), base.stride)
    }

    /// `out = base + sign left right`, without the base if it is null; a base must be readable in full.
    #[inline(always)]
    fn run<L: Lanes, R: Rows>(self, part: Part, out: ViewMut, base: (*const f64, usize), sign: f64) {
        let Self { left, right, rows, inner, width } = self;
        if rows == 0 || width == 0 {
            return;
        }
        assert!(width.is_multiple_of(LANES) && (part == Part::Whole || width >= R::stride(rows)));
        assert!(holds(out.numbers, out.stride, (rows, width)) && holds(right.numbers, right.stride, (inner, width)));
        let entries = if left.transposed { (inner, rows) } else { (rows, inner) };
        assert!(inner == 0 || holds(left.data, left.stride, entries));
        let (to, out_stride) = (out.numbers.as_mut_ptr(), out.stride);
        let factors = Factors {
            left: left.data.as_ptr(),
            left_stride: left.stride,
            right: right.numbers.as_ptr(),
            right_stride: right.stride,
            inner,
        };
        let work = Work { part, factors, rows, width, to, out_stride, base: base.0, base_stride: base.1, sign };
        // SAFETY: the assertions above.
        unsafe {
            match (R::CALLED, left.transposed) {
                (false, true) => work.by_lanes::<L, R, true>(),
                (false, false) => work.by_lanes::<L, R, false>(),
                (true, true) => L::apart(Blocks::<true>(work)),
                (true, false) => L::apart(Blocks::<false>(work)),
            }
        }
    }
}

/// [`Product::lower`].
///
/// Example: [`Product`].
#[derive(Clone, Copy, Debug)]
pub struct Lower<'a>(Product<'a>);

impl Lower<'_> {
    /// `out = left right`
    #[inline(always)]
    pub fn set<L: Lanes, R: Rows>(self, out: ViewMut) {
        self.0.run::<L, R>(Part::Lower, out, (std::ptr::null(), 0), 1.0);
    }

    /// `out += left right`
    #[inline(always)]
    pub fn add<L: Lanes, R: Rows>(self, out: ViewMut) {
        let base = (out.numbers.as_ptr(), out.stride);
        self.0.run::<L, R>(Part::Lower, out, base, 1.0);
    }

    /// `out -= left right`
    #[inline(always)]
    pub fn subtract<L: Lanes, R: Rows>(self, out: ViewMut) {
        let base = (out.numbers.as_ptr(), out.stride);
        self.0.run::<L, R>(Part::Lower, out, base, -1.0);
    }

    /// `out = base + left right`
    #[inline(always)]
    pub fn add_to<L: Lanes, R: Rows>(self, base: View, out: ViewMut) {
        self.0.run::<L, R>(Part::Lower, out, self.0.base(base), 1.0);
    }

    /// `out = base - left right`
    #[inline(always)]
    pub fn subtract_from<L: Lanes, R: Rows>(self, base: View, out: ViewMut) {
        self.0.run::<L, R>(Part::Lower, out, self.0.base(base), -1.0);
    }
}

/// The factors; every entry addressed must exist.
#[derive(Clone, Copy)]
struct Factors {
    left: *const f64,
    left_stride: usize,
    right: *const f64,
    right_stride: usize,
    inner: usize,
}

/// A product whose sizes were checked.
struct Work {
    part: Part,
    factors: Factors,
    rows: usize,
    width: usize,
    to: *mut f64,
    out_stride: usize,
    base: *const f64,
    base_stride: usize,
    sign: f64,
}

/// A product with rows of any length, whose left factor is transposed or not.
struct Blocks<const TRANSPOSED: bool>(Work);

impl<const TRANSPOSED: bool> Job for Blocks<TRANSPOSED> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self(work) = self;
        let group = if work.part == Part::Lower { LANES } else { work.rows };
        let mut first = 0;
        // SAFETY: `Product::run` checked the sizes; a group of rows of a lower triangle begins at a multiple of its size, so
        // that its last row is below the next multiple of the lanes.
        unsafe {
            while first < work.rows {
                let end = (first + group).min(work.rows);
                let width = if work.part == Part::Lower { padded(end) } else { work.width };
                if work.part == Part::Lower && work.factors.inner >= LONG && !work.base.is_null() {
                    for row in first..end {
                        ask_nearest(work.base.add(row * work.base_stride), width);
                    }
                }
                let mut column = 0;
                while column < width {
                    if L::WIDE && column + 2 * LANES <= width {
                        work.columns::<L, TRANSPOSED, 2>((first, end), column);
                        column += 2 * LANES;
                    } else {
                        work.columns::<L, TRANSPOSED, 1>((first, end), column);
                        column += LANES;
                    }
                }
                first = end;
            }
        }
    }
}

/// `to -= left right` of `(rows, inner, width)`, `right` and `to` with the same stride.
///
/// # Safety
/// All numbers must exist; `to` must not overlap `left` or `right`.
#[inline(always)]
pub(super) unsafe fn subtract_product<L: Lanes, const TRANSPOSED: bool>(
    (to, stride): (*mut f64, usize),
    (left, left_stride): (*const f64, usize),
    right: *const f64,
    (rows, inner, width): (usize, usize, usize),
) {
    let factors = Factors { left, left_stride, right, right_stride: stride, inner };
    let (base, sign) = (to.cast_const(), -1.0);
    let work =
        Work { part: Part::Whole, factors, rows, width, to, out_stride: stride, base, base_stride: stride, sign };
    L::apart(Blocks::<TRANSPOSED>(work));
}

/// The number of terms from which the output is prefetched during the sum.
const LONG: usize = 16;

impl Work {
    /// Short and medium rows, with as little code as possible without loss of speed.
    ///
    /// # Safety
    /// As [`Product::run`] checks.
    #[inline(always)]
    unsafe fn by_lanes<L: Lanes, R: Rows, const TRANSPOSED: bool>(self) {
        // SAFETY: the caller's.
        unsafe {
            if R::SHORT {
                return self.fours::<L, TRANSPOSED, 1>(0, 0, false);
            }
            let mut column = 0;
            while column < self.width {
                if self.part == Part::Lower {
                    self.fours::<L, TRANSPOSED, 1>(column, column, true);
                    column += LANES;
                } else if L::WIDE && column + 2 * LANES <= self.width {
                    self.fours::<L, TRANSPOSED, 2>(0, column, true);
                    column += 2 * LANES;
                } else {
                    self.fours::<L, TRANSPOSED, 1>(0, column, true);
                    column += LANES;
                }
            }
        }
    }

    /// `C` lanes of columns from `column` on, four rows at a time from `row` on, then the rest one by one or together.
    ///
    /// # Safety
    /// As [`Product::run`] checks.
    #[inline(always)]
    unsafe fn fours<L: Lanes, const TRANSPOSED: bool, const C: usize>(
        &self,
        mut row: usize,
        column: usize,
        together: bool,
    ) {
        // SAFETY: the caller's.
        unsafe {
            while row + 4 <= self.rows {
                self.block::<L, TRANSPOSED, 4, C>(row, column);
                row += 4;
            }
            if together && row + 3 == self.rows {
                return self.block::<L, TRANSPOSED, 3, C>(row, column);
            }
            if together && row + 2 == self.rows {
                return self.block::<L, TRANSPOSED, 2, C>(row, column);
            }
            while row < self.rows {
                self.block::<L, TRANSPOSED, 1, C>(row, column);
                row += 1;
            }
        }
    }

    /// `C` lanes of columns of some rows, from `column` on.
    ///
    /// # Safety
    /// As [`Product::run`] checks.
    #[inline(always)]
    unsafe fn columns<L: Lanes, const TRANSPOSED: bool, const C: usize>(
        &self,
        (mut row, end): (usize, usize),
        column: usize,
    ) {
        // SAFETY: the caller's.
        unsafe {
            while row < end {
                macro_rules! rows {
                    ($count:literal) => {{
                        self.block::<L, TRANSPOSED, $count, C>(row, column);
                        row += $count;
                    }};
                }
                match end - row {
                    1 => rows!(1),
                    2 => rows!(2),
                    3 => rows!(3),
                    8.. if L::WIDE => rows!(8),
                    // A block takes as long as its sums depend on one another, however few rows it has.
                    5 if L::WIDE => rows!(5),
                    6 if L::WIDE => rows!(6),
                    7 if L::WIDE => rows!(7),
                    _ => rows!(4),
                }
            }
        }
    }

    /// `R` rows and `C` lanes of columns.
    ///
    /// # Safety
    /// Rows `row..row + R` and these columns must exist.
    #[inline(always)]
    unsafe fn block<L: Lanes, const TRANSPOSED: bool, const R: usize, const C: usize>(
        &self,
        row: usize,
        column: usize,
    ) {
        let Factors { left, left_stride, right, right_stride, inner } = self.factors;
        let (by_row, by_term) = if TRANSPOSED { (1, left_stride) } else { (left_stride, 1) };
        // SAFETY: the caller's.
        unsafe {
            let mut sums = [[L::zero(); C]; R];
            let (mut left, mut right) = (left.add(row * by_row), right.add(column));
            for _ in 0..inner {
                let mut lines = [L::zero(); C];
                for (c, line) in lines.iter_mut().enumerate() {
                    *line = L::load(right.add(c * LANES));
                }
                for (r, sums) in sums.iter_mut().enumerate() {
                    let factor = L::constant(*left.add(r * by_row));
                    for (sum, line) in sums.iter_mut().zip(lines) {
                        *sum = factor.mul_add(line, *sum);
                    }
                }
                (left, right) = (left.wrapping_add(by_term), right.wrapping_add(right_stride));
            }
            let to = self.to.add(row * self.out_stride + column);
            if self.base.is_null() {
                for (r, sums) in sums.into_iter().enumerate() {
                    for (c, sum) in sums.into_iter().enumerate() {
                        sum.store(to.add(r * self.out_stride + c * LANES));
                    }
                }
                return;
            }
            let (base, sign) = (self.base.add(row * self.base_stride + column), L::constant(self.sign));
            for (r, sums) in sums.into_iter().enumerate() {
                for (c, sum) in sums.into_iter().enumerate() {
                    let base = L::load(base.add(r * self.base_stride + c * LANES));
                    sign.mul_add(sum, base).store(to.add(r * self.out_stride + c * LANES));
                }
            }
        }
    }
}
