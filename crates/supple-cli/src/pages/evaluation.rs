//! The page of one design, evaluated.

use std::fmt::Write;

use supple::plan::PlanStatus;
use supple::simulate::{LimitShare, MonteCarlo};
use supple::system::Curvature;
use supple::{Evaluation, LimitReached, LimitViolation, TaskEvaluation};
use supple_study::About;
use supple_study::design::DesignReport;

use super::next;
use crate::tables::{Rows, align_right, first_lines, heading, number, signed, table, with_unit};
use crate::{contacts, informations, terms, trust};
use supple_text::{saves, short};

/// The page of `supple evaluate`.
pub fn evaluation_page(about: &About, at: &Evaluation) -> String {
    let mut page = heading(about);
    let is_set_by_all = |name: &str| about.tasks.iter().all(|task| task.set.get(name).is_some());
    let values = about.parameters.iter().zip(&at.parameters.0).filter(|(p, _)| !is_set_by_all(&p.name));
    let values: Vec<_> = values.map(|(p, (name, value))| format!("{name} = {} {}", number(*value), p.unit)).collect();
    if !values.is_empty() {
        let _ = writeln!(page, "{}\n", values.join("   ").trim_end());
    }
    at.tasks.iter().for_each(|task| page.push_str(&task_section(at, task)));
    page.push_str(&prices(at, None));
    page.push_str(&contacts::warnings(at));
    if at.tasks.len() > 1 {
        let is_weighted = about.tasks.iter().any(|task| task.information_weight != 1.0);
        let weighted = if is_weighted { ", weighted by `information_weight`" } else { "" };
        let _ = writeln!(page, "all tasks together: {} bits{weighted}", number(at.objective.information_bits));
    }
    page + &next::after_evaluation(about, at)
}

/// One task: how its plan ended, its numbers, limits, contacts and gradients.
fn task_section(at: &Evaluation, task: &TaskEvaluation) -> String {
    let TaskEvaluation { name, status, iterations, stationarity, .. } = task;
    let plural = if *iterations == 1 { "" } else { "s" };
    let mut page = format!("{name}: {status} after {iterations} iteration{plural}, stationarity {stationarity:.1e}\n");
    if task.cost_curvature == Curvature::GaussNewton {
        page.push_str("  cost curvature: Gauss-Newton\n");
    }
    if let Some(branches) = task.branches {
        let which = if branches == 1 { "" } else { "; this is the cheapest" };
        let _ = writeln!(page, "  {} encountered{which}", minima(branches));
    }
    let numbers = number_rows(at, task).to_string();
    let _ = writeln!(page, "{}\n", numbers.trim_start_matches(|c: char| c.is_whitespace() && c != ' ').trim_end());
    if let Some(trust) = &task.trust {
        let _ = writeln!(page, "  {}\n", trust::line(trust));
    }
    if !task.limits_violated.is_empty() {
        let _ = writeln!(page, "  violates limits:\n{}", limit_lines(task));
    }
    if !task.limits_reached.is_empty() {
        let _ = writeln!(page, "  The plan is held at limits:\n{}", reached_lines(task));
    }
    let left = left_lines(task);
    if !left.is_empty() {
        let _ = writeln!(page, "  roll-outs exceed limits:\n{left}");
    }
    if task.stability.numerically_unstable {
        let _ = writeln!(page, "  {}\n", task.stability);
    }
    if let Some(rows) = terms::table_of(task) {
        let _ = writeln!(page, "{}{}", rows.trimmed(), terms::missed(task));
    }
    if !task.contacts.is_empty() {
        let _ = writeln!(page, "{}\n{}", contacts::table_of(task), contacts::apart(task));
    }
    page + &gradient_tables(task)
}

/// Share of the cost of noise from which it is worth a row what the curvature of the dynamics adds.
const SHOWN: f64 = 0.02;

