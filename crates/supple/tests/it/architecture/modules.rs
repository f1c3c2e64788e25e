//! Which module of a crate uses which: read from its sources, token by token, without its unit tests.

use std::collections::{BTreeMap, BTreeSet};
use std::error::Error;
use std::fs;
use std::path::Path;

use proc_macro2::{Delimiter, Group, TokenStream, TokenTree};

/// A module by the names that lead to it from the root of its crate, which has none.
pub type Module = Vec<String>;

/// That a module uses another one.
pub struct Import {
    pub from: Module,
    pub to: Module,
    /// As it is written.
    pub path: String,
}

/// What a module says of itself and others.
#[derive(Default)]
struct Source {
    /// Names that it has from elsewhere by `use`, each with the path that it stands for, and what all names of which it
    /// has.
    names: BTreeMap<String, Vec<String>>,
    globs: Vec<Vec<String>>,
    /// All paths of more than one name, and those of `use`.
    paths: BTreeSet<Vec<String>>,
    /// Names by themselves, as of types and of functions that are called.
    words: BTreeSet<String>,
    /// What `pub use` hands on, by its name.
    handed_on: BTreeMap<String, Vec<String>>,
}

/// A crate.
#[derive(Default)]
pub struct Crate {
    modules: BTreeMap<Module, Source>,
}

impl Crate {
    /// Reads all modules below a folder `src`.
    pub fn read(source: &Path) -> Result<Self, Box<dyn Error>> {
        let mut found = Self::default();
        found.folder(source, &[])?;
        Ok(found)
    }

    fn folder(&mut self, folder: &Path, module: &[String]) -> Result<(), Box<dyn Error>> {
        for entry in fs::read_dir(folder)? {
            let path = entry?.path();
            let name = path.file_stem().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
            let inside: Module = module.iter().cloned().chain([name.clone()]).collect();
            if path.is_dir() {
                self.folder(&path, &inside)?;
            } else if path.extension().is_some_and(|extension| extension == "rs") {
                let module = if ["lib", "main", "mod"].contains(&name.as_str()) { module } else { &inside };
                let tokens: TokenStream =
                    fs::read_to_string(&path)?.parse().map_err(|error| format!("{}: {error}", path.display()))?;
                self.tokens(tokens, module);
            }
        }
        Ok(())
    }

    fn tokens(&mut self, tokens: TokenStream, module: &[String]) {
        self.modules.entry(module.to_vec()).or_default();
        let tokens: Vec<TokenTree> = tokens.into_iter().collect();
        let mut at = 0;
        let mut is_public = false;
        while at < tokens.len() {
            if is_only_for_tests(&tokens[at..]) {
                // To the end of what it is said of.
                at += 2;
                while at < tokens.len() && !is_end(&tokens[at]) {
                    at += 1;
                }
                at += 1;
                continue;
            }
            let was_public = std::mem::take(&mut is_public);
            match (&tokens[at], tokens.get(at + 1), tokens.get(at + 2)) {
                (TokenTree::Ident(word), next, _) if *word == "pub" => {
                    at += if next.is_some_and(is_visibility) { 2 } else { 1 };
                    is_public = true;
                }
                (TokenTree::Ident(word), Some(TokenTree::Ident(name)), Some(TokenTree::Group(body)))
                    if *word == "mod" =>
                {
                    let inside: Module = module.iter().cloned().chain([name.to_string()]).collect();
                    self.tokens(body.stream(), &inside);
                    at += 3;
                }
                (TokenTree::Ident(word), ..) if *word == "use" => {
                    let end = (at..tokens.len()).find(|&end| is_mark(&tokens[end], ';')).unwrap_or(tokens.len());
                    self.using(&tokens[at + 1..end], &[], (module, was_public));
                    at = end;
                }
                (TokenTree::Ident(_), ..) => {
                    let (path, length) = path(&tokens[at..]);
                    let source = self.modules.entry(module.to_vec()).or_default();
                    if path.len() > 1 {
                        source.paths.insert(path);
                    } else if is_use(at.checked_sub(1).map(|before| &tokens[before]), &path[0], tokens.get(at + 1)) {
                        source.words.extend(path);
                    }
                    at += length;
                }
                (TokenTree::Group(group), ..) => {
                    self.tokens(group.stream(), module);
                    at += 1;
                }
                _ => at += 1,
            }
        }
    }

