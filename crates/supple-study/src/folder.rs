use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use supple::design::DesignStatus;
use supple_file::read_text;

use crate::bound::BoundStudy;
use crate::checksums;
use crate::design::DesignReport;
use crate::evaluate::EvaluateReport;
use crate::journal::forget;
use crate::pareto::Pareto;
use crate::robustness::Robustness;
use crate::sensors::Sensors;
use crate::study::Study;
use crate::sweep::Sweep;
use crate::trace::Trace;
use crate::write::RESULT;
use crate::{About, LoadedTask, NotFinite, Source, StudyError, not_finite, write_text};

/// The version of the layout of result folders.
const FORMAT: u32 = 1;

/// What made a result.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Made {
    /// Version of the layout of the folder.
    pub format: u32,
    /// Version of supple.
    pub supple: String,
    /// The command's name.
    pub command: String,
    /// All arguments of the program.
    pub arguments: Vec<String>,
    /// Seed of everything random.
    pub seed: u64,
    /// The task file, then the robot's file where there is one.
    pub sources: Vec<Source>,
    /// What the task is.
    pub about: About,
}

impl Made {
    /// By this version, with the arguments of this program.
    pub fn here(command: &str, seed: u64, task: &LoadedTask) -> Self {
        Self::of_sources(command, seed, task.sources.clone(), About::of(&task.problem))
    }

    /// The same, of any files.
    pub fn of_sources(command: &str, seed: u64, sources: Vec<Source>, about: About) -> Self {
        Self {
            format: FORMAT,
            supple: env!("CARGO_PKG_VERSION").to_owned(),
            command: command.to_owned(),
            arguments: std::env::args_os().skip(1).map(|word| word.to_string_lossy().into_owned()).collect(),
            seed,
            sources,
            about,
        }
    }
}

/// A result of any study.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(tag = "kind", content = "result", rename_all = "snake_case")]
pub enum StudyResult {
    /// Of `supple design`.
    Design(Box<DesignReport>),
    /// Of `supple evaluate`.
    Evaluate(Box<EvaluateReport>),
    /// Of `supple sweep`.
    Sweep(Box<Sweep>),
    /// Of `supple robustness`.
    Robustness(Box<Robustness>),
    /// Of `supple pareto`.
    Pareto(Box<Pareto>),
    /// Of `supple trace`.
    Trace(Box<Trace>),
    /// Of `supple sensors`.
    Sensors(Box<Sensors>),
    /// Of `supple bound`.
    Bound(Box<BoundStudy>),
    /// Of `supple study`: the folders of its steps.
    Study(Box<Study>),
}

impl StudyResult {
    /// The command that makes such results: `design`, `evaluate`...
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Design(_) => "design",
            Self::Evaluate(_) => "evaluate",
            Self::Sweep(_) => "sweep",
            Self::Robustness(_) => "robustness",
            Self::Pareto(_) => "pareto",
            Self::Trace(_) => "trace",
            Self::Sensors(_) => "sensors",
            Self::Bound(_) => "bound",
            Self::Study(_) => "study",
        }
    }

    /// Whether it was told to stop before all of it was found; a journal may keep the parts that were.
    pub fn is_stopped(&self) -> bool {
        match self {
            Self::Robustness(result) => result.stopped,
            Self::Pareto(result) => result.stopped,
            Self::Trace(result) => result.stopped,
            _ => false,
        }
    }

    /// All of its numbers that are not finite, but for those that say why.
    pub fn not_finite(&self) -> Vec<NotFinite> {
        match self {
            Self::Design(result) => not_finite(result),
            Self::Evaluate(result) => not_finite(&result.evaluation),
            // Cells of a table hold finite numbers only; the column `error` says what others lack.
            Self::Sweep(_) => Vec::new(),
            Self::Robustness(result) => not_finite(result),
            Self::Pareto(result) => not_finite(result),
            Self::Trace(result) => not_finite(result),
            Self::Sensors(result) => not_finite(result),
            Self::Bound(result) => not_finite(result),
            Self::Study(result) => not_finite(result),
        }
    }

    /// The result as programs read it: one JSON object; of a sweep its table, as lines of JSON.
    ///
    /// # Errors
    /// Where it cannot be told in JSON.
    pub fn json(&self) -> Result<String, StudyError> {
        let text = match self {
            Self::Design(result) => serde_json::to_string_pretty(result),
            Self::Evaluate(result) => serde_json::to_string_pretty(&result.evaluation),
            Self::Sweep(result) => Ok(result.table.to_jsonl()),
            Self::Robustness(result) => serde_json::to_string_pretty(result),
            Self::Pareto(result) => serde_json::to_string_pretty(result),
            Self::Trace(result) => serde_json::to_string_pretty(result),
            Self::Sensors(result) => serde_json::to_string_pretty(result),
            Self::Bound(result) => return result.json(),
            Self::Study(result) => serde_json::to_string_pretty(result),
        };
        text.map_err(|error| StudyError::Usage(error.to_string()))
    }
}

