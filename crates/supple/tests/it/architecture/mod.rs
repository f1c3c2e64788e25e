//! Every path that the documents of the repository name exists, ARCHITECTURE.md leaves no crate and no module out, and every
//! equation that is cited stands in the theory.

use std::collections::BTreeMap;
use std::error::Error;
use std::fs;
use std::path::{Path, PathBuf};

use modules::{Crate, Import, Module, between_all, between_siblings, circles};

mod modules;

const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../");

/// All documents, by path from the root.
fn documents() -> Result<Vec<PathBuf>, Box<dyn Error>> {
    let mut documents: Vec<PathBuf> =
        ["README.md", "ARCHITECTURE.md", "CONTRIBUTING.md", "CHANGELOG.md"].map(PathBuf::from).to_vec();
    for folder in ["docs", "docs/theory"] {
        for entry in fs::read_dir(Path::new(ROOT).join(folder))? {
            let path = Path::new(folder).join(entry?.file_name());
            if path.extension().is_some_and(|extension| extension == "md") {
                documents.push(path);
            }
        }
    }
    Ok(documents)
}

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
    // Names in capitals stand for names to choose: `crates/supple-model/src/cost/NAME.rs`, `DIR/result.json`.
    plain && (word.contains('/') || ending) && !["NAME", "DIR"].iter().any(|name| word.contains(name))
}

#[test]
fn every_path_exists() -> Result<(), Box<dyn Error>> {
    let mut missing = Vec::new();
    for document in documents()? {
        let text = fs::read_to_string(Path::new(ROOT).join(&document))?;
        let folder = document.parent().unwrap_or(Path::new(""));
        let targets = links(&text).filter(|target| !target.contains("://") && !target.starts_with('#'));
        let targets = targets.filter_map(|target| target.split('#').next()).map(|target| folder.join(target));
        let mut paths: Vec<PathBuf> =
            quoted(&text).filter(|word| is_path(word)).map(PathBuf::from).chain(targets).collect();
        paths.retain(|path| !Path::new(ROOT).join(path).exists());
        missing.extend(paths.into_iter().map(|path| format!("{}: {}", document.display(), path.display())));
    }
    assert!(missing.is_empty(), "these do not exist: {missing:#?}");
    Ok(())
}

/// Crates whose modules have tables on the map.
const MAPPED: [&str; 5] = ["supple-kernels", "supple-lqg", "supple-model", "supple", "supple-study"];

#[test]
fn crates_and_their_modules_are_on_the_map() -> Result<(), Box<dyn Error>> {
    let text = fs::read_to_string(Path::new(ROOT).join("ARCHITECTURE.md"))?;
    let first_cells = text.lines().filter_map(|line| line.strip_prefix("| `")?.split_once("` |"));
    let named: Vec<&str> = first_cells.map(|(path, _)| path.trim_end_matches('/')).collect();
    let mut expected: Vec<String> = Vec::new();
    for folder in std::iter::once("crates".to_owned()).chain(MAPPED.map(|name| format!("crates/{name}/src"))) {
        for entry in fs::read_dir(Path::new(ROOT).join(&folder))? {
            expected.push(format!("{folder}/{}", entry?.file_name().to_string_lossy()));
        }
    }
    let missing: Vec<&String> = expected.iter().filter(|path| !named.contains(&path.as_str())).collect();
    assert!(expected.len() > 100 && missing.is_empty(), "ARCHITECTURE.md does not name {missing:#?}");
    Ok(())
}

/// All crates by name, with the imports of their modules.
fn crates() -> Result<Vec<(String, Crate)>, Box<dyn Error>> {
    let mut found = Vec::new();
    for member in fs::read_dir(Path::new(ROOT).join("crates"))? {
        let member = member?;
        found.push((member.file_name().to_string_lossy().into_owned(), Crate::read(&member.path().join("src"))?));
    }
    Ok(found)
}

/// The compiler keeps the order of crates; within a crate, this does: for folders with all that is in them, at every
/// depth, and for modules, each by itself.
#[test]
fn modules_form_no_circle() -> Result<(), Box<dyn Error>> {
    let (mut modules, mut pairs, mut found) = (0, 0, Vec::new());
    let crates = crates()?;
    for (name, read) in &crates {
        let imports = read.imports();
        let of_folders = between_siblings(&imports).into_values().flat_map(|graph| circles(&graph)).collect::<Vec<_>>();
        for circle in of_folders.into_iter().chain(circles(&between_all(&imports))) {
            let written = |import: &&Import| {
                format!(
                    "{} uses {}",
                    ["crate"].into_iter().chain(import.from.iter().map(String::as_str)).collect::<Vec<_>>().join("::"),
                    import.path
                )
            };
            found.push(format!("{name}: {}", circle.iter().map(written).collect::<Vec<_>>().join("; ")));
        }
        modules += read.count();
        pairs += imports.len();
    }
    assert!(found.is_empty(), "modules that use themselves: {found:#?}");
    assert!(crates.len() >= 13 && modules > 600 && pairs > 2000, "{} {modules} {pairs}", crates.len());
    Ok(())
}

