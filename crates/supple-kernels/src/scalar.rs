use std::fmt::Debug;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// A real number as the physics of a model sees it: a plain `f64`, eight of them in SIMD lanes, a dual number, or a
/// place in a graph.
///
/// Code generic over `Scalar` must not branch on values: use [`Scalar::select`] and what is built on it.
pub trait Scalar:
    Copy
    + Debug
    + Send
    + Sync
    + 'static
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + Add<f64, Output = Self>
    + Sub<f64, Output = Self>
    + Mul<f64, Output = Self>
    + Div<f64, Output = Self>
    + AddAssign
    + SubAssign
{
    /// The number `value`, with no dependence on anything.
    fn constant(value: f64) -> Self;

    /// `self * factor + term`, rounded once where the machine can.
    fn mul_add(self, factor: Self, term: Self) -> Self;

    /// `1 / self`.
    fn recip(self) -> Self;

    /// Square root. Its derivative at 0 is infinite.
    fn sqrt(self) -> Self;

    /// Sine and cosine of an angle in radians.
    fn sin_cos(self) -> (Self, Self);

    /// `e` to the power of `self`.
    fn exp(self) -> Self;

    /// Natural logarithm.
    fn ln(self) -> Self;

    /// Hyperbolic tangent.
    fn tanh(self) -> Self;

    /// `e` to the power of `self`, less 1: exact to rounding also near 0.
    fn exp_m1(self) -> Self;

    /// Natural logarithm of `1 + self`: exact to rounding also near 0.
    fn ln_1p(self) -> Self;

    /// The angle of the point (`x`, `self`), radians in [-pi, pi]. It has no derivative at the origin.
    fn atan2(self, x: Self) -> Self;

    /// `positive` where `self > 0`, else `otherwise`.
    fn select(self, positive: Self, otherwise: Self) -> Self;

    /// Zero.
    #[inline(always)]
    fn zero() -> Self {
        Self::constant(0.0)
    }

    /// One.
    #[inline(always)]
    fn one() -> Self {
        Self::constant(1.0)
    }

    /// `self * self`.
    #[inline(always)]
    fn square(self) -> Self {
        self * self
    }

    /// Sine of an angle in radians.
    #[inline(always)]
    fn sin(self) -> Self {
        self.sin_cos().0
    }

    /// Cosine of an angle in radians.
    #[inline(always)]
    fn cos(self) -> Self {
        self.sin_cos().1
    }

    /// Absolute value; its derivative at 0 is taken as -1.
    #[inline(always)]
    fn abs(self) -> Self {
        self.select(self, -self)
    }

    /// The smooth positive part `(z)_+ = 1/2 (sqrt(z^2 + smoothing^2) + z)` of Tassa et al. 2012.
    ///
    /// With `smoothing` a constant 0 this is `max(z, 0)` but for the undefined derivative at `z = 0`; use
    /// [`Scalar::positive_part`] there.
    #[inline(always)]
    fn smooth_positive_part(self, smoothing: Self) -> Self {
        (self.mul_add(self, smoothing * smoothing).sqrt() + self) * 0.5
    }

    /// The positive part rounded off near 0: exactly 0 up to `-smoothing`, exactly `self` from `smoothing` on, and three
    /// times continuously differentiable.
    ///
    /// In between, with `t = 1 + self / smoothing`, it is `smoothing t^4 (t^2 - 6 t + 10) / 32`.
    #[inline(always)]
    fn rounded_positive_part(self, smoothing: Self) -> Self {
        let t = self.place_in_rounding(smoothing);
        let bend = t.square().square() * (t * (t - 6.0) + 10.0) * (1.0 / 32.0);
        smoothing.mul_add(bend, (self - smoothing).positive_part())
    }

    /// The derivative of [`Scalar::rounded_positive_part`]: from 0 to 1.
    #[inline(always)]
    fn rounded_step(self, smoothing: Self) -> Self {
        let t = self.place_in_rounding(smoothing);
        t.square() * t * (t * (t * 3.0 - 15.0) + 20.0) * (1.0 / 16.0)
    }

    /// `1 + self / smoothing`, within [0, 2].
    #[inline(always)]
    fn place_in_rounding(self, smoothing: Self) -> Self {
        let t = (self / smoothing + 1.0).positive_part();
        -(-t + 2.0).positive_part() + 2.0
    }

    /// `max(self, 0)`, with derivative 0 at 0.
    #[inline(always)]
    fn positive_part(self) -> Self {
        self.select(self, Self::zero())
    }
}

/// One number with the arithmetic of one lane.
pub trait Single: Scalar + Into<f64> {
    /// Numbers as such.
    fn slice_of(numbers: &mut [f64]) -> &mut [Self];
}

/// Implements the operators with an `f64` on the right, and the assigning ones, from the operators between two `Self`.
macro_rules! derive_operators {
    ([$($generics:tt)*] $name:ty) => {
        impl<$($generics)*> std::ops::Add<f64> for $name {
            type Output = Self;
            #[inline(always)]
            fn add(self, other: f64) -> Self {
                self + <Self as $crate::Scalar>::constant(other)
            }
        }
        impl<$($generics)*> std::ops::Sub<f64> for $name {
            type Output = Self;
            #[inline(always)]
            fn sub(self, other: f64) -> Self {
                self - <Self as $crate::Scalar>::constant(other)
            }
        }
        impl<$($generics)*> std::ops::AddAssign for $name {
            #[inline(always)]
            fn add_assign(&mut self, other: Self) {
                *self = *self + other;
            }
        }
        impl<$($generics)*> std::ops::SubAssign for $name {
            #[inline(always)]
            fn sub_assign(&mut self, other: Self) {
                *self = *self - other;
            }
        }
    };
}
pub(crate) use derive_operators;
