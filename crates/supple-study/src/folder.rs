use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use supple::parameters::Parameter;
use supple::{Evaluation, FileError};
use supple_file::read_text;

use crate::checksums;
use crate::consistent;
use crate::journal::{JOURNAL, forget, kept_parts};
use crate::result::Kind;
use crate::study::{Study, Work};
use crate::sweep::{Axis, TABLE_CSV};
use crate::write::RESULT;
use crate::{About, LoadedTask, Source, StudyError, StudyResult, check_writable, write_text};

/// The version of the layout of result folders.
const FORMAT: u32 = 2;

/// The file in which `supple validate` stores its findings about a result, in the same folder.
const VALIDATION: &str = "validation.json";

/// What made a result.
///
/// Example: the [front page](crate).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Made {
    /// Version of the layout of the folder.
    pub format: u32,
    /// Version of supple.
    pub supple: String,
    /// What was done; none for the result of a study file, whose steps have their own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub study: Option<Study>,
    /// The task file, then the robot's file where there is one; or the study file.
    pub sources: Vec<Source>,
    /// What the task is.
    pub about: About,
}

impl Made {
    /// By this version: work on a task.
    #[must_use]
    pub fn of(task: &LoadedTask, work: Work) -> Self {
        let study = Some(Study::of(task, work));
        Self { study, about: About::of(&task.problem), ..Self::of_files(task.sources.clone()) }
    }

    /// By this version: several studies, asked for by one file with a title.
    #[must_use]
    pub fn of_steps(title: &str, file: Source) -> Self {
        Self { about: About { title: title.to_owned(), ..About::default() }, ..Self::of_files(vec![file]) }
    }

    fn of_files(sources: Vec<Source>) -> Self {
        let supple = env!("CARGO_PKG_VERSION").to_owned();
        Self { format: FORMAT, supple, study: None, sources, about: About::default() }
    }
}

/// A folder with a result.
///
/// Example: the [front page](crate).
#[derive(Clone, Debug)]
pub struct Folder {
    /// Where it is.
    pub path: PathBuf,
    /// What made it.
    pub made: Made,
    /// The result.
    pub result: StudyResult,
}

/// `result.json` as it is written.
#[derive(Serialize)]
struct File<'a> {
    #[serde(flatten)]
    made: &'a Made,
    #[serde(flatten)]
    result: &'a StudyResult,
}

impl Folder {
    /// Writes `result.json`, whole or not at all, what else belongs to the result, and the checksums of all.
    ///
    /// # Errors
    /// Where a file cannot be written.
    pub fn save(path: &Path, made: &Made, result: &StudyResult) -> Result<(), StudyError> {
        if let StudyResult::Sweep(sweep) = result {
            sweep.save_table(path)?;
        }
        if let StudyResult::Bound(study) = result {
            study.save_table(path)?;
        }
        let file = path.join(RESULT);
        // It refers to the previous result in this folder.
        remove(&path.join(VALIDATION))?;
        let json = serde_json::to_string_pretty(&File { made, result });
        let text = json.map_err(|error| StudyError::io(&file, error.into()))? + "\n";
        write_text(&file, text.as_bytes())?;
        checksums::save(path)
    }

    /// The same, and removes the journal if there is nothing to resume, as the result is complete. The journal of a sweep
    /// is kept, since it holds the rows of the table.
    ///
    /// # Errors
    /// Where a file cannot be written or removed.
    pub fn conclude(path: &Path, made: &Made, result: &StudyResult) -> Result<(), StudyError> {
        Self::save(path, made, result)?;
        let resumes = result.is_stopped() && kept_parts(path)? > 0;
        if resumes || matches!(result, StudyResult::Sweep(_)) { Ok(()) } else { forget(path) }
    }

