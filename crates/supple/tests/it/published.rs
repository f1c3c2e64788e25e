//! Every crate that is published says what it is, and the libraries need no file formats.

use std::collections::BTreeSet;
use std::error::Error;
use std::fs;
use std::path::Path;
use std::process::Command;

use crate::architecture::sources;

const CRATES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/..");

/// The value of a key of a crate, or of the workspace where the crate leaves it to that.
fn value<'a>(package: &'a toml::Table, workspace: &'a toml::Table, key: &str) -> Option<&'a toml::Value> {
    match package.get(key)? {
        toml::Value::Table(_) => workspace.get(key),
        value => Some(value),
    }
}

#[test]
fn every_crate_says_what_it_is() -> Result<(), Box<dyn Error>> {
    let table =
        |path: &Path| -> Result<toml::Table, Box<dyn Error>> { Ok(toml::from_str(&fs::read_to_string(path)?)?) };
    let root = table(&Path::new(CRATES).join("../Cargo.toml"))?;
    let workspace = root["workspace"]["package"].as_table().ok_or("no table")?;
    let mut seen = 0;
    for member in fs::read_dir(CRATES)? {
        let folder = member?.path();
        let manifest = table(&folder.join("Cargo.toml"))?;
        let package = manifest["package"].as_table().ok_or("no table")?;
        if package.get("publish").and_then(toml::Value::as_bool) == Some(false) {
            continue;
        }
        let name = package["name"].as_str().ok_or("no name")?;
        let text = |key: &str| value(package, workspace, key).and_then(toml::Value::as_str);
        for key in ["description", "license", "readme", "documentation"] {
            assert!(text(key).is_some_and(|text| !text.is_empty()), "{name} has no `{key}`");
        }
        assert_eq!(text("documentation"), Some(format!("https://docs.rs/{name}").as_str()));
        for key in ["keywords", "categories"] {
            let list = value(package, workspace, key).and_then(toml::Value::as_array).map_or(0, Vec::len);
            assert!((1..=5).contains(&list), "{name} has {list} {key}");
        }
        let page = fs::read_to_string(folder.join("README.md")).map_err(|error| format!("{name}: {error}"))?;
        assert!(page.starts_with(&format!("# {name}\n")), "{name}: its page begins with its name");
        assert!(!page.contains("](.."), "{name}: its page links to files that its package does not contain");
        for licence in ["LICENSE-MIT", "LICENSE-APACHE"] {
            let text =
                fs::read_to_string(folder.join(licence)).map_err(|error| format!("{name}, {licence}: {error}"))?;
            assert_eq!(text, fs::read_to_string(Path::new(CRATES).join("..").join(licence))?, "{name}: {licence}");
        }
        seen += 1;
    }
    assert_eq!(seen, 12);
    Ok(())
}

/// What `cargo tree` says of dependencies, a line each.
fn tree(which: &[&str]) -> Result<String, Box<dyn Error>> {
    let mut tree = Command::new(env!("CARGO"));
    let tree = tree.args(["tree", "--locked", "--prefix", "none"]).args(which).current_dir(CRATES).output()?;
    assert!(tree.status.success(), "{}", String::from_utf8_lossy(&tree.stderr));
    Ok(String::from_utf8(tree.stdout)?)
}

/// What is built names its licence, also what is not published; the few crates of others that do not are told in `deny.toml`.
#[test]
fn whatever_is_built_names_its_licence() -> Result<(), Box<dyn Error>> {
    let rules: toml::Table = toml::from_str(&fs::read_to_string(Path::new(CRATES).join("../deny.toml"))?)?;
    let told = rules["licenses"]["clarify"].as_array().ok_or("no list")?;
    let told: BTreeSet<&str> = told.iter().filter_map(|rule| rule["crate"].as_str()).collect();
    let lines = tree(&["--workspace", "--edges", "normal,build,dev", "--format", "{p}|{l}"])?;
    let without = lines.lines().filter_map(|line| line.strip_suffix('|')?.split(' ').next());
    assert_eq!(without.collect::<BTreeSet<&str>>(), told);
    Ok(())
}

