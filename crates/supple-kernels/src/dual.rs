// Loops over `0..K`, not closures: a closure does not inherit the instructions of run-time dispatch.
#![allow(clippy::needless_range_loop)]

use std::ops::{Add, Div, Mul, Neg, Sub};

use crate::Scalar;
use crate::scalar::derive_operators;

/// A value and its derivatives along `K` directions: forward differentiation.
///
/// Nested, `Dual<Dual<S, 1>, K>` carries second derivatives: `tangents[i].tangents[0]` is the mixed one.
///
/// ```
/// use supple_kernels::{Dual, Scalar};
///
/// // The slope of x sin(x) at 2.
/// let x = Dual::<f64, 1>::variable(2.0, 0);
/// let y = x * Scalar::sin(x);
/// assert!((y.tangents[0] - (2.0_f64.sin() + 2.0 * 2.0_f64.cos())).abs() < 1e-15);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dual<S, const K: usize> {
    /// The value.
    pub value: S,
    /// Its derivatives along the `K` directions.
    pub tangents: [S; K],
}

impl<S: Scalar, const K: usize> Dual<S, K> {
    /// A value whose derivative along direction `direction` is 1.
    #[inline(always)]
    pub fn variable(value: S, direction: usize) -> Self {
        let mut tangents = [S::zero(); K];
        tangents[direction] = S::one();
        Self { value, tangents }
    }

    /// A value that depends on no direction.
    #[inline(always)]
    pub fn fixed(value: S) -> Self {
        Self { value, tangents: [S::zero(); K] }
    }

    /// `f(self)`, given the value of `f` there and its slope.
    #[inline(always)]
    fn chain(mut self, value: S, slope: S) -> Self {
        self.value = value;
        for i in 0..K {
            self.tangents[i] = self.tangents[i] * slope;
        }
        self
    }
}

impl<S: Scalar, const K: usize> Add for Dual<S, K> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        let mut tangents = self.tangents;
        for i in 0..K {
            tangents[i] = self.tangents[i] + other.tangents[i];
        }
        Self { value: self.value + other.value, tangents }
    }
}

impl<S: Scalar, const K: usize> Sub for Dual<S, K> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        let mut tangents = self.tangents;
        for i in 0..K {
            tangents[i] = self.tangents[i] - other.tangents[i];
        }
        Self { value: self.value - other.value, tangents }
    }
}

impl<S: Scalar, const K: usize> Mul for Dual<S, K> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        let mut tangents = self.tangents;
        for i in 0..K {
            tangents[i] = self.tangents[i].mul_add(other.value, self.value * other.tangents[i]);
        }
        Self { value: self.value * other.value, tangents }
    }
}

impl<S: Scalar, const K: usize> Div for Dual<S, K> {
    type Output = Self;
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        let reciprocal = other.value.recip();
        let value = self.value * reciprocal;
        let mut tangents = self.tangents;
        for i in 0..K {
            tangents[i] = (self.tangents[i] - value * other.tangents[i]) * reciprocal;
        }
        Self { value, tangents }
    }
}

impl<S: Scalar, const K: usize> Neg for Dual<S, K> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        let mut tangents = self.tangents;
        for i in 0..K {
            tangents[i] = -tangents[i];
        }
        Self { value: -self.value, tangents }
    }
}

impl<S: Scalar, const K: usize> Mul<f64> for Dual<S, K> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: f64) -> Self {
        let mut tangents = self.tangents;
        for i in 0..K {
            tangents[i] = tangents[i] * other;
        }
        Self { value: self.value * other, tangents }
    }
}

impl<S: Scalar, const K: usize> Div<f64> for Dual<S, K> {
    type Output = Self;
    #[inline(always)]
    fn div(self, other: f64) -> Self {
        let mut tangents = self.tangents;
        for i in 0..K {
            tangents[i] = tangents[i] / other;
        }
        Self { value: self.value / other, tangents }
    }
}

derive_operators!([S: Scalar, const K: usize] Dual<S, K>);

