//! Lower bounds that are proved: numbers from elsewhere, systems at their limits, and that no proof is above what a sensor
//! achieves.

#[path = "../../../supple-lqg/tests/common/another_filter.rs"]
mod another_filter;

use std::path::Path;

use crate::common::bound::{matrix, sequence};
use another_filter::filtered;
use nalgebra::DMatrix;
use serde_json::Value as Json;
use supple::bound::{
    BoundSettings, Horizon, Proof, Stationary, StationaryMinimum, Vacuous, data_rate_floor, kostina_hassibi,
    minimum_information, stationary_minimum,
};
use supple::lqg;

/// Nats in a bit.
const BITS: f64 = std::f64::consts::LN_2;

/// `x+ = A x + B u + w` with the cost `x'Qx + u'Ru` per step, without factors 1/2.
struct System {
    a: DMatrix<f64>,
    b: DMatrix<f64>,
    w: DMatrix<f64>,
    q: DMatrix<f64>,
    r: DMatrix<f64>,
}

impl System {
    /// A signal `h'x` to be tracked: the last state is how far the control was from it.
    fn tracking(a: &DMatrix<f64>, w: &DMatrix<f64>, h: &[f64]) -> Self {
        let n = a.nrows();
        let mut wide = a.clone().resize(n + 1, n + 1, 0.0);
        h.iter().enumerate().for_each(|(j, entry)| wide[(n, j)] = *entry);
        let mut b = DMatrix::zeros(n + 1, 1);
        b[(n, 0)] = -1.0;
        let mut q = DMatrix::zeros(n + 1, n + 1);
        q[(n, n)] = 1.0;
        Self { a: wide, b, w: w.clone().resize(n + 1, n + 1, 0.0), q, r: DMatrix::zeros(1, 1) }
    }

    fn stationary(&self) -> Stationary {
        self.regulated().unwrap()
    }

    fn regulated(&self) -> Result<Stationary, lqg::Error> {
        let (n, m) = (self.a.nrows(), self.b.ncols());
        let joint = matrix(n, n + m, |i, j| if j < n { self.a[(i, j)] } else { self.b[(i, j - n)] });
        let cost = matrix(n + m, n + m, |i, j| match (i < n, j < n) {
            (true, true) => 2.0 * self.q[(i, j)],
            (false, false) => 2.0 * self.r[(i - n, j - n)],
            _ => 0.0,
        });
        Stationary::new(&joint, &matrix(n, n, |i, j| self.w[(i, j)]), &cost)
    }
}

/// The minimum, proved, and attained by the sensor at the cost asked for.
fn proved(stationary: &Stationary, cost: f64) -> StationaryMinimum {
    let found = stationary_minimum(stationary, cost, &BoundSettings::default()).unwrap();
    let Proof::Proved { distance } = found.proof else { panic!("{:?}", found.proof) };
    assert!(distance < 1e-9, "{distance:e}");
    assert!(found.lower_nats <= found.nats && found.nats - found.lower_nats < 1e-6, "{found:?}");
    let achieved = found.achieved.unwrap();
    assert!(achieved.cost <= cost * (1.0 + 1e-8) && achieved.nats >= found.lower_nats, "{achieved:?}");
    found
}

/// The same in bits, and by another filter of the sensor.
fn bits(system: &System, cost: f64) -> f64 {
    let stationary = system.stationary();
    let found = proved(&stationary, cost);
    let achieved = found.achieved.unwrap();
    let (nats, price) = filtered(&stationary, &found, 3000);
    let rate = nats / BITS;
    assert!((rate - achieved.nats / BITS).abs() < 1e-7 && rate * BITS >= found.lower_nats - 1e-12, "{rate}");
    let budget = cost - stationary.base_cost;
    assert!((price + stationary.base_cost - achieved.cost).abs() < 1e-7 * budget, "{price}");
    found.nats / BITS
}

fn of(rows: usize, entries: &[f64]) -> DMatrix<f64> {
    DMatrix::from_row_slice(rows, entries.len() / rows, entries)
}

