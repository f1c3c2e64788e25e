//! The rates with which an implicit step with dry friction ends.

use supple_kernels::{Ldl, Scalar};

/// What dry friction resists: at the velocity `v = rows rates` with the force `-limit v / sqrt(v' v + smoothing^2)`.
#[derive(Debug)]
pub(super) struct Rubbing<S> {
    /// N m or N, not negative.
    pub limit: S,
    /// rad/s or m/s, above 0.
    pub smoothing: S,
    /// A row for every direction, each by position.
    pub rows: Vec<Vec<S>>,
}

/// A step without dry friction, whose rates at its end are `velocities + lead a` with `inertia a + needed = 0`.
#[derive(Debug)]
pub(super) struct FreeStep<S> {
    pub inertia: Vec<Vec<S>>,
    pub needed: Vec<S>,
    pub velocities: Vec<S>,
    /// s
    pub lead: S,
}

/// Rates that change by less than this share of speed and smoothing are found: the next change is its square.
const SETTLED: f64 = 1e-6;

/// Runs of the method at most. Of a million random steps none took more than 25.
const MOST: usize = 60;

/// The rates `r` at the end of the step with dry friction (theory, equation R.23): those where
/// `inertia (r - velocities) / lead + needed + sum rows' limit v / sqrt(v' v + smoothing^2)` is 0.
///
/// They are where a strictly convex function is least. Newton's method would not find them from afar, as friction hardly
/// changes where it slides and changes at once where it sticks: directions of friction are variables of their own, which the
/// method of Chan, Golub and Mulet (1999) moves beside the rates. It begins at the velocities.
pub(super) fn sliding_rates<S: Scalar>(step: &FreeStep<S>, rubbing: &[Rubbing<S>]) -> Vec<S> {
    let count = step.velocities.len();
    let directions = rubbing.iter().flat_map(|Rubbing { smoothing, rows, .. }| {
        let v = products(rows, &step.velocities);
        let scale = speed(&v, *smoothing).recip();
        v.into_iter().map(move |v| v * scale)
    });
    let start = step.velocities.iter().copied().chain(directions).collect();
    let found = S::repeat(start, MOST, |variables| {
        let (rates, directions) = variables.split_at(count);
        improve(step, rubbing, rates, directions)
    });
    found[..count].to_vec()
}

/// The next rates and directions, and by how much the rates have yet to settle.
fn improve<S: Scalar>(step: &FreeStep<S>, rubbing: &[Rubbing<S>], rates: &[S], directions: &[S]) -> (Vec<S>, S) {
    let FreeStep { inertia, needed, velocities, lead } = step;
    let mut matrix = inertia.clone();
    let gained: Vec<S> = rates.iter().zip(velocities).map(|(&rate, &v)| rate - v).collect();
    let mut missing: Vec<S> =
        inertia.iter().zip(needed).map(|(row, &needed)| -dot(row, &gained) - *lead * needed).collect();
    let mut rest = directions;
    let mut pairs = Vec::with_capacity(rubbing.len());
    for Rubbing { limit, smoothing, rows } in rubbing {
        let (direction, others) = rest.split_at(rows.len());
        rest = others;
        let v = products(rows, rates);
        let inverse = speed(&v, *smoothing).recip();
        let along = *lead * *limit * inverse;
        for (row, &v) in rows.iter().zip(&v) {
            let force = along * v;
            row.iter().zip(&mut missing).for_each(|(&entry, missing)| *missing -= entry * force);
        }
        // Symmetric and never negative, as neither the direction nor `v inverse` is longer than 1.
        let half = inverse * 0.5;
        let weight = |a: usize, b: usize| {
            let own = if a == b { S::one() } else { S::zero() };
            along * (own - half * (direction[a] * v[b] + direction[b] * v[a]))
        };
        let weighed: Vec<Vec<S>> = (0..rows.len())
            .map(|a| {
                let sum = |i: usize| {
                    rows.iter().enumerate().fold(S::zero(), |sum, (b, row)| weight(a, b).mul_add(row[i], sum))
                };
                (0..rates.len()).map(sum).collect()
            })
            .collect();
        for (i, entries) in matrix.iter_mut().enumerate() {
            for (row, weighed) in rows.iter().zip(&weighed) {
                entries[..=i].iter_mut().zip(weighed).for_each(|(entry, &weighed)| *entry += row[i] * weighed);
            }
        }
        pairs.push((direction, v, inverse));
    }
    let change = Ldl::new(&matrix).solve(missing);
    let mut left = S::zero();
    let mut next: Vec<S> = rates.iter().zip(&change).map(|(&rate, &change)| rate + change).collect();
    for (Rubbing { rows, .. }, (direction, v, inverse)) in rubbing.iter().zip(pairs) {
        let change = products(rows, &change);
        left += dot(&change, &change) * inverse.square();
        let turn = dot(&v, &change) * inverse;
        let turned: Vec<S> = (0..rows.len()).map(|a| (v[a] + change[a] - direction[a] * turn) * inverse).collect();
        let scale = ((dot(&turned, &turned) - 1.0).positive_part() + 1.0).sqrt().recip();
        next.extend(turned.iter().map(|&entry| entry * scale));
    }
    (next, left - SETTLED * SETTLED)
}

fn dot<S: Scalar>(a: &[S], b: &[S]) -> S {
    a.iter().zip(b).fold(S::zero(), |sum, (&a, &b)| a.mul_add(b, sum))
}

fn products<S: Scalar>(rows: &[Vec<S>], vector: &[S]) -> Vec<S> {
    rows.iter().map(|row| dot(row, vector)).collect()
}

/// `sqrt(v' v + smoothing^2)`
fn speed<S: Scalar>(v: &[S], smoothing: S) -> S {
    (dot(v, v) + smoothing.square()).sqrt()
}
