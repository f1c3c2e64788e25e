use supple_study::sensors::{SensorGoal, SensorMethod};
use supple_study::{Made, StudyResult};

use crate::Outcome;
use crate::arguments::{SensorGoalArgument, SensorMethodArgument, SensorsOptions};
use crate::failure::Failure;
use crate::present::present;
use crate::progress::{Stopping, watched};

/// `supple sensors TASK`
pub fn sensors(options: &SensorsOptions) -> Result<Outcome, Failure> {
    let loaded = options.task.load()?;
    let wanted = supple_study::sensors::SensorsOptions {
        budget: options.budget,
        count: options.count,
        cost: options.cost,
        goal: match options.goal {
            SensorGoalArgument::Cost => SensorGoal::Cost,
            SensorGoalArgument::Information => SensorGoal::Information,
        },
        method: match options.method {
            SensorMethodArgument::Greedy => SensorMethod::Greedy,
            SensorMethodArgument::Exhaustive => SensorMethod::Exhaustive,
            SensorMethodArgument::Both => SensorMethod::Both,
        },
        task: options.name.clone(),
    };
    options.output.check("sensors")?;
    let study = watched(Stopping::Now, |watch| supple_study::sensors::run(&loaded, &wanted, watch))?;
    let made = Made::here("sensors", 0, &loaded);
    // A set that is not proved to be the best one is a result with a certificate, not a shortfall.
    present(&StudyResult::Sensors(Box::new(study)), &made, &options.output)
}
