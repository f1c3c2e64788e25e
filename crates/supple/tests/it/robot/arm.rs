//! Small task files for the robots in `data/`, in parts that tests replace.

use supple::{Problem, Scratch};

/// A task file in parts.
#[derive(Clone, Debug)]
pub struct Description {
    /// Keys of `[model]` and tables below it, but for sensors.
    pub model: String,
    pub sensors: String,
    /// Names and initial values.
    pub parameters: Vec<(&'static str, f64)>,
    pub steps: usize,
    pub time_step: String,
    pub start: String,
    pub noise: String,
    pub costs: String,
}

/// The arm of `data/arm.urdf`: `shoulder` and `elbow` turn, `slide` slides, and `tool` is at the end.
pub fn arm() -> Description {
    Description {
        model: "file = \"arm.urdf\"\n".into(),
        sensors: sensor("joint_position", "select = [\"shoulder\", \"elbow\", \"slide\"]\nvariance = 1e-3"),
        parameters: Vec::new(),
        steps: 6,
        time_step: "0.02".into(),
        start: "\"q.shoulder\" = 0.3\n\"q.elbow\" = -0.4\n\"q.slide\" = 0.1\n\
                \"v.shoulder\" = 0.5\n\"v.elbow\" = -0.3\n\"v.slide\" = 0.2\n"
            .into(),
        noise: "initial = { \"*\" = 1e-3 }\nprocess = { \"*\" = 1e-4 }\n".into(),
        costs: cost("joint_position", "target = [0.4, 0.2, 0.05]\nweight = 2.0")
            + &cost("joint_velocity", "weight = 0.05")
            + &cost("control", "weight = 0.01"),
    }
}

/// The arm of `data/servo.xml` with the controls of its file.
pub fn servo() -> Description {
    Description {
        model: "file = \"servo.xml\"\n".into(),
        sensors: sensor("joint_position", "select = [\"shoulder\", \"elbow\", \"slide\"]\nvariance = 1e-3"),
        costs: cost("joint_position", "target = [0.4, 0.2, 0.05]\nweight = 2.0") + &cost("control", "weight = 0.01"),
        ..arm()
    }
}

/// A table of `[[model.compliance]]`.
pub fn compliance(kind: &str, name: &str, keys: &str) -> String {
    format!("[[model.compliance]]\nkind = \"{kind}\"\nname = \"{name}\"\n{keys}\n")
}

/// A table of `[[model.sensors]]`.
pub fn sensor(kind: &str, keys: &str) -> String {
    format!("[[model.sensors]]\nkind = \"{kind}\"\n{keys}\n")
}

/// A table of `[[tasks.costs]]`.
pub fn cost(kind: &str, keys: &str) -> String {
    format!("[[tasks.costs]]\nkind = \"{kind}\"\n{keys}\n")
}

impl Description {
    /// With more in `[model]`, or tables below it.
    pub fn with(mut self, model: &str) -> Self {
        self.model += model;
        self
    }

    /// With forces at the beginning of each step, as formulas of accelerations have them.
    pub fn explicit(mut self) -> Self {
        self.model.insert_str(0, "integrator = \"semi_implicit\"\n");
        self
    }

    /// With these sensors and no others.
    pub fn sensing(mut self, sensors: &str) -> Self {
        self.sensors = sensors.into();
        self
    }

    /// With these costs and no others.
    pub fn costing(mut self, costs: &str) -> Self {
        self.costs = costs.into();
        self
    }

    /// With more parameters.
    pub fn where_(mut self, parameters: &[(&'static str, f64)]) -> Self {
        self.parameters.extend(parameters);
        self
    }

    /// The task file.
    pub fn text(&self) -> String {
        let Self { model, sensors, parameters, steps, time_step, start, noise, costs } = self;
        let mut text = String::new();
        for (name, initial) in parameters {
            let (a, b) = (0.5 * initial, 1.5 * initial);
            text += &format!(
                "[parameters.{name}]\ninitial = {initial:?}\nbounds = [{:?}, {:?}]\n",
                a.min(b) - if *initial == 0.0 { 0.1 } else { 0.0 },
                a.max(b) + if *initial == 0.0 { 0.1 } else { 0.0 },
            );
        }
        format!(
            "{text}[model]\nkind = \"robot\"\n{model}{sensors}[[tasks]]\nname = \"task\"\nsteps = {steps}\n\
             time_step = {time_step}\n[tasks.initial_state]\n{start}[tasks.noise]\n{noise}{costs}"
        )
    }

    /// The problem; robots are looked for in `data/`.
    pub fn problem(&self) -> Problem {
        let text = self.text();
        supple_file::parse(&text, "tests/data/task.toml").unwrap_or_else(|error| panic!("{error}\n{text}"))
    }
}

/// The state after one step of the first task.
pub fn step(problem: &Problem, x: &[f64], u: &[f64], phi: &[f64]) -> Vec<f64> {
    let mut next = vec![0.0; x.len()];
    problem.tasks[0].system.step(0, x, u, phi, &mut next);
    next
}

/// The state after several steps of the first task with one control.
pub fn steps(problem: &Problem, x: &[f64], u: &[f64], phi: &[f64], count: usize) -> Vec<f64> {
    (0..count).fold(x.to_vec(), |x, _| step(problem, &x, u, phi))
}

/// The measurement of the first task.
pub fn observe(problem: &Problem, x: &[f64], phi: &[f64]) -> Vec<f64> {
    let system = &problem.tasks[0].system;
    let mut y = vec![0.0; system.dimensions().measurements];
    system.observe(0, x, phi, &mut y);
    y
}

/// The stage cost of the first task.
pub fn stage_cost(problem: &Problem, x: &[f64], u: &[f64], phi: &[f64]) -> f64 {
    problem.tasks[0].system.stage_cost(0, x, u, phi, &mut Scratch::new())
}

/// Accelerations of all positions: the task's time step must be 1.
pub fn accelerations(problem: &Problem, x: &[f64], u: &[f64], phi: &[f64], positions: usize) -> Vec<f64> {
    let next = step(problem, x, u, phi);
    (positions..2 * positions).map(|i| next[i] - x[i]).collect()
}
