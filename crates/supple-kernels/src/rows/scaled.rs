use super::{Rows, View, ViewMut, holds};
use crate::{LANES, Lanes};

/// `factor` times the first `count` numbers of some rows.
///
/// Example: [`transpose`](crate::rows::transpose).
#[derive(Clone, Copy, Debug)]
pub struct Scaled<'a> {
    /// The rows.
    pub from: View<'a>,
    /// The factor.
    pub factor: f64,
    /// How many rows.
    pub rows: usize,
    /// How many numbers of each; others up to whole lanes count as 0, but must be finite.
    pub count: usize,
}

impl Scaled<'_> {
    /// `out = factor from`
    #[inline(always)]
    pub fn set<L: Lanes, R: Rows>(self, out: ViewMut) {
        self.run::<L, R>(out, (std::ptr::null(), 0));
    }

    /// `out += factor from`
    #[inline(always)]
    pub fn add<L: Lanes, R: Rows>(self, out: ViewMut) {
        let base = (out.numbers.as_ptr(), out.stride);
        self.run::<L, R>(out, base);
    }

    /// `out = base + factor from`
    #[inline(always)]
    pub fn add_to<L: Lanes, R: Rows>(self, base: View, out: ViewMut) {
        assert!(holds(base.numbers, base.stride, (self.rows, R::stride(self.count))));
        self.run::<L, R>(out, (base.numbers.as_ptr(), base.stride));
    }

    /// `out = base + factor from`, without the base where it is null; every number of a base exists.
    #[inline(always)]
    fn run<L: Lanes, R: Rows>(self, out: ViewMut, (base, base_stride): (*const f64, usize)) {
        let Self { from, factor, rows, count } = self;
        if count == 0 {
            return;
        }
        let width = R::stride(count);
        assert!(holds(out.numbers, out.stride, (rows, width)) && holds(from.numbers, from.stride, (rows, width)));
        let (to, stride) = (out.numbers.as_mut_ptr(), out.stride);
        let work = Work { to, stride, base, base_stride, from: from.numbers.as_ptr(), from_stride: from.stride };
        for column in (0..width).step_by(LANES) {
            // SAFETY: the assertion above.
            unsafe { work.columns::<L>(factor, (rows, column), (count - column).min(LANES)) };
        }
    }
}

struct Work {
    to: *mut f64,
    stride: usize,
    base: *const f64,
    base_stride: usize,
    from: *const f64,
    from_stride: usize,
}

impl Work {
    /// The lanes from `column` on, of which the first `count` are used.
    ///
    /// # Safety
    /// As [`Scaled::run`] checks.
    #[inline(always)]
    unsafe fn columns<L: Lanes>(&self, factor: f64, (rows, column): (usize, usize), count: usize) {
        // SAFETY: the caller's.
        unsafe {
            let factors = L::constant(factor).first(count);
            let (to, from) = (self.to.add(column), self.from.add(column));
            if self.base.is_null() {
                for row in 0..rows {
                    (L::load(from.add(row * self.from_stride)) * factors).store(to.add(row * self.stride));
                }
                return;
            }
            let base = self.base.add(column);
            for row in 0..rows {
                let (line, base) =
                    (L::load(from.add(row * self.from_stride)), L::load(base.add(row * self.base_stride)));
                factors.mul_add(line, base).store(to.add(row * self.stride));
            }
        }
    }
}
