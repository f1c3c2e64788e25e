//! Study files: several studies and figures in one file, made by one command.
//!
//! A step is a command of `supple`: the keys of its table are the command's long options, read by the command line's own
//! parser, so that a file and a shell have one list of options and one set of checks.

use std::collections::BTreeMap;
use std::path::{Component, Path, PathBuf};

use clap::Subcommand;
use clap::error::{ContextKind, ErrorKind};
use serde::de::{SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};
use supple::FileError;
use supple_file::{Document, Place, parse_document, read_text};
use supple_study::Source;

use crate::arguments::{Arguments, Command, PlotOptions, StudyCommand};

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

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Top {
    title: String,
    #[serde(default)]
    steps: Vec<BTreeMap<String, Words>>,
    #[serde(default)]
    figures: Vec<BTreeMap<String, Words>>,
}

/// The value of an option: the words that it is on a command line.
#[derive(Clone, Debug)]
enum Words {
    /// An option without a value, given or not.
    Flag(bool),
    /// Its values.
    List(Vec<String>),
}

impl<'de> Deserialize<'de> for Words {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(WordsVisitor)
    }
}

struct WordsVisitor;

impl<'de> Visitor<'de> for WordsVisitor {
    type Value = Words;

    fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.write_str("a number, a text, true, false, or a list of numbers or texts")
    }
    fn visit_bool<E>(self, given: bool) -> Result<Words, E> {
        Ok(Words::Flag(given))
    }
    fn visit_i64<E>(self, number: i64) -> Result<Words, E> {
        Ok(Words::List(vec![number.to_string()]))
    }
    fn visit_f64<E>(self, number: f64) -> Result<Words, E> {
        Ok(Words::List(vec![number.to_string()]))
    }
    fn visit_str<E>(self, text: &str) -> Result<Words, E> {
        Ok(Words::List(vec![text.to_owned()]))
    }
    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Words, A::Error> {
        let mut words = Vec::new();
        while let Some(entry) = list.next_element::<Words>()? {
            match entry {
                Words::List(entry) => words.extend(entry),
                Words::Flag(flag) => words.push(flag.to_string()),
            }
        }
        Ok(Words::List(words))
    }
}