/// The map of a crate is its floors: each module uses only those that stand above it.
#[test]
fn modules_use_only_those_above_them_on_the_map() -> Result<(), Box<dyn Error>> {
    let text = fs::read_to_string(Path::new(ROOT).join("ARCHITECTURE.md"))?;
    let top = |path: &str| path.split(['/', '.']).next().map(str::to_owned);
    let mut imported = 0;
    for name in MAPPED {
        let source = format!("crates/{name}/src");
        let prefix = format!("| `{source}/");
        let rows = text.lines().filter_map(|line| line.strip_prefix(&prefix)?.split_once("` |"));
        let mut order: Vec<String> = Vec::new();
        for module in rows.filter_map(|(path, _)| top(path)) {
            if !order.contains(&module) {
                order.push(module);
            }
        }
        let place = |module: &str| order.iter().position(|other| other == module);
        let imports = Crate::read(&Path::new(ROOT).join(source))?.imports();
        let found = between_siblings(&imports).remove(&Module::new()).unwrap_or_default();
        let upwards: Vec<String> = found
            .iter()
            .flat_map(|(module, used)| used.keys().map(move |used| (module, used)))
            .filter(|(module, used)| place(module) < place(used))
            .map(|(module, used)| format!("{module} uses {used}"))
            .collect();
        assert!(upwards.is_empty(), "{name}, against the order of ARCHITECTURE.md: {upwards:#?}");
        imported += found.values().map(BTreeMap::len).sum::<usize>();
    }
    assert!(imported > 100, "{imported}");
    Ok(())
}

/// The numbers of equations, such as `P.2a`, that stand after `mark`.
fn equations<'a>(text: &'a str, mark: &str) -> Vec<&'a str> {
    let number = |rest: &'a str| {
        let (section, rest_of) = rest.split_once('.')?;
        let digits = rest_of.find(|c: char| !c.is_ascii_digit()).unwrap_or(rest_of.len());
        let letter = usize::from(rest_of[digits..].starts_with(|c: char| c.is_ascii_lowercase()));
        let capital = section.len() == 1 && section.starts_with(|c: char| c.is_ascii_uppercase());
        (capital && digits > 0).then(|| &rest[..2 + digits + letter])
    };
    text.split(mark).skip(1).filter_map(number).collect()
}

/// The files with Rust code below a folder.
pub(crate) fn sources(folder: &Path, found: &mut Vec<PathBuf>) -> Result<(), Box<dyn Error>> {
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() {
            sources(&path, found)?;
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            found.push(path);
        }
    }
    Ok(())
}

#[test]
fn every_cited_equation_exists() -> Result<(), Box<dyn Error>> {
    let mut numbered: BTreeMap<String, usize> = BTreeMap::new();
    let mut cited: Vec<(String, String)> = Vec::new();
    for document in documents()? {
        let text = fs::read_to_string(Path::new(ROOT).join(&document))?;
        for number in equations(&text, "\\tag{") {
            *numbered.entry(number.to_owned()).or_default() += 1;
        }
        let name = document.display().to_string();
        cited.extend(equations(&text, "(").into_iter().map(|number| (name.clone(), number.to_owned())));
    }
    let mut files = Vec::new();
    for member in fs::read_dir(Path::new(ROOT).join("crates"))? {
        sources(&member?.path().join("src"), &mut files)?;
    }
    for file in files {
        let text = fs::read_to_string(&file)?;
        for mark in ["equation ", "equations "] {
            let numbers = equations(&text, mark);
            cited.extend(numbers.into_iter().map(|number| (file.display().to_string(), number.to_owned())));
        }
    }
    let twice: Vec<_> = numbered.iter().filter(|&(_, &count)| count > 1).collect();
    assert!(twice.is_empty(), "two equations have one number: {twice:?}");
    let missing: Vec<_> = cited.iter().filter(|(_, number)| !numbered.contains_key(number)).collect();
    assert!(cited.len() > 100 && missing.is_empty(), "the theory has no such equations: {missing:#?}");
    Ok(())
}
