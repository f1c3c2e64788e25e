use std::fmt::Debug;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// A real number as the physics of a model uses it: a plain `f64`, eight of them in SIMD lanes, a dual number, or a
/// place in a graph.
///
/// Code generic over `Scalar` must not branch on values: use [`Scalar::select`] and what is built on it.
///
/// Example: the [front page](crate).
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
    #[must_use]
    fn mul_add(self, factor: Self, term: Self) -> Self;

    /// `1 / self`.
    #[must_use]
    fn recip(self) -> Self;

    /// Square root. Its derivative at 0 is infinite.
    #[must_use]
    fn sqrt(self) -> Self;

    /// Sine and cosine of an angle in radians.
    fn sin_cos(self) -> (Self, Self);

    /// `e` to the power of `self`.
    #[must_use]
    fn exp(self) -> Self;

    /// Natural logarithm.
    #[must_use]
    fn ln(self) -> Self;

    /// Hyperbolic tangent.
    #[must_use]
    fn tanh(self) -> Self;

    /// `e` to the power of `self`, minus 1: accurate to rounding near 0, too.
    #[must_use]
    fn exp_m1(self) -> Self;

    /// Natural logarithm of `1 + self`: accurate to rounding near 0, too.
    #[must_use]
    fn ln_1p(self) -> Self;

    /// The angle of the point (`x`, `self`), radians in [-pi, pi]. It has no derivative at the origin.
    #[must_use]
    fn atan2(self, x: Self) -> Self;

    /// `positive` where `self > 0`, else `otherwise`.
    #[must_use]
    fn select(self, positive: Self, otherwise: Self) -> Self;

    /// Applies `body` to `start` repeatedly, until the number that it returns beside the next variables is no
    /// longer above 0: at least once, and at most `most` times. With lanes, each lane stops on its own.
    ///
    /// In the derivatives of a graph the result counts as constant: a repetition that solves an equation must be followed by
    /// Newton steps, each of which doubles the number of derivative orders that are correct.
    fn repeat(start: Vec<Self>, most: usize, body: impl Fn(&[Self]) -> (Vec<Self>, Self)) -> Vec<Self> {
        let mut variables = [vec![Self::one()], start].concat();
        for _ in 0..most {
            variables = once_more(variables[0], &variables[1..], &body);
        }
        variables.split_off(1)
    }

    /// Zero.
    #[inline(always)]
    #[must_use]
    fn zero() -> Self {
        Self::constant(0.0)
    }

    /// One.
    #[inline(always)]
    #[must_use]
    fn one() -> Self {
        Self::constant(1.0)
    }

    /// `self * self`.
    #[inline(always)]
    #[must_use]
    fn square(self) -> Self {
        self * self
    }

    /// Sine of an angle in radians.
    #[inline(always)]
    #[must_use]
    fn sin(self) -> Self {
        self.sin_cos().0
    }

    /// Cosine of an angle in radians.
    #[inline(always)]
    #[must_use]
    fn cos(self) -> Self {
        self.sin_cos().1
    }

    /// Absolute value; its derivative at 0 is taken as -1.
    #[inline(always)]
    #[must_use]
    fn abs(self) -> Self {
        self.select(self, -self)
    }

    /// The smooth positive part `(z)_+ = 1/2 (sqrt(z^2 + smoothing^2) + z)` of Tassa et al. 2012.
    ///
    /// With `smoothing` a constant 0 this is `max(z, 0)` except for the undefined derivative at `z = 0`; use
    /// [`Scalar::positive_part`] there.
    #[inline(always)]
    #[must_use]
    fn smooth_positive_part(self, smoothing: Self) -> Self {
        (self.mul_add(self, smoothing * smoothing).sqrt() + self) * 0.5
    }

    /// The positive part rounded off near 0: exactly 0 up to `-smoothing`, exactly `self` from `smoothing` on, and three
    /// times continuously differentiable.
    ///
    /// In between, with `t = 1 + self / smoothing`, it is `smoothing t^4 (t^2 - 6 t + 10) / 32`.
    #[inline(always)]
    #[must_use]
    fn rounded_positive_part(self, smoothing: Self) -> Self {
        let t = self.place_in_rounding(smoothing);
        let bend = t.square().square() * (t * (t - 6.0) + 10.0) * (1.0 / 32.0);
        smoothing.mul_add(bend, (self - smoothing).positive_part())
    }

    /// The derivative of [`Scalar::rounded_positive_part`]: from 0 to 1.
    #[inline(always)]
    #[must_use]
    fn rounded_step(self, smoothing: Self) -> Self {
        let t = self.place_in_rounding(smoothing);
        t.square() * t * (t * (t * 3.0 - 15.0) + 20.0) * (1.0 / 16.0)
    }

    /// `1 + self / smoothing`, within [0, 2].
    #[inline(always)]
    #[must_use]
    fn place_in_rounding(self, smoothing: Self) -> Self {
        let t = (self / smoothing + 1.0).positive_part();
        -(-t + 2.0).positive_part() + 2.0
    }

    /// `max(self, 0)`, with derivative 0 at 0.
    #[inline(always)]
    #[must_use]
    fn positive_part(self) -> Self {
        self.select(self, Self::zero())
    }
}

