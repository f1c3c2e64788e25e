//! What was asked and the answer, in words and numbers.

use maud::{Markup, html};
use supple::design::{DesignStatus, Split};
use supple::{Evaluation, TaskEvaluation};
use supple_study::AboutTask;
use supple_study::design::DesignReport;
use supple_text::{capitalised, saves};

use super::context::Context;
use super::headlines::{Headline, headlines};
use super::warnings::{limits, limits_in_rollouts, warnings};
use crate::html::{heading, table, with_code, words};
use crate::numbers::{bits, change, labelled, number, unit, with_unit};
use crate::part::{Part, end_name};
use crate::words::{count, list};

/// What was asked, what was found, and what to be careful about.
pub fn section(context: &mut Context) -> Option<Markup> {
    let part = context.part;
    let searches = part.searches();
    let evaluations = part.evaluations();
    let (studies, warnings) = (headlines(part), warnings(part));
    Some(html! {
        p { (asked(part)) }
        @for (folder, report) in &searches {
            @if searches.len() > 1 {
                (heading(context.level + 1, &format!("{}answer-{folder}", context.prefix), &format!("Search in {folder}")))
            }
            (found(part, report))
        }
        @if !evaluations.is_empty() {
            (evaluated(part, &evaluations, if searches.is_empty() { "Evaluated designs" } else { "Other designs" }))
        }
        @if searches.is_empty() && evaluations.is_empty() {
            p { "No single design of this task was optimised or evaluated." }
        }
        @if !studies.is_empty() {
            p { "Studies over many designs:" }
            ul {
                @for Headline { section, what, text } in &studies {
                    li { a href=(format!("#{}{section}", context.prefix)) { (what) } ": " (text) }
                }
            }
        }
        @if !warnings.is_empty() {
            div.warnings {
                p { strong { "Warnings" } }
                ul { @for warning in &warnings { li { (with_code(warning)) } } }
                @for limits in [limits(part), limits_in_rollouts(part)].into_iter().flatten() { (limits) }
            }
        }
    })
}

/// What the task asks for.
fn asked(part: &Part) -> String {
    let about = part.about;
    let range = |&index: &usize| {
        let parameter = about.parameters.get(index);
        let [least, most] = parameter.bounds;
        format!("{} ({} to {})", parameter.name, number(least), with_unit(most, &parameter.unit))
    };
    let design: Vec<String> = about.parameters.design().iter().map(range).collect();
    let task = |task: &AboutTask| {
        let duration = with_unit(task.steps as f64 * task.time_step, "s");
        let bound = match task.bound {
            Some(bound) => format!("expected cost at most {}", number(bound)),
            None => "no cost limit".into(),
        };
        format!("{} ({duration} in {}, {bound})", task.name, count(task.steps, "step"))
    };
    let tasks: Vec<String> = about.tasks.iter().map(task).collect();
    let noun = if tasks.len() == 1 { "task" } else { "tasks" };
    if design.is_empty() {
        return format!("The {noun}: {}. There are no design parameters.", list(&tasks));
    }
    format!(
        "Question: with which {} does the controller receive the least sensor information? The {noun}: {}.",
        list(&design),
        list(&tasks)
    )
}

/// What one search found.
fn found(part: &Part, report: &DesignReport) -> Markup {
    let end = end_name(report.status);
    html! {
        p.result { (result(part, report)) }
        p { (verdict(report)) }
        @for text in in_closed_loop(report) { p { strong { (with_code(&text)) } } }
        @if let Some(better) = better(part, report) { p { strong { (better) } } }
        (parameters(part, report, end))
        (results(part, report, end))
    }
}

/// What the design exceeds in closed loop although its plan keeps it, by task.
fn in_closed_loop(report: &DesignReport) -> Vec<String> {
    let of_task = |task: &TaskEvaluation| {
        let exceeded = task.exceeded_in_rollouts();
        let name = &task.name;
        let text = || {
            let exceeded = exceeded.join("; ");
            format!(
                "In roll-outs of {name}, {exceeded}. Plans keep limits without noise: a stricter limit leaves a margin."
            )
        };
        (!exceeded.is_empty()).then(text)
    };
    report.optimum.tasks.iter().filter_map(of_task).collect()
}

