mod robot;

use std::io::ErrorKind;
use std::path::Path;

use crate::Outcome;
use crate::arguments::NewOptions;
use crate::failure::Failure;
use crate::output::{print_text, write_new};

const TEMPLATE: &str = include_str!("../../templates/new.toml");

/// `supple new NAME`
pub fn new(options: &NewOptions) -> Result<Outcome, Failure> {
    let name = options.name.trim_end_matches(".toml");
    let title = match Path::new(name).file_name() {
        Some(stem) if !name.ends_with(std::path::is_separator) => stem.to_string_lossy(),
        _ => return Err(Failure::usage(format!("`{}` is no name for a file", options.name))),
    };
    let path = format!("{name}.toml");
    let title = title.replace(['\\', '"'], "'").replace(char::is_control, " ");
    let text = match &options.robot {
        None => TEMPLATE.replace("@TITLE@", &title),
        Some(file) => {
            let folder = Path::new(&path).parent().unwrap_or(Path::new(""));
            robot::task(&title, file, &options.package_roots, folder)?
        }
    };
    write_new(Path::new(&path), &text).map_err(|error| match error.kind() {
        ErrorKind::AlreadyExists => Failure::usage(format!("{path} exists already; nothing was written")),
        _ => Failure::write(&path, error),
    })?;
    let command = if options.robot.is_some() { "evaluate" } else { "design" };
    print_text(&format!("wrote {path}\nnow try: supple {command} {path}\n"))?;
    Ok(Outcome::Success)
}
