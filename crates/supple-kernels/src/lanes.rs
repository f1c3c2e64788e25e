use std::ops::{Add, Div, Mul, Neg, Sub};

use crate::scalar::derive_operators;
use crate::{Scalar, Single, math};

/// How many numbers every [`Lanes`] type holds.
///
/// Example: [`dispatch`](crate::dispatch()).
pub const LANES: usize = 8;

/// Work written once over the lanes, to be run with the machine's best instructions.
///
/// `run` and all it calls must be `#[inline(always)]`; a closure made outside does not inherit the instructions.
///
/// Example: [`dispatch`](crate::dispatch()).
pub trait Job {
    /// The result of the job.
    type Output;

    /// Does the work with lanes of type `L`.
    fn run<L: Lanes>(self) -> Self::Output;
}

/// Eight numbers worked on at once: eight knots of a trajectory, or eight entries of a padded row.
///
/// Example: [`dispatch`](crate::dispatch()).
pub trait Lanes: Scalar + Mul<f64, Output = Self> {
    /// One number with the arithmetic of one lane.
    type Single: Single;

    /// Whether there are enough registers to hold sixteen sets of lanes at once.
    const WIDE: bool;

    /// The lanes from an array.
    fn from_array(values: [f64; LANES]) -> Self;

    /// The lanes as an array.
    fn to_array(self) -> [f64; LANES];

    /// Runs a job as a separate function, with the instructions of these lanes. Code that is not inlined into its caller is
    /// compiled once, however many callers it has: for jobs whose call cost is negligible.
    fn apart<J: Job>(job: J) -> J::Output;

    /// `term - self * factor`, rounded once where the machine can.
    #[must_use]
    fn neg_mul_add(self, factor: Self, term: Self) -> Self;

    /// Loads the first eight numbers at `from`.
    ///
    /// # Safety
    /// Eight numbers must be readable at `from`.
    unsafe fn load(from: *const f64) -> Self;

    /// Stores the eight numbers at `to`.
    ///
    /// # Safety
    /// Eight numbers must be writable at `to`.
    unsafe fn store(self, to: *mut f64);

    /// The first `count` lanes, at most eight, and 0 in the others.
    ///
    /// All lanes must be finite.
    #[inline(always)]
    #[must_use]
    fn first(self, count: usize) -> Self {
        let place = LANES - count.min(LANES);
        // SAFETY: eight numbers follow each of the first nine.
        self * unsafe { Self::load(FIRST.as_ptr().add(place)) }
    }

    /// The first `count` lanes of these, and the others of `rest`. All must be finite.
    #[inline(always)]
    #[must_use]
    fn followed_by(self, rest: Self, count: usize) -> Self {
        self.first(count) + (rest - rest.first(count))
    }

    /// Copies four rows of four numbers to columns.
    ///
    /// # Safety
    /// Four rows of four numbers must be readable and writable at these places, each row so many numbers after the last one,
    /// and the places must not overlap.
    #[inline(always)]
    unsafe fn transpose_four((from, from_stride): (*const f64, usize), (to, to_stride): (*mut f64, usize)) {
        for i in 0..4 {
            for j in 0..4 {
                // SAFETY: the caller's.
                unsafe { *to.add(j * to_stride + i) = *from.add(i * from_stride + j) };
            }
        }
    }

    /// Eight rows of eight numbers, as columns.
    #[inline(always)]
    fn transposed(rows: [Self; LANES]) -> [Self; LANES] {
        let mut columns = [[0.0; LANES]; LANES];
        for (i, row) in rows.into_iter().enumerate() {
            for (column, value) in columns.iter_mut().zip(row.to_array()) {
                column[i] = value;
            }
        }
        let mut out = rows;
        for (out, column) in out.iter_mut().zip(columns) {
            *out = Self::from_array(column);
        }
        out
    }
}

/// Eight ones and eight zeros.
static FIRST: [f64; 2 * LANES] = {
    let mut numbers = [0.0; 2 * LANES];
    let mut i = 0;
    while i < LANES {
        numbers[i] = 1.0;
        i += 1;
    }
    numbers
};

