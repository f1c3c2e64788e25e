use supple_study::sweep::{Axis, SweepOptions, TABLE_CSV};
use supple_study::{Folder, LoadedTask, Made, StudyResult, Watch, check_writable};

use crate::Outcome;
use crate::arguments;
use crate::failure::Failure;
use crate::output::print_text;
use crate::progress::{Bar, STOP, listen};

/// `supple sweep TASK`
pub fn sweep(options: &arguments::SweepOptions) -> Result<Outcome, Failure> {
    let loaded = options.task.load()?;
    let wanted = wanted(options, &loaded)?;
    if let Some(folder) = &options.out {
        check_writable(folder, TABLE_CSV)?;
    }
    let mut pool = rayon::ThreadPoolBuilder::new();
    if let Some(jobs) = options.jobs {
        pool = pool.num_threads(jobs);
    }
    listen();
    let bar = Bar::new();
    let watch = Watch { progress: &bar, stop: &STOP };
    let run = || supple_study::sweep::run(&loaded, &wanted, options.out.as_deref(), watch);
    let found = match options.jobs {
        Some(jobs) => {
            let pool = pool.build().map_err(|error| Failure::usage(format!("--jobs {jobs}: {error}")))?;
            pool.install(run)
        }
        None => run(),
    };
    bar.finish();
    let sweep = found?;
    let made = Made::here("sweep", options.seed, &loaded);
    if options.json {
        print_text(&sweep.table.to_jsonl())?;
    }
    if let Some(folder) = &options.out {
        Folder::save(folder, &made, &StudyResult::Sweep(Box::new(sweep)))?;
    }
    Ok(Outcome::Success)
}

fn wanted(options: &arguments::SweepOptions, task: &LoadedTask) -> Result<SweepOptions, Failure> {
    let axis = |text: &String| Axis::parse(text, task).map_err(|error| Failure::usage(format!("--grid {error}")));
    let axes = options.grid.iter().map(axis).collect::<Result<_, _>>()?;
    Ok(SweepOptions { axes, rollouts: options.rollouts, starts: options.starts, seed: options.seed })
}
