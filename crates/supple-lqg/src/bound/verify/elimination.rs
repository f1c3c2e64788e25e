//! Eliminates the controls from quadratic forms of states and controls, in many digits.

use super::matrix::{Matrix, by_rows};
use super::wide::Wide;

/// A symmetric matrix: its lower triangle is kept.
#[derive(Clone)]
pub(super) struct Symmetric<const K: usize> {
    pub n: usize,
    entries: Vec<Wide<K>>,
}

impl<const K: usize> Symmetric<K> {
    pub fn from_fn(n: usize, entry: impl Fn(usize, usize) -> Wide<K>) -> Self {
        Self { n, entries: by_rows(&mut (1..=n), &entry) }
    }

    /// The mean of a matrix and its transpose.
    pub fn new(a: &Matrix) -> Self {
        let half = Wide::power_of_two(-1);
        Self::from_fn(a.rows, |i, j| (Wide::new(a.at(i, j)) + Wide::new(a.at(j, i))) * half)
    }

    pub fn at(&self, i: usize, j: usize) -> Wide<K> {
        let (i, j) = if i < j { (j, i) } else { (i, j) };
        self.entries[i * (i + 1) / 2 + j]
    }

    pub fn set(&mut self, i: usize, j: usize, value: Wide<K>) {
        self.entries[i * (i + 1) / 2 + j] = value;
    }

    /// `Tr(self W)`, and the sum of the absolute values.
    pub fn dot(&self, w: &Matrix) -> (Wide<K>, f64) {
        let (mut sum, mut size) = (Wide::ZERO, 0.0);
        for i in 0..self.n {
            for j in 0..self.n {
                if w.at(i, j) != 0.0 {
                    sum = sum + self.at(i, j) * Wide::new(w.at(i, j));
                    size += self.at(i, j).magnitude() * w.at(i, j).abs();
                }
            }
        }
        (sum, size)
    }
}

/// A row of `U` in `U' c U`, with its weight, an entry of the diagonal `c`.
pub(super) struct Row<const K: usize> {
    pub control: usize,
    pub entries: Vec<Wide<K>>,
    pub weight: Wide<K>,
}

/// A control whose price is at most the first share of the terms it is summed from has none; above the second it has one;
/// in between, more digits are needed to decide.
fn thresholds<const K: usize>() -> (f64, f64) {
    (2f64.powi(-48 * K.min(20) as i32), 2f64.powi(-(16 * K.min(60) as i32)))
}

/// Why controls could not be eliminated.
pub(super) enum Elimination {
    Undecided,
    Negative,
}

pub(super) type Eliminated<const K: usize> = (Vec<Row<K>>, Symmetric<K>, f64);

/// Rows with `H - U' c U` free of the controls, most expensive control first; the remainder; and how much is left out for
/// controls without a price.
pub(super) fn eliminated<const K: usize>(
    mut left: Symmetric<K>,
    sizes: &Matrix,
    n: usize,
) -> Result<Eliminated<K>, Elimination> {
    let joint = left.n;
    let (free, priced) = thresholds::<K>();
    let (mut rows, mut dropped) = (Vec::new(), 0.0f64);
    let mut controls: Vec<usize> = (n..joint).collect();
    let share = |left: &Symmetric<K>, k: usize| {
        let (pivot, size) = (left.at(k, k).rounded(), sizes.at(k, k));
        if size > 0.0 { pivot / size } else { 0.0 }
    };
    while let Some(place) =
        (0..controls.len()).max_by(|&a, &b| share(&left, controls[a]).total_cmp(&share(&left, controls[b])))
    {
        let k = controls[place];
        let price = share(&left, k);
        if price <= free {
            break;
        }
        if price <= priced {
            return Err(Elimination::Undecided);
        }
        controls.swap_remove(place);
        let entries: Vec<Wide<K>> = (0..joint)
            .map(|j| if j < n || j == k || controls.contains(&j) { left.at(k, j) } else { Wide::ZERO })
            .collect();
        let weight = entries[k].inverse();
        for i in (0..joint).filter(|&i| i < n || controls.contains(&i)) {
            let by = entries[i] * weight;
            if by.is_zero() {
                continue;
            }
            for j in (0..=i).filter(|&j| j < n || controls.contains(&j)) {
                let taken = by * entries[j];
                if !taken.is_zero() {
                    left.set(i, j, left.at(i, j) - taken);
                }
            }
        }
        rows.push(Row { control: k, entries, weight });
    }
    // Controls without a price have no effect, up to rounding.
    for &k in &controls {
        if share(&left, k) < -priced {
            return Err(Elimination::Negative);
        }
        for j in (0..n).chain(controls.iter().copied()) {
            let size = sizes.at(k, k).sqrt() * sizes.at(j, j).sqrt();
            let entry = left.at(k, j).magnitude();
            let of = if entry == 0.0 { 0.0 } else { entry / size };
            if of.is_nan() || of > free.sqrt() {
                return Err(Elimination::Undecided);
            }
            dropped = dropped.max(of);
        }
    }
    Ok((rows, left, dropped))
}

/// `u = K x` at which every row is 0; 0 for controls without a price.
pub(super) fn gains<const K: usize>(rows: &[Row<K>], n: usize, joint: usize) -> Vec<Vec<Wide<K>>> {
    let mut gains = vec![vec![Wide::ZERO; n]; joint - n];
    for row in rows.iter().rev() {
        let solved = (0..n).map(|j| {
            let others = (n..joint).filter(|&k| k != row.control);
            let sum = others.fold(row.entries[j], |sum, k| sum + row.entries[k] * gains[k - n][j]);
            -sum * row.weight
        });
        gains[row.control - n] = solved.collect();
    }
    gains
}
