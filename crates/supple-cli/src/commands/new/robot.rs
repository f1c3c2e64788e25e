//! A task file for a robot: the end of a limb reaches a point.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use supple_robot::{JointKind, Kinematics, LoadOptions, Numbers, Robot, bias, load, mass_matrix};
use supple_text::{quoted, short, significant};

use super::ask::Asked;
use super::limb::{Limb, MOST_JOINTS, falling};
use super::rules::plain;
use super::tried::{distance, evaluate, exceeded};
use crate::commands::robot::{Planning, SMOOTHING};
use crate::failure::Failure;
use crate::output::warn;

/// How far joints turn or slide to the goal, rad or m.
const TURN: f64 = 0.2;
const SLIDE: f64 = 0.05;
/// Time that the task lasts, and its time step, s.
const DURATION: f64 = 0.5;
const TIME_STEP: f64 = 0.005;

/// Factors on the weight of the control to try if the plan does not reach its target.
const CHEAPER: [f64; 3] = [0.1, 0.01, 0.001];
/// Factors on the time to try if the plan exceeds limits of the robot.
const SLOWER: [f64; 2] = [2.0, 4.0];
/// Joints without a drive fall if gravity accelerates them by more than this, rad/s^2 or m/s^2.
const FALLING: f64 = 1.0;
/// Joints with a spring and without a drive fall if gravity deflects them by more than this, rad or m.
const GIVING: f64 = 0.5;
/// How far from its target a plan may end, as a share of the way.
const BESIDE: f64 = 0.1;

/// The task file of the robot in `file`, to be written to `path`.
///
/// # Errors
/// Where the file is wrong, or nothing in it can be planned.
pub fn task(title: &str, file: &Path, path: &str, asked: &Asked) -> Result<(String, Option<String>), Failure> {
    let package_roots = &asked.package_roots;
    let folder = Path::new(path).parent().unwrap_or(Path::new(""));
    let options = LoadOptions { package_roots: package_roots.clone(), ..LoadOptions::default() };
    let robot = load(file, &options)?;
    let whole = Planning::of(&robot);
    if let Some(why) = whole.obstacle() {
        return Err(Failure::usage(format!("--robot {}: {why}", file.display())));
    }
    warn_of_still(&whole);
    let limb = Limb::of(&whole, asked.frame.as_deref(), file)?;
    let chosen = asked.frame.is_none().then(|| limb.chosen("the point is reached by"));
    // Few joints are all planned.
    let planning = if whole.tree.dofs() <= MOST_JOINTS { &whole } else { &limb.planning };
    let gravity = robot.gravity.unwrap_or([0.0, 0.0, -9.81]);
    let mut text = format!(
        "# The end of a limb reaches a point. Try:\n#\n#     supple evaluate FILE    plan, information and cost\n\
         #     supple check FILE       compare every derivative with finite differences\n#\n\
         # docs/tasks.md lists all keys; `[parameters]` with `bounds` declare the numbers that `supple design` chooses.\n\
         title = {title:?}\n\n[model]\nkind = \"robot\"\nfile = {:?}\n",
        relative(file, folder)
    );
    if !package_roots.is_empty() {
        let roots: Vec<_> = package_roots.iter().map(|root| format!("{:?}", relative(root, folder))).collect();
        let _ = writeln!(text, "package_roots = [{}]", roots.join(", "));
    }
    if let Some(line) = planning.locked_line() {
        let _ = writeln!(text, "{line}   # remove those to be planned");
    }
    let driven = driven(planning);
    if driven.len() < planning.tree.dofs() {
        let names: Vec<_> = driven.iter().map(|&dof| format!("{:?}", planning.tree.joints()[dof])).collect();
        let _ =
            writeln!(text, "actuated = [{}]   # the file gives no effort limit for the other joints", names.join(", "));
    }
    limb.tool.write(&mut text);
    let reach = Reach::of(planning, &limb, gravity);
    let tried = |cheaper: f64, slower: f64, keeps: Keeps| -> Result<(String, Plan), Failure> {
        let limits = if keeps.positions { reach.limits() } else { String::new() };
        let text = format!("{text}{}{limits}", reach.text(cheaper, slower, keeps));
        let plan = reach.planned(&text, path)?;
        Ok((text, plan))
    };
    let written = |cheaper: f64, slower: f64| tried(cheaper, slower, Keeps::default());
    let (mut text, mut plan) = written(1.0, 1.0)?;
    let mut weight = 1.0;
    if plan.missed.is_some() {
        for cheaper in CHEAPER {
            let other = written(cheaper, 1.0)?;
            if other.1.missed.is_none() {
                ((text, plan), weight) = (other, cheaper);
                break;
            }
        }
    }
    for slower in SLOWER {
        if plan.missed.is_some() || plan.exceeded.is_empty() {
            break;
        }
        let other = written(weight, slower)?;
        if other.1.missed.is_none() && other.1.exceeded.len() < plan.exceeded.len() {
            (text, plan) = other;
        }
    }
    if plan.missed.is_none() && !plan.exceeded.is_empty() {
        for slower in [1.0].into_iter().chain(SLOWER) {
            // Drives without limits have none to keep.
            let all = tried(weight, slower, Keeps { positions: true, efforts: true });
            let other = all.or_else(|_| tried(weight, slower, Keeps { positions: true, efforts: false }))?;
            if other.1.missed.is_none() && other.1.exceeded.len() < plan.exceeded.len() {
                (text, plan) = other;
                break;
            }
        }
    }
    plan.missed.iter().chain(&plan.exceeded).for_each(|what| warn(what));
    warn_of_file(&robot);
    Ok((text, chosen))
}