/// Information and costs of a task, expected and sampled.
fn number_rows(at: &Evaluation, task: &TaskEvaluation) -> Rows {
    let mut rows = table(&["", "", ""]);
    for (name, value, note) in informations::of_task(&task.information) {
        rows.add_row([name, &value, &note]);
    }
    rows.add_row(["expected cost", &number(task.cost.expected), &bound_note(at, task)]);
    let parts = task.cost.parts;
    let names = ["  nominal", "  estimation error", "  process noise", "  initial uncertainty"];
    for (name, part) in names.into_iter().zip([parts.nominal, parts.belief, parts.process, parts.initial]) {
        rows.add_row([name, &number(part), ""]);
    }
    let noise = task.cost.expected - parts.nominal;
    if let Some(cost) = task.cost.second_order.filter(|cost| (cost - task.cost.expected).abs() > SHOWN * noise.abs()) {
        rows.add_row(["  with curvature", &number(cost), "of the dynamics, which the controller leaves out"]);
    }
    if let Some(sampled) = task.monte_carlo.as_ref().filter(|sampled| sampled.diverged > 0) {
        let note = format!("{} of {} roll-outs diverged", sampled.diverged, sampled.rollouts);
        rows.add_row(["sampled cost", "none", &note]);
    } else if let Some(sampled) = &task.monte_carlo {
        let interval = sampled.cost_interval_95.map_or_else(String::new, |of| format!("{}, ", trust::between(of)));
        let above = above_limit(task).map_or_else(String::new, |above| format!("; {above}"));
        let MonteCarlo { rollouts, difference, .. } = sampled;
        let difference = signed(*difference);
        let note = format!("{interval}{rollouts} roll-outs, {difference} from the expected{above}");
        rows.add_row(["sampled cost", &number(sampled.cost_mean), &note]);
    }
    let kept = task.cost.bound.filter(|_| at.missed_bound(task).is_none());
    for (name, value, note) in task.monte_carlo.as_ref().map(|sampled| trust::rows(sampled, kept)).unwrap_or_default() {
        rows.add_row([name, &value, &note]);
    }
    align_right(&mut rows, 1..2);
    rows
}

/// The price of a design: a line for all prices, with the budget and what an increase of it saves.
pub(super) fn prices(at: &Evaluation, report: Option<&DesignReport>) -> String {
    let Some(price) = &at.price else { return String::new() };
    let parts: Vec<String> =
        price.parameters.0.iter().map(|(name, price)| format!("{name} {}", number(*price))).collect();
    let before = report
        .and_then(|report| report.start.price.as_ref())
        .map_or_else(String::new, |start| format!("; {} at the start", number(start.total)));
    let within = match (at.exceeded_budget(), price.budget) {
        (Some(budget), _) => format!(", above the budget {}", number(budget)),
        (None, Some(budget)) => format!(" of the budget {}", number(budget)),
        (None, None) => String::new(),
    };
    let mut text = format!("price: {} ({}){within}{before}\n", number(price.total), parts.join(", "));
    if let Some(saved) = report.map(|report| report.budget_nats_per_unit).filter(|&nats| nats > 0.0) {
        let all = at.objective.information_bits;
        let _ = writeln!(text, "Budget exhausted; {}.", saves("budget", saved / std::f64::consts::LN_2, all, number));
    }
    if price.weight_nats_per_unit > 0.0 {
        let [weight, sum] =
            [price.weight_nats_per_unit, price.objective_nats].map(|nats| nats / std::f64::consts::LN_2);
        let _ = writeln!(
            text,
            "With {} bits per unit of price, the minimised total is {} bits.",
            number(weight),
            number(sum)
        );
    }
    text + "\n"
}

/// A line for each limit that the plan of a task violates.
pub(super) fn limit_lines(task: &TaskEvaluation) -> String {
    let line = |LimitViolation { name, unit, worst, limit, step, steps, .. }: &LimitViolation| {
        let side = if worst > limit { "above" } else { "below" };
        let steps = supple_text::count(*steps, "step");
        format!("    {name}: {} at step {step}, {side} {} ({steps})\n", number(*worst), with_unit(*limit, unit))
    };
    first_lines(task.limits_violated.iter().map(line))
}

/// A line for each limit that the plan of a task is held at.
pub(super) fn reached_lines(task: &TaskEvaluation) -> String {
    let line = |LimitReached { name, unit, limit, upper, step, steps, price, .. }: &LimitReached| {
        let side = if *upper { "at most" } else { "at least" };
        let steps = if *steps == 1 { format!("step {step}") } else { format!("{steps} steps from {step}") };
        let (limit, price) = (with_unit(*limit, unit), number(*price));
        format!("    {name} {side} {limit} ({steps}); +1 lowers the cost by {price}\n")
    };
    first_lines(task.limits_reached.iter().map(line))
}