/// A random walk beside an AR(1), tracked: u = x1 costs nothing, though nothing that is paid for keeps x1 bounded.
#[test]
fn an_unpriced_mode_on_the_unit_circle_costs_nothing() {
    let w = of(2, &[0.01, 0.01, 0.01, 0.01]);
    let system = System::tracking(&of(2, &[1.0, 0.6, 0.0, 0.6]), &w, &[1.0, 0.0]);
    assert_eq!(system.stationary().base_cost, 0.0);
    // A sensor of x1 + .6818 x2 with variance .2 achieves .3284.
    let found = bits(&system, 0.051_756_4);
    assert!((found - 0.328_414_0).abs() < 1e-6, "{found}");
}

/// Two AR(1) whose sum is tracked (Sims 2011), at the rate and cost that DRIPs prints.
#[test]
fn the_example_of_sims() {
    let a = of(2, &[0.95, 0.0, 0.0, 0.4]);
    let system = System::tracking(&a, &of(2, &[0.0975, 0.0, 0.0, 0.86]), &[1.0, 1.0]);
    let found = bits(&system, 0.781_360_1);
    assert!((found - 0.360_484_7).abs() < 1e-6, "{found}");
}

/// ARMA(2, 1): directions without a price in unequal units. The sensor printed once gave .2141 bits at .6151.
#[test]
fn the_sensor_of_an_arma_process_attains_its_rate() {
    let a = of(3, &[1.3, -0.4, -0.1, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    let noise = [0.5, 0.0, 1.0];
    let w = DMatrix::from_fn(3, 3, |i, j| noise[i] * noise[j]);
    let found = bits(&System::tracking(&a, &w, &[1.0, 0.0, 0.0]), 0.6768);
    assert!((found - 0.176_253_6).abs() < 1e-6, "{found}");
}

/// A signal seen through a line of delays by falling weights.
fn delays(states: usize, fall: f64, price: f64) -> System {
    let a = DMatrix::from_fn(states, states, |i, j| f64::from(u8::from(i == j + 1)));
    let mut w = DMatrix::zeros(states, states);
    w[(0, 0)] = 1.0;
    let weights: Vec<f64> = (0..states as i32).map(|k| fall.powi(k)).collect();
    let mut system = System::tracking(&a, &w, &weights);
    system.r[(0, 0)] = price;
    system
}

/// Filters by hand of the sensors found agree to 1e-8; at the fall .5 all long lines are one.
#[test]
fn delay_lines_of_any_length() {
    for (states, fall, known) in [
        (8, 0.5, 0.920_653_9),
        (13, 0.5, 0.920_651_1),
        (16, 0.5, 0.920_651_1),
        (21, 0.5, 0.920_651_1),
        (21, 0.2, 0.877_087_4),
        (21, 0.8, 0.995_188_0),
        (28, 0.9, 1.025_8),
    ] {
        let found = bits(&delays(states, fall, 0.0), 0.3);
        let within = if states < 28 { 2e-7 } else { 1e-2 };
        assert!((found - known).abs() < within, "{states} {fall}: {found}");
    }
    let dear = delays(18, 0.8, 0.1);
    let least = dear.stationary().base_cost;
    assert!(least > 0.0 && bits(&dear, least + 0.3) > 0.5);
}

/// `benches/python/bound_steady_oracle.py`: modes on the unit circle, singular prices of states and controls.
#[test]
fn random_systems_with_modes_on_the_unit_circle_against_cvxpy() {
    let golden: Vec<Json> = serde_json::from_str(include_str!("../golden/bound_steady.json")).unwrap();
    assert!(golden.len() >= 500, "{}", golden.len());
    let (mut close, mut refused, mut unproved, mut lower) = (0, Vec::new(), Vec::new(), Vec::new());
    for case in &golden {
        let all = |key: &str| -> DMatrix<f64> {
            let rows: Vec<Vec<f64>> = serde_json::from_value(case[key].clone()).unwrap();
            DMatrix::from_fn(rows.len(), rows[0].len(), |i, j| rows[i][j])
        };
        let system = System { a: all("A"), b: all("B"), w: all("W"), q: all("Q"), r: all("R") };
        let number = |key: &str| case[key].as_f64().unwrap();
        let Ok(stationary) = system.regulated() else {
            refused.push(case["seed"].to_string());
            continue;
        };
        let least = stationary.base_cost;
        if least < number("least") * (1.0 - 1e-6) {
            // A law that holds what costs something at 0 from the second step on, whatever the other states do: steps in
            // double precision lead to one that keeps all of them bounded.
            assert!((least - (&system.q * &system.w).trace()).abs() < 1e-9 * least, "seed {}: {least}", case["seed"]);
            lower.push(case["seed"].to_string());
            continue;
        }
        assert!((least - number("least")).abs() < 1e-6 * number("least"), "seed {}: {least}", case["seed"]);
        let cost = least + number("budget");
        let minimum = stationary_minimum(&stationary, cost, &BoundSettings::default()).unwrap();
        let achieved = minimum.achieved.unwrap();
        assert!(minimum.lower_nats <= achieved.nats && achieved.cost <= cost * (1.0 + 1e-8), "{achieved:?}");
        match minimum.proof {
            Proof::Proved { .. } => assert!(minimum.nats - minimum.lower_nats < 1e-6, "seed {}", case["seed"]),
            Proof::NotProved { .. } => unproved.push(case["seed"].to_string()),
        }
        let found = minimum.nats / BITS;
        // What is found is proved from below and achieved from above: where the two differ it is the oracle that ends early.
        let below = (number("bits") - found) / number("bits").max(1.0);
        assert!(below > -1e-5 && below < 1e-2, "seed {}: {found}", case["seed"]);
        close += usize::from(below < 1e-5);
    }
    assert!(close * 10 >= golden.len() * 9, "{close} of {}", golden.len());
    // Regulators that take more steps than are tried: said, not wrong.
    assert!(refused.len() * 100 <= golden.len(), "{refused:?}");
    assert!(unproved.len() * 20 <= golden.len(), "{unproved:?}");
    assert!(lower.len() <= 1, "{lower:?}");
}

/// Singular everything, and nothing at all.
#[test]
fn singular_matrices_are_proved_too() {
    let identity = |n: usize| DMatrix::<f64>::identity(n, n);
    // No noise, and a state that grows: log2 of how fast, whatever the cost.
    let grows = System { a: of(1, &[1.5]), b: of(1, &[1.0]), w: of(1, &[0.0]), q: of(1, &[1.0]), r: of(1, &[0.0]) };
    let found = bits(&grows, 2.0);
    assert!((found - 1.5f64.log2()).abs() < 1e-6, "{found}");
    // A control that does nothing, one that costs nothing, and a price of one direction.
    let system = System {
        a: of(2, &[1.0, 1.0, 0.0, 1.0]),
        b: of(2, &[-0.15, -0.26, 0.0, -0.41, 0.88, 0.0]),
        w: identity(2) * 0.1,
        q: of(2, &[1.0, -1.0, -1.0, 1.0]),
        r: DMatrix::zeros(3, 3),
    };
    assert!(bits(&system, system.stationary().base_cost + 0.01) > 0.1);
    // An uncontrolled random walk that costs: no regulator.
    let lost = System { b: DMatrix::zeros(2, 1), r: DMatrix::zeros(1, 1), ..system };
    let joint = matrix(2, 3, |i, j| if j < 2 { lost.a[(i, j)] } else { 0.0 });
    let cost = matrix(3, 3, |i, j| if i < 2 && j < 2 { 2.0 * lost.q[(i, j)] } else { 0.0 });
    let error = Stationary::new(&joint, &matrix(2, 2, |i, j| lost.w[(i, j)]), &cost).unwrap_err().to_string();
    assert!(error.contains("no regulator"), "{error}");
}

/// Plants with a zero outside of the unit circle and a control without a price. The numbers are those of
/// `benches/python/bound_attack.py` in 200 digits: the least cost, and a sensor's cost beyond it with its bits.
#[test]
fn free_controls_keep_what_costs_at_0_whatever_the_states_do() {
    let first = System {
        a: of(3, &[0.7, -1.4, -1.3, -0.1, -0.6, 1.1, 0.5, 0.2, 1.3]),
        b: of(3, &[-0.5, -1.5, 1.5]),
        w: of(3, &[2.84, -0.23, -1.44, -0.23, 1.99, -0.2, -1.44, -0.2, 0.99]),
        q: of(3, &[0.0, 0.0, 0.0, 0.0, 1.0, 0.875, 0.0, 0.875, 0.765_625]),
        r: DMatrix::zeros(1, 1),
    };
    let second = System {
        a: of(2, &[0.4, 0.4, 0.6, -0.4]),
        b: of(2, &[1.7, 0.5]),
        w: of(2, &[1.35, 0.72, 0.72, 1.38]),
        q: of(2, &[0.390_625, -1.406_25, -1.406_25, 5.0625]),
        r: DMatrix::zeros(1, 1),
    };
    for (system, least, paid, sensor) in [
        (first, 2.397_968_75, 0.633_458_698_436_098_9, 2.633_092_883_866_299),
        (second, 5.488_593_75, 0.023_427_939_614_076_947, 3.263_868_253_231_731),
    ] {
        assert!((system.stationary().base_cost - least).abs() < 1e-12 * least, "{}", system.stationary().base_cost);
        let found = bits(&system, least + paid);
        assert!(found <= sensor && found > 0.5 * sensor, "{found} and {sensor}");
    }
}

/// Whatever the cost, they need the logarithm of how fast they grow, and a sensor with as much keeps it.
#[test]
fn modes_that_grow_without_noise_are_measured() {
    let system = System {
        a: of(2, &[-2.05, -1.54, -2.22, 0.7]),
        b: of(2, &[-0.08, 0.98, 0.22, 1.22]),
        w: DMatrix::zeros(2, 2),
        q: of(2, &[3.515_625, -1.171_875, -1.171_875, 0.390_625]),
        r: DMatrix::identity(2, 2),
    };
    let growth: f64 = system.a.complex_eigenvalues().iter().map(|value| value.norm().log2().max(0.0)).sum();
    for cost in [0.1, 648.0] {
        let found = bits(&system, cost);
        assert!(growth > 2.0 && (found - growth).abs() < 1e-6, "{cost}: {found} and {growth}");
    }
    let system = System {
        a: of(4, &[0.0, 0.0, -0.2, 0.9, -1.0, 3.9, -0.7, 0.0, 0.4, 0.0, 1.8, -2.2, 0.0, 1.7, 1.5, 0.7]),
        b: of(4, &[1.1, 0.0, 1.5, -1.0, 0.0, 0.0, -0.2, 0.0, -0.9, 0.6, -0.1, 1.1]),
        w: DMatrix::zeros(4, 4),
        q: of(4, &[1.0, -1.75, 1.0, 1.25]) * of(1, &[1.0, -1.75, 1.0, 1.25]),
        r: DMatrix::identity(3, 3),
    };
    let growth: f64 = system.a.complex_eigenvalues().iter().map(|value| value.norm().log2().max(0.0)).sum();
    let found = bits(&system, 0.5);
    assert!(growth > 2.0 && (found - growth).abs() < 1e-6, "{found} and {growth}");
}

/// A state that grows and never costs anything, in unequal units: no bound counts its growth.
#[test]
fn growth_that_costs_nothing_needs_no_information() {
    let system = System {
        a: of(2, &[0.75, 0.0, 26_624.0, 3.375]),
        b: of(2, &[-2.441_406_25e-3, -24.0]),
        w: of(2, &[2.336_502_075_195_312_5e-5, -0.546_875, -0.546_875, 12_928.0]),
        q: of(2, &[295_936.0, 0.0, 0.0, 0.0]),
        r: of(1, &[0.25]),
    };
    let (least, paid, sensor) = (7.401_345_137_058_549, 3.538_060_802_602_674_3, 0.339_764_998_112_699_45);
    let stationary = system.stationary();
    assert!((stationary.base_cost - least).abs() < 1e-12 * least, "{}", stationary.base_cost);
    assert_eq!((stationary.unpriced.get(0, 0, 0), stationary.unpriced.get(0, 1, 0)), (0.0, 1.0));
    let found = proved(&stationary, least + paid).nats / BITS;
    assert!(found <= sensor * (1.0 + 1e-7) && found > 0.5 * sensor, "{found} and {sensor}");
    let floor = data_rate_floor(&stationary.priced_dynamics()).unwrap();
    let closed = kostina_hassibi(&stationary, least + paid, floor);
    assert_eq!((floor, closed.nats, closed.vacuous), (0.0, f64::NEG_INFINITY, Some(Vacuous::SingularPrice)));
    // The same in other coordinates.
    let turn = of(2, &[1.0, 0.0, 4096.0, 1.0]);
    let back = of(2, &[1.0, 0.0, -4096.0, 1.0]);
    let turned = System {
        a: &turn * &system.a * &back,
        b: &turn * &system.b,
        w: &turn * &system.w * turn.transpose(),
        q: back.transpose() * &system.q * &back,
        r: system.r.clone(),
    };
    let turned = turned.stationary();
    assert!((proved(&turned, least + paid).nats / BITS - found).abs() < 1e-7);
    assert_eq!(data_rate_floor(&turned.priced_dynamics()).unwrap(), 0.0);
}

/// Horizons with a first covariance, noise and prices of low rank.
#[test]
fn singular_horizons_are_proved_and_attained() {
    let mut state = 7u32;
    let mut next = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        f64::from(state >> 8) / f64::from(1 << 24) * 2.0 - 1.0
    };
    let mut random = |rows: usize, cols: usize| DMatrix::from_fn(rows, cols, |_, _| next());
    for (n, ranks) in [(3, [1, 1, 1]), (4, [2, 0, 1]), (4, [0, 1, 2]), (5, [5, 1, 1]), (2, [2, 2, 2])] {
        let steps = 7;
        let of_rank = |g: DMatrix<f64>| &g * g.transpose();
        let initial = of_rank(random(n, ranks[0]));
        let (a, w): (Vec<_>, Vec<_>) = (0..steps).map(|_| (random(n, n), of_rank(random(n, ranks[1])))).unzip();
        let prices: Vec<_> = (0..steps).map(|_| of_rank(random(n, ranks[2]))).collect();
        let (mut p, mut open) = (initial.clone(), 0.0);
        for t in 0..steps {
            open += (&prices[t] * &p).trace();
            p = &a[t] * p * a[t].transpose() + &w[t];
        }
        let horizon = Horizon {
            dynamics: sequence(&a),
            process: sequence(&w),
            initial: sequence(&[initial]),
            prices: sequence(&prices),
            base_cost: 0.0,
        };
        for share in [0.7, 0.1, 0.01] {
            let found = minimum_information(&horizon, share * open, &BoundSettings::default()).unwrap();
            assert!(matches!(found.proof, Proof::Proved { .. }), "{n} {ranks:?} {share}: {:?}", found.proof);
            let achieved = found.achieved.unwrap();
            assert!(found.lower_nats <= achieved.nats && achieved.cost <= share * open * (1.0 + 1e-8), "{achieved:?}");
            assert!(achieved.nats - found.lower_nats < 2e-6 * steps as f64, "{n} {ranks:?} {share}: {achieved:?}");
        }
    }
}

/// What proves bounds has no line in common with what finds them.
#[test]
fn proofs_use_nothing_else_of_the_library() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../supple-lqg/src/bound/verify");
    let mut files = 0;
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let text = std::fs::read_to_string(&path).unwrap();
        for line in text.lines().filter(|line| line.trim_start().starts_with("use ")) {
            // Elementary functions are those of the crate libm.
            let own = ["use std::", "use super::", "use supple_kernels::math;"];
            let own = own.into_iter().any(|start| line.trim_start().starts_with(start));
            assert!(own && !line.contains("super::super::"), "{}: {line}", path.display());
        }
        assert!(!text.contains("crate::") && !text.contains("nalgebra"), "{}", path.display());
        files += 1;
    }
    assert!(files >= 5);
}
