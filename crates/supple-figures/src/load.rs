use std::path::Path;

use supple_study::{Folder, StudyError, StudyResult};

/// Reads folders of results; that of a study file stands for the folders of all its steps.
///
/// # Errors
/// Where a folder has no result, or one that this version cannot read.
pub fn load(paths: &[impl AsRef<Path>]) -> Result<Vec<Folder>, StudyError> {
    let mut folders = Vec::new();
    for path in paths {
        let folder = Folder::load(path.as_ref())?;
        match &folder.result {
            StudyResult::Study(study) => {
                for step in &study.steps {
                    folders.push(Folder::load(&folder.path.join(step))?);
                }
            }
            _ => folders.push(folder),
        }
    }
    Ok(folders)
}
