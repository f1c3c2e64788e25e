//! A task file from a template: written, evaluated and corrected until its plan does what the template is about.

use std::path::Path;

use supple::{EvaluateOptions, LimitViolation, Problem, TaskEvaluation, Trust, Verdict};
use supple_robot::{LoadOptions, load};
use supple_text::{quoted, short};

use super::ask::Asked;
use super::costs::{Costs, limit};
use super::limb::Limb;
use super::place::{FEW, Start, starts};
use super::robot::{relative, warn_of_still};
use super::rules::Rules;
use super::templates::Draft;
use crate::commands::robot::Planning;
use crate::failure::Failure;
use crate::output::warn;
use crate::progress::Waiting;
use crate::template::Template;

/// Postures that are evaluated at most.
const TRIES: usize = 6;
/// Postures that are evaluated at most where the plan can be used, though it falls short of what the template asks for.
const FEW_TRIES: usize = 2;
/// What is tried where a plan exceeds limits of the robot: a factor on the duration of the task, and whether the plan keeps
/// the limits.
const CORRECTIONS: [(f64, bool); 3] = [(1.0, false), (2.0, false), (2.0, true)];
/// Greatest factor on the smoothing length of the contact, where roll-outs find the linearisation doubtful, and its step.
const LONGEST: f64 = 2.0;
const LONGER: f64 = 1.4;
/// Share of the torque by the weight of the limb above which gravity moves a joint without a drive.
const FALLING: f64 = 0.01;
/// Roll-outs where the usual number is too few to tell.
const MANY: usize = 1000;
/// Tolerances by which a plan may end beside its target.
const BESIDE: f64 = 3.0;
/// Speed limits above this stand for none, rad/s or m/s.
const FASTEST: f64 = 100.0;
/// By which share of the cost a sensor that is of use lowers it.
const LEAST_USE: f64 = 0.05;

/// The text of a task file, to be written to `path`.
///
/// With it, what the tool is mounted on, where nothing says that.
///
/// # Errors
/// Where the robot's file or an option is wrong, or no plan was found.
pub fn task(title: &str, file: &Path, path: &str, asked: &Asked) -> Result<(String, Option<String>), Failure> {
    let options = LoadOptions { package_roots: asked.package_roots.clone(), ..LoadOptions::default() };
    let robot = load(file, &options)?;
    let whole = Planning::of(&robot);
    if let Some(why) = whole.obstacle() {
        return Err(Failure::usage(format!("--robot {}: {why}", file.display())));
    }
    let template = asked.template.unwrap_or(Template::Press);
    let limb = limb(&whole, template, file, asked)?;
    let bar = Waiting::new();
    bar.say("looking for a posture");
    let mut found = starts(&limb, asked.wall, asked.at, template == Template::Handle);
    held_up(&limb, &mut found)?;
    if found.is_empty() {
        return Err(without_posture(&limb, asked));
    }
    let folder = Path::new(path).parent().unwrap_or(Path::new(""));
    let mut best: Option<Tried> = None;
    let most = found.len().min(TRIES);
    for (number, start) in found.iter().take(TRIES).enumerate() {
        bar.say(&format!("planning the task in posture {} of at most {most}", number + 1));
        let draft = |rules: Rules, enforced: bool| Draft {
            template,
            title,
            file: relative(file, folder),
            package_roots: asked.package_roots.iter().map(|root| relative(root, folder)).collect(),
            limb: &limb,
            start,
            rules,
            limit: None,
            enforced,
            first: None,
            rollouts: (template == Template::Reach).then_some(MANY),
        };
        let rules = |longer| Rules::of(&limb, start, template, &asked.set, longer);
        best = better(best, best_at(rules, draft, (template, path))?);
        let is_enough = |best: &Tried| best.faults.is_empty() || number + 1 >= FEW_TRIES && best.is_sound();
        if best.as_ref().is_some_and(is_enough) {
            break;
        }
    }
    drop(bar);
    let best = best.ok_or_else(|| Failure::usage("no posture was found".to_owned()))?;
    if !best.converged {
        let message = format!(
            "no plan was found for this robot: {}; try another --frame, --wall or --at, or a longer task, --set time=2",
            best.faults.join("; ")
        );
        return Err(Failure::usage(message));
    }
    warn_of_still(&limb.planning);
    warn_of_fast(&limb);
    best.faults.iter().chain(&best.remarks).for_each(|fault| warn(fault));
    Ok((best.text, asked.frame.is_none().then(|| limb.chosen())))
}

