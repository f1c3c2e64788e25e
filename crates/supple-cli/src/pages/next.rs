//! What to try next: one line at the end of a page.

use supple::design::DesignStatus;
use supple::parameters::{Parameter, Role};
use supple::plan::PlanStatus;
use supple::{Evaluation, LimitViolation, Stability, TaskEvaluation, Verdict};
use supple_study::About;
use supple_study::design::DesignReport;

use super::ends::at_bounds;
use crate::tables::number;

/// After an evaluation.
pub fn after_evaluation(about: &About, at: &Evaluation) -> String {
    let design = about.parameters.design();
    let names = || design.iter().map(|&index| about.parameters.get(index).name.clone()).collect::<Vec<_>>();
    let advice = plan(at).or_else(|| warned(at)).or_else(|| doubtful(at)).unwrap_or_else(|| {
        let missed = at.tasks.iter().filter(|task| at.missed_bound(task).is_some());
        let missed: Vec<String> =
            missed.map(|task| format!("a `bound` of {} on {}", number(task.cost.expected), task.name)).collect();
        let unlimited = at.tasks.iter().find(|task| task.cost.bound.is_none());
        match (missed.is_empty(), unlimited, design.is_empty()) {
            (false, _, true) => {
                format!("{}, or declare [parameters] that `supple design` may change", raise(at))
            }
            (false, _, false) if at.tasks.iter().any(|task| at.missed_bound(task).is_some() && is_out_of_reach(task)) => {
                format!(
                    "{}: no sensors meet the limit along this plan, so that `supple design` can only where {} change the plan",
                    raise(at),
                    listed(&names())
                )
            }
            (false, _, false) => format!(
                "`supple design` searches for {} within the limit; this design would meet {}",
                listed(&names()),
                listed(&missed)
            ),
            (true, _, true) => {
                "declare [parameters] in place of numbers, and `supple design` finds the best".to_owned()
            }
            (true, Some(task), false) => {
                format!("{}: without one, `supple design` may give up the task to save information", limit_for(task))
            }
            (true, None, false) => {
                format!("`supple design` minimises the information over {} within the limit", listed(&names()))
            }
        }
    });
    format!("Next: {advice}.\n")
}

/// After a design.
pub fn after_design(about: &About, report: &DesignReport) -> String {
    let optimum = &report.optimum;
    let at_bounds: Vec<String> = at_bounds(about, optimum).into_iter().map(|(name, _)| name).collect();
    let advice = match report.status {
        DesignStatus::Stopped => "repeat the command to finish the search".to_owned(),
        DesignStatus::BoundViolated => optimum.tasks.iter().find_map(of_search).unwrap_or_else(|| {
            let raise = raise(optimum);
            let budget = exhausted(optimum).map_or_else(String::new, |budget| {
                format!(", or raise the `budget`, of which {} are used up", number(budget))
            });
            match at_bounds.is_empty() {
                true => format!("{raise}{budget}, or declare more parameters"),
                false => format!("{raise}{budget}, or widen the bounds of {}", listed(&at_bounds)),
            }
        }),
        _ => plan(optimum).or_else(|| warned(optimum)).unwrap_or_else(|| {
            let (same, worse) = report.agreement();
            let blind = met_blindly(report);
            let is_optimum = !matches!(report.status, DesignStatus::NotConverged | DesignStatus::NotOptimal);
            if let Some(left) = left_in_rollouts(optimum).filter(|_| is_optimum) {
                return left;
            }
            if let Some((before, after)) = given_up(report) {
                return format!(
                    "{}: without one, the search gave up the task to save information: its cost rose from {} to {}",
                    limit_for(before),
                    number(before.cost.expected),
                    number(after.cost.expected)
                );
            }
            if let Some(doubt) = doubtful(optimum).filter(|_| is_optimum) {
                return doubt;
            }
            match (report.status, at_bounds.is_empty()) {
                (DesignStatus::NotConverged | DesignStatus::NotOptimal, _) => unfinished(report),
                (_, false) if blind.is_some() => format!(
                    "lower the `bound` of {}: it can be met without measurements, so it gives no requirement for the sensors; `supple sensors` shows the cost without sensors",
                    blind.unwrap_or_default()
                ),
                (_, false) => format!("widen the bounds of {}: the optimum is at one of them", listed(&at_bounds)),
                _ if report.catalogue.is_some() => "`supple export` writes the controller".to_owned(),
                // Along a single parameter, a search that converged is seldom one of several.
                _ if same <= 1 && (worse > 0 || about.parameters.design().len() > 1) => {
                    let more = if worse > 0 { "other starts found worse optima" } else { "a single start may find a local optimum" };
                    format!("more starts, `--starts {}`: {more}", more_starts(report))
                }
                _ => match about.parameters.iter().find(|parameter| parameter.role == Role::Study) {
                    Some(Parameter { name, .. }) => format!(
                        "`supple robustness --vary {name}=FROM:TO:COUNT` shows how the design performs at other values of {name}, \
                         `supple export` writes its controller"
                    ),
                    None => "`supple export` writes its controller".to_owned(),
                },
            }
        }),
    };
    format!("Next: {advice}.\n")
}

