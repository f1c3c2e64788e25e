//! Writes a task file from a template, evaluates it, and corrects it until its plan does what the template intends.

use std::path::Path;

use supple_robot::{LoadOptions, load};
use supple_text::{quoted, short};

use super::ask::Asked;
use super::limb::{Limb, falling};
use super::place::{FEW, Start, starts};
use super::robot::{relative, warn_of_file, warn_of_still};
use super::rules::Rules;
use super::templates::Draft;
use super::tried::{MANY, Tried};
use crate::commands::robot::Planning;
use crate::failure::Failure;
use crate::output::warn;
use crate::progress::Waiting;
use crate::template::Template;

/// Maximum number of postures to evaluate.
const TRIES: usize = 6;
/// Maximum number of postures to evaluate once a plan is usable, even if it falls short of the template's aim.
const FEW_TRIES: usize = 2;
/// Corrections to try if a plan exceeds limits of the robot: a factor on the task's duration, and whether the limits
/// are enforced.
const CORRECTIONS: [(f64, bool); 3] = [(1.0, false), (2.0, false), (2.0, true)];
/// Numbers of sub-steps per time step to try if roll-outs show that the time step is too long.
const SUBSTEPS: [usize; 3] = [2, 4, 8];
/// Maximum factor on the contact's smoothing length if roll-outs contradict the linearisation; and its increment.
const LONGEST: f64 = 2.0;
const LONGER: f64 = 1.4;
/// Joints without a drive fall if holding them takes more than this share of the limb's weight at its lever.
const FALLING: f64 = 0.01;
/// Deflections of springs up to this are none, rad or m.
const SAG: f64 = 1e-3;
/// Speed limits above this are treated as absent, rad/s or m/s.
const FASTEST: f64 = 100.0;

/// The text of a task file, to be written to `path`.
///
/// Also returns a note on where the tool is mounted, if the options do not specify it.
///
/// # Errors
/// Where the robot's file or an option is wrong, or no plan was found.
pub fn task(title: &str, file: &Path, path: &str, asked: &Asked) -> Result<(String, Option<String>), Failure> {
    let options = LoadOptions { package_roots: asked.package_roots.clone(), ..LoadOptions::default() };
    let robot = load(file, &options)?;
    // These may say why there is no posture or no plan.
    warn_of_file(&robot);
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
    let (mut best, mut longer): (Option<Tried>, f64) = (None, 1.0);
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
            substeps: None,
        };
        let rules = |longer| Rules::of(&limb, start, template, &asked.set, longer);
        let tried = best_at(rules, draft, &mut longer, template, path)?.or_better(best);
        let is_enough = tried.faults.is_empty() || number + 1 >= FEW_TRIES && tried.is_sound();
        best = Some(tried);
        if is_enough {
            break;
        }
    }
    let best = best.ok_or_else(|| Failure::usage("no posture was found".to_owned()))?.complete();
    drop(bar);
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
    Ok((best.text(), asked.frame.is_none().then(|| limb.chosen("the tool is on"))))
}

/// The error if there is no posture to start from.
fn without_posture(limb: &Limb, asked: &Asked) -> Failure {
    Failure::usage(match asked.at {
        Some(_) => "--at: the tool cannot reach this point facing the wall; move it closer to the robot".into(),
        None if limb.joints().len() < FEW && asked.wall.is_none() => {
            format!(
                "no joint of this limb moves a tool at `{}`, whose origin lies on the joints' axes: choose a --frame beside them",
                limb.frame()
            )
        }
        None if limb.joints().len() < FEW => {
            "the joints of this limb cannot move the tool towards this wall: omit --wall, or choose another --frame"
                .into()
        }
        None => format!(
            "no posture was found in which a tool at `{}` faces a wall; give --at, another --wall, or another --frame",
            limb.frame()
        ),
    })
}

/// Warns of implausibly high speed limits.
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

