//! Study files: several studies and figures in one file, made by one command.
//!
//! A step is a command of `supple`: the keys of its table are the command's long options.

use std::collections::BTreeMap;
use std::path::{Component, Path, PathBuf};

use serde::de::{SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};
use supple::FileError;
use supple_file::{Document, Place, parse_document, read_text};

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
#[derive(Clone, Debug)]
pub struct StudyFile {
    /// What it is, for people.
    pub title: String,
    /// Its steps, in order.
    pub steps: Vec<Step>,
    /// Its figures, drawn after all steps.
    pub figures: Vec<Step>,
    /// The file's name and text.
    pub source: crate::Source,
}

/// A command of a study.
///
/// Example: [`StudyFile`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Step {
    /// Its name: of its folder, or of the figure's file.
    pub name: String,
    /// The words that one would type after `supple`.
    pub words: Vec<String>,
    /// What they make, as seen from the folder of the study.
    pub output: String,
    /// What the words are about in the file, for errors.
    place: (&'static str, usize),
}

/// Commands that a step may run.
const COMMANDS: [&str; 8] = ["bound", "design", "evaluate", "pareto", "robustness", "sensors", "sweep", "trace"];

/// The page that a study ends in.
pub const REPORT: &str = "report.html";

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
    /// Where the file cannot be read or anything in it is wrong; whether the options are those of the commands is for
    /// the command line to say.
    pub fn load(path: &Path, out: &Path) -> Result<Self, FileError> {
        let (name, text) = (path.display().to_string(), read_text(path)?);
        let document = parse_document(&text, &name)?;
        let top: Top = document.read(&[])?;
        if top.steps.is_empty() {
            return Err(document.error(&[], "a study needs at least one table [[steps]]"));
        }
        let reading = Reading { document: &document, folder: path.parent().unwrap_or(Path::new("")), out };
        let steps = top.steps.into_iter().enumerate().map(|(index, keys)| reading.step(index, keys));
        let steps = steps.collect::<Result<Vec<_>, _>>()?;
        reading.check_names(&steps)?;
        let figures = top.figures.into_iter().enumerate().map(|(index, keys)| reading.figure(index, keys, &steps));
        let figures = figures.collect::<Result<Vec<_>, _>>()?;
        reading.check_names(&figures)?;
        let source = crate::Source { path: name.clone(), text: text.clone() };
        Ok(Self { title: top.title, steps, figures, source })
    }

    /// An error about a step or figure, such as an option that its command does not have.
    pub fn error(&self, step: &Step, message: impl Into<String>) -> FileError {
        match parse_document(&self.source.text, &self.source.path) {
            Ok(document) => document.error(&[step.place.0.into(), step.place.1.into()], message),
            Err(error) => error,
        }
    }
}

/// What reading steps needs.
struct Reading<'a> {
    document: &'a Document<'a>,
    /// The folder of the study file, from which its paths go.
    folder: &'a Path,
    out: &'a Path,
}

impl Reading<'_> {
    fn step(&self, index: usize, mut keys: BTreeMap<String, Words>) -> Result<Step, FileError> {
        let place = ("steps", index);
        let name = self.name(place, &mut keys)?;
        if name == FIGURES {
            return Err(self.error(
                place,
                "name",
                format!("`{FIGURES}` is reserved for the figures folder; choose another name"),
            ));
        }
        let command = self.one(place, "run", &mut keys)?;
        if !COMMANDS.contains(&command.as_str()) {
            let message = format!("must be one of {}; found `{command}`", supple_text::quoted(&COMMANDS));
            let help = supple_text::nearest(&command, &COMMANDS);
            return Err(FileError { help, ..self.error(place, "run", message) });
        }
        let task = self.one(place, "task", &mut keys)?;
        let mut words = vec![command, tidy(&self.folder.join(task))];
        self.options(place, keys, &mut words)?;
        words.extend(["--out".to_owned(), tidy(&self.out.join(&name))]);
        Ok(Step { output: name.clone(), name, words, place })
    }

    fn figure(&self, index: usize, mut keys: BTreeMap<String, Words>, steps: &[Step]) -> Result<Step, FileError> {
        let place = ("figures", index);
        let name = self.name(place, &mut keys)?;
        let from = match keys.remove("from") {
            Some(Words::List(list)) if !list.is_empty() => list,
            _ => return Err(self.error(place, "from", "must name at least one step".to_owned())),
        };
        let mut words = vec!["plot".to_owned()];
        for step in &from {
            let names: Vec<&str> = steps.iter().map(|step| step.name.as_str()).collect();
            if !names.contains(&step.as_str()) {
                let message = format!("there is no step `{step}`; valid steps: {}", supple_text::quoted(&names));
                let help = supple_text::nearest(step, &names);
                return Err(FileError { help, ..self.error(place, "from", message) });
            }
            words.push(tidy(&self.out.join(step)));
        }
        let format = match keys.get("format") {
            Some(Words::List(list)) => list.first().cloned().unwrap_or_default(),
            _ => "svg".to_owned(),
        };
        self.options(place, keys, &mut words)?;
        let output = format!("{FIGURES}/{name}.{format}");
        words.extend(["--out".to_owned(), tidy(&self.out.join(&output))]);
        Ok(Step { name, words, output, place })
    }

    /// Every step needs a name of its own.
    fn check_names(&self, list: &[Step]) -> Result<(), FileError> {
        for (index, step) in list.iter().enumerate() {
            if list[..index].iter().any(|other| other.name == step.name) {
                let message = format!("the name `{}` occurs twice; names must be unique", step.name);
                return Err(self.error(step.place, "name", message));
            }
        }
        Ok(())
    }

    /// The key `name`: a valid folder name on every system.
    fn name(&self, place: (&'static str, usize), keys: &mut BTreeMap<String, Words>) -> Result<String, FileError> {
        let name = self.one(place, "name", keys)?;
        let plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '-');
        if name.is_empty() || name.len() > 64 || !name.chars().all(plain) {
            let message = format!("must be of letters, digits, `_` and `-`, at most 64; found `{name}`");
            return Err(self.error(place, "name", message));
        }
        Ok(name)
    }

    /// A key with one word, which must be there.
    fn one(
        &self,
        place: (&'static str, usize),
        key: &'static str,
        keys: &mut BTreeMap<String, Words>,
    ) -> Result<String, FileError> {
        match keys.remove(key) {
            Some(Words::List(list)) if list.len() == 1 => Ok(list.into_iter().collect()),
            Some(_) => Err(self.error(place, key, "must be one text".to_owned())),
            None => Err(self.error(place, key, "is missing".to_owned())),
        }
    }

    /// All other keys as options.
    fn options(
        &self,
        place: (&'static str, usize),
        keys: BTreeMap<String, Words>,
        words: &mut Vec<String>,
    ) -> Result<(), FileError> {
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

    fn error(&self, (list, index): (&'static str, usize), key: &str, message: String) -> FileError {
        self.document.error(&[list.into(), index.into(), Place::Key(key)], message)
    }
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
