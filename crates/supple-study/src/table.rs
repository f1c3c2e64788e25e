use std::fmt::Write;
use std::path::Path;

use serde::de::{MapAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize};
use supple_file::read_text;
use supple_text::{exact, plain};

use crate::StudyError;

/// A column of a table.
///
/// Example: [`Table`].
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
///
/// Example: [`Table`].
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
    #[must_use]
    pub fn number(number: f64) -> Self {
        if number.is_finite() { Self::Number(number) } else { Self::Missing }
    }

    /// The entry as CSV has it, before quotes: nothing is empty.
    fn to_csv(&self) -> String {
        match self {
            Self::Number(number) if number.is_finite() => exact(*number),
            Self::Text(text) => no_formula(text),
            _ => String::new(),
        }
    }

    /// The entry as JSON has it: nothing is `null`.
    fn to_json(&self) -> String {
        match self {
            Self::Number(number) if number.is_finite() => exact(*number),
            Self::Text(text) => quoted(text),
            _ => "null".to_owned(),
        }
    }
}

/// A text that spreadsheets do not evaluate and terminals do not execute: an apostrophe before any formula, and no
/// control characters.
fn no_formula(text: &str) -> String {
    let text = plain(text);
    if text.starts_with(['=', '+', '-', '@', '\t']) { format!("'{text}") } else { text.into_owned() }
}

/// A text as a JSON string.
fn quoted(text: &str) -> String {
    serde_json::Value::from(text).to_string()
}

/// Rows under named columns.
///
/// ```
/// use supple_study::{Cell, Column, Table};
///
/// let column = |name: &str, unit: &str| Column { name: name.into(), unit: unit.into(), description: String::new() };
/// let columns = vec![column("k1", "N/m"), column("error", "")];
/// let table = Table { columns, rows: vec![vec![Cell::number(300.0), Cell::Missing]] };
/// assert_eq!(table.numbers("k1"), Some(vec![300.0]));
/// assert_eq!(table.to_csv().lines().next(), Some("k1,error"));
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Table {
    /// The columns.
    pub columns: Vec<Column>,
    /// The rows, each with one entry by column.
    pub rows: Vec<Vec<Cell>>,
}

impl Table {
    /// The index of a column.
    #[must_use]
    pub fn column(&self, name: &str) -> Option<usize> {
        self.columns.iter().position(|column| column.name == name)
    }

    /// The numbers of a column, NaN for missing ones; `None` if there is no such column.
    #[must_use]
    pub fn numbers(&self, name: &str) -> Option<Vec<f64>> {
        let column = self.column(name)?;
        let number = |row: &Vec<Cell>| match row[column] {
            Cell::Number(number) => number,
            _ => f64::NAN,
        };
        Some(self.rows.iter().map(number).collect())
    }

    /// The table as CSV (RFC 4180): names of columns, then rows; what is missing is empty. Before texts that
    /// spreadsheets would evaluate because they begin with `=`, `+`, `-` or `@`, an apostrophe is inserted.
    pub fn to_csv(&self) -> String {
        let mut writer = csv::Writer::from_writer(Vec::new());
        // Writing to memory cannot fail; rows of a deviating length are written as they are.
        let names: Vec<String> = self.columns.iter().map(|column| no_formula(&column.name)).collect();
        let _ = writer.write_record(&names);
        for row in &self.rows {
            let _ = writer.write_record(row.iter().map(Cell::to_csv));
        }
        String::from_utf8(writer.into_inner().unwrap_or_default()).unwrap_or_default()
    }

    /// A row as one line of JSON, an object with the columns in their order; without a line break.
    #[must_use]
    pub fn json_line(&self, row: &[Cell]) -> String {
        let mut line = String::from("{");
        for (index, (column, cell)) in self.columns.iter().zip(row).enumerate() {
            let comma = if index > 0 { "," } else { "" };
            let _ = write!(line, "{comma}{}:{}", quoted(&column.name), cell.to_json());
        }
        line + "}"
    }

