use supple_kernels::halt;

/// A finite difference, and how far from the derivative it may be.
///
/// Example: [`compare_gradients`](crate::check::compare_gradients).
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Difference {
    /// The derivative, extrapolated from differences over several steps.
    pub value: f64,
    /// How far it may be from the derivative, given extrapolation and rounding errors.
    pub uncertainty: f64,
}

impl Difference {
    /// The derivative of a constant: exactly 0.
    pub const ZERO: Self = Self { value: 0.0, uncertainty: 0.0 };

    /// The derivative of a sum.
    #[must_use]
    pub fn plus(self, other: Self) -> Self {
        Self { value: self.value + other.value, uncertainty: self.uncertainty + other.uncertainty }
    }

    /// The derivative with respect to a variable that is scaled by `size`.
    #[must_use]
    pub fn over(self, size: f64) -> Self {
        Self { value: self.value / size, uncertainty: self.uncertainty / size.abs() }
    }
}

/// How a function is differenced.
#[derive(Clone, Copy, Debug)]
pub(super) struct Differencing<'a> {
    /// The longest step.
    pub step: f64,
    /// Steps are shortened until every value has this relative accuracy, or until noise prevents it.
    pub goal: f64,
    /// The noise of each value if it is known; otherwise it is measured.
    pub noise: Option<&'a [f64]>,
    /// Number of consecutive values that are sums of terms as large as the largest of them and so share its rounding error.
    pub block: usize,
}

/// Factors on the longest step for a second opinion on a derivative that a difference contradicts: a derivative is wrong if
/// the differences over all these steps contradict it, as those over some may agree with one another by chance.
pub(super) const OTHER_STEPS: [f64; 3] = [0.31, 0.017, 3.3];

/// Rounding error of a function that sums several terms, relative to its value.
const ROUNDING: f64 = 16.0 * f64::EPSILON;

/// Noise is counted as this many standard deviations.
const DEVIATIONS: f64 = 6.0;

/// Factor by which each step is shorter than the one before.
const SHRINK: f64 = 4.0;

/// Maximum number of steps: the last is 4e-6 of the first.
const LEVELS: usize = 10;

/// Maximum number of extrapolation columns: higher ones extrapolate noise.
const COLUMNS: usize = 4;

/// The error of an extrapolation is taken as this many times the change made by its last step.
const SAFETY: f64 = 4.0;

/// Points where noise is measured, as fractions of a span: unevenly spaced, because rounding that repeats at even spacing
/// would go unnoticed.
const PLACES: [f64; 9] = [0.0, 0.0831, 0.2173, 0.3412, 0.4591, 0.6037, 0.7369, 0.8713, 1.0];

/// The span over which noise is measured, relative to the longest step: so short that a smooth function is a polynomial of
/// third degree there.
const SPAN: f64 = 2e-5;

/// Coefficients of that polynomial.
const DEGREES: usize = 4;

/// The noise of each value of a function of one number: the standard deviation from the nearest polynomial of third degree
/// over a short span.
pub(super) fn noise(step: f64, at: &mut impl FnMut(f64) -> Option<Vec<f64>>) -> Option<Vec<f64>> {
    let values: Vec<Vec<f64>> = PLACES.into_iter().map(|place| at(SPAN * step * place)).collect::<Option<_>>()?;
    let basis = polynomials();
    let of = |index: usize| {
        let mut rest = PLACES.map(|_| 0.0);
        rest.iter_mut().zip(&values).for_each(|(rest, value)| *rest = value[index] - values[0][index]);
        basis.iter().for_each(|one| without(&mut rest, one));
        let squares: f64 = rest.iter().map(|rest| rest * rest).sum();
        (squares / (PLACES.len() - DEGREES) as f64).sqrt()
    };
    let noise: Vec<f64> = (0..values.first()?.len()).map(of).collect();
    noise.iter().all(|noise| noise.is_finite()).then_some(noise)
}

/// Polynomials up to third degree at the places, orthonormal.
fn polynomials() -> [[f64; PLACES.len()]; DEGREES] {
    let mut basis = [[0.0; PLACES.len()]; DEGREES];
    for degree in 0..DEGREES {
        let mut one = PLACES.map(|place| place.powi(degree as i32));
        // Orthogonalise twice, because of rounding.
        for known in basis[..degree].iter().chain(&basis[..degree]) {
            without(&mut one, known);
        }
        let length = one.iter().map(|entry| entry * entry).sum::<f64>().sqrt();
        basis[degree] = one.map(|entry| entry / length);
    }
    basis
}

/// Removes the component of a vector along a unit vector.
fn without(vector: &mut [f64], unit: &[f64]) {
    let along: f64 = vector.iter().zip(unit).map(|(a, b)| a * b).sum();
    vector.iter_mut().zip(unit).for_each(|(entry, unit)| *entry -= along * unit);
}

/// Differences on both sides of a point or, if one side cannot be evaluated, on the other.
#[derive(Clone, Copy)]
enum Side {
    Both,
    Above,
    Below,
}

