use std::fmt::Write;

use supple::design::DesignStatus;
use supple_study::About;
use supple_study::robustness::{Comparison, Paired, PlannedFor, RobustCell, RobustDesign, Robustness};

use crate::tables::{align_right, heading, number, table, title, with_unit};

/// p-values below this count as significant.
const SIGNIFICANT: f64 = 0.05;

/// The page of `supple robustness`.
pub fn robustness_page(about: &About, study: &Robustness) -> String {
    let mut page = heading(about) + &designs(about, study);
    for (index, task) in about.tasks.iter().enumerate() {
        for planned_for in [PlannedFor::Nominal, PlannedFor::Truth] {
            let _ = writeln!(
                page,
                "Cost of {}, {}{}:\n\n{}",
                task.name,
                if task.set.get(&study.options.vary.parameter).is_some() { "which sets it for itself, " } else { "" },
                planning(study, planned_for),
                costs(study, index, planned_for)
            );
            let of_it = |comparison: &&Comparison| comparison.task == index && comparison.planned_for == planned_for;
            let sentences: String = study.comparisons.iter().filter(of_it).map(|c| comparison(study, c)).collect();
            if !sentences.is_empty() {
                let _ = writeln!(page, "{sentences}");
            }
        }
    }
    page.push_str(&problems(about, study));
    page.push_str(&footer(study));
    page
}

fn designs(about: &About, study: &Robustness) -> String {
    let design = about.parameters.design();
    let mut header = vec!["design".to_owned()];
    header.extend(design.iter().map(|&i| {
        let parameter = about.parameters.get(i);
        title(&parameter.name, &parameter.unit)
    }));
    header.push("information, bits".to_owned());
    let mut rows = table(&header.iter().map(String::as_str).collect::<Vec<_>>());
    for RobustDesign { name, parameters, information_nats, .. } in &study.designs {
        let mut row = vec![name.clone()];
        row.extend(design.iter().map(|&i| number(parameters.0[i].1)));
        row.push(number(information_nats / std::f64::consts::LN_2));
        rows.add_row(row);
    }
    align_right(&mut rows, 1..design.len() + 2);
    let mut page = format!("{rows}\n\n");
    for design in &study.designs {
        if let Some(status) = design.status.filter(|&status| status != DesignStatus::Converged) {
            let _ = writeln!(page, "The search for {} finished with status {status}.\n", design.name);
        }
    }
    page
}

/// What controllers are planned for, in words.
fn planning(study: &Robustness, planned_for: PlannedFor) -> String {
    let name = &study.options.vary.parameter;
    match planned_for {
        PlannedFor::Nominal => {
            format!("planned for the nominal {name} = {}", with_unit(study.nominal, &study.options.vary.unit))
        }
        PlannedFor::Truth => format!("planned for the true {name}"),
    }
}

fn costs(study: &Robustness, task: usize, planned_for: PlannedFor) -> String {
    let vary = &study.options.vary;
    let first =
        if vary.unit.is_empty() { vary.parameter.clone() } else { format!("{}, {}", vary.parameter, vary.unit) };
    let mut header = vec![first.as_str()];
    for design in &study.designs {
        header.push(&design.name);
        if planned_for == PlannedFor::Truth {
            header.push("expected");
        }
    }
    let mut rows = table(&header);
    for (level, &value) in vary.values.iter().enumerate() {
        let mut row = vec![number(value)];
        let of_it = |cell: &&RobustCell| (cell.task, cell.planned_for, cell.level) == (task, planned_for, level);
        for cell in study.cells.iter().filter(of_it) {
            row.push(cost(cell));
            if planned_for == PlannedFor::Truth {
                row.push(cell.expected.map(number).unwrap_or_default());
            }
        }
        rows.add_row(row);
    }
    align_right(&mut rows, 0..header.len());
    format!("{rows}\n")
}

fn cost(cell: &RobustCell) -> String {
    match cell {
        cell if cell.is_missing() => "not computed".to_owned(),
        RobustCell { error: Some(_), .. } => "failed".to_owned(),
        RobustCell { diverged: 1.., .. } => format!("{} diverged", cell.diverged),
        RobustCell { mean, half_width_95, .. } => {
            format!("{} +- {}", beside(*mean, *half_width_95), beside(*half_width_95, *half_width_95))
        }
    }
}

