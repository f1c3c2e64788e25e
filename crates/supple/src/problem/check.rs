//! What a task must satisfy, whoever made it.

use supple_kernels::Matrices;
use supple_model::Value;
use supple_model::document::Unfit;
use supple_model::parameters::Parameters;
use supple_text::{count, digits};

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
        self.check_shapes()?;
        self.check_values(parameters)?;
        let size = self.system.dimensions();
        self.noise.check(size, self.steps, parameters).map_err(|unfit| unfit.below("noise"))
    }

    /// The part of [`check`](Self::check) that takes no time: lengths and numbers, but not whether covariances are.
    ///
    /// # Errors
    /// As of [`check`](Self::check).
    pub fn check_numbers(&self, parameters: &Parameters) -> Result<(), Unfit> {
        self.check_shapes()?;
        self.check_values(parameters)?;
        self.noise.check_numbers(parameters).map_err(|unfit| unfit.below("noise"))
    }

    /// The number of steps, and all lengths.
    fn check_shapes(&self) -> Result<(), Unfit> {
        let size = self.system.dimensions();
        let unfit = |key, message: String| Err(Unfit::new(key, message));
        let most = most_steps(size);
        if !(1..=most).contains(&self.steps) {
            let message = format!("must be from 1 to {most} with {} states; found {}", size.states, self.steps);
            let advice = "take fewer, longer steps; `locked` takes joints out of a robot, and with them states";
            let unfit = Unfit::new("steps", message);
            return Err(if most < self.steps { unfit.with_help(advice) } else { unfit });
        }
        if let Some(steps) = self.system.steps().filter(|&steps| steps != self.steps) {
            return unfit("steps", format!("must be {steps}, as many as the system has; found {}", self.steps));
        }
        if self.initial_state.len() != size.states {
            let found = self.initial_state.len();
            let message = format!("must have {} numbers, one for each state; found {found}", size.states);
            return unfit("initial_state", message);
        }
        self.check_controls()?;
        self.noise.check_shapes(size, self.steps).map_err(|unfit| unfit.below("noise"))
    }

    /// Checks that every number is finite and valid, and uses no parameter that there is not.
    fn check_values(&self, parameters: &Parameters) -> Result<(), Unfit> {
        if !(self.information_weight >= 0.0 && self.information_weight.is_finite()) {
            let message = format!("must be a number of at least 0; found {}", digits(self.information_weight));
            return Err(Unfit::new("information_weight", message));
        }
        let check = |key, value: &Value| parameters.number(value).map_err(|wrong| Unfit::new(key, wrong.to_string()));
        let least = |value: &Value| parameters.least(value).unwrap_or(f64::NAN);
        check("time_step", &self.time_step)?;
        if least(&self.time_step) <= 0.0 {
            let message = format!("must be above 0; {}", self.time_step.found(least(&self.time_step)));
            return Err(Unfit::new("time_step", message));
        }
        if let Some(bound) = &self.bound {
            check("bound", bound)?;
            if least(bound) < 0.0 {
                let found = bound.found(least(bound));
                return Err(Unfit::new("bound", format!("must be at least 0, as every expected cost is; {found}")));
            }
        }
        let most = self.system.parameters();
        if most > parameters.len() {
            let message = format!("was made for {}; the problem has {}", count(most, "parameter"), parameters.len());
            return Err(Unfit::new("system", message));
        }
        let first = |value: &Value| parameters.number(value).unwrap_or(f64::NAN);
        if let Some(own) = self.system.time_step().map(first).filter(|own| *own != first(&self.time_step)) {
            let found = digits(first(&self.time_step));
            return Err(Unfit::new(
                "time_step",
                format!("must be that of the system, {} s; found {found}", digits(own)),
            ));
        }
        self.system.check(parameters)?;
        for (i, value) in self.initial_state.iter().enumerate() {
            check("initial_state", value).map_err(|unfit| unfit.entry(i))?;
        }
        for (t, row) in self.initial_control.iter().enumerate() {
            for (i, value) in row.iter().enumerate() {
                check("initial_control", value).map_err(|unfit| unfit.entry(t).entry(i))?;
            }
        }
        Ok(())
    }

    /// Checks that controls to start a plan from are finite and as many as it has; the error says what is valid.
    pub(crate) fn check_guess(&self, controls: &Matrices) -> Result<(), String> {
        let (steps, count) = (self.steps, self.system.dimensions().controls);
        let (found, width) = (controls.count(), controls.cols());
        if (found, width) != (steps, count) {
            return Err(format!("must be {steps} vectors of length {count}; found {found} of length {width}"));
        }
        let is_finite = |step: &usize| controls.vector(*step).iter().all(|value| value.is_finite());
        match (0..steps).find(|step| !is_finite(step)) {
            Some(step) => Err(format!("must be finite numbers; those of step {step} are not")),
            None => Ok(()),
        }
    }

    /// Checks the first guess of the controls, and their bounds.
    fn check_controls(&self) -> Result<(), Unfit> {
        let (count, steps) = (self.system.dimensions().controls, self.steps);
        let valid = format!("must be one row of {}, or {steps} such rows", supple_text::count(count, "number"));
        let rows = &self.initial_control;
        if let [row] = &rows[..]
            && row.len() != count
        {
            return Err(Unfit::new(
                "initial_control",
                format!("{valid}; found {}", supple_text::count(row.len(), "number")),
            ));
        }
        if let Some(row) = rows.iter().position(|row| row.len() != count) {
            let message = format!("{valid}; this row has {}", supple_text::count(rows[row].len(), "number"));
            return Err(Unfit::new("initial_control", message).entry(row));
        }
        if rows.len() > 1 && rows.len() != steps {
            return Err(Unfit::new("initial_control", format!("{valid}; found {} rows", rows.len())));
        }
        if let Some(known) = &self.known_controls {
            self.check_guess(known).map_err(|message| Unfit::new("known_controls", message))?;
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
