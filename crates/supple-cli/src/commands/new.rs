use std::io::Write;
use std::path::Path;

use crate::Outcome;
use crate::arguments::NewOptions;
use crate::failure::Failure;
use crate::output::print_text;

const TEMPLATE: &str = include_str!("../../templates/new.toml");

/// `supple new NAME`
pub fn new(options: &NewOptions) -> Result<Outcome, Failure> {
    let name = options.name.trim_end_matches(".toml");
    if name.is_empty() {
        return Err(Failure::usage("the name of a task must not be empty".into()));
    }
    let path = format!("{name}.toml");
    let title = Path::new(name).file_name().map_or_else(|| name.to_owned(), |stem| stem.to_string_lossy().into_owned());
    let title = title.replace(['\\', '"'], "'");
    let text = TEMPLATE.replace("@TITLE@", &title);
    let fail = |error: std::io::Error| match error.kind() {
        std::io::ErrorKind::AlreadyExists => Failure::usage(format!("{path} exists already; nothing was written")),
        _ => Failure::write(&path, error),
    };
    let mut file = std::fs::OpenOptions::new().write(true).create_new(true).open(&path).map_err(fail)?;
    file.write_all(text.as_bytes()).map_err(fail)?;
    print_text(&format!("wrote {path}\nnow try: supple design {path}\n"))?;
    Ok(Outcome::Success)
}
