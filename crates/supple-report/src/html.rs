//! Pieces of HTML that sections share.

use maud::{Markup, html};

/// A heading of a level from 1 to 4.
pub fn heading(level: u8, id: &str, text: &str) -> Markup {
    match level {
        1 => html! { h1 id=(id) { (text) } },
        2 => html! { h2 id=(id) { (text) } },
        3 => html! { h3 id=(id) { (text) } },
        _ => html! { h4 id=(id) { (text) } },
    }
}

/// A table, its first column the names of the rows. Columns of numbers stand to the right. Wide tables scroll by
/// themselves.
pub fn table(caption: &str, head: &[String], rows: &[Vec<String>]) -> Markup {
    let numeric: Vec<bool> = (0..head.len()).map(|column| column > 0 && is_numeric(rows, column)).collect();
    let class = |column: usize| numeric.get(column).copied().unwrap_or(false).then_some("number");
    html! {
        div.table tabindex="0" role="region" aria-label=(caption) {
            table {
                caption { (caption) }
                thead {
                    tr {
                        @for (column, name) in head.iter().enumerate() {
                            th scope="col" class=[class(column)] { (name) }
                        }
                    }
                }
                tbody {
                    @for row in rows {
                        tr {
                            @for (column, entry) in row.iter().enumerate() {
                                @if column == 0 { th scope="row" { (entry) } } @else {
                                    td class=[class(column)] { (entry) }
                                }
                            }
                        }
                    }
                }
            }
        }
    }
}

/// Whether every entry of a column that says something is a number.
fn is_numeric(rows: &[Vec<String>], column: usize) -> bool {
    let entries = || rows.iter().filter_map(|row| row.get(column)).filter(|entry| !entry.is_empty());
    let starts = |entry: &String| entry.starts_with(|letter: char| letter.is_ascii_digit() || "−+–".contains(letter));
    entries().next().is_some() && entries().all(starts)
}

/// A text whose names in backticks are set as code.
pub fn with_code(text: &str) -> Markup {
    let parts: Vec<&str> = text.split('`').collect();
    html! {
        @for (index, part) in parts.iter().enumerate() {
            @match (index % 2, index + 1 < parts.len()) {
                (1, true) => { code { (part) } }
                // A backtick without its partner.
                (1, false) => { "`" (part) }
                _ => { (part) }
            }
        }
    }
}

/// Words as strings.
pub fn words<const N: usize>(list: [&str; N]) -> Vec<String> {
    list.map(str::to_owned).to_vec()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_of_numbers_stand_to_the_right() {
        let rows = [words(["a", "1.5", "N/m", ""]), words(["b", "−2", "", "–"])];
        let columns: Vec<bool> = (0..4).map(|column| is_numeric(&rows, column)).collect();
        assert_eq!(columns, [false, true, false, true]);
    }

    #[test]
    fn names_in_backticks_are_code() {
        let texts = ["at `<k>` of `d`", "no name", "5` more"].map(|text| with_code(text).into_string());
        assert_eq!(texts, ["at <code>&lt;k&gt;</code> of <code>d</code>", "no name", "5` more"]);
    }

    #[test]
    fn tables_show_markup_as_text() {
        let page = table("a", &words(["<i>"]), &[words(["</td><b>"])]).into_string();
        assert!(page.contains("&lt;i&gt;") && page.contains("&lt;/td&gt;&lt;b&gt;") && !page.contains("<b>"));
    }
}
