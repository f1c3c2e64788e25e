//! Extended-precision numbers, for computations in which rounding to 53 bits would leave no correct digits.

use std::ops::{Add, Mul, Neg, Sub};

/// `± 0.m 2^exponent` with a mantissa `m` of `64 K` bits, whose leading bit is set, except for 0.
///
/// A product is truncated towards 0, by less than `2^(2 - 64 K)` of its value. The error of a sum is less than that share of
/// the sum of the absolute values of its terms.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Wide<const K: usize> {
    negative: bool,
    exponent: i64,
    /// The least significant word first.
    words: [u64; K],
}

impl<const K: usize> Wide<K> {
    pub const ZERO: Self = Self { negative: false, exponent: 0, words: [0; K] };

    /// Exactly this number, which must be finite.
    pub fn new(value: f64) -> Self {
        let bits = value.to_bits();
        let (exponent, fraction) = ((bits >> 52 & 0x7ff) as i64, bits & ((1 << 52) - 1));
        let mantissa = if exponent == 0 { fraction } else { fraction | 1 << 52 };
        if mantissa == 0 {
            return Self::ZERO;
        }
        let shift = mantissa.leading_zeros();
        let mut words = [0; K];
        words[K - 1] = mantissa << shift;
        // value = mantissa 2^(exponent - 1075), and mantissa = 0.words 2^(64 - shift).
        Self { negative: value < 0.0, exponent: exponent.max(1) - 1075 + 64 - i64::from(shift), words }
    }

    /// `2^exponent`.
    pub fn power_of_two(exponent: i64) -> Self {
        let mut words = [0; K];
        words[K - 1] = 1 << 63;
        Self { negative: false, exponent: exponent + 1, words }
    }

    pub fn is_zero(self) -> bool {
        self.words[K - 1] == 0
    }

    pub fn is_positive(self) -> bool {
        !self.negative && !self.is_zero()
    }

    /// The exponent: the absolute value is below `2^exponent`; 0 for the number 0.
    pub fn exponent(self) -> i64 {
        self.exponent
    }

    pub fn abs(self) -> Self {
        Self { negative: false, ..self }
    }

    /// The floating-point number nearest to it; 0 or infinite beyond their range.
    pub fn rounded(self) -> f64 {
        let sign = if self.negative { -1.0 } else { 1.0 };
        // The lower words break ties, where the first word is half-way between two floating-point numbers.
        let rest = u64::from(self.words[..K - 1].iter().any(|&word| word != 0));
        sign * scaled((self.words[K - 1] | rest) as f64, self.exponent - 64)
    }

    /// A floating-point number that is at least the absolute value.
    pub fn magnitude(self) -> f64 {
        if self.is_zero() { 0.0 } else { self.rounded().abs().next_up().next_up() }
    }

    /// Floating-point bounds on all numbers within `slack` of it.
    pub fn around(self, slack: f64) -> (f64, f64) {
        let middle = self.rounded();
        // What is cut off is below the last place.
        let radius = (middle.abs() * (2.0 * f64::EPSILON) + slack).next_up() + f64::MIN_POSITIVE;
        ((middle - radius).next_down(), (middle + radius).next_up())
    }

    /// Approximately `1 / self`, for a number other than 0; the error is a few units in the last place.
    pub fn inverse(self) -> Self {
        let of_mantissa = Self { negative: false, exponent: 0, ..self };
        // Between 1 and 2.
        let mut inverse = Self::new(of_mantissa.rounded().recip());
        let two = Self::new(2.0);
        let mut digits = 50;
        while digits < 64 * K {
            inverse = inverse * (two - of_mantissa * inverse);
            digits *= 2;
        }
        Self { negative: self.negative, exponent: inverse.exponent - self.exponent, ..inverse }
    }

    /// Compares the absolute values.
    fn compare(&self, other: &Self) -> std::cmp::Ordering {
        match (self.is_zero(), other.is_zero()) {
            (true, true) => std::cmp::Ordering::Equal,
            (true, false) => std::cmp::Ordering::Less,
            (false, true) => std::cmp::Ordering::Greater,
            (false, false) => {
                self.exponent.cmp(&other.exponent).then_with(|| self.words.iter().rev().cmp(other.words.iter().rev()))
            }
        }
    }

    /// The words moved down by some bits.
    fn shifted_down(&self, bits: u64) -> [u64; K] {
        let (by, rest) = ((bits / 64) as usize, bits % 64);
        let mut out = [0; K];
        for (i, word) in out.iter_mut().enumerate().take(K.saturating_sub(by)) {
            let high = if i + by + 1 < K { self.words[i + by + 1] } else { 0 };
            let low = self.words[i + by];
            *word = if rest == 0 { low } else { low >> rest | high << (64 - rest) };
        }
        out
    }

    /// Shifted so that the leading bit is set.
    fn normalised(negative: bool, mut exponent: i64, words: [u64; K]) -> Self {
        let Some(first) = (0..K).rev().find(|&i| words[i] != 0) else { return Self::ZERO };
        let (by, rest) = (K - 1 - first, words[first].leading_zeros());
        exponent -= 64 * by as i64 + i64::from(rest);
        let mut out = [0; K];
        for i in (by..K).rev() {
            let low = if i > by { words[i - by - 1] } else { 0 };
            let high = words[i - by];
            out[i] = if rest == 0 { high } else { high << rest | low >> (64 - rest) };
        }
        Self { negative, exponent, words: out }
    }
}