/// That there is no posture to begin from.
fn without_posture(limb: &Limb, asked: &Asked) -> Failure {
    Failure::usage(match asked.at {
        Some(_) => "--at: the tool cannot reach this point facing the wall; move it closer to the robot".into(),
        None if limb.joints().len() < FEW && asked.wall.is_none() => {
            format!("no joint of this limb moves a tool at `{}`: choose another --frame", limb.frame)
        }
        None if limb.joints().len() < FEW => {
            "the joints of this limb cannot move the tool towards this wall: omit --wall, or choose another --frame"
                .into()
        }
        None => format!(
            "no posture was found in which a tool at `{}` faces a wall; give --at, another --wall, or another --frame",
            limb.frame
        ),
    })
}

/// Warns of speed limits that no joint reaches.
fn warn_of_fast(limb: &Limb) {
    for slides in [false, true] {
        let fast =
            limb.of_kind(slides).filter(|joint| joint.limits.velocity.is_finite() && joint.limits.velocity > FASTEST);
        let (names, speeds): (Vec<&str>, Vec<f64>) = fast.map(|joint| (&*joint.name, joint.limits.velocity)).unzip();
        if let Some(least) = speeds.into_iter().reduce(f64::min) {
            let (joints, unit, s) =
                (quoted(&names), if slides { "m/s" } else { "rad/s" }, if names.len() == 1 { "" } else { "s" });
            warn(&format!(
                "the robot file limits the speed of joint{s} {joints} to {} {unit}: not a real limit? Correct `velocity` there, or \
                 lower the limit in the task",
                short(least, 3)
            ));
        }
    }
}

/// Leaves postures in which gravity moves no joint without a drive.
///
/// # Errors
/// Where there are postures, but none of these.
fn held_up(limb: &Limb, found: &mut Vec<Start>) -> Result<(), Failure> {
    let driven = limb.driven();
    let gravity = limb.gravity.iter().map(|entry| entry * entry).sum::<f64>().sqrt();
    let least = FALLING * gravity * limb.mass * limb.lever();
    let falls = |start: &Start, dof: usize| !driven.contains(&dof) && start.held[dof].abs() > least;
    let falling: Vec<&str> = match found.first() {
        Some(start) => (0..start.held.len()).filter(|&dof| falls(start, dof)).map(|dof| &*limb.joints()[dof]).collect(),
        None => return Ok(()),
    };
    found.retain(|start| (0..start.held.len()).all(|dof| !falls(start, dof)));
    if found.is_empty() {
        let joints = quoted(&falling);
        return Err(Failure::usage(format!(
            "gravity moves joints {joints}, for which the robot file has no drive: floating bases and robots that fall are \
             not supported; remove these joints from the file, give them actuators, or choose another --frame"
        )));
    }
    Ok(())
}

/// The limb that the tool is mounted on, with joints enough for the template.
fn limb(whole: &Planning, template: Template, file: &Path, asked: &Asked) -> Result<Limb, Failure> {
    let limb = Limb::of(whole, asked.frame.as_deref(), file)?;
    let (joints, needed) = (limb.joints().len(), template.joints());
    if joints < needed {
        let (name, what) = template.words();
        return Err(Failure::usage(format!(
            "--template {name}: {what} requires at least {needed} joints, but `{}` is moved by {joints}; try --template press, \
             hold or reach, or a --frame that more joints move",
            limb.frame
        )));
    }
    Ok(limb)
}

/// The best draft at a posture: one that keeps the limits of the robot, with a longer smoothing of the contact where the
/// linearisation is doubtful.
fn best_at<'a>(
    rules: impl Fn(f64) -> Result<Rules, Failure>,
    draft: impl Fn(Rules, bool) -> Draft<'a>,
    (template, path): (Template, &str),
) -> Result<Option<Tried>, Failure> {
    let (mut longer, mut correction) = (1.0, 0);
    let mut best = None;
    loop {
        let rules = rules(longer)?;
        let tried = within_limits(&rules, &draft, &mut correction, path)?;
        let is_doubtful = tried.as_ref().is_some_and(|tried| tried.is_doubtful() && !tried.is_coarse());
        best = better(best, tried);
        longer *= LONGER;
        if !is_doubtful || !template.touches() || longer > LONGEST {
            return Ok(best);
        }
    }
}

