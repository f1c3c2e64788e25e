//! Elementary functions in plain Rust, so that results do not depend on the machine's C library, which selects code by
//! processor: within one instruction level, the same bits everywhere.
//!
//! Sine and cosine are written over any [`Scalar`], and so run in lanes; the others are those of the crate `libm`.

use crate::Scalar;

pub use libm::{
    acos, asin, atan, atan2, cos, exp, expm1 as exp_m1, hypot, log as ln, log1p as ln_1p, log2, log10, pow as powf,
    sin, sincos as sin_cos, tan, tanh,
};

/// Angles up to here, in radians, are reduced in lanes; larger ones by [`libm`], one at a time.
pub(crate) const NEAR: f64 = 1e5;

/// 2^52 + 2^51: adding and subtracting it rounds to the nearest integer.
const ROUNDER: f64 = 6_755_399_441_055_744.0;

/// pi/2 in three parts of 33 bits, and what is left.
const HALF_TURN: [f64; 4] =
    [1.570_796_326_734_125_6, 6.077_100_506_303_966e-11, 2.022_266_248_711_166_5e-21, 8.478_427_660_368_9e-32];

/// Coefficients of sine, from the highest (FreeBSD's `k_sin.c`).
const SINE: [f64; 6] = [
    1.589_690_995_211_55e-10,
    -2.505_076_025_340_686_3e-8,
    2.755_731_370_707_006_8e-6,
    -1.984_126_982_985_795e-4,
    8.333_333_333_322_49e-3,
    -1.666_666_666_666_663_2e-1,
];

/// Coefficients of cosine, from the highest (FreeBSD's `k_cos.c`).
const COSINE: [f64; 6] = [
    -1.135_964_755_778_819_5e-11,
    2.087_572_321_298_175e-9,
    -2.755_731_435_139_066_3e-7,
    2.480_158_728_947_673e-5,
    -1.388_888_888_887_411e-3,
    4.166_666_666_666_66e-2,
];

/// Sine and cosine of angles up to [`NEAR`], each to an ulp.
///
/// `x = k pi/2 + r` with `r` in two parts, `|r| <= pi/4`; polynomials of `r`; and the quadrant `k mod 4`.
#[inline(always)]
pub(crate) fn near_sin_cos<S: Scalar>(x: S) -> (S, S) {
    let rounder = S::constant(ROUNDER);
    let turns = (x * S::constant(std::f64::consts::FRAC_2_PI) + rounder) - rounder;
    let (first, second) = (turns * S::constant(HALF_TURN[0]), turns * S::constant(HALF_TURN[1]));
    let (third, rest) = (turns * S::constant(HALF_TURN[2]), turns * S::constant(HALF_TURN[3]));
    // The rounding error of each difference is kept.
    let a = x - first;
    let b = a - second;
    let lost_b = (a - b) - second;
    let c = b - third;
    let lost_c = (b - c) - third;
    let less = rest - lost_b - lost_c;
    let r = c - less;
    let tail = (c - r) - less;

    let z = r * r;
    // r + r^3 p(z) + tail (1 - z / 2), and 1 - z / 2 + z^2 q(z) - r tail.
    let half = z * S::constant(0.5);
    let cube = z * r;
    let sine = r + (cube * polynomial(z, SINE) + (tail - half * tail));
    let whole = S::one() - half;
    let cosine = whole + (((S::one() - whole) - half) + (z * (z * polynomial(z, COSINE)) - r * tail));

    // The residue of k modulo 4, in -2 ..= 2.
    let quarters = (turns * S::constant(0.25) + rounder) - rounder;
    let place = turns - quarters * S::constant(4.0);
    let is_odd = S::constant(0.5) - (place * place - S::one()).square();
    let (left, right) = (place - S::constant(0.5), place + S::constant(0.5));
    let sin = is_odd.select(cosine, sine);
    let cos = is_odd.select(sine, cosine);
    ((left * left - S::one()).select(-sin, sin), (right * right - S::one()).select(-cos, cos))
}

/// `c_0 z^5 + .. + c_5`
#[inline(always)]
fn polynomial<S: Scalar>(z: S, coefficients: [f64; 6]) -> S {
    let mut sum = S::constant(coefficients[0]);
    for coefficient in &coefficients[1..] {
        sum = sum.mul_add(z, S::constant(*coefficient));
    }
    sum
}

/// Sine and cosine of `x`, whose number is `value`, with the arithmetic of `S`.
#[inline(always)]
pub(crate) fn single_sin_cos<S: Scalar>(x: S, value: f64) -> (S, S) {
    if value.abs() <= NEAR {
        return near_sin_cos(x);
    }
    let (sin, cos) = sin_cos(value);
    (S::constant(sin), S::constant(cos))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ulps(found: f64, expected: f64) -> f64 {
        (found - expected).abs() / (expected.abs() * f64::EPSILON).max(f64::MIN_POSITIVE)
    }

    fn assert_near(x: f64) {
        let (sin, cos) = single_sin_cos(x, x);
        let (s, c) = sin_cos(x);
        // Each of the two is within an ulp of the truth.
        assert!(ulps(sin, s) <= 2.0 && ulps(cos, c) <= 2.0, "{x:e}: {sin:e} for {s:e}, {cos:e} for {c:e}");
    }

    #[test]
    fn sine_and_cosine_over_their_range() {
        for i in -100_000..=100_000 {
            assert_near(f64::from(i) * 1e-4);
            assert_near(f64::from(i) * 0.999_9);
        }
        // Doubles next to multiples of pi/2.
        for k in 1..60_000 {
            let x = f64::from(k) * std::f64::consts::FRAC_PI_2;
            [x, x.next_up(), x.next_down(), -x].into_iter().for_each(assert_near);
        }
        for power in -1074..0 {
            let x = 2f64.powi(power);
            assert_near(x);
            assert_eq!(single_sin_cos(-x, -x).0, -single_sin_cos(x, x).0);
        }
    }

    #[test]
    fn sine_and_cosine_at_the_edges() {
        assert_eq!(single_sin_cos(0.0, 0.0), (0.0, 1.0));
        assert_eq!(single_sin_cos(-0.0, -0.0), (0.0, 1.0));
        for x in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            let (sin, cos) = single_sin_cos(x, x);
            assert!(sin.is_nan() && cos.is_nan());
        }
        for x in [NEAR, NEAR.next_up(), 1e22, f64::MAX] {
            assert_near(x);
        }
    }

    /// Both use the same formulas, in different order: fewer than one in a hundred of the angles in between differ in bits,
    /// and none next to multiples of pi/2, where errors of the reduction would show.
    #[test]
    fn sine_and_cosine_have_the_bits_of_one_by_one() {
        let differ = |x: f64| {
            let ((sin, cos), (s, c)) = (single_sin_cos(x, x), sin_cos(x));
            [sin != s, cos != c].map(usize::from)
        };
        for step in [1e-4, 0.999_9] {
            let counts = (-100_000..=100_000).map(|i| differ(f64::from(i) * step));
            let [sines, cosines] = counts.fold([0, 0], |sum, one| [sum[0] + one[0], sum[1] + one[1]]);
            assert!(sines < 2000 && cosines < 2000, "{sines} sines and {cosines} cosines of 200 001");
        }
        for k in 1..60_000 {
            let x = f64::from(k) * std::f64::consts::FRAC_PI_2;
            for x in [x, x.next_up(), x.next_down(), -x] {
                assert_eq!(differ(x), [0, 0], "{x:e}");
            }
        }
    }
}