    /// Whether this result is of the same robot as a task, where both have one; what is said where it is not.
    ///
    /// # Errors
    /// Where a parameter of both has different units.
    pub fn check_kinship(&self, task: &LoadedTask) -> Result<Option<String>, StudyError> {
        let others = &task.problem.parameters;
        for parameter in self.made.about.parameters.iter() {
            let same_name = others.iter().find(|other| other.name == parameter.name);
            let differ = |other: &&Parameter| {
                !other.unit.is_empty() && !parameter.unit.is_empty() && other.unit != parameter.unit
            };
            if let Some(other) = same_name.filter(differ) {
                let Parameter { name, unit, .. } = parameter;
                let other = &other.unit;
                return Err(StudyError::usage(format!(
                    "its parameter `{name}` is in {unit}, that of the task in {other}"
                )));
            }
        }
        let [own, other] = [&self.made.sources, &task.sources].map(|sources| sources.get(1));
        Ok(own
            .zip(other)
            .filter(|(own, other)| own.text != other.text)
            .map(|(own, other)| format!("it is of another robot, {}, than the task, {}", own.path, other.path)))
    }

    /// Reads folders; after that of a study file those of its steps. A folder that is named twice is read once.
    ///
    /// # Errors
    /// Where there is no result in one, or one that this version cannot read.
    pub fn load_all(paths: &[impl AsRef<Path>]) -> Result<Vec<Self>, StudyError> {
        let mut found: Vec<Self> = Vec::new();
        let mut waiting: Vec<PathBuf> = paths.iter().rev().map(|path| path.as_ref().to_owned()).collect();
        while let Some(path) = waiting.pop() {
            if found.iter().any(|folder| same(&folder.path, &path)) {
                continue;
            }
            let folder = Self::load(&path)?;
            if let StudyResult::Study(study) = &folder.result {
                waiting.extend(study.steps.iter().rev().map(|step| path.join(step)));
            }
            found.push(folder);
        }
        Ok(found)
    }

    /// The result that a folder already holds of a study: of the same files, by this version, not changed since, and
    /// not stopped halfway.
    #[must_use]
    pub fn load_made(path: &Path, study: &Study) -> Option<Self> {
        let folder = Self::load(path).ok()?;
        let Self { made, result, .. } = &folder;
        let same = |source: &Source| read_text(&source.path).is_ok_and(|text| text == source.text);
        let is_made = made.study.as_ref() == Some(study)
            && made.supple == env!("CARGO_PKG_VERSION")
            && made.sources.iter().all(same)
            && !result.is_stopped()
            && checksums::changed(path).is_empty();
        is_made.then_some(folder)
    }

    /// Checks that a folder can take the result of some work, before long work is done for it.
    ///
    /// # Errors
    /// Where it holds a result of another kind, which the new one would replace, or cannot be written to.
    pub fn check_for(path: &Path, work: &Work) -> Result<(), StudyError> {
        Self::check_kind(path, work.command())?;
        check_writable(path, if matches!(work, Work::Sweep(_)) { TABLE_CSV } else { RESULT })
    }

    /// A warning if a sweep will replace the result of another sweep whose journal was removed. If that sweep still has
    /// its journal, the new one is refused when it begins.
    #[must_use]
    pub fn replaced_sweep(path: &Path, work: &Work) -> Option<String> {
        #[derive(Deserialize)]
        struct Before {
            study: Study,
        }
        let text = std::fs::read_to_string(path.join(RESULT)).ok().filter(|_| !path.join(JOURNAL).exists())?;
        let Before { study } = serde_json::from_str(&text).ok()?;
        let (Work::Sweep(before), Work::Sweep(_)) = (&study.work, work) else { return None };
        let axis = |axis: &Axis| format!("`{}`: {} values", axis.parameter, axis.values.len());
        let axes: Vec<String> = before.axes.iter().map(axis).collect();
        let what = format!("{} contains a sweep of other points ({})", path.display(), axes.join("; "));
        (study.work != *work).then(|| format!("{what}, which this one replaces"))
    }

    /// Checks that a folder holds no result of another kind, which a new one would replace: `kind` is that of
    /// [`StudyResult::kind`].
    ///
    /// # Errors
    /// Where it holds one.
    pub fn check_kind(path: &Path, kind: &str) -> Result<(), StudyError> {
        let file = path.join(RESULT);
        let read = std::fs::read_to_string(&file).ok().and_then(|text| serde_json::from_str::<Kind>(&text).ok());
        match read {
            Some(found) if found.kind != kind => Err(StudyError::usage(format!(
                "{} contains a result of `supple {}` and would be overwritten by `supple {kind}`; choose another folder or delete it",
                path.display(),
                found.kind
            ))),
            _ => Ok(()),
        }
    }

