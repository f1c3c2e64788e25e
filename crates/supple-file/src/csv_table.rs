use std::ops::Range;

use supple_text::FileError;

/// A table of comma-separated values. Empty lines and lines that begin with `#` are skipped.
pub(super) struct CsvTable<'a> {
    pub name: &'a str,
    pub text: &'a str,
    /// The names of its columns, each once.
    pub header: CsvRow,
    /// Rows with as many cells as the header.
    pub rows: Vec<CsvRow>,
}

/// A line of a table.
pub(super) struct CsvRow {
    /// Without blanks around them.
    pub cells: csv::StringRecord,
    /// The bytes of its line.
    pub span: Range<usize>,
}

impl<'a> CsvTable<'a> {
    /// Reads a table; `name` is what errors call its file.
    ///
    /// # Errors
    /// Where it is no such table, names a column twice, or a row has more or fewer cells than there are columns.
    pub fn parse(text: &'a str, name: &'a str) -> Result<Self, FileError> {
        let mut reader = csv::ReaderBuilder::new();
        reader.has_headers(false).trim(csv::Trim::All).comment(Some(b'#')).flexible(true);
        let mut rows = Vec::new();
        for record in reader.from_reader(text.as_bytes()).records() {
            let at = |position: Option<&csv::Position>| line_at(text, position.map_or(0, |at| at.byte() as usize));
            let cells = record.map_err(|error| {
                FileError::at(name, text, at(error.position()), String::new(), format!("must be CSV: {error}"))
            })?;
            let span = at(cells.position());
            rows.push(CsvRow { cells, span });
        }
        let mut rows = rows.into_iter();
        let header = rows.next().unwrap_or(CsvRow { cells: csv::StringRecord::new(), span: 0..0 });
        let table = Self { name, text, header, rows: rows.collect() };
        for (place, column) in table.header.cells.iter().enumerate() {
            if table.header.cells.iter().take(place).any(|other| other == column) {
                return Err(table.error(&table.header, format!("the column `{column}` occurs twice")));
            }
        }
        let columns = table.header.cells.len();
        if columns == 1 && table.header.cells[0].contains([';', '\t']) {
            return Err(table.error(&table.header, "columns must be separated by commas"));
        }
        match table.rows.iter().find(|row| row.cells.len() != columns) {
            Some(row) => {
                let message = format!("must have {columns} cells, as the first line; found {}", row.cells.len());
                Err(table.error(row, message))
            }
            None => Ok(table),
        }
    }

    /// An error about a row.
    pub fn error(&self, row: &CsvRow, message: impl Into<String>) -> FileError {
        FileError::at(self.name, self.text, row.span.clone(), String::new(), message)
    }

    /// The bytes of each cell of a row; those of the whole row if the cell is written differently in the file, for example
    /// in quotes.
    pub fn spans(&self, row: &CsvRow) -> Vec<Range<usize>> {
        let mut from = row.span.start;
        let span = |cell: &str| match self.text.get(from..row.span.end).and_then(|rest| rest.find(cell)) {
            Some(before) => {
                let start = from + before;
                from = start + cell.len();
                start..from
            }
            None => row.span.clone(),
        };
        row.cells.iter().map(span).collect()
    }
}

/// The first line with an entry at or after a byte.
fn line_at(text: &str, byte: usize) -> Range<usize> {
    let mut start = byte.min(text.len());
    for line in text.get(start..).unwrap_or("").split_inclusive('\n') {
        let blanks = line.len() - line.trim_start().len();
        if blanks < line.len() && !line.starts_with('#') {
            return start + blanks..start + line.trim_end().len();
        }
        start += line.len();
    }
    start..start
}
