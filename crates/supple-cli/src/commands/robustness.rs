use supple::parameters::Scale;
use supple_study::robustness::DesignChoice;
use supple_study::sweep::Axis;
use supple_study::{LoadedTask, Made, StudyError, StudyResult};

use crate::Outcome;
use crate::arguments::RobustnessOptions;
use crate::failure::Failure;
use crate::pages::stopped_robustness;
use crate::present::{found_or_kept, present_resumable};
use crate::progress::{Stopping, watched};

/// `supple robustness TASK`
pub fn robustness(options: &RobustnessOptions) -> Result<Outcome, Failure> {
    let loaded = options.task.load()?;
    let wanted = wanted(options, &loaded)?;
    options.output.check("robustness")?;
    let folder = options.output.out.as_deref();
    let found = watched(Stopping::Now, |watch| supple_study::robustness::run(&loaded, &wanted, folder, watch));
    let Some(study) = found_or_kept(found, &options.output)? else { return Ok(Outcome::Shortfall) };
    let made = Made::here("robustness", options.seed, &loaded);
    let whole = study.cells.iter().all(|cell| cell.error.is_none() && cell.diverged == 0)
        && study.designs.iter().all(|design| design.warnings.is_empty());
    let outcome = if whole { Outcome::Success } else { Outcome::Shortfall };
    let stopped = stopped_robustness(&study);
    let result = StudyResult::Robustness(Box::new(study));
    Ok(outcome.and(present_resumable(&result, &made, &options.output, stopped)?))
}

fn wanted(
    options: &RobustnessOptions,
    task: &LoadedTask,
) -> Result<supple_study::robustness::RobustnessOptions, Failure> {
    let of = |option: &'static str| move |error: StudyError| Failure::usage(format!("{option} {error}"));
    let designs = DesignChoice::parse_list(&options.designs, task).map_err(of("--designs:"))?;
    // A parameter that designs would move by ratios grows by ratios.
    let name = options.vary.split('=').next().unwrap_or_default().trim();
    let parameter = task.problem.parameters.iter().find(|parameter| parameter.name == name);
    let spread = parameter.map_or(Scale::Linear, |parameter| parameter.scale);
    let vary = Axis::parse_as(&options.vary, task, spread).map_err(of("--vary"))?;
    Ok(supple_study::robustness::RobustnessOptions { designs, vary, rollouts: options.rollouts, seed: options.seed })
}
