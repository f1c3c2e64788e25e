//! The page of a design.

use std::fmt::Write;

use supple::TaskEvaluation;
use supple::design::{CatalogueMethod, DesignStatus};
use supple::parameters::Role;
use supple_study::design::DesignReport;
use supple_study::{About, AboutTask};

use super::ends::at_bounds;
use super::evaluation::{above_limit, excess, left_lines, limit_lines, minima, prices, reached_lines};
use super::next;
use crate::tables::{Rows, align_right, heading, number, percent, signed, table};
use crate::{catalogue, contacts, informations, split, terms, trust};

/// How far a stopped search got; `None` if it was not stopped.
pub fn stopped_design(report: &DesignReport) -> Option<String> {
    let ended = report.starts.iter().filter(|start| !start.interrupted).count();
    let wanted = report.settings.starts;
    (report.status == DesignStatus::Stopped).then(|| match ended {
        0 => format!("stopped: none of {wanted} starts had finished"),
        _ => format!("stopped: {ended} of {wanted} starts had finished"),
    })
}

/// The page of `supple design`.
pub fn design_page(about: &About, report: &DesignReport) -> String {
    let (start, optimum) = (&report.start, &report.optimum);
    let mut page = heading(about);
    let _ = writeln!(page, "{}\n", parameters(about, report));
    let _ = writeln!(page, "{}\n", results(about, report));
    page.push_str(&split::of_design(&report.split));
    page.push_str(&trust::of_design(start, optimum));
    if let Some(unconfirmed) = report.unconfirmed(about) {
        let _ = writeln!(page, "{}.\n", supple_text::capitalised(&unconfirmed.to_string()));
    }
    if let Some(rises) = report.rises() {
        let _ = writeln!(page, "{}.\n", supple_text::capitalised(&rises));
    }
    if let Some(chosen) = &report.catalogue {
        let _ = writeln!(page, "{}", catalogue::page(chosen));
    }

    page.push_str(&prices(optimum, Some(report)));

    let at_bounds = at_bounds(about, optimum).into_iter();
    let at_bounds: Vec<String> = at_bounds.map(|(name, side)| format!("{name} is at its {side} bound")).collect();
    if !at_bounds.is_empty() {
        let _ = writeln!(page, "{}.\n", at_bounds.join("; "));
    }
    for task in optimum.tasks.iter().filter(|task| !task.contacts.is_empty()) {
        let _ = writeln!(page, "Contacts of {}:\n{}\n", task.name, contacts::table_of(task));
        page.push_str(&contacts::apart(task));
    }
    let missed: String = optimum.tasks.iter().map(terms::missed).collect();
    if !missed.is_empty() {
        let _ = writeln!(page, "{missed}");
    }
    for task in optimum.tasks.iter().filter(|task| !task.limits_violated.is_empty()) {
        let _ = writeln!(page, "The plan of {} violates limits:\n{}", task.name, limit_lines(task));
    }
    for task in optimum.tasks.iter().filter(|task| !task.limits_reached.is_empty()) {
        let _ = writeln!(page, "The plan of {} is held at limits:\n{}", task.name, reached_lines(task));
    }
    for task in &optimum.tasks {
        let left = left_lines(task);
        if !left.is_empty() {
            let _ = writeln!(page, "Roll-outs of {} exceed limits:\n{left}", task.name);
        }
    }
    page.push_str(&contacts::warnings(optimum));
    let _ = writeln!(page, "{}", verdict(about, report));
    page + &next::after_design(about, report)
}

/// The parameters from start to optimum, with the sensitivities of information and costs to each.
fn parameters(about: &About, report: &DesignReport) -> Rows {
    let (start, optimum) = (&report.start, &report.optimum);
    let change = "change in information per +1 %";
    let mut rows = table(&["parameter", "from", "to", "unit", change, "change in cost per +1 %"]);
    for (index, parameter) in about.parameters.iter().enumerate() {
        let (from, to) = (start.parameters.0[index].1, optimum.parameters.0[index].1);
        let to_shown = if parameter.role == Role::Design { number(to) } else { String::new() };
        let mut row = vec![parameter.name.clone(), number(from), to_shown, parameter.unit.clone()];
        row.extend(sensitivities(about, report, index, to));
        rows.add_row(row);
    }
    align_right(&mut rows, 1..3);
    align_right(&mut rows, 4..6);
    rows
}

