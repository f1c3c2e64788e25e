//! What figures look up in results.

use supple::TrajectoryReport;
use supple::{Evaluation, TaskEvaluation};
use supple_study::{Folder, StudyResult};

use crate::FigureError;
use crate::figure::{Colour, Marker, Series, Shape, Style};

/// Nats in a bit.
pub const NATS: f64 = std::f64::consts::LN_2;

/// The most designs that are drawn side by side.
const MOST: usize = 4;

/// A task of a design.
pub struct Shown<'a> {
    /// The name of the design.
    pub design: String,
    /// The task.
    pub task: &'a TaskEvaluation,
    /// Its trajectory.
    pub trajectory: &'a TrajectoryReport,
}

/// The folder's own name, for people.
pub fn folder_name(folder: &Folder) -> String {
    folder
        .path
        .file_name()
        .map_or_else(|| folder.path.display().to_string(), |name| name.to_string_lossy().into_owned())
}

/// Error: the results do not fit the figure.
pub fn lacking(figure: &'static str, needs: &'static str, folders: &[Folder]) -> FigureError {
    let kind = |folder: &Folder| format!("{} (of `supple {}`)", folder.path.display(), folder.result.kind());
    let given = folders.iter().map(kind).collect::<Vec<_>>().join(", ");
    FigureError::Needs { figure, needs, given: if given.is_empty() { "nothing".into() } else { given } }
}

/// Error: a result lacks the data of a figure.
pub fn content(folder: &Folder, message: impl Into<String>) -> FigureError {
    FigureError::Content { folder: folder.path.display().to_string(), message: message.into() }
}

/// What marks points whose plans never make a contact whose force a cost tracks.
pub const MISSES_CONTACT: &str = "contact never made";

/// Marks of such points.
pub fn misses_contact(x: Vec<f64>, y: Vec<f64>) -> Series {
    Series::named(MISSES_CONTACT, Style::points(Colour::Vermilion, Marker::Cross), Shape::Points { x, y })
}

/// The index of a task among those of a folder: of the named one, or else the first.
pub fn task_index(folder: &Folder, task: Option<&str>) -> Result<usize, FigureError> {
    let tasks = &folder.made.about.tasks;
    let Some(name) = task else { return Ok(0) };
    let unknown = || {
        let valid = tasks.iter().map(|task| task.name.as_str()).collect::<Vec<_>>().join(", ");
        FigureError::UnknownTask { name: name.to_owned(), valid }
    };
    tasks.iter().position(|task| task.name == name).ok_or_else(unknown)
}

/// The evaluated designs of all folders by name, with the task to show.
pub fn designs<'a>(
    figure: &'static str,
    folders: &'a [Folder],
    task: Option<&str>,
) -> Result<Vec<Shown<'a>>, FigureError> {
    let several = folders.iter().filter(|folder| evaluations(folder).is_some()).count() > 1;
    let mut shown = Vec::new();
    for folder in folders {
        for (name, evaluation) in evaluations(folder).unwrap_or_default() {
            let index = task_index(folder, task)?;
            let task = evaluation.tasks.get(index).ok_or_else(|| content(folder, "has no tasks"))?;
            let missing = || content(folder, "has no trajectories; recompute the result with this version of supple");
            let trajectory = task.trajectory.as_ref().ok_or_else(missing)?;
            let design = match (name, several) {
                (None, _) => folder_name(folder),
                (Some(name), false) => name.to_owned(),
                (Some(name), true) => format!("{}: {name}", folder_name(folder)),
            };
            let design = if evaluation.tasks.len() > 1 { format!("{design}, {}", task.name) } else { design };
            shown.push(Shown { design, task, trajectory });
        }
    }
    if shown.is_empty() {
        return Err(lacking(figure, "a folder of `supple design` or `supple evaluate`", folders));
    }
    if shown.len() > MOST {
        return Err(lacking(figure, "at most 4 designs; a folder of `supple design` has 2", folders));
    }
    Ok(shown)
}

/// The designs that a folder holds, with names where there are several.
fn evaluations(folder: &Folder) -> Option<Vec<(Option<&'static str>, &Evaluation)>> {
    match &folder.result {
        StudyResult::Design(report) => Some(vec![(Some("start"), &report.start), (Some("optimum"), &report.optimum)]),
        StudyResult::Evaluate(report) => Some(vec![(None, &report.evaluation)]),
        _ => None,
    }
}

/// A name with that of the task, where there is more than one.
pub fn of_task(what: &str, folder: &Folder, index: usize) -> String {
    match folder.made.about.tasks.as_slice() {
        tasks if tasks.len() > 1 => format!("{what} of {}", tasks[index].name),
        _ => what.to_owned(),
    }
}
