//! What a task must satisfy, whoever made it.

use supple_model::Value;
use supple_model::document::Unfit;
use supple_model::parameters::Parameters;
use supple_text::digits;

use super::{Task, most_steps};

impl Task {
    /// Checks numbers, lengths and noise for the task's system, within the bounds of the parameters.
    ///
    /// # Errors
    /// What is wrong, below the table of the task: `noise.process[2]` for the third variance of its process.
    ///
    /// ```
    /// use supple::Task;
    /// use supple::parameters::Parameters;
    /// # let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tasks/two_mass.toml");
    /// let problem = supple_file::load(file)?;
    /// let task = Task { steps: 0, ..problem.tasks[0].clone() };
    /// let wrong = task.check(&problem.parameters).err().map(|unfit| unfit.to_string());
    /// assert_eq!(wrong.as_deref(), Some("steps: must be from 1 to 1000000 with 5 states; found 0"));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn check(&self, parameters: &Parameters) -> Result<(), Unfit> {
        let size = self.system.dimensions();
        let unfit = |key, message: String| Err(Unfit::new(key, message));
        let most = most_steps(size);
        if !(1..=most).contains(&self.steps) {
            let message = format!("must be from 1 to {most} with {} states; found {}", size.states, self.steps);
            return unfit("steps", message);
        }
        if let Some(steps) = self.system.steps().filter(|&steps| steps != self.steps) {
            return unfit("steps", format!("must be {steps}, as many as the system has; found {}", self.steps));
        }
        if !(self.information_weight >= 0.0 && self.information_weight.is_finite()) {
            let found = digits(self.information_weight);
            return unfit("information_weight", format!("must be a number of at least 0; found {found}"));
        }
        self.check_values(parameters)?;
        if let Some(least) = parameters.least(self.time_step).filter(|&least| least <= 0.0) {
            return unfit("time_step", format!("must be above 0; {}", self.time_step.found(least)));
        }
        if let Some(bound) = self.bound
            && let Some(least) = parameters.least(bound).filter(|&least| least < 0.0)
        {
            return unfit("bound", format!("must be at least 0, as every expected cost is; {}", bound.found(least)));
        }
        if self.initial_state.len() != size.states {
            let found = self.initial_state.len();
            return unfit(
                "initial_state",
                format!("must have {} numbers, one for each state; found {found}", size.states),
            );
        }
        self.check_controls()?;
        self.noise.check(size, self.steps, parameters).map_err(|unfit| unfit.below("noise"))
    }

    /// Checks that every value is finite at the initial values of the parameters, and uses no parameter that there is not.
    fn check_values(&self, parameters: &Parameters) -> Result<(), Unfit> {
        let phi = parameters.initial();
        let check = |value: &Value| match parameters.least(*value).map(|_| value.resolve::<f64>(&phi)) {
            None => Err("uses a parameter that the problem does not have".to_owned()),
            Some(number) if !number.is_finite() => Err(format!("must be finite; found {number}")),
            Some(_) => Ok(()),
        };
        check(&self.time_step).map_err(|message| Unfit::new("time_step", message))?;
        self.bound.iter().try_for_each(check).map_err(|message| Unfit::new("bound", message))?;
        for (i, value) in self.initial_state.iter().enumerate() {
            check(value).map_err(|message| Unfit::new("initial_state", message).entry(i))?;
        }
        for (t, i, value) in self
            .initial_control
            .iter()
            .enumerate()
            .flat_map(|(t, row)| row.iter().enumerate().map(move |(i, value)| (t, i, value)))
        {
            check(value).map_err(|message| Unfit::new("initial_control", message).entry(t).entry(i))?;
        }
        Ok(())
    }

    /// Checks the first guess of the controls, and their bounds.
    fn check_controls(&self) -> Result<(), Unfit> {
        let (count, steps) = (self.system.dimensions().controls, self.steps);
        let valid = format!("must be one row of {count} numbers, or {steps} such rows");
        let rows = &self.initial_control;
        if let Some(row) = rows.iter().position(|row| row.len() != count) {
            let message = format!("{valid}; this row has {} numbers", rows[row].len());
            return Err(Unfit::new("initial_control", message).entry(row));
        }
        if rows.len() > 1 && rows.len() != steps {
            return Err(Unfit::new("initial_control", format!("{valid}; found {} rows", rows.len())));
        }
        let Some(bounds) = &self.control_bounds else { return Ok(()) };
        let (lower, upper) = (bounds.lower(), bounds.upper());
        if lower.len() != count {
            let message = format!("must be {count} pairs, one for each control; found {}", lower.len());
            return Err(Unfit::new("control_bounds", message));
        }
        match (0..count).find(|&i| lower[i].is_nan() || upper[i].is_nan() || lower[i] > upper[i]) {
            Some(i) => {
                let message =
                    format!("the lower bound exceeds the upper one: [{}, {}]", digits(lower[i]), digits(upper[i]));
                Err(Unfit::new("control_bounds", message).entry(i))
            }
            None => Ok(()),
        }
    }
}