/// The variables of a [repetition](Scalar::repeat) after one more run, if `running` is above 0; first the next `running`.
pub(crate) fn once_more<S: Scalar>(running: S, variables: &[S], body: &impl Fn(&[S]) -> (Vec<S>, S)) -> Vec<S> {
    let (next, left) = body(variables);
    let goes_on = running.select(left.select(S::one(), S::zero()), S::zero());
    let kept = next.into_iter().zip(variables).map(|(next, &now)| running.select(next, now));
    [goes_on].into_iter().chain(kept).collect()
}

/// One number with the arithmetic of one lane.
///
/// Example: [`dispatch`](crate::dispatch()).
pub trait Single: Scalar + Into<f64> {
    /// The numbers as a slice of this type.
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fused::Fused;
    use crate::graph::{Node, record};
    use crate::pair::Pair;
    use crate::{Dual, Job, LANES, Lanes, Level, dispatch, dispatch_portable};

    /// Every operation on two numbers.
    fn every<S: Scalar>(a: S, b: S) -> Vec<S> {
        let (mut sum, mut difference) = (a, a);
        sum += b;
        difference -= b;
        let ((sin, cos), positive) = (a.sin_cos(), a.square() + 0.3);
        let exact = [a + b, a - b, a * b, -a, a + 0.7, a - 0.7, a * 0.7, a / 0.7, a / b, sum, difference, a.square()];
        let chosen = [a.select(a, b), a.abs(), a.positive_part(), S::zero(), S::one(), S::constant(-2.5)];
        let functions =
            [a.mul_add(b, a), b.recip(), positive.sqrt(), sin, cos, a.sin(), a.cos(), a.exp(), positive.ln()];
        let others = [a.tanh(), a.exp_m1(), positive.ln_1p(), a.atan2(b), a.smooth_positive_part(S::constant(0.1))];
        [&exact[..], &chosen, &functions, &others].concat()
    }

    /// The same by the standard library.
    fn plainly(a: f64, b: f64) -> Vec<f64> {
        let (chosen, positive) = (if a > 0.0 { a } else { b }, a * a + 0.3);
        let smooth = ((a * a + 0.01).sqrt() + a) / 2.0;
        let exact = [a + b, a - b, a * b, -a, a + 0.7, a - 0.7, a * 0.7, a / 0.7, a / b, a + b, a - b, a * a];
        let others = [chosen, a.abs(), if a > 0.0 { a } else { 0.0 }, 0.0, 1.0, -2.5, a * b + a, 1.0 / b];
        let functions = [positive.sqrt(), a.sin(), a.cos(), a.sin(), a.cos(), a.exp(), positive.ln()];
        let rest = [a.tanh(), a.exp_m1(), positive.ln_1p(), f64::atan2(a, b), smooth];
        [&exact[..], &others, &functions, &rest].concat()
    }

    const NUMBERS: [(f64, f64); 5] = [(0.6, 1.7), (-0.8, 0.4), (0.0, -1.3), (2.9, -0.2), (-3.4, -5.0)];

    fn assert_plain(what: &str, (a, b): (f64, f64), found: impl IntoIterator<Item = f64>) {
        let (found, expected): (Vec<f64>, _) = (found.into_iter().collect(), plainly(a, b));
        assert_eq!(found.len(), expected.len());
        for (i, (found, expected)) in found.into_iter().zip(expected).enumerate() {
            let error = (found - expected).abs();
            assert!(error <= 4.0 * f64::EPSILON * expected.abs().max(1.0), "{what} {a} {b}, {i}: {found} {expected}");
        }
    }

    #[test]
    fn every_kind_of_number_computes_the_same() {
        for (a, b) in NUMBERS {
            assert_plain("plain", (a, b), every(a, b));
            assert_plain("fused", (a, b), every(Fused::constant(a), Fused::constant(b)).into_iter().map(f64::from));
            let dual = every(Dual::<f64, 2>::fixed(a), Dual::fixed(b));
            assert!(dual.iter().all(|v| v.tangents == [0.0; 2]));
            assert_plain("dual", (a, b), dual.into_iter().map(|v| v.value));
            let pairs = every(Pair(a, b), Pair(b, a));
            assert_plain("first of a pair", (a, b), pairs.iter().map(|v| v.0));
            if a != 0.0 {
                assert_plain("second of a pair", (b, a), pairs.iter().map(|v| v.1));
            }
            let folded = record(|| {
                let nodes = every(Node::constant(a), Node::constant(b));
                nodes.into_iter().map(|node| node.known().unwrap()).collect::<Vec<f64>>()
            });
            assert_plain("folded", (a, b), folded);
        }
    }

