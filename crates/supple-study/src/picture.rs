use std::path::Path;

use supple::FileError;
use unicode_width::UnicodeWidthChar;

/// Bytes up to which a line of a file is worth showing.
const LONGEST: usize = 400;

/// Columns of a tab.
const TAB: usize = 4;

/// Endings of the files whose lines are shown. A task file of others may name any file, whose lines are nobody's business.
const SHOWN: [&str; 8] = ["toml", "urdf", "xml", "sdf", "world", "mjcf", "csv", "json"];

/// Whether lines of a file are shown.
fn is_shown(file: &str) -> bool {
    let ending = Path::new(file).extension().map(|ending| ending.to_string_lossy().to_lowercase());
    ending.is_some_and(|ending| SHOWN.contains(&&*ending))
}

/// The lines that an error is about, with marks, for people; none where there are none to show:
///
/// ```text
///   × steps: must be a positive integer
///     ╭─[reach.toml:12:1]
///  11 │ [[tasks]]
///  12 │ steps = -1
///     · ──┬──
///     ·   ╰── here
///  13 │ time_step = 0.02
///     ╰────
/// ```
pub fn picture(error: &FileError) -> Option<String> {
    let at = error.line.checked_sub(1)?;
    if !is_shown(&error.file) {
        return None;
    }
    let short = |line: &str| line.len() <= LONGEST;
    let line = error.text.lines().nth(at).filter(|line| short(line) && !line.trim().is_empty())?;
    // What spans several lines, such as a long list, is marked on its first.
    let begin = error.text.get(..error.span.start)?.rfind('\n').map_or(0, |newline| newline + 1);
    let (start, end) = (error.span.start - begin, error.span.end.saturating_sub(begin).min(line.len()));
    let from = spaced(line.get(..start)?).1;
    let width = spaced(line.get(..end.max(start))?).1 - from;

    let around: Vec<_> = error.text.lines().enumerate().skip(at.saturating_sub(1)).take(at.min(1) + 2).collect();
    let whole = around.iter().all(|(_, line)| short(line));
    let shown: Vec<_> = around.into_iter().filter(|(other, _)| whole || *other == at).collect();
    let digits = shown.last().map_or(0, |(last, _)| last + 1).to_string().len();

    let message =
        if error.key.is_empty() { error.message.clone() } else { format!("{}: {}", error.key, error.message) };
    let mut page = format!("  × {}\n", message.replace('\n', "\n  │ "));
    page += &format!(" {:digits$} ╭─[{}:{}:{}]\n", "", error.file, at + 1, line.get(..start)?.chars().count() + 1);
    for (other, text) in shown {
        page += &format!(" {:digits$} │ {}\n", other + 1, spaced(text).0);
        if other == at {
            let (left, right) = (width / 2, width.saturating_sub(width / 2 + 1));
            let mark = if width == 0 {
                "▲".to_string()
            } else {
                format!("{}┬{}", "─".repeat(left), "─".repeat(right))
            };
            page += &format!(" {:digits$} · {:from$}{mark}\n", "", "");
            page += &format!(" {:digits$} · {:indent$}╰── here\n", "", "", indent = from + left);
        }
    }
    page += &format!(" {:digits$} ╰────\n", "");
    if let Some(help) = &error.help {
        page += &format!("  help: {}\n", help.replace('\n', "\n        "));
    }
    Some(page)
}

/// A line with spaces in place of its tabs, and its width in columns.
fn spaced(line: &str) -> (String, usize) {
    let (mut text, mut width) = (String::new(), 0);
    for character in line.chars() {
        if character == '\t' {
            let wide = TAB - width % TAB;
            text.extend(std::iter::repeat_n(' ', wide));
            width += wide;
        } else {
            text.push(character);
            width += character.width().unwrap_or(0);
        }
    }
    (text, width)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An error about some part of a text.
    fn error(file: &str, text: &str, part: &str, help: Option<&str>) -> FileError {
        let start = text.find(part).unwrap();
        let line = text[..start].matches('\n').count() + 1;
        FileError {
            file: file.into(),
            line,
            column: 1,
            key: "key".into(),
            message: "is wrong".into(),
            help: help.map(Into::into),
            span: start..start + part.len(),
            text: text.into(),
        }
    }

    #[test]
    fn the_lines_around_are_shown_and_what_is_meant_is_marked() {
        let text = "a = 1\n".repeat(8) + "title = \"漢字\"\nbound = steps # é\n";
        let drawn = picture(&error("reach.toml", &text, "steps", Some("use a number"))).unwrap();
        let expected = "  × key: is wrong
    ╭─[reach.toml:10:9]
  9 │ title = \"漢字\"
 10 │ bound = steps # é
    ·         ──┬──
    ·           ╰── here
    ╰────
  help: use a number
";
        assert_eq!(drawn, expected);
    }

    #[test]
    fn marks_stand_below_what_they_mark_beside_tabs_and_wide_characters() {
        let drawn = picture(&error("a.toml", "\t\"漢字\" =\t\"字\"\n", "\"字\"", None)).unwrap();
        let marks = drawn.lines().nth(3).unwrap();
        // A tab to column 4, the key of 6 and ` =` to column 12, and a tab to column 16.
        assert_eq!(marks, format!("   · {}──┬─", " ".repeat(16)));
        let nothing = FileError { span: 3..3, ..error("a.toml", "ab cd\n", "cd", None) };
        assert!(picture(&nothing).unwrap().contains("   ·    ▲\n   ·    ╰── here\n"));
    }

    #[test]
    fn what_spans_lines_is_marked_on_its_first_and_long_neighbours_are_left_out() {
        let drawn = picture(&error("a.toml", "x = [1,\r\n2]\r\n", "[1,\r\n2]", None)).unwrap();
        assert!(drawn.contains(" 1 │ x = [1,\n   ·     ─┬─\n") && drawn.contains(" 2 │ 2]\n"), "{drawn}");
        let long = format!("# {}\nx = 1\ny = 2\n", "z".repeat(LONGEST));
        let drawn = picture(&error("a.toml", &long, "x", None)).unwrap();
        assert!(drawn.contains(" 2 │ x = 1\n") && !drawn.contains("zzz") && !drawn.contains("y = 2"), "{drawn}");
        let unshown = FileError { file: "secrets".into(), ..error("a.toml", "x = 1\n", "x", None) };
        assert_eq!(picture(&unshown), None);
    }
}
