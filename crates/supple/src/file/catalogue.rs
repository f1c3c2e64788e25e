use std::ops::Range;
use std::path::{Path, PathBuf};

use serde::Deserialize;
use serde::de::{self, Deserializer, MapAccess, SeqAccess, Visitor};
use supple_files::{FileError, nearest, read_text};

use super::document::{Document, Place};
use crate::parameters::{CatalogueEntry, Parameter};

/// Entries that a catalogue has at most.
const MOST_ENTRIES: usize = 10_000;

/// Values of a parameter that can be had.
#[derive(Debug)]
pub(super) enum CatalogueFile {
    /// As they are.
    Entries(Vec<CatalogueEntry>),
    /// A CSV file with the columns value, and where there are any, name and price.
    Csv(String),
}

impl CatalogueFile {
    /// Puts the entries into a parameter, in their order; a file that they come from is added to `files`.
    ///
    /// # Errors
    /// What is wrong with an entry, with the line that it is in.
    pub fn read_into(
        self,
        parameter: &mut Parameter,
        (document, at): (&Document, &[Place]),
        (folder, files): (&Path, &mut Vec<PathBuf>),
    ) -> Result<(), FileError> {
        let count = match self {
            Self::Entries(entries) => {
                parameter.catalogue = entries;
                if let Some((index, message)) = parameter.wrong_entry() {
                    let at: Vec<Place> = at.iter().copied().chain([index.into()]).collect();
                    return Err(document.error(&at, message));
                }
                parameter.catalogue.len()
            }
            Self::Csv(name) => {
                let path = folder.join(&name);
                let text = read_text(&path).map_err(|error| document.error_of_file(at, error))?;
                let table = CsvText { name: &path.display().to_string(), text: &text };
                let (entries, lines) = table.entries()?;
                parameter.catalogue = entries;
                if let Some((index, message)) = parameter.wrong_entry() {
                    return Err(table.error(lines[index].clone(), message));
                }
                files.push(path);
                parameter.catalogue.len()
            }
        };
        if !(1..=MOST_ENTRIES).contains(&count) {
            return Err(document.error(at, format!("must have from 1 to {MOST_ENTRIES} entries; found {count}")));
        }
        Ok(())
    }
}

/// The text of a CSV file.
struct CsvText<'a> {
    name: &'a str,
    text: &'a str,
}

impl CsvText<'_> {
    fn error(&self, span: Range<usize>, message: impl Into<String>) -> FileError {
        FileError::at(self.name, self.text, span, String::new(), message)
    }

    /// The entries, each with the bytes of its line.
    fn entries(&self) -> Result<(Vec<CatalogueEntry>, Vec<Range<usize>>), FileError> {
        let mut reader = csv::ReaderBuilder::new();
        let mut reader =
            reader.trim(csv::Trim::All).comment(Some(b'#')).flexible(true).from_reader(self.text.as_bytes());
        let header = reader.headers().map_err(|error| self.csv_error(&error))?.clone();
        let start = header.position().map_or(0, |position| position.byte() as usize);
        const COLUMNS: [&str; 3] = ["value", "name", "price"];
        for (place, column) in header.iter().enumerate() {
            let again = header.iter().take(place).any(|other| other == column);
            if again || !COLUMNS.contains(&column) {
                let what = if again { "is there twice" } else { "is none of `value`, `name`, `price`" };
                let help = nearest(column, &COLUMNS).filter(|_| !again);
                let error = self.error(self.line_at(start), format!("the column `{column}` {what}"));
                return Err(FileError { help, ..error });
            }
        }
        let column = |name: &str| header.iter().position(|column| column == name);
        let Some(value) = column("value") else {
            let message =
                "a catalogue begins with the names of its columns: `value`, and where there are any `name`, `price`";
            return Err(self.error(self.line_at(start), message));
        };
        let (name, price) = (column("name"), column("price"));
        let (mut entries, mut lines) = (Vec::new(), Vec::new());
        for record in reader.records() {
            let record = record.map_err(|error| self.csv_error(&error))?;
            let line = self.line_at(record.position().map_or(0, |position| position.byte() as usize));
            if record.len() != header.len() {
                let message = format!("must have {} columns, as the first line; found {}", header.len(), record.len());
                return Err(self.error(line, message));
            }
            let number = |column: usize, what: &str| {
                let text = &record[column];
                let wrong = || self.error(line.clone(), format!("{what} must be a finite number; found `{text}`"));
                text.parse::<f64>().ok().filter(|number| number.is_finite()).ok_or_else(wrong)
            };
            entries.push(CatalogueEntry {
                value: number(value, "`value`")?,
                price: price.filter(|&column| !record[column].is_empty()).map(|c| number(c, "`price`")).transpose()?,
                name: name.map(|column| record[column].to_owned()).filter(|name| !name.is_empty()),
            });
            lines.push(line);
            if entries.len() > MOST_ENTRIES {
                break;
            }
        }
        Ok((entries, lines))
    }

    /// The line that the byte is in, or the next one that has text.
    fn line_at(&self, byte: usize) -> Range<usize> {
        let rest = self.text.get(byte..).unwrap_or("");
        let skipped = rest.len() - rest.trim_start().len();
        let start = (byte + skipped).min(self.text.len());
        let length = self.text[start..].find('\n').unwrap_or(self.text.len() - start);
        start..start + length
    }

    fn csv_error(&self, error: &csv::Error) -> FileError {
        let byte = error.position().map_or(0, |position| position.byte() as usize);
        self.error(self.line_at(byte), format!("must be CSV: {error}"))
    }
}