/// Formats of files are for the crates that read and write files.
#[test]
fn the_libraries_depend_on_no_file_formats() -> Result<(), Box<dyn Error>> {
    for name in ["supple-kernels", "supple-lqg", "supple-robot", "supple-model", "supple"] {
        let tree = tree(&["--package", name, "--edges", "normal", "--format", "{p}"])?;
        let packages: Vec<&str> = tree.lines().filter_map(|line| line.split(' ').next()).collect();
        assert!(packages.first() == Some(&name) && packages.len() > 2, "{name}: {packages:?}");
        for format in ["toml", "csv", "schemars"] {
            assert!(
                !packages.contains(&format),
                "{name} depends on {format}: cargo tree -p {name} -e normal -i {format}"
            );
        }
    }
    Ok(())
}

/// The package for Python is built after the tests: what it depends on has the features that it has in their build, so that
/// nothing is built twice.
#[test]
fn the_package_for_python_shares_the_build_of_the_tests() -> Result<(), Box<dyn Error>> {
    let packages = |which: &[&str]| -> Result<BTreeSet<String>, Box<dyn Error>> {
        let lines = tree(&[which, &["--no-dedupe", "--format", "{p} {f}"]].concat())?;
        Ok(lines.lines().map(|line| line.trim().to_owned()).collect())
    };
    let tests = packages(&["--workspace", "--edges", "normal,build,dev"])?;
    let package = packages(&["--package", "supple-py", "--edges", "normal,build"])?;
    assert!(package.len() > 100, "{package:?}");
    let differ: Vec<&String> = package.difference(&tests).collect();
    assert!(differ.is_empty(), "built again, with other features; give supple-py those of the tests: {differ:#?}");
    Ok(())
}

/// The names that a front page offers from its own modules.
fn offered(page: &str) -> Vec<String> {
    let mut names = Vec::new();
    for line in page.split("\npub use ").skip(1).filter_map(|rest| rest.split(';').next()) {
        let own = !line.starts_with("supple_");
        let list = line.rsplit_once("::").map_or(line, |(_, list)| list);
        let list = line.split_once('{').map_or(list, |(_, list)| list.trim_end_matches('}'));
        names.extend(list.split(',').map(|name| name.trim().to_owned()).filter(|name| own && !name.is_empty()));
    }
    names
}

/// The documentation of all definitions of a name as a type, a trait or a function.
fn documentation<'a>(sources: &'a [String], name: &str) -> Vec<&'a str> {
    let of_source = |source: &'a String| {
        let lines: Vec<&str> = source.lines().collect();
        let is_definition = |line: &str| {
            ["struct", "enum", "trait", "fn", "const fn", "type"].iter().any(|kind| {
                let rest = line.strip_prefix(&format!("pub {kind} {name}"));
                rest.is_some_and(|rest| !rest.starts_with(|next: char| next.is_alphanumeric() || next == '_'))
            })
        };
        let at = lines.iter().position(|line| is_definition(line))?;
        let above = lines[..at].iter().rev().take_while(|line| !line.is_empty() && !line.starts_with('}'));
        Some(above.copied().collect::<Vec<_>>())
    };
    sources.iter().filter_map(of_source).flatten().collect()
}

#[test]
fn whatever_a_front_page_offers_has_an_example() -> Result<(), Box<dyn Error>> {
    let mut missing = Vec::new();
    let mut seen = 0;
    for name in ["lqg", "robot", "model", "file", "study", "figures", "report"].map(|name| format!("supple-{name}")) {
        seen += without_example(&name, &mut missing)?;
    }
    seen += without_example("supple", &mut missing)?;
    assert!(missing.is_empty(), "neither an example nor a link to one: {missing:?}");
    assert!(seen > 200, "{seen} were found");
    Ok(())
}

/// Counts what the front page of a crate offers, and adds what has neither an example nor a link to one to `missing`.
fn without_example(name: &str, missing: &mut Vec<String>) -> Result<usize, Box<dyn Error>> {
    let folder = Path::new(CRATES).join(name).join("src");
    let (page, mut files) = (fs::read_to_string(folder.join("lib.rs"))?, Vec::new());
    sources(&folder, &mut files)?;
    let all = files.iter().map(fs::read_to_string).collect::<Result<Vec<_>, _>>()?;
    let offered = offered(&page);
    let documented = offered.iter().map(|item| (item, documentation(&all, item)));
    let documented: Vec<_> = documented.filter(|(_, lines)| !lines.is_empty()).collect();
    for (item, lines) in &documented {
        if !lines.iter().any(|line| line.contains("```") || line.contains("Example")) {
            missing.push(format!("{name}: {item}"));
        }
    }
    Ok(documented.len())
}