impl StudyFile {
    /// Reads a study file, whose results will go to the folder `out`.
    ///
    /// # Errors
    /// Where the file cannot be read or anything in it is wrong.
    pub fn load(path: &Path, out: &Path) -> Result<Self, FileError> {
        let (name, text) = (path.display().to_string(), read_text(path)?);
        let document = parse_document(&text, &name)?;
        let top: Top = document.read(&[])?;
        if top.steps.is_empty() {
            return Err(document.error(&[], "a study needs at least one table [[steps]]"));
        }
        let reading = Reading { document: &document, folder: path.parent().unwrap_or(Path::new("")), out };
        let mut steps = Vec::with_capacity(top.steps.len());
        for (index, keys) in top.steps.into_iter().enumerate() {
            steps.push(reading.step(index, keys, &steps)?);
        }
        reading.check_names(&steps)?;
        let names: Vec<&str> = steps.iter().map(|step| step.name.as_str()).collect();
        let figures = top.figures.into_iter().enumerate().map(|(index, keys)| reading.figure(index, keys, &names));
        let figures = figures.collect::<Result<Vec<_>, _>>()?;
        reading.check_names(&figures)?;
        let source = Source { path: name.clone(), text: text.clone() };
        Ok(Self { title: top.title, steps, figures, source })
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
    fn step(
        &self,
        index: usize,
        mut keys: BTreeMap<String, Words>,
        before: &[Step<StudyCommand>],
    ) -> Result<Step<StudyCommand>, FileError> {
        let place = ("steps", index);
        let name = self.name(place, &mut keys)?;
        if name == FIGURES {
            return Err(self.error(
                place,
                "name",
                format!("`{FIGURES}` is reserved for the figures folder; choose another name"),
            ));
        }
        let run = self.one(place, "run", &mut keys)?;
        let studies = StudyCommand::augment_subcommands(clap::Command::new(""));
        let studies: Vec<&str> = studies.get_subcommands().map(clap::Command::get_name).collect();
        if !studies.contains(&run.as_str()) {
            let message = format!("must be one of {}; found `{run}`", supple_text::quoted(&studies));
            let help = supple_text::nearest(&run, &studies);
            return Err(FileError { help, ..self.error(place, "run", message) });
        }
        let task = self.one(place, "task", &mut keys)?;
        let mut words = vec![run, tidy(&self.folder.join(task))];
        if keys.contains_key("from") {
            let from = self.one(place, "from", &mut keys)?;
            self.check_design(place, &from, before)?;
            words.push(format!("--from={}", tidy(&self.out.join(from))));
        }
        match self.command(place, words, keys, &name)? {
            Command::Study(command) => Ok(Step { output: name.clone(), name, command, place }),
            _ => Err(self.error(place, "run", "is not a study".to_owned())),
        }
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

    fn figure(
        &self,
        index: usize,
        mut keys: BTreeMap<String, Words>,
        steps: &[&str],
    ) -> Result<Step<PlotOptions>, FileError> {
        let place = ("figures", index);
        let name = self.name(place, &mut keys)?;
        let from = match keys.remove("from") {
            Some(Words::List(list)) if !list.is_empty() => list,
            _ => return Err(self.error(place, "from", "must name at least one step".to_owned())),
        };
        let mut words = vec!["plot".to_owned()];
        for step in &from {
            if !steps.contains(&step.as_str()) {
                let message = format!("there is no step `{step}`; valid steps: {}", supple_text::quoted(steps));
                let help = supple_text::nearest(step, steps);
                return Err(FileError { help, ..self.error(place, "from", message) });
            }
            words.push(tidy(&self.out.join(step)));
        }
        let format = match keys.get("format") {
            Some(Words::List(list)) => list.first().cloned().unwrap_or_default(),
            _ => "svg".to_owned(),
        };
        let output = format!("{FIGURES}/{name}.{format}");
        match self.command(place, words, keys, &output)? {
            Command::Plot(command) => Ok(Step { name, command, output, place }),
            _ => Err(self.error(place, "figure", "is not a figure".to_owned())),
        }
    }

    /// The command of some words with all other keys as its options.
    fn command(
        &self,
        place: At,
        mut words: Vec<String>,
        keys: BTreeMap<String, Words>,
        output: &str,
    ) -> Result<Command, FileError> {
        self.options(place, keys, &mut words)?;
        words.extend(["--out".to_owned(), tidy(&self.out.join(output))]);
        let run = words[0].clone();
        let words = ["supple".to_owned()].into_iter().chain(words);
        Arguments::of_words(words).map(|arguments| arguments.command).map_err(|error| self.refused(place, &run, &error))
    }

    /// An option that the command refuses, told by its key.
    fn refused(&self, place: At, command: &str, error: &clap::Error) -> FileError {
        let context = |kind| error.get(kind).map(ToString::to_string);
        let key = context(ContextKind::InvalidArg).and_then(|option| key_of(&option));
        let found = context(ContextKind::InvalidValue).unwrap_or_default();
        let told = std::error::Error::source(error).map(ToString::to_string);
        match (error.kind(), key, told) {
            (ErrorKind::UnknownArgument, Some(key), _) => {
                let near = context(ContextKind::SuggestedArg).and_then(|option| key_of(&option));
                let help = near.map(|near| format!("did you mean `{near}`?"));
                FileError { help, ..self.error(place, &key, format!("`supple {command}` has no such option")) }
            }
            (ErrorKind::MissingRequiredArgument, Some(key), _) => self.error(place, &key, "is missing".to_owned()),
            (ErrorKind::ValueValidation, Some(key), Some(told)) => self.error(place, &key, told),
            (ErrorKind::InvalidValue, Some(key), _) => {
                let found = if found.is_empty() { "true".to_owned() } else { format!("`{found}`") };
                let message = match context(ContextKind::ValidValue).filter(|valid| !valid.is_empty()) {
                    Some(valid) => format!("must be one of {valid}; found {found}"),
                    None => {
                        let help = Arguments::help_of(command, &key.replace('_', "-")).unwrap_or_default();
                        format!("takes a value ({}); found {found}", uncapitalised(&help))
                    }
                };
                self.error(place, &key, message)
            }
            (_, key, _) => {
                // The first line says what is wrong; the rest is help on the command line.
                let text = error.to_string();
                let told = text.lines().next().unwrap_or_default().trim_start_matches("error: ").to_owned();
                self.error(place, key.as_deref().unwrap_or("run"), told)
            }
        }
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

    /// The key `name`: a valid folder name on every system.
    fn name(&self, place: At, keys: &mut BTreeMap<String, Words>) -> Result<String, FileError> {
        let name = self.one(place, "name", keys)?;
        let plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '-');
        if name.is_empty() || name.len() > 64 || !name.chars().all(plain) {
            let message = format!("must be of letters from a to z, digits, `_` and `-`, at most 64; found `{name}`");
            return Err(self.error(place, "name", message));
        }
        Ok(name)
    }

    /// A key with one word, which must be there.
    fn one(&self, place: At, key: &'static str, keys: &mut BTreeMap<String, Words>) -> Result<String, FileError> {
        match keys.remove(key) {
            Some(Words::List(list)) if list.len() == 1 => Ok(list.into_iter().collect()),
            Some(_) => Err(self.error(place, key, "must be one text".to_owned())),
            None => Err(self.error(place, key, "is missing".to_owned())),
        }
    }

    /// All other keys as options.
    fn options(&self, place: At, keys: BTreeMap<String, Words>, words: &mut Vec<String>) -> Result<(), FileError> {
        for (key, value) in keys {
            if matches!(key.as_str(), "out" | "json" | "help" | "version" | "threads" | "instructions") {
                let message =
                    "is an option of `supple study`, not of a step; the result of a step is stored in a folder with its name".to_owned();
                return Err(self.error(place, &key, message));
            }
            let option = format!("--{}", key.replace('_', "-"));
            match value {
                Words::Flag(true) => words.push(option),
                Words::Flag(false) => {}
                // With `=`, so that a value that begins with `-` is not parsed as an option.
                Words::List(list) => words.extend(list.into_iter().map(|value| format!("{option}={value}"))),
            }
        }
        Ok(())
    }

    fn error(&self, (list, index): At, key: &str, message: String) -> FileError {
        self.document.error(&[list.into(), index.into(), Place::Key(key)], message)
    }
}

/// A text with its first letter in lower case.
fn uncapitalised(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_lowercase().chain(letters).collect())
}

/// A path without `.` and, where they lead up from a named folder, `..`.
fn tidy(path: &Path) -> String {
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
    tidy.display().to_string()
}