    /// What stands between `use` and its semicolon, or between two commas there, after `before`.
    fn using(&mut self, tokens: &[TokenTree], before: &[String], (module, is_public): (&[String], bool)) {
        let (own, length) = path(tokens);
        let mut path: Vec<String> = before.iter().cloned().chain(own).collect();
        let source = self.modules.entry(module.to_vec()).or_default();
        match &tokens[length..] {
            [.., TokenTree::Group(group)] if group.delimiter() == Delimiter::Brace => {
                let list: Vec<TokenTree> = group.stream().into_iter().collect();
                list.split(|token| is_mark(token, ',')).for_each(|one| self.using(one, &path, (module, is_public)));
            }
            [.., last] if is_mark(last, '*') => {
                source.paths.insert(path.clone());
                source.globs.push(path);
            }
            rest => {
                if path.last().is_some_and(|last| last == "self") {
                    path.pop();
                }
                let name = match rest {
                    [TokenTree::Ident(_), TokenTree::Ident(name)] => Some(name.to_string()),
                    _ => path.last().cloned(),
                };
                let Some(name) = name else { return };
                if is_public {
                    source.handed_on.insert(name.clone(), path.clone());
                } else {
                    source.paths.insert(path.clone());
                }
                source.names.insert(name, path);
            }
        }
    }

    /// The modules that a path leads through, from a module on: to where what it names is defined, and to those that
    /// hand it on, except for the ones that the module is in.
    fn through(&self, from: &[String], path: &[String], depth: usize) -> Vec<Module> {
        let mut at = from.to_vec();
        let mut rest = path;
        let mut is_inside = false;
        while let Some((first, others)) = rest.split_first() {
            match first.as_str() {
                "crate" => at.clear(),
                "super" => drop(at.pop()),
                "self" => {}
                _ => break,
            }
            (rest, is_inside) = (others, true);
        }
        let mut found = Vec::new();
        let mut hands_on = false;
        while let Some((name, others)) = rest.split_first() {
            let child: Module = at.iter().cloned().chain([name.clone()]).collect();
            // A name at the end may be of a module and of something that is handed on.
            let is_handed_on = others.is_empty() && at != from && self.has_name(&at, name);
            if self.modules.contains_key(&child) && !is_handed_on {
                (at, rest, is_inside) = (child, others, true);
                continue;
            }
            let source = self.modules.get(&at);
            let named = source.and_then(|source| source.names.get(name)).filter(|named| *named != path || at != from);
            if let Some(named) = named.filter(|_| depth < 16) {
                let on: Vec<String> = named.iter().chain(others).cloned().collect();
                found.extend(self.through(&at, &on, depth + 1));
                hands_on = true;
            } else if is_inside {
                let globs = source.map(|source| source.globs.as_slice()).unwrap_or_default();
                for glob in globs.iter().filter(|_| depth < 16) {
                    let on: Vec<String> = glob.iter().cloned().chain(rest.iter().cloned()).collect();
                    found.extend(self.through(&at, &on, depth + 1));
                }
            }
            break;
        }
        if is_inside && !(hands_on && from.starts_with(&at)) {
            found.push(at);
        }
        found
    }

    fn has_name(&self, module: &[String], name: &str) -> bool {
        self.modules.get(module).is_some_and(|source| source.names.contains_key(name))
    }

    /// All imports, each once. That a module hands on what is in its submodules is none, unless it uses that itself.
    pub fn imports(&self) -> Vec<Import> {
        let mut found = BTreeMap::new();
        for (from, source) in &self.modules {
            // What is written out in full says more than a name that came by `use`.
            let is_full = |path: &&Vec<String>| ["crate", "super", "self"].iter().any(|word| path[0] == *word);
            let (full, short): (Vec<_>, Vec<_>) = source.paths.iter().partition(is_full);
            let used = full.into_iter().chain(short).map(|path| (path, true));
            let handed_on = source.handed_on.iter().map(|(name, path)| (path, source.words.contains(name)));
            for (path, is_used) in used.chain(handed_on) {
                for to in self.through(from, path, 0) {
                    if to != *from && (is_used || !to.starts_with(from)) {
                        found.entry((from.clone(), to)).or_insert_with(|| path.join("::"));
                    }
                }
            }
        }
        found.into_iter().map(|((from, to), path)| Import { from, to, path }).collect()
    }

    pub fn count(&self) -> usize {
        self.modules.len()
    }
}

/// The first import from each module to each other one.
pub type Graph<'a, Name> = BTreeMap<Name, BTreeMap<Name, &'a Import>>;

