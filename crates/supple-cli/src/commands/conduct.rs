//! Runs, stores and prints the studies that commands request.

use std::path::Path;

use supple::design::DesignStatus;
use supple_study::study::{Work, on_threads};
use supple_study::sweep::Sweep;
use supple_study::{Folder, JOURNAL, LoadedTask, Made, StudyError, StudyResult, forget, kept_parts};

use crate::arguments::{Asks, Output};
use crate::failure::Failure;
use crate::outcome::Outcome;
use crate::output::{print_text, warn};
use crate::pages::stopped;
use crate::present::print;
use crate::progress::watched;

/// Runs the study that a command requests.
pub fn conduct(asks: &dyn Asks) -> Result<Outcome, Failure> {
    let mut task = asks.task().load()?;
    let work = asks.work(&task)?;
    // Journals do not know such plans.
    if matches!(work, Work::Evaluate(_) | Work::Bound(_) | Work::Sensors(_)) {
        task = asks.task().knowing(task)?;
    }
    make(&task, work, asks.output(), asks.jobs())
}

/// Does work on a task, stores the result if a folder is given, and prints it.
pub fn make(task: &LoadedTask, work: Work, output: &Output, jobs: Option<usize>) -> Result<Outcome, Failure> {
    let folder = output.out.as_deref();
    folder.map_or(Ok(()), |folder| Folder::check_for(folder, &work))?;
    folder.and_then(|folder| Folder::replaced_sweep(folder, &work)).iter().for_each(|replaced| warn(replaced));
    let found = watched(|watch| on_threads(jobs, || work.run(task, folder, watch)));
    let Some(result) = found_or_kept(found, folder)? else { return Ok(Outcome::Shortfall) };
    if let StudyResult::Sweep(sweep) = &result
        && !sweep.complete
    {
        return interrupted(sweep, output);
    }
    if let Some(text) = stopped(&result) {
        let has_parts = match &result {
            StudyResult::Design(report) => report.starts.iter().any(|start| !start.interrupted),
            StudyResult::Trace(trace) => trace.runs.iter().any(|run| run.status != DesignStatus::Stopped),
            _ => true,
        };
        let resumes = match folder {
            Some(_) if !has_parts => "begins again",
            Some(_) => "resumes",
            None => "resumes where it has --out",
        };
        warn(&format!("{text}; the same command {resumes}"));
    }
    let made = Made::of(task, work);
    if let Some(folder) = folder {
        Folder::conclude(folder, &made, &result)?;
    }
    let outcome = if result.falls_short(&made.about) { Outcome::Shortfall } else { Outcome::Success };
    Ok(outcome.and(print(&result, &made.about, folder, output.json)?))
}

/// The result of a study; `None` if it was stopped before there was a result. Its journal may still keep finished parts.
fn found_or_kept(
    found: Result<StudyResult, StudyError>,
    folder: Option<&Path>,
) -> Result<Option<StudyResult>, Failure> {
    match (found, folder) {
        (Err(StudyError::Stopped), Some(folder)) => {
            let parts = kept_parts(folder)?;
            if parts == 0 {
                forget(folder)?;
                return Err(StudyError::Stopped.into());
            }
            let (journal, s) = (folder.join(JOURNAL), if parts == 1 { "" } else { "s" });
            warn(&format!(
                "stopped before there was a result; {parts} finished part{s} of the study: stored in {}; the same command \
                 resumes",
                journal.display()
            ));
            Ok(None)
        }
        (found, _) => Ok(Some(found?)),
    }
}

/// Reports how far an interrupted sweep got, and prints its rows if JSON lines were requested.
fn interrupted(sweep: &Sweep, output: &Output) -> Result<Outcome, Failure> {
    if output.json {
        print_text(&sweep.table.to_jsonl())?;
    }
    let (done, points) = (sweep.table.rows.len(), sweep.options.points());
    warn(&match &output.out {
        Some(folder) => format!(
            "interrupted: {done} of {points} points are done and stored in {}; the same command resumes",
            folder.join(JOURNAL).display()
        ),
        None => format!("interrupted: {done} of {points} points were done; without --out, nothing is stored"),
    });
    Ok(Outcome::Shortfall)
}
