use supple_study::{Made, StudyResult};

use crate::Outcome;
use crate::arguments::TraceOptions;
use crate::failure::Failure;
use crate::pages::stopped_trace;
use crate::present::{found_or_kept, present_resumable};
use crate::progress::{Stopping, watched};

/// `supple trace TASK`
pub fn trace(options: &TraceOptions) -> Result<Outcome, Failure> {
    let loaded = options.task.load()?;
    let wanted = supple_study::trace::TraceOptions {
        starts: options.starts,
        methods: options.method.iter().map(|&method| method.into()).collect(),
        gradients: options.gradient.iter().map(|&gradient| gradient.into()).collect(),
        seed: options.seed,
    };
    options.output.check("trace")?;
    let folder = options.output.out.as_deref();
    let found = watched(Stopping::AtPause, |watch| supple_study::trace::run(&loaded, &wanted, folder, watch));
    let Some(study) = found_or_kept(found, &options.output)? else { return Ok(Outcome::Shortfall) };
    let made = Made::here("trace", options.seed, &loaded);
    // How searches ended is what was asked for, so that ends that are no optima are no shortfall.
    let stopped = stopped_trace(&study);
    present_resumable(&StudyResult::Trace(Box::new(study)), &made, &options.output, stopped)
}
