use std::ops::{Add, Div, Mul, Neg, Sub};

use crate::Scalar;
use crate::scalar::derive_operators;

/// Two numbers, or two sets of lanes, processed at once: twice the work for every instruction decoded.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pair<S>(pub S, pub S);

macro_rules! operator {
    ($($trait:ident, $method:ident, $op:tt;)*) => {$(
        impl<S: Scalar> $trait for Pair<S> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self(self.0 $op other.0, self.1 $op other.1)
            }
        }
    )*};
}
operator! { Add, add, +; Sub, sub, -; Mul, mul, *; Div, div, /; }

impl<S: Scalar> Neg for Pair<S> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self(-self.0, -self.1)
    }
}

impl<S: Scalar> Mul<f64> for Pair<S> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: f64) -> Self {
        Self(self.0 * other, self.1 * other)
    }
}

impl<S: Scalar> Div<f64> for Pair<S> {
    type Output = Self;
    #[inline(always)]
    fn div(self, other: f64) -> Self {
        Self(self.0 / other, self.1 / other)
    }
}

derive_operators!([S: Scalar] Pair<S>);

macro_rules! each {
    ($($method:ident($($argument:ident),*);)*) => {$(
        #[inline(always)]
        fn $method(self $(, $argument: Self)*) -> Self {
            Self(self.0.$method($($argument.0),*), self.1.$method($($argument.1),*))
        }
    )*};
}

impl<S: Scalar> Scalar for Pair<S> {
    #[inline(always)]
    fn constant(value: f64) -> Self {
        Self(S::constant(value), S::constant(value))
    }
    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        let (a, b) = (self.0.sin_cos(), self.1.sin_cos());
        (Self(a.0, b.0), Self(a.1, b.1))
    }
    each! {
        mul_add(factor, term);
        recip();
        sqrt();
        exp();
        ln();
        tanh();
        exp_m1();
        ln_1p();
        atan2(x);
        select(positive, otherwise);
    }
}
