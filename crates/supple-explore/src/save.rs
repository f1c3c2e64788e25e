//! What is kept of the design on screen: a result, a report, or a task file that begins with it.

use std::path::{Path, PathBuf};

use supple::Matrices;
use supple_file::{Document, Place, parse_document};
use supple_study::evaluate::EvaluateOptions;
use supple_study::study::Work;
use supple_study::{Folder, LoadedTask, Made, OWN_MODEL, Source, Watch, write_text};

use crate::knobs::{Kind, Knob, Turned, changes, covariance, turned};
use crate::noise_text::{Edit, noise_edits, plain_number};

/// By how much a number that is read back from a file may differ, relative to it: rounding.
const ROUNDING: f64 = 1e-12;

/// A design on screen.
#[derive(Clone, Copy)]
pub struct OnScreen<'a> {
    /// The task file.
    pub loaded: &'a LoadedTask,
    /// What can be turned.
    pub knobs: &'a [Knob],
    /// The values of all knobs.
    pub values: &'a [f64],
}

impl OnScreen<'_> {
    /// The task file's path.
    fn path(&self) -> &Path {
        Path::new(self.loaded.sources.first().map_or("task.toml", |source| &source.path))
    }

    /// The name of the task file, without its ending.
    fn stem(&self) -> String {
        self.path().file_stem().map_or_else(|| "task".to_owned(), |stem| stem.to_string_lossy().into_owned())
    }

    /// The options of the program that set the parameters of this design; what they cannot set follows as a comment of
    /// a shell.
    pub fn set_text(&self) -> String {
        let changes = changes(&self.loaded.problem, self.knobs, self.values);
        let options = changes.parameters.iter().map(|(name, value)| format!("--set {name}={value:?}"));
        let options = options.collect::<Vec<String>>().join(" ");
        let limits = changes.limits.iter().map(|(name, _, limit)| format!("{name} = {limit:?}"));
        let noise = changes.noise.iter().map(|one| format!("{} × {:?}", one.name, one.factor));
        let rest: Vec<String> = limits.chain(noise).collect();
        if rest.is_empty() {
            return options;
        }
        let text = format!("{options}  # no options set {}: save the task file to keep them", rest.join(", "));
        text.trim_start().to_owned()
    }

    /// The task file with these parameters, limits and noise as its own; comments stay.
    ///
    /// # Errors
    /// Where the file cannot be edited: what stands in the way.
    pub fn task_text(&self) -> Result<String, String> {
        let changes = changes(&self.loaded.problem, self.knobs, self.values);
        let text = self.loaded.sources.first().map_or("", |source| &source.text);
        let name = self.path().display().to_string();
        let document = parse_document(text, &name).map_err(|error| error.to_string())?;
        let mut edits = Vec::new();
        for (parameter, value) in changes.parameters {
            edits.push(edit(&document, &["parameters".into(), parameter.into(), "initial".into()], value)?);
        }
        for (_, task, value) in changes.limits {
            edits.push(edit(&document, &["tasks".into(), task.into(), "bound".into()], value)?);
        }
        edits.extend(noise_edits(text, &self.loaded.problem, &changes.noise)?);
        // Apply edits from the end, so that earlier positions stay valid.
        edits.sort_by_key(|edit| std::cmp::Reverse(edit.0.start));
        let mut new = text.to_owned();
        edits.into_iter().for_each(|(span, number)| new.replace_range(span, &number));
        self.check(&new, &name)?;
        Ok(new)
    }

    /// Checks that a text describes the design on screen.
    fn check(&self, text: &str, name: &str) -> Result<(), String> {
        let read = supple_file::parse_with(text, name, self.loaded.kinds.clone()).map_err(|error| error.to_string())?;
        let Turned { problem: turned, phi } = turned(self.loaded, self.knobs, self.values)?;
        let parameters = read.parameters.initial();
        let is_near = |a: f64, b: f64| (a - b).abs() <= ROUNDING * a.abs().max(b.abs());
        if !parameters.iter().zip(&phi).all(|(&a, &b)| is_near(a, b)) {
            return Err("the file gives a parameter another value than the one on screen".to_owned());
        }
        for (ours, theirs) in turned.tasks.iter().zip(&read.tasks) {
            let [limit, written] =
                [ours, theirs].map(|task| task.bound.as_ref().map(|bound| bound.resolve::<f64>(&phi)));
            if limit != written {
                return Err(format!("the limit of {} cannot be written to the file", ours.name));
            }
            for kind in [Kind::Initial, Kind::Process, Kind::Measurement] {
                let [ours, theirs] = [ours, theirs].map(|task| {
                    let mut matrix = Matrices::default();
                    covariance(task, kind).resolve(&phi, &mut matrix);
                    matrix
                });
                let (ours, theirs) = (ours.as_slice(), theirs.as_slice());
                if ours.len() != theirs.len() || !ours.iter().zip(theirs).all(|(&a, &b)| is_near(a, b)) {
                    return Err(
                        "the noise cannot be saved: its numbers occur more than once or in an expression; reset the noise sliders to 1, or use parameters in the file"
                            .to_owned(),
                    );
                }
            }
        }
        Ok(())
    }

    /// This design as a task, whose file has it as its own.
    ///
    /// # Errors
    /// Where the file cannot be edited; or where there is none, as Python describes the task, and limits or noise were
    /// turned.
    pub fn task(&self) -> Result<LoadedTask, String> {
        let LoadedTask { problem, sources, .. } = self.loaded;
        if sources.first().is_none_or(|source| source.path == OWN_MODEL) {
            let changes = changes(problem, self.knobs, self.values);
            let first =
                changes.limits.iter().map(|(name, ..)| *name).chain(changes.noise.iter().map(|one| one.name)).next();
            if let Some(name) = first {
                return Err(format!(
                    "`{name}` has been changed but is not a parameter, and this task has no file: change it in the definition of the task, or reset its slider"
                ));
            }
            let Turned { phi, .. } = turned(self.loaded, self.knobs, self.values)?;
            return Ok(LoadedTask { phi, ..self.loaded.clone() });
        }
        let kinds = self.loaded.kinds.clone();
        LoadedTask::restore_with(&self.sources(self.task_text()?), kinds).map_err(|error| error.to_string())
    }

    /// The files of the task, with another text of the task file.
    fn sources(&self, text: String) -> Vec<Source> {
        let mut sources = self.loaded.sources.clone();
        if let Some(first) = sources.first_mut() {
            first.text = text;
        }
        sources
    }

    /// Writes the task file of this design beside the one that is shown, under a name that is free.
    ///
    /// # Errors
    /// Where it cannot be written: why.
    pub fn save_task(&self) -> Result<PathBuf, String> {
        let text = self.task_text()?;
        let folder = self.path().parent().unwrap_or(Path::new(""));
        let path = free(folder, &format!("{}_explored", self.stem()), ".toml");
        write_text(&path, text.as_bytes()).map_err(|error| error.to_string())?;
        Ok(path)
    }

    /// Evaluates this design as `supple evaluate` does, with trajectories and roll-outs.
    fn folder(&self, path: PathBuf) -> Result<Folder, String> {
        let Turned { problem, phi } = turned(self.loaded, self.knobs, self.values)?;
        let text = self.task_text()?;
        let work = Work::Evaluate(EvaluateOptions {
            total_gradient: true,
            needed: true,
            rollouts: problem.rollouts(None),
            trajectories: true,
            ..Default::default()
        });
        let task = LoadedTask { problem, phi, sources: self.sources(text), kinds: self.loaded.kinds.clone() };
        let watch = Watch::default();
        let result = work.run(&task, None, watch).map_err(|error| error.to_string())?;
        Ok(Folder { path, made: Made::of(&task, work), result })
    }

    /// Writes the folder of a result to the current folder, under a name that is free.
    ///
    /// # Errors
    /// Where the design cannot be evaluated or written: why.
    pub fn save_result(&self) -> Result<PathBuf, String> {
        let path = free(Path::new(""), &format!("{}_explored", self.stem()), "");
        let Folder { path, made, result } = self.folder(path)?;
        Folder::save(&path, &made, &result).map_err(|error| error.to_string())?;
        Ok(path)
    }

    /// Writes a report of this design to the current folder, under a name that is free.
    ///
    /// # Errors
    /// Where the design cannot be evaluated or written: why.
    pub fn save_report(&self) -> Result<PathBuf, String> {
        let path = free(Path::new(""), &format!("{}_explored", self.stem()), ".html");
        let folder = self.folder(PathBuf::from("explored"))?;
        let page = supple_report::page(&[folder]).map_err(|error| error.to_string())?;
        write_text(&path, page.as_bytes()).map_err(|error| error.to_string())?;
        Ok(path)
    }
}

/// Where a number stands in a task file, and what takes its place.
fn edit(document: &Document, at: &[Place], number: f64) -> Result<Edit, String> {
    let found = document.error(at, "is not a plain number, so another one cannot be written in its place");
    let plain = found.text.get(found.span.clone()).and_then(plain_number).is_some();
    if plain { Ok((found.span, format!("{number:?}"))) } else { Err(found.to_string()) }
}

/// A name that no file has yet.
fn free(folder: &Path, stem: &str, ending: &str) -> PathBuf {
    let numbered = (2..).map(|number| format!("{stem}_{number}{ending}"));
    let mut names = std::iter::once(format!("{stem}{ending}")).chain(numbered);
    names.find_map(|name| Some(folder.join(name)).filter(|path| !path.exists())).unwrap_or_default()
}
