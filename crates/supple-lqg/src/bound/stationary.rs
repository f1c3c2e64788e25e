//! The least directed information per step of a time-invariant system.

use supple_kernels::{Matrices, halt, math};

use super::free::{matrix, of_matrix};
use super::horizon::Stationary;
use super::interior::search;
use super::local::nats;
use super::minimum::{LEAST_MARGIN, LOST, SHARE, budget, certified, finer, is_coarse};
use super::nearby::Nearby;
use super::proof::{Achieved, Attempt, Lower, Proof};
use super::reduce::{Chain, Stage, measured_root, reach};
use super::sensitivity::Worth;
use super::sensor::sensors;
use super::settings::{BoundSettings, BoundStatus};
use super::settle::settled;
use super::solution::StationaryMinimum;
use super::start::{COMPLEMENTARITIES, inside, once_measured, search_from};
use super::subspace::{GROWTH, complement, invariant_hull, observed, range, seen_states, unit_columns, unstable};
use super::units::InUnits;
use super::verify::Matrix;
use super::virtual_sensor::VirtualSensor;
use super::witness::{Witness, WitnessStep};
use super::zeros::{lasting, moduli};
use crate::Error;
use crate::dense::{Dense, Svd, cholesky, congruence, dense, store, svd, symmetric};
use crate::given::{PROCESS, root_of};

/// Steps of the filter that scales coordinates, in addition to two for every state.
const SCALING: usize = 30;

/// Filter steps taken from the result of doubling.
const POLISHING: usize = 10;

/// The largest factor by which a sensor's precision is raised to keep the cost limit, and the bisection steps to find it.
const MOST_PRECISION: f64 = 1e6;
const PRECISION_STEPS: usize = 20;

/// The least factor by which precision is lowered, if the sensor costs less than the budget by more than this share of it.
const LEAST_PRECISION: f64 = 1e-9;
const SPARE: f64 = 1e-3;

/// Shares of the budget at which to repeat the search if the result at the budget itself is uncertain:
/// information that suffices for a lower cost suffices for a higher one.
const SHARES: [f64; 6] = [0.5, 0.1, 1e-2, 1e-3, 1e-4, 1e-6];

/// The factor by which the cost grows from one warm-started search to the next.
const FARTHER: f64 = 2.0;

/// The number of states from which few searches are repeated, because each takes long.
const MANY: usize = 20;
const FEW: usize = 1;

/// The minimum directed information per step that any sensors and any controller need to keep an expected cost per step
/// of `cost` (theory, equation L.15), with a proved lower bound that accounts for rounding.
///
/// States that cost nothing, now or later, are left out: their covariances in the result are those without a sensor
/// where these exist, and 0 otherwise.
///
/// # Errors
/// As [`super::minimum_information`].
///
/// Example: the [front page](crate).
pub fn stationary_minimum(
    system: &Stationary,
    cost: f64,
    settings: &BoundSettings,
) -> Result<StationaryMinimum, Error> {
    settings.check()?;
    system.check()?;
    if let Some((fewer, rows, kept)) = system.fewer() {
        return Ok(stationary_minimum(&fewer, cost, settings)?.among_all(&rows, &kept));
    }
    // If no information is needed, the least cost itself can be achieved.
    let stage = reduce(system, 1.0)?;
    if let Some(covariance) = without_sensors(&stage) {
        let excess = stage.price.dot(&covariance);
        if excess <= cost - system.base_cost + LEAST_MARGIN * system.base_cost.abs() {
            return Ok(free(&congruence(&stage.basis, &covariance), system.base_cost + excess));
        }
    }
    let budget = budget(cost, system.base_cost)?;
    let mut seeking = Seeking { system, cost, budget, settings, best: Err(Error::Stopped), near: None };
    seeking.at(1.0, &COMPLEMENTARITIES);
    if seeking.best.as_ref().is_ok_and(|found| is_coarse(found.nats, settings)) {
        seeking.at(1.0, &COMPLEMENTARITIES);
    }
    seeking.search_elsewhere(if stage.price.nrows() > MANY { FEW } else { usize::MAX });
    let best = seeking.best;
    if halt::is_requested() {
        return Err(Error::Stopped);
    }
    let mut best = best?;
    if best.lower_nats == 0.0 && best.nats > 0.0 && matches!(best.proof, Proof::Proved { .. }) && !best.is_tight() {
        best.proof = Proof::NotProved { reason: LOST.into() };
    }
    Ok(best)
}

