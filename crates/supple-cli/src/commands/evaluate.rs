use crate::Outcome;
use crate::arguments::{EvaluateOptions, GradientChoice, Loaded};
use crate::failure::Failure;
use crate::output::{print_json, print_text};
use crate::tables::evaluation_page;

/// `supple evaluate TASK`
pub fn evaluate(options: &EvaluateOptions) -> Result<Outcome, Failure> {
    let Loaded { problem, phi, .. } = options.task.load()?;
    let wanted = supple::EvaluateOptions {
        total_gradient: matches!(options.gradient, GradientChoice::Total | GradientChoice::Both),
        frozen_gradient: matches!(options.gradient, GradientChoice::Frozen | GradientChoice::Both),
        rollouts: options.rollouts,
        branches: options.branches,
        seed: options.seed,
        ..Default::default()
    };
    let evaluation = problem.evaluate(&phi, &wanted)?;
    if options.json {
        print_json(&evaluation)?;
    } else {
        print_text(&evaluation_page(&problem, &evaluation))?;
    }
    Ok(if evaluation.feasible { Outcome::Success } else { Outcome::Shortfall })
}
