use supple_study::study::Work;
use supple_study::sweep::Axis;

use crate::arguments::{Ask, Count, Subject, SweepOptions};
use crate::failure::Failure;
use crate::output::warn;

/// `supple sweep TASK`
impl Ask for SweepOptions {
    fn work(&self, &Subject { task, set, .. }: &Subject) -> Result<Work, Failure> {
        let axis = |text: &String| Axis::parse(text, task).map_err(|error| Failure::usage(format!("--grid {error}")));
        let axes = self.grid.iter().map(axis).collect::<Result<Vec<Axis>, _>>()?;
        let is_swept =
            |set: &&String| axes.iter().any(|axis| set.split('=').next().map(str::trim) == Some(&*axis.parameter));
        for set in set.iter().filter(is_swept) {
            warn(&format!("--set {set} changes nothing: --grid gives this parameter its values"));
        }
        let Self { rollouts: Count(rollouts), starts: Count(starts), branches: Count(branches), seed, .. } = *self;
        Ok(Work::Sweep(supple_study::sweep::SweepOptions { axes, rollouts, starts, branches, seed }))
    }

    fn jobs(&self) -> Option<usize> {
        self.jobs.map(|jobs| jobs.0)
    }
}
