//! The expected cost of a closed loop, the bits that its sensor gives, and how both change with the sensor's noise.

#![allow(clippy::print_stdout)]

use supple_lqg::{
    Belief, BeliefAdjoint, BeliefSeeds, Error, Horizon, Information, KnotAdjoints, Knots, LinearQuadratic, Noise,
    Policy, Regularisation, constant, control_information, information, kalman, reverse_kalman, solve_riccati,
};

const STEPS: usize = 100;

/// Prints it.
///
/// # Errors
/// Where something cannot be computed.
pub fn main() -> Result<(), Error> {
    // A mass that is pushed to 0, and whose position is measured every 0.1 s.
    let (a, b, c) = ([[1.0, 0.1], [0.0, 1.0]], [[0.005], [0.1]], [[1.0, 0.0]]);
    let plant = LinearQuadratic { a: &a, b: &b, c: &c, q: &[[1.0, 0.0], [0.0, 0.1]], r: &[[0.01]] };
    let knots = Knots::linear(STEPS, plant)?;
    let mut policy = Policy::zeros(knots.dimensions, STEPS);
    solve_riccati(&knots.dynamics, &knots.cost, Regularisation::default(), &mut policy)?;

    let noise = |variance: f64| Noise {
        initial: constant(&[[0.01, 0.0], [0.0, 0.01]]),
        process: constant(&[[1e-6, 0.0], [0.0, 1e-4]]),
        measurement: constant(&[[variance]]),
    };
    println!("variance   expected cost   measured, bits   used, bits");
    for variance in [1e-5, 1e-4, 1e-3] {
        let noise = noise(variance);
        let mut belief = Belief::zeros(2, 1, STEPS);
        kalman(&knots, &noise, &mut belief)?;
        let horizon = Horizon::along(&knots, &policy, &noise, 0.0)?;
        let paid: f64 = (0..STEPS).map(|t| trace(&horizon.prices, &belief.corrected, t)).sum();
        let used: f64 = control_information(&knots, &policy, &belief, &noise)?.iter().sum();
        let bits = |nats: f64| nats / std::f64::consts::LN_2;
        let measured = nats(&belief, &noise)?;
        println!("{variance:8.0e} {:15.4} {:16.1} {:12.1}", horizon.base_cost + paid, bits(measured), bits(used));
    }

    // The derivative of the information by the variance: one reverse sweep, whatever it is taken by.
    let at = noise(1e-4);
    let mut belief = Belief::zeros(2, 1, STEPS);
    kalman(&knots, &at, &mut belief)?;
    let mut adjoints = KnotAdjoints::zeros(knots.dimensions, STEPS);
    let mut by_noise = Noise::zeros(2, 1);
    let seeds = BeliefSeeds { information: 1.0, ..BeliefSeeds::default() };
    reverse_kalman(&knots, &at, &belief, seeds, &mut BeliefAdjoint::new(2, 1), &mut adjoints, &mut by_noise);

    let mut beside = [0.0; 2];
    for (value, step) in beside.iter_mut().zip([-1e-9, 1e-9]) {
        let noise = noise(1e-4 + step);
        kalman(&knots, &noise, &mut belief)?;
        *value = nats(&belief, &noise)?;
    }
    let (exact, difference) = (by_noise.measurement.get(0, 0, 0), (beside[1] - beside[0]) / 2e-9);
    println!("d information / d variance: {exact:.2} nats, and {difference:.2} by differences");
    assert!((exact / difference - 1.0).abs() < 1e-4, "the adjoint is the derivative");
    Ok(())
}

fn nats(belief: &Belief, noise: &Noise) -> Result<f64, Error> {
    let mut found = Information::default();
    information(belief, noise, &mut found)?;
    Ok(found.total)
}

/// `Tr(a_t b_t)`
fn trace(a: &supple_lqg::Matrices, b: &supple_lqg::Matrices, t: usize) -> f64 {
    (0..a.rows()).flat_map(|i| (0..a.cols()).map(move |j| (i, j))).map(|(i, j)| a.get(t, i, j) * b.get(t, j, i)).sum()
}