/// A number with as many decimals as its uncertainty has at two digits, but at least two where these are few.
fn beside(value: f64, uncertainty: f64) -> String {
    if !value.is_finite() || value.abs() >= 1e7 {
        return number(value);
    }
    let decimals = match uncertainty > 0.0 && uncertainty.is_finite() {
        true => (1.0 - uncertainty.log10().floor()).clamp(2.0, 9.0) as usize,
        false => 2,
    };
    format!("{value:.decimals$}")
}

/// How two designs compare, in a sentence for growth and one for the cost at the greatest level.
fn comparison(study: &Robustness, comparison: &Comparison) -> String {
    let Comparison { design, other, levels, growths, growth, at_greatest, .. } = comparison;
    let (design, other) = (&study.designs[*design].name, &study.designs[*other].name);
    let [least, greatest] = levels.map(|level| study.options.vary.values[level]);
    let name = &study.options.vary.parameter;
    if !growth.difference.is_finite() {
        let cause = match study.cells.iter().any(RobustCell::is_missing) {
            true => "not all costs were computed",
            false => "roll-outs diverged or failed",
        };
        return format!("{design} cannot be compared with {other}: {cause}.\n");
    }
    let mut text = format!(
        "From {name} = {} to {} the cost of {design} grows by {}, the cost of {other} by {}: {}.\n",
        number(least),
        with_unit(greatest, &study.options.vary.unit),
        beside(growths[0], growth.half_width()),
        beside(growths[1], growth.half_width()),
        verdict(growth, ["less", "more"])
    );
    if at_greatest.difference.is_finite() {
        let verdict = verdict(at_greatest, ["cheaper", "more expensive"]);
        let _ = writeln!(text, "  At {} {design} is {verdict}.", with_unit(greatest, &study.options.vary.unit));
    }
    text
}

/// A difference, its interval and whether it is significant.
fn verdict(paired: &Paired, [less, more]: [&str; 2]) -> String {
    let Paired { difference, interval_95: [lower, upper], p_value } = *paired;
    let which = if difference < 0.0 { less } else { more };
    let p = match p_value {
        ..1e-12 => "p < 1e-12".to_owned(),
        ..1e-4 => format!("p = {p_value:.0e}"),
        _ => format!("p = {p_value:.4}"),
    };
    let significant = if p_value < SIGNIFICANT { "significant" } else { "not significant" };
    let [size, lower, upper] = [difference.abs(), lower, upper].map(|value| beside(value, paired.half_width()));
    format!("{size} {which} (95 % interval of the difference {lower} to {upper}, {p}: {significant})")
}

/// How far a study of robustness is that was stopped.
pub fn stopped_robustness(study: &Robustness) -> Option<String> {
    let done = study.cells.iter().filter(|cell| cell.error.is_none()).count();
    study.stopped.then(|| format!("stopped: {done} of {} costs were computed and stored", study.cells.len()))
}

/// Cells that failed or diverged.
fn problems(about: &About, study: &Robustness) -> String {
    let mut page = String::new();
    for design in &study.designs {
        for warning in &design.warnings {
            let _ = writeln!(page, "Warning: at {}, {warning}.", design.name);
        }
    }
    if let Some(stopped) = stopped_robustness(study) {
        // All cells that are missing for this reason would be a long list.
        return format!("{page}Warning: {stopped}.\n\n");
    }
    for cell in study.cells.iter().filter(|cell| cell.error.is_some() || cell.is_broken()) {
        let place = format!(
            "{} in {}, {}, at {} = {}",
            study.designs[cell.design].name,
            about.tasks[cell.task].name,
            planning(study, cell.planned_for),
            study.options.vary.parameter,
            with_unit(study.options.vary.values[cell.level], &study.options.vary.unit)
        );
        let _ = match (&cell.error, cell.expected) {
            (Some(error), _) => writeln!(page, "{place}: failed: {error}"),
            (None, Some(expected)) if cell.diverged == 0 => {
                writeln!(page, "{place}: roll-outs cost {}, but {} is expected", number(cell.mean), number(expected))
            }
            (None, _) => writeln!(page, "{place}: {} of {} roll-outs diverged", cell.diverged, study.options.rollouts),
        };
    }
    if !page.is_empty() {
        page.push('\n');
    }
    page
}

fn footer(study: &Robustness) -> String {
    format!(
        "{} roll-outs each, seed {}, the same random numbers for every design. +- is half the width of the \
         95 % interval of the mean.\nDifferences are paired by roll-out; each is called significant if \
         p < {SIGNIFICANT}, on its own.\n",
        study.options.rollouts, study.options.seed
    )
}
