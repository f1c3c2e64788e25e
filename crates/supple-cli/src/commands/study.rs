use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;
use std::time::Instant;

use supple_study::study::{REPORT, Step, Study, StudyFile};
use supple_study::{Folder, LoadedTask, Made, RESULT, Steps, StudyResult, check_writable};

use super::conduct::make;
use super::plot::check_figures;
use super::{plot, report};
use crate::Outcome;
use crate::arguments::{Arguments, Command, PlotOptions, ReportOptions, StudyCommand, StudyOptions};
use crate::failure::Failure;
use crate::output::{note, print_text};
use crate::progress::{STOP, listen};

/// `supple study FILE`
pub fn study(options: &StudyOptions) -> Result<Outcome, Failure> {
    let out = options.out.clone().unwrap_or_else(|| options.study.file_stem().map(PathBuf::from).unwrap_or_default());
    let file = StudyFile::load(&options.study, &out)?;
    let steps = file.steps.iter().map(|step| Planned::of(&file, step)).collect::<Result<Vec<_>, _>>()?;
    let figures = file.figures.iter().map(|figure| to_plot(&file, figure)).collect::<Result<Vec<_>, _>>()?;
    if !figures.is_empty() {
        check_figures()?;
    }
    Folder::check_kind(&out, "study")?;
    check_writable(&out, RESULT)?;
    listen();
    let clock = Instant::now();
    let mut outcome = Outcome::Success;
    for (number, (step, planned)) in file.steps.iter().zip(&steps).enumerate() {
        let heading = format!("step {} of {}, {}", number + 1, steps.len(), step.name);
        outcome = planned.make(&heading, &out.join(&step.name))?.and(outcome);
        if STOP.load(Ordering::SeqCst) {
            note("stopped; repeat the command to resume");
            return Ok(Outcome::Shortfall);
        }
    }
    figures.iter().try_for_each(|figure| plot(figure).map(drop))?;
    let names = |steps: &[Step]| steps.iter().map(|step| step.output.clone()).collect();
    let result = Steps { steps: names(&file.steps), figures: names(&file.figures) };
    Folder::save(&out, &Made::of_study_file(&file), &StudyResult::Study(Box::new(result)))?;
    let page = out.join(REPORT);
    report(&ReportOptions { folders: vec![out], out: page.clone() })?;
    let (steps, seconds) = (steps.len(), clock.elapsed().as_secs_f64());
    print_text(&format!("{}\n\n{steps} steps in {seconds:.0} s. The report: {}\n", file.title, page.display()))?;
    Ok(outcome)
}

/// A step whose options and task have been validated.
struct Planned {
    command: StudyCommand,
    task: LoadedTask,
    study: Study,
}

impl Planned {
    /// Parses the step's options and loads its task.
    fn of(file: &StudyFile, step: &Step) -> Result<Self, Failure> {
        let Command::Study(command) = command(file, step)? else { return Err(wrong(file, step, "is not a study")) };
        let asks = command.asks();
        let here =
            |failure: Failure| if failure.is_of_file() { failure } else { wrong(file, step, &failure.to_string()) };
        let task = asks.task().read().map_err(here)?;
        let work = asks.work(&task).map_err(here)?;
        let study = Study::of(&task, work);
        Ok(Self { command, task, study })
    }

    /// Runs the step, or reuses its result from an earlier run.
    fn make(&self, heading: &str, folder: &Path) -> Result<Outcome, Failure> {
        if let Some(made) = Folder::load_made(folder, &self.study) {
            let (fell, outcome) = match made.result.falls_short() || !made.result.not_finite().is_empty() {
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
            outcome => outcome,
        }
    }
}

/// Parses a step or figure as a command.
fn command(file: &StudyFile, step: &Step) -> Result<Command, Failure> {
    let words = ["supple".to_owned()].into_iter().chain(step.words.iter().cloned());
    match Arguments::of_words(words) {
        Ok(arguments) => Ok(arguments.command),
        Err(error) => {
            // The first line says what is wrong; the rest is help on the command line.
            let text = error.to_string();
            Err(wrong(file, step, text.lines().next().unwrap_or_default().trim_start_matches("error: ")))
        }
    }
}

fn to_plot(file: &StudyFile, figure: &Step) -> Result<PlotOptions, Failure> {
    match command(file, figure)? {
        Command::Plot(options) => Ok(options),
        _ => Err(wrong(file, figure, "is not a figure")),
    }
}

fn wrong(file: &StudyFile, step: &Step, message: &str) -> Failure {
    file.error(step, format!("`{}`: {message}", step.name)).into()
}