impl<'de> Deserialize<'de> for CatalogueFile {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Entries;

        impl<'de> Visitor<'de> for Entries {
            type Value = CatalogueFile;

            fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
                f.write_str(
                    "a list of values, a list of tables with `value`, `price` and `name`, or the name of a CSV file",
                )
            }
            fn visit_str<E: de::Error>(self, name: &str) -> Result<CatalogueFile, E> {
                Ok(CatalogueFile::Csv(name.to_owned()))
            }
            fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<CatalogueFile, A::Error> {
                let mut entries = Vec::new();
                while let Some(Entry(entry)) = list.next_element()? {
                    entries.push(entry);
                }
                Ok(CatalogueFile::Entries(entries))
            }
        }

        deserializer.deserialize_any(Entries)
    }
}

/// A value, or a table with it.
struct Entry(CatalogueEntry);

impl<'de> Deserialize<'de> for Entry {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Either;

        impl<'de> Visitor<'de> for Either {
            type Value = Entry;

            fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
                f.write_str("a number, or a table with `value`, and where there are any `price` and `name`")
            }
            fn visit_f64<E: de::Error>(self, value: f64) -> Result<Entry, E> {
                match value.is_finite() {
                    true => Ok(Entry(CatalogueEntry { value, ..CatalogueEntry::default() })),
                    false => Err(E::custom(format!("must be a finite number; found {value}"))),
                }
            }
            fn visit_i64<E: de::Error>(self, value: i64) -> Result<Entry, E> {
                self.visit_f64(value as f64)
            }
            fn visit_u64<E: de::Error>(self, value: u64) -> Result<Entry, E> {
                self.visit_f64(value as f64)
            }
            fn visit_map<A: MapAccess<'de>>(self, table: A) -> Result<Entry, A::Error> {
                CatalogueEntry::deserialize(de::value::MapAccessDeserializer::new(table)).map(Entry)
            }
        }

        deserializer.deserialize_any(Either)
    }
}

impl schemars::JsonSchema for CatalogueFile {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Catalogue".into()
    }
    fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
        schemars::json_schema!({
            "description": "Values that can be had: numbers, or tables with prices and names; or the name of a CSV file \
                            with the columns value, name and price",
            "anyOf": [
                {
                    "type": "array",
                    "minItems": 1,
                    "items": {
                        "anyOf": [
                            { "type": "number" },
                            {
                                "type": "object",
                                "additionalProperties": false,
                                "required": ["value"],
                                "properties": {
                                    "value": { "type": "number", "description": "The value" },
                                    "price": { "type": "number", "minimum": 0, "description": "What it costs to buy" },
                                    "name": { "type": "string", "description": "What its maker calls it" }
                                }
                            }
                        ]
                    }
                },
                { "type": "string", "minLength": 1 }
            ]
        })
    }
}