/// The answer in words.
fn result(part: &Part, report: &DesignReport) -> String {
    let (start, end) = (&report.start, &report.optimum);
    let (from, to) = (start.objective.information_bits, end.objective.information_bits);
    let values = list(&part.describe(&end.parameters));
    let what = if part.about.tasks.iter().all(|task| task.information_weight == 1.0) { "" } else { ", weighted" };
    let mut text = format!(
        "{}: {values}. The information{what} {} from {} to {} bits ({})",
        capitalised(end_name(report.status)),
        went(from, to),
        number(from),
        number(to),
        change(from, to)
    );
    if let ([before], [after]) = (&start.tasks[..], &end.tasks[..]) {
        let rate = |task: &TaskEvaluation| number(task.information.bits_per_second);
        text += &format!(", that is, from {} to {} bits/s", rate(before), rate(after));
    }
    text += ".";
    for (index, (before, after)) in start.tasks.iter().zip(&end.tasks).enumerate() {
        let (from, to) = (before.cost.expected, after.cost.expected);
        text +=
            &format!(" The expected cost of {} {} from {} to {}", after.name, went(from, to), number(from), number(to));
        text += &match after.cost.bound {
            Some(bound) => format!("; {}.", against_bound(report, index, bound)),
            None => "; it has no cost limit.".into(),
        };
    }
    if let (Some(before), Some(after)) = (&start.price, &end.price) {
        let (from, to) = (before.total, after.total);
        text += &format!(" The price {} from {} to {}", went(from, to), number(from), number(to));
        text += &match after.budget {
            Some(budget) => format!("; {}.", against_budget(report, budget)),
            None => ".".into(),
        };
        if after.weight_nats_per_unit > 0.0 {
            let [weight, sum] = [after.weight_nats_per_unit, after.objective_nats].map(|nats| number(bits(nats)));
            text += &format!(" A unit of price counts as {weight} bits; the minimised total is {sum} bits.");
        }
    }
    text
}

/// How a value compares with its limit.
enum Standing {
    Missed,
    Active {
        /// Bits that a unit more would save.
        rate: f64,
        /// The bits that are minimised.
        all: f64,
    },
    Met,
}

impl Standing {
    fn of(report: &DesignReport, missed: bool, nats_per_unit: f64) -> Self {
        match missed {
            true => Self::Missed,
            false if nats_per_unit > 0.0 => {
                Self::Active { rate: bits(nats_per_unit), all: report.optimum.objective.information_bits }
            }
            false => Self::Met,
        }
    }

    /// Of the cost of a task at the best design.
    fn of_cost(report: &DesignReport, index: usize) -> Self {
        let price = report.bound_prices.get(index).map_or(0.0, |price| price.nats_per_unit);
        let task = report.optimum.tasks.get(index);
        Self::of(report, task.is_some_and(|task| report.optimum.missed_bound(task).is_some()), price)
    }

    /// Of the price of the best design.
    fn of_price(report: &DesignReport) -> Self {
        Self::of(report, report.optimum.exceeded_budget().is_some(), report.budget_nats_per_unit)
    }
}

/// How a price stands to the budget.
fn against_budget(report: &DesignReport, budget: f64) -> String {
    let budget = number(budget);
    match Standing::of_price(report) {
        Standing::Missed => format!("this exceeds the budget of {budget}"),
        Standing::Active { rate, all } => {
            format!("the budget of {budget} is exhausted: {}", saves("budget", rate, all, number))
        }
        Standing::Met => format!("the budget is {budget}"),
    }
}

/// How a cost stands to its bound.
fn against_bound(report: &DesignReport, index: usize, bound: f64) -> String {
    let standing = Standing::of_cost(report, index);
    let bound = number(bound);
    match standing {
        Standing::Missed => format!("this exceeds its cost limit of {bound}"),
        Standing::Active { rate, all } if report.is_at_limit(index) => {
            format!("its cost limit of {bound} is active; {}", saves("cost", rate, all, number))
        }
        Standing::Active { rate, all } => format!(
            "its cost limit of {bound} is met, and what is needed depends on it: {}",
            saves("limit", rate, all, number)
        ),
        Standing::Met => format!("its cost limit of {bound} is met but not active"),
    }
}

