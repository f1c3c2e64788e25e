//! A task file from a template: written, evaluated and corrected until its plan does what the template is about.

use std::path::Path;

use supple::{EvaluateOptions, TaskEvaluation, Verdict};
use supple_robot::{LoadOptions, load};

use super::ask::Asked;
use super::limb::Limb;
use super::place::{FEW, starts};
use super::robot::relative;
use super::rules::Rules;
use super::templates::Draft;
use crate::commands::robot::Planning;
use crate::failure::Failure;
use crate::output::warn;
use crate::template::Template;

/// Postures that are evaluated at most.
const TRIES: usize = 6;

/// The text of a task file, to be written to `path`.
///
/// # Errors
/// Where the robot's file or an option is wrong, or no plan was found.
pub fn task(title: &str, file: &Path, path: &str, asked: &Asked) -> Result<String, Failure> {
    let options = LoadOptions { package_roots: asked.package_roots.clone(), ..LoadOptions::default() };
    let robot = load(file, &options)?;
    let whole = Planning::of(&robot);
    if let Some(why) = whole.obstacle() {
        return Err(Failure::usage(format!("--robot {}: {why}", file.display())));
    }
    let template = asked.template.unwrap_or(Template::Press);
    let limb = Limb::of(&whole, asked.frame.as_deref(), file)?;
    let (joints, needed) = (limb.joints().len(), template.joints());
    if joints < needed {
        let (name, what) = template.words();
        return Err(Failure::usage(format!(
            "--template {name}: {what} requires at least {needed} joints, but `{}` is moved by {joints}; try --template press, \
             hold or reach, or a --frame that more joints move",
            limb.frame
        )));
    }
    let found = starts(&limb, asked.wall, asked.at, template == Template::Handle);
    if found.is_empty() {
        let what = match asked.at {
            Some(_) => "--at: the tool cannot reach this point facing the wall; move it closer to the robot",
            None if joints < FEW => {
                "the joints of this limb cannot move the tool towards this wall: omit --wall, or choose another --frame"
            }
            None => "no posture was found in which the tool faces a wall; give --at, or another --wall",
        };
        return Err(Failure::usage(what.to_owned()));
    }
    let folder = Path::new(path).parent().unwrap_or(Path::new(""));
    let mut best: Option<Tried> = None;
    for start in found.iter().take(TRIES) {
        // As it is; then nearer to the wall where the plan does not find it, slower where it exceeds limits of the
        // robot.
        let (mut is_lost, mut is_limited) = (false, false);
        for (slower, enforce, near) in
            [(1.0, false, false), (1.0, false, true), (2.0, false, false), (2.0, true, false)]
        {
            let is_first = !near && slower == 1.0;
            if !(is_first || near && is_lost || !near && is_limited) {
                continue;
            }
            let mut rules = Rules::of(&limb, start, template, &asked.set)?;
            rules.time *= slower;
            let draft = Draft {
                template,
                title,
                file: relative(file, folder),
                package_roots: asked.package_roots.iter().map(|root| relative(root, folder)).collect(),
                limb: &limb,
                start,
                rules: &rules,
                limit: None,
                enforce,
                near,
            };
            let tried = Tried::of(&draft, path)?;
            let done = tried.faults.is_empty();
            is_lost = is_first && tried.converged && !tried.touches && template.touches();
            is_limited = tried.is_limited;
            if best.as_ref().is_none_or(|best| tried.rank() < best.rank()) {
                best = Some(tried);
            }
            if done {
                break;
            }
        }
        if best.as_ref().is_some_and(|best| best.faults.is_empty()) {
            break;
        }
    }
    let best = best.ok_or_else(|| Failure::usage("no posture was found".to_owned()))?;
    if !best.converged {
        let message = format!(
            "no plan was found for this robot: {}; try another --frame, --wall or --at, or a longer task, --set time=2",
            best.faults.join("; ")
        );
        return Err(Failure::usage(message));
    }
    best.faults.iter().for_each(|fault| warn(fault));
    if let Some(reasons) = why_broken(&best.text, path)? {
        warn(&format!("the first design is unreliable: {reasons}; try other values of --set, --at, --frame or --wall"));
    }
    Ok(best.text)
}

/// Why roll-outs of a task do not do what is predicted, where they diverge.
fn why_broken(text: &str, path: &str) -> Result<Option<String>, Failure> {
    let problem = supple_file::parse(text, path)?;
    let options = EvaluateOptions { rollouts: problem.rollouts(None), ..EvaluateOptions::default() };
    let evaluation = problem.evaluate(&problem.parameters.initial(), &options)?;
    let mut verdicts = evaluation.tasks.into_iter().filter_map(|task| task.trust);
    Ok(verdicts.find(|trust| trust.verdict == Verdict::Broken).map(|trust| trust.reasons.join("; ")))
}

/// A draft, evaluated.
struct Tried {
    text: String,
    converged: bool,
    touches: bool,
    /// Whether the plan exceeds limits of the robot.
    is_limited: bool,
    /// What is wrong with it, for people.
    faults: Vec<String>,
}

impl Tried {
    fn of(draft: &Draft, path: &str) -> Result<Self, Failure> {
        let problem = supple_file::parse(&draft.text(), path)?;
        let phi = problem.parameters.initial();
        let evaluation = match problem.evaluate(&phi, &EvaluateOptions::default()) {
            Ok(evaluation) => evaluation,
            Err(error) => {
                let faults = vec![error.to_string()];
                return Ok(Self { text: String::new(), converged: false, touches: false, is_limited: false, faults });
            }
        };
        let task = &evaluation.tasks[0];
        let (converged, touches) = (task.status.is_converged(), task.contacts.iter().all(|contact| contact.touches));
        let mut faults: Vec<String> = task.warnings.clone();
        if !converged {
            faults.push(format!("the plan ended as {}", task.status));
        }
        if converged && !touches {
            faults.push("the plan does not touch the wall".to_owned());
        }
        faults.extend(task.limits_violated.iter().map(|limit| format!("the plan exceeds {}", limit.name)));
        let text = draft.limited(limit(task, draft.rules.margin)).text();
        Ok(Self { text, converged, touches, is_limited: !task.limits_violated.is_empty(), faults })
    }

    /// The less, the better.
    fn rank(&self) -> (bool, bool, usize) {
        (!self.converged, !self.touches, self.faults.len())
    }
}

/// The limit of the cost: a multiple of the cost of the stiff design, with two digits, rounded up; and that cost.
fn limit(task: &TaskEvaluation, margin: f64) -> (f64, f64) {
    let cost = task.cost.expected;
    let unit = 10.0_f64.powf((margin * cost).abs().max(1e-12).log10().floor() - 1.0);
    let limit = (margin * cost / unit).ceil() * unit;
    (format!("{limit:.6e}").parse().unwrap_or(limit), cost)
}
