//! The rates at the end of an implicit step with dry friction and contacts.

use supple_kernels::{Ldl, Scalar};

use crate::model::compliance::Push;

/// One dry friction: at the velocity `v = rows rates` it exerts the force `-limit v / sqrt(v' v + smoothing^2)`.
#[derive(Debug)]
pub(super) struct Rubbing<S> {
    /// N m or N, not negative.
    pub limit: S,
    /// rad/s or m/s, above 0.
    pub smoothing: S,
    /// A row per direction, with an entry per position.
    pub rows: Vec<Vec<S>>,
}

/// A step without dry friction and contacts: its final rates are `velocities + lead a`, where `inertia a + needed = 0`.
#[derive(Debug)]
pub(super) struct FreeStep<S> {
    pub inertia: Vec<Vec<S>>,
    pub needed: Vec<S>,
    pub velocities: Vec<S>,
    /// s
    pub lead: S,
}

/// Rates have converged if they change by less than this fraction of speed and smoothing: the next change is its square. Forces
/// of contacts have if they are off by less than its square.
const SETTLED: f64 = 1e-6;

/// Forces of contacts below this, as a share of that at a depth of one smoothing length, need not be known as exactly.
const NO_FORCE: f64 = 1e-6;

/// Rounding of a depth hides forces below this share of it, times stiffness and [`SETTLED`] squared.
const ROUNDED: f64 = 1e-3;

/// Changes whose squared fractions of speed and smoothing add up to less than this are taken in full.
const SMALL: f64 = 1e-4;

/// Greatest number of iterations. Of a million random steps, none took more than 37.
const MOST: usize = 100;

/// The rates `r` at the end of the step with dry friction and contacts (theory, equations R.22 to R.24a): those where
/// `inertia (r - velocities) / lead + needed + sum rows' limit v / sqrt(v' v + smoothing^2) + sum motions push` is 0.
///
/// They minimise a strictly convex function. Newton's method does not converge from afar, as friction hardly
/// changes when sliding but abruptly when sticking. Therefore the friction directions are separate variables, which the
/// method of Chan, Golub and Mulet (1999) updates along with the rates. It starts at the velocities, and shortens a
/// change that ends where the function rises steeply.
pub(super) fn sliding_rates<S: Scalar>(step: &FreeStep<S>, rubbing: &[Rubbing<S>], pushing: &[Push<S>]) -> Vec<S> {
    let count = step.velocities.len();
    let directions = rubbing.iter().flat_map(|Rubbing { smoothing, rows, .. }| {
        let v = products(rows, &step.velocities);
        let scale = speed(&v, *smoothing).recip();
        v.into_iter().map(move |v| v * scale)
    });
    let start = step.velocities.iter().copied().chain(directions).collect();
    let found = S::repeat(start, MOST, |variables| {
        let (rates, directions) = variables.split_at(count);
        improve(step, rubbing, pushing, rates, directions)
    });
    found[..count].to_vec()
}

