//! Studies as command lines, for people.

use std::fmt;

use serde::Serialize;
use supple::design::DesignSettings;
use supple::parameters::Scale;
use supple_text::shell_word;

use super::{Study, Work};
use crate::evaluate::EvaluateOptions;
use crate::robustness::DesignChoice;
use crate::sensors::{SensorGoal, SensorMethod, SensorsOptions};
use crate::sweep::Axis;

impl Study {
    /// The command line that asks for the same, without the program's name.
    pub fn words(&self) -> Vec<String> {
        let mut words = Words(vec![self.work.command().to_owned(), self.task.clone()]);
        for (name, value) in &self.set.0 {
            words.give("set", format!("{name}={value}"));
        }
        match &self.work {
            Work::Design(settings) => words.search(settings),
            Work::Evaluate(options) => words.evaluation(options),
            Work::Sweep(options) => {
                options.axes.iter().for_each(|axis| words.give("grid", axis));
                words.unless_zero("rollouts", options.rollouts);
                words.unless_zero("starts", options.starts);
                words.unless_zero("branches", options.branches);
                words.unless_zero("seed", options.seed);
            }
            Work::Robustness(options) => {
                let designs: Vec<String> = options.designs.iter().map(ToString::to_string).collect();
                words.give("designs", designs.join(","));
                words.give("vary", &options.vary);
                words.give("rollouts", options.rollouts);
                words.unless_zero("seed", options.seed);
            }
            Work::Pareto(options) => {
                words.give("points", options.points);
                words.give("starts", options.starts);
                words.unless_zero("seed", options.seed);
            }
            Work::Trace(options) => {
                words.give("starts", options.starts);
                words.give("method", names(&options.methods));
                words.give("gradient", names(&options.gradients));
                words.unless_zero("seed", options.seed);
            }
            Work::Sensors(options) => words.sensors(options),
            Work::Bound(options) => {
                words.if_given("task", options.task.as_ref());
                words.if_given("cost", options.cost);
                if let Some(points) = options.curve {
                    words.0.push(format!("--curve={points}"));
                }
                if options.stationary {
                    words.0.push("--stationary".to_owned());
                }
            }
        }
        words.0
    }
}

/// The command line, as a shell takes it.
impl fmt::Display for Study {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("supple")?;
        self.words().iter().try_for_each(|word| write!(f, " {}", shell_word(word)))
    }
}

/// The words of a command line.
struct Words(Vec<String>);

impl Words {
    fn evaluation(&mut self, options: &EvaluateOptions) {
        match (options.total_gradient, options.frozen_gradient) {
            (true, true) => self.give("gradient", "both"),
            (true, false) => self.give("gradient", "total"),
            (false, true) => self.give("gradient", "frozen"),
            (false, false) => {}
        }
        self.give("rollouts", options.rollouts);
        self.unless_zero("branches", options.branches);
        self.unless_zero("seed", options.seed);
    }

    fn sensors(&mut self, options: &SensorsOptions) {
        self.if_given("budget", options.budget);
        self.if_given("count", options.count);
        self.if_given("cost", options.cost);
        if options.goal != SensorGoal::default() {
            self.give("for", name(&options.goal));
        }
        if options.method != SensorMethod::default() {
            self.give("method", name(&options.method));
        }
        self.if_given("task", options.task.as_ref());
    }

    fn give(&mut self, option: &str, value: impl ToString) {
        self.0.extend([format!("--{option}"), value.to_string()]);
    }

    fn if_given(&mut self, option: &str, value: Option<impl ToString>) {
        if let Some(value) = value {
            self.give(option, value);
        }
    }

    /// 0 is the default of the command.
    fn unless_zero(&mut self, option: &str, value: impl ToString + Default + PartialEq) {
        if value != Default::default() {
            self.give(option, value);
        }
    }

    /// What the command line can say of a search; the rest is in the task file.
    fn search(&mut self, settings: &DesignSettings) {
        self.give("method", name(&settings.method));
        self.give("gradient", name(&settings.gradient));
        self.give("information", settings.information.argument());
        self.give("starts", settings.starts);
        self.give("seed", settings.seed);
        self.if_given("rollouts", settings.rollouts);
    }
}

/// The name of a choice, as files and command lines have it.
fn name(choice: &impl Serialize) -> String {
    match serde_json::to_value(choice) {
        Ok(serde_json::Value::String(name)) => name,
        _ => String::new(),
    }
}

fn names(choices: &[impl Serialize]) -> String {
    choices.iter().map(name).collect::<Vec<_>>().join(",")
}

/// As `--grid` and `--vary` take it: by its ends where these tell all values, or else value by value.
impl fmt::Display for Axis {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{}=", self.parameter)?;
        if let [first, _, .., last] = self.values[..] {
            let count = self.values.len();
            for (scale, word) in [(Scale::Linear, "lin"), (Scale::Log, "log")] {
                if scale == self.scale && Self::spread(scale, [first, last], count).is_ok_and(|all| all == self.values)
                {
                    return write!(f, "{word}:{first}:{last}:{count}");
                }
            }
        }
        let values: Vec<String> = self.values.iter().map(ToString::to_string).collect();
        f.write_str(&values.join(","))
    }
}

/// As `--designs` takes it.
impl fmt::Display for DesignChoice {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(self.name())?;
        let Self::Named(_, values) = self else { return Ok(()) };
        let values: Vec<String> = values.iter().map(|(name, value)| format!("{name}:{value}")).collect();
        write!(f, "={}", values.join(","))
    }
}
