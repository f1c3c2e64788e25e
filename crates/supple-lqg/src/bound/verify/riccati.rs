//! Steps of a Riccati equation, many at once, in many digits.

use super::wides::Wides;

/// `X <- Q + A'X (I + G X)^-1 A`, some number of steps at once.
///
/// Best applied to the deviation from a value already reached, where the closed loop `A` is stable: starting from 0 it may
/// grow, and digits are lost.
pub(super) struct Steps<const K: usize> {
    a: Wides<K>,
    g: Wides<K>,
    /// The result of these steps from 0.
    pub from_zero: Wides<K>,
}

impl<const K: usize> Steps<K> {
    /// One step.
    pub fn new(a: Wides<K>, g: Wides<K>, q: Wides<K>) -> Self {
        Self { a, g, from_zero: q }
    }

    /// Twice as many.
    pub fn twice(&self) -> Option<Self> {
        let Self { a, g, from_zero: h } = self;
        let n = a.rows;
        let both = Wides::identity(n).plus(&g.times(h)).solve(&a.beside(g))?;
        let (a_next, g_next) = (both.columns(0, n), both.columns(n, n));
        Some(Self {
            from_zero: h.plus(&a.transpose().times(&h.times(&a_next))).symmetric(),
            g: g.plus(&a.times(&g_next).times(&a.transpose())).symmetric(),
            a: a.times(&a_next),
        })
    }

    /// The exponent of a power of 2 that bounds the closed loop of all steps.
    pub fn growth(&self) -> i64 {
        let entries = self.a.entries.iter().filter(|entry| !entry.is_zero());
        entries.map(|entry| entry.exponent()).max().unwrap_or(i64::MIN)
    }
}