fn went(from: f64, to: f64) -> &'static str {
    if to < from {
        "falls"
    } else if to > from {
        "rises"
    } else {
        "goes"
    }
}

/// How the search ended.
fn verdict(report: &DesignReport) -> String {
    let how = match report.status {
        // Agreement between starts says nothing about the choice from catalogues.
        DesignStatus::Converged if report.catalogue.is_some() => {
            "The search converged: this is an optimum among the catalogue entries.".into()
        }
        DesignStatus::Converged => format!(
            "The search converged: {} of {} ended at this information.{}",
            report.agreement().0,
            count(report.starts.len(), "start"),
            report.advice()
        ),
        DesignStatus::NotOptimal => {
            "The search stopped, but this is not an optimum: the total gradient is not zero there.".into()
        }
        DesignStatus::NotConverged => {
            "The search did not converge; this is the best design found within all cost limits.".into()
        }
        DesignStatus::Stopped => "The search was stopped; this is the best design found so far.".into(),
        DesignStatus::BoundViolated => {
            "No design within all cost limits with a converged plan was found; this is the closest.".into()
        }
    };
    let branches = match report.branches {
        0 | 1 => String::new(),
        several => format!(" {several} local minima of its plans were encountered; the numbers are for the cheapest."),
    };
    format!("{how}{branches}")
}

/// By how much less another design has to need to be better than the best design of a search.
const BETTER: f64 = 1e-3;

/// Another design of this page within all limits that receives less information than the best one of a search.
fn better(part: &Part, report: &DesignReport) -> Option<String> {
    let optimum = report.optimum.objective.information_bits;
    let evaluated = part.evaluations().into_iter().filter(|(_, at)| at.feasible && at.warnings().next().is_none());
    let evaluated = evaluated.map(|(folder, at)| (folder, at.objective.information_bits));
    let swept = part.sweeps().into_iter().filter_map(|(folder, sweep)| {
        let least = sweep.least().filter(|least| least.among > 0)?;
        Some((folder, least.bits))
    });
    let (folder, bits) = evaluated.chain(swept).min_by(|a, b| a.1.total_cmp(&b.1))?;
    (report.optimum.feasible && bits < optimum - BETTER * optimum.abs()).then(|| {
        format!(
            "But {folder} has a design within all limits that receives {} bits: the search ended at a local optimum, or its \
             ranges or other parameters differ. Use more starts.",
            number(bits)
        )
    })
}

/// The parameters from start to end.
fn parameters(part: &Part, report: &DesignReport, end: &str) -> Markup {
    let design = part.about.parameters.design();
    let row = |(index, parameter): (usize, &supple::parameters::Parameter)| {
        let value = |at: &Evaluation| at.parameters.get(&parameter.name).unwrap_or(f64::NAN);
        let [least, most] = parameter.bounds;
        let to = value(&report.optimum);
        let note = if !design.contains(&index) {
            "given"
        } else if parameter.is_at(least, to) {
            "at the lower end of its range"
        } else if parameter.is_at(most, to) {
            "at the upper end of its range"
        } else {
            ""
        };
        let range =
            if design.contains(&index) { format!("{} to {}", number(least), number(most)) } else { String::new() };
        let from = number(value(&report.start));
        vec![parameter.name.clone(), from, number(to), unit(&parameter.unit), range, note.to_owned()]
    };
    let rows: Vec<_> = part.about.parameters.iter().enumerate().map(row).collect();
    if rows.is_empty() {
        return html! {};
    }
    let head = words(["parameter", "start", end, "unit", "range", "remark"]);
    html! {
        (table("Parameters", &head, &rows))
        @for settings in part.about.settings(with_unit) { p { "Set by the task " (settings) "." } }
    }
}