/// Prints what the robot file's reader warns of, as every command does that reads the task.
pub fn warn_of_file(robot: &Robot) {
    robot.warnings.iter().for_each(|warning| warn(warning));
}

/// Warns of joints that are locked because the robot file gives them a single position.
pub fn warn_of_still(planning: &Planning) {
    if !planning.still.is_empty() {
        let (joints, s) = (quoted(&planning.still), if planning.still.len() == 1 { "" } else { "s" });
        warn(&format!(
            "the task locks joint{s} {joints}, as the range in the robot file is a single position; where that is wrong, \
             correct `lower` and `upper` there"
        ));
    }
}

/// Joints with drives: those with an effort limit above 0, or all where none has.
fn driven(planning: &Planning) -> Vec<usize> {
    let effort = |dof: &usize| planning.robot.joints[planning.tree.joint_indices()[*dof]].limits.effort > 0.0;
    let all: Vec<usize> = (0..planning.tree.dofs()).collect();
    let some: Vec<usize> = all.iter().copied().filter(effort).collect();
    if some.is_empty() || !planning.robot.actuators.is_empty() { all } else { some }
}

/// Positions to reach: each joint as far from the start as its limits allow, and no farther than [`TURN`] or [`SLIDE`].
fn goal(Planning { robot, tree, start, .. }: &Planning) -> Vec<f64> {
    let joints = tree.joint_indices().iter().map(|&joint| &robot.joints[joint]);
    let positions = joints.zip(start).map(|(joint, &start)| {
        let by = if joint.kind == JointKind::Prismatic { SLIDE } else { TURN };
        let (up, down) = ((start + by).min(joint.limits.upper), (start - by).max(joint.limits.lower));
        if up - start >= start - down { up } else { down }
    });
    positions.collect()
}

/// Which limits of the robot a plan keeps.
#[derive(Clone, Copy, Default)]
struct Keeps {
    positions: bool,
    efforts: bool,
}

/// The task: where the limb starts, and where it ends.
struct Reach<'a> {
    planning: &'a Planning,
    /// The frame at the end of the limb.
    end: &'a str,
    /// Positions of the joints to reach.
    goal: Vec<f64>,
    /// Where the end of the limb is at the start and at the goal, m.
    from: [f64; 3],
    to: [f64; 3],
    /// The greatest effort that holds a joint, moves it and overcomes its friction and damping; at least 1 N m or N.
    effort: f64,
}

