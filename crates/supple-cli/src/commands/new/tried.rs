//! A draft of a task file, planned and judged.

use supple::{EvaluateOptions, Evaluation, LimitViolation, Matrices, Problem, TaskEvaluation, Trust, Verdict};
use supple_text::short;

use super::costs::{Costs, limit};
use super::templates::Draft;
use crate::failure::Failure;
use crate::template::Template;

/// Maximum iterations of a plan: template designs take some tens from their initial guess, and a search must be able
/// to find the plan again.
const MOST_ITERATIONS: usize = 100;
/// Number of roll-outs if the usual number is too small to be conclusive.
pub const MANY: usize = 1000;
/// How far, in tolerances, a plan may end from its target.
const BESIDE: f64 = 3.0;
/// A sensor is useful if it lowers the cost by at least this share.
const LEAST_USE: f64 = 0.05;

/// A draft and what is known about it: first its plan with the stiff mount, later its cost limit and roll-outs of the
/// initial design of a search.
pub struct Tried<'a> {
    draft: Draft<'a>,
    problem: Problem,
    /// Controls of the most recent plan, which warm-start plans with other mounts and roll-outs.
    controls: Option<Matrices>,
    /// Whether its limit and its roll-outs are known.
    is_complete: bool,
    pub converged: bool,
    pub touches: bool,
    /// Whether the plan exceeds limits of the robot.
    pub is_limited: bool,
    /// What roll-outs show about the linearisation; `None` without roll-outs.
    trust: Option<Trust>,
    /// What is wrong with it, for people.
    pub faults: Vec<String>,
    /// Whether roll-outs with the softest mount find the steps too long.
    softest_is_coarse: bool,
    /// What is wrong with its softest mount, for people: no reason for another posture.
    pub remarks: Vec<String>,
}

impl<'a> Tried<'a> {
    /// Plans a draft with its stiff mount, to be written to `path`.
    ///
    /// # Errors
    /// Where its text is no task.
    pub fn of(draft: Draft<'a>, path: &str) -> Result<Self, Failure> {
        let mut problem = supple_file::parse(&draft.text(), path)?;
        problem.planning.max_iterations = MOST_ITERATIONS;
        let found = evaluate(&problem, &problem.parameters.initial(), 0, None);
        let mut tried = Self {
            draft,
            problem,
            controls: None,
            is_complete: false,
            converged: false,
            touches: false,
            is_limited: false,
            trust: None,
            softest_is_coarse: false,
            faults: Vec::new(),
            remarks: Vec::new(),
        };
        match found {
            Ok(evaluation) => tried.judge(&evaluation.tasks[0]),
            Err(error) => tried.faults.push(error.to_string()),
        }
        Ok(tried)
    }

    /// Stores the findings of an evaluation.
    fn judge(&mut self, task: &TaskEvaluation) {
        self.converged = task.status.is_converged();
        self.touches = touches(task);
        self.is_limited = !task.limits_violated.is_empty();
        self.trust.clone_from(&task.trust);
        self.faults = faults(&self.draft, task);
        self.controls = controls(task);
    }

    /// The same draft with its cost limit, initial design and roll-outs of that design.
    #[must_use]
    pub fn complete(mut self) -> Self {
        if self.is_complete || !self.converged {
            return self;
        }
        let problem = &self.problem;
        let mut phi = problem.parameters.initial();
        let Costs { stiff, precise, best, coarse, softest } = Costs::of(problem, &phi, self.controls.as_ref());
        let limit = limit(precise, coarse, self.draft.rules.margin);
        let mut first = (stiff > limit.bound && best.is_finite()).then_some(best);
        if let (Some(found), Ok(k)) = (first, problem.parameters.index("k")) {
            let stiff = std::mem::replace(&mut phi[k], found);
            // That plan was warm-started from another stiffness; check that a cold start, as in a search, converges too.
            match evaluate(problem, &phi, 0, None) {
                Ok(evaluation) if evaluation.tasks[0].status.is_converged() => {
                    self.controls = controls(&evaluation.tasks[0]);
                }
                _ => (first, phi[k]) = (None, stiff),
            }
        }
        let usual = problem.rollouts(None);
        let rolled_out = |rollouts: usize| evaluate(problem, &phi, rollouts, self.controls.clone());
        let mut evaluation = match rolled_out(usual) {
            Ok(evaluation) => evaluation,
            Err(error) => {
                self.faults.push(error.to_string());
                self.converged = false;
                return self;
            }
        };
        let mut draft = self.draft.limited(limit, first);
        let needs_more = evaluation.tasks[0].trust.as_ref().is_some_and(Trust::needs_only_rollouts);
        if needs_more
            && usual < MANY
            && let Ok(more) = rolled_out(MANY)
        {
            evaluation = more;
            draft.rollouts = Some(MANY);
        }
        self.draft = draft;
        self.is_complete = true;
        self.judge(&evaluation.tasks[0]);
        self.softest_is_coarse = self.converged && self.is_coarse_at_softest(&phi);
        if self.converged && !self.is_limited {
            self.remarks.extend(softest.as_ref().map(of_softest));
        }
        // More uncertainty would make the sensor useful, but a doubtful linearisation worse.
        if coarse < precise * (1.0 + LEAST_USE) && !self.is_doubtful() {
            self.faults.push(of_little_use(self.draft.template, precise, coarse));
        }
        self
    }

