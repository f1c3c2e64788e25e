use supple::Problem;
use supple::design::{Control, DesignSettings, DesignStatus};
use supple_study::{Made, StudyResult};

use crate::Outcome;
use crate::arguments::DesignOptions;
use crate::failure::Failure;
use crate::present::present;
use crate::progress::{Progress, STOP, Stopping, listen};

/// `supple design TASK`
pub fn design(options: &DesignOptions) -> Result<Outcome, Failure> {
    let loaded = options.task.load()?;
    let settings = settings(options, &loaded.problem)?;
    options.output.check("design")?;
    listen(Stopping::AtPause);
    let progress = Progress::new(settings.feasibility);
    let found = supple_study::design::run(&loaded, &settings, Control { observer: &progress, stop: &STOP });
    progress.finish();
    let report = found?;
    let made = Made::here("design", settings.seed, &loaded);
    let trusted = report.status == DesignStatus::Converged && report.optimum.warnings().next().is_none();
    let outcome = if trusted { Outcome::Success } else { Outcome::Shortfall };
    Ok(outcome.and(present(&StudyResult::Design(Box::new(report)), &made, &options.output)?))
}

fn settings(options: &DesignOptions, problem: &Problem) -> Result<DesignSettings, Failure> {
    let mut settings = problem.design.clone();
    if let Some(method) = options.method {
        settings.method = method.into();
    }
    if let Some(gradient) = options.gradient {
        settings.gradient = gradient.into();
    }
    if let Some(starts) = options.starts {
        settings.starts = starts;
    }
    if let Some(seed) = options.seed {
        settings.seed = seed;
    }
    if let Some(information) = options.information {
        settings.information = information.weights();
    }
    if let Some(rollouts) = options.rollouts {
        settings.rollouts = Some(rollouts);
    }
    settings.check().map_err(|(key, message)| Failure::usage(format!("--{key}: {message}")))?;
    Ok(settings)
}
