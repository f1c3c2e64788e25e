use supple_study::evaluate::EvaluateReport;
use supple_study::{LoadedTask, Made, StudyResult};

use crate::Outcome;
use crate::arguments::{EvaluateOptions, GradientChoice};
use crate::failure::Failure;
use crate::present::present;

/// `supple evaluate TASK`
pub fn evaluate(options: &EvaluateOptions) -> Result<Outcome, Failure> {
    let loaded = options.task.load()?;
    options.output.check("evaluate")?;
    let LoadedTask { problem, phi, .. } = &loaded;
    let wanted = supple::EvaluateOptions {
        total_gradient: matches!(options.gradient, GradientChoice::Total | GradientChoice::Both),
        frozen_gradient: matches!(options.gradient, GradientChoice::Frozen | GradientChoice::Both),
        needed: true,
        rollouts: problem.rollouts(options.rollouts),
        branches: options.branches,
        seed: options.seed,
        trajectories: options.output.out.is_some(),
        ..Default::default()
    };
    let evaluation = problem.evaluate(phi, &wanted)?;
    let made = Made::here("evaluate", options.seed, &loaded);
    let trusted = evaluation.feasible && evaluation.warnings().next().is_none();
    let outcome = if trusted { Outcome::Success } else { Outcome::Shortfall };
    let result = StudyResult::Evaluate(Box::new(EvaluateReport { evaluation }));
    Ok(outcome.and(present(&result, &made, &options.output)?))
}
