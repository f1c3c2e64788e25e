use supple::parameters::Scale;
use supple_study::StudyError;
use supple_study::robustness::DesignChoice;
use supple_study::study::Work;
use supple_study::sweep::Axis;

use crate::arguments::{Ask, Count, RobustnessOptions, Subject};
use crate::failure::Failure;

/// `supple robustness TASK`
impl Ask for RobustnessOptions {
    fn work(&self, &Subject { task, .. }: &Subject) -> Result<Work, Failure> {
        let of = |option: &'static str| move |error: StudyError| Failure::usage(format!("{option} {error}"));
        let designs = DesignChoice::parse_list(&self.designs, task).map_err(of("--designs:"))?;
        // A parameter on a logarithmic scale is varied by equal ratios.
        let name = self.vary.split('=').next().unwrap_or_default().trim();
        let parameter = task.problem.parameters.iter().find(|parameter| parameter.name == name);
        let spread = parameter.map_or(Scale::Linear, |parameter| parameter.scale);
        let vary = Axis::parse_as(&self.vary, task, spread).map_err(of("--vary"))?;
        let Self { rollouts: Count(rollouts), seed, .. } = *self;
        Ok(Work::Robustness(supple_study::robustness::RobustnessOptions { designs, vary, rollouts, seed }))
    }
}
