//! Intervals with outward rounding: every result contains all results of the operation on numbers in its operands.

use std::ops::{Add, Mul, Neg, Sub};
use supple_kernels::math;

/// Products below this may have lost bits that [`f64::mul_add`] cannot recover.
const TINY: f64 = 1e-280;

/// Rounding error of the platform's logarithm, relative, with a margin.
const LOG_ROUNDING: f64 = 8.0 * f64::EPSILON;

/// The numbers from `low` to `high`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Interval {
    pub low: f64,
    pub high: f64,
}

/// `a + b` rounded down and rounded up, each to one unit in the last place.
#[inline(always)]
fn sums(a: f64, b: f64) -> (f64, f64) {
    let sum = a + b;
    let part = sum - a;
    // Knuth: exact where nothing overflows, and not a number otherwise.
    let error = (a - (sum - part)) + (b - part);
    let low = if error >= 0.0 { sum } else { sum.next_down() };
    let high = if error <= 0.0 { sum } else { sum.next_up() };
    (low, high)
}

/// The same of `a b`.
#[inline(always)]
fn products(a: f64, b: f64) -> (f64, f64) {
    let product = a * b;
    if a == 0.0 || b == 0.0 {
        return (product, product);
    }
    if product.abs() < TINY {
        return (product.next_down(), product.next_up());
    }
    let error = a.mul_add(b, -product);
    let low = if error >= 0.0 { product } else { product.next_down() };
    let high = if error <= 0.0 { product } else { product.next_up() };
    (low, high)
}

impl Interval {
    pub const ZERO: Self = Self { low: 0.0, high: 0.0 };

    /// One number.
    pub fn point(value: f64) -> Self {
        Self { low: value, high: value }
    }

    /// A number near the middle.
    pub fn middle(self) -> f64 {
        0.5 * self.low + 0.5 * self.high
    }

    /// The largest absolute value in it.
    pub fn magnitude(self) -> f64 {
        self.low.abs().max(self.high.abs())
    }

    /// `ln` of a positive interval; not a number otherwise.
    pub fn ln(self) -> Self {
        let widened = |value: f64, sign: f64| {
            let log = math::ln(value);
            log + sign * (LOG_ROUNDING * log.abs() + f64::MIN_POSITIVE)
        };
        Self { low: widened(self.low, -1.0), high: widened(self.high, 1.0) }
    }

    /// The inverse of a positive interval; not a number otherwise.
    pub fn recip(self) -> Self {
        let positive = self.low > 0.0;
        let of = |value: f64| if positive { value.recip() } else { f64::NAN };
        Self { low: of(self.high).next_down(), high: of(self.low).next_up() }
    }
}

impl Add for Interval {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self { low: sums(self.low, other.low).0, high: sums(self.high, other.high).1 }
    }
}

impl Sub for Interval {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl Neg for Interval {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self { low: -self.high, high: -self.low }
    }
}

impl Mul for Interval {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        let (a, b) = (products(self.low, other.low), products(self.low, other.high));
        let (c, d) = (products(self.high, other.low), products(self.high, other.high));
        // A NaN product must not be lost when taking the minimum.
        let sum = a.0 + b.0 + c.0 + d.0;
        if sum.is_nan() {
            return Self { low: f64::NEG_INFINITY, high: f64::INFINITY };
        }
        Self { low: a.0.min(b.0).min(c.0.min(d.0)), high: a.1.max(b.1).max(c.1.max(d.1)) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_rounds_is_enclosed_and_what_does_not_stays_a_point() {
        let (exact, third) =
            (Interval::point(0.75) * Interval::point(-0.5), Interval::point(1.0) + Interval::point(1e-20));
        assert_eq!(exact, Interval::point(-0.375));
        assert_eq!((third.low, third.high), (1.0, 1.0_f64.next_up()));
        let mut state = 1u64;
        let mut next = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 34) as i64 - (1 << 29)
        };
        for _ in 0..1000 {
            // Numbers of 49 bits: their product is known exactly as an integer.
            let (a, b) = (next(), next());
            let product =
                Interval::point(a as f64 * 2f64.powi(20) + 1.0) * Interval::point(b as f64 * 2f64.powi(20) + 1.0);
            let wide = ((i128::from(a) << 20) + 1) * ((i128::from(b) << 20) + 1);
            assert!(product.low as i128 <= wide && wide <= product.high as i128, "{a} {b}");
            assert!(product.high - product.low <= product.magnitude() * 2.3e-16);
        }
        let log = Interval::point(2.0).ln();
        assert!(log.low < std::f64::consts::LN_2 && std::f64::consts::LN_2 < log.high);
        let third = Interval::point(3.0).recip();
        assert!((third * Interval::point(3.0)).low <= 1.0 && (third * Interval::point(3.0)).high >= 1.0);
        assert!(Interval { low: -1.0, high: 1.0 }.recip().low.is_nan());
        assert_eq!((Interval::point(f64::INFINITY) * Interval::ZERO).high, f64::INFINITY);
    }
}
