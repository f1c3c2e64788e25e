use supple_study::sensors::{SensorGoal, SensorMethod};
use supple_study::study::Work;

use crate::arguments::{Ask, SensorGoalArgument, SensorMethodArgument, SensorsOptions, Subject};
use crate::failure::Failure;

/// `supple sensors TASK`
impl Ask for SensorsOptions {
    fn work(&self, _: &Subject) -> Result<Work, Failure> {
        Ok(Work::Sensors(supple_study::sensors::SensorsOptions {
            budget: self.budget,
            count: self.count.map(|count| count.0),
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
