use std::path::PathBuf;

use supple_study::{Folder, StudyResult};

use crate::ReportError;

/// Reads folders of results; of a study, the folders of all its steps too. A folder that is named twice is read once.
///
/// # Errors
/// Where a folder holds no result that this version can read.
pub fn load(paths: &[PathBuf]) -> Result<Vec<Folder>, ReportError> {
    let mut found: Vec<Folder> = Vec::new();
    let mut waiting: Vec<PathBuf> = paths.iter().rev().cloned().collect();
    while let Some(path) = waiting.pop() {
        if found.iter().any(|folder| same(&folder.path, &path)) {
            continue;
        }
        let folder = Folder::load(&path)?;
        if let StudyResult::Study(study) = &folder.result {
            waiting.extend(study.steps.iter().rev().map(|step| path.join(step)));
        }
        found.push(folder);
    }
    Ok(found)
}

/// Whether two paths lead to the same folder.
fn same(a: &PathBuf, b: &PathBuf) -> bool {
    a == b || matches!((a.canonicalize(), b.canonicalize()), (Ok(a), Ok(b)) if a == b)
}
