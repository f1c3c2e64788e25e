//! Plain numbers as scalars.

use crate::{Scalar, Single, math};

impl Single for f64 {
    #[inline(always)]
    fn slice_of(numbers: &mut [f64]) -> &mut [Self] {
        numbers
    }
}

impl Scalar for f64 {
    #[inline(always)]
    fn constant(value: f64) -> Self {
        value
    }
    #[inline(always)]
    fn mul_add(self, factor: Self, term: Self) -> Self {
        // Plain: the baseline instruction set has no fused form, and the library call is slow.
        self * factor + term
    }
    #[inline(always)]
    fn recip(self) -> Self {
        1.0 / self
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        f64::sqrt(self)
    }
    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        math::single_sin_cos(self, self)
    }
    #[inline(always)]
    fn exp(self) -> Self {
        math::exp(self)
    }
    #[inline(always)]
    fn ln(self) -> Self {
        math::ln(self)
    }
    #[inline(always)]
    fn tanh(self) -> Self {
        math::tanh(self)
    }
    #[inline(always)]
    fn exp_m1(self) -> Self {
        math::exp_m1(self)
    }
    #[inline(always)]
    fn ln_1p(self) -> Self {
        math::ln_1p(self)
    }
    #[inline(always)]
    fn atan2(self, x: Self) -> Self {
        math::atan2(self, x)
    }
    fn repeat(mut variables: Vec<Self>, most: usize, body: impl Fn(&[Self]) -> (Vec<Self>, Self)) -> Vec<Self> {
        let mut runs = 0;
        loop {
            let (next, left) = body(&variables);
            variables = next;
            runs += 1;
            let goes_on = left > 0.0 && runs < most;
            if !goes_on {
                return variables;
            }
        }
    }
    #[inline(always)]
    fn select(self, positive: Self, otherwise: Self) -> Self {
        if self > 0.0 { positive } else { otherwise }
    }
}
