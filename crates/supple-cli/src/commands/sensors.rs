use supple_study::LoadedTask;
use supple_study::sensors::{SensorGoal, SensorMethod};
use supple_study::study::Work;

use crate::arguments::{Asks, Output, SensorGoalArgument, SensorMethodArgument, SensorsOptions, TaskArguments};
use crate::failure::Failure;

/// `supple sensors TASK`
impl Asks for SensorsOptions {
    fn task(&self) -> &TaskArguments {
        &self.task
    }

    fn output(&self) -> &Output {
        &self.output
    }

    fn work(&self, _: &LoadedTask) -> Result<Work, Failure> {
        Ok(Work::Sensors(supple_study::sensors::SensorsOptions {
            budget: self.budget,
            count: self.count,
            cost: self.cost,
            goal: match self.goal {
                SensorGoalArgument::Cost => SensorGoal::Cost,
                SensorGoalArgument::Information => SensorGoal::Information,
            },
            method: match self.method {
                SensorMethodArgument::Greedy => SensorMethod::Greedy,
                SensorMethodArgument::Exhaustive => SensorMethod::Exhaustive,
                SensorMethodArgument::Both => SensorMethod::Both,
            },
            task: self.name.clone(),
        }))
    }
}
