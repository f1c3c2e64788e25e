//! Results with all that made them: kept, read again, drawn and shown.

use std::path::PathBuf;
use std::sync::Arc;

use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyList};
use supple_figures::{FigureError, Format, Kind, Width, draw, render};
use supple_study::study::Study;
use supple_study::sweep::Holds;
use supple_study::{Cell, Folder, Made, StudyResult, Table};

use crate::arrays::to_python;
use crate::errors;
use crate::own::Failures;
use crate::watch::long;

/// A result and what made it.
#[pyclass(name = "Kept", module = "supple._supple", frozen)]
pub struct Kept(pub Arc<Folder>);

impl Kept {
    /// A result that is in no folder yet.
    pub fn new(made: Made, result: StudyResult) -> Self {
        Self(Arc::new(Folder { path: PathBuf::new(), made, result }))
    }
}

#[pymethods]
impl Kept {
    /// Reads a folder.
    #[staticmethod]
    fn load(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        let folder = py.detach(|| Folder::load(&path)).map_err(|error| errors::of_study(py, &error))?;
        Ok(Self(Arc::new(folder)))
    }

    /// Writes a folder that the command line reads too.
    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        let Folder { made, result, .. } = &*self.0;
        py.detach(|| Folder::save(&path, made, result)).map_err(|error| errors::of_study(py, &error))
    }

    /// `design`, `evaluate`, `sweep`...
    #[getter]
    fn kind(&self) -> &'static str {
        self.0.result.kind()
    }

    /// The words of the command line that asks for the same.
    fn words(&self) -> Vec<String> {
        self.0.made.study.as_ref().map(Study::words).unwrap_or_default()
    }

    /// What made it, as a dict.
    fn made(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        to_python(py, &self.0.made)
    }

    /// The result as dicts, lists and arrays.
    fn data(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        match &self.0.result {
            StudyResult::Design(result) => to_python(py, result),
            StudyResult::Evaluate(result) => to_python(py, &result.evaluation),
            StudyResult::Sweep(result) => to_python(py, result),
            StudyResult::Robustness(result) => to_python(py, result),
            StudyResult::Pareto(result) => to_python(py, result),
            StudyResult::Trace(result) => to_python(py, result),
            StudyResult::Sensors(result) => to_python(py, result),
            StudyResult::Bound(result) => to_python(py, result),
            StudyResult::Study(result) => to_python(py, result),
        }
    }

    /// The result as the command line prints it with `--json`.
    fn json(&self, py: Python<'_>) -> PyResult<String> {
        self.0.result.json().map_err(|error| errors::of_study(py, &error))
    }

    /// The columns of a sweep's table by name: arrays of numbers, NaN where there is none, of whole numbers, of
    /// booleans, or lists of texts; whole numbers and booleans are numbers where one is missing.
    fn columns<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        if let StudyResult::Sweep(sweep) = &self.0.result {
            for (index, column) in sweep.table.columns.iter().enumerate() {
                dict.set_item(&column.name, self::column(py, &sweep.table, index)?)?;
            }
        }
        Ok(dict)
    }

    /// A figure of this and other results, as the bytes of a file.
    #[pyo3(signature = (figure, format, *, others, task, wide))]
    fn plot<'py>(
        &self,
        py: Python<'py>,
        figure: &str,
        format: &str,
        others: Vec<Py<Self>>,
        task: Option<String>,
        wide: bool,
    ) -> PyResult<Bound<'py, PyBytes>> {
        let kind = kind_of(py, figure)?;
        let formats = [Format::Svg, Format::Png, Format::Pdf];
        let known = formats.into_iter().find(|known| known.extension() == format);
        let format =
            known.ok_or_else(|| errors::usage(py, &format!("unknown format `{format}`; valid: svg, png, pdf")))?;
        let folders = self.with(&others);
        let width = if wide { Width::Page } else { Width::Column };
        let drawn = py.detach(|| draw(kind, &folders, task.as_deref()).and_then(|drawn| render(&drawn, format, width)));
        Ok(PyBytes::new(py, &drawn.map_err(|error| figure_error(py, error))?))
    }

    /// What a figure shows, as dicts, lists and arrays: panels with their axes and series.
    #[pyo3(signature = (figure, *, others, task))]
    fn figure(&self, py: Python<'_>, figure: &str, others: Vec<Py<Self>>, task: Option<String>) -> PyResult<Py<PyAny>> {
        let (kind, folders) = (kind_of(py, figure)?, self.with(&others));
        let drawn = py.detach(|| draw(kind, &folders, task.as_deref()));
        to_python(py, &drawn.map_err(|error| figure_error(py, error))?)
    }

    /// The page of this and other results, HTML.
    fn report(&self, py: Python<'_>, others: Vec<Py<Self>>) -> PyResult<String> {
        let folders = self.with(&others);
        let page = long(py, None, &Failures::default(), |_| supple_report::page(&folders))?;
        page.map_err(|error| match error {
            supple_report::ReportError::Study(error) => errors::of_study(py, &error),
            other => errors::usage(py, &in_python(&other.to_string())),
        })
    }

    /// What the columns of a sweep's table hold, by name: `numbers`, `counts`, `truths` or `texts`.
    fn kinds(&self) -> Vec<(String, &'static str)> {
        let StudyResult::Sweep(sweep) = &self.0.result else { return Vec::new() };
        let word = |column| match Holds::of(column) {
            Holds::Numbers => "numbers",
            Holds::Counts => "counts",
            Holds::Truths => "truths",
            Holds::Texts => "texts",
        };
        sweep.table.columns.iter().map(|column| (column.name.clone(), word(column))).collect()
    }
}