/// A folder with a result.
#[derive(Clone, Debug)]
pub struct Folder {
    /// Where it is.
    pub path: PathBuf,
    /// What made it.
    pub made: Made,
    /// The result.
    pub result: StudyResult,
}

#[derive(Serialize, Deserialize)]
struct File<M, R> {
    #[serde(flatten)]
    made: M,
    #[serde(flatten)]
    result: R,
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
        let json = serde_json::to_string_pretty(&File { made, result });
        let text = json.map_err(|error| StudyError::io(&file, error.into()))? + "\n";
        write_text(&file, text.as_bytes())?;
        checksums::save(path)
    }

    /// The same for a study whose journal keeps its finished parts: that of one that was not stopped is removed, as its result
    /// says it all.
    ///
    /// # Errors
    /// Where a file cannot be written or removed.
    pub fn conclude(path: &Path, made: &Made, result: &StudyResult) -> Result<(), StudyError> {
        Self::save(path, made, result)?;
        if result.is_stopped() { Ok(()) } else { forget(path) }
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

    /// Whether a folder already holds what a command would make: the same words, files and version, and not stopped halfway.
    pub fn is_made(folder: &Path, words: &[String]) -> bool {
        let Ok(Self { made, result, .. }) = Self::load(folder) else { return false };
        if !checksums::changed(folder).is_empty() {
            return false;
        }
        let complete = match &result {
            StudyResult::Sweep(sweep) => sweep.complete,
            // Starts that were not begun are not in the list.
            StudyResult::Design(design) => {
                design.status != DesignStatus::Stopped
                    && design.starts.iter().all(|start| start.status != DesignStatus::Stopped)
            }
            StudyResult::Robustness(study) => !study.stopped,
            StudyResult::Pareto(front) => !front.stopped,
            StudyResult::Trace(study) => !study.stopped,
            _ => true,
        };
        let same = |source: &Source| read_text(&source.path).is_ok_and(|text| text == source.text);
        complete && made.arguments == words && made.supple == env!("CARGO_PKG_VERSION") && made.sources.iter().all(same)
    }

    /// Checks that a folder holds no result of another kind, which a new one would replace: `kind` is that of
    /// [`StudyResult::kind`].
    ///
    /// # Errors
    /// Where it holds one.
    pub fn check_kind(path: &Path, kind: &str) -> Result<(), StudyError> {
        #[derive(Deserialize)]
        struct Kind {
            kind: String,
        }
        let file = path.join(RESULT);
        let read = std::fs::read_to_string(&file).ok().and_then(|text| serde_json::from_str::<Kind>(&text).ok());
        match read {
            Some(found) if found.kind != kind => Err(StudyError::usage(format!(
                "{} holds a result of `supple {}`, which one of `supple {kind}` would replace; name another folder, or \
                 delete it",
                path.display(),
                found.kind
            ))),
            _ => Ok(()),
        }
    }

    /// Reads a folder.
    ///
    /// # Errors
    /// Where there is no result in it, or one that this version cannot read.
    pub fn load(path: &Path) -> Result<Self, StudyError> {
        let file = path.join(RESULT);
        let text = read_text(&file)?;
        let format = serde_json::from_str::<Format>(&text).map(|format| format.format);
        match format {
            Ok(FORMAT) => {}
            Ok(other) => {
                let message = format!("has format {other}; this version of supple reads format {FORMAT}");
                return Err(StudyError::kept(&file, message));
            }
            Err(error) => return Err(StudyError::kept(&file, format!("is no result of supple: {error}"))),
        }
        let read: File<Made, StudyResult> = serde_json::from_str(&text)
            .map_err(|error| StudyError::kept(&file, format!("is damaged: {error}; make the result again")))?;
        let mut result = read.result;
        if let StudyResult::Sweep(sweep) = &mut result {
            sweep.load_table(path)?;
        }
        Ok(Self { path: path.to_owned(), made: read.made, result })
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
