//! Every path that the documents of the repository name exists, and ARCHITECTURE.md leaves no module out.

use std::error::Error;
use std::fs;
use std::path::Path;

const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../");

const DOCUMENTS: [&str; 3] = ["README.md", "ARCHITECTURE.md", "CONTRIBUTING.md"];

/// What stands between back quotes, outside of blocks of code.
fn quoted(text: &str) -> impl Iterator<Item = &str> {
    text.split("```").step_by(2).flat_map(|text| text.split('`').skip(1).step_by(2))
}

/// The targets of links.
fn links(text: &str) -> impl Iterator<Item = &str> {
    text.split("](").skip(1).filter_map(|rest| rest.split_once(')').map(|(target, _)| target))
}

/// Whether a quoted word names a file or a folder of the repository, rather than code or a pattern.
fn is_path(word: &str) -> bool {
    let plain = word.chars().all(|c| c.is_ascii_alphanumeric() || "/._-".contains(c));
    let ending = [".rs", ".toml", ".md", ".json", ".svg"].iter().any(|ending| word.ends_with(ending));
    // Names in capitals stand for names to choose: `crates/supple/src/cost/NAME.rs`.
    plain && (word.contains('/') || ending) && !word.contains("NAME")
}

#[test]
fn every_path_exists() -> Result<(), Box<dyn Error>> {
    let mut missing = Vec::new();
    for document in DOCUMENTS {
        let text = fs::read_to_string(Path::new(ROOT).join(document))?;
        let targets =
            links(&text).filter(|target| !target.contains("://")).filter_map(|target| target.split('#').next());
        let mut paths: Vec<&str> = quoted(&text).filter(|word| is_path(word)).chain(targets).collect();
        paths.retain(|path| !Path::new(ROOT).join(path).exists());
        missing.extend(paths.into_iter().map(|path| format!("{document}: {path}")));
    }
    assert!(missing.is_empty(), "these do not exist: {missing:#?}");
    Ok(())
}

#[test]
fn every_module_is_on_the_map() -> Result<(), Box<dyn Error>> {
    let text = fs::read_to_string(Path::new(ROOT).join("ARCHITECTURE.md"))?;
    let named: Vec<&str> = quoted(&text).map(|word| word.trim_end_matches('/')).collect();
    let mut missing = Vec::new();
    for member in fs::read_dir(Path::new(ROOT).join("crates"))? {
        let name = member?.file_name().to_string_lossy().into_owned();
        for entry in fs::read_dir(Path::new(ROOT).join("crates").join(&name).join("src"))? {
            let path = format!("crates/{name}/src/{}", entry?.file_name().to_string_lossy());
            if !named.contains(&path.as_str()) {
                missing.push(path);
            }
        }
    }
    assert!(missing.is_empty(), "ARCHITECTURE.md does not name {missing:#?}");
    Ok(())
}
