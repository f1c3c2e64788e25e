mod file;
#[cfg(test)]
mod tests;

use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;
use std::time::Instant;

use supple_study::study::Study;
use supple_study::{Folder, LoadedTask, Made, RESULT, Steps, StudyResult, check_writable, forget};

use file::{Step, StudyFile};

use super::conduct::make;
use super::plot::check_figures;
use super::{plot, report};
use crate::arguments::{ReportOptions, StudyCommand, StudyOptions, TaskArguments};
use crate::failure::Failure;
use crate::outcome::Outcome;
use crate::output::{REPORT, note, print_text};
use crate::progress::{STOP, listen};

/// `supple study FILE`
pub fn study(options: &StudyOptions) -> Result<Outcome, Failure> {
    let out = options.out.clone().unwrap_or_else(|| options.study.file_stem().map(PathBuf::from).unwrap_or_default());
    let file = StudyFile::load(&options.study, &out)?;
    let planned = |step| Planned::of(&file, step, TaskArguments::read_alone);
    let steps = file.steps.iter().map(planned).collect::<Result<Vec<_>, _>>()?;
    if !file.figures.is_empty() {
        check_figures()?;
    }
    Folder::check_kind(&out, "study")?;
    check_writable(&out, RESULT)?;
    listen();
    let clock = Instant::now();
    let (mut outcome, mut short) = (Outcome::Success, Vec::new());
    let count = steps.len();
    for (number, (step, planned)) in file.steps.iter().zip(steps).enumerate() {
        let heading = format!("step {} of {count}, {}", number + 1, step.name);
        // The design of an earlier step exists by now.
        let planned = match step.command.asks().task().from {
            Some(_) => Planned::of(&file, step, TaskArguments::read)?,
            None => planned,
        };
        let made = planned.make(&heading, &out.join(&step.name))?;
        if made == Outcome::Shortfall {
            short.push(step.name.as_str());
        }
        outcome = made.and(outcome);
        if STOP.load(Ordering::SeqCst) {
            note("stopped; repeat the command to resume");
            return Ok(Outcome::Shortfall);
        }
    }
    file.figures.iter().try_for_each(|figure| plot(&figure.command).map(drop))?;
    let result = Steps {
        steps: file.steps.iter().map(|step| step.output.clone()).collect(),
        figures: file.figures.iter().map(|figure| figure.output.clone()).collect(),
    };
    Folder::save(&out, &Made::of_steps(&file.title, file.source.clone()), &StudyResult::Study(Box::new(result)))?;
    let page = out.join(REPORT);
    report(&ReportOptions { folders: vec![out], out: page.clone() })?;
    let seconds = clock.elapsed().as_secs_f64();
    let short = match short[..] {
        [] => String::new(),
        [step] => format!("Step {step} fell short: see above.\n"),
        _ => format!("Steps {} fell short: see above.\n", short.join(", ")),
    };
    let steps = supple_text::count(count, "step");
    print_text(&format!("{}\n\n{steps} in {seconds:.0} s. The report: {}\n{short}", file.title, page.display()))?;
    Ok(outcome)
}

/// A step whose options and task have been validated.
struct Planned<'a> {
    command: &'a StudyCommand,
    task: LoadedTask,
    study: Study,
}

impl<'a> Planned<'a> {
    /// Loads the step's task by `read` and checks its options against it.
    fn of(
        file: &StudyFile,
        step: &'a Step<StudyCommand>,
        read: fn(&TaskArguments) -> Result<LoadedTask, Failure>,
    ) -> Result<Self, Failure> {
        let asks = step.command.asks();
        let here =
            |failure: Failure| if failure.is_of_file() { failure } else { wrong(file, step, &failure.to_string()) };
        let task = read(asks.task()).map_err(here)?;
        let work = asks.work(&task).map_err(here)?;
        work.check(&task).map_err(|error| here(error.into()))?;
        let study = Study::of(&task, work);
        Ok(Self { command: &step.command, task, study })
    }

    /// Runs the step, or reuses its result from an earlier run.
    fn make(&self, heading: &str, folder: &Path) -> Result<Outcome, Failure> {
        if let Some(made) = Folder::load_made(folder, &self.study) {
            let (fell, outcome) =
                match made.result.falls_short(&made.made.about) || !made.result.not_finite().is_empty() {
                    true => (", which fell short", Outcome::Shortfall),
                    false => ("", Outcome::Success),
                };
            note(&format!("{heading}: reused from an earlier run{fell}"));
            return Ok(outcome);
        }
        note(&format!("{heading}: {} --out {}", self.study, folder.display()));
        let asks = self.command.asks();
        asks.task().warn(&self.task);
        match make(&self.task, self.study.work.clone(), asks.output(), asks.jobs()) {
            Err(_) if STOP.load(Ordering::SeqCst) => Ok(Outcome::Shortfall),
            Err(failure) => {
                failure.report();
                Err(Failure::usage(format!("{heading} failed")))
            }
            Ok(outcome) => {
                // A complete step is reused as it is; the journal of a sweep would refuse another one in its place.
                if Folder::load_made(folder, &self.study).is_some() {
                    forget(folder)?;
                }
                Ok(outcome)
            }
        }
    }
}

fn wrong(file: &StudyFile, step: &Step<StudyCommand>, message: &str) -> Failure {
    file.error(step, message).into()
}
