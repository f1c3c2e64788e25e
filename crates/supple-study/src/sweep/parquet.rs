use std::path::Path;
use std::sync::Arc;

use parquet::basic::{LogicalType, Repetition, Type as Physical};
use parquet::data_type::{ByteArray, ByteArrayType, DoubleType};
use parquet::errors::ParquetError;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::Type;

use super::columns::Holds;
use crate::{Cell, StudyError, Table, write_text};

/// The table with types of columns.
pub const TABLE_PARQUET: &str = "table.parquet";

/// Rows that are stored together.
const GROUP: usize = 1 << 20;

/// Writes a sweep's table: a column of doubles or of texts (UTF-8) for each of its own; what is missing is null.
///
/// # Errors
/// Where the file cannot be written.
pub(super) fn save(table: &Table, folder: &Path) -> Result<(), StudyError> {
    let path = folder.join(TABLE_PARQUET);
    let bytes = bytes(table).map_err(|error| StudyError::io(&path, std::io::Error::other(error)))?;
    write_text(&path, &bytes)
}

fn bytes(table: &Table) -> Result<Vec<u8>, ParquetError> {
    let field = |column: &crate::Column| {
        let builder = match Holds::of(column) == Holds::Texts {
            true => Type::primitive_type_builder(&column.name, Physical::BYTE_ARRAY)
                .with_logical_type(Some(LogicalType::String)),
            false => Type::primitive_type_builder(&column.name, Physical::DOUBLE),
        };
        Ok(Arc::new(builder.with_repetition(Repetition::OPTIONAL).build()?))
    };
    let fields = table.columns.iter().map(field).collect::<Result<_, ParquetError>>()?;
    let schema = Arc::new(Type::group_type_builder("sweep").with_fields(fields).build()?);
    let mut writer = SerializedFileWriter::new(Vec::new(), schema, Arc::new(WriterProperties::builder().build()))?;
    for rows in table.rows.chunks(GROUP) {
        let mut group = writer.next_row_group()?;
        for (index, column) in table.columns.iter().enumerate() {
            let Some(mut out) = group.next_column()? else { break };
            if Holds::of(column) == Holds::Texts {
                let texts: Vec<Option<ByteArray>> = rows.iter().map(|row| text(&row[index])).collect();
                let (values, levels) = parts(texts);
                out.typed::<ByteArrayType>().write_batch(&values, Some(&levels), None)?;
            } else {
                let (values, levels) = parts(rows.iter().map(|row| number(&row[index])).collect());
                out.typed::<DoubleType>().write_batch(&values, Some(&levels), None)?;
            }
            out.close()?;
        }
        group.close()?;
    }
    writer.into_inner()
}

/// The values that are there, and for each entry whether it is.
fn parts<T>(entries: Vec<Option<T>>) -> (Vec<T>, Vec<i16>) {
    let levels = entries.iter().map(|entry| i16::from(entry.is_some())).collect();
    (entries.into_iter().flatten().collect(), levels)
}

fn text(cell: &Cell) -> Option<ByteArray> {
    match cell {
        Cell::Text(text) => Some(ByteArray::from(text.as_str())),
        _ => None,
    }
}

fn number(cell: &Cell) -> Option<f64> {
    match cell {
        Cell::Number(number) => Some(*number),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use parquet::file::reader::{FileReader, SerializedFileReader};
    use parquet::record::Field;

    use super::*;
    use crate::sweep::tests::{RUNNING, options, task};

    #[test]
    fn parquet_holds_the_table_with_types() {
        let task = task();
        let sweep = crate::sweep::run(&task, &options(&task, &["k1=50,60", "k2=100:600:3"]), None, RUNNING).unwrap();
        let mut table = sweep.table;
        let error = table.column("error").unwrap();
        table.rows[4][error] = Cell::Text("broken".into());
        table.rows[4][table.columns.len() - 2] = Cell::Missing;
        let folder = tempfile::tempdir().unwrap();
        save(&table, folder.path()).unwrap();
        let file = std::fs::File::open(folder.path().join(TABLE_PARQUET)).unwrap();
        let reader = SerializedFileReader::new(file).unwrap();
        let rows: Vec<_> = reader.get_row_iter(None).unwrap().map(Result::unwrap).collect();
        assert_eq!(rows.len(), 6);
        for (row, expected) in rows.iter().zip(&table.rows) {
            for ((name, field), (column, cell)) in row.get_column_iter().zip(table.columns.iter().zip(expected)) {
                assert_eq!(*name, column.name);
                let found = match field {
                    Field::Double(number) => Cell::Number(*number),
                    Field::Str(text) => Cell::Text(text.clone()),
                    Field::Null => Cell::Missing,
                    other => panic!("{name} is {other:?}"),
                };
                assert_eq!(found, *cell, "{name}");
            }
        }
        let types = reader.metadata().file_metadata().schema_descr_ptr();
        let types: Vec<Physical> = types.columns().iter().map(|column| column.physical_type()).collect();
        let texts: Vec<&str> =
            (0..types.len()).filter(|&i| types[i] == Physical::BYTE_ARRAY).map(|i| &*table.columns[i].name).collect();
        assert_eq!(texts, ["press.status", "error"]);
    }
}
