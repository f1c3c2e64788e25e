//! Study files: several studies in one file, made by one command.

use serde::{Deserialize, Serialize};

/// The result of a study file.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Study {
    /// What it is, for people.
    pub title: String,
    /// Names of its steps; each has a folder of its name.
    pub steps: Vec<String>,
}