/// The derivative at 0 of a vector-valued function of one number, by Ridders' method: differences over ever shorter steps,
/// extrapolated to a step of 0 in a tableau; for each value, the entry with the least uncertainty from extrapolation and
/// rounding is taken. Points where the function is `None` are left out; the result is `None`
/// if nothing is left, and once a stop is requested.
pub(super) fn differentiate(how: Differencing, mut at: impl FnMut(f64) -> Option<Vec<f64>>) -> Option<Vec<Difference>> {
    let mut at = |h: f64| if halt::is_requested() { None } else { at(h) };
    let measured;
    let noise = match how.noise {
        Some(known) => known,
        None => {
            measured = noise(how.step, &mut at).or_else(|| noise(-how.step, &mut at))?;
            &measured
        }
    };
    [Side::Both, Side::Above, Side::Below].into_iter().find_map(|side| extrapolate(how, side, noise, &mut at))
}

fn extrapolate(
    how: Differencing,
    side: Side,
    noise: &[f64],
    at: &mut impl FnMut(f64) -> Option<Vec<f64>>,
) -> Option<Vec<Difference>> {
    let mut best: Vec<Difference> = Vec::new();
    let mut last: Vec<Vec<f64>> = Vec::new();
    let mut step = how.step;
    for _ in 0..LEVELS {
        let Some((quotients, sizes)) = quotients(side, step, at) else {
            last.clear();
            step /= SHRINK;
            continue;
        };
        let rounding = rounding(how.block, step, &sizes, noise);
        let row = next_row(side, quotients, &last);
        best.resize(rounding.len(), UNKNOWN);
        for (index, best) in best.iter_mut().enumerate() {
            *best = better(*best, entry(&row, &last, index, rounding[index]));
        }
        let known = |(best, rounding): (&Difference, &f64)| {
            best.uncertainty <= how.goal * best.value.abs() || best.uncertainty <= SHRINK * rounding
        };
        if best.iter().zip(&rounding).all(known) {
            break;
        }
        last = row;
        step /= SHRINK;
    }
    (!best.is_empty() && best.iter().all(|best| best.uncertainty.is_finite())).then_some(best)
}

const UNKNOWN: Difference = Difference { value: f64::NAN, uncertainty: f64::INFINITY };

/// A value with at most this relative uncertainty is considered converged: shorter steps that contradict it and have not
/// converged show noise.
const SETTLED: f64 = 1e-4;

/// The better of the results from longer and shorter steps: the less uncertain one, unless they contradict each other; then
/// the one from shorter steps, because these resolve a bend that longer steps miss. If both have converged, to different
/// values, the difference is part of the uncertainty.
fn better(longer: Difference, shorter: Difference) -> Difference {
    let apart = (shorter.value - longer.value).abs();
    let has_settled = |one: Difference| one.uncertainty <= SETTLED * one.value.abs();
    let contradict = apart > shorter.uncertainty + longer.uncertainty;
    match (contradict, has_settled(longer), has_settled(shorter)) {
        (true, true, true) => Difference { uncertainty: shorter.uncertainty + apart, ..shorter },
        (true, false, _) => shorter,
        _ if shorter.uncertainty < longer.uncertainty => shorter,
        _ => longer,
    }
}

/// Difference quotients over a step, and the magnitudes of the values they are computed from.
fn quotients(side: Side, step: f64, at: &mut impl FnMut(f64) -> Option<Vec<f64>>) -> Option<(Vec<f64>, Vec<f64>)> {
    let [above, below] = match side {
        Side::Both => [step, -step],
        Side::Above => [step, 0.0],
        Side::Below => [0.0, -step],
    };
    let (high, low) = (at(above)?, at(below)?);
    let quotients: Vec<f64> = high.iter().zip(&low).map(|(high, low)| (high - low) / (above - below)).collect();
    let sizes = high.iter().zip(&low).map(|(high, low)| high.abs().max(low.abs())).collect();
    quotients.iter().all(|quotient| quotient.is_finite()).then_some((quotients, sizes))
}

/// The error that noise and rounding of the values cause in difference quotients over a step.
fn rounding(block: usize, step: f64, sizes: &[f64], noise: &[f64]) -> Vec<f64> {
    let of = |block: &[f64]| {
        let largest = block.iter().fold(0.0, |largest: f64, size| largest.max(*size));
        std::iter::repeat_n(ROUNDING * largest, block.len())
    };
    let rounded = sizes.chunks(block).flat_map(of);
    rounded.zip(noise).map(|(rounded, noise)| rounded.max(DEVIATIONS * noise) / step).collect()
}

/// The next row of the tableau: quotients first; each further column eliminates one more power of the step.
fn next_row(side: Side, quotients: Vec<f64>, last: &[Vec<f64>]) -> Vec<Vec<f64>> {
    // Two-sided differences have errors in even powers of the step only.
    let power = if matches!(side, Side::Both) { SHRINK * SHRINK } else { SHRINK };
    let mut row = vec![quotients];
    let mut factor = power;
    for (column, last) in last.iter().take(COLUMNS - 1).enumerate() {
        let next = row[column].iter().zip(last).map(|(fine, coarse)| fine + (fine - coarse) / (factor - 1.0));
        let next = next.collect();
        row.push(next);
        factor *= power;
    }
    row
}

