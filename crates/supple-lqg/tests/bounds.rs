//! Bounds where rounding grows: free controls of plants that are not minimum phase, chains of delays, slow modes.
#![allow(clippy::unwrap_used)]

#[path = "common/another_filter.rs"]
mod another_filter;

use another_filter::filtered;
use nalgebra::{DMatrix, DVector};
use supple_lqg::bound::{
    BoundSettings, MinimumInformation, Proof, Spread, Stationary, StationaryMinimum, minimum_information,
    minimum_information_within, own_rates, regulator_distance, stationary_minimum,
};
use supple_lqg::dense::{dense, store};
use supple_lqg::{Dimensions, Horizon, Knots, Matrices, Noise, Policy, Regularisation, solve_riccati};

/// `x+ = A x + B u + w` with the cost `x'Qx + u'Ru` per step, without factors 1/2.
struct System {
    a: DMatrix<f64>,
    b: DMatrix<f64>,
    w: DMatrix<f64>,
    q: DMatrix<f64>,
    r: DMatrix<f64>,
}

fn of(rows: usize, entries: &[f64]) -> DMatrix<f64> {
    DMatrix::from_row_slice(rows, entries.len() / rows, entries)
}

fn matrices(a: &DMatrix<f64>) -> Matrices {
    let mut out = Matrices::constant(a.nrows(), a.ncols());
    store(&mut out, 0, a);
    out
}

impl System {
    /// `[A, B]` and `diag(2 Q, 2 R)`.
    fn joint(&self) -> (DMatrix<f64>, DMatrix<f64>) {
        let (n, m) = self.b.shape();
        let mut f = self.a.clone().resize(n, n + m, 0.0);
        f.columns_mut(n, m).copy_from(&self.b);
        let mut l = (&self.q * 2.0).resize(n + m, n + m, 0.0);
        l.view_mut((n, n), (m, m)).copy_from(&(&self.r * 2.0));
        (f, l)
    }

    /// Over a horizon, with the first state's covariance the identity.
    fn knots(&self, steps: usize) -> (Knots, Noise) {
        let (n, m) = self.b.shape();
        let mut knots = Knots::zeros(Dimensions { states: n, controls: m, measurements: n }, steps);
        let (f, l) = self.joint();
        for t in 0..=steps {
            store(&mut knots.measurement, t, &DMatrix::identity(n, n));
            if t < steps {
                store(&mut knots.dynamics, t, &f);
                store(&mut knots.cost, t, &l);
            } else {
                store(&mut knots.cost, t, &l.view((0, 0), (n, n)).into_owned());
            }
        }
        let mut noise = Noise::zeros(n, n);
        store(&mut noise.initial, 0, &DMatrix::identity(n, n));
        store(&mut noise.process, 0, &self.w);
        store(&mut noise.measurement, 0, &DMatrix::identity(n, n));
        (knots, noise)
    }

    /// The least cost over a horizon by a sweep in double precision, and the horizon whose law is proved.
    fn horizons(&self, steps: usize) -> (f64, (Horizon, Spread)) {
        let (knots, noise) = self.knots(steps);
        let mut policy = Policy::zeros(knots.dimensions, steps);
        solve_riccati(&knots.dynamics, &knots.cost, Regularisation::default(), &mut policy).unwrap();
        let rounded = Horizon::along(&knots, &policy, &noise, 0.0).unwrap().base_cost;
        (rounded, Horizon::proved(&knots, &policy, &noise, 0.0, 0.0).unwrap())
    }

    /// In the steady state, with a regulator that is proved but for rounding.
    fn stationary(&self) -> Stationary {
        let (f, l) = self.joint();
        let (f, l) = (matrices(&f), matrices(&l));
        let system = Stationary::new(&f, &matrices(&self.w), &l).unwrap();
        let distance = regulator_distance(&system, &f, &l).unwrap();
        assert!(distance < 1e-8, "{distance:e}");
        system
    }
}

/// `x1+ = x1 / 2 + u`, `x2+ = x1` with the cost `(x1 - z x2)^2`: the control is free, and the zero of what costs is z.
fn with_zero(z: f64, noise: f64) -> System {
    System {
        a: of(2, &[0.5, 0.0, 1.0, 0.0]),
        b: of(2, &[1.0, 0.0]),
        w: of(2, &[noise, 0.0, 0.0, 0.0]),
        q: of(2, &[1.0, -z, -z, z * z]),
        r: DMatrix::zeros(1, 1),
    }
}

