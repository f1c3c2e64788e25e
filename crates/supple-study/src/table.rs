use std::fmt::Write;
use std::path::Path;

use serde::de::{MapAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize};
use supple::file::read_text;

use crate::StudyError;

/// A column of a table.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Column {
    /// Its name, such as `k1`, `information_nats`, `press.expected_cost`.
    pub name: String,
    /// Its unit; empty where it has none.
    pub unit: String,
    /// What it is, for people.
    pub description: String,
}

/// An entry of a table.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Cell {
    /// A number.
    Number(f64),
    /// A text.
    Text(String),
    /// Nothing, as where a design could not be evaluated.
    Missing,
}

impl Cell {
    /// A number, or nothing where it is not finite, which neither CSV nor JSON can tell.
    pub fn number(number: f64) -> Self {
        if number.is_finite() { Self::Number(number) } else { Self::Missing }
    }

    /// The entry as CSV has it, before quotes: nothing is empty.
    fn to_csv(&self) -> String {
        match self {
            Self::Number(number) if number.is_finite() => number_text(*number),
            Self::Text(text) => text.clone(),
            _ => String::new(),
        }
    }

    /// The entry as JSON has it: nothing is `null`.
    fn to_json(&self) -> String {
        match self {
            Self::Number(number) if number.is_finite() => number_text(*number),
            Self::Text(text) => quoted(text),
            _ => "null".to_owned(),
        }
    }
}

/// The shortest text from which the same number is read; whole numbers without a point.
fn number_text(number: f64) -> String {
    let mut text = format!("{number:?}");
    if text.ends_with(".0") {
        text.truncate(text.len() - 2);
    }
    text
}

/// A text as a JSON string.
fn quoted(text: &str) -> String {
    serde_json::Value::from(text).to_string()
}

/// Rows under named columns.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Table {
    /// The columns.
    pub columns: Vec<Column>,
    /// The rows, each with one entry by column.
    pub rows: Vec<Vec<Cell>>,
}

impl Table {
    /// The index of a column.
    pub fn column(&self, name: &str) -> Option<usize> {
        self.columns.iter().position(|column| column.name == name)
    }

    /// The numbers of a column, NaN where there is none; none where there is no such column.
    pub fn numbers(&self, name: &str) -> Option<Vec<f64>> {
        let column = self.column(name)?;
        let number = |row: &Vec<Cell>| match row[column] {
            Cell::Number(number) => number,
            _ => f64::NAN,
        };
        Some(self.rows.iter().map(number).collect())
    }

    /// The table as CSV (RFC 4180): names of columns, then rows; what is missing is empty.
    pub fn to_csv(&self) -> String {
        let mut writer = csv::Writer::from_writer(Vec::new());
        // Writing to memory cannot fail, and rows of another length than the first one are written as they are.
        let names: Vec<&str> = self.columns.iter().map(|column| &*column.name).collect();
        let _ = writer.write_record(&names);
        for row in &self.rows {
            let _ = writer.write_record(row.iter().map(Cell::to_csv));
        }
        String::from_utf8(writer.into_inner().unwrap_or_default()).unwrap_or_default()
    }

    /// A row as one line of JSON, an object with the columns in their order; without a line break.
    pub fn json_line(&self, row: &[Cell]) -> String {
        let mut line = String::from("{");
        for (index, (column, cell)) in self.columns.iter().zip(row).enumerate() {
            let comma = if index > 0 { "," } else { "" };
            let _ = write!(line, "{comma}{}:{}", quoted(&column.name), cell.to_json());
        }
        line + "}"
    }

    /// The table as lines of JSON, one object by row.
    pub fn to_jsonl(&self) -> String {
        let mut text = String::new();
        for row in &self.rows {
            text += &self.json_line(row);
            text.push('\n');
        }
        text
    }

    /// Reads rows of these columns from lines of JSON.
    ///
    /// # Errors
    /// Where the file cannot be read, or a line is no object with these columns in their order.
    pub fn read_jsonl(columns: &[Column], path: &Path) -> Result<Self, StudyError> {
        let text = read_text(path)?;
        let row = |(index, line): (usize, &str)| {
            let damaged = |what: String| {
                StudyError::kept(path, format!("line {}: {what}: it is damaged; make the result again", index + 1))
            };
            let Pairs(pairs) = serde_json::from_str(line).map_err(|error| damaged(error.to_string()))?;
            if !pairs.iter().map(|(name, _)| name).eq(columns.iter().map(|column| &column.name)) {
                return Err(damaged("its names are not those of the columns".to_owned()));
            }
            Ok(pairs.into_iter().map(|(_, cell)| cell).collect())
        };
        let rows = text.lines().enumerate().map(row).collect::<Result<_, _>>()?;
        Ok(Self { columns: columns.to_vec(), rows })
    }
}

/// Entries by name, in their order.
struct Pairs(Vec<(String, Cell)>);

impl<'de> Deserialize<'de> for Pairs {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Entries;
        impl<'de> Visitor<'de> for Entries {
            type Value = Pairs;

            fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
                f.write_str("entries by name")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Pairs, A::Error> {
                let mut pairs = Vec::new();
                while let Some(pair) = map.next_entry()? {
                    pairs.push(pair);
                }
                Ok(Pairs(pairs))
            }
        }
        deserializer.deserialize_map(Entries)
    }
}