impl<'a> Reach<'a> {
    fn of(planning: &'a Planning, limb: &'a Limb, gravity: [f64; 3]) -> Self {
        let Planning { robot, tree, start, .. } = planning;
        let numbers = Numbers::of(robot, gravity);
        let goal = goal(planning);
        let place = |q: &[f64]| Kinematics::at_rest(tree, &numbers, q).poses()[limb.link].compose(&limb.pose).position;
        let (from, to) = (place(start), place(&goal));
        let kinematics = Kinematics::at_rest(tree, &numbers, start);
        let held = bias(tree, &numbers, &kinematics, start, &vec![0.0; start.len()], SMOOTHING);
        let inertia = mass_matrix(tree, &numbers, &kinematics);
        let least = |dof: usize| {
            let joint = &numbers.joints[tree.joint_indices()[dof]];
            joint.friction.max(FALLING * inertia[dof][dof]).max(GIVING * joint.stiffness)
        };
        let falling: Vec<_> = falling(planning, &held, least).into_iter().map(|dof| &tree.joints()[dof]).collect();
        if !falling.is_empty() {
            warn(&format!(
                "gravity moves joints {}, for which the robot file has no drive: the robot falls; lock these joints in the task, \
                 or give them actuators",
                quoted(&falling)
            ));
        }
        let efforts = tree.joint_indices().iter().zip(&held).zip(goal.iter().zip(start)).enumerate().map(
            |(dof, ((&joint, held), (to, from)))| {
                // As great as in a motion at constant acceleration and deceleration.
                let speed = 2.0 * (to - from).abs() / DURATION;
                let inertial = inertia[dof][dof] * 2.0 * speed / DURATION;
                held.abs() + inertial + numbers.joints[joint].friction + numbers.joints[joint].damping * speed
            },
        );
        let effort = efforts.fold(1.0, f64::max);
        Self { planning, end: limb.frame(), goal, from, to, effort }
    }

    /// How far the end of the limb moves, m.
    fn way(&self) -> f64 {
        (0..3).map(|i| (self.to[i] - self.from[i]).powi(2)).sum::<f64>().sqrt()
    }

    /// Whether it moves; if not, the joints have targets.
    fn moves(&self) -> bool {
        self.way() > 1e-3
    }

    /// Sensors, task and costs, with factors on the weight of the control and on the time; and whether the plan keeps limits
    /// of the drives.
    fn text(&self, cheaper: f64, slower: f64, keeps: Keeps) -> String {
        let names: Vec<_> = self.planning.tree.joints().iter().map(|name| format!("{name:?}")).collect();
        let select = names.join(", ");
        let list =
            |list: &[f64]| list.iter().map(|entry| format!("{:?}", plain(*entry))).collect::<Vec<_>>().join(", ");
        let mut text = format!(
            "\n[[model.sensors]]\nkind = \"joint_position\"\nselect = [{select}]\nvariance = 1e-6                  # rad^2 or m^2\n\n\
             [[model.sensors]]\nkind = \"joint_velocity\"\nselect = [{select}]\nvariance = 1e-4                  # squares of rad/s or m/s\n\n\
             [[tasks]]\nname = \"reach\"\nsteps = {}\ntime_step = {TIME_STEP:?}               # s\n",
            (slower * DURATION / TIME_STEP).round(),
        );
        if keeps.efforts {
            text += "enforce_effort_limits = true\n";
        }
        text += "# initial_state is left out: at rest at 0, or at the middle of the range if it excludes 0.\n\
                 # initial_control is left out: the plan starts from controls that hold the robot up.\n\n\
                 [tasks.noise]                    # variances; of the process per step\n\
                 initial = { \"q.*\" = 1e-6, \"v.*\" = 1e-4 }\nprocess = { \"q.*\" = 1e-10, \"v.*\" = 1e-5 }\n\n";
        if self.moves() {
            let final_weight = significant(100.0 / self.way().powi(2), 2);
            // In more time, less haste.
            let weight = significant(1e-3 * final_weight / slower.powi(3), 2);
            let _ = write!(
                text,
                "[[tasks.costs]]\nkind = \"frame_point\"\nframe = {:?}\ntarget = [{}]   # m; it starts at [{}]\n\
                 weight = {:?}\nfinal_weight = {:?}\n\n",
                self.end,
                list(&self.to),
                list(&self.from),
                weight,
                final_weight
            );
        } else {
            let _ = write!(
                text,
                "[[tasks.costs]]\nkind = \"joint_position\"\nselect = [{select}]\ntarget = [{}]\nweight = 1.0\nfinal_weight = 1e2\n\n",
                list(&self.goal)
            );
        }
        // A tenth of the mean speed.
        let rest = significant(100.0 * (slower * DURATION / TURN).powi(2), 2);
        let _ = write!(
            text,
            "[[tasks.costs]]\nkind = \"joint_velocity\"\nweight = 0.1\nfinal_weight = {rest:?}\n\n\
             [[tasks.costs]]\nkind = \"control\"\nweight = {:.1e}\n",
            cheaper * 1e-2 / (self.effort * self.effort)
        );
        text
    }

