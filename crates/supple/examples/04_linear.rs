//! A linear problem from arrays: how much a controller must know of a mass that is pushed around, by its sensor's noise.
//!
//! Run by `cargo run --release -p supple --example 04_linear`. Its twin in Python, `python/examples/04_linear.py`, prints
//! the same.

use std::error::Error;
use std::io::Write;

use supple::noise::{Covariance, NoiseModel};
use supple::parameters::Parameters;
use supple::system::{Arrays, Sequence};
use supple::{EvaluateOptions, Matrices, Problem, Task};

const STEPS: usize = 100;

/// The same matrix at every step, by rows.
fn constant<const N: usize>(rows: &[[f64; N]]) -> Matrices {
    let mut matrix = Matrices::constant(rows.len(), N);
    for (i, row) in rows.iter().enumerate() {
        row.iter().enumerate().for_each(|(j, &entry)| matrix.set(0, i, j, entry));
    }
    matrix
}

/// A mass of 1 kg at steps of 0.05 s, in a field that pushes it away from 0 more and more.
fn arrays() -> Arrays {
    let mut dynamics = Matrices::zeros(STEPS, 2, 2);
    for t in 0..STEPS {
        let push = 2.0 * t as f64 / (STEPS - 1) as f64;
        for (i, j, entry) in [(0, 0, 1.0), (0, 1, 0.05), (1, 0, 0.05 * push), (1, 1, 1.0)] {
            dynamics.set(t, i, j, entry);
        }
    }
    Arrays {
        A: dynamics,
        B: constant(&[[0.0], [0.05]]),
        C: constant(&[[1.0, 0.0]]),
        c: None,
        d: None,
        Q: constant(&[[1.0, 0.0], [0.0, 0.1]]),
        S: None,
        R: constant(&[[0.01]]),
        q: None,
        r: None,
        QN: Some(constant(&[[10.0, 0.0], [0.0, 1.0]])),
        qN: None,
    }
}

fn problem(variance: f64) -> Result<Problem, supple::Error> {
    let noise = NoiseModel::new(
        Covariance::diagonal([1e-2, 1e-2]),
        Covariance::diagonal([0.0, 1e-3]),
        Covariance::diagonal([variance]),
    );
    let system = Sequence::new(STEPS, &arrays())?;
    let task = Task::new("linear", system, noise, STEPS, 0.05).starting_at([1.0, 0.0]).guessing([0.0]);
    Ok(Problem::new("", Parameters::default(), vec![task]))
}

fn main() -> Result<(), Box<dyn Error>> {
    run(&mut std::io::stdout())
}

/// Evaluates the mass with better and worse sensors.
pub fn run(out: &mut dyn Write) -> Result<(), Box<dyn Error>> {
    for variance in [1e-4, 1e-3, 1e-2] {
        let options = EvaluateOptions { trajectories: true, ..Default::default() };
        let at = problem(variance)?.evaluate(&[], &options)?;
        let task = &at.tasks[0];
        let gain = &task.trajectory.as_ref().ok_or("no trajectory")?.feedback[0][0];
        writeln!(
            out,
            "variance {variance:.4}: {:.4} bits, cost {:.6}, first gains {:.4} {:.4}",
            at.objective.information_bits, task.cost.expected, gain[0], gain[1]
        )?;
    }
    Ok(())
}
