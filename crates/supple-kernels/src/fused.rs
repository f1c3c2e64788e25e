use std::ops::{Add, Div, Mul, Neg, Sub};

use crate::scalar::derive_operators;
use crate::{Scalar, Single, math};

/// A number whose multiply-add is rounded once, like one lane on machines that have the instruction.
///
/// To be used under run-time dispatch only; elsewhere `mul_add` is a slow call.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(transparent)]
pub struct Fused(f64);

impl Single for Fused {
    #[inline(always)]
    fn slice_of(numbers: &mut [f64]) -> &mut [Self] {
        // SAFETY: a `Fused` is laid out as the number that it holds.
        unsafe { &mut *(std::ptr::from_mut(numbers) as *mut [Self]) }
    }
}

impl From<Fused> for f64 {
    #[inline(always)]
    fn from(number: Fused) -> Self {
        number.0
    }
}

macro_rules! operator {
    ($($trait:ident, $method:ident, $op:tt;)*) => {$(
        impl $trait for Fused {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self(self.0 $op other.0)
            }
        }
    )*};
}
operator! { Add, add, +; Sub, sub, -; Mul, mul, *; Div, div, /; }

impl Neg for Fused {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self(-self.0)
    }
}

impl Mul<f64> for Fused {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: f64) -> Self {
        Self(self.0 * other)
    }
}

impl Div<f64> for Fused {
    type Output = Self;
    #[inline(always)]
    fn div(self, other: f64) -> Self {
        Self(self.0 / other)
    }
}

derive_operators!([] Fused);

impl Scalar for Fused {
    #[inline(always)]
    fn constant(value: f64) -> Self {
        Self(value)
    }
    #[inline(always)]
    fn mul_add(self, factor: Self, term: Self) -> Self {
        Self(self.0.mul_add(factor.0, term.0))
    }
    #[inline(always)]
    fn recip(self) -> Self {
        Self(1.0 / self.0)
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(self.0.sqrt())
    }
    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        math::single_sin_cos(self, self.0)
    }
    #[inline(always)]
    fn exp(self) -> Self {
        Self(math::exp(self.0))
    }
    #[inline(always)]
    fn ln(self) -> Self {
        Self(math::ln(self.0))
    }
    #[inline(always)]
    fn tanh(self) -> Self {
        Self(math::tanh(self.0))
    }
    #[inline(always)]
    fn exp_m1(self) -> Self {
        Self(math::exp_m1(self.0))
    }
    #[inline(always)]
    fn ln_1p(self) -> Self {
        Self(math::ln_1p(self.0))
    }
    #[inline(always)]
    fn atan2(self, x: Self) -> Self {
        Self(math::atan2(self.0, x.0))
    }
    #[inline(always)]
    fn select(self, positive: Self, otherwise: Self) -> Self {
        if self.0 > 0.0 { positive } else { otherwise }
    }
}