/// `value 2^exponent`.
fn scaled(value: f64, exponent: i64) -> f64 {
    match exponent {
        ..-1200 => 0.0,
        1200.. => value * f64::INFINITY,
        // In two steps, so that neither factor is out of range.
        _ => {
            let half = exponent / 2;
            value * 2f64.powi(half as i32) * 2f64.powi((exponent - half) as i32)
        }
    }
}

impl<const K: usize> Neg for Wide<K> {
    type Output = Self;
    fn neg(self) -> Self {
        Self { negative: !self.negative, ..self }
    }
}

impl<const K: usize> Add for Wide<K> {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        let (large, small) = if self.compare(&other).is_lt() { (other, self) } else { (self, other) };
        if small.is_zero() {
            return large;
        }
        let distance = (large.exponent - small.exponent) as u64;
        if distance >= 64 * K as u64 {
            return large;
        }
        let shifted = small.shifted_down(distance);
        let mut words = large.words;
        if large.negative == small.negative {
            let mut carry = false;
            for (word, other) in words.iter_mut().zip(shifted) {
                let (sum, first) = word.overflowing_add(other);
                let (sum, second) = sum.overflowing_add(u64::from(carry));
                (*word, carry) = (sum, first | second);
            }
            if !carry {
                return Self { words, ..large };
            }
            let mut halved = Self { words, ..large }.shifted_down(1);
            halved[K - 1] |= 1 << 63;
            return Self { words: halved, exponent: large.exponent + 1, ..large };
        }
        let mut borrow = false;
        for (word, other) in words.iter_mut().zip(shifted) {
            let (left, first) = word.overflowing_sub(other);
            let (left, second) = left.overflowing_sub(u64::from(borrow));
            (*word, borrow) = (left, first | second);
        }
        Self::normalised(large.negative, large.exponent, words)
    }
}

impl<const K: usize> Sub for Wide<K> {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl<const K: usize> Mul for Wide<K> {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        if self.is_zero() || other.is_zero() {
            return Self::ZERO;
        }
        let (mut low, mut high) = ([0u64; K], [0u64; K]);
        for (i, &a) in self.words.iter().enumerate() {
            // Numbers converted from `f64` have few non-zero words.
            if a == 0 {
                continue;
            }
            let mut carry = 0u128;
            for (j, &b) in other.words.iter().enumerate() {
                let slot = if i + j < K { &mut low[i + j] } else { &mut high[i + j - K] };
                let sum = u128::from(a) * u128::from(b) + u128::from(*slot) + carry;
                *slot = sum as u64;
                carry = sum >> 64;
            }
            high[i] = carry as u64;
        }
        let (negative, exponent) = (self.negative != other.negative, self.exponent + other.exponent);
        if high[K - 1] >> 63 == 1 {
            return Self { negative, exponent, words: high };
        }
        // The product of two halves or more is at least a quarter.
        let mut words = [0; K];
        for i in 0..K {
            let below = if i > 0 { high[i - 1] } else { low[K - 1] };
            words[i] = high[i] << 1 | below >> 63;
        }
        Self { negative, exponent: exponent - 1, words }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn numbers() -> impl Iterator<Item = f64> {
        let mut state = 1u64;
        std::iter::from_fn(move || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            Some(((state >> 11) as f64 - 2f64.powi(52)) * 2f64.powi((state & 63) as i32 - 80))
        })
    }

    #[test]
    fn numbers_are_kept_and_rounded_back() {
        for value in numbers().take(1000).chain([0.0, -1.0, f64::MIN_POSITIVE, 5e-324, f64::MAX, 2f64.powi(-1060)]) {
            assert_eq!(Wide::<3>::new(value).rounded(), value);
            assert!(Wide::<3>::new(value).magnitude() >= value.abs());
        }
        assert_eq!(Wide::<2>::power_of_two(-7).rounded(), 2f64.powi(-7));
        assert_eq!((Wide::<2>::power_of_two(-5000) * Wide::new(3.0)).rounded(), 0.0);
    }

    /// Sums and products of three numbers are exact with this many bits, in any order.
    #[test]
    fn sums_and_products_are_exact_while_the_digits_last() {
        let all: Vec<f64> = numbers().take(300).collect();
        for triple in all.windows(3) {
            let [a, b, c] = [triple[0], triple[1], triple[2]].map(Wide::<8>::new);
            assert_eq!((a + b) + c, a + (b + c));
            assert_eq!((a * b) * c, a * (b * c));
            assert_eq!((a + b) * c, a * c + b * c);
            assert_eq!((a + b) - b, a);
            assert_eq!((a * b).rounded(), triple[0] * triple[1]);
            assert!((a - a).is_zero() && !(a - b).is_zero());
        }
    }

    #[test]
    fn inverses_have_all_digits() {
        fn off<const K: usize>(value: f64) -> f64 {
            let wide = Wide::<K>::new(value);
            (wide * wide.inverse() - Wide::new(1.0)).rounded().abs()
        }
        for value in numbers().take(100) {
            assert!(off::<2>(value) < 2f64.powi(-120), "{value}");
            assert!(off::<5>(value) < 2f64.powi(-312), "{value}");
            assert!(off::<16>(value) < 2f64.powi(-1016), "{value}");
        }
    }
}
