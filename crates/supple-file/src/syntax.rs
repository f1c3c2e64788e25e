//! TOML as documents whose errors name file, line and key.

use std::borrow::Cow;
use std::ops::Range;

use supple_model::document::{Content, Document, Spanned, Table};
use supple_text::FileError;
use toml::de::{DeTable, DeValue};

/// Parses TOML; `name` stands for the file in errors.
///
/// # Errors
/// Where it is not TOML.
///
/// ```
/// let document = supple_file::parse_document("steps = 20", "note.toml")?;
/// assert_eq!(document.read::<usize>(&["steps".into()])?, 20);
/// assert!(document.read::<f64>(&["time".into()]).is_err());
/// # Ok::<(), supple_file::FileError>(())
/// ```
pub fn parse_document<'a>(text: &'a str, name: &'a str) -> Result<Document<'a>, FileError> {
    if text.trim_start().starts_with('<') {
        let help =
            "`supple new NAME --robot FILE` writes a task file for a robot file, and `supple robot FILE` shows it";
        return Err(
            FileError::at(name, text, 0..1, String::new(), "is XML, and no TOML file of a task").with_help(help)
        );
    }
    match DeTable::parse(text) {
        Ok(root) => Ok(Document::new(name, text, table(root.into_inner()))),
        Err(error) => {
            let span = error.span().unwrap_or(0..0);
            if let Some(number) = without_zero(text, span.start) {
                let message = format!("numbers begin with a digit: write `0{number}` in place of `{number}`");
                return Err(FileError::at(
                    name,
                    text,
                    span.start..span.start + number.len(),
                    number.to_owned(),
                    message,
                ));
            }
            match (error.message().trim(), text.get(span.clone())) {
                ("duplicate key", Some(key)) => {
                    let message = format!("`{key}` is defined twice");
                    Err(FileError::at(name, text, span, key.to_owned(), message))
                }
                (message, _) => Err(match with_unit(text, span.start) {
                    Some((place, number, unit)) => {
                        let message = format!(
                            "numbers have no units: write `{number}` in SI units and radians, without `{unit}`"
                        );
                        FileError::at(name, text, place, String::new(), message)
                    }
                    None => FileError::at(name, text, span, String::new(), message),
                }),
            }
        }
    }
}

/// The number at `at` where it begins with its decimal point, such as `.2`.
fn without_zero(text: &str, at: usize) -> Option<&str> {
    let number = text.get(at..)?;
    let digits = number.strip_prefix('.')?.bytes().take_while(u8::is_ascii_digit).count();
    (digits > 0).then(|| &number[..=digits])
}

/// The value of the line at `at` where it is a number with a unit, such as `0.5 ms`: its place, the number and the unit.
fn with_unit(text: &str, at: usize) -> Option<(Range<usize>, &str, &str)> {
    let start = text.get(..at)?.rfind('\n').map_or(0, |end| end + 1);
    let line = text.get(start..)?.lines().next()?;
    let (key, rest) = line.split_once('=')?;
    let value = rest.split('#').next().unwrap_or_default().trim();
    // The longest number that the value begins with; an exponent belongs to it, `e` alone begins a unit.
    let ends = (1..=value.len()).rev().filter(|&end| value.is_char_boundary(end));
    let number = ends
        .map(|end| &value[..end])
        .find(|head| head.ends_with(|last: char| last.is_ascii_digit()) && head.parse::<f64>().is_ok())?;
    let unit = value[number.len()..].trim_start();
    let based = number == "0" && unit.starts_with(['b', 'o', 'x']);
    let names_one = !based && unit.starts_with(|first: char| first.is_alphabetic() || "%°".contains(first));
    let place = start + key.len() + 1 + (rest.len() - rest.trim_start().len());
    (names_one && !unit.contains([',', ']', '}', '"'])).then(|| (place..place + value.len(), number, unit))
}

fn table<'a>(table: DeTable<'a>) -> Table<'a> {
    table.into_iter().map(|(key, value)| (spanned(key, |key| key), spanned(value, content))).collect()
}

fn content<'a>(value: DeValue<'a>) -> Content<'a> {
    match value {
        DeValue::String(text) => Content::Text(text),
        DeValue::Integer(number) => {
            Content::Whole { digits: Cow::Owned(number.as_str().to_owned()), radix: number.radix() }
        }
        DeValue::Float(number) => Content::Decimal(Cow::Owned(number.as_str().to_owned())),
        DeValue::Boolean(value) => Content::Boolean(value),
        DeValue::Datetime(_) => Content::Date,
        DeValue::Array(list) => Content::List(list.into_iter().map(|value| spanned(value, content)).collect()),
        DeValue::Table(entries) => Content::Table(table(entries)),
    }
}

fn spanned<A, B>(value: toml::Spanned<A>, into: impl FnOnce(A) -> B) -> Spanned<B> {
    let span = value.span();
    Spanned::new(span, into(value.into_inner()))
}
