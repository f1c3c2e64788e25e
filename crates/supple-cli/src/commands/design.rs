use supple_study::study::Work;

use crate::arguments::{Ask, Count, DesignOptions, Subject};
use crate::failure::Failure;

/// `supple design TASK`
impl Ask for DesignOptions {
    fn work(&self, &Subject { task, .. }: &Subject) -> Result<Work, Failure> {
        let mut settings = task.problem.design.clone();
        if let Some(method) = self.method {
            settings.method = method;
        }
        if let Some(gradient) = self.gradient {
            settings.gradient = gradient;
        }
        if let Some(Count(starts)) = self.starts {
            settings.starts = starts;
        }
        if let Some(seed) = self.seed {
            settings.seed = seed;
        }
        if let Some(information) = self.information {
            settings.information = information;
        }
        if let Some(Count(rollouts)) = self.rollouts {
            settings.rollouts = Some(rollouts);
        }
        settings.check().map_err(|unfit| Failure::usage(format!("--{unfit}")))?;
        Ok(Work::Design(Box::new(settings)))
    }
}