/// The limits that a design misses, with the values that it would keep.
fn raise(at: &Evaluation) -> String {
    let missed = at.tasks.iter().filter(|task| at.missed_bound(task).is_some());
    let bounds = missed.map(|task| format!("the `bound` of {} to {}", task.name, number(task.cost.expected)));
    let price = at.price.as_ref().filter(|_| at.exceeded_budget().is_some());
    let budget = price.map(|price| format!("the `budget` to {}", number(price.total)));
    let limits: Vec<String> = bounds.chain(budget).collect();
    format!("raise {}", if limits.is_empty() { "the limits".to_owned() } else { listed(&limits) })
}

/// The budget, where the price takes all of it.
fn exhausted(at: &Evaluation) -> Option<f64> {
    let price = at.price.as_ref()?;
    price.budget.filter(|budget| price.total >= budget * (1.0 - EXHAUSTED))
}

/// Share of a budget that may be left of one that is used up.
const EXHAUSTED: f64 = 1e-6;

/// What to do about what roll-outs exceed although the plan keeps it.
fn left_in_rollouts(at: &Evaluation) -> Option<String> {
    at.tasks.iter().find_map(|task| {
        let left = task.exceeded_in_rollouts().into_iter().next()?;
        Some(format!("a stricter limit, as a margin: in roll-outs of {}, {left}", task.name))
    })
}

/// After a search that did not end at an optimum.
fn unfinished(report: &DesignReport) -> String {
    let used_up = report.starts.iter().any(|start| start.evaluations >= report.settings.max_evaluations);
    let more = if used_up { "more evaluations, `max_evaluations` in [design], or " } else { "" };
    format!(
        "{more}more starts, `--starts {}`, or others, `--seed {}`",
        more_starts(report),
        report.seed.wrapping_add(1)
    )
}

/// Whether the cost limit is below what full information costs along the plan.
fn is_out_of_reach(task: &TaskEvaluation) -> bool {
    task.information.needed.as_ref().is_some_and(|needed| needed.limit_out_of_reach)
}

/// A cost limit to set.
fn limit_for(task: &TaskEvaluation) -> String {
    let limit = number(1.2 * task.cost.expected);
    format!("set a cost limit, such as `bound = {limit}` for {}, 1.2 times its cost at the start", task.name)
}

/// The cost above which a search has given up a task, as a multiple of that at the start.
const GIVEN_UP: f64 = 1.2;

/// A task without a cost limit that a search gave up, at the start and at the optimum.
fn given_up(report: &DesignReport) -> Option<(&TaskEvaluation, &TaskEvaluation)> {
    let mut pairs = report.start.tasks.iter().zip(&report.optimum.tasks);
    pairs.find(|(before, after)| {
        after.cost.bound.is_none() && after.cost.expected > GIVEN_UP * before.cost.expected.abs()
    })
}

fn more_starts(report: &DesignReport) -> usize {
    2 * report.starts.len().max(2)
}

/// A task whose cost limit can be met without measurements although more than needed information is minimised; `None`
/// if any limit requires information. Judged at the optimum, or at the start if not computed at the optimum.
fn met_blindly(report: &DesignReport) -> Option<&str> {
    let needed = |task: &TaskEvaluation| task.information.needed.as_ref().map(|needed| needed.total_bits);
    let mut pairs = report.optimum.tasks.iter().zip(&report.start.tasks);
    let is_blind = pairs.all(|(optimum, start)| {
        optimum.cost.bound.is_some() && needed(optimum).or(needed(start)).is_some_and(|bits| bits < 1e-6)
    });
    let first = report.optimum.tasks.first().filter(|_| is_blind && report.settings.information.needed == 0.0);
    first.map(|task| task.name.as_str())
}

