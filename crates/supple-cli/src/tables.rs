//! Pages of text that a designer reads at a glance.

use std::fmt::Write;

use comfy_table::{CellAlignment, Table, presets};
use supple::design::DesignStatus;
use supple::parameters::Role;
use supple::{Evaluation, LimitViolation, TaskEvaluation};
use supple_study::design::DesignReport;
use supple_study::{About, AboutTask};

use crate::{catalogue, contacts, informations, split, trust};

/// A number with about six significant digits.
pub(crate) fn number(value: f64) -> String {
    if value == 0.0 {
        return "0".into();
    }
    let digits = value.abs().log10().floor() as i32;
    match digits {
        _ if !value.is_finite() => value.to_string(),
        -3..=5 => {
            let text = format!("{value:.*}", (5 - digits).clamp(0, 8) as usize);
            if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
        }
        _ => format!("{value:.4e}"),
    }
}

pub(crate) fn table(header: &[&str]) -> Table {
    let mut table = Table::new();
    table.load_preset(presets::NOTHING).set_header(header);
    table
}

pub(crate) fn align_right(table: &mut Table, columns: std::ops::Range<usize>) {
    for column in columns {
        if let Some(column) = table.column_mut(column) {
            column.set_cell_alignment(CellAlignment::Right);
        }
    }
}

/// The title of a column: a name with its unit.
pub(crate) fn title(name: &str, unit: &str) -> String {
    if unit.is_empty() { name.to_owned() } else { format!("{name}, {unit}") }
}

pub(crate) fn percent(from: f64, to: f64) -> String {
    if from == 0.0 { String::new() } else { format!("{:+.1} %", 100.0 * (to - from) / from.abs()) }
}

pub(crate) fn heading(about: &About) -> String {
    if about.title.is_empty() { String::new() } else { format!("{}\n\n", about.title) }
}

/// The page of `supple design`.
pub fn design_page(about: &About, report: &DesignReport) -> String {
    let (start, optimum) = (&report.start, &report.optimum);
    let mut page = heading(about);
    let mut parameters = table(&["parameter", "from", "to", "unit", "information, per +1 %", "costs, per +1 %"]);
    for (index, parameter) in about.parameters.iter().enumerate() {
        let (from, to) = (start.parameters.0[index].1, optimum.parameters.0[index].1);
        let to_shown = if parameter.role == Role::Design { number(to) } else { String::new() };
        let mut row = vec![parameter.name.clone(), number(from), to_shown, parameter.unit.clone()];
        row.extend(sensitivities(about, optimum, index, to));
        parameters.add_row(row);
    }
    align_right(&mut parameters, 1..3);
    align_right(&mut parameters, 4..6);
    let _ = writeln!(page, "{parameters}\n");

    let mut results = table(&["", "from", "to", "change", "bound", ""]);
    informations::add_rows(&mut results, (about, report));
    for (index, (before, after)) in start.tasks.iter().zip(&optimum.tasks).enumerate() {
        let (from, to) = (before.cost.expected, after.cost.expected);
        let missed = optimum.missed_bound(after);
        let note = match report.bound_prices.get(index).filter(|price| price.nats_per_unit > 0.0) {
            _ if missed.is_some() => "missed".into(),
            Some(price) => {
                format!("active: one more would save {} bits", number(price.nats_per_unit / std::f64::consts::LN_2))
            }
            None => String::new(),
        };
        let bound = after.cost.bound.map_or_else(|| "none".into(), number);
        results.add_row([format!("cost of {}", after.name), number(from), number(to), percent(from, to), bound, note]);
    }
    for (before, after) in start.tasks.iter().zip(&optimum.tasks) {
        if let (Some(from), Some(to)) = (&before.monte_carlo, &after.monte_carlo) {
            let (from, to) = (from.cost_mean, to.cost_mean);
            let change = if from.is_finite() && to.is_finite() { percent(from, to) } else { String::new() };
            let name = format!("sampled cost of {}", after.name);
            results.add_row([name, number(from), number(to), change, String::new(), String::new()]);
        }
    }
    align_right(&mut results, 1..5);
    let _ = writeln!(page, "{results}\n");
    page.push_str(&split::of_design(&report.split));
    page.push_str(&trust::of_design(start, optimum));
    if let Some(chosen) = &report.catalogue {
        let _ = writeln!(page, "{}", catalogue::page(chosen));
    }

    page.push_str(&prices(optimum, Some(report)));

    let at_box: Vec<String> = about
        .parameters
        .iter()
        .enumerate()
        .filter_map(|(index, parameter)| {
            let [lower, upper] = parameter.bounds;
            let value = optimum.parameters.0[index].1;
            let near = 1e-6 * (upper - lower);
            let side = if value - lower < near {
                "lower"
            } else if upper - value < near {
                "upper"
            } else {
                return None;
            };
            about.parameters.design().contains(&index).then(|| format!("{} is at its {side} bound", parameter.name))
        })
        .collect();
    if !at_box.is_empty() {
        let _ = writeln!(page, "{}.\n", at_box.join("; "));
    }
    for task in optimum.tasks.iter().filter(|task| !task.contacts.is_empty()) {
        let _ = writeln!(page, "Contacts of {}:\n{}\n", task.name, contacts::table_of(task));
    }
    for task in optimum.tasks.iter().filter(|task| !task.limits_violated.is_empty()) {
        let _ = writeln!(page, "The plan of {} violates limits:\n{}", task.name, limit_lines(task));
    }
    page.push_str(&contacts::warnings(optimum));
    let _ = writeln!(page, "{}", verdict(about, report));
    page
}

