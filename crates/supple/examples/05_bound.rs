//! How little information would do: for a linear plant in its steady state, and for two masses that meet a wall.
//!
//! Run by `cargo run --release -p supple --example 05_bound`. Its twin in Python, `python/examples/05_bound.py`, prints the
//! same.

use std::error::Error;
use std::io::Write;

use supple::bound::BoundOptions;

fn main() -> Result<(), Box<dyn Error>> {
    run("tasks", &mut std::io::stdout())
}

/// Bounds of the plant over costs, then of the masses at two designs; `folder` holds the task files.
pub fn run(folder: &str, out: &mut dyn Write) -> Result<(), Box<dyn Error>> {
    let plant = supple_file::load(format!("{folder}/tanaka_plant.toml"))?;
    for cost in [33.0, 40.0, 60.0, 1000.0] {
        let options = BoundOptions { stationary: true, cost: Some(cost), ..Default::default() };
        let bound = &plant.bound(&plant.parameters.initial(), &options)?.tasks[0];
        writeln!(
            out,
            "cost {cost:6.1}: floor {:.4}, Kostina-Hassibi {:.4}, minimum {:.4} bits per step, rank {}",
            bound.floor_bits_per_step,
            bound.kostina_hassibi_bits_per_step.ok_or("no bound of Kostina and Hassibi")?,
            bound.minimum_bits_per_step,
            bound.virtual_sensor.rank
        )?;
    }
    let masses = supple_file::load(format!("{folder}/two_mass.toml"))?;
    for design in [[500.0, 500.0], [135.912, 171.458]] {
        let mut phi = masses.parameters.initial();
        phi[..2].copy_from_slice(&design);
        let bound = &masses.bound(&phi, &BoundOptions::default())?.tasks[0];
        let [controls, measurements] = [bound.control_bits_per_step, bound.measurement_bits_per_step];
        writeln!(
            out,
            "k1 = {:.0}, k2 = {:.0}: minimum {:.4}, controls {:.4}, measurements {:.4} bits per step, efficiency {:.1} %",
            design[0],
            design[1],
            bound.minimum_bits_per_step,
            controls.ok_or("no controls")?,
            measurements.ok_or("no measurements")?,
            100.0 * bound.efficiency.ok_or("no efficiency")?
        )?;
    }
    Ok(())
}
