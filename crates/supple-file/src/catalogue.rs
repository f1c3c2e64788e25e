use std::path::{Path, PathBuf};

use serde::Deserialize;
use serde::de::{self, Deserializer, MapAccess, SeqAccess, Visitor};
use supple_model::document::{Place, Spot};
use supple_model::parameters::{CatalogueEntry, Parameter};
use supple_text::{FileError, nearest};

use crate::csv_table::{CsvRow, CsvTable};

/// Entries that a catalogue has at most.
const MOST_ENTRIES: usize = 10_000;

/// Available values of a parameter.
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
        Spot { document, at }: Spot,
        folder: &Path,
        files: &mut Vec<PathBuf>,
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
                let text = document.files().read(&path).map_err(|error| document.error_of_file(at, error))?;
                let name = path.display().to_string();
                let table = CsvTable::parse(&text, &name)?;
                parameter.catalogue = entries(&table)?;
                if let Some((index, message)) = parameter.wrong_entry() {
                    return Err(table.error(&table.rows[index], message));
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

/// The entries of a table, one on each row.
fn entries(table: &CsvTable) -> Result<Vec<CatalogueEntry>, FileError> {
    const COLUMNS: [&str; 3] = ["value", "name", "price"];
    let header = &table.header.cells;
    if let Some(column) = header.iter().find(|column| !COLUMNS.contains(column)) {
        let message = format!("unknown column `{column}`; valid: `value`, `name`, `price`");
        return Err(FileError { help: nearest(column, &COLUMNS), ..table.error(&table.header, message) });
    }
    let [value, name, price] = COLUMNS.map(|name| header.iter().position(|column| column == name));
    let Some(value) = value else {
        let message = "the first line of a catalogue must name its columns: `value`, and optionally `name` and `price`";
        return Err(table.error(&table.header, message));
    };
    let entry = |row: &CsvRow| {
        let number = |column: usize| {
            let text = &row.cells[column];
            let what = &header[column];
            let wrong = || table.error(row, format!("`{what}` must be a finite number; found `{text}`"));
            text.parse::<f64>().ok().filter(|number| number.is_finite()).ok_or_else(wrong)
        };
        let told = |column: &usize| !row.cells[*column].is_empty();
        Ok(CatalogueEntry {
            value: number(value)?,
            price: price.filter(told).map(number).transpose()?,
            name: name.filter(told).map(|column| row.cells[column].to_owned()),
        })
    };
    table.rows.iter().map(entry).collect()
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
                f.write_str("a number, or a table with `value` and optionally `price` and `name`")
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
            "description": "Available stock values: numbers, or tables with price and name; or the name of a CSV file with the columns value, name and price",
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
                                    "price": { "type": "number", "minimum": 0, "description": "Purchase price" },
                                    "name": { "type": "string", "description": "Manufacturer's name" }
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
