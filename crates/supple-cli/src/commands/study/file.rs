//! Study files: several studies and figures in one file, made by one command.
//!
//! The keys of a step are the long options of its command: one type per command holds them, read from a file by serde and
//! from a shell by clap, so that both have one list of options and one set of checks.

use std::path::{Component, Path, PathBuf};

use clap::{Subcommand, ValueEnum};
use serde::Deserialize;
use serde::de::DeserializeOwned;
use supple::FileError;
use supple_file::{Document, Place, ReadError, Reader, parse_document, read_text};
use supple_study::Source;

use crate::arguments::{Format, Output, PlotOptions, StudyCommand, TaskArguments, texts};

/// A study file as it was read.
///
/// Such a file, with one step:
///
/// ```toml
/// title = "The paper's studies"
///
/// [[steps]]
/// name = "landscape"
/// run = "sweep"
/// task = "../tasks/two_mass.toml"
/// grid = ["k1=log:50:600:40", "k2=log:100:600:40"]
/// ```
#[derive(Debug)]
pub struct StudyFile {
    /// What it is, for people.
    pub title: String,
    /// Its steps, in order.
    pub steps: Vec<Step<StudyCommand>>,
    /// Its figures, drawn after all steps.
    pub figures: Vec<Step<PlotOptions>>,
    /// The file's name and text.
    pub source: Source,
}

/// A command of a study file.
#[derive(Debug)]
pub struct Step<T> {
    /// Its name: of its folder, or of the figure's file.
    pub name: String,
    /// What it asks for.
    pub command: T,
    /// What it makes, as seen from the folder of the study.
    pub output: String,
    /// Where it is in the file.
    place: At,
}

/// The list in a study file and the index in it.
type At = (&'static str, usize);

/// The folder of figures in that of a study.
const FIGURES: &str = "figures";

/// What a file has at its top; the tables of the lists are read one by one.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Top {
    title: String,
}

const LISTS: &[&str] = &["steps", "figures"];

/// The keys that all steps have; the others are options of the command.
#[derive(Deserialize)]
struct StepKeys {
    name: String,
    run: String,
    task: String,
    from: Option<String>,
    #[serde(default, deserialize_with = "texts")]
    set: Vec<String>,
    #[serde(default)]
    verbose: bool,
}

const STEP_KEYS: &[&str] = &["name", "run", "task", "from", "set", "verbose"];

/// The keys that all figures have; the others are options of `supple plot`.
#[derive(Deserialize)]
struct FigureKeys {
    name: String,
    #[serde(default, deserialize_with = "texts")]
    from: Vec<String>,
}

const FIGURE_KEYS: &[&str] = &["name", "from"];

/// Options that belong to the whole study.
const OF_STUDY: [&str; 6] = ["out", "json", "help", "version", "threads", "instructions"];

impl StudyFile {
    /// Reads a study file, whose results will go to the folder `out`.
    ///
    /// # Errors
    /// Where the file cannot be read or anything in it is wrong.
    pub fn load(path: &Path, out: &Path) -> Result<Self, FileError> {
        let (name, text) = (path.display().to_string(), read_text(path)?);
        let document = parse_document(&text, &name)?;
        let whole = document.get(&[]).ok_or_else(|| document.error(&[], "is empty"))?;
        let Top { title } =
            Top::deserialize(document.reader(whole).beside(LISTS)).map_err(|error| document.read_error(&[], error))?;
        let count = |list: &'static str| document.tables(&[list.into()]);
        if count("steps")? == 0 {
            return Err(document.error(&[], "a study needs at least one table [[steps]]"));
        }
        let reading = Reading { document: &document, folder: path.parent().unwrap_or(Path::new("")), out };
        let mut steps = Vec::new();
        for index in 0..count("steps")? {
            steps.push(reading.step(("steps", index), &steps)?);
        }
        reading.check_names(&steps)?;
        let names: Vec<&str> = steps.iter().map(|step| step.name.as_str()).collect();
        let figures = (0..count("figures")?).map(|index| reading.figure(("figures", index), &names));
        let figures = figures.collect::<Result<Vec<_>, _>>()?;
        reading.check_names(&figures)?;
        let source = Source { path: name.clone(), text: text.clone() };
        Ok(Self { title, steps, figures, source })
    }

    /// An error about a step: at the key of the option with which the message begins, or else at the whole step.
    pub fn error<T>(&self, step: &Step<T>, message: &str) -> FileError {
        let document = match parse_document(&self.source.text, &self.source.path) {
            Ok(document) => document,
            Err(error) => return error,
        };
        let (list, index) = step.place;
        let option = message.split_once(' ').and_then(|(option, told)| Some((key_of(option)?, told)));
        match option {
            Some((key, told)) => document.error(&[list.into(), index.into(), Place::Key(&key)], told),
            None => document.error(&[list.into(), index.into()], message),
        }
    }
}

/// The key that stands for an option: `time_step` for `--time-step <DT>`.
fn key_of(option: &str) -> Option<String> {
    let name = option.strip_prefix("--")?.split([' ', '=', ':']).next()?;
    Some(name.replace('-', "_"))
}

/// What reading steps needs.
struct Reading<'a> {
    document: &'a Document<'a>,
    /// The folder of the study file, from which its paths go.
    folder: &'a Path,
    out: &'a Path,
}