/// Information and costs from start to end.
fn results(part: &Part, report: &DesignReport, end: &str) -> Markup {
    let mut rows = Vec::new();
    let mut add = |what: String, unit: &str, from: f64, to: f64, remark: [String; 2]| {
        let [bound, note] = remark;
        rows.push(vec![labelled(&what, unit), number(from), number(to), change(from, to), bound, note]);
    };
    let (start, optimum) = (&report.start, &report.optimum);
    let none = || [String::new(), String::new()];
    if part.about.tasks.len() > 1 {
        let (from, to) = (start.objective.information_bits, optimum.objective.information_bits);
        add("information of all tasks".into(), "bits", from, to, none());
    }
    for (index, (before, after)) in start.tasks.iter().zip(&optimum.tasks).enumerate() {
        let (a, b) = (&before.information, &after.information);
        if let (Some(a), Some(b)) = (&a.needed, &b.needed) {
            add(format!("information needed for {}", after.name), "bits", a.total_bits, b.total_bits, none());
        }
        if let (Some(a), Some(b)) = (&a.used, &b.used) {
            add(format!("information used for {}", after.name), "bits", a.total_bits, b.total_bits, none());
        }
        add(format!("information measured for {}", after.name), "bits", a.total_bits, b.total_bits, none());
        add(format!("information measured for {}", after.name), "bits/s", a.bits_per_second, b.bits_per_second, none());
        let remark = cost_remark(report, index, after.cost.bound);
        add(format!("expected cost of {}", after.name), "", before.cost.expected, after.cost.expected, remark);
        if let (Some(a), Some(b)) = (&before.monte_carlo, &after.monte_carlo) {
            let interval = b
                .cost_interval_95
                .map_or_else(String::new, |interval| format!("{}, ", supple_text::interval_95(interval, number)));
            let above = if after.limit_exceeded_in_rollouts().is_some() { "; above the cost limit" } else { "" };
            let note = format!("{interval}{} roll-outs{above}", b.rollouts);
            add(format!("sampled cost of {}", after.name), "", a.cost_mean, b.cost_mean, [String::new(), note]);
        }
    }
    if let (Some(before), Some(after)) = (&start.price, &optimum.price) {
        add("price".into(), "", before.total, after.total, budget_remark(report, after.budget));
    }
    html! {
        (table("Information and cost", &words(["quantity", "start", end, "change", "bound", "remark"]), &rows))
        @for text in trusted(report) { p { (with_code(&text)) } }
        (changes(&report.split))
    }
}

/// The limit of the expected cost of a task, and how the design stands to it.
fn cost_remark(report: &DesignReport, task: usize, bound: Option<f64>) -> [String; 2] {
    let Some(bound) = bound else { return ["none".into(), String::new()] };
    let note = match Standing::of_cost(report, task) {
        Standing::Missed => "missed".into(),
        _ => report.priced_limit(task, number).unwrap_or_else(|| "met".into()),
    };
    [number(bound), note]
}

/// The budget, and how the price of the design stands to it.
fn budget_remark(report: &DesignReport, budget: Option<f64>) -> [String; 2] {
    let Some(budget) = budget else { return ["none".into(), String::new()] };
    let note = match Standing::of_price(report) {
        Standing::Missed => "exceeded".into(),
        Standing::Active { rate, all } => format!("budget exhausted; {}", saves("budget", rate, all, number)),
        Standing::Met => "met".into(),
    };
    [number(budget), note]
}

/// Comparison of roll-outs with predictions.
fn trusted(report: &DesignReport) -> Vec<String> {
    let tasks = report.start.tasks.iter().zip(&report.optimum.tasks);
    tasks.flat_map(|(start, end)| [trust("at the start", start), trust("at the optimum", end)]).flatten().collect()
}

/// What roll-outs of a task say of the prediction, if there were any.
fn trust(place: &str, task: &TaskEvaluation) -> Option<String> {
    Some(format!("Roll-outs of {} {place}: {}.", task.name, task.trust.as_ref()?))
}

/// A number with its sign and two decimals.
fn hundredths(value: f64) -> String {
    if value.abs() < 0.005 { "0.00".into() } else { format!("{value:+.2}").replace('-', "−") }
}