impl<S: Scalar, const K: usize> Scalar for Dual<S, K> {
    #[inline(always)]
    fn constant(value: f64) -> Self {
        Self::fixed(S::constant(value))
    }
    #[inline(always)]
    fn mul_add(self, factor: Self, term: Self) -> Self {
        let mut tangents = self.tangents;
        for i in 0..K {
            tangents[i] =
                self.tangents[i].mul_add(factor.value, self.value.mul_add(factor.tangents[i], term.tangents[i]));
        }
        Self { value: self.value.mul_add(factor.value, term.value), tangents }
    }
    #[inline(always)]
    fn recip(self) -> Self {
        let reciprocal = self.value.recip();
        self.chain(reciprocal, -(reciprocal * reciprocal))
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        let root = self.value.sqrt();
        self.chain(root, root.recip() * 0.5)
    }
    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        let (sin, cos) = self.value.sin_cos();
        (self.chain(sin, cos), self.chain(cos, -sin))
    }
    #[inline(always)]
    fn exp(self) -> Self {
        let power = self.value.exp();
        self.chain(power, power)
    }
    #[inline(always)]
    fn ln(self) -> Self {
        self.chain(self.value.ln(), self.value.recip())
    }
    #[inline(always)]
    fn tanh(self) -> Self {
        let tanh = self.value.tanh();
        self.chain(tanh, S::one() - tanh * tanh)
    }
    #[inline(always)]
    fn exp_m1(self) -> Self {
        let power = self.value.exp_m1();
        self.chain(power, power + 1.0)
    }
    #[inline(always)]
    fn ln_1p(self) -> Self {
        self.chain(self.value.ln_1p(), (self.value + 1.0).recip())
    }
    #[inline(always)]
    fn atan2(self, x: Self) -> Self {
        let scale = (self.value * self.value + x.value * x.value).recip();
        let (along, across) = (x.value * scale, self.value * scale);
        let mut tangents = self.tangents;
        for i in 0..K {
            tangents[i] = along * self.tangents[i] - across * x.tangents[i];
        }
        Self { value: self.value.atan2(x.value), tangents }
    }
    #[inline(always)]
    fn select(self, positive: Self, otherwise: Self) -> Self {
        let mut tangents = self.tangents;
        for i in 0..K {
            tangents[i] = self.value.select(positive.tangents[i], otherwise.tangents[i]);
        }
        Self { value: self.value.select(positive.value, otherwise.value), tangents }
    }
}

#[cfg(test)]
mod tests {
    use num_dual::{Dual3_64, DualNum, third_derivative};
    use proptest::prelude::*;

    use super::*;

    /// A function that uses every operation, for our numbers.
    fn ours<S: Scalar>(x: S) -> S {
        let (sin, cos) = (x * 0.7).sin_cos();
        let root = (x * x + 0.3).sqrt();
        let quotient = (sin + 1.5) / (root + cos * 0.1);
        let rest = (-x).exp().mul_add(quotient, (x.square() + 1.0).ln()) - root.recip() / 3.0;
        let angle = (x * x - 1.0).atan2(x * 0.8 + 4.0);
        let bends = (x * 0.4).tanh() * (x * 0.3).exp_m1() + x.square().ln_1p();
        angle + bends + (x - 0.5).select(rest * x, rest) + x.smooth_positive_part(S::constant(0.01)) - (x - 2.0).abs()
    }

    /// The same function, for num-dual's.
    fn oracle(x: Dual3_64) -> Dual3_64 {
        let (sin, cos) = (x * 0.7).sin_cos();
        let root = (x * x + 0.3).sqrt();
        let quotient = (sin + 1.5) / (root + cos * 0.1);
        let rest = (-x).exp() * quotient + (x * x + 1.0).ln() - root.recip() / 3.0;
        let chosen = if x.re > 0.5 { rest * x } else { rest };
        let z = x;
        let smooth = ((z * z + 1e-4).sqrt() + z) * 0.5;
        let kink = if x.re > 2.0 { x - 2.0 } else { -(x - 2.0) };
        // With a positive denominator, the angle is the arctangent of the quotient.
        let angle = ((x * x - 1.0) / (x * 0.8 + 4.0)).atan();
        let bends = (x * 0.4).tanh() * (x * 0.3).exp_m1() + (x * x).ln_1p();
        angle + bends + chosen + smooth - kink
    }

    proptest! {
        #[test]
        fn three_nested_duals_give_three_derivatives(x in -3.0..3.0f64) {
            type Nested = Dual<Dual<Dual<f64, 1>, 1>, 1>;
            let mut seed = Nested::constant(x);
            seed.value.value.tangents[0] = 1.0;
            seed.value.tangents[0].value = 1.0;
            seed.tangents[0].value.value = 1.0;
            let f = ours(seed);
            let (value, first, second, third) = third_derivative(oracle, x);
            let close = |a: f64, b: f64| (a - b).abs() <= 1e-12 * (1.0 + b.abs()) * 1e3;
            prop_assert!(close(f.value.value.value, value));
            prop_assert!(close(f.tangents[0].value.value, first));
            prop_assert!(close(f.tangents[0].tangents[0].value, second));
            prop_assert!(close(f.tangents[0].tangents[0].tangents[0], third));
        }
    }

    #[test]
    fn several_tangents_are_one_tangent_each() {
        let (a, b) = (0.8, -1.3);
        let f = |x: Dual<f64, 2>, y: Dual<f64, 2>| (x * y).sin() + x / (y.square() + 1.0);
        let both = f(Dual::variable(a, 0), Dual::variable(b, 1));
        let step = 1e-6;
        let at = |x: f64, y: f64| f64::sin(x * y) + x / (y * y + 1.0);
        assert!((both.tangents[0] - (at(a + step, b) - at(a - step, b)) / (2.0 * step)).abs() < 1e-9);
        assert!((both.tangents[1] - (at(a, b + step) - at(a, b - step)) / (2.0 * step)).abs() < 1e-9);
    }
}