impl Reading<'_> {
    fn step(&self, place: At, before: &[Step<StudyCommand>]) -> Result<Step<StudyCommand>, FileError> {
        let StepKeys { name, run, task, from, set, verbose } = self.keys(place, STEP_KEYS)?;
        self.check_name(place, &name)?;
        if name == FIGURES {
            return Err(self.error(
                place,
                "name",
                format!("`{FIGURES}` is reserved for the figures folder; choose another name"),
            ));
        }
        if let Some(key) = OF_STUDY.into_iter().find(|key| self.document.get(&self.at(place, key)).is_some()) {
            let message = "is an option of `supple study`, not of a step; the result of a step is stored in a folder \
                           with its name";
            return Err(self.error(place, key, message.to_owned()));
        }
        if let Some(from) = &from {
            self.check_design(place, from, before)?;
        }
        let task = TaskArguments {
            task: tidy(&self.folder.join(task)),
            from: from.map(|from| tidy(&self.out.join(from))),
            set,
            verbose,
        };
        let output = Output { out: Some(tidy(&self.out.join(&name))), json: false };
        let command = StudyCommand::read(&run, self.table(place)?.beside(STEP_KEYS), task, output);
        let Some(command) = command else {
            let studies = StudyCommand::augment_subcommands(clap::Command::new(""));
            let studies: Vec<&str> = studies.get_subcommands().map(clap::Command::get_name).collect();
            let message = format!("must be one of {}; found `{run}`", supple_text::quoted(&studies));
            let help = supple_text::nearest(&run, &studies);
            return Err(FileError { help, ..self.error(place, "run", message) });
        };
        let command = self.told(place, command)?;
        Ok(Step { output: name.clone(), name, command, place })
    }

    /// That an earlier step of this name finds or evaluates a design.
    fn check_design(&self, place: At, from: &str, before: &[Step<StudyCommand>]) -> Result<(), FileError> {
        let has_design =
            |step: &&Step<StudyCommand>| matches!(step.command, StudyCommand::Design(_) | StudyCommand::Evaluate(_));
        let valid: Vec<&str> = before.iter().filter(has_design).map(|step| step.name.as_str()).collect();
        if valid.contains(&from) {
            return Ok(());
        }
        let message = match &valid[..] {
            [] => format!("no step before this one is a `design` or `evaluate`; found `{from}`"),
            _ => format!(
                "must be an earlier step that is a `design` or `evaluate`, {}; found `{from}`",
                supple_text::quoted(&valid)
            ),
        };
        Err(FileError { help: supple_text::nearest(from, &valid), ..self.error(place, "from", message) })
    }

    fn figure(&self, place: At, steps: &[&str]) -> Result<Step<PlotOptions>, FileError> {
        let FigureKeys { name, from } = self.keys(place, FIGURE_KEYS)?;
        self.check_name(place, &name)?;
        if from.is_empty() {
            return Err(self.error(place, "from", "must name at least one step".to_owned()));
        }
        if let Some(unknown) = from.iter().find(|step| !steps.contains(&step.as_str())) {
            let message = format!("there is no step `{unknown}`; valid steps: {}", supple_text::quoted(steps));
            let help = supple_text::nearest(unknown, steps);
            return Err(FileError { help, ..self.error(place, "from", message) });
        }
        let options = PlotOptions::deserialize(self.table(place)?.beside(FIGURE_KEYS));
        let mut command = self.told(place, options)?;
        let format = command.format.unwrap_or(Format::Svg).to_possible_value();
        let output = format!("{FIGURES}/{name}.{}", format.as_ref().map_or("svg", |format| format.get_name()));
        command.folders = from.iter().map(|step| tidy(&self.out.join(step))).collect();
        command.out = Some(tidy(&self.out.join(&output)));
        Ok(Step { name, command, output, place })
    }

    /// The keys that all tables of a list have.
    fn keys<T: DeserializeOwned>(&self, place: At, keys: &'static [&'static str]) -> Result<T, FileError> {
        self.told(place, T::deserialize(self.table(place)?.only(keys)))
    }

    /// What was read of a table, or the error with its line.
    fn told<T>(&self, (list, index): At, read: Result<T, ReadError>) -> Result<T, FileError> {
        read.map_err(|error| self.document.read_error(&[list.into(), index.into()], error))
    }

    /// A table of a list.
    fn table(&self, (list, index): At) -> Result<Reader<'_>, FileError> {
        let at = [list.into(), index.into()];
        let table = self.document.get(&at).ok_or_else(|| self.document.error(&at, "is missing"))?;
        Ok(self.document.reader(table))
    }

    /// Every step needs a name of its own.
    fn check_names<T>(&self, list: &[Step<T>]) -> Result<(), FileError> {
        for (index, step) in list.iter().enumerate() {
            if list[..index].iter().any(|other| other.name == step.name) {
                let message = format!("the name `{}` occurs twice; names must be unique", step.name);
                return Err(self.error(step.place, "name", message));
            }
        }
        Ok(())
    }

    /// Checks that a name is a valid folder name on every system.
    fn check_name(&self, place: At, name: &str) -> Result<(), FileError> {
        let plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '-');
        if name.is_empty() || name.len() > 64 || !name.chars().all(plain) {
            let message = format!("must be of letters from a to z, digits, `_` and `-`, at most 64; found `{name}`");
            return Err(self.error(place, "name", message));
        }
        Ok(())
    }

    fn at<'k>(&self, (list, index): At, key: &'k str) -> [Place<'k>; 3] {
        [list.into(), index.into(), Place::Key(key)]
    }

    fn error(&self, place: At, key: &str, message: String) -> FileError {
        self.document.error(&self.at(place, key), message)
    }
}

/// A path without `.` and, where they lead up from a named folder, `..`.
fn tidy(path: &Path) -> PathBuf {
    let mut tidy = PathBuf::new();
    for part in path.components() {
        let named = matches!(tidy.components().next_back(), Some(Component::Normal(_)));
        match part {
            Component::CurDir => {}
            Component::ParentDir if named => {
                tidy.pop();
            }
            part => tidy.push(part),
        }
    }
    tidy
}