/// Information and costs from start to optimum.
fn results(about: &About, report: &DesignReport) -> Rows {
    let (start, optimum) = (&report.start, &report.optimum);
    let mut results = table(&["", "from", "to", "change", "bound", ""]);
    informations::add_rows(&mut results, about, report);
    for (index, (before, after)) in start.tasks.iter().zip(&optimum.tasks).enumerate() {
        let (from, to) = (before.cost.expected, after.cost.expected);
        let missed = optimum.missed_bound(after);
        let note = match missed.is_some() {
            true => "missed".into(),
            false => report.priced_limit(index, number).unwrap_or_default(),
        };
        let bound = after.cost.bound.map_or_else(|| "none".into(), number);
        results.add_row([format!("cost of {}", after.name), number(from), number(to), percent(from, to), bound, note]);
    }
    for (before, after) in start.tasks.iter().zip(&optimum.tasks) {
        if let (Some(from), Some(to)) = (&before.monte_carlo, &after.monte_carlo) {
            let (from, to) = (from.cost_mean, to.cost_mean);
            let change = if from.is_finite() && to.is_finite() { percent(from, to) } else { String::new() };
            let name = format!("sampled cost of {}", after.name);
            let note = above_limit(after).unwrap_or_default();
            results.add_row([name, number(from), number(to), change, String::new(), note]);
        }
    }
    for (before, after) in start.tasks.iter().zip(&optimum.tasks) {
        let bits = |task: &TaskEvaluation| Some(task.monte_carlo.as_ref()?.realised_bits?.mean);
        if let (Some(from), Some(to)) = (bits(before), bits(after)) {
            let name = format!("sampled bits of {}", after.name);
            results.add_row([name, number(from), number(to), percent(from, to), String::new(), String::new()]);
        }
    }
    align_right(&mut results, 1..5);
    results
}

/// By how much the minimised information and each cost change per +1 % of a parameter.
fn sensitivities(about: &About, report: &DesignReport, index: usize, value: f64) -> [String; 2] {
    let gradients = report.optimum.tasks.iter().filter_map(|task| task.gradient.as_ref()?.total.as_ref());
    let (mut bits, mut costs) = (Some(0.0), Vec::new());
    for (task, gradient) in about.tasks.iter().zip(gradients) {
        let slope = gradient.minimised_nats(report.settings.information).map(|minimised| minimised.0[index].1);
        bits = bits.zip(slope).map(|(bits, slope)| bits + task.information_weight * slope / std::f64::consts::LN_2);
        costs.push(signed(gradient.expected_cost.0[index].1 * value * 0.01));
    }
    let bits = bits.map_or_else(|| "unknown".to_owned(), |bits| format!("{} bits", signed(bits * value * 0.01)));
    [bits, costs.join(", ")]
}

fn verdict(about: &About, report: &DesignReport) -> String {
    let how = match report.status {
        DesignStatus::Converged => {
            let minima = minima(report.branches);
            match report.catalogue.as_ref().map(|chosen| chosen.method) {
                Some(CatalogueMethod::AllCombinations) => {
                    format!("Optimum among the catalogue entries; {minima} of its plans encountered.")
                }
                Some(CatalogueMethod::Neighbourhood) => {
                    format!("Local optimum among the catalogue entries; {minima} of its plans encountered.")
                }
                None => {
                    let (agree, starts) = (report.agreement().0, report.starts.len());
                    let advice = report.advice();
                    format!("Optimum found from {agree} of {starts} starts; {minima} of its plans encountered.{advice}")
                }
            }
        }
        DesignStatus::NotOptimal => "Not an optimum: the method stopped, but the total gradient is not zero.".into(),
        DesignStatus::NotConverged => {
            let error = report.starts.iter().find_map(|start| start.error.as_deref());
            let cause = error.map_or_else(String::new, |error| {
                format!(" The search ended early, as designs beside it could not be evaluated: {error}.")
            });
            format!("Not converged; the best design found is within all cost limits.{cause}")
        }
        DesignStatus::Stopped => "Stopped: this is the best design found so far.".into(),
        DesignStatus::BoundViolated => none_within(about, report),
    };
    format!(
        "{how}{}\n{} designs evaluated in {:.2} s, report in {:.2} s, information minimised: {}, method {}, gradient {}, seed {}.{}",
        informations::passed(report),
        report.evaluations,
        report.seconds,
        report.report_seconds,
        report.settings.information,
        report.method,
        report.gradient,
        report.seed,
        contacts::note(report)
    )
}

/// Reports that no design is within all limits, and by how much the closest one exceeds them.
fn none_within(about: &About, report: &DesignReport) -> String {
    let tasks = || about.tasks.iter().zip(&report.optimum.tasks);
    let over = |(task, at): (&AboutTask, &TaskEvaluation)| {
        let bound = report.optimum.missed_bound(at)?;
        Some(format!("exceeds the cost limit of {} by {}", task.name, excess(at.cost.expected, bound)))
    };
    let unfinished = |(task, at): (&AboutTask, &TaskEvaluation)| {
        (!at.status.is_converged()).then(|| format!("has a plan of {} that ended as {}", task.name, at.status))
    };
    let broken = |(task, at): (&AboutTask, &TaskEvaluation)| {
        (!at.cost.expected.is_finite()).then(|| format!("has an infinite expected cost of {}", task.name))
    };
    let dear = report.optimum.price.as_ref().and_then(|price| {
        let budget = report.optimum.exceeded_budget()?;
        Some(format!("costs {}, above the budget of {}", number(price.total), number(budget)))
    });
    let causes = tasks().filter_map(over).chain(tasks().filter_map(unfinished)).chain(tasks().filter_map(broken));
    let list: Vec<_> = causes.chain(dear).collect();
    let of = if report.catalogue.is_some() { " from the catalogues" } else { "" };
    let closest = if list.is_empty() { String::new() } else { format!(" The closest {}.", list.join(", and ")) };
    format!("No design{of} within all cost limits was found.{closest}")
}
