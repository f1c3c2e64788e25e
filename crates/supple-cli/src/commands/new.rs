mod ask;
mod costs;
mod draft;
mod joints;
mod limb;
mod place;
mod robot;
mod rules;
mod templates;
mod tool;
mod tried;

use std::io::ErrorKind;
use std::path::Path;

use supple_text::shell_word;

use crate::arguments::{ModelKind, NewOptions};
use crate::failure::Failure;
use crate::outcome::Outcome;
use crate::output::{print_text, write_new};
use ask::Asked;

const TWO_MASS: &str = include_str!("../../templates/new.toml");
const LINEAR: &str = include_str!("../../templates/linear.toml");
/// Robot file for `--model robot`.
const ARM: &str = include_str!("../../templates/arm.urdf");

/// `supple new NAME`
pub fn new(options: &NewOptions) -> Result<Outcome, Failure> {
    let name = options.name.trim_end_matches(".toml");
    let title = match Path::new(name).file_name() {
        Some(stem) if !name.ends_with(std::path::is_separator) => stem.to_string_lossy(),
        _ => return Err(Failure::usage(format!("`{}` is not a file name", options.name))),
    };
    let path = format!("{name}.toml");
    if Path::new(&path).exists() {
        return Err(taken(&path));
    }
    let title = title.replace(['\\', '"'], "'").replace(char::is_control, " ");
    let folder = Path::new(&path).parent().unwrap_or(Path::new(""));
    if !folder.as_os_str().is_empty() && !folder.is_dir() {
        let folder = folder.display();
        return Err(Failure::usage(format!(
            "{path}: there is no folder {folder}; create it first, or choose another NAME"
        )));
    }
    let asked = Asked::of(options)?;
    let mut wrote = path.clone();
    let (text, chosen) = match (&asked.robot, asked.model) {
        (Some(file), _) => match asked.template {
            Some(_) => draft::task(&title, file, &path, &asked)?,
            None => robot::task(&title, file, &path, &asked)?,
        },
        (None, ModelKind::TwoMass) => (TWO_MASS.replace("@TITLE@", &title), None),
        (None, ModelKind::Linear) => (LINEAR.replace("@TITLE@", &title), None),
        (None, ModelKind::Robot) => {
            let arm = format!("{name}.urdf");
            write(&arm, ARM)?;
            wrote = format!("{arm} and {path}");
            let (text, _) = draft::task(&title, Path::new(&arm), &path, &asked)?;
            (text, None)
        }
    };
    write(&path, &text)?;
    let command = if asked.robot.is_some() && asked.template.is_none() { "evaluate" } else { "design" };
    let chosen = chosen.map_or_else(String::new, |chosen| format!("{chosen}\n"));
    print_text(&format!("wrote {wrote}\n{chosen}Next: supple {command} {}\n", shell_word(&path)))?;
    Ok(Outcome::Success)
}

fn write(path: &str, text: &str) -> Result<(), Failure> {
    write_new(Path::new(path), text).map_err(|error| match error.kind() {
        ErrorKind::AlreadyExists => taken(path),
        _ => Failure::write(path, error),
    })
}

fn taken(path: &str) -> Failure {
    Failure::usage(format!("{path} already exists; nothing was written"))
}