/// A search for the minimum from several starting points.
struct Seeking<'a> {
    system: &'a Stationary,
    cost: f64,
    budget: f64,
    settings: &'a BoundSettings,
    /// The best bounds so far, or why there are none.
    best: Result<StationaryMinimum, Error>,
    /// An iterate of the last search, for a warm start.
    near: Option<Nearby>,
}

impl Seeking<'_> {
    /// Searches with a share of the budget from these starts; returns whether the search converged.
    fn at(&mut self, share: f64, starts: &[f64]) -> bool {
        let finer = self.best.as_ref().map_or(*self.settings, |found| finer(found.nats, self.settings));
        let found = match halt::is_requested() {
            true => Err(Error::Stopped),
            false => at(self.system, self.cost, share * self.budget, starts, &mut self.near, &finer),
        };
        let ended = found.as_ref().is_ok_and(|found| found.status == BoundStatus::Converged);
        let before = std::mem::replace(&mut self.best, Err(Error::Stopped));
        self.best = match (before, found) {
            (Ok(before), Ok(found)) => Ok(before.beside(found)),
            (Err(Error::Stopped), found) | (_, found @ Ok(_)) => found,
            (before, Err(_)) => before,
        };
        ended
    }

    fn is_over(&self) -> bool {
        halt::is_requested() || self.best.as_ref().is_ok_and(StationaryMinimum::is_tight)
    }

    /// Searches from other starts, and at lower costs that then increase stepwise; at most `most` searches.
    fn search_elsewhere(&mut self, most: usize) {
        let starts = (1..COMPLEMENTARITIES.len()).map(|from| (1.0, &COMPLEMENTARITIES[from..=from]));
        let shares = SHARES.into_iter().map(|share| (share, &COMPLEMENTARITIES[..]));
        let mut climbs = most > FEW;
        for (mut share, starts) in starts.chain(shares).take(most) {
            if self.is_over() {
                break;
            }
            self.near = None;
            let mut ended = self.at(share, starts);
            while climbs && ended && share < 1.0 && !self.is_over() {
                share = (FARTHER * share).min(1.0);
                ended = self.at(share, &[]);
                climbs = ended;
            }
        }
    }
}