/// A bound that is proved, and not above what the sensors achieve at the cost asked for.
fn assert_proved(found: &MinimumInformation, cost: f64) {
    assert!(matches!(found.proof, Proof::Proved { distance } if distance < 1e-9), "{:?}", found.proof);
    let achieved = found.achieved.unwrap();
    assert!(achieved.cost <= cost * (1.0 + 1e-9), "{achieved:?}");
    assert!(found.lower_nats <= found.nats && found.lower_nats <= achieved.nats, "{found:?}");
    assert!(found.nats - found.lower_nats < 1e-5, "{} {}", found.nats, found.lower_nats);
}

/// `u` cancels the noise before it costs: `1 + z^2` at the start and what each step adds.
#[test]
fn a_zero_outside_the_unit_circle_does_not_raise_the_least_cost() {
    for z in [1.5, 2.0, 3.0, 4.0] {
        for steps in [5, 20, 40, 100] {
            for noise in [0.0, 0.25] {
                let (_, (horizon, spread)) = with_zero(z, noise).horizons(steps);
                let least = 1.0 + z * z + noise * steps as f64;
                assert!((horizon.base_cost - least).abs() < 1e-11 * least, "{z} {steps} {}", horizon.base_cost);
                let [below, above] = spread.least;
                let off = least - horizon.base_cost;
                assert!(-below <= off && off <= above, "{z} {steps} {noise}: {off:e} {spread:?}");
                assert!(below + above < 1e-11 * least && spread.distance == 0.0, "{spread:?}");
            }
        }
    }
}

/// `G G'` of another library may differ from its transpose in the last digit; 1e-6 of an entry is no rounding.
#[test]
fn covariances_that_are_symmetric_but_for_rounding_are_taken() {
    let mut system = with_zero(2.0, 0.25);
    system.w = of(2, &[0.25, 0.1, 0.1, 0.3]);
    let minimum = |system: &System| {
        let (least, (horizon, spread)) = system.horizons(20);
        minimum_information_within(&horizon, &spread, 1.5 * least, &BoundSettings::default()).unwrap()
    };
    let exact = minimum(&system);
    for ulps in 1..=4 {
        system.w[(0, 1)] = system.w[(0, 1)].next_up();
        let found = minimum(&system);
        assert!((found.nats - exact.nats).abs() < 1e-9, "{ulps}: {} {}", found.nats, exact.nats);
        assert_proved(&found, 1.5 * system.horizons(20).0);
    }
    system.w[(0, 1)] += 1e-6;
    let (_, (horizon, spread)) = system.horizons(20);
    let refused = minimum_information_within(&horizon, &spread, 1e3, &BoundSettings::default());
    let said = refused.unwrap_err().to_string();
    let found = format!("at step 0 entry [1][0] is 0.1, and [0][1] is {:?}", system.w[(0, 1)]);
    let valid = "the process covariance must be symmetric and positive semidefinite; ";
    assert!(said.starts_with(valid) && said.ends_with(&found), "{said}");
}

/// The same problem in double precision leads to the law that keeps all states bounded, which costs 8 and not 5.
#[test]
fn a_law_that_rounding_changed_proves_nothing() {
    let (rounded, (horizon, spread)) = with_zero(2.0, 0.0).horizons(40);
    assert!((rounded - 8.0).abs() < 1e-4, "{rounded}");
    assert!((horizon.base_cost - 5.0).abs() < 1e-12);
    // Without measurements it costs 8: below, something must be known, and at 8 nothing.
    let within = |cost: f64| minimum_information_within(&horizon, &spread, cost, &BoundSettings::default());
    assert!(within(4.99).is_err());
    let mut last = f64::INFINITY;
    for cost in [5.01, 5.5, 6.5, 7.9] {
        let found = within(cost).unwrap();
        assert_proved(&found, cost);
        assert!(found.nats < last && found.nats > 1e-3, "{cost}: {}", found.nats);
        last = found.nats;
    }
    assert!(within(8.0 + 1e-9).unwrap().nats < 1e-6);
}

