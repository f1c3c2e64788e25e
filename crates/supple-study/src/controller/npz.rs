//! Arrays as `numpy.load` reads them: an archive of one `.npy` file each, little-endian, row by row.

use std::io::{Cursor, Write};
use std::path::Path;

use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

use super::file::ControllerFile;
use crate::StudyError;

/// One array in the making.
struct Array {
    shape: Vec<usize>,
    entries: Entries,
}

enum Entries {
    Whole(Vec<i64>),
    Numbers(Vec<f64>),
    Texts(Vec<String>),
}

/// All of a controller, one array per key of its JSON; parameters are `parameter_names` and `parameter_values`.
pub fn bytes(file: &ControllerFile, path: &Path) -> Result<Vec<u8>, StudyError> {
    let mut archive = ZipWriter::new(Cursor::new(Vec::new()));
    let stored = SimpleFileOptions::default().compression_method(CompressionMethod::Stored);
    let failed = |error: zip::result::ZipError| StudyError::io(path, error.into());
    for (name, array) in arrays(file) {
        archive.start_file(format!("{name}.npy"), stored).map_err(failed)?;
        archive.write_all(&array.npy()).map_err(|error| StudyError::io(path, error))?;
    }
    Ok(archive.finish().map_err(failed)?.into_inner())
}

fn arrays(file: &ControllerFile) -> Vec<(&'static str, Array)> {
    let text = |text: &str| Array { shape: vec![], entries: Entries::Texts(vec![text.to_owned()]) };
    let whole = |number: i64| Array { shape: vec![], entries: Entries::Whole(vec![number]) };
    let texts = |list: &[String]| Array { shape: vec![list.len()], entries: Entries::Texts(list.to_vec()) };
    let numbers = |list: &[f64]| Array { shape: vec![list.len()], entries: Entries::Numbers(list.to_vec()) };
    let (n, m, p) = (file.state_names.len(), file.control_names.len(), file.measurement_names.len());
    let matrix = |rows: &[Vec<f64>], cols: usize| Array {
        shape: vec![rows.len(), cols],
        entries: Entries::Numbers(rows.concat()),
    };
    let matrices = |list: &[Vec<Vec<f64>>], (rows, cols): (usize, usize)| Array {
        shape: vec![list.len(), rows, cols],
        entries: Entries::Numbers(list.iter().flatten().flatten().copied().collect()),
    };
    let (parameter_names, parameter_values): (Vec<String>, Vec<f64>) = file.parameters.0.iter().cloned().unzip();
    vec![
        ("format", text(file.format)),
        ("version", whole(i64::from(file.version))),
        ("supple", text(file.supple)),
        ("task", text(&file.task)),
        ("status", text(&file.status.to_string())),
        ("parameter_names", texts(&parameter_names)),
        ("parameter_values", numbers(&parameter_values)),
        ("time_step", Array { shape: vec![], entries: Entries::Numbers(vec![file.time_step]) }),
        ("steps", whole(file.steps as i64)),
        ("time", numbers(&file.time)),
        ("state_names", texts(&file.state_names)),
        ("state_units", texts(&file.state_units)),
        ("control_names", texts(&file.control_names)),
        ("control_units", texts(&file.control_units)),
        ("measurement_names", texts(&file.measurement_names)),
        ("measurement_units", texts(&file.measurement_units)),
        ("states", matrix(&file.states, n)),
        ("controls", matrix(&file.controls, m)),
        ("expected_measurements", matrix(&file.expected_measurements, p)),
        ("feedforward", matrix(&file.feedforward, m)),
        ("feedback", matrices(&file.feedback, (m, n))),
        ("filter_gain", matrices(&file.filter_gain, (n, p))),
        ("dynamics", matrices(&file.dynamics, (n, n))),
        ("input", matrices(&file.input, (n, m))),
        ("measurement", matrices(&file.measurement, (p, n))),
        ("initial_covariance", matrix(&file.initial_covariance, n)),
        ("process_covariance", matrices(&file.process_covariance, (n, n))),
        ("measurement_covariance", matrices(&file.measurement_covariance, (p, p))),
        ("predicted_covariance", matrices(&file.predicted_covariance, (n, n))),
        ("belief_covariance", matrices(&file.belief_covariance, (n, n))),
        ("control_lower", numbers(&file.control_lower)),
        ("control_upper", numbers(&file.control_upper)),
    ]
}

impl Array {
    /// The bytes of its `.npy` file, version 1.0 of the format.
    fn npy(&self) -> Vec<u8> {
        let longest = match &self.entries {
            Entries::Texts(texts) => texts.iter().map(|text| text.chars().count()).max().unwrap_or(0).max(1),
            _ => 0,
        };
        let kind = match &self.entries {
            Entries::Whole(_) => "<i8".to_owned(),
            Entries::Numbers(_) => "<f8".to_owned(),
            Entries::Texts(_) => format!("<U{longest}"),
        };
        let shape: String = self.shape.iter().map(|length| format!("{length}, ")).collect();
        let mut header = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': ({}), }}", shape.trim_end());
        // The numbers begin at a multiple of 64 bytes: after 10 bytes, the header, blanks and a line's end.
        header.extend(std::iter::repeat_n(' ', 63 - (10 + header.len()) % 64));
        header.push('\n');
        let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
        bytes.extend((header.len() as u16).to_le_bytes());
        bytes.extend(header.as_bytes());
        match &self.entries {
            Entries::Whole(list) => bytes.extend(list.iter().flat_map(|number| number.to_le_bytes())),
            Entries::Numbers(list) => bytes.extend(list.iter().flat_map(|number| number.to_le_bytes())),
            Entries::Texts(list) => {
                for text in list {
                    let letters = text.chars().map(u32::from).chain(std::iter::repeat(0)).take(longest);
                    bytes.extend(letters.flat_map(u32::to_le_bytes));
                }
            }
        }
        bytes
    }
}