    /// The task file.
    pub fn text(&self) -> String {
        self.draft.text()
    }

    /// Whether roll-outs find the linearisation doubtful, and not only that there are too few of them.
    pub fn is_doubtful(&self) -> bool {
        let doubted = |trust: &Trust| trust.verdict != Verdict::Holds && !trust.needs_only_rollouts();
        self.converged && self.trust.as_ref().is_some_and(doubted)
    }

    /// Whether the plan can be trusted, as far as that is known, and a robot can follow it.
    pub fn is_sound(&self) -> bool {
        self.converged && self.touches && !self.is_limited && !self.is_doubtful()
    }

    /// Whether roll-outs find the steps too long: those of the first design, or those with the softest mount, which a search is
    /// likely to come to.
    pub fn is_coarse(&self) -> bool {
        self.softest_is_coarse || self.trust.as_ref().is_some_and(advises_substeps)
    }

    fn is_coarse_at_softest(&self, phi: &[f64]) -> bool {
        let problem = &self.problem;
        let Ok(k) = problem.parameters.index("k") else { return false };
        let mut softest = phi.to_vec();
        softest[k] = problem.parameters.get(k).bounds[0];
        // Where no plan is found, a search finds none either.
        let found = evaluate(problem, &softest, problem.rollouts(None), self.controls.clone());
        let task = found.ok().and_then(|evaluation| evaluation.tasks.into_iter().next());
        let task = task.filter(|task| task.status.is_converged());
        task.and_then(|task| task.trust).as_ref().is_some_and(advises_substeps)
    }

    /// The draft with so many sub-steps.
    pub fn with_substeps(&self, substeps: usize) -> Draft<'a> {
        Draft { substeps: Some(substeps), limit: None, first: None, ..self.draft.clone() }
    }

    /// Of two drafts, the one with fewer problems.
    #[must_use]
    pub fn or_better(self, other: Option<Self>) -> Self {
        match other {
            Some(other) if other.rank() <= self.rank() => other,
            _ => self,
        }
    }

    /// Lower is better; a draft with roll-outs had no faults before them.
    fn rank(&self) -> (bool, bool, bool, bool, Option<Verdict>, usize) {
        let verdict = self.trust.as_ref().map(|trust| trust.verdict);
        (!self.converged, !self.touches, self.is_limited, !self.is_complete, verdict, self.faults.len())
    }
}

/// Evaluates the one task of a draft, with its trajectory; from the controls of a plan, if given.
pub fn evaluate(
    problem: &Problem,
    phi: &[f64],
    rollouts: usize,
    controls: Option<Matrices>,
) -> Result<Evaluation, supple::Error> {
    let controls = controls.map(|controls| vec![controls]);
    problem.evaluate(phi, &EvaluateOptions { rollouts, trajectories: true, controls, ..Default::default() })
}

/// The controls of a plan that was found.
fn controls(task: &TaskEvaluation) -> Option<Matrices> {
    let trajectory = task.trajectory.as_ref().filter(|_| task.status.is_converged())?;
    Some(Matrices::of_rows(&trajectory.controls, trajectory.control_names.len()))
}

fn touches(task: &TaskEvaluation) -> bool {
    task.contacts.iter().all(|contact| contact.touches)
}