/// What is known no better than its radii bounds no more than the worst of it.
#[test]
fn a_wider_spread_proves_less() {
    let (_, (horizon, spread)) = with_zero(3.0, 0.25).horizons(20);
    let settings = BoundSettings::default();
    let cost = 1.5 * horizon.base_cost;
    let exact = minimum_information(&horizon, cost, &settings).unwrap();
    let within = minimum_information_within(&horizon, &spread, cost, &settings).unwrap();
    assert_proved(&within, cost);
    assert!((exact.lower_nats - within.lower_nats).abs() < 1e-9, "{} {}", exact.lower_nats, within.lower_nats);
    let wide = Spread { least: [0.5, 0.5], ..spread };
    let less = minimum_information_within(&horizon, &wide, cost, &settings).unwrap();
    let dearer = minimum_information(&horizon, cost + 0.5, &settings).unwrap();
    assert!(matches!(less.proof, Proof::Proved { .. }), "{:?}", less.proof);
    assert!(less.lower_nats < exact.lower_nats - 1e-3 && less.lower_nats <= dearer.nats, "{}", less.lower_nats);
}

/// Controls at their limits stay there: without the only one, the cost is that of free motion.
#[test]
fn a_control_at_its_limit_moves_nothing() {
    let steps = 6;
    let system = with_zero(2.0, 0.25);
    let (knots, noise) = system.knots(steps);
    let mut policy = Policy::zeros(knots.dimensions, steps);
    policy.clamped.fill(true);
    let (horizon, _) = Horizon::proved(&knots, &policy, &noise, 1.0, 0.0).unwrap();
    let (mut covariance, mut free) = (DMatrix::identity(2, 2), 1.0);
    for t in 0..=steps {
        free += (&system.q * &covariance).trace();
        covariance = &system.a * covariance * system.a.transpose() + &system.w;
        assert!(t == steps || dense(&horizon.prices, t).norm() == 0.0);
    }
    assert!((horizon.base_cost - free).abs() < 1e-12 * free, "{} {free}", horizon.base_cost);
}

/// Controls that lower the cost without limit have no law.
#[test]
fn a_cost_that_is_not_convex_has_no_law() {
    let system = System { r: of(1, &[-9.0]), ..with_zero(0.5, 0.1) };
    let (knots, noise) = system.knots(5);
    let policy = Policy::zeros(knots.dimensions, 5);
    let reason = Horizon::proved(&knots, &policy, &noise, 0.0, 0.0).unwrap_err();
    assert!(reason.contains("not convex"), "{reason}");
}

/// The minimum in the steady state, proved, attained and agreed upon by so many steps of another filter.
fn attained(system: &Stationary, cost: f64, steps: usize) -> f64 {
    let found = stationary_minimum(system, cost, &BoundSettings::default()).unwrap();
    assert!(matches!(found.proof, Proof::Proved { distance } if distance < 1e-9), "{:?}", found.proof);
    let achieved = found.achieved.unwrap();
    assert!(achieved.cost <= cost * (1.0 + 1e-8), "{achieved:?} {cost}");
    assert!(found.lower_nats <= found.nats && found.lower_nats <= achieved.nats, "{found:?}");
    assert!(found.nats - found.lower_nats < 1e-5, "{} {}", found.nats, found.lower_nats);
    if found.virtual_sensor().rank == 0 || steps == 0 {
        return found.nats;
    }
    let (rate, price) = filtered(system, &found, steps);
    assert!((rate - achieved.nats).abs() < 1e-6 * rate, "{rate} {achieved:?}");
    let budget = cost - system.base_cost;
    assert!((price + system.base_cost - achieved.cost).abs() < 1e-6 * budget, "{price} {achieved:?}");
    found.nats
}

