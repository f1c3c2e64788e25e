use std::ops::{Add, BitOr, Div, Mul, Neg, Sub};

use crate::Scalar;
use crate::scalar::derive_operators;

/// Which variables a value depends on, and to what order: a [`Scalar`] that carries sets instead of numbers.
///
/// Running the physics once with `Pattern`s tells which derivatives can be anything but zero, whatever the values.
/// The sets are never too small; they may be too large. Bit `i` stands for variable `i`; variables from 127 on share
/// the last bit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Pattern {
    /// Variables with a non-zero first derivative.
    pub first: u128,
    /// Variables in any non-zero second derivative.
    pub second: u128,
    /// Variables in any non-zero third derivative.
    pub third: u128,
}

impl Pattern {
    /// The variable `index` itself.
    pub fn variable(index: usize) -> Self {
        Self { first: Self::bit(index), second: 0, third: 0 }
    }

    /// The bit that stands for variable `index`.
    pub fn bit(index: usize) -> u128 {
        1 << index.min(127)
    }

    /// Through a curved function of one argument: every order, in every variable.
    fn curved(self) -> Self {
        Self { first: self.first, second: self.first, third: self.first }
    }
}

impl BitOr for Pattern {
    type Output = Self;
    fn bitor(self, other: Self) -> Self {
        Self { first: self.first | other.first, second: self.second | other.second, third: self.third | other.third }
    }
}

#[allow(clippy::suspicious_arithmetic_impl)]
impl Add for Pattern {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        self | other
    }
}

#[allow(clippy::suspicious_arithmetic_impl)]
impl Sub for Pattern {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self | other
    }
}

impl Mul for Pattern {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        let mut product = self | other;
        if self.first != 0 && other.first != 0 {
            product.second = product.first;
            if self.second != 0 || other.second != 0 {
                product.third = product.first;
            }
        }
        product
    }
}

impl Div for Pattern {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        if other.first == 0 { self } else { self * other.curved() }
    }
}

impl Neg for Pattern {
    type Output = Self;
    fn neg(self) -> Self {
        self
    }
}

impl Mul<f64> for Pattern {
    type Output = Self;
    fn mul(self, _: f64) -> Self {
        self
    }
}

impl Div<f64> for Pattern {
    type Output = Self;
    fn div(self, _: f64) -> Self {
        self
    }
}

derive_operators!([] Pattern);

impl Scalar for Pattern {
    fn constant(_: f64) -> Self {
        Self::default()
    }
    fn mul_add(self, factor: Self, term: Self) -> Self {
        self * factor + term
    }
    fn recip(self) -> Self {
        self.curved()
    }
    fn sqrt(self) -> Self {
        self.curved()
    }
    fn sin_cos(self) -> (Self, Self) {
        (self.curved(), self.curved())
    }
    fn exp(self) -> Self {
        self.curved()
    }
    fn ln(self) -> Self {
        self.curved()
    }
    fn select(self, positive: Self, otherwise: Self) -> Self {
        positive | otherwise
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn orders_of_products() {
        let [x, y, z] = [0, 1, 2].map(Pattern::variable);
        assert_eq!((x * 3.0 + 1.0 - y).second, 0);
        let bilinear = x * y + z;
        assert_eq!((bilinear.first, bilinear.second, bilinear.third), (0b111, 0b011, 0));
        assert_eq!((x * y * z).third, 0b111);
        assert_eq!((x * y.sqrt()).third, 0b011);
        assert_eq!((x / Pattern::constant(2.0)).second, 0);
        assert_eq!((Pattern::constant(2.0) / x).third, 0b001);
    }
}