/// What is wrong with the plan of a draft, and with its roll-outs.
fn faults(draft: &Draft, task: &TaskEvaluation) -> Vec<String> {
    let converged = task.status.is_converged();
    let mut faults: Vec<String> = task.warnings.clone();
    if !converged {
        faults.push(format!("the plan ended as {}", task.status));
    }
    if converged && !touches(task) {
        faults.push("the plan does not touch the wall".to_owned());
    }
    let limits = exceeded(task).into_iter();
    faults.extend(limits.map(|what| format!("{what}; try --set time or --set travel, or another --at")));
    faults.extend(beside(draft, task));
    if let Some(by) = draft.travelled() {
        let (by, travel) = (short(by, 3), short(draft.rules.travel, 3));
        faults.push(format!(
            "the tool moves by {by} m instead of {travel} m: it reaches no farther from here; try --at or another --wall"
        ));
    }
    if let Some(trust) = task.trust.as_ref().filter(|trust| trust.verdict != Verdict::Holds) {
        let numbers = match draft.template {
            Template::Reach => "; try a smaller --set disturbance, or another --set travel",
            Template::Handle => "; try a smaller --set wall_sd or --set travel",
            _ => "; try a larger --set smoothing or a smaller --set wall_sd",
        };
        let numbers = if trust.needs_only_rollouts() { "" } else { numbers };
        faults.push(format!("roll-outs of the first design: {trust}{numbers}"));
    }
    faults
}

/// The limits of the robot file that a plan exceeds, by the file's own names; the task repeats them by those of its
/// channels.
pub fn exceeded(task: &TaskEvaluation) -> Vec<String> {
    let limits = task.limits_violated.iter().filter(|limit| limit.name.contains(" of "));
    let said = limits.map(|LimitViolation { name, worst, limit, .. }| {
        format!("the plan exceeds the {name}: {}, limit {}", short(*worst, 3), short(*limit, 3))
    });
    said.collect()
}

/// That the plan with the softest mount exceeds limits of the robot, where that of the first design does not.
fn of_softest((stiffness, LimitViolation { name, worst, limit, .. }): &(f64, LimitViolation)) -> String {
    let [soft, worst, limit] = [stiffness, worst, limit].map(|&number| short(number, 3));
    format!(
        "with the softest mount, k = {soft}, the plan exceeds the {name}: {worst}, limit {limit}; raise the lower bound of \
         `k`, or write `enforce = true` for that limit"
    )
}

/// How far a plan ends from the targets of its costs of points, m.
pub fn distance(task: &TaskEvaluation) -> Option<f64> {
    let of_cost = task.trajectory.as_ref()?.quantities.iter().filter(|quantity| quantity.of.starts_with("cost "));
    let places = of_cost.filter(|quantity| quantity.unit == "m" && quantity.name.contains(" of "));
    let off = places.filter_map(|quantity| Some(quantity.values.last()? - quantity.target?));
    Some(off.map(|off| off * off).sum::<f64>().sqrt())
}

/// The fault of a plan that ends beside its target.
fn beside(draft: &Draft, task: &TaskEvaluation) -> Option<String> {
    let trajectory = task.trajectory.as_ref()?;
    let (off, tolerance, unit) = match draft.template {
        Template::Press | Template::Hold => return None,
        Template::Handle => {
            let name = format!("q.{}_rz", draft.door_name());
            let hinge = trajectory.state_names.iter().position(|state| *state == name)?;
            (trajectory.states.last()?[hinge] - draft.opening(), draft.opening_tolerance(), "rad")
        }
        _ => (distance(task)?, draft.rules.tolerance, "m"),
    };
    let off = off.abs();
    (off > BESIDE * tolerance).then(|| {
        let (off, tolerance) = (short(off, 2), short(tolerance, 2));
        format!(
            "the plan ends {off} {unit} from its target, with a tolerance of {tolerance} {unit}: the target may be out of reach; try \
             a smaller --set travel, a longer --set time, or --at"
        )
    })
}

fn advises_substeps(trust: &Trust) -> bool {
    trust.substeps_advised.is_some()
}

/// The warning about a sensor that the task hardly needs.
fn of_little_use(template: Template, precise: f64, coarse: f64) -> String {
    let (sensor, number) = match template {
        Template::Reach => ("joint sensors are", "disturbance"),
        _ => ("force sensor is", "wall_sd"),
    };
    format!(
        "the {sensor} of little use in this task: the least expected cost is {precise:.4} with the precise noise and \
         {coarse:.4} with the coarsest; try a larger --set {number}"
    )
}