/// A line for each limit that roll-outs of a task exceed; empty if there are none.
pub(super) fn left_lines(task: &TaskEvaluation) -> String {
    let percent = |share: f64| format!("{} %", short(100.0 * share, 2));
    let reach = |found: &LimitShare| format!("median {}, worst {}", number(found.median), number(found.worst));
    let line = |(limit, finer): (&LimitShare, Option<&LimitShare>)| {
        let LimitShare { name, unit, limit: bound, upper, share, share_of_time, .. } = limit;
        let side = if *upper { "above" } else { "below" };
        let of_finer = finer.map_or_else(String::new, |found| {
            format!("; on finer steps in {}, {}", percent(found.share), reach(found))
        });
        let (bound, reached) = (with_unit(*bound, unit), reach(limit));
        let (share, time) = (percent(*share), percent(*share_of_time));
        format!("    {name}: {side} {bound} in {share} of them, {time} of the time; {reached}{of_finer}\n")
    };
    let exceeded: Vec<_> = task.monte_carlo.iter().flat_map(MonteCarlo::limits_exceeded).collect();
    first_lines(exceeded.into_iter().map(line))
}

/// How far a cost is above its bound, also relative to a bound that is not 0.
pub(super) fn excess(cost: f64, bound: f64) -> String {
    let over = cost - bound;
    if bound == 0.0 { number(over) } else { format!("{} ({} %)", number(over), short(100.0 * over / bound.abs(), 4)) }
}

pub(super) fn bound_note(at: &Evaluation, task: &TaskEvaluation) -> String {
    match (at.missed_bound(task), task.cost.bound) {
        (Some(bound), _) => {
            format!("exceeds the cost limit {} by {}", number(bound), excess(task.cost.expected, bound))
        }
        (None, Some(_)) if task.status == PlanStatus::Indefinite => {
            format!("not valid: the plan ended as {}", task.status)
        }
        (None, Some(bound)) if !task.status.is_converged() => {
            format!("below the cost limit {}, but the plan ended as {}", number(bound), task.status)
        }
        (None, Some(bound)) => format!("within the cost limit {}", number(bound)),
        (None, None) => String::new(),
    }
}

/// That roll-outs exceed the cost limit.
pub(super) fn above_limit(task: &TaskEvaluation) -> Option<String> {
    let (bound, sampled) = (task.limit_exceeded_in_rollouts()?, task.monte_carlo.as_ref()?.cost_mean);
    Some(format!("above the cost limit by {}", excess(sampled, bound)))
}

fn gradient_tables(task: &TaskEvaluation) -> String {
    let mut page = String::new();
    let Some(gradient) = &task.gradient else { return page };
    if let Some(total) = &gradient.total {
        let columns = [
            ("needed, nats", total.needed_nats.as_ref()),
            ("used, nats", total.used_nats.as_ref()),
            ("measured, nats", Some(&total.information_nats)),
            ("expected cost", Some(&total.expected_cost)),
            ("nominal", Some(&total.nominal_cost)),
            ("estimation error", Some(&total.belief_cost)),
            ("process noise", Some(&total.process_cost)),
            ("initial uncertainty", Some(&total.initial_cost)),
        ];
        let known: Vec<_> = columns.into_iter().filter_map(|(what, of)| Some((what, of?))).collect();
        let head: Vec<&str> = ["total gradient"].into_iter().chain(known.iter().map(|(what, _)| *what)).collect();
        let mut rows = table(&head);
        for (index, (name, _)) in total.information_nats.0.iter().enumerate() {
            let values = known.iter().map(|(_, of)| format!("{:.4e}", of.0[index].1));
            rows.add_row([name.clone()].into_iter().chain(values));
        }
        align_right(&mut rows, 1..head.len());
        let note = if total.valid { "" } else { "These gradients are not valid: the plan is not stationary enough.\n" };
        let _ = writeln!(page, "{rows}\n{note}");
    }
    if let Some(frozen) = &gradient.frozen {
        let mut rows = table(&["frozen gradient", "information, nats", "cost of estimation error"]);
        for (index, (name, value)) in frozen.information_nats.0.iter().enumerate() {
            rows.add_row([name.clone(), format!("{value:.4e}"), format!("{:.4e}", frozen.belief_cost.0[index].1)]);
        }
        align_right(&mut rows, 1..3);
        let radius = frozen.recursion_spectral_radius;
        let radius = radius.map_or_else(|| "none: a covariance is singular".into(), |radius| format!("{radius:.6}"));
        let _ = writeln!(page, "{rows}\nspectral radius of the paper's recursion: {radius}\n");
    }
    page
}

pub(super) fn minima(count: usize) -> String {
    if count == 1 { "1 local minimum".to_owned() } else { format!("{count} local minima") }
}
