use std::fmt::Write;
use std::path::Path;

use supple_study::JOURNAL;
use supple_study::sweep::{Jumps, LeastPoint, Sweep, SweepOptions, TABLE_CSV, TABLE_JSONL, misses_contact};
use supple_study::{About, Cell, Column, RESULT};

use crate::tables::{align_right, heading, number, table, title, with_unit};

/// Rows that are shown at the beginning and at the end of a table that is longer than both.
const FIRST: usize = 15;
const LAST: usize = 5;

/// The page of `supple sweep` where the table is kept in a folder.
pub fn sweep_page(about: &About, sweep: &Sweep, folder: &Path) -> String {
    let mut page = heading(about) + &summary(sweep);
    for (name, what) in [
        (TABLE_CSV, "the table"),
        (TABLE_JSONL, "the same table, one JSON object per line"),
        (RESULT, "its inputs, and a description of its columns"),
        (JOURNAL, "the journal"),
    ] {
        let path = folder.join(name);
        // Studies do not keep the journals of complete steps.
        if path.exists() {
            let _ = writeln!(page, "  {}: {what}", path.display());
        }
    }
    page
}

/// The page of `supple sweep` where the table is not kept: the table itself, its first and last rows where it is long.
pub fn table_page(about: &About, sweep: &Sweep) -> String {
    let mut page = heading(about);
    let shown = shown_columns(about, sweep);
    let constant = constants(about, sweep);
    if !constant.is_empty() {
        let _ = writeln!(page, "{}\n", constant.join("   "));
    }
    let columns = &sweep.table.columns;
    let header: Vec<String> = shown.iter().map(|&i| title(&columns[i].name, &columns[i].unit)).collect();
    let mut rows = table(&header.iter().map(String::as_str).collect::<Vec<_>>());
    let all = &sweep.table.rows;
    let long = all.len() > FIRST + LAST;
    for (index, row) in all.iter().enumerate() {
        if long && index == FIRST {
            rows.add_row(shown.iter().map(|_| ".."));
        }
        if !long || index < FIRST || index >= all.len() - LAST {
            rows.add_row(shown.iter().map(|&i| text(&row[i])));
        }
    }
    for (position, &column) in shown.iter().enumerate() {
        if !all.iter().any(|row| matches!(row[column], Cell::Text(_))) {
            align_right(&mut rows, position..position + 1);
        }
    }
    let _ = writeln!(page, "{rows}\n");
    page + &summary(sweep)
}

fn text(cell: &Cell) -> String {
    match cell {
        Cell::Number(value) => number(*value),
        Cell::Text(text) => text.clone(),
        Cell::Missing => "-".into(),
    }
}

/// Columns for people: what changes of the parameters, and the results that matter.
fn shown_columns(about: &About, sweep: &Sweep) -> Vec<usize> {
    let parameters = about.parameters.len();
    let mut names = vec!["information_bits".to_owned(), "feasible".to_owned(), "design_status".to_owned()];
    for task in &about.tasks {
        names.extend(["status", "expected_cost", "sampled_cost_mean"].map(|name| format!("{}.{name}", task.name)));
    }
    let failed = failed(sweep) > 0;
    let is_shown = |&index: &usize| match index < parameters {
        true => changes(sweep, index),
        false => {
            let name = &sweep.table.columns[index].name;
            names.contains(name) || failed && name == "error"
        }
    };
    (0..sweep.table.columns.len()).filter(is_shown).collect()
}

/// Whether a parameter is on an axis, or not the same everywhere.
fn changes(sweep: &Sweep, column: usize) -> bool {
    let name = &sweep.table.columns[column].name;
    let on_axis = sweep.options.axes.iter().any(|axis| axis.parameter == *name);
    let mut rows = sweep.table.rows.iter();
    let first = rows.next().map(|row| &row[column]);
    on_axis || rows.any(|row| Some(&row[column]) != first)
}

/// Parameters that are the same at every point, with their values.
fn constants(about: &About, sweep: &Sweep) -> Vec<String> {
    let Some(first) = sweep.table.rows.first() else { return Vec::new() };
    let parameters = about.parameters.iter().enumerate();
    let constant = parameters.filter(|(index, _)| !changes(sweep, *index));
    constant
        .map(|(index, p)| format!("{} = {} {}", p.name, text(&first[index]), p.unit).trim_end().to_owned())
        .collect()
}

/// How many points could not be evaluated.
fn failed(sweep: &Sweep) -> usize {
    let Some(error) = sweep.table.column("error") else { return 0 };
    sweep.table.rows.iter().filter(|row| row[error] != Cell::Missing).count()
}

/// A line for each task whose plans never touch, at some points, a contact from which a cost wants a force.
fn missed_contacts(sweep: &Sweep) -> String {
    let of_task = |column: &Column| {
        let task = misses_contact(column)?;
        let count = sweep.table.numbers(&column.name)?.into_iter().filter(|&missed| missed == 1.0).count();
        (count > 0).then(|| {
            format!(
                "Warning: at {} the plan of {task} never makes a contact whose force a cost tracks: see the \
                 column `{}`.\n",
                supple_text::count(count, "point"),
                column.name
            )
        })
    };
    sweep.table.columns.iter().filter_map(of_task).collect()
}

/// A line for each task whose expected cost jumps between neighbouring points.
fn jumps(sweep: &Sweep) -> String {
    let advice = match sweep.options {
        SweepOptions { starts, .. } if starts > 0 => "increase `branch_attempts` in [design], or --starts",
        SweepOptions { branches: 0, .. } => "use --branches 10 to look for the cheapest",
        _ => "increase --branches to look for the cheapest",
    };
    let of_task = |Jumps { task, count, axis, rows, costs: [from, to] }: Jumps| {
        let axis = &sweep.options.axes[axis];
        let values = sweep.table.numbers(&axis.parameter).unwrap_or_default();
        let [left, right] = rows.map(|row| with_unit(values[row], &axis.unit));
        format!(
            "Warning: the expected cost of {task} jumps in {}, most from {} to {} between {} = {left} and {right}: the plans are \
             at different local minima; {advice}.\n",
            supple_text::count(count, "place"),
            number(from),
            number(to),
            axis.parameter
        )
    };
    sweep.jumps().into_iter().map(of_task).collect()
}

/// How many points there are, how many failed, and where the least information is.
fn summary(sweep: &Sweep) -> String {
    let (rows, failed) = (&sweep.table.rows, failed(sweep));
    let points = supple_text::count(rows.len(), "point");
    let mut text = match failed {
        0 => format!("{points}, all evaluated.\n"),
        _ => format!("{points}; {failed} could not be evaluated: see the column `error`.\n"),
    };
    let misses = sweep.contacts_made().contains(&false);
    match sweep.least() {
        Some(LeastPoint { row, bits, among }) => {
            let values = sweep.options.axes.iter().filter_map(|axis| {
                let value = sweep.table.numbers(&axis.parameter)?[row];
                Some(format!("{} = {}", axis.parameter, with_unit(value, &axis.unit)))
            });
            let values: Vec<String> = values.collect();
            let [make, makes] = if misses { [" and make their contacts", " and makes its contacts"] } else { ["", ""] };
            let what = match among {
                0 => format!("No point with converged plans is within all cost limits{makes}. Least information"),
                _ => format!("Least information among the {among} that are within all cost limits{make}"),
            };
            let _ = writeln!(text, "{what}: {} bits at {}.", number(bits), values.join(", "));
        }
        None => text.push_str("There is no information to compare.\n"),
    }
    text + &missed_contacts(sweep) + &jumps(sweep)
}