/// Imports between modules of one folder, whatever is inside of them, by folder and by the names in it.
pub fn between_siblings(imports: &[Import]) -> BTreeMap<Module, Graph<'_, String>> {
    let mut found: BTreeMap<Module, Graph<String>> = BTreeMap::new();
    for import in imports {
        let common = import.from.iter().zip(&import.to).take_while(|(a, b)| a == b).count();
        let (Some(from), Some(to)) = (import.from.get(common), import.to.get(common)) else { continue };
        let folder = found.entry(import.from[..common].to_vec()).or_default();
        folder.entry(from.clone()).or_default().entry(to.clone()).or_insert(import);
    }
    found
}

/// Imports between all modules, each by itself: a module and its submodules are as any others.
pub fn between_all(imports: &[Import]) -> Graph<'_, Module> {
    let mut found: Graph<Module> = BTreeMap::new();
    for import in imports {
        found.entry(import.from.clone()).or_default().entry(import.to.clone()).or_insert(import);
    }
    found
}

/// All circles of a graph that have no module in common with one before, each by its imports, on the shortest way.
pub fn circles<'a, Name: Clone + Ord>(graph: &Graph<'a, Name>) -> Vec<Vec<&'a Import>> {
    let (mut found, mut reported) = (Vec::new(), BTreeSet::new());
    for start in graph.keys() {
        let Some(way) = circle(graph, start).filter(|_| !reported.contains(start)) else { continue };
        reported.extend(way.iter().map(|(name, _)| name.clone()));
        found.push(way.into_iter().map(|(_, import)| import).collect());
    }
    found
}

/// The way that leads from a module back to it, where there is one: each import with where it starts.
fn circle<'a, Name: Clone + Ord>(graph: &Graph<'a, Name>, start: &Name) -> Option<Vec<(Name, &'a Import)>> {
    let mut ways: Vec<(&Name, Vec<(Name, &Import)>)> = vec![(start, Vec::new())];
    let mut seen = BTreeSet::new();
    while !ways.is_empty() {
        let mut longer = Vec::new();
        for (at, way) in ways {
            for (next, import) in graph.get(at).into_iter().flatten() {
                let way: Vec<_> = way.iter().cloned().chain([(at.clone(), *import)]).collect();
                if next == start {
                    return Some(way);
                }
                if seen.insert(next) {
                    longer.push((next, way));
                }
            }
        }
        ways = longer;
    }
    None
}

/// Names joined by `::` at the start, and how many tokens they take, with a last `::` where one follows.
fn path(tokens: &[TokenTree]) -> (Vec<String>, usize) {
    let (mut names, mut at) = (Vec::new(), 0);
    while let Some(TokenTree::Ident(name)) = tokens.get(at) {
        names.push(name.to_string());
        at += 1;
        let [Some(a), Some(b)] = [tokens.get(at), tokens.get(at + 1)] else { break };
        if !(is_mark(a, ':') && is_mark(b, ':')) {
            break;
        }
        at += 2;
    }
    (names, at)
}

fn is_mark(token: &TokenTree, mark: char) -> bool {
    matches!(token, TokenTree::Punct(punct) if punct.as_char() == mark)
}

/// Whether an item may end with it: a semicolon, or a body.
fn is_end(token: &TokenTree) -> bool {
    is_mark(token, ';') || matches!(token, TokenTree::Group(group) if group.delimiter() == Delimiter::Brace)
}

/// Whether `#[cfg(test)]` stands here.
fn is_only_for_tests(tokens: &[TokenTree]) -> bool {
    match tokens {
        [hash, TokenTree::Group(group), ..] if is_mark(hash, '#') => {
            group.stream().to_string().replace(' ', "") == "cfg(test)"
        }
        _ => false,
    }
}

/// Whether it says after `pub` who sees an item.
fn is_visibility(token: &TokenTree) -> bool {
    let first = |group: &Group| group.stream().into_iter().next().map(|token| token.to_string());
    match token {
        TokenTree::Group(group) if group.delimiter() == Delimiter::Parenthesis => {
            first(group).is_some_and(|word| ["crate", "self", "super", "in"].contains(&word.as_str()))
        }
        _ => false,
    }
}

/// Whether a name by itself, between two tokens, may be one that came by `use`: a type or constant, or a function that is
/// called, but neither a field nor a method.
fn is_use(before: Option<&TokenTree>, name: &str, after: Option<&TokenTree>) -> bool {
    let is_called = matches!(after, Some(TokenTree::Group(group)) if group.delimiter() == Delimiter::Parenthesis);
    let is_defined = matches!(before, Some(TokenTree::Ident(word)) if *word == "fn");
    let is_member = before.is_some_and(|token| is_mark(token, '.'));
    !is_defined && !is_member && (is_called || name.starts_with(|c: char| c.is_ascii_uppercase()))
}