/// The result of a search with a share of the budget.
fn at(
    system: &Stationary,
    cost: f64,
    budget: f64,
    starts: &[f64],
    near: &mut Option<Nearby>,
    settings: &BoundSettings,
) -> Result<StationaryMinimum, Error> {
    let n = system.dynamics.rows();
    let chain = Chain { stages: vec![reduce(system, budget)?], wraps: true };
    let target = SHARE * settings.gap;
    let found = if starts.is_empty() {
        near.as_ref().and_then(|near| search(&chain, near.place(&chain, budget)?, target, settings))
    } else {
        let factors = start(&chain.stages[0]).ok_or_else(|| Error::NoBound {
            what: "no covariances that stay within it were found".into(),
            advice: "scale the states to similar sizes, or ask for a larger cost",
        })?;
        search_from(&chain, &[factors], starts, target, settings)
    };
    let found = certified(found, STEADY_ADVICE)?;
    *near = Nearby::of(&chain, &found, budget);
    let (mut predicted, mut posterior) = (Matrices::constant(n, n), Matrices::constant(n, n));
    let root = &chain.stages[0].basis * &found.place.factors[0];
    store(&mut posterior, 0, &symmetric(&root * root.transpose()));
    store(&mut predicted, 0, &congruence(&root, &found.local[0].predicted));
    let nats = nats(&found.local[0]);
    let sensor = sensors(&chain, &found).pop().unwrap_or_else(|| VirtualSensor::none(n));
    let witness = Witness::new(&chain, &found, budget);
    let (sensor, achieved) = match witness.steps.first() {
        Some(near) => keeping(system, cost, sensor, near),
        None => (sensor, None),
    };
    let kept = achieved.filter(|achieved| achieved.keeps(cost, system.base_cost));
    let witnesses: [&dyn Fn() -> Witness; 2] = [&|| witness.clone(), &|| Witness::settled(&chain, &found, budget)];
    let (lower, nats) = Lower::of_stationary(system, cost, &Attempt { nats, witnesses }).beside(kept, nats);
    Ok(StationaryMinimum {
        nats,
        lower_nats: lower.nats,
        worth: Worth::of(&chain, &found),
        proof: lower.proof,
        achieved,
        cost: system.base_cost + budget * found.local[0].price.trace(),
        slope: -found.place.price / budget,
        predicted,
        posterior,
        iterations: found.iterations,
        status: found.status,
        sensor,
    })
}

/// Advice for costs at which the minimum is hard to find.
const STEADY_ADVICE: &str =
    "scale the states to similar sizes, or choose a cost that is neither close to the minimum nor far above it";

impl Stationary {
    /// The nearby system of the states that cost something beyond rounding, with `R` and the indices of these states.
    fn fewer(&self) -> Option<(Self, Dense, Vec<usize>)> {
        let quotient = self.quotient()?;
        let (n, rows) = (self.dynamics.rows(), dense(&self.costly, 0));
        let zero = Dense::zeros(n, n);
        let found = quotient.of(&matrix(&dense(&self.dynamics, 0)), &matrix(&zero), &matrix(&dense(&self.process, 0)));
        let price = quotient.price(&matrix(&dense(&self.price, 0)));
        let of = |a: &Matrix| {
            let mut out = Matrices::constant(a.rows, a.cols);
            store(&mut out, 0, &of_matrix(a));
            out
        };
        let unpriced = &rows * dense(&self.unpriced, 0);
        let some: Vec<usize> = (0..unpriced.ncols()).filter(|&k| unpriced.column(k).amax() > 0.0).collect();
        let fewer = Self {
            dynamics: of(&found.dynamics),
            process: of(&found.process),
            price: of(&price),
            base_cost: self.base_cost,
            unpriced: of(&matrix(&unpriced.select_columns(&some))),
            costly: Matrices::constant(0, price.rows),
        };
        Some((fewer, rows, quotient.kept().to_vec()))
    }

    /// The expected cost per step where nothing is measured; `None` if it is infinite.
    ///
    /// # Errors
    /// If the states that cost something cannot be distinguished from the others.
    pub fn unmeasured_cost(&self) -> Result<Option<f64>, Error> {
        if let Some((fewer, ..)) = self.fewer() {
            return fewer.unmeasured_cost();
        }
        let stage = reduce(self, 1.0)?;
        Ok(without_sensors(&stage).map(|covariance| self.base_cost + stage.price.dot(&covariance)))
    }
}