    /// The design in it: the optimum of a search, or what was evaluated.
    ///
    /// # Errors
    /// Where the result is of another command.
    ///
    /// ```
    /// use supple::Named;
    /// use supple_study::study::Work;
    /// use supple_study::{Folder, LoadedTask, Made, Watch};
    /// # let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tasks/two_mass.toml");
    /// # let path = tempfile::tempdir()?;
    /// # let path = path.path();
    ///
    /// let task = LoadedTask::load(file.as_ref())?.setting(&Named::from([("k1", 300.0)]))?;
    /// let work = Work::Evaluate(supple_study::evaluate::EvaluateOptions { rollouts: 0, ..Default::default() });
    /// let result = work.run(&task, None, Watch::default())?;
    /// Folder::conclude(path, &Made::of(&task, work), &result)?;
    ///
    /// let mut another = LoadedTask::load(file.as_ref())?;
    /// another.start_from(&Folder::load(path)?.design()?.parameters)?;
    /// assert_eq!(another.phi, task.phi);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn design(&self) -> Result<&Evaluation, StudyError> {
        match &self.result {
            StudyResult::Design(found) => Ok(&found.optimum),
            StudyResult::Evaluate(found) => Ok(&found.evaluation),
            other => Err(StudyError::usage(format!(
                "is a result of `supple {}`: a design is in results of `design` and `evaluate`",
                other.kind()
            ))),
        }
    }

    /// Reads a folder.
    ///
    /// # Errors
    /// Where there is no result in it, or one that this version cannot read.
    pub fn load(path: &Path) -> Result<Self, StudyError> {
        let file = path.join(RESULT);
        let text = read_text(&file).map_err(|error| absent(path, error))?;
        let format = serde_json::from_str::<Format>(&text).map(|format| format.format);
        match format {
            Ok(FORMAT) => {}
            Ok(other) => {
                let message = format!("has format {other}; this version of supple reads format {FORMAT}");
                return Err(StudyError::kept(&file, message));
            }
            Err(error) => return Err(StudyError::kept(&file, format!("is not a supple result: {error}"))),
        }
        let read = serde_json::from_str::<Made>(&text).and_then(|made| Ok((made, StudyResult::of_file(&text)?)));
        let (made, mut result) =
            read.map_err(|error| StudyError::kept(&file, format!("is damaged: {error}; recompute the result")))?;
        if let StudyResult::Sweep(sweep) = &mut result {
            sweep.load_table(path)?;
        }
        consistent::check(&made.about, &result)
            .map_err(|why| StudyError::kept(&file, format!("is damaged: {why}; recompute the result")))?;
        Ok(Self { path: path.to_owned(), made, result })
    }
}

/// The error for a folder whose result cannot be read: if it has none, says so, and where results are.
fn absent(path: &Path, error: FileError) -> FileError {
    let elsewhere = "results are in the folders that `--out` names, in Python `out`";
    let (message, help) = if path.join(RESULT).exists() {
        return error;
    } else if path.join(JOURNAL).exists() {
        ("holds an incomplete study and no result yet", "run the same command again to resume it")
    } else if path.is_dir() {
        ("holds no result: it has no file `result.json`", elsewhere)
    } else if path.exists() {
        ("is a file, not the folder of a result", elsewhere)
    } else {
        ("there is no such folder", elsewhere)
    };
    FileError { file: path.display().to_string(), message: message.to_owned(), help: Some(help.to_owned()), ..error }
}

/// Removes a file where there is one.
fn remove(file: &Path) -> Result<(), StudyError> {
    match std::fs::remove_file(file) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => Err(StudyError::io(file, error)),
        _ => Ok(()),
    }
}

/// Whether two paths lead to the same folder.
fn same(a: &Path, b: &Path) -> bool {
    a == b || matches!((a.canonicalize(), b.canonicalize()), (Ok(a), Ok(b)) if a == b)
}

#[derive(Deserialize)]
struct Format {
    format: u32,
}