/// The least uncertain entry, for one value, of a row of the tableau.
fn entry(row: &[Vec<f64>], last: &[Vec<f64>], index: usize, rounding: f64) -> Difference {
    let mut best = UNKNOWN;
    for column in 1..row.len() {
        let value = row[column][index];
        let changes = [row[column - 1][index], last[column - 1][index]].map(|other| (value - other).abs());
        let uncertainty = SAFETY * changes[0].max(changes[1]) + rounding;
        if uncertainty < best.uncertainty {
            best = Difference { value, uncertainty };
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;

    fn how(step: f64) -> Differencing<'static> {
        Differencing { step, goal: 1e-7, noise: None, block: 1 }
    }

    #[test]
    fn uncertainties_hold_and_steps_fit_the_curvature() {
        // A bend whose width differs from the first step by factors of up to a million.
        for width in [1e-5, 1e-3, 1.0, 1e3] {
            let bend = |x: f64| (1.0 + (x / width).powi(2)).sqrt() + x / width;
            let found = differentiate(how(1e-2), |h| Some(vec![bend(0.3 * width + h)])).unwrap()[0];
            let exact = (0.3 / 1.09f64.sqrt() + 1.0) / width;
            assert!((found.value - exact).abs() <= found.uncertainty, "{width}: {found:?}, not {exact}");
            assert!(found.uncertainty < 2e-5 * exact, "{width}: {found:?}");
        }
    }

    /// Quotients of longer steps agreed by chance, and a derivative that was right counted as wrong.
    #[test]
    fn values_that_contradict_each_other_are_uncertain() {
        let [longer, shorter] = [1.113_639e-3, 1.113_612e-3].map(|value| Difference { value, uncertainty: 4e-9 });
        let found = better(longer, shorter);
        assert_eq!(found.value, shorter.value);
        assert!((2.7e-8..4e-8).contains(&found.uncertainty), "{found:?}");
        // Once more steps agree with the shorter ones, they count.
        let next = better(found, Difference { value: 1.113_611_8e-3, uncertainty: 1e-9 });
        assert_eq!(next.uncertainty, 1e-9);
        // A value that has not converged contradicts nothing.
        let noisy = Difference { value: 1.2e-3, uncertainty: 1e-6 };
        assert_eq!(better(longer, noisy).value, longer.value);
    }

    #[test]
    fn noise_is_part_of_the_uncertainty() {
        let noisy = |h: f64| 1.0 + h + 1e-9 * (1e9 * h).sin();
        let found = differentiate(how(1e-2), |h| Some(vec![noisy(h)])).unwrap()[0];
        assert!((found.value - 1.0).abs() <= found.uncertainty, "{found:?}");
        assert!((1e-9..1e-5).contains(&found.uncertainty), "{found:?}");
        let measured = noise(1e-2, &mut |h| Some(vec![noisy(h), h.exp()])).unwrap();
        assert!((1e-10..1e-8).contains(&measured[0]) && measured[1] < 1e-15, "{measured:?}");
    }

    /// The function is a difference of numbers a million times as large, so its rounding error is larger than its value
    /// suggests, and short steps give the same wrong quotient repeatedly.
    #[test]
    fn rounding_that_is_larger_than_it_looks_is_seen() {
        let cancelling = |z: f64| 250.0 * ((z * z + 1e-4).sqrt() + z);
        let exact = 250.0 * (1.0 - 0.75 / (0.75f64 * 0.75 + 1e-4).sqrt());
        for offset in 0..200 {
            let start = -0.75 - 1e-9 * f64::from(offset);
            // A value that remains uncertain prevents the steps from ending early.
            let unknown = |h: f64| if h == 0.0 { 0.0 } else { (1e12 * h).sin() };
            let found = differentiate(how(1e-4), |h| Some(vec![cancelling(start + h), unknown(h)])).unwrap()[0];
            let error = (found.value - exact).abs();
            assert!(error <= found.uncertainty + 1e-5 * exact, "{offset}: off by {error:e}: {found:?}, not {exact}");
        }
    }

    #[test]
    fn points_that_cannot_be_evaluated_are_left_out() {
        let root = |h: f64| (h >= 0.0).then(|| vec![(1.0 + h).sqrt()]);
        let found = differentiate(how(1e-2), root).unwrap()[0];
        assert!((found.value - 0.5).abs() <= found.uncertainty && found.uncertainty < 1e-5, "{found:?}");
        let near = |h: f64| (h.abs() < 1e-3).then(|| vec![(1.0 + h).sqrt()]);
        let found = differentiate(how(1e-2), near).unwrap()[0];
        assert!((found.value - 0.5).abs() <= found.uncertainty && found.uncertainty < 1e-6, "{found:?}");
        assert_eq!(differentiate(how(1e-2), |_| None), None);
    }
}