/// The first of the [`CORRECTIONS`] from a number on, which becomes that of the one that was found, of which the plan keeps
/// the limits of the robot.
fn within_limits<'a>(
    rules: &Rules,
    draft: &impl Fn(Rules, bool) -> Draft<'a>,
    from: &mut usize,
    path: &str,
) -> Result<Option<Tried>, Failure> {
    let corrected = |number: usize| {
        let (slower, enforced) = CORRECTIONS[number];
        draft(Rules { time: slower * rules.time, ..rules.clone() }, enforced)
    };
    let (last, mut best, mut skipped) = (CORRECTIONS.len() - 1, None, None);
    for number in *from..=last {
        *from = number;
        let draft = corrected(number);
        // Nothing else is asked of a draft that exceeds limits while there is a correction.
        if number < last && exceeds_limits(&draft, path)? {
            skipped = Some(number);
            continue;
        }
        let tried = Tried::of(&draft, path)?;
        let is_limited = tried.is_limited;
        best = better(best, Some(tried));
        if !is_limited {
            break;
        }
    }
    // A plan beyond limits is better than none.
    if let Some(number) = skipped
        && best.as_ref().is_none_or(|best| !best.converged || !best.touches)
    {
        best = better(best, Some(Tried::of(&corrected(number), path)?));
    }
    Ok(best)
}

/// Whether the plan of a draft exceeds limits of the robot.
fn exceeds_limits(draft: &Draft, path: &str) -> Result<bool, Failure> {
    let problem = supple_file::parse(&draft.text(), path)?;
    let options = EvaluateOptions { rollouts: 0, ..Default::default() };
    let evaluation = problem.evaluate(&problem.parameters.initial(), &options);
    Ok(evaluation.is_ok_and(|evaluation| {
        let task = &evaluation.tasks[0];
        task.status.is_converged() && !task.limits_violated.is_empty()
    }))
}

fn better(best: Option<Tried>, tried: Option<Tried>) -> Option<Tried> {
    match (best, tried) {
        (Some(best), Some(tried)) => Some(if best.rank() <= tried.rank() { best } else { tried }),
        (best, tried) => best.or(tried),
    }
}

/// A draft, evaluated.
struct Tried {
    text: String,
    converged: bool,
    touches: bool,
    /// Whether the plan exceeds limits of the robot.
    is_limited: bool,
    /// What roll-outs say of the linearisation; none where nothing could be evaluated.
    trust: Option<Trust>,
    /// What is wrong with it, for people.
    faults: Vec<String>,
    /// What is wrong with its softest mount, for people: no reason for another posture.
    remarks: Vec<String>,
}

impl Tried {
    fn of(draft: &Draft, path: &str) -> Result<Self, Failure> {
        let problem = supple_file::parse(&draft.text(), path)?;
        let mut phi = problem.parameters.initial();
        let costs = Costs::of(&problem, &phi);
        let Costs { stiff, precise, coarse, .. } = costs;
        let limit = limit(precise, coarse, draft.rules.margin);
        let mut first = (stiff > limit.bound && costs.best.is_finite()).then_some(costs.best);
        let evaluate = |phi: &[f64], rollouts: usize| {
            problem.evaluate(phi, &EvaluateOptions { rollouts, trajectories: true, ..Default::default() })
        };
        if let (Some(found), Ok(k)) = (first, problem.parameters.index("k")) {
            let stiff = std::mem::replace(&mut phi[k], found);
            // The plan was found from that of another stiffness, and a search begins without it.
            if !evaluate(&phi, 0).is_ok_and(|evaluation| evaluation.tasks[0].status.is_converged()) {
                (first, phi[k]) = (None, stiff);
            }
        }
        let rollouts = problem.rollouts(None);
        let mut evaluation = match evaluate(&phi, rollouts) {
            Ok(evaluation) => evaluation,
            Err(error) => {
                let (text, faults) = (String::new(), vec![error.to_string()]);
                return Ok(Self {
                    text,
                    converged: false,
                    touches: false,
                    is_limited: false,
                    trust: None,
                    faults,
                    remarks: Vec::new(),
                });
            }
        };
        let mut draft = draft.limited(limit, first);
        let needs_more = evaluation.tasks[0].trust.as_ref().is_some_and(Trust::needs_only_rollouts);
        if needs_more
            && rollouts < MANY
            && let Ok(more) = evaluate(&phi, MANY)
        {
            evaluation = more;
            draft.rollouts = Some(MANY);
        }
        let task = &evaluation.tasks[0];
        let mut tried = Self {
            text: draft.text(),
            converged: task.status.is_converged(),
            touches: touches(task),
            is_limited: !task.limits_violated.is_empty(),
            trust: task.trust.clone(),
            faults: faults(&draft, task),
            remarks: Vec::new(),
        };
        if tried.converged && !tried.is_limited {
            tried.remarks.extend(of_softest(&problem, &phi));
        }
        // What makes a sensor of use, more uncertainty, makes a doubtful linearisation worse.
        if coarse < precise * (1.0 + LEAST_USE) && !tried.is_doubtful() {
            tried.faults.push(of_little_use(draft.template, precise, coarse));
        }
        Ok(tried)
    }

