//! Every path that the documents of the repository name exists, ARCHITECTURE.md leaves no crate and no module out, and every
//! equation that is cited stands in the theory.

use std::collections::BTreeMap;
use std::error::Error;
use std::fs;
use std::path::{Path, PathBuf};

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

/// The modules of a crate, each with its files: those at the top of `src`.
fn modules(source: &Path) -> Result<BTreeMap<String, Vec<PathBuf>>, Box<dyn Error>> {
    let mut found: BTreeMap<String, Vec<PathBuf>> = BTreeMap::new();
    for entry in fs::read_dir(source)? {
        let path = entry?.path();
        let name = path.file_stem().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
        let files = found.entry(name).or_default();
        if path.is_dir() { sources(&path, files)? } else { files.push(path) }
    }
    found.retain(|name, _| !["lib", "main"].contains(&name.as_str()));
    Ok(found)
}

/// The first words of what is inside of one pair of braces or stands alone.
fn heads(list: &str) -> Vec<&str> {
    let mut depth = 0;
    let parts = list.split(|c: char| {
        depth += i32::from(c == '{') - i32::from(c == '}');
        c == ',' && depth == 0
    });
    parts.filter_map(|part| part.trim().split(|c: char| !(c.is_alphanumeric() || c == '_')).next()).collect()
}

/// What a file of a crate names of the crate itself, without its unit tests and comments.
fn named_of_crate(text: &str) -> Vec<String> {
    let text = text.split("#[cfg(test)]").next().unwrap_or_default();
    let code: Vec<&str> = text.lines().map(|line| line.split("//").next().unwrap_or_default()).collect();
    let code = code.join("\n");
    let one = |rest: &str| match rest.strip_prefix('{') {
        Some(list) => {
            heads(list.split_once("};").map_or(list, |(list, _)| list)).into_iter().map(str::to_owned).collect()
        }
        None => heads(rest).first().map(|head| (*head).to_owned()).into_iter().collect::<Vec<_>>(),
    };
    code.split("crate::").skip(1).flat_map(one).collect()
}

/// The other modules of its crate that each module uses.
fn imports(source: &Path) -> Result<BTreeMap<String, Vec<String>>, Box<dyn Error>> {
    let modules = modules(source)?;
    let root = fs::read_to_string(source.join("lib.rs")).or_else(|_| fs::read_to_string(source.join("main.rs")))?;
    // Names that the root gives on stand for their modules.
    let mut given: BTreeMap<&str, &str> = BTreeMap::new();
    for exported in root.split("use ").skip(1).filter_map(|rest| rest.split_once(';')).map(|(path, _)| path) {
        if let Some((module, names)) = exported.split_once("::") {
            for name in names.split(|c: char| !(c.is_alphanumeric() || c == '_')) {
                given.insert(name, module);
            }
        }
    }
    let mut found: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for (module, files) in &modules {
        let to = found.entry(module.clone()).or_default();
        for file in files {
            for name in named_of_crate(&fs::read_to_string(file)?) {
                let target =
                    if modules.contains_key(&name) { Some(name.as_str()) } else { given.get(name.as_str()).copied() };
                to.extend(target.filter(|target| modules.contains_key(*target)).map(str::to_owned));
            }
        }
        to.retain(|other| other != module);
        to.sort_unstable();
        to.dedup();
    }
    Ok(found)
}

/// The compiler keeps the order of crates; within a crate this does.
#[test]
fn modules_form_no_circle() -> Result<(), Box<dyn Error>> {
    let mut crates = 0;
    for member in fs::read_dir(Path::new(ROOT).join("crates"))? {
        let member = member?;
        let reached = imports(&member.path().join("src"))?;
        for module in reached.keys() {
            let (mut seen, mut left) = (Vec::new(), reached[module].clone());
            while let Some(next) = left.pop() {
                if !seen.contains(&next) {
                    left.extend(reached[&next].iter().cloned());
                    seen.push(next);
                }
            }
            let name = member.file_name();
            assert!(!seen.contains(module), "{}: {module} uses itself by way of {seen:?}", name.display());
        }
        crates += 1;
    }
    assert!(crates >= 13);
    Ok(())
}

/// The map of a crate is its floors: each module uses only those that stand above it.
#[test]
fn modules_use_only_those_above_them_on_the_map() -> Result<(), Box<dyn Error>> {
    let text = fs::read_to_string(Path::new(ROOT).join("ARCHITECTURE.md"))?;
    let top = |path: &str| path.split(['/', '.']).next().map(str::to_owned);
    let mut imported = 0;
    for name in ["supple-model", "supple", "supple-study"] {
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
        let found = imports(&Path::new(ROOT).join(source))?;
        let upwards: Vec<String> = found
            .iter()
            .flat_map(|(module, used)| used.iter().map(move |used| (module, used)))
            .filter(|(module, used)| place(module) < place(used))
            .map(|(module, used)| format!("{module} uses {used}"))
            .collect();
        assert!(upwards.is_empty(), "{name}, against the order of ARCHITECTURE.md: {upwards:#?}");
        imported += found.values().map(Vec::len).sum::<usize>();
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
fn sources(folder: &Path, found: &mut Vec<PathBuf>) -> Result<(), Box<dyn Error>> {
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
