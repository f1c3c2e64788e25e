use std::path::Path;

use supple_study::sweep::{Axis, Sweep, SweepOptions, TABLE_CSV};
use supple_study::{Folder, JOURNAL, LoadedTask, Made, StudyError, StudyResult, check_writable};

use crate::Outcome;
use crate::arguments;
use crate::failure::Failure;
use crate::output::{print_text, warn};
use crate::pages::untrusted;
use crate::present::present;
use crate::progress::{Stopping, watched};

/// `supple sweep TASK`
pub fn sweep(options: &arguments::SweepOptions) -> Result<Outcome, Failure> {
    let loaded = options.task.load()?;
    let wanted = wanted(options, &loaded)?;
    let folder = options.output.out.as_deref();
    if let Some(folder) = folder {
        Folder::check_kind(folder, "sweep")?;
        check_writable(folder, TABLE_CSV)?;
    }
    let sweep = watched(Stopping::Now, |watch| {
        on_threads(options.jobs, || supple_study::sweep::run(&loaded, &wanted, folder, watch))
    })??;
    if !sweep.complete {
        if options.output.json {
            print_text(&sweep.table.to_jsonl())?;
        }
        warn(&interrupted(&sweep, folder));
        return Ok(Outcome::Shortfall);
    }
    let outcome = if untrusted(&sweep) == sweep.table.rows.len() { Outcome::Shortfall } else { Outcome::Success };
    let made = Made::here("sweep", options.seed, &loaded);
    Ok(outcome.and(present(&StudyResult::Sweep(Box::new(sweep)), &made, &options.output)?))
}

fn wanted(options: &arguments::SweepOptions, task: &LoadedTask) -> Result<SweepOptions, Failure> {
    let axis = |text: &String| Axis::parse(text, task).map_err(|error| Failure::usage(format!("--grid {error}")));
    let axes = options.grid.iter().map(axis).collect::<Result<_, _>>()?;
    Ok(SweepOptions { axes, rollouts: options.rollouts, starts: options.starts, seed: options.seed })
}

/// Does work on its own threads where their number is given, or else on those of the program.
fn on_threads<T: Send>(
    jobs: Option<usize>,
    work: impl FnOnce() -> Result<T, StudyError> + Send,
) -> Result<Result<T, StudyError>, Failure> {
    let Some(jobs) = jobs else { return Ok(work()) };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(jobs).build();
    let pool = pool.map_err(|error| Failure::usage(format!("--jobs {jobs}: {error}")))?;
    Ok(pool.install(work))
}

/// How far a sweep is that was interrupted, and what to do.
fn interrupted(sweep: &Sweep, folder: Option<&Path>) -> String {
    let (done, points) = (sweep.table.rows.len(), sweep.options.points());
    match folder {
        Some(folder) => format!(
            "interrupted: {done} of {points} points are done and stored in {}; the same command resumes",
            folder.join(JOURNAL).display()
        ),
        None => format!("interrupted: {done} of {points} points were done; without --out, nothing is stored"),
    }
}
