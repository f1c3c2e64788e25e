use supple_study::LoadedTask;
use supple_study::study::Work;
use supple_study::sweep::Axis;

use crate::arguments::{Asks, Output, SweepOptions, TaskArguments};
use crate::failure::Failure;

/// `supple sweep TASK`
impl Asks for SweepOptions {
    fn task(&self) -> &TaskArguments {
        &self.task
    }

    fn output(&self) -> &Output {
        &self.output
    }

    fn work(&self, task: &LoadedTask) -> Result<Work, Failure> {
        let axis = |text: &String| Axis::parse(text, task).map_err(|error| Failure::usage(format!("--grid {error}")));
        let axes = self.grid.iter().map(axis).collect::<Result<Vec<Axis>, _>>()?;
        let is_swept =
            |set: &&String| axes.iter().any(|axis| set.split('=').next().map(str::trim) == Some(&*axis.parameter));
        let both = self.task.set.iter().find(is_swept);
        if let Some(set) = both {
            return Err(Failure::usage(format!(
                "--set {set}: --grid gives this parameter its values; leave out one of them"
            )));
        }
        let Self { rollouts, starts, seed, .. } = *self;
        Ok(Work::Sweep(supple_study::sweep::SweepOptions { axes, rollouts, starts, seed }))
    }

    fn jobs(&self) -> Option<usize> {
        self.jobs
    }
}