/// Keeps only postures in which gravity does not move undriven joints.
///
/// # Errors
/// If there are postures, but none of them qualifies.
fn held_up(limb: &Limb, found: &mut Vec<Start>) -> Result<(), Failure> {
    let gravity = limb.gravity.iter().map(|entry| entry * entry).sum::<f64>().sqrt();
    let least = FALLING * gravity * limb.mass * limb.lever();
    let falls = |start: &Start| falling(&limb.planning, &start.held, |dof| least + SAG * limb.stiffness(dof));
    let Some(first) = found.first().map(falls) else { return Ok(()) };
    found.retain(|start| falls(start).is_empty());
    if found.is_empty() {
        let joints = quoted(&first.iter().map(|&dof| &*limb.joints()[dof]).collect::<Vec<_>>());
        if first.iter().all(|&dof| limb.stiffness(dof) > 0.0) {
            return Err(Failure::usage(format!(
                "no posture was found in which the springs of joints {joints}, for which the robot file has no drive, hold them; \
                 choose stiffer springs, or a --frame that at most two joints move"
            )));
        }
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
            limb.frame()
        )));
    }
    Ok(limb)
}

/// The best draft at a posture: one within the robot's limits, with a longer contact smoothing if the
/// linearisation is doubtful. That factor, `longer`, is kept for other postures, which have the same contact.
fn best_at<'a>(
    rules: impl Fn(f64) -> Result<Rules, Failure>,
    draft: impl Fn(Rules, bool) -> Draft<'a>,
    longer: &mut f64,
    template: Template,
    path: &str,
) -> Result<Tried<'a>, Failure> {
    let (mut best, mut correction) = (None, 0);
    loop {
        let tried = within_limits(&rules(*longer)?, &draft, &mut correction, path)?;
        let is_doubtful = tried.is_doubtful();
        let found = tried.or_better(best);
        if !is_doubtful || !template.touches() || *longer * LONGER > LONGEST {
            return Ok(found);
        }
        *longer *= LONGER;
        best = Some(found);
    }
}

/// The draft with the fewest of the [`SUBSTEPS`] at which roll-outs no longer find the steps too long; if none helps,
/// the better of the original draft and the finest one.
fn with_substeps<'a>(coarse: Tried<'a>, path: &str) -> Result<Tried<'a>, Failure> {
    let [fewer @ .., most] = SUBSTEPS;
    let finest = Tried::of(coarse.with_substeps(most), path)?.complete();
    if finest.is_coarse() {
        return Ok(finest.or_better(Some(coarse)));
    }
    for substeps in fewer {
        let found = Tried::of(coarse.with_substeps(substeps), path)?.complete();
        if !found.is_coarse() {
            return Ok(finest.or_better(Some(found)));
        }
    }
    Ok(finest)
}

/// Tries [`CORRECTIONS`] from index `from` on and returns the first draft whose plan stays within the robot's limits,
/// or the best one if none does; `from` becomes the index of the last one tried.
fn within_limits<'a>(
    rules: &Rules,
    draft: &impl Fn(Rules, bool) -> Draft<'a>,
    from: &mut usize,
    path: &str,
) -> Result<Tried<'a>, Failure> {
    let mut best = None;
    loop {
        let (slower, enforced) = CORRECTIONS[*from];
        let mut tried = Tried::of(draft(Rules { time: slower * rules.time, ..rules.clone() }, enforced), path)?;
        // Skip the costly checks of a faulty draft: another one may have no faults.
        if tried.faults.is_empty() {
            tried = tried.complete();
        }
        if tried.is_coarse() {
            tried = with_substeps(tried, path)?;
        }
        // If even twice the time gives no plan, enforcing limits will hardly help.
        let is_last = *from + 1 == CORRECTIONS.len() || *from > 0 && !tried.converged;
        let is_limited = tried.is_limited;
        let found = tried.or_better(best);
        if !is_limited || is_last {
            return Ok(found);
        }
        best = Some(found);
        *from += 1;
    }
}
