use std::path::PathBuf;

use supple_text::Files;

/// How robots are read.
///
/// Example: the [front page](crate).
#[derive(Clone, Debug, Default)]
pub struct LoadOptions {
    /// Folders in which `package://NAME/...` and `model://NAME/...` are looked for, each holding a folder NAME.
    pub package_roots: Vec<PathBuf>,
    /// Whether mimic joints move independently.
    pub independent_mimic: bool,
    /// Where the robot's file and those it includes are read.
    pub files: Files,
}