    /// Whether roll-outs find the linearisation doubtful, and not only that there are too few of them.
    fn is_doubtful(&self) -> bool {
        let doubted = |trust: &Trust| trust.verdict != Verdict::Holds && !trust.needs_only_rollouts();
        self.converged && self.trust.as_ref().is_some_and(doubted)
    }

    /// Whether the plan can be trusted and a robot can follow it.
    fn is_sound(&self) -> bool {
        self.converged && self.touches && !self.is_limited && !self.is_doubtful()
    }

    /// Whether roll-outs find the steps too long, and no other fault of the linearisation.
    fn is_coarse(&self) -> bool {
        self.trust.as_ref().is_some_and(Trust::needs_only_substeps)
    }

    /// The less, the better.
    fn rank(&self) -> (bool, bool, Option<Verdict>, usize) {
        (!self.converged, !self.touches, self.trust.as_ref().map(|trust| trust.verdict), self.faults.len())
    }
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
    // Limits of the file by its own names; the task repeats them by those of its channels.
    let limits = task.limits_violated.iter().filter(|limit| limit.name.contains(" of "));
    faults.extend(limits.map(|limit| {
        let (name, [worst, limit]) = (&limit.name, [limit.worst, limit.limit].map(|number| short(number, 3)));
        format!("the plan exceeds the {name}: {worst}, limit {limit}; try --set time or --set travel, or another --at")
    }));
    faults.extend(beside(draft, task));
    if let Some(by) = draft.travelled() {
        let (by, travel) = (short(by, 3), short(draft.rules.travel, 3));
        faults.push(format!(
            "the tool moves by {by} m instead of {travel} m: it reaches no farther from here; try --at or another --wall"
        ));
    }
    if let Some(trust) = task.trust.as_ref().filter(|trust| trust.verdict != Verdict::Holds) {
        let numbers = match draft.template {
            Template::Reach => "; try --set disturbance, with less of it, or --set travel",
            Template::Handle => "; try a smaller --set wall_sd or --set travel",
            _ => "; try a larger --set smoothing or a smaller --set wall_sd",
        };
        let numbers = if trust.needs_only_rollouts() { "" } else { numbers };
        faults.push(format!("roll-outs of the first design: {trust}{numbers}"));
    }
    faults
}

/// That the plan with the softest mount exceeds limits of the robot, where that at `phi` does not.
fn of_softest(problem: &Problem, phi: &[f64]) -> Option<String> {
    let k = problem.parameters.index("k").ok()?;
    let [soft, _] = problem.parameters.get(k).bounds;
    let mut phi = phi.to_vec();
    phi[k] = soft;
    let evaluation = problem.evaluate(&phi, &EvaluateOptions { rollouts: 0, ..Default::default() }).ok()?;
    let task = evaluation.tasks.first().filter(|task| task.status.is_converged())?;
    let LimitViolation { name, worst, limit, .. } =
        task.limits_violated.iter().find(|limit| limit.name.contains(" of "))?;
    let [soft, worst, limit] = [soft, *worst, *limit].map(|number| short(number, 3));
    Some(format!(
        "with the softest mount, k = {soft}, the plan exceeds the {name}: {worst}, limit {limit}; raise the lower bound of \
         `k`, or write `enforce = true` for that limit"
    ))
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
        _ => {
            let of_cost = trajectory.quantities.iter().filter(|quantity| quantity.of.starts_with("cost "));
            let places = of_cost.filter(|quantity| quantity.unit == "m" && quantity.name.contains(" of "));
            let off = places.filter_map(|quantity| Some(quantity.values.last()? - quantity.target?));
            (off.map(|off| off * off).sum::<f64>().sqrt(), draft.rules.tolerance, "m")
        }
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
