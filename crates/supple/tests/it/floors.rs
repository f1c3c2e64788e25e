//! Bounds in closed form: the data-rate floor, that of Kostina and Hassibi, and what quantisers cost.

use nalgebra::DMatrix;
use supple::Matrices;
use supple::bound::{Stationary, Vacuous, data_rate_floor, kostina_hassibi, product_growth, quantiser_bound};

const LN_2: f64 = std::f64::consts::LN_2;

/// The plant of Tanaka, Esfahani and Mitter (IEEE TAC 2018), as printed there.
fn tanaka() -> [DMatrix<f64>; 3] {
    let a = [0.12, 0.63, -0.52, 0.33, 0.26, -1.28, 1.57, 1.13, -1.77, -0.30, 0.77, 0.25, -0.16, 0.20, -0.58, 0.56];
    let b = [0.66, -0.58, 0.03, -0.20, 2.61, -0.91, 0.87, -0.07, -0.64, -1.12, -0.19, 0.61, 0.93, 0.58, -1.18, -1.21];
    let w = [4.94, -0.10, 1.29, 0.35, -0.10, 5.55, 2.07, 0.31, 1.29, 2.07, 2.02, 1.43, 0.35, 0.31, 1.43, 3.10];
    [a, b, w].map(|entries| DMatrix::from_row_slice(4, 4, &entries))
}

fn matrices(matrix: &DMatrix<f64>) -> Matrices {
    let mut out = Matrices::constant(matrix.nrows(), matrix.ncols());
    for (i, j) in (0..matrix.nrows()).flat_map(|i| (0..matrix.ncols()).map(move |j| (i, j))) {
        out.set(0, i, j, matrix[(i, j)]);
    }
    out
}

/// What the noise costs with the state known, and the price of not knowing it, for the cost `x'x + u'u` per step: by the
/// Riccati equation, iterated until it rests.
fn stationary(a: &DMatrix<f64>, b: &DMatrix<f64>, w: &DMatrix<f64>) -> Stationary {
    let n = a.nrows();
    let identity = DMatrix::identity(n, n);
    let mut s = identity.clone();
    let mut m = s.clone();
    for _ in 0..3000 {
        let gain = (DMatrix::identity(b.ncols(), b.ncols()) + b.transpose() * &s * b).try_inverse().unwrap();
        m = &s * b * gain * b.transpose() * &s;
        s = &identity + a.transpose() * (&s - &m) * a;
        s = 0.5 * (&s + s.transpose());
    }
    let price = a.transpose() * m * a;
    let unpriced = Matrices::constant(n, 0);
    Stationary {
        dynamics: matrices(a),
        process: matrices(w),
        price: matrices(&price),
        base_cost: (w * s).trace(),
        unpriced,
        costly: Matrices::constant(0, n),
    }
}

#[test]
fn the_plant_of_tanaka_has_the_known_floor_and_least_cost() {
    let [a, b, w] = tanaka();
    let plant = stationary(&a, &b, &w);
    let floor = data_rate_floor(&plant.dynamics).unwrap() / LN_2;
    assert!((floor - 1.168539).abs() < 1e-6, "{floor}");
    assert!((plant.base_cost - 31.48334).abs() < 1e-5, "{}", plant.base_cost);
}

#[test]
fn the_bound_of_kostina_and_hassibi_at_the_plant_of_tanaka() {
    let [a, b, w] = tanaka();
    let plant = stationary(&a, &b, &w);
    let floor = data_rate_floor(&plant.dynamics).unwrap();
    let known = [
        (33.0, 5.778),
        (35.0, 3.881),
        (40.0, 2.338),
        (50.0, 1.436),
        (60.0, 1.101),
        (80.0, 0.816),
        (100.0, 0.689),
        (200.0, 0.495),
        (1000.0, 0.380),
    ];
    for (cost, bits) in known {
        let found = kostina_hassibi(&plant, cost, floor);
        assert!((found.nats / LN_2 - bits).abs() < 6e-4, "at {cost}: {} and {bits}", found.nats / LN_2);
        assert_eq!(found.vacuous, (cost >= 60.0).then_some(Vacuous::LooseCost), "at {cost}");
    }
}

#[test]
fn it_is_the_printed_form_and_the_minimum_of_scalars() {
    // log a + 1/2 log(1 + W M / (D - D_min)) is the minimum of a scalar plant.
    for (slope, cost, bits) in [(1.5, 3.1562392, 1.6893249), (0.8, 1.6439429, 0.658_003_9)] {
        let one = |value: f64| DMatrix::from_element(1, 1, value);
        let plant = stationary(&one(slope), &one(1.0), &one(1.0));
        let found = kostina_hassibi(&plant, cost, data_rate_floor(&plant.dynamics).unwrap());
        assert!((cost - 1.2 * plant.base_cost).abs() < 1e-6 && (found.nats / LN_2 - bits).abs() < 1e-6, "{found:?}");
        let (a, m) = (slope, plant.price.get(0, 0, 0) / slope / slope);
        let printed = a.ln() + 0.5 * (m / (cost - plant.base_cost)).ln_1p();
        assert!((found.nats - printed).abs() < 1e-12, "{} and {printed}", found.nats);
    }
}

