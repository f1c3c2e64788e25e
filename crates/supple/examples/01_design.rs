//! Finds the stiffnesses that minimise the information of two masses pressing on a wall.

use std::error::Error;
use std::io::Write;

use supple::EvaluateOptions;
use supple::design::{Control, design};

fn main() -> Result<(), Box<dyn Error>> {
    run("tasks/two_mass.toml", &mut std::io::stdout())
}

/// Designs a task and prints the result before and after.
pub fn run(task: &str, out: &mut dyn Write) -> Result<(), Box<dyn Error>> {
    let problem = supple_file::load(task)?;
    let start = problem.parameters.initial();
    let found = design(&problem, &start, &problem.design, Control::default())?;

    let best = &found.starts[found.best];
    for index in problem.parameters.design() {
        let parameter = problem.parameters.get(index);
        writeln!(out, "{} = {:.1} {}", parameter.name, best.to[index], parameter.unit)?;
    }
    let plans = EvaluateOptions { controls: Some(best.controls.clone()), ..Default::default() };
    for at in [problem.evaluate(&start, &EvaluateOptions::default())?, problem.evaluate(&best.to, &plans)?] {
        writeln!(out, "{:.1} bits at cost {:.1}", at.objective.information_bits, at.tasks[0].cost.expected)?;
    }
    Ok(())
}
