//! How stiff should the grip on a door be? Information and cost of `tasks/iiwa_door.toml` over equal stiffnesses.
//!
//! Two tables: the sweep, and what it is made of: the parts of the nominal cost, and the information if positions had no
//! process noise. [docs/paper.md](../../../docs/paper.md) says what they mean.
//!
//! Run by `cargo run --release -p supple --example 02_door_stiffness`.

use std::error::Error;
use std::io::Write;

use supple::{EvaluateOptions, Problem, TaskEvaluation};

/// Stiffnesses along all three axes, N/m.
const SWEEP: [f64; 10] = [1.0, 10.0, 100.0, 300.0, 1e3, 3e3, 1e4, 1e5, 3e5, 1e6];

fn main() -> Result<(), Box<dyn Error>> {
    run("tasks/iiwa_door.toml", &mut std::io::stdout())
}

/// Evaluates the task file at all stiffnesses, those outside of its bounds too, and writes the tables.
pub fn run(task: &str, out: &mut dyn Write) -> Result<(), Box<dyn Error>> {
    let source = std::fs::read_to_string(task)?;
    let problem = supple_file::parse(&source, task)?;
    let quiet = supple_file::parse(&source.replace(r#"{ "q.*" = 1e-7,"#, r#"{ "q.*" = 0.0,"#), task)?;
    for (index, task) in problem.tasks.iter().enumerate() {
        writeln!(out, "{:<7}  stiffness  nominal  expected cost  DI, bits   bits/s  end angle", task.name)?;
        for stiffness in SWEEP {
            let at = evaluate(&problem, stiffness, index)?;
            let (cost, information) = (&at.cost, &at.information);
            let end = states(&at).last().map_or(f64::NAN, |state| state[7]);
            writeln!(
                out,
                "{:>18} {:>8.3} {:>14.3} {:>9.1} {:>8.0} {:>10.4}",
                stiffness, cost.parts.nominal, cost.expected, information.total_bits, information.bits_per_second, end
            )?;
        }
        writeln!(out)?;
        writeln!(out, "{:<7}  stiffness  of door  of velocities  of torques  DI without position noise", task.name)?;
        for stiffness in [1.0, 1e4, 1e6] {
            let [door, velocities, torques] = parts(&evaluate(&problem, stiffness, index)?);
            let bits = evaluate(&quiet, stiffness, index)?.information.total_bits;
            writeln!(out, "{stiffness:>18} {door:>8.3} {velocities:>14.3} {torques:>11.3} {bits:>26.1}")?;
        }
        writeln!(out)?;
    }
    Ok(())
}

/// One task at equal stiffnesses.
fn evaluate(problem: &Problem, stiffness: f64, task: usize) -> Result<TaskEvaluation, supple::Error> {
    let options = EvaluateOptions { trajectories: true, ..Default::default() };
    let mut found = problem.evaluate(&[stiffness; 3], &options)?;
    Ok(found.tasks.swap_remove(task))
}

fn states(at: &TaskEvaluation) -> &[Vec<f64>] {
    at.trajectory.as_ref().map_or(&[], |trajectory| &trajectory.states)
}

/// The nominal cost by what it is of, with the weights of the task file: angle of the door, velocities, torques.
fn parts(at: &TaskEvaluation) -> [f64; 3] {
    let target = if at.name == "open" { -0.5 } else { -0.17 };
    let (states, square) = (states(at), |list: &[f64]| list.iter().map(|entry| entry * entry).sum::<f64>());
    let controls = at.trajectory.as_ref().map_or(&[][..], |trajectory| &trajectory.controls);
    let last = states.len().saturating_sub(1);
    let sum = |stage: f64, end: f64, of: &dyn Fn(&[f64]) -> f64| {
        states.iter().enumerate().map(|(t, x)| if t < last { stage } else { end } * of(x)).sum::<f64>()
    };
    [
        sum(15.0, 50.0, &|x| (x[7] - target) * (x[7] - target)),
        sum(1e-5, 0.0125, &|x| square(&x[8..])),
        1e-5 * controls.iter().map(|u| square(u)).sum::<f64>(),
    ]
}