/// Eight numbers in a plain array, for machines whose vector instructions are not known here.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub struct Portable([f64; LANES]);

macro_rules! portable_operator {
    ($($trait:ident, $method:ident, $op:tt;)*) => {$(
        impl $trait for Portable {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self(std::array::from_fn(|i| self.0[i] $op other.0[i]))
            }
        }
    )*};
}
portable_operator! { Add, add, +; Sub, sub, -; Mul, mul, *; Div, div, /; }

impl Neg for Portable {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self(self.0.map(|v| -v))
    }
}

impl Lanes for Portable {
    type Single = f64;
    const WIDE: bool = false;
    #[inline(never)]
    fn apart<J: Job>(job: J) -> J::Output {
        job.run::<Self>()
    }
    #[inline(always)]
    fn from_array(values: [f64; LANES]) -> Self {
        Self(values)
    }
    #[inline(always)]
    fn to_array(self) -> [f64; LANES] {
        self.0
    }
    #[inline(always)]
    fn neg_mul_add(self, factor: Self, term: Self) -> Self {
        term - self * factor
    }
    #[inline(always)]
    unsafe fn load(from: *const f64) -> Self {
        // SAFETY: the caller's.
        Self(unsafe { from.cast::<[f64; LANES]>().read_unaligned() })
    }
    #[inline(always)]
    unsafe fn store(self, to: *mut f64) {
        // SAFETY: the caller's.
        unsafe { to.cast::<[f64; LANES]>().write_unaligned(self.0) }
    }
}

impl Scalar for Portable {
    #[inline(always)]
    fn constant(value: f64) -> Self {
        Self([value; LANES])
    }
    #[inline(always)]
    fn mul_add(self, factor: Self, term: Self) -> Self {
        self * factor + term
    }
    #[inline(always)]
    fn recip(self) -> Self {
        Self(self.0.map(|v| 1.0 / v))
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(self.0.map(f64::sqrt))
    }
    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        lane_sin_cos(self)
    }
    #[inline(always)]
    fn exp(self) -> Self {
        Self(self.0.map(math::exp))
    }
    #[inline(always)]
    fn ln(self) -> Self {
        Self(self.0.map(math::ln))
    }
    #[inline(always)]
    fn tanh(self) -> Self {
        Self(self.0.map(math::tanh))
    }
    #[inline(always)]
    fn exp_m1(self) -> Self {
        Self(self.0.map(math::exp_m1))
    }
    #[inline(always)]
    fn ln_1p(self) -> Self {
        Self(self.0.map(math::ln_1p))
    }
    #[inline(always)]
    fn atan2(self, x: Self) -> Self {
        Self(std::array::from_fn(|i| math::atan2(self.0[i], x.0[i])))
    }
    #[inline(always)]
    fn select(self, positive: Self, otherwise: Self) -> Self {
        Self(std::array::from_fn(|i| if self.0[i] > 0.0 { positive.0[i] } else { otherwise.0[i] }))
    }
}

/// Sine and cosine of all lanes; those of large angles one by one.
#[inline(always)]
fn lane_sin_cos<L: Lanes>(x: L) -> (L, L) {
    let (sin, cos) = math::near_sin_cos(x);
    let values = x.to_array();
    // Numbers that are not finite are not near either.
    let is_near = |value: f64| value.abs() <= math::NEAR;
    if values.into_iter().all(is_near) {
        return (sin, cos);
    }
    let (mut sin, mut cos) = (sin.to_array(), cos.to_array());
    for (i, value) in values.into_iter().enumerate().filter(|&(_, value)| !is_near(value)) {
        (sin[i], cos[i]) = math::sin_cos(value);
    }
    (L::from_array(sin), L::from_array(cos))
}