#[test]
fn a_singular_plant_or_noise_or_price_is_told_apart() {
    let [a, b, mut w] = tanaka();
    let plant = stationary(&a, &b, &w);
    let few = stationary(&a, &b.columns(0, 2).into_owned(), &w);
    assert_eq!(kostina_hassibi(&few, few.base_cost + 1.0, 0.0).vacuous, Some(Vacuous::SingularPrice));
    w.row_mut(2).fill(0.0);
    w.column_mut(2).fill(0.0);
    let still = Stationary { process: matrices(&w), ..plant.clone() };
    assert_eq!(kostina_hassibi(&still, 40.0, 0.0).vacuous, Some(Vacuous::SingularProcess));
    // A singular A leaves what the noise asks for.
    let nothing = Stationary { dynamics: matrices(&DMatrix::zeros(4, 4)), ..plant };
    let found = kostina_hassibi(&nothing, 40.0, 0.0);
    assert!(found.nats.is_finite() && found.vacuous.is_none(), "{found:?}");
}

#[test]
fn units_of_states_change_no_bound() {
    let [a, b, w] = tanaka();
    let plant = stationary(&a, &b, &w);
    let units = DMatrix::from_diagonal(&nalgebra::DVector::from_vec(vec![1e-9, 1.0, 1e6, 1e9]));
    let back = units.clone().try_inverse().unwrap();
    let other = Stationary {
        dynamics: matrices(&(&units * &a * &back)),
        process: matrices(&(&units * &w * &units)),
        price: {
            let price = DMatrix::from_fn(4, 4, |i, j| plant.price.get(0, i, j));
            matrices(&(&back * price * &back))
        },
        base_cost: plant.base_cost,
        unpriced: plant.unpriced.clone(),
        costly: plant.costly.clone(),
    };
    let floors = [&plant, &other].map(|plant| data_rate_floor(&plant.dynamics).unwrap());
    assert!((floors[0] - floors[1]).abs() < 1e-10, "{floors:?}");
    let bounds = [&plant, &other].map(|plant| kostina_hassibi(plant, 40.0, floors[0]).nats);
    assert!((bounds[0] - bounds[1]).abs() < 1e-9, "{bounds:?}");
}

#[test]
fn eigenvalues_that_iterations_stall_at_are_found() {
    let mut cyclic = DMatrix::zeros(4, 4);
    (0..4).for_each(|i| cyclic[(i, (i + 1) % 4)] = 2.0);
    assert!((data_rate_floor(&matrices(&cyclic)).unwrap() - 4.0 * LN_2).abs() < 1e-12);
    // Two integrators in a row grow, but no faster than any exponential.
    let integrators = DMatrix::from_row_slice(2, 2, &[1.0, 0.1, 0.0, 1.0]);
    assert!(data_rate_floor(&matrices(&integrators)).unwrap() < 1e-7);
    assert_eq!(data_rate_floor(&matrices(&DMatrix::zeros(3, 3))).unwrap(), 0.0);
    let error = data_rate_floor(&matrices(&DMatrix::from_element(1, 1, f64::NAN))).unwrap_err().to_string();
    assert_eq!(error, "the dynamics is not finite at step 0");
}

#[test]
fn the_growth_of_a_long_product_tends_to_the_floor_and_is_no_bound_before() {
    let [a, ..] = tanaka();
    let floor = data_rate_floor(&matrices(&a)).unwrap() / LN_2;
    let growth = |steps: usize| product_growth(&matrices(&a), steps).unwrap() / LN_2 / steps as f64;
    assert!((growth(4000) - floor).abs() < 1e-2, "{} and {floor}", growth(4000));
    // Over two steps nothing need be known at a cost of 80 per step, and yet the product grows.
    assert!(growth(2) > 1.0, "{}", growth(2));
}

#[test]
fn quantisers_cost_three_quarters_of_a_bit_by_number_and_one_by_message() {
    let loss = quantiser_bound(10.0, &[2]) - 11.0;
    assert!((loss - 1.509_229).abs() < 1e-6, "{loss}");
    assert_eq!(quantiser_bound(0.0, &[0, 0]), 0.0);
    assert!((quantiser_bound(3.0, &[2, 0, 2]) - 3.0 - 2.0 * (1.0 + loss)).abs() < 1e-12);
}

/// A matrix in other, badly scaled coordinates.
fn disguised(matrix: &DMatrix<f64>, seed: usize) -> Matrices {
    let n = matrix.nrows();
    let turn = DMatrix::from_fn(n, n, |i, j| ((seed * 17 + i * 7 + j * 13 + i * j) as f64).sin()).qr().q();
    let units = DMatrix::from_fn(n, n, |i, j| if i == j { 10f64.powi(((i + seed) % 3) as i32 - 1) } else { 0.0 });
    let to = &units * turn;
    matrices(&(&to * matrix * to.clone().try_inverse().unwrap()))
}

#[test]
fn integrators_in_a_row_have_no_floor_and_hide_none() {
    for seed in 0..40 {
        for orders in [&[2][..], &[3], &[4], &[5], &[2, 2], &[2, 2, 2, 2, 2, 2, 2], &[3, 2, 1]] {
            let n: usize = orders.iter().sum();
            let mut rows = DMatrix::identity(n + 1, n + 1);
            let mut first = 0;
            for &order in orders {
                (first..first + order - 1).for_each(|i| rows[(i, i + 1)] = 0.1);
                first += order;
            }
            let floor = data_rate_floor(&disguised(&rows, seed)).unwrap();
            assert_eq!(floor, 0.0, "{orders:?}, {seed}");
            // A pendulum beside them.
            rows[(n, n)] = 1.05;
            let floor = data_rate_floor(&disguised(&rows, seed)).unwrap();
            let known = 1.05_f64.ln();
            assert!(floor <= known && floor > known - 1e-6, "{orders:?}, {seed}: {floor}");
        }
    }
}