    /// Every operation on lanes with these numbers in turn.
    struct Every;

    impl Job for Every {
        type Output = Vec<[f64; LANES]>;

        #[inline(always)]
        fn run<L: Lanes>(self) -> Self::Output {
            let numbers =
                |second: bool| std::array::from_fn(|i| if second { NUMBERS[i % 5].1 } else { NUMBERS[i % 5].0 });
            every(L::from_array(numbers(false)), L::from_array(numbers(true))).into_iter().map(L::to_array).collect()
        }
    }

    #[test]
    fn lanes_compute_the_same_at_every_level() {
        let levels = Level::ALL.into_iter().filter(|level| level.force());
        let found = levels.map(|level| (format!("{level:?}"), dispatch(Every)));
        for (what, found) in found.chain([("portable".into(), dispatch_portable(Every))]) {
            for lane in 0..LANES {
                assert_plain(&what, NUMBERS[lane % 5], found.iter().map(|values| values[lane]));
            }
        }
    }

    /// Only numbers above 0 count as positive: neither 0 nor NaN.
    #[test]
    fn choices_at_zero_and_where_there_is_no_number() {
        struct Select([f64; LANES]);
        impl Job for Select {
            type Output = [f64; LANES];

            #[inline(always)]
            fn run<L: Lanes>(self) -> [f64; LANES] {
                L::from_array(self.0).select(L::constant(1.0), L::constant(f64::INFINITY)).to_array()
            }
        }
        let signs =
            [0.0, -0.0, f64::NAN, f64::MIN_POSITIVE, -f64::MIN_POSITIVE, f64::INFINITY, f64::NEG_INFINITY, 1e-320];
        let expected = signs.map(|sign| if sign > 0.0 { 1.0 } else { f64::INFINITY });
        for level in Level::ALL.into_iter().filter(|level| level.force()) {
            assert_eq!(dispatch(Select(signs)), expected, "{level:?}");
        }
        assert_eq!(dispatch_portable(Select(signs)), expected);
        for (sign, expected) in signs.into_iter().zip(expected) {
            assert_eq!(sign.select(1.0, f64::INFINITY), expected);
            let fused = Fused::constant(sign).select(Fused::one(), Fused::constant(f64::INFINITY));
            assert_eq!(f64::from(fused), expected);
            let folded = record(|| Node::constant(sign).select(Node::one(), Node::constant(f64::INFINITY)).known());
            assert_eq!(folded, Some(expected));
        }
    }

    #[test]
    fn rounded_parts_follow_their_formulas() {
        type Nested = Dual<Dual<Dual<f64, 1>, 1>, 1>;
        for smoothing in [0.5, 1.0, 3.0] {
            let part = |x: f64| x.rounded_positive_part(smoothing);
            let step = |x: f64| x.rounded_step(smoothing);
            for x in [-10.0, -1.001, -1.0] {
                assert_eq!((part(x * smoothing), step(x * smoothing)), (0.0, 0.0));
            }
            for x in [1.0, 1.001, 10.0] {
                let (found, x) = (part(x * smoothing), x * smoothing);
                assert!((found - x).abs() < 1e-15 * x && (step(x) - 1.0).abs() < 1e-15, "{x}: {found}");
            }
            for i in -19..20 {
                let x = f64::from(i) / 20.0 * smoothing;
                let t = 1.0 + x / smoothing;
                let value = smoothing * t.powi(4) * (t * t - 6.0 * t + 10.0) / 32.0;
                assert!((part(x) - value).abs() < 1e-14 * smoothing, "{x}");
                // The integral of t^2 (2 - t)^2, from 0 to 1.
                let slope = (3.0 * t.powi(5) - 15.0 * t.powi(4) + 20.0 * t.powi(3)) / 16.0;
                assert!((step(x) - slope).abs() < 1e-14, "{x}");
                let dual = Dual::<f64, 1>::variable(x, 0).rounded_positive_part(Dual::constant(smoothing));
                assert!((dual.tangents[0] - slope).abs() < 1e-14, "{x}");
            }
            // Curvature and its slope end at 0 on both sides.
            for x in [-smoothing, smoothing] {
                for x in [x.next_down(), x.next_up()] {
                    let mut seed = Nested::constant(x);
                    seed.value.value.tangents[0] = 1.0;
                    seed.value.tangents[0].value = 1.0;
                    seed.tangents[0].value.value = 1.0;
                    let f = seed.rounded_positive_part(Nested::constant(smoothing));
                    let (second, third) = (f.tangents[0].tangents[0].value, f.tangents[0].tangents[0].tangents[0]);
                    assert!(second.abs() < 1e-12 && third.abs() < 1e-12, "{x}: {second} {third}");
                }
            }
        }
    }
}