/// A sensor with its gain and what it achieves, adjusted with a high-precision filter until it just keeps the cost limit,
/// if a small change suffices: rounding may have affected the filter with which it was found.
fn keeping(
    system: &Stationary,
    cost: f64,
    sensor: VirtualSensor,
    near: &WitnessStep,
) -> (VirtualSensor, Option<Achieved>) {
    let of = |precision: f64| {
        if halt::is_requested() {
            return None;
        }
        let variances = sensor.variances.iter().map(|variance| variance / precision).collect();
        let one = VirtualSensor { variances, ..sensor.clone() };
        Achieved::of_stationary(system, &one, near).map(|(achieved, predicted)| {
            let gain = one.gain_from(&predicted).unwrap_or_else(|| one.gain.clone());
            (VirtualSensor { gain, ..one }, achieved)
        })
    };
    let Some((first, achieved)) = of(1.0) else { return (sensor, None) };
    let keeps = |achieved: &Achieved| achieved.keeps(cost, system.base_cost);
    let excess = (achieved.cost - cost) / (cost - system.base_cost);
    if keeps(&achieved) && (excess > -SPARE || first.rank == 0) {
        return (first, Some(achieved));
    }
    if keeps(&achieved) {
        // More precise than necessary: find the least precision that suffices.
        let (mut low, mut high, mut best) = (math::ln(LEAST_PRECISION), 0.0, (first, achieved));
        for _ in 0..PRECISION_STEPS {
            let middle = 0.5 * (low + high);
            match of(math::exp(middle)).filter(|(_, achieved)| keeps(achieved)) {
                Some(kept) => (best, high) = (kept, middle),
                None => low = middle,
            }
        }
        return (best.0, Some(best.1));
    }
    // The necessary increase in precision is about the share of the budget by which the sensor exceeds it.
    let (mut low, mut more, mut best) = (0.0, 1.5 * excess, None);
    while best.is_none() && more < MOST_PRECISION {
        best = of(1.0 + more).filter(|(_, achieved)| keeps(achieved));
        if best.is_none() {
            (low, more) = (more, 4.0 * more);
        }
    }
    for _ in 0..PRECISION_STEPS {
        if best.is_none() || more - low <= 1e-8 {
            break;
        }
        let middle = 0.5 * (low + more);
        match of(1.0 + middle).filter(|(_, achieved)| keeps(achieved)) {
            Some(kept) => (best, more) = (Some(kept), middle),
            None => low = middle,
        }
    }
    let (sensor, achieved) = best.unwrap_or((first, achieved));
    (sensor, Some(achieved))
}

/// The system in coordinates of the states that cost something and stay uncertain (theory, equation L.16).
fn reduce(system: &Stationary, budget: f64) -> Result<Stage, Error> {
    let n = system.dynamics.rows();
    root_of("the price of not knowing the state", &system.price, 0)?;
    let driven = root_of(PROCESS, &system.process, 0)?;
    let InUnits { d, a, price } = InUnits::of(system);
    let driven = Dense::from_fn(n, driven.ncols(), |i, k| driven[(i, k)] / d[i]);
    let price = price / budget;
    let unseen = unseen(&a, &price, &unpriced(system, &d))?;
    let seen = complement(&unseen);
    let mut root = seen.transpose() * &driven;
    for (mut seen, whole) in root.column_iter_mut().zip(driven.column_iter()) {
        // Remaining noise that does not affect the cost is rounding.
        if seen.norm() <= 1e-13 * whole.norm() {
            seen.fill(0.0);
        }
    }
    let kept = uncertain(&(seen.transpose() * &a * &seen), root, &seen)?;
    let (a, driven) = (kept.transpose() * a * &kept, kept.transpose() * driven);
    let price = congruence(&kept.transpose(), &price);
    let scaled = scaled(&a, &driven, &price);
    let (dynamics, driven) = (from_left(&scaled, a * &scaled), from_left(&scaled, driven));
    let reader = from_left(&scaled, kept.transpose());
    let basis = kept * &scaled;
    let in_units = |m: &Dense| Dense::from_fn(n, m.ncols(), |i, k| d[i] * m[(i, k)]);
    Ok(Stage {
        dynamics,
        process: symmetric(&driven * driven.transpose()),
        price: congruence(&scaled.transpose(), &price),
        basis: in_units(&basis),
        reader: Dense::from_fn(reader.nrows(), n, |k, i| reader[(k, i)] / d[i]),
        unseen: in_units(&unseen),
    })
}

