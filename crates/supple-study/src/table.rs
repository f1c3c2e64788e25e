use serde::{Deserialize, Serialize};

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
}