/// What every lane type has in common, given its operators.
macro_rules! common {
    ($name:ty) => {
        derive_operators!([] $name);
        impl Mul<f64> for $name {
            type Output = Self;
            #[inline(always)]
            fn mul(self, other: f64) -> Self {
                self * Self::constant(other)
            }
        }
        impl Div<f64> for $name {
            type Output = Self;
            #[inline(always)]
            fn div(self, other: f64) -> Self {
                self / Self::constant(other)
            }
        }
    };
}
common!(Portable);

#[cfg(target_arch = "x86_64")]
pub(crate) mod x86;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Level, dispatch, dispatch_portable};

    /// Operations on whole lanes, applied to numbers that all differ.
    struct Moves;

    impl Job for Moves {
        type Output = Vec<[f64; LANES]>;

        #[inline(always)]
        fn run<L: Lanes>(self) -> Self::Output {
            let numbers = |from: usize| std::array::from_fn(|i| (from + i) as f64 + 0.5);
            let (a, b) = (L::from_array(numbers(1)), L::from_array(numbers(20)));
            let mut out = vec![a.neg_mul_add(b, L::constant(3.0)).to_array()];
            for count in 0..10 {
                out.push(a.first(count).to_array());
                out.push(a.followed_by(b, count).to_array());
            }
            let mut rows = [a; LANES];
            for (i, row) in rows.iter_mut().enumerate() {
                *row = L::from_array(numbers(10 * i));
            }
            for column in L::transposed(rows) {
                out.push(column.to_array());
            }
            let mut stored = [0.0; 2 * LANES + 1];
            // SAFETY: eight numbers follow each of these places.
            unsafe { L::load(stored.as_ptr()).store(stored.as_mut_ptr().add(LANES)) };
            // SAFETY: as above.
            unsafe { a.store(stored.as_mut_ptr().add(3)) };
            // SAFETY: as above.
            out.push(unsafe { L::load(stored.as_ptr().add(2)) }.to_array());
            out
        }
    }

    #[test]
    fn lanes_are_moved_alike_at_every_level() {
        let number = |from: usize, i: usize| (from + i) as f64 + 0.5;
        let mut expected = vec![std::array::from_fn(|i| 3.0 - number(1, i) * number(20, i))];
        for count in 0..10 {
            expected.push(std::array::from_fn(|i| if i < count { number(1, i) } else { 0.0 }));
            expected.push(std::array::from_fn(|i| if i < count { number(1, i) } else { number(20, i) }));
        }
        for j in 0..LANES {
            expected.push(std::array::from_fn(|i| number(10 * i, j)));
        }
        expected.push(std::array::from_fn(|i| if i == 0 { 0.0 } else { number(1, i - 1) }));
        for level in Level::ALL.into_iter().filter(|level| level.force()) {
            assert_eq!(dispatch(Moves), expected, "{level:?}");
        }
        assert_eq!(dispatch_portable(Moves), expected);
    }

    /// Angles that are reduced in lanes, mixed with angles that are not.
    #[test]
    fn sines_of_near_and_far_angles_side_by_side() {
        struct Sines([f64; LANES]);
        impl Job for Sines {
            type Output = ([f64; LANES], [f64; LANES]);

            #[inline(always)]
            fn run<L: Lanes>(self) -> Self::Output {
                let (sin, cos) = L::from_array(self.0).sin_cos();
                (sin.to_array(), cos.to_array())
            }
        }
        let angles = [0.3, 1e6, -2.0, -3e9, 0.0, 1e22, f64::INFINITY, math::NEAR];
        let check = |what: &str, (sin, cos): ([f64; LANES], [f64; LANES])| {
            for (i, angle) in angles.into_iter().enumerate() {
                if angle.is_finite() {
                    let (s, c) = math::sin_cos(angle);
                    assert!((sin[i] - s).abs() < 1e-15 && (cos[i] - c).abs() < 1e-15, "{what} {angle}");
                } else {
                    assert!(sin[i].is_nan() && cos[i].is_nan(), "{what} {angle}");
                }
            }
        };
        for level in Level::ALL.into_iter().filter(|level| level.force()) {
            check(&format!("{level:?}"), dispatch(Sines(angles)));
        }
        check("portable", dispatch_portable(Sines(angles)));
    }
}