/// An orthonormal basis, by columns, of the modes that are unobservable through the price and do not decay: however
/// uncertain they are, they need no information. Decaying modes may stay.
///
/// States unobservable by the zeros of the matrices alone are left out in any case: exactly, and first. Those that are
/// known to cost nothing (`unpriced`) follow.
fn unseen(a: &Dense, price: &Dense, unpriced: &Dense) -> Result<Dense, Error> {
    let n = a.nrows();
    let priced = seen_states(a, |i| price.row(i).iter().any(|entry| *entry != 0.0));
    let identity = Dense::identity(n, n);
    let of = |wanted: bool| (0..n).filter(|&i| priced[i] == wanted).collect::<Vec<_>>();
    let (kept, left_out) = (identity.select_columns(&of(true)), identity.select_columns(&of(false)));
    let known = kept.transpose() * unpriced;
    let known = known.select_columns(&(0..known.ncols()).filter(|&k| known.column(k).amax() > 0.0).collect::<Vec<_>>());
    let known = range(unit_columns(known));
    let rest = complement(&known);
    let of_rest = &kept * &rest;
    let (a, price) = (of_rest.transpose() * a * &of_rest, congruence(&of_rest.transpose(), price));
    let parts = [left_out, &kept * known, of_rest * unseen_modes(&a, &price)?];
    let mut all = Dense::zeros(n, parts.iter().map(Dense::ncols).sum());
    let mut first = 0;
    for part in parts {
        all.columns_mut(first, part.ncols()).copy_from(&part);
        first += part.ncols();
    }
    Ok(all)
}

/// States that are known to cost nothing, in scaled units.
fn unpriced(system: &Stationary, units: &[f64]) -> Dense {
    dense(&system.unpriced, 0).map_with_location(|i, _, entry| entry / units[i])
}

impl Stationary {
    /// `A` of the states that cost something, now or later: states that grow at no cost need no information.
    #[must_use]
    pub fn priced_dynamics(&self) -> Matrices {
        let InUnits { d, a, price } = InUnits::of(self);
        let rest = complement(&range(unit_columns(unpriced(self, &d))));
        let (a, price) = (rest.transpose() * a * &rest, congruence(&rest.transpose(), &price));
        let seen = observed(&a, &price);
        let mut out = Matrices::constant(seen.ncols(), seen.ncols());
        store(&mut out, 0, &(seen.transpose() * a * seen));
        out
    }
}

fn unseen_modes(a: &Dense, price: &Dense) -> Result<Dense, Error> {
    let unseen = complement(&observed(a, price));
    let lasting = lasting(&(unseen.transpose() * a * &unseen)).ok_or_else(|| Error::NoBound {
        what: "persistent and decaying modes could not be separated".into(),
        advice: "scale the states to similar sizes",
    })?;
    Ok(unseen * lasting)
}

/// Coordinates, by columns, in which a filter that measures what costs has a covariance of about `I`, however weakly
/// noise drives some of them.
fn scaled(a: &Dense, driven: &Dense, price: &Dense) -> Dense {
    let n = a.nrows();
    let mut basis = Dense::identity(n, n);
    for _ in 0..SCALING + 2 * n {
        if halt::is_requested() {
            break;
        }
        let Some(measured) = measured_root(&basis, &congruence(&basis.transpose(), price), 1) else { break };
        let (next, ..) = reach(a, &basis, driven, &measured);
        if next.ncols() == 0 || !next.iter().all(|entry| entry.is_finite()) {
            break;
        }
        basis = next;
    }
    basis
}

/// Coordinates of columns with respect to a basis whose span contains them.
fn from_left(basis: &Dense, columns: Dense) -> Dense {
    let sizes: Vec<f64> = basis.column_iter().map(|column| column.norm()).collect();
    let Svd { u, values, v } = svd(&Dense::from_fn(basis.nrows(), basis.ncols(), |i, k| basis[(i, k)] / sizes[k]));
    let mut along = u.transpose() * columns;
    for (mut row, value) in along.row_iter_mut().zip(values) {
        row /= value;
    }
    let mut found = v * along;
    for (mut row, size) in found.row_iter_mut().zip(sizes) {
        row /= size;
    }
    found
}