/// `x+ = a x + (u some steps ago) + w`: eigenvalues at 0 in long chains. `x` is as uncertain as that long ahead,
/// whatever the control, and what is measured matters as much later.
#[test]
fn actuators_with_delays_have_a_steady_state() {
    for (growth, delay, price) in [(1.1, 3, 0.0), (1.1, 17, 0.0), (1.0, 10, 0.0), (0.9, 10, 1.0), (1.1, 10, 1.0)] {
        let n = delay + 1;
        let mut system = System {
            a: DMatrix::from_fn(n, n, |i, j| f64::from(u8::from(i >= 2 && j + 1 == i))),
            b: DMatrix::from_fn(n, 1, |i, _| f64::from(u8::from(i == 1))),
            w: DMatrix::zeros(n, n),
            q: DMatrix::zeros(n, n),
            r: of(1, &[price]),
        };
        (system.a[(0, 0)], system.a[(0, delay)]) = (growth, 1.0);
        (system.w[(0, 0)], system.q[(0, 0)]) = (1.0, 1.0);
        let stationary = system.stationary();
        let least: f64 = (0..=delay as i32).map(|k| f64::powi(growth * growth, k)).sum();
        if price == 0.0 {
            assert!((stationary.base_cost - least).abs() < 1e-9 * least, "{} {least}", stationary.base_cost);
        }
        let (few, more) = (1.05 * stationary.base_cost, 1.2 * stationary.base_cost);
        let (dear, cheap) = (attained(&stationary, few, 3000), attained(&stationary, more, 3000));
        assert!(dear > cheap && cheap >= growth.ln().max(0.0) - 1e-9, "{growth} {delay}: {dear} {cheap}");
        let (knots, noise) = system.knots(2);
        let own = own_rates(&stationary, &knots, &noise).unwrap().unwrap();
        let at_own = stationary_minimum(&stationary, stationary.base_cost + own.price, &BoundSettings::default());
        assert!(at_own.unwrap().lower_nats <= own.measurement_nats * (1.0 + 1e-9), "{own:?}");
    }
}

/// States that no noise drives become known, however slowly: a filter's rates are those of the other states alone, where
/// the known ones are constant, turn or vanish, and where they drive the others or disturb the sensors.
#[test]
fn states_that_nothing_drives_become_known() {
    let rates = |a: &[f64], w: &[f64], sensors: &[f64]| {
        let n = w.len();
        let first = |i: usize, j: usize| f64::from(u8::from(i == 0 && j == 0));
        let (a, w) = (of(n, a), DMatrix::from_diagonal(&DVector::from_row_slice(w)));
        let (b, q) = (DMatrix::from_fn(n, 1, first), DMatrix::from_fn(n, n, first));
        let system = System { a, b, w, q, r: of(1, &[1.0]) };
        let (mut knots, noise) = system.knots(2);
        (0..=2).for_each(|t| store(&mut knots.measurement, t, &of(n, sensors)));
        let own = own_rates(&system.stationary(), &knots, &noise).unwrap().unwrap();
        [own.price, own.measurement_nats, own.control_nats.unwrap()]
    };
    let (sin, cos) = 0.3_f64.sin_cos();
    let turning = [1.0, 0.0, 0.0, 0.0, cos, sin, 0.0, -sin, cos];
    let alone = rates(&[1.0], &[0.1], &[1.0]);
    for (name, found) in [
        ("constant", rates(&[1.0, 0.0, 0.0, 1.0], &[0.1, 0.0], &[1.0, 0.0, 0.0, 1.0])),
        ("an offset of the sensor", rates(&[1.0, 0.0, 0.0, 1.0], &[0.1, 0.0], &[1.0, 1.0, 0.0, 1.0])),
        ("a decaying push", rates(&[1.0, 0.3, 0.0, 0.9], &[0.1, 0.0], &[1.0, 0.0, 0.0, 0.0])),
        ("turning", rates(&turning, &[0.1, 0.0, 0.0], &[1.0, 0.5, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0])),
    ] {
        let close = alone.iter().zip(&found).all(|(alone, found)| (alone - found).abs() <= 1e-9 * alone);
        assert!(close, "{name}: {found:?} for {alone:?}");
    }
    // All known, so that nothing is measured.
    assert_eq!(rates(&[1.0], &[0.0], &[1.0]), [0.0; 3]);
    // Growing without noise: as much information as growth. Constant, undriven and unseen: as uncertain as at first.
    let [_, measured, _] = rates(&[2.0], &[0.0], &[1.0]);
    assert!((measured - 2f64.ln()).abs() < 1e-9, "{measured}");
}