fn kind_of(py: Python<'_>, figure: &str) -> PyResult<Kind> {
    let kind = Kind::ALL.iter().copied().find(|kind| kind.name() == figure);
    kind.ok_or_else(|| errors::usage(py, &format!("unknown figure `{figure}`")))
}

fn figure_error(py: Python<'_>, error: FigureError) -> PyErr {
    match error {
        FigureError::Study(error) => errors::of_study(py, &error),
        other => errors::usage(py, &in_python(&other.to_string())),
    }
}

/// A sentence about command lines and folders in the words of Python: commands are methods, and folders results.
fn in_python(text: &str) -> String {
    let mut text =
        text.replace("`supple bound --curve`", "`task.bound(curve=True)`").replace("`--curve`", "`curve=True`");
    for command in ["design", "evaluate", "sweep", "robustness", "pareto", "trace", "bound", "sensors"] {
        text = text.replace(&format!("`supple {command}`"), &format!("`task.{command}()`"));
    }
    text = text.replace("recompute the result with this version of supple", "make it with `trajectories=True`");
    let text = text.replace("folders of other results", "other results").replace("folder of `task", "result of `task");
    // A result that was made here is in no folder.
    let text = text.replace("given:  (of ", "given: (of ").replace(",  (of ", ", (of ");
    match text.strip_prefix(": ") {
        Some(rest) => format!("the result {rest}"),
        None => text,
    }
}

impl Kept {
    /// This one's folder and those of others.
    fn with(&self, others: &[Py<Self>]) -> Vec<Folder> {
        std::iter::once(&self.0)
            .chain(others.iter().map(|other| &other.get().0))
            .map(|folder| (**folder).clone())
            .collect()
    }
}

/// A column: numbers, unless there is a text in it.
fn column<'py>(py: Python<'py>, table: &Table, index: usize) -> PyResult<Bound<'py, PyAny>> {
    let cells = || table.rows.iter().map(|row| &row[index]);
    let whole: Option<Vec<f64>> =
        cells().map(|cell| if let Cell::Number(n) = cell { Some(*n) } else { None }).collect();
    match (Holds::of(&table.columns[index]), whole) {
        (Holds::Counts, Some(numbers)) => {
            return Ok(PyArray1::from_iter(py, numbers.into_iter().map(|number| number as i64)).into_any());
        }
        (Holds::Truths, Some(numbers)) => {
            return Ok(PyArray1::from_iter(py, numbers.into_iter().map(|number| number == 1.0)).into_any());
        }
        _ => {}
    }
    if cells().any(|cell| matches!(cell, Cell::Text(_))) {
        let text = |cell: &Cell| match cell {
            Cell::Text(text) => Some(text.clone()),
            Cell::Number(number) => Some(number.to_string()),
            Cell::Missing => None,
        };
        return Ok(PyList::new(py, cells().map(text))?.into_any());
    }
    let number = |cell: &Cell| if let Cell::Number(number) = cell { *number } else { f64::NAN };
    Ok(PyArray1::from_iter(py, cells().map(number)).into_any())
}