/// The next rates and directions, and a measure of convergence that is negative once the rates have converged.
fn improve<S: Scalar>(
    step: &FreeStep<S>,
    rubbing: &[Rubbing<S>],
    pushing: &[Push<S>],
    rates: &[S],
    directions: &[S],
) -> (Vec<S>, S) {
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
        // Symmetric and positive semidefinite, as neither the direction nor `v inverse` is longer than 1.
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
    let mut pushes = Vec::with_capacity(pushing.len());
    for push in pushing {
        let rate = dot(&push.motions, rates);
        let (force, slope) = push.at(*lead, rate);
        let (force, slope) = (*lead * force, *lead * slope);
        for (i, &motion) in push.motions.iter().enumerate() {
            missing[i] -= motion * force;
            let weighed = slope * motion;
            matrix[i][..=i].iter_mut().zip(&push.motions).for_each(|(entry, &other)| *entry += weighed * other);
        }
        pushes.push((rate, force, slope));
    }
    let change = Ldl::new(&matrix).solve(missing.clone());
    let falls = dot(&missing, &change);
    // The slope of the convex function along the change: linear but for friction and contacts.
    let (mut left, mut flat, mut bend) = (S::zero(), -falls, falls);
    let mut changes = Vec::with_capacity(rubbing.len());
    for (Rubbing { limit, rows, .. }, (direction, v, inverse)) in rubbing.iter().zip(&pairs) {
        let change = products(rows, &change);
        let (square, turn) = (dot(&change, &change), dot(v, &change) * *inverse);
        left += square * inverse.square();
        flat -= *lead * *limit * turn;
        bend -= *lead * *limit * *inverse * (square - turn * dot(direction, &change));
        changes.push((change, turn));
    }
    let mut pushed = Vec::with_capacity(pushing.len());
    for (push, (rate, force, slope)) in pushing.iter().zip(pushes) {
        let change = dot(&push.motions, &change);
        flat -= force * change;
        bend -= slope * change.square();
        // What the linear model misses at the end, relative to the forces.
        let end = *lead * push.at(*lead, rate + change).0;
        let missed = end - force - slope * change;
        let unseen = push.smoothing * NO_FORCE + (push.depth.abs() + *lead * rate.abs()) * ROUNDED;
        left += missed.abs() / (end + force + *lead * push.stiffness * unseen);
        pushed.push((push, rate, change));
    }
    let slope_at = |share: f64| {
        let mut slope = bend.mul_add(S::constant(share), flat);
        for ((Rubbing { limit, smoothing, .. }, (_, v, _)), (change, _)) in rubbing.iter().zip(&pairs).zip(&changes) {
            let then: Vec<S> = v.iter().zip(change).map(|(&v, &change)| v + change * share).collect();
            slope += *lead * *limit * dot(&then, change) / speed(&then, *smoothing);
        }
        for &(push, rate, change) in &pushed {
            slope += *lead * push.at(*lead, rate + change * share).0 * change;
        }
        slope
    };
    // A change that ends far beyond the minimum is shortened; a small change is taken in full.
    let [half_way, at_end] = [0.5, 1.0].map(slope_at);
    let rises = |slope: S| slope - falls * 0.5;
    let [least, quarter, late] = [1.0 / 32.0, 0.25, 0.75].map(S::constant);
    // A contact may stop a change right after its beginning.
    let early = if pushing.is_empty() { quarter } else { rises(slope_at(0.25)).select(least, quarter) };
    let shortened = rises(at_end).select(half_way.select(early, late), S::one());
    let share = (left - SMALL).select(shortened, S::one());
    let mut next: Vec<S> = rates.iter().zip(&change).map(|(&rate, &change)| share.mul_add(change, rate)).collect();
    for ((direction, v, inverse), (change, turn)) in pairs.into_iter().zip(changes) {
        let turned = (0..v.len()).map(|a| {
            let whole = (v[a] + change[a] - direction[a] * turn) * inverse;
            share.mul_add(whole - direction[a], direction[a])
        });
        let turned: Vec<S> = turned.collect();
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers of a plain linear congruential generator.
    struct Random(u64);

    impl Random {
        /// Evenly within [-1, 1].
        fn even(&mut self) -> f64 {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (self.0 >> 11) as f64 * 2f64.powi(-52) - 1.0
        }

        /// A power of 10 between these.
        fn power(&mut self, from: f64, to: f64) -> f64 {
            10f64.powf(from + (to - from) * (self.even() + 1.0) / 2.0)
        }

        fn evens(&mut self, count: usize) -> Vec<f64> {
            (0..count).map(|_| self.even()).collect()
        }
    }

    /// A step of up to eight positions with friction in joints and on walls, ranging from sticking to
    /// fast sliding, and with contacts, from far apart to deep inside their walls.
    fn random_step(random: &mut Random) -> (FreeStep<f64>, Vec<Rubbing<f64>>, Vec<Push<f64>>) {
        let count = 1 + (random.power(0.0, 0.9) as usize);
        let arms: Vec<Vec<f64>> = (0..count).map(|_| random.evens(count)).collect();
        let own: Vec<f64> = (0..count).map(|_| random.power(-3.0, 0.0)).collect();
        let inertia = (0..count)
            .map(|i| (0..count).map(|j| dot(&arms[i], &arms[j]) + if i == j { own[i] } else { 0.0 }).collect())
            .collect();
        let (speed, force) = (random.power(-5.0, 1.5), random.power(-2.0, 2.5));
        let velocities = random.evens(count).iter().map(|v| v * speed).collect();
        let needed = random.evens(count).iter().map(|f| f * force).collect();
        let mut rubbing = Vec::new();
        for joint in 0..count {
            let mut row = vec![0.0; count];
            row[joint] = 1.0;
            let (limit, smoothing) = (random.power(-2.0, 2.0), random.power(-5.0, -1.0));
            rubbing.push(Rubbing { limit, smoothing, rows: vec![row] });
        }
        for _ in 0..(random.power(0.0, 0.6) as usize) - 1 {
            // Along a wall whose normal is the third direction.
            let rows = vec![random.evens(count), random.evens(count), vec![0.0; count]];
            rubbing.push(Rubbing { limit: random.power(-2.0, 3.0), smoothing: random.power(-4.0, -1.0), rows });
        }
        let lead = random.power(-5.0, -1.0);
        let pushing = (0..(random.power(0.0, 0.7) as usize) - 1).map(|_| Push {
            depth: random.even() * random.power(-6.0, -1.0),
            stiffness: random.power(1.0, 7.0),
            smoothing: random.power(-5.0, -2.0),
            dissipation: random.power(-2.0, 2.0),
            motions: random.evens(count),
        });
        let pushing = pushing.collect();
        (FreeStep { inertia, needed, velocities, lead }, rubbing, pushing)
    }

    /// The residual of the equation at some rates, relative to the largest of its terms.
    fn left(step: &FreeStep<f64>, rubbing: &[Rubbing<f64>], pushing: &[Push<f64>], rates: &[f64]) -> f64 {
        let mut terms: Vec<Vec<f64>> = step.needed.iter().map(|&force| vec![step.lead * force]).collect();
        for (row, terms) in step.inertia.iter().zip(&mut terms) {
            terms.extend(row.iter().zip(rates).map(|(&entry, &rate)| entry * rate));
            terms.extend(row.iter().zip(&step.velocities).map(|(&entry, &v)| -entry * v));
        }
        for Rubbing { limit, smoothing, rows } in rubbing {
            let v = products(rows, rates);
            let force = step.lead * limit / speed(&v, *smoothing);
            for (row, v) in rows.iter().zip(&v) {
                terms.iter_mut().zip(row).for_each(|(terms, &entry)| terms.push(entry * force * v));
            }
        }
        for push in pushing {
            let force = step.lead * push.at(step.lead, dot(&push.motions, rates)).0;
            terms.iter_mut().zip(&push.motions).for_each(|(terms, &entry)| terms.push(entry * force));
        }
        let largest = terms.iter().flatten().fold(0.0, |most: f64, term| most.max(term.abs()));
        terms.iter().map(|terms| terms.iter().sum::<f64>().abs() / largest).fold(0.0, f64::max)
    }

    /// The greatest number of iterations over random steps, checking that all of them converge.
    fn most_runs(count: usize, seed: u64) -> usize {
        let mut random = Random(seed);
        let mut most = 0;
        for _ in 0..count {
            let (step, rubbing, pushing) = random_step(&mut random);
            let rates = sliding_rates(&step, &rubbing, &pushing);
            let off = left(&step, &rubbing, &pushing, &rates);
            assert!(off < 1e-10, "{off:e} left: {step:?} {rubbing:?} {pushing:?}");
            let directions = rubbing.iter().flat_map(|Rubbing { smoothing, rows, .. }| {
                let v = products(rows, &step.velocities);
                let speed = speed(&v, *smoothing);
                v.into_iter().map(move |v| v / speed)
            });
            let mut variables: Vec<f64> = step.velocities.iter().copied().chain(directions).collect();
            let mut runs = 0;
            loop {
                let (now, directions) = variables.split_at(rates.len());
                let (next, left) = improve(&step, &rubbing, &pushing, now, directions);
                variables = next;
                runs += 1;
                if left <= 0.0 {
                    break;
                }
                assert!(runs < MOST, "does not settle: {left} {step:?} {rubbing:?} {pushing:?}");
            }
            most = most.max(runs);
        }
        most
    }

    #[test]
    fn rates_are_found_whatever_sticks_and_slides() {
        let most = most_runs(30_000, 1);
        assert!((10..MOST / 2).contains(&most), "{most}");
    }

    /// Checks the claim at [`MOST`].
    #[test]
    #[ignore = "a million steps"]
    fn a_million_steps() {
        let most = most_runs(1_000_000, 2);
        assert!(most <= MOST / 2, "{most}");
    }
}
