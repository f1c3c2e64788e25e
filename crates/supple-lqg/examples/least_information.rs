//! The least information that keeps a cost over a horizon, over all sensors and controllers, at several cost limits.

#![allow(clippy::print_stdout)]

use supple_lqg::bound::{BoundSettings, minimum_information, virtual_sensors};
use supple_lqg::{Error, Horizon, Knots, LinearQuadratic, Noise, Policy, Regularisation, constant, solve_riccati};

/// Prints it.
///
/// # Errors
/// Where something cannot be computed.
pub fn main() -> Result<(), Error> {
    // An inverted pendulum, linearised upright, 50 steps of 20 ms, with a torque.
    let (a, b, c) = ([[1.0, 0.02], [0.4, 1.0]], [[0.0], [0.02]], [[1.0, 0.0]]);
    let plant = LinearQuadratic { a: &a, b: &b, c: &c, q: &[[10.0, 0.0], [0.0, 1.0]], r: &[[0.01]] };
    let knots = Knots::linear(50, plant)?;
    let mut policy = Policy::zeros(knots.dimensions, 50);
    solve_riccati(&knots.dynamics, &knots.cost, Regularisation::default(), &mut policy)?;
    let noise = Noise {
        initial: constant(&[[1e-2, 0.0], [0.0, 1e-2]]),
        process: constant(&[[1e-8, 0.0], [0.0, 1e-4]]),
        measurement: constant(&[[1.0]]),
    };
    let horizon = Horizon::along(&knots, &policy, &noise, 0.0)?;
    println!("the least cost, with the state known exactly: {:.4}", horizon.base_cost);
    println!("cost limit   least information, bits   proved, bits   numbers that the sensor measures");
    let mut last = f64::INFINITY;
    for share in [1.05, 1.2, 1.5, 2.0] {
        let limit = share * horizon.base_cost;
        let found = minimum_information(&horizon, limit, &BoundSettings::default())?;
        let bits = |nats: f64| nats / std::f64::consts::LN_2;
        let rank = virtual_sensors(&found).iter().map(|sensor| sensor.rank).max().unwrap_or(0);
        println!("{limit:10.4} {:25.3} {:14.3} {rank:10}", bits(found.nats), bits(found.lower_nats));
        assert!(found.lower_nats <= found.nats && found.nats < last, "a looser limit needs less");
        last = found.nats;
    }
    Ok(())
}
