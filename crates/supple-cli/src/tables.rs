//! Numbers and tables as text.

use std::ops::{Deref, DerefMut};

use comfy_table::{CellAlignment, ColumnConstraint, ContentArrangement, Table, presets};
use supple_study::About;
use supple_text::short;
/// A number in a table, with about six significant digits.
pub(crate) use supple_text::tabular as number;

/// A table as text, no wider than the terminal: columns that do not fit follow below, each time with the first column.
pub(crate) struct Rows(Table);

impl Rows {
    /// Its lines, without blanks at their ends.
    pub fn trimmed(&self) -> String {
        self.to_string().lines().map(|line| format!("{}\n", line.trim_end())).collect()
    }
}

impl Deref for Rows {
    type Target = Table;

    fn deref(&self) -> &Table {
        &self.0
    }
}

impl DerefMut for Rows {
    fn deref_mut(&mut self) -> &mut Table {
        &mut self.0
    }
}

impl std::fmt::Display for Rows {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.write_str(&fitted(&self.0, width()))
    }
}

/// Available width: that of the terminal or the variable COLUMNS; unlimited when writing to a file.
fn width() -> usize {
    let said = std::env::var("COLUMNS").ok().and_then(|columns| columns.parse().ok());
    let terminal = || terminal_size::terminal_size_of(std::io::stdout()).map(|(width, _)| usize::from(width.0));
    said.or_else(terminal).map_or(usize::MAX, |width: usize| width.max(LEAST))
}

/// Minimum width of a table.
const LEAST: usize = 40;

/// A table that fits into a width.
fn fitted(table: &Table, width: usize) -> String {
    // One space on each side of every cell.
    let widths: Vec<usize> = table.column_max_content_widths().iter().map(|&width| usize::from(width) + 2).collect();
    if widths.iter().sum::<usize>() <= width {
        return table.trim_fmt();
    }
    let mut blocks: Vec<Vec<usize>> = Vec::new();
    let first = widths.first().copied().unwrap_or(0);
    let mut room = 0;
    for (column, &wide) in widths.iter().enumerate().skip(1) {
        // The last column may be text: wrap it next to the others if there is enough room.
        match blocks.last_mut() {
            Some(block) if wide <= room || column + 1 == widths.len() && room >= ENOUGH => {
                block.push(column);
                room = room.saturating_sub(wide);
            }
            _ => {
                blocks.push(vec![0, column]);
                room = width.saturating_sub(first + wide);
            }
        }
    }
    let shown = blocks.iter().map(|block| {
        let mut part = table.clone();
        for column in 0..widths.len() {
            if !block.contains(&column)
                && let Some(column) = part.column_mut(column)
            {
                column.set_constraint(ColumnConstraint::Hidden);
            }
        }
        part.set_content_arrangement(ContentArrangement::Dynamic).set_width(u16::try_from(width).unwrap_or(u16::MAX));
        part.trim_fmt()
    });
    shown.collect::<Vec<_>>().join("\n\n")
}

/// Minimum width of a wrapped column.
const ENOUGH: usize = 20;

/// Lines of one list that are printed at most.
const MOST_LINES: usize = 12;

/// The first lines of a list, and how many more there are.
pub(crate) fn first_lines(lines: impl ExactSizeIterator<Item = String>) -> String {
    let more = lines.len().saturating_sub(MOST_LINES);
    let mut text: String = lines.take(MOST_LINES).collect();
    if more > 0 {
        text += &format!("    and {more} more, which `--json` lists\n");
    }
    text
}

pub(crate) fn table(header: &[&str]) -> Rows {
    let mut table = Table::new();
    table.load_preset(presets::NOTHING).set_header(header);
    Rows(table)
}

pub(crate) fn align_right(table: &mut Table, columns: std::ops::Range<usize>) {
    for column in columns {
        if let Some(column) = table.column_mut(column) {
            column.set_cell_alignment(CellAlignment::Right);
        }
    }
}

/// A column heading: a name with its unit.
pub(crate) fn title(name: &str, unit: &str) -> String {
    if unit.is_empty() { name.to_owned() } else { format!("{name}, {unit}") }
}

/// A number with its unit, where it has one.
pub(crate) fn with_unit(value: f64, unit: &str) -> String {
    format!("{} {unit}", number(value)).trim_end().to_owned()
}

/// A number with its sign.
pub(crate) fn signed(value: f64) -> String {
    let sign = if value > 0.0 { "+" } else { "" };
    format!("{sign}{}", short(value, 3))
}

pub(crate) fn percent(from: f64, to: f64) -> String {
    if from == 0.0 { String::new() } else { format!("{:+.1} %", 100.0 * (to - from) / from.abs()) }
}

/// The title, and what tasks set for themselves.
pub(crate) fn heading(about: &About) -> String {
    let settings = about.settings(with_unit);
    let title = (!about.title.is_empty()).then(|| about.title.clone());
    let lines: Vec<String> = title.into_iter().chain(settings).collect();
    if lines.is_empty() { String::new() } else { format!("{}\n\n", lines.join("\n")) }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    fn wide() -> Rows {
        let mut rows =
            table(&["factor", "information, bits", "cost of press", "bits per unit of cost limit", "status"]);
        for factor in ["0.5", "1"] {
            rows.add_row([factor, "123.456", "250.123", "2.72142", "converged and within every limit of the task"]);
        }
        rows
    }

    #[test]
    fn a_table_is_as_wide_as_its_terminal() {
        for width in [40, 60, 80, 100] {
            let text = fitted(&wide(), width);
            assert!(text.lines().all(|line| line.chars().count() <= width), "{width}\n{text}");
            for word in ["factor", "information,", "press", "limit", "status", "123.456", "within"] {
                assert!(text.contains(word), "{word} at {width}\n{text}");
            }
        }
    }

    #[test]
    fn columns_that_do_not_fit_follow_below_with_the_first() {
        let text = fitted(&wide(), 60);
        let parts: Vec<&str> = text.split("\n\n").collect();
        assert!(parts.len() > 1 && parts.iter().all(|part| part.trim_start().starts_with("factor")), "{text}");
        assert_eq!(fitted(&wide(), usize::MAX), wide().0.trim_fmt());
    }
}