/// What to do about a task whose roll-outs do not agree with what is expected of them, or are too few to tell.
fn doubtful(at: &Evaluation) -> Option<String> {
    let of_task = |task: &TaskEvaluation| {
        let trust = task.trust.as_ref().filter(|trust| trust.verdict != Verdict::Holds)?;
        Some(match trust.rollouts_needed.filter(|_| trust.needs_only_rollouts()) {
            Some(needed) => format!(
                "`supple evaluate` at this design with `--rollouts {needed}`: too few leave the cost of {} in doubt",
                task.name
            ),
            None => format!("mend what roll-outs of {} tell above, before its numbers are used", task.name),
        })
    };
    at.tasks.iter().find_map(of_task)
}

/// That warnings come first.
fn warned(at: &Evaluation) -> Option<String> {
    let count = at.warnings().count();
    let what = if count == 1 {
        "mend what the warning above tells".to_owned()
    } else {
        format!("mend what the {count} warnings above tell")
    };
    (count > 0).then(|| format!("{what}, before these numbers are used"))
}

/// What to do about an unusable plan; `None` if all plans are fine.
fn plan(at: &Evaluation) -> Option<String> {
    at.tasks.iter().find_map(of_plan)
}

fn of_plan(task: &TaskEvaluation) -> Option<String> {
    of_search(task).or_else(|| of_motion(task))
}

/// What to do about a plan that was not found, or is numerically unstable.
fn of_search(task: &TaskEvaluation) -> Option<String> {
    let name = &task.name;
    if task.status == PlanStatus::LimitsExceeded {
        return Some(format!(
            "look for another local minimum with `supple evaluate --branches 10`, widen the enforced limits of {name}, allow more time, or give it stronger drives or another initial state: no plan within these limits was found"
        ));
    }
    if !task.status.is_converged() {
        let raise = match task.status {
            PlanStatus::TimeLimit => "raise `time_limit` in [planning]",
            PlanStatus::MaxIterations => {
                "raise `max_iterations` in [planning], or `sampled.iterations` of a sampled plan,"
            }
            _ => "look for another local minimum with `supple evaluate --branches 10`, try another `time_step`,",
        };
        let status = task.status;
        return Some(format!(
            "{raise} or give a better `initial_control`: the plan of {name} ended with status {status}"
        ));
    }
    if task.stability.numerically_unstable {
        let Stability { suggested_time_step: shorter, suggested_substeps: substeps, .. } = task.stability;
        let advice = match (substeps, shorter) {
            (Some(substeps), _) => format!("`substeps = {substeps}` in [model]"),
            (None, Some(shorter)) => format!("`time_step = {}`", number(shorter)),
            (None, None) => "a shorter `time_step`".to_owned(),
        };
        return Some(format!("{advice}: the time step of {name} is too large for the stiff parts of the model"));
    }
    None
}

/// What to do about what a plan does.
fn of_motion(task: &TaskEvaluation) -> Option<String> {
    let name = &task.name;
    if let Some(substeps) = task.trust.as_ref().and_then(|trust| trust.substeps_advised) {
        return Some(format!(
            "`substeps = {substeps}` in [model]: roll-outs of {name} on finer steps differ from those on its own steps"
        ));
    }
    if task.trust.as_ref().is_some_and(|trust| trust.shorter_steps_advised) {
        return Some(format!(
            "a smaller `time_step`: roll-outs of {name} on finer steps differ from those on its own steps, and `substeps` is \
             near its maximum"
        ));
    }
    let is_wanted = |name: &str| task.warnings.iter().any(|text| text.contains(&format!("`{name}`")));
    if let Some(contact) = task.contacts.iter().find(|contact| !contact.touches && is_wanted(&contact.name)) {
        return Some(format!(
            "start closer to `{}`, or move it closer: the plan of {name} misses it by {} m; or raise the weight of its force",
            contact.name,
            number(contact.least_clearance_m)
        ));
    }
    let effort = |limit: &&LimitViolation| {
        !limit.is_of_task && ["effort of", "control of", "force of"].iter().any(|start| limit.name.starts_with(start))
    };
    let more = |count: usize| if count > 1 { format!(" and {} more", count - 1) } else { String::new() };
    if let Some(limit) = task.limits_violated.iter().find(effort) {
        return Some(format!(
            "`enforce_effort_limits = true` in the task {name}: its plan exceeds the limit of {}{}",
            limit.name,
            more(task.limits_violated.iter().filter(effort).count())
        ));
    }
    let of_task = |limit: &&LimitViolation| limit.is_of_task;
    if let Some(limit) = task.limits_violated.iter().find(of_task) {
        return Some(format!(
            "`enforce = true` in the [[tasks.limits]] of {name} that its plan exceeds: that of {}{}",
            limit.name,
            more(task.limits_violated.iter().filter(of_task).count())
        ));
    }
    if let Some(limit) = task.limits_violated.first() {
        // Limbs fold the wrong way in some minima.
        let other = match task.branches {
            None => "another local minimum (`supple evaluate --branches 10`), ",
            Some(_) => "",
        };
        return Some(format!(
            "{other}more time for {name}, a greater weight of its motion, or a limit with `enforce = true`: the plan exceeds the \
             limit of {}{}",
            limit.name,
            more(task.limits_violated.len())
        ));
    }
    task.is_broken().then(|| format!("less noise or softer contacts: the roll-outs of {name} do not follow the plan"))
}

