use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::atomic::Ordering;
use std::time::Instant;

use clap::Parser;
use supple_study::study::{REPORT, Step, Study, StudyFile, is_made};
use supple_study::{About, Folder, Made, RESULT, StudyResult, check_writable};

use crate::Outcome;
use crate::arguments::{Arguments, Common, StudyOptions};
use crate::failure::Failure;
use crate::output::{note, print_text};
use crate::progress::{STOP, listen};

/// `supple study FILE`: every step is a run of this program, so that its folder says which command made it.
pub fn study(options: &StudyOptions, common: &Common) -> Result<Outcome, Failure> {
    let out = options.out.clone().unwrap_or_else(|| options.study.file_stem().map(PathBuf::from).unwrap_or_default());
    let file = StudyFile::load(&options.study, &out)?;
    for step in file.steps.iter().chain(&file.figures) {
        check(&file, step)?;
    }
    check_writable(&out, RESULT)?;
    listen();
    let clock = Instant::now();
    let mut outcome = Outcome::Success;
    for (number, step) in file.steps.iter().enumerate() {
        let heading = format!("step {} of {}, {}", number + 1, file.steps.len(), step.name);
        let folder = out.join(&step.name);
        if is_made(&folder, &step.words) {
            note(&format!("{heading}: as it was made before"));
            continue;
        }
        note(&format!("{heading}: supple {}", step.words.join(" ")));
        if run(&step.words, common, &step.name)? == Outcome::Shortfall {
            outcome = Outcome::Shortfall;
        }
        if STOP.load(Ordering::SeqCst) {
            note("stopped; the same command goes on from here");
            return Ok(Outcome::Shortfall);
        }
    }
    for figure in &file.figures {
        run(&figure.words, common, &figure.name)?;
    }
    save(&file, &out)?;
    let report = out.join(REPORT).display().to_string();
    let words = ["report", &out.display().to_string(), "--out", &report].map(str::to_owned);
    run(&words, common, "report")?;
    let (steps, seconds) = (file.steps.len(), clock.elapsed().as_secs_f64());
    print_text(&format!("{}\n\n{steps} steps in {seconds:.0} s. The report: {report}\n", file.title))?;
    Ok(outcome)
}

/// Checks that the words of a step are a command line, before anything is run.
fn check(file: &StudyFile, step: &Step) -> Result<(), Failure> {
    let words = ["supple".to_owned()].into_iter().chain(step.words.iter().cloned());
    match Arguments::try_parse_from(words) {
        Ok(_) => Ok(()),
        Err(error) => {
            // The first line says what is wrong; the rest is about the command line.
            let text = error.to_string();
            let message = text.lines().next().unwrap_or_default().trim_start_matches("error: ").to_owned();
            Err(file.error(step, format!("`{}`: {message}", step.name)).into())
        }
    }
}

/// Runs this program with the given words.
fn run(words: &[String], common: &Common, name: &str) -> Result<Outcome, Failure> {
    let program = std::env::current_exe().map_err(|error| Failure::write("this program", error))?;
    let mut command = Command::new(program);
    command.args(words).args(common.instruction_words());
    if let Some(threads) = common.threads() {
        command.env("RAYON_NUM_THREADS", threads.to_string());
    }
    let status = command.status().map_err(|error| Failure::write(format!("step {name}"), error))?;
    match status.code() {
        Some(0) => Ok(Outcome::Success),
        Some(1) => Ok(Outcome::Shortfall),
        _ if STOP.load(Ordering::SeqCst) => Ok(Outcome::Shortfall),
        _ => Err(Failure::usage(format!("{name} failed: supple {}", words.join(" ")))),
    }
}

fn save(file: &StudyFile, out: &Path) -> Result<(), Failure> {
    let outputs = |steps: &[Step]| steps.iter().map(|step| step.output.clone()).collect();
    let study = Study { steps: outputs(&file.steps), figures: outputs(&file.figures) };
    let about = About { title: file.title.clone(), ..About::default() };
    let made = Made::of_sources("study", 0, vec![file.source.clone()], about);
    Ok(Folder::save(out, &made, &StudyResult::Study(Box::new(study)))?)
}
