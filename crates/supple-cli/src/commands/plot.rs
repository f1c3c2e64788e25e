use std::path::{Path, PathBuf};

use clap::ValueEnum;
use supple_figures::{FigureError, Kind, draw, render};
use supple_study::{Folder, check_writable, write_text};

use crate::arguments::{FigureArgument, Format, PlotOptions, Width};
use crate::failure::Failure;
use crate::outcome::Outcome;
use crate::output::{print_text, warn, warn_changed};

/// Checks that this program can draw figures.
///
/// # Errors
/// None: this build includes figures.
pub fn check_figures() -> Result<(), Failure> {
    Ok(())
}

/// `supple plot`
pub fn plot(options: &PlotOptions) -> Result<Outcome, Failure> {
    let (kind, format) = (kind(options.figure), format(options)?);
    let standard = || PathBuf::from(format!("{}.{}", kind.name(), format.extension()));
    let out = options.out.clone().unwrap_or_else(standard);
    let folder = out.parent().map(PathBuf::from).unwrap_or_default();
    let name = out.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    if name.is_empty() {
        return Err(Failure::usage(format!("--out: {} is not a file name", out.display())));
    }
    check_writable(&folder, &name)?;
    let folders = Folder::load_all(&options.folders)?;
    folders.iter().for_each(|folder| warn_changed(&folder.path));
    if let Some(other) = of_another_task(&folders) {
        let [first, other] = [&folders[0], other].map(|folder| folder.path.display());
        warn(&format!("{other} was made of another task file than {first}: the figure draws them as if of one"));
    }
    let figure = draw(kind, &folders, options.task.as_deref()).map_err(failure)?;
    let width = match options.width {
        Width::Column => supple_figures::Width::Column,
        Width::Page => supple_figures::Width::Page,
    };
    write_text(&out, &render(&figure, format, width).map_err(failure)?)?;
    print_text(&format!("wrote {}\n", out.display()))?;
    Ok(Outcome::Success)
}

/// The first folder whose task, or robot, is written differently from that of the first one.
fn of_another_task(folders: &[Folder]) -> Option<&Folder> {
    let texts = |folder: &Folder| folder.made.sources.iter().map(|source| source.text.clone()).collect::<Vec<_>>();
    let first = texts(folders.first()?);
    folders.iter().find(|folder| texts(folder) != first)
}

fn failure(error: FigureError) -> Failure {
    match error {
        FigureError::Study(error) => error.into(),
        other => Failure::usage(other.to_string()),
    }
}

fn kind(argument: FigureArgument) -> Kind {
    match argument {
        FigureArgument::Landscape => Kind::Landscape,
        FigureArgument::Belief => Kind::Belief,
        FigureArgument::Gains => Kind::Gains,
        FigureArgument::Robustness => Kind::Robustness,
        FigureArgument::Pareto => Kind::Pareto,
        FigureArgument::Information => Kind::Information,
        FigureArgument::Bound => Kind::Bound,
        FigureArgument::Motion => Kind::Motion,
    }
}

/// The format of `--format`, or of the extension of `--out`; they must not conflict.
fn format(options: &PlotOptions) -> Result<supple_figures::Format, Failure> {
    let ending = options.out.as_ref().and_then(|out| out.extension()).map(|ending| ending.to_string_lossy());
    let of_ending = ending.as_deref().map(|ending| Format::from_str(ending, true).ok());
    let format = match (options.format, of_ending) {
        (None, None) => Format::Svg,
        (Some(format), None) | (None, Some(Some(format))) => format,
        (Some(format), Some(of_ending)) if of_ending == Some(format) => format,
        _ => {
            let out = options.out.as_deref().unwrap_or(Path::new("")).display();
            let asked = options.format.map(|format| format!(" for --format {}", of_figures(format).extension()));
            return Err(Failure::usage(format!(
                "--out {out}: `.{}` is not the extension of a figure{}; use .svg, .png or .pdf",
                ending.unwrap_or_default(),
                asked.unwrap_or_default()
            )));
        }
    };
    Ok(of_figures(format))
}

fn of_figures(format: Format) -> supple_figures::Format {
    match format {
        Format::Svg => supple_figures::Format::Svg,
        Format::Png => supple_figures::Format::Png,
        Format::Pdf => supple_figures::Format::Pdf,
    }
}