/// Names as a list of words.
fn listed(names: &[String]) -> String {
    match names {
        [] => String::new(),
        [one] => one.clone(),
        [rest @ .., last] => format!("{} and {last}", rest.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use supple::{EvaluateOptions, PriceReport};

    use super::*;

    /// A plan with a time step that is too large, or whose roll-outs diverge, was followed by the advice to design.
    #[test]
    fn a_plan_that_cannot_be_trusted_comes_first() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tasks/two_mass_small.toml");
        let problem = supple_file::load(path).unwrap();
        let options = EvaluateOptions { rollouts: 8, ..EvaluateOptions::default() };
        let mut at = problem.evaluate(&problem.parameters.initial(), &options).unwrap();
        assert_eq!(plan(&at), None);
        at.tasks[0].trust.as_mut().unwrap().verdict = Verdict::Broken;
        assert!(plan(&at).unwrap().starts_with("less noise or softer contacts"));
        at.tasks[0].stability.numerically_unstable = true;
        for (substeps, shorter, advice) in [
            (Some(8), Some(1e-3), "`substeps = 8` in [model]: the time step of"),
            (None, Some(1e-3), "`time_step = "),
            (None, None, "a shorter `time_step`: "),
        ] {
            at.tasks[0].stability.suggested_substeps = substeps;
            at.tasks[0].stability.suggested_time_step = shorter;
            assert!(plan(&at).unwrap().starts_with(advice), "{:?}", plan(&at));
        }
    }

    /// Advice to enforce the efforts of the robot's file, of a robot without any, led to an error.
    #[test]
    fn limits_of_the_task_are_enforced_in_the_task() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tasks/two_mass_small.toml");
        let problem = supple_file::load(path).unwrap();
        let options = EvaluateOptions { rollouts: 0, ..EvaluateOptions::default() };
        let mut at = problem.evaluate(&problem.parameters.initial(), &options).unwrap();
        let violated = |is_of_task| LimitViolation {
            name: "effort of z".to_owned(),
            unit: "N".to_owned(),
            worst: 12.0,
            limit: 10.0,
            step: 0,
            steps: 3,
            is_of_task,
        };
        at.tasks[0].limits_violated = vec![violated(true)];
        assert!(plan(&at).unwrap().starts_with("`enforce = true` in the [[tasks.limits]] of "), "{:?}", plan(&at));
        at.tasks[0].limits_violated = vec![violated(true), violated(false)];
        assert!(plan(&at).unwrap().starts_with("`enforce_effort_limits = true` in the task "), "{:?}", plan(&at));
    }

    /// A design above its budget was said to need a greater `bound` alone.
    #[test]
    fn every_limit_that_is_missed_is_raised() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tasks/two_mass_small.toml");
        let problem = supple_file::load(path).unwrap();
        let mut at = problem.evaluate(&problem.parameters.initial(), &EvaluateOptions::default()).unwrap();
        assert_eq!(raise(&at), "raise the limits");
        at.tasks[0].cost.bound = Some(0.5 * at.tasks[0].cost.expected);
        assert!(raise(&at).starts_with("raise the `bound` of ") && !raise(&at).contains("budget"), "{}", raise(&at));
        let parameters = at.parameters.clone();
        let price = |budget| PriceReport {
            total: 9.5,
            budget: Some(budget),
            weight_nats_per_unit: 0.0,
            objective_nats: 0.0,
            parameters: parameters.clone(),
        };
        at.price = Some(price(10.0));
        assert!(!raise(&at).contains("budget"), "{}", raise(&at));
        at.price = Some(price(6.0));
        assert!(raise(&at).ends_with(" and the `budget` to 9.5"), "{}", raise(&at));
    }
}