fn sensitivities(about: &About, at: &Evaluation, index: usize, value: f64) -> [String; 2] {
    let gradients = at.tasks.iter().filter_map(|task| task.gradient.as_ref()?.total.as_ref());
    let (mut bits, mut costs) = (0.0, Vec::new());
    for (task, gradient) in about.tasks.iter().zip(gradients) {
        bits += task.information_weight * gradient.information_nats.0[index].1 / std::f64::consts::LN_2;
        costs.push(format!("{:+.3}", gradient.expected_cost.0[index].1 * value * 0.01));
    }
    [format!("{:+.3} bits", bits * value * 0.01), costs.join(", ")]
}

fn minima(count: usize) -> String {
    if count == 1 { "1 local minimum".to_owned() } else { format!("{count} local minima") }
}

fn verdict(about: &About, report: &DesignReport) -> String {
    let how = match report.status {
        DesignStatus::Converged if report.catalogue.is_some() => {
            format!("Optimum among the catalogues' entries; {} of the plan seen.", minima(report.branches))
        }
        DesignStatus::Converged => format!(
            "Optimum found from {} of {} starts; {} of the plan seen.{}",
            report.agreement().0,
            report.starts.len(),
            minima(report.branches),
            report.advice()
        ),
        DesignStatus::NotOptimal => {
            "Not an optimum: the method came to rest, but the total gradient is not zero.".into()
        }
        DesignStatus::NotConverged => "Not converged: the best design found meets every bound.".into(),
        DesignStatus::Stopped => "Stopped: the best design until then.".into(),
        DesignStatus::BoundViolated => {
            let over = |(task, at): (&AboutTask, &TaskEvaluation)| {
                let bound = report.optimum.missed_bound(at)?;
                Some(format!("misses the bound of {} by {}", task.name, excess(at.cost.expected, bound)))
            };
            let unfinished = |(task, at): (&AboutTask, &TaskEvaluation)| {
                (!at.status.is_converged()).then(|| format!("has a plan of {} that ended as {}", task.name, at.status))
            };
            let tasks = || about.tasks.iter().zip(&report.optimum.tasks);
            let dear = report.optimum.price.as_ref().and_then(|price| {
                Some(format!(
                    "costs {} of a budget of {}",
                    number(price.total),
                    number(report.optimum.exceeded_budget()?)
                ))
            });
            let broken = |(task, at): (&AboutTask, &TaskEvaluation)| {
                (!at.cost.expected.is_finite()).then(|| format!("has an infinite expected cost of {}", task.name))
            };
            let causes =
                tasks().filter_map(over).chain(tasks().filter_map(unfinished)).chain(tasks().filter_map(broken));
            let list: Vec<_> = causes.chain(dear).collect();
            let of = if report.catalogue.is_some() { " from the catalogues" } else { "" };
            let closest =
                if list.is_empty() { String::new() } else { format!(" The closest {}.", list.join(", and ")) };
            format!("No design{of} that meets every bound was found.{closest}")
        }
    };
    format!(
        "{how}{}\n{} designs evaluated in {:.2} s, least information {}, method {}, gradient {}, seed {}.{}",
        informations::passed(report),
        report.evaluations,
        report.seconds,
        report.settings.information,
        report.method,
        report.gradient,
        report.seed,
        contacts::note(report)
    )
}

