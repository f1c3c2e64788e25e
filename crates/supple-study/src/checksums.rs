//! Checksums of the files of a result, as `sha256sum --check` reads them.

use std::fmt::Write;
use std::path::Path;

use sha2::{Digest, Sha256};

use crate::StudyError;
use crate::bound::CURVE_CSV;
use crate::sweep::{TABLE_CSV, TABLE_JSONL};
use crate::write::{RESULT, write_text};

/// The file with the checksums of the others.
///
/// Example: [`changed`].
pub const CHECKSUMS: &str = "checksums.sha256";

/// The files that a result is read from.
const FILES: [&str; 4] = [RESULT, TABLE_JSONL, TABLE_CSV, CURVE_CSV];

fn checksum(path: &Path) -> Option<String> {
    let bytes = std::fs::read(path).ok()?;
    let mut text = String::new();
    for byte in Sha256::digest(bytes) {
        let _ = write!(text, "{byte:02x}");
    }
    Some(text)
}

/// Writes the checksums of the files of a result that are in a folder.
///
/// # Errors
/// Where they cannot be written.
pub(crate) fn save(folder: &Path) -> Result<(), StudyError> {
    let line = |name: &&str| Some(format!("{}  {name}\n", checksum(&folder.join(name))?));
    let text: String = FILES.iter().filter_map(line).collect();
    write_text(&folder.join(CHECKSUMS), text.as_bytes())
}

/// The files of a result that are no longer those that were saved; empty if the folder has no checksums. Whoever
/// changes a file on purpose can change its checksum too: this detects corruption, not tampering.
///
/// ```
/// use supple_study::evaluate::EvaluateOptions;
/// use supple_study::study::Work;
/// use supple_study::{CHECKSUMS, Folder, LoadedTask, Made, RESULT, Source, Watch, changed};
/// # let text = r#"
/// #     model = { kind = "linear", A = [[1.0]], B = [[1.0]], C = [[1.0]] }
/// #     parameters.variance = { initial = 1e-2, bounds = [1e-4, 1.0] }
/// #     [[tasks]]
/// #     name = "hold"
/// #     steps = 20
/// #     time_step = 0.1
/// #     initial_state = [1.0]
/// #     noise = { initial = [1e-2], process = [1e-3], measurement = ["variance"] }
/// #     costs = [{ kind = "quadratic", Q = [[1.0]], R = [[1.0]] }]
/// # "#;
/// # let source = Source { path: "hold.toml".to_owned(), text: text.to_owned() };
///
/// // The task of the front page.
/// let task = LoadedTask::restore(&[source])?;
/// let work = Work::Evaluate(EvaluateOptions::default());
/// let result = work.run(&task, None, Watch::default())?;
/// let folder = tempfile::tempdir()?;
/// Folder::save(folder.path(), &Made::of(&task, work), &result)?;
/// assert!(folder.path().join(CHECKSUMS).exists() && changed(folder.path()).is_empty());
/// std::fs::write(folder.path().join(RESULT), "{}")?;
/// assert_eq!(changed(folder.path()), [RESULT]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[must_use]
pub fn changed(folder: &Path) -> Vec<&'static str> {
    let Ok(text) = supple_file::read_text(folder.join(CHECKSUMS)) else { return Vec::new() };
    let saved =
        |name: &str| text.lines().find_map(|line| line.strip_suffix(name)?.strip_suffix("  ").map(str::to_owned));
    let differs = |name: &&&str| saved(name).is_some_and(|saved| checksum(&folder.join(name)) != Some(saved));
    FILES.iter().filter(differs).copied().collect()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    #[test]
    fn a_changed_file_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let folder = folder.path();
        assert!(changed(folder).is_empty());
        std::fs::write(folder.join(RESULT), "abc").unwrap();
        std::fs::write(folder.join(TABLE_CSV), "k1\n1\n").unwrap();
        save(folder).unwrap();
        let text = std::fs::read_to_string(folder.join(CHECKSUMS)).unwrap();
        // FIPS 180-4, appendix B.1.
        let first = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad  result.json";
        assert_eq!(text.lines().next(), Some(first));
        assert!(changed(folder).is_empty());
        std::fs::write(folder.join(TABLE_CSV), "k1\n2\n").unwrap();
        assert_eq!(changed(folder), [TABLE_CSV]);
        std::fs::remove_file(folder.join(RESULT)).unwrap();
        assert_eq!(changed(folder), [RESULT, TABLE_CSV]);
    }
}
