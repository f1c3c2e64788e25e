use std::ops::{Add, Div, Mul, Neg, Sub};

use supple_kernels::math;

/// An interval. Arithmetic encloses all results; undefined results give minus to plus infinity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Range {
    pub lower: f64,
    pub upper: f64,
}

impl Range {
    /// All numbers.
    pub const ALL: Self = Self { lower: f64::NEG_INFINITY, upper: f64::INFINITY };

    /// The smallest interval containing some numbers.
    fn around(numbers: &[f64]) -> Self {
        if numbers.iter().any(|number| number.is_nan()) {
            return Self::ALL;
        }
        let lower = numbers.iter().copied().fold(f64::INFINITY, f64::min);
        let upper = numbers.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        Self { lower, upper }
    }

    /// The range of an increasing function.
    fn rising(self, function: impl Fn(f64) -> f64) -> Self {
        Self::around(&[function(self.lower), function(self.upper)])
    }

    pub fn sqrt(self) -> Self {
        self.rising(f64::sqrt)
    }

    pub fn exp(self) -> Self {
        self.rising(math::exp)
    }

    pub fn ln(self) -> Self {
        self.rising(math::ln)
    }

    pub fn tanh(self) -> Self {
        self.rising(math::tanh)
    }

    /// The range of a sine or cosine.
    pub fn of_circle(self) -> Self {
        Self { lower: -1.0, upper: 1.0 }
    }

    /// A power with a constant exponent.
    pub fn power(self, exponent: f64) -> Self {
        let ends = [math::powf(self.lower, exponent), math::powf(self.upper, exponent)];
        let whole = exponent.fract() == 0.0;
        let crosses = self.lower <= 0.0 && self.upper >= 0.0;
        match (whole, crosses) {
            (false, _) if self.lower < 0.0 => Self::ALL,
            (_, true) if exponent < 0.0 => Self::ALL,
            (true, true) if exponent % 2.0 == 0.0 => Self::around(&[ends[0], ends[1], math::powf(0.0, exponent)]),
            _ => Self::around(&ends),
        }
    }
}

impl Neg for Range {
    type Output = Self;
    fn neg(self) -> Self {
        Self { lower: -self.upper, upper: -self.lower }
    }
}

impl Add for Range {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self::around(&[self.lower + other.lower, self.upper + other.upper])
    }
}

impl Sub for Range {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl Mul for Range {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        let [a, b, c, d] = [self.lower, self.upper, other.lower, other.upper];
        Self::around(&[a * c, a * d, b * c, b * d])
    }
}

impl Div for Range {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        if other.lower <= 0.0 && other.upper >= 0.0 {
            return Self::ALL;
        }
        self * Self::around(&[1.0 / other.lower, 1.0 / other.upper])
    }
}