/// A cart with a pendulum, held upright, sampled at 20 and at 100 Hz: slow modes beside fast ones.
#[test]
fn a_cart_pole_at_any_cost() {
    let slow = of(
        4,
        &[
            1.0,
            0.049_773_098_045_225_096,
            0.003_355_963_057_773_744_6,
            5.582_966_764_729_548_5e-5,
            0.0,
            0.990_924_968_688_301_3,
            0.134_908_308_350_697_64,
            0.003_355_963_057_773_744,
            0.0,
            -0.000_570_160_220_484_835_7,
            1.039_245_951_786_772_5,
            0.050_652_508_255_970_81,
            0.0,
            -0.022_920_201_894_444_034,
            1.579_523_535_854_428_4,
            1.039_245_951_786_772_5,
        ],
    );
    let fast = of(
        4,
        &[
            1.0,
            0.009_990_914_091_648_278,
            0.000_133_726_474_101_889_04,
            4.457_760_504_322_141e-7,
            0.0,
            0.998_183_267_539_677_3,
            0.026_744_150_811_284_062,
            0.000_133_726_474_101_889,
            0.0,
            -2.271_941_456_029_374e-5,
            1.001_560_885_157_939_4,
            0.010_005_202_578_060_767,
            0.0,
            -0.004_543_688_551_016_658,
            0.312_237_970_255_150_5,
            1.001_560_885_157_939_4,
        ],
    );
    let by_slow =
        [0.002_269_019_547_749_006, 0.090_750_313_116_987_88, 0.005_701_602_204_848_358, 0.229_202_018_944_440_37];
    let by_fast =
        [9.085_908_351_725_655e-5, 0.018_167_324_603_226_096, 0.000_227_194_145_602_937_37, 0.045_436_885_510_166_58];
    let diagonal = |entries: [f64; 4]| DMatrix::from_diagonal(&DVector::from_row_slice(&entries));
    let all = diagonal([1e-3; 4]);
    let pushed = diagonal([0.0, 1e-4, 0.0, 1e-4]);
    for (a, b, w, q) in [
        (&slow, by_slow, &all, DMatrix::identity(4, 4)),
        (&slow, by_slow, &all, diagonal([1.0, 0.0, 10.0, 0.0])),
        (&fast, by_fast, &pushed, diagonal([1.0, 0.0, 10.0, 0.0])),
    ] {
        let system = System { a: a.clone(), b: of(4, &b), w: w.clone(), q, r: of(1, &[0.1]) };
        let stationary = system.stationary();
        // What grows must be known, whatever it costs.
        let growth: f64 = a.complex_eigenvalues().iter().map(|root| root.norm().ln()).filter(|log| *log > 1e-9).sum();
        let mut last = f64::INFINITY;
        for beyond in [1.0, 100.0, 1e4, 1e6] {
            // Beyond, a filter in double precision does not settle.
            let steps = if beyond > 1e4 { 0 } else { 100_000 };
            let found = attained(&stationary, stationary.base_cost * (1.0 + beyond), steps);
            assert!(found < last && found > growth - 1e-6, "{beyond}: {found} {growth}");
            last = found;
        }
        assert!(last < growth + 0.01, "{last} {growth}");
    }
}

/// An AR(3) signal that is tracked at no cost of the control; what is measured must save all that it can.
#[test]
fn an_autoregression_of_three_terms() {
    let mut a = DMatrix::zeros(4, 4);
    a.view_mut((0, 0), (3, 3)).copy_from(&of(3, &[0.5, 0.25, 0.15, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]));
    a[(3, 0)] = 1.0;
    let mut w = DMatrix::zeros(4, 4);
    w[(0, 0)] = 1.0;
    let mut q = DMatrix::zeros(4, 4);
    q[(3, 3)] = 1.0;
    let system = System { a, b: of(4, &[0.0, 0.0, 0.0, -1.0]), w, q, r: of(1, &[0.0]) };
    let stationary = system.stationary();
    assert_eq!(stationary.base_cost, 0.0);
    let (loose, tight) = (attained(&stationary, 1.0, 3000), attained(&stationary, 0.2, 3000));
    // To know the signal for a tenth of its variance takes about 1/2 log 10 nats more.
    assert!(loose > 0.1 && tight > loose + 0.5, "{loose} {tight}");
}