/// The page of `supple evaluate`.
pub fn evaluation_page(about: &About, at: &Evaluation) -> String {
    let mut page = heading(about);
    let values = about.parameters.iter().zip(&at.parameters.0);
    let values: Vec<_> = values.map(|(p, (name, value))| format!("{name} = {} {}", number(*value), p.unit)).collect();
    if !values.is_empty() {
        let _ = writeln!(page, "{}\n", values.join("   ").trim_end());
    }
    for task in &at.tasks {
        let information = &task.information;
        let _ = writeln!(
            page,
            "{}: {} after {} iterations, stationarity {:.1e}",
            task.name, task.status, task.iterations, task.stationarity
        );
        if let Some(branches) = task.branches {
            let which = if branches == 1 { "no other" } else { "this is the cheapest" };
            let _ = writeln!(page, "  {} of the plan seen; {which}", minima(branches));
        }
        let mut rows = table(&["", "", ""]);
        for (name, value, note) in informations::of_task(information) {
            rows.add_row([name, &value, &note]);
        }
        rows.add_row(["expected cost", &number(task.cost.expected), &bound_note(at, task)]);
        let parts = task.cost.parts;
        let names = ["  nominal", "  belief", "  process noise", "  unknown start"];
        for (name, part) in names.into_iter().zip([parts.nominal, parts.belief, parts.process, parts.initial]) {
            rows.add_row([name, &number(part), ""]);
        }
        if let Some(sampled) = task.monte_carlo.as_ref().filter(|sampled| sampled.diverged > 0) {
            rows.add_row([
                "sampled cost",
                "none",
                &format!("{} of {} roll-outs diverged", sampled.diverged, sampled.rollouts),
            ]);
        } else if let Some(sampled) = &task.monte_carlo {
            let note = format!(
                "+- {} over {} roll-outs, {:+.4} from the expected",
                number(sampled.cost_standard_error),
                sampled.rollouts,
                sampled.difference
            );
            rows.add_row(["sampled cost", &number(sampled.cost_mean), &note]);
        }
        for (name, value, note) in task.monte_carlo.as_ref().map(trust::rows).unwrap_or_default() {
            rows.add_row([name, &value, &note]);
        }
        align_right(&mut rows, 1..2);
        let body = rows.to_string();
        let _ = writeln!(page, "{}\n", body.trim_start_matches(|c: char| c.is_whitespace() && c != ' ').trim_end());
        if let Some(trust) = &task.trust {
            let _ = writeln!(page, "  {}\n", trust::line(trust));
        }
        if !task.limits_violated.is_empty() {
            let _ = writeln!(page, "  violates limits:\n{}", limit_lines(task));
        }
        if task.stability.numerically_unstable {
            let _ = writeln!(page, "  {}\n", task.stability);
        }
        if !task.contacts.is_empty() {
            let _ = writeln!(page, "{}\n", contacts::table_of(task));
        }
        page.push_str(&gradient_tables(task));
    }
    page.push_str(&prices(at, None));
    page.push_str(&contacts::warnings(at));
    if at.tasks.len() > 1 {
        let _ = writeln!(page, "all tasks: {} bits minimised", number(at.objective.information_bits));
    }
    page
}

/// What a design costs: a line for all prices, with the budget and what more of it would save.
fn prices(at: &Evaluation, report: Option<&DesignReport>) -> String {
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
        let bits = number(saved / std::f64::consts::LN_2);
        let _ = writeln!(text, "The budget is used up: one more would save {bits} bits.");
    }
    if price.weight_nats_per_unit > 0.0 {
        let [weight, sum] =
            [price.weight_nats_per_unit, price.objective_nats].map(|nats| nats / std::f64::consts::LN_2);
        let _ = writeln!(text, "With {} bits per unit of price, {} bits are minimised.", number(weight), number(sum));
    }
    text + "\n"
}

/// A line for each limit that the plan of a task violates.
fn limit_lines(task: &TaskEvaluation) -> String {
    let line = |LimitViolation { name, worst, limit, step, steps }: &LimitViolation| {
        let side = if worst > limit { "above" } else { "below" };
        let steps = if *steps == 1 { "1 step".into() } else { format!("{steps} steps") };
        format!("    {name}: {} at step {step}, {side} {} ({steps})\n", number(*worst), number(*limit))
    };
    task.limits_violated.iter().map(line).collect()
}

/// How far a cost is above its bound, also relative to a bound that is not 0.
fn excess(cost: f64, bound: f64) -> String {
    let over = cost - bound;
    if bound == 0.0 { number(over) } else { format!("{} ({:.3} %)", number(over), 100.0 * over / bound.abs()) }
}

fn bound_note(at: &Evaluation, task: &TaskEvaluation) -> String {
    match (at.missed_bound(task), task.cost.bound) {
        (Some(bound), _) => format!("misses the bound {} by {}", number(bound), excess(task.cost.expected, bound)),
        (None, Some(bound)) => format!("meets the bound {}", number(bound)),
        (None, None) => String::new(),
    }
}

fn gradient_tables(task: &TaskEvaluation) -> String {
    let mut page = String::new();
    let Some(gradient) = &task.gradient else { return page };
    if let Some(total) = &gradient.total {
        let mut rows =
            table(&["total gradient", "information, nats", "expected cost", "nominal", "belief", "process", "initial"]);
        for (index, (name, value)) in total.information_nats.0.iter().enumerate() {
            let parts = [
                &total.expected_cost,
                &total.nominal_cost,
                &total.belief_cost,
                &total.process_cost,
                &total.initial_cost,
            ];
            let parts = parts.iter().map(|part| format!("{:.4e}", part.0[index].1));
            rows.add_row([name.clone(), format!("{value:.4e}")].into_iter().chain(parts));
        }
        align_right(&mut rows, 1..7);
        let note = if total.valid { "" } else { "The plan is not stationary enough for these gradients to hold.\n" };
        let _ = writeln!(page, "{rows}\n{note}");
    }
    if let Some(frozen) = &gradient.frozen {
        let mut rows = table(&["frozen gradient", "information, nats", "belief cost"]);
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