/// The solution without information.
fn free(covariance: &Dense, cost: f64) -> StationaryMinimum {
    let n = covariance.nrows();
    let mut posterior = Matrices::constant(n, n);
    store(&mut posterior, 0, covariance);
    StationaryMinimum {
        nats: 0.0,
        lower_nats: 0.0,
        cost,
        slope: 0.0,
        predicted: posterior.clone(),
        posterior,
        iterations: 0,
        status: BoundStatus::Converged,
        sensor: VirtualSensor::none(n),
        worth: Worth::default(),
        proof: Proof::Proved { distance: 0.0 },
        achieved: Some(Achieved { nats: 0.0, cost }),
    }
}

/// A basis, by columns in all states, of what affects the cost and stays uncertain: driven by noise, or growing by itself.
/// The rest becomes known in the end, however little is measured.
fn uncertain(a: &Dense, root: Dense, seen: &Dense) -> Result<Dense, Error> {
    let driven = invariant_hull(a, root.clone());
    if driven.ncols() == a.nrows() {
        return Ok(seen.clone());
    }
    // A is block triangular in (driven, the others): the others grow according to their own block.
    let others = complement(&driven);
    let block = others.transpose() * a * others;
    let moduli = moduli(&block).ok_or_else(|| Error::NoBound {
        what: "the eigenvalues of the states that no noise drives could not be computed".into(),
        advice: "scale the states to similar sizes, or add a small process noise to these states",
    })?;
    if moduli.iter().all(|&modulus| modulus <= 1.0 + GROWTH) {
        return Ok(seen * driven);
    }
    let growing = unstable(a, 1.0 + GROWTH).ok_or_else(|| Error::NoBound {
        what: "the states that no noise drives have eigenvalues too close to the unit circle".into(),
        advice: "add a small process noise to these states, or leave them out",
    })?;
    let mut both = Dense::zeros(a.nrows(), driven.ncols() + growing.ncols());
    both.columns_mut(0, driven.ncols()).copy_from(&driven);
    both.columns_mut(driven.ncols(), growing.ncols()).copy_from(&growing);
    Ok(seen * invariant_hull(a, both))
}

/// The covariance without a sensor, where it exists.
fn without_sensors(stage: &Stage) -> Option<Dense> {
    let (mut a, mut covariance) = (stage.dynamics.clone(), stage.process.clone());
    for _ in 0..50 {
        covariance = congruence(&a, &covariance) + &covariance;
        a = &a * &a;
        let size = a.norm();
        if !size.is_finite() || !covariance.norm().is_finite() {
            return None;
        }
        if size < 1e-20 {
            return Some(covariance);
        }
    }
    None
}

/// A factor of the steady covariance once every reduced coordinate is measured with a noise of variance `variance`,
/// and its cost as a share of the budget.
fn measured(stage: &Stage, variance: f64) -> Option<(Dense, f64)> {
    let n = stage.price.nrows();
    let identity = Dense::identity(n, n);
    let mut predicted = settled(&stage.dynamics, &(&identity / variance), &stage.process, &identity)?;
    let mut posterior = once_measured(&predicted, variance)?;
    // Steps remove the rounding errors of doubling.
    for _ in 0..POLISHING {
        predicted = congruence(&stage.dynamics, &posterior) + &stage.process;
        posterior = once_measured(&predicted, variance)?;
    }
    cholesky(&(congruence(&stage.dynamics, &posterior) + &stage.process - &posterior))?;
    let cost = stage.price.dot(&posterior);
    cost.is_finite().then_some((cholesky(&posterior)?, cost))
}

/// A strictly feasible start: all coordinates measured just well enough to use about half of the budget.
fn start(stage: &Stage) -> Option<Dense> {
    inside(|variance| measured(stage, variance))
}