/// The rows of masses on springs, pulled by a force on the first one, after steps by the exponential of the equations of
/// motion: where all of them are counts for nothing, but for the last digit of a decimal.
#[test]
fn masses_that_float_freely_need_no_information_about_where_they_are() {
    let a = of(
        4,
        &[
            0.999_800_209_837_899_2,
            0.000_199_790_162_100_791_05,
            0.009_989_344_344_908_17,
            1.065_565_509_182_882_4e-5,
            9.989_508_105_039_549e-5,
            0.999_900_104_918_949_7,
            5.327_827_545_914_412e-6,
            0.009_994_672_172_454_084,
            -0.039_936_066_069_449_02,
            0.039_936_066_069_449_03,
            0.997_803_406_534_426_8,
            0.002_196_593_465_573_242_4,
            0.019_968_033_034_724_508,
            -0.019_968_033_034_724_51,
            0.001_098_296_732_786_621_2,
            0.998_901_703_267_213_4,
        ],
    );
    let b = of(
        4,
        &[4.996_502_701_679_85e-5, 1.748_649_160_074_740_7e-8, 0.009_989_344_344_908_17, 5.327_827_545_914_41e-6],
    );
    let mut w = DMatrix::zeros(4, 4);
    (w[(2, 2)], w[(3, 3)]) = (1e-4, 1e-4);
    let mut q = DMatrix::zeros(4, 4);
    q.view_mut((0, 0), (2, 2)).copy_from(&of(2, &[1.0, -1.0, -1.0, 1.0]));
    let system = System { a, b, w, q, r: of(1, &[0.1]) };
    let stationary = system.stationary();
    assert_eq!((stationary.costly.rows(), stationary.unpriced.cols()), (2, 2));
    // Where they are is not known in the end, at no cost.
    let open = stationary.unmeasured_cost().unwrap().unwrap();
    assert!(open > 2.0 * stationary.base_cost && open < 3.0 * stationary.base_cost, "{open}");
    assert_eq!(attained(&stationary, 1.01 * open, 0), 0.0);
    let (few, more) = (1.05 * stationary.base_cost, 1.5 * stationary.base_cost);
    let (dear, cheap) = (attained(&stationary, few, 0), attained(&stationary, more, 0));
    assert!(dear > cheap && cheap > 1e-3, "{dear} {cheap}");
    // The stretch alone, as a system of its own.
    let found = stationary_minimum(&stationary, more, &BoundSettings::default()).unwrap();
    let sensor = found.virtual_sensor();
    for row in 0..sensor.rank {
        let c = |i: usize| sensor.measurement.get(0, row, i);
        assert!((c(0) + c(1)).abs() < 1e-9 * c(0).abs() && (c(2) + c(3)).abs() < 1e-9 * c(2).abs().max(c(0).abs()));
    }
}

/// What less cost takes is enough for more: the minimum does not rise with the cost, however small it is.
#[test]
fn a_minimum_far_below_the_gap_falls_with_the_cost() {
    let system = System {
        a: of(2, &[0.5, 1e-4, 0.0, 1.0]),
        b: DMatrix::identity(2, 2),
        w: DMatrix::identity(2, 2),
        q: of(2, &[1.0, 0.0, 0.0, 0.0]),
        r: DMatrix::identity(2, 2),
    };
    let stationary = system.stationary();
    let at = |cost: f64| stationary_minimum(&stationary, cost, &BoundSettings::default()).unwrap();
    let found: Vec<MinimumOf> = [1.2, 2.0, 3.27, 20.0, 1133.9].into_iter().map(|cost| of_minimum(&at(cost))).collect();
    assert!(found.windows(2).all(|pair| pair[1].nats < pair[0].nats), "{found:?}");
    assert!(found.iter().all(|one| one.nats > 0.0 && one.lower <= one.nats), "{found:?}");
    assert!(found[1].nats < 3.1e-8 && found[1].lower > 0.99 * found[1].nats, "{found:?}");
    assert!(found[4].nats < 3e-11, "{found:?}");
    // What is far from proved is not.
    assert!(found.iter().all(|one| one.lower > 0.0 || !one.proved), "{found:?}");
}

#[derive(Debug)]
struct MinimumOf {
    nats: f64,
    lower: f64,
    proved: bool,
}