    /// The table as lines of JSON, one object by row.
    #[must_use]
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
                StudyError::kept(path, format!("line {}: {what}: it is damaged; recompute the result", index + 1))
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

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use proptest::prelude::*;

    use super::*;

    fn cell() -> impl Strategy<Value = Cell> {
        prop_oneof![
            any::<f64>().prop_map(Cell::number),
            any::<u64>().prop_map(|bits| Cell::number(f64::from_bits(bits))),
            any::<i32>().prop_map(|number| Cell::Number(number.into())),
            any::<String>().prop_map(Cell::Text),
            prop::sample::select(&["", "null", "1e5", "a,b", "\"", "x\ny", "\r\n", "{}", "\u{feff}"][..])
                .prop_map(|text| Cell::Text(text.into())),
            Just(Cell::Missing),
        ]
    }

    fn tables() -> impl Strategy<Value = Table> {
        (1usize..6).prop_flat_map(|count| {
            let rows = prop::collection::vec(prop::collection::vec(cell(), count), 0..8);
            let names = prop::collection::vec(any::<String>(), count);
            (names, rows).prop_map(|(names, rows)| {
                let column = |(index, name)| Column {
                    name: format!("{name}{index}"),
                    unit: String::new(),
                    description: String::new(),
                };
                Table { columns: names.into_iter().enumerate().map(column).collect(), rows }
            })
        })
    }

    /// Bitwise equality, which distinguishes -0 from 0.
    fn bits(table: &Table) -> Vec<Vec<Result<u64, &Cell>>> {
        fn of(cell: &Cell) -> Result<u64, &Cell> {
            if let Cell::Number(number) = cell { Ok(number.to_bits()) } else { Err(cell) }
        }
        table.rows.iter().map(|row| row.iter().map(of).collect()).collect()
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn lines_of_json_come_back(table in tables()) {
            let folder = tempfile::tempdir().unwrap();
            let path = folder.path().join("table.jsonl");
            std::fs::write(&path, table.to_jsonl()).unwrap();
            let read = Table::read_jsonl(&table.columns, &path).unwrap();
            prop_assert_eq!(bits(&read), bits(&table));
            for (line, row) in table.to_jsonl().lines().zip(&table.rows) {
                let object: serde_json::Value = serde_json::from_str(line).unwrap();
                prop_assert_eq!(object.as_object().unwrap().len(), row.len());
            }
        }

        #[test]
        fn csv_comes_back(table in tables()) {
            let text = table.to_csv();
            let mut reader = csv::ReaderBuilder::new().from_reader(text.as_bytes());
            let names: Vec<String> = reader.headers().unwrap().iter().map(str::to_owned).collect();
            prop_assert!(names.into_iter().eq(table.columns.iter().map(|column| no_formula(&column.name))));
            let records: Vec<csv::StringRecord> = reader.records().collect::<Result<_, _>>().unwrap();
            prop_assert_eq!(records.len(), table.rows.len());
            for (record, row) in records.iter().zip(&table.rows) {
                for (field, cell) in record.iter().zip(row) {
                    match cell {
                        Cell::Number(number) => prop_assert_eq!(field.parse::<f64>().unwrap().to_bits(), number.to_bits()),
                        Cell::Text(text) => prop_assert_eq!(field, no_formula(text)),
                        Cell::Missing => prop_assert_eq!(field, ""),
                    }
                }
            }
        }
    }

    #[test]
    fn csv_holds_no_formula_of_spreadsheets() {
        let column = Column { name: "=HYPERLINK(\"x\")".into(), unit: String::new(), description: String::new() };
        let rows = vec![vec![Cell::Text("@SUM(A1)".into())], vec![Cell::Number(-1.5)]];
        let text = Table { columns: vec![column], rows }.to_csv();
        assert_eq!(text, "\"'=HYPERLINK(\"\"x\"\")\"\n'@SUM(A1)\n-1.5\n");
    }

    #[test]
    fn numbers_that_are_not_finite_are_missing() {
        assert_eq!([f64::NAN, f64::INFINITY].map(Cell::number), [Cell::Missing, Cell::Missing]);
    }
}
