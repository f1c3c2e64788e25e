//! TOML as documents whose errors name file, line and key.

use std::borrow::Cow;

use supple_model::document::{Content, Document, Spanned, Table};
use supple_text::FileError;
use toml::de::{DeTable, DeValue};

/// Parses TOML; `name` stands for the file in errors.
///
/// # Errors
/// Where it is not TOML.
pub fn parse_document<'a>(text: &'a str, name: &'a str) -> Result<Document<'a>, FileError> {
    match DeTable::parse(text) {
        Ok(root) => Ok(Document::new(name, text, table(root.into_inner()))),
        Err(error) => {
            let span = error.span().unwrap_or(0..0);
            match (error.message().trim(), text.get(span.clone())) {
                ("duplicate key", Some(key)) => {
                    let message = format!("`{key}` is defined twice");
                    Err(FileError::at(name, text, span, key.to_owned(), message))
                }
                (message, _) => Err(FileError::at(name, text, span, String::new(), message)),
            }
        }
    }
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