fn of_minimum(found: &StationaryMinimum) -> MinimumOf {
    let proved = matches!(found.proof, Proof::Proved { .. });
    MinimumOf { nats: found.nats, lower: found.lower_nats, proved }
}

/// A point mass, sampled 10 000 times per second, at costs of which some were refused: at each the rate is that of
/// continuous time, which falls as the fourth root of the cost.
#[test]
fn fast_sampling_of_an_integrator_at_any_cost() {
    let system = System {
        a: of(2, &[1.0, 1e-4, 0.0, 1.0]),
        b: of(2, &[0.0, 1e-4]),
        w: of(2, &[0.0, 0.0, 0.0, 1e-6]),
        q: of(2, &[1e-4, 0.0, 0.0, 0.0]),
        r: of(1, &[1e-6]),
    };
    let stationary = system.stationary();
    let mut last = f64::INFINITY;
    for times in [1.03, 3.0, 21.0, 31.0, 101.0, 1001.0] {
        let cost = times * stationary.base_cost;
        let found = stationary_minimum(&stationary, cost, &BoundSettings::default()).unwrap();
        assert!(matches!(found.proof, Proof::Proved { .. }), "{times}: {:?}", found.proof);
        assert!(found.lower_nats > 0.999 * found.nats && found.nats < last, "{times}: {found:?}");
        last = found.nats;
    }
}

/// A state that is coupled so weakly that its price settles after 10^12 steps, and one that disturbs what a free control
/// cancels: both regulators exist, and what they price is paid.
#[test]
fn weak_couplings_and_free_controls_have_regulators_that_are_proved() {
    let weak = |coupling: f64, growth: f64| System {
        a: of(2, &[0.5, coupling, 0.0, growth]),
        b: DMatrix::identity(2, 2),
        w: DMatrix::identity(2, 2),
        q: of(2, &[1.0, 0.0, 0.0, 0.0]),
        r: DMatrix::identity(2, 2),
    };
    // u = -diag(.25, .5) x costs 1.4667.
    let stationary = weak(1e-12, 1.0).stationary();
    assert!(stationary.base_cost < 1.4667 && stationary.base_cost > 1.1, "{}", stationary.base_cost);
    weak(1e-14, 1.05).stationary();
    let cancelled = System {
        a: of(3, &[1.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0]),
        b: of(3, &[0.0, 1.0, 0.0]),
        w: DMatrix::identity(3, 3),
        q: of(3, &[1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]),
        r: of(1, &[0.0]),
    };
    let stationary = cancelled.stationary();
    assert!((stationary.base_cost - 3.0).abs() < 1e-12, "{}", stationary.base_cost);
    // By a semidefinite program: 1.360996 bits.
    let bits = attained(&stationary, 6.0, 0) / std::f64::consts::LN_2;
    assert!((bits - 1.360_996).abs() < 1e-6, "{bits}");
}

/// A horizon whose least cost is known to 1e-10 of it: the bound is that of the least budget that there may be.
#[test]
fn what_a_plan_costs_is_known_only_up_to_rounding() {
    let system = System { r: of(1, &[0.3]), ..with_zero(2.0, 0.1) };
    let (knots, noise) = system.knots(8);
    let mut policy = Policy::zeros(knots.dimensions, 8);
    solve_riccati(&knots.dynamics, &knots.cost, Regularisation::default(), &mut policy).unwrap();
    let of = |rounding: f64| Horizon::proved(&knots, &policy, &noise, 1e6, rounding).unwrap();
    let ((exact, _), (same, spread)) = (of(0.0), of(1e-4));
    assert!((exact.base_cost - same.base_cost).abs() < 1e-8 && spread.least.iter().all(|off| *off >= 1e-4));
    let cost = exact.base_cost + 0.1 * (exact.unmeasured().cost - exact.base_cost);
    let settings = BoundSettings::default();
    let sharp = minimum_information(&exact, cost, &settings).unwrap();
    let found = minimum_information_within(&same, &spread, cost, &settings).unwrap();
    let more = minimum_information(&exact, cost + 1e-4, &settings).unwrap();
    assert!(found.lower_nats > 0.0 && found.lower_nats <= more.nats && more.nats < sharp.lower_nats, "{found:?}");
}