    /// The ranges of the joints, as limits that plans keep.
    fn limits(&self) -> String {
        let Planning { robot, tree, .. } = self.planning;
        let mut text = "\n# The ranges of the joints in the robot's file.\n".to_owned();
        for (name, &joint) in tree.joints().iter().zip(tree.joint_indices()) {
            let limits = &robot.joints[joint].limits;
            let end = |key: &str, value: f64| {
                if value.is_finite() { format!("{key} = {value:?}\n") } else { String::new() }
            };
            let ends = end("lower", limits.lower) + &end("upper", limits.upper);
            if !ends.is_empty() {
                let _ = write!(
                    text,
                    "[[tasks.limits]]\nkind = \"joint_position\"\nselect = [{name:?}]\n{ends}enforce = true\n"
                );
            }
        }
        text
    }

    /// Plans the task.
    ///
    /// # Errors
    /// Where the text is no task.
    fn planned(&self, text: &str, path: &str) -> Result<Plan, Failure> {
        let problem = supple_file::parse(text, path)?;
        let missed = |what: String| Plan { missed: Some(what), exceeded: Vec::new() };
        let evaluation = match evaluate(&problem, &problem.parameters.initial(), 0, None) {
            Ok(evaluation) => evaluation,
            Err(error) => return Ok(missed(error.to_string())),
        };
        let task = &evaluation.tasks[0];
        if !task.status.is_converged() {
            return Ok(missed(format!("the plan ended as {}", task.status)));
        }
        let way = self.way();
        let off = distance(task).filter(|&off| self.moves() && off > BESIDE * way);
        let missed = off.map(|off| {
            let [off, way] = [off, way].map(|length| short(length, 2));
            format!(
                "the plan ends {off} m from its target, which is {way} m away: increase `final_weight` of `frame_point`, or `steps`"
            )
        });
        let advice = "choose a nearer `target`, increase `steps`, or let the plan keep it: `enforce_effort_limits`, or a limit \
                      with `enforce = true`";
        let exceeded = exceeded(task).into_iter().map(|what| format!("{what}; {advice}")).collect();
        Ok(Plan { missed, exceeded })
    }
}

/// What a plan lacks, for people.
struct Plan {
    /// What keeps it from its target.
    missed: Option<String>,
    /// Limits of the robot that it exceeds.
    exceeded: Vec<String>,
}

/// A path as seen from a folder, where it has a part in common with it; else from the top.
pub fn relative(path: &Path, folder: &Path) -> String {
    let absolute = |path: &Path| path.canonicalize().or_else(|_| std::path::absolute(path));
    let here = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let (Ok(full), Ok(from)) = (absolute(path), absolute(here)) else { return path.display().to_string() };
    let common = full.components().zip(from.components()).take_while(|(a, b)| a == b).count();
    if common <= 1 {
        return full.display().to_string();
    }
    let up = from.components().skip(common).map(|_| "..".into());
    let down = full.components().skip(common).map(|part| part.as_os_str().to_owned());
    up.chain(down).collect::<PathBuf>().display().to_string()
}
