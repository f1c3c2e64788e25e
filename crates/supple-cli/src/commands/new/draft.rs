//! A task file from a template: written, evaluated and corrected until its plan does what the template is about.

use std::path::Path;

use supple::{EvaluateOptions, Problem, Verdict};
use supple_robot::{LoadOptions, load};

use super::ask::Asked;
use super::limb::Limb;
use super::place::{FEW, starts};
use super::robot::relative;
use super::rules::{Rules, digits};
use super::templates::{Draft, Limit};
use crate::commands::robot::Planning;
use crate::failure::Failure;
use crate::output::warn;
use crate::template::Template;

/// Postures that are evaluated at most.
const TRIES: usize = 6;
/// By what factor tasks become slower and contacts set in over more length at most.
const SLOWEST: f64 = 2.0;
const LONGEST: f64 = 2.0;
/// Stiffnesses beside the stiff one at which the cost without the sensor is looked for.
const SOFTER: usize = 4;
/// Share of its cost that a design loses at least without the sensor.
const LEAST_USE: f64 = 0.05;

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
    'tries: for start in found.iter().take(TRIES) {
        // As it is; slower where it exceeds limits of the robot; with contacts that set in over more length where
        // roll-outs do not do what is predicted.
        let (mut slower, mut longer) = (1.0, 1.0);
        loop {
            let mut rules = Rules::of(&limb, start, template, &asked.set, longer)?;
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
                first: None,
            };
            let tried = Tried::of(&draft, path)?;
            let (done, is_limited, is_doubtful) = (tried.faults.is_empty(), tried.is_limited, tried.is_doubtful());
            if best.as_ref().is_none_or(|best| tried.rank() < best.rank()) {
                best = Some(tried);
            }
            if done {
                break 'tries;
            }
            if is_limited && slower < SLOWEST {
                slower *= 2.0;
            } else if is_doubtful && longer < LONGEST {
                longer *= 1.4;
            } else {
                break;
            }
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
    Ok(best.text)
}

/// A draft, evaluated.
struct Tried {
    text: String,
    converged: bool,
    touches: bool,
    /// Whether the plan exceeds limits of the robot.
    is_limited: bool,
    /// Whether roll-outs do what is predicted; none where they were not run.
    verdict: Option<Verdict>,
    /// What is wrong with it, for people.
    faults: Vec<String>,
}

impl Tried {
    fn of(draft: &Draft, path: &str) -> Result<Self, Failure> {
        let problem = supple_file::parse(&draft.text(), path)?;
        let mut phi = problem.parameters.initial();
        let costs = Costs::of(&problem, &phi);
        let Costs { stiff, precise, coarse, .. } = costs;
        let limit = limit(precise, coarse, draft.rules.margin);
        let first = (stiff > limit.bound && costs.best.is_finite()).then_some(costs.best);
        if let (Some(first), Ok(k)) = (first, problem.parameters.index("k")) {
            phi[k] = first;
        }
        let options = EvaluateOptions { rollouts: problem.rollouts(None), ..Default::default() };
        let evaluation = match problem.evaluate(&phi, &options) {
            Ok(evaluation) => evaluation,
            Err(error) => {
                let (text, faults) = (String::new(), vec![error.to_string()]);
                return Ok(Self { text, converged: false, touches: false, is_limited: false, verdict: None, faults });
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
        let trust = task.trust.as_ref().filter(|trust| trust.verdict != Verdict::Holds);
        if let Some(trust) = trust {
            faults.push(format!("roll-outs of the first design: {trust}"));
        }
        if coarse < precise * (1.0 + LEAST_USE) {
            faults.push(format!(
                "the designed sensor is of little use here: the expected cost is {precise:.4} with it and {coarse:.4} without"
            ));
        }
        let text = draft.limited(limit, first).text();
        let verdict = task.trust.as_ref().map(|trust| trust.verdict);
        Ok(Self { text, converged, touches, is_limited: !task.limits_violated.is_empty(), verdict, faults })
    }

    fn is_doubtful(&self) -> bool {
        self.converged && self.verdict.is_some_and(|verdict| verdict != Verdict::Holds)
    }

    /// The less, the better.
    fn rank(&self) -> (bool, bool, Option<Verdict>, usize) {
        (!self.converged, !self.touches, self.verdict, self.faults.len())
    }
}

/// Expected costs over stiffnesses of the mount.
struct Costs {
    /// With the stiff mount and the precise sensor.
    stiff: f64,
    /// The least with the precise sensor, and the stiffness there.
    precise: f64,
    best: f64,
    /// The least with the coarsest sensor.
    coarse: f64,
}

impl Costs {
    fn of(problem: &Problem, stiff: &[f64]) -> Self {
        let index = |name: &str| problem.parameters.iter().position(|parameter| parameter.name == name);
        let sensor = ["force_noise", "joint_noise"].into_iter().find_map(index);
        let mut found = Self { stiff: f64::INFINITY, precise: f64::INFINITY, best: f64::NAN, coarse: f64::INFINITY };
        let (Some(sensor), Some(k)) = (sensor, index("k")) else { return found };
        let [soft, most] = problem.parameters.get(k).bounds;
        let [precise, coarse] = problem.parameters.get(sensor).bounds;
        let cost = |stiffness: f64, noise: f64| {
            let mut phi = stiff.to_vec();
            (phi[k], phi[sensor]) = (stiffness, noise);
            let evaluation = problem.evaluate(&phi, &EvaluateOptions::default()).ok()?;
            evaluation.tasks[0].status.is_converged().then(|| evaluation.tasks[0].cost.expected)
        };
        for place in 0..=SOFTER {
            let stiffness = digits(most * (soft / most).powf(place as f64 / SOFTER as f64));
            let with = cost(stiffness, precise).unwrap_or(f64::INFINITY);
            if place == 0 {
                found.stiff = with;
            }
            if with < found.precise {
                (found.precise, found.best) = (with, stiffness);
            }
            found.coarse = cost(stiffness, coarse).map_or(found.coarse, |cost| cost.min(found.coarse));
        }
        found
    }
}

/// The limit of the cost: a share of the way from that with the precise sensor to that with the coarse one, rounded to a
/// hundredth of the way.
fn limit(precise: f64, coarse: f64, margin: f64) -> Limit {
    let precise = if precise.is_finite() { precise } else { 1.0 };
    let way = if coarse.is_finite() { (coarse - precise).max(0.02 * precise) } else { precise };
    let unit = 10.0_f64.powf((0.01 * way).max(1e-12).log10().floor());
    let bound = ((precise + margin * way) / unit).ceil() * unit;
    Limit { bound: format!("{bound:.6e}").parse().unwrap_or(bound), precise, coarse }
}