/// Where the change of measured information comes from.
fn changes(split: &[Split]) -> Markup {
    let head = words([
        "task",
        "change, bits",
        "sensor sensitivity",
        "how uncertainty propagates",
        "change of the plan",
        "jumps to other local minima",
    ]);
    let row = |of: &Split| {
        let parts = [of.total_bits, of.sensors_bits, of.uncertainty_bits, of.plan_bits, of.jumps_bits];
        std::iter::once(of.task.clone()).chain(parts.map(hundredths)).collect::<Vec<_>>()
    };
    let rows: Vec<_> = split.iter().map(row).collect();
    if rows.is_empty() {
        return html! {};
    }
    table("Where the change of measured information comes from (theory, equation G.10)", &head, &rows)
}

/// Which evaluated design needs the least information within all cost limits, and which limits the others miss.
fn best_of(part: &Part, evaluations: &[(&str, &Evaluation)]) -> String {
    let bits = |at: &Evaluation| at.objective.information_bits;
    let feasible = evaluations.iter().filter(|(_, at)| at.feasible);
    let best = feasible.min_by(|(_, a), (_, b)| bits(a).total_cmp(&bits(b)));
    let mut text = match (best, evaluations) {
        (Some((folder, at)), [_]) => {
            let limited = at.tasks.iter().any(|task| task.cost.bound.is_some());
            let within = if limited { "all cost limits are met" } else { "there is no cost limit" };
            format!("In {folder}, the controller receives {} bits; {within}.", number(bits(at)))
        }
        (Some((folder, at)), _) => {
            let (number_of, bits, values) = (evaluations.len(), number(bits(at)), part.describe(&at.parameters));
            let values = if values.is_empty() { String::new() } else { format!(" at {}", list(&values)) };
            format!(
                "Of these {number_of} designs, {folder} receives the least information within all cost limits: {bits} bits{values}."
            )
        }
        (None, [(folder, _)]) => format!("The design in {folder} is not within all limits with a plan that converged."),
        (None, _) => "No design is within all limits with a plan that converged.".into(),
    };
    for (folder, at) in evaluations {
        for task in &at.tasks {
            let cost = number(task.cost.expected);
            if let Some(bound) = at.missed_bound(task) {
                text +=
                    &format!(" In {folder}, the expected cost of {}, {cost}, exceeds {}.", task.name, number(bound));
            }
        }
        if let (Some(budget), Some(price)) = (at.exceeded_budget(), &at.price) {
            text +=
                &format!(" In {folder}, the price, {}, exceeds the budget of {}.", number(price.total), number(budget));
        }
    }
    text
}

/// Designs that no search found.
fn evaluated(part: &Part, evaluations: &[(&str, &Evaluation)], title: &str) -> Markup {
    let mut head = words(["design", "parameters", "information, bits"]);
    for task in &part.about.tasks {
        head.push(format!("used for {}, bits", task.name));
        head.push(format!("information of {}, bits/s", task.name));
        head.push(format!("cost of {}", task.name));
        head.push(format!("sampled cost of {}", task.name));
        head.push(format!("bound of {}", task.name));
    }
    let priced = evaluations.iter().any(|(_, at)| at.price.is_some());
    head.extend(priced.then(|| "price".into()));
    let row = |(folder, at): &(&str, &Evaluation)| {
        let values = part.describe(&at.parameters).join(", ");
        let mut row = vec![(*folder).to_owned(), values, number(at.objective.information_bits)];
        for task in &at.tasks {
            let used = task.information.used.as_ref().map(|used| used.total_bits);
            row.push(used.map_or_else(String::new, number));
            row.push(number(task.information.bits_per_second));
            row.push(number(task.cost.expected));
            row.push(task.monte_carlo.as_ref().map_or_else(String::new, |sampled| number(sampled.cost_mean)));
            row.push(task.cost.bound.map_or("none".into(), |bound| {
                format!("{}, {}", number(bound), if at.missed_bound(task).is_some() { "missed" } else { "met" })
            }));
        }
        row.extend(priced.then(|| at.price.as_ref().map_or_else(String::new, |price| number(price.total))));
        row
    };
    let rows: Vec<_> = evaluations.iter().map(row).collect();
    let trusted = evaluations
        .iter()
        .flat_map(|(folder, at)| at.tasks.iter().filter_map(move |task| trust(&format!("in {folder}"), task)));
    html! {
        p.result { (best_of(part, evaluations)) }
        (table(title, &head, &rows))
        @for text in trusted { p { (with_code(&text)) } }
    }
}
