//! Included files: the elements of the included file replace `include`.

use std::collections::HashSet;
use std::path::{Path, PathBuf};

use supple_text::FileError;

use super::super::meshes::inside_of;
use super::super::options::LoadOptions;
use super::super::words::shown;
use super::super::xml::{Document, Element, cleaned};

/// Greatest number of included files, directly or indirectly.
const MOST: usize = 1_000;
/// Greatest depth of nested includes.
const DEEPEST: usize = 50;
/// Bytes of all files together, at most.
const LARGEST: usize = 64 << 20;

/// A file that is included.
struct Source {
    path: PathBuf,
    text: String,
    /// The file that includes it, and the byte offset of the `include`; `None` for the outermost file.
    from: Option<(usize, usize)>,
    depth: usize,
}

/// The texts of a file and of all files that it includes.
pub(crate) struct Sources(Vec<Source>);

impl Sources {
    /// Reads the files that a document of MJCF includes. Each is in the folder of the outermost file, in that of the file
    /// that includes it, or in a package root.
    ///
    /// # Errors
    /// If one cannot be read, is outside these folders, or is included twice.
    pub(crate) fn read(document: &Document, path: &Path, options: &LoadOptions) -> Result<Self, FileError> {
        let mut files = Self(Vec::new());
        let folder = path.parent().unwrap_or(Path::new(""));
        let mut seen = HashSet::from([path.to_owned()]);
        files.gather(document, None, 0, &[folder], &mut seen, options)?;
        let mut next = 0;
        let mut size = 0;
        while let Some(source) = files.0.get(next) {
            let (path, depth) = (source.path.clone(), source.depth);
            let text = cleaned(&options.files.read(&path)?).0.into_owned();
            size += text.len();
            let name = path.display().to_string();
            let document = Document::parse(&text, &name)?;
            let root = document.root();
            if size > LARGEST {
                return Err(root.error(format!("the files of a robot may have at most {LARGEST} bytes in total")));
            }
            let own = path.parent().unwrap_or(Path::new(""));
            files.gather(&document, Some(next), depth, &[folder, own], &mut seen, options)?;
            files.0[next].text = text;
            next += 1;
        }
        Ok(files)
    }

    /// The files that `document` includes; `from` is its own place.
    fn gather(
        &mut self,
        document: &Document,
        from: Option<usize>,
        depth: usize,
        folders: &[&Path],
        seen: &mut HashSet<PathBuf>,
        options: &LoadOptions,
    ) -> Result<(), FileError> {
        for at in document.root().descendants().filter(|element| element.tag() == "include") {
            let path = find(at, folders, options)?;
            if !seen.insert(path.clone()) {
                let message =
                    format!("file {} is included twice; each may be included once", shown(at.required("file")?));
                return Err(at.error_at("file", message));
            }
            if depth >= DEEPEST || self.0.len() >= MOST {
                let message = format!("at most {MOST} files are included, and at most {DEEPEST} inside one another");
                return Err(at.error_at("file", message));
            }
            let place = (from.unwrap_or(usize::MAX), at.start());
            self.0.push(Source { path, text: String::new(), from: Some(place), depth: depth + 1 });
        }
        Ok(())
    }

    /// The paths of all files.
    pub(crate) fn paths(&self) -> Vec<PathBuf> {
        self.0.iter().map(|source| source.path.clone()).collect()
    }

    /// Puts all files into the document that includes them.
    ///
    /// # Errors
    /// Where one of them is not well-formed.
    pub(crate) fn put_into<'t>(&'t self, document: &mut Document<'t>) -> Result<(), FileError> {
        let parsed = self.0.iter().map(|source| Document::parse(&source.text, &source.path.display().to_string()));
        let mut parsed: Vec<_> = parsed.map(|found| found.map(Some)).collect::<Result<_, _>>()?;
        // Files come after those that include them.
        for index in (0..self.0.len()).rev() {
            let Some(inner) = parsed[index].take() else { continue };
            let Some((outer, byte)) = self.0[index].from else { continue };
            match parsed.get_mut(outer) {
                Some(Some(outer)) => outer.include(byte, inner),
                _ => document.include(byte, inner),
            }
        }
        Ok(())
    }
}

/// The path of an `include`: in the first of these folders that has it.
fn find(at: Element, folders: &[&Path], options: &LoadOptions) -> Result<PathBuf, FileError> {
    let named = at.required("file")?;
    let file = named.replace('\\', "/");
    let mut outside = false;
    for folder in folders {
        let path = folder.join(&file);
        match inside_of(&path, folders[0], options) {
            Some(path) if options.files.has(&path) => return Ok(path),
            Some(_) => {}
            None => outside |= path.is_file(),
        }
    }
    let (why, help) = if outside {
        (
            "leads out of the robot file's folder",
            "name a folder that holds all files as a package root: `package_roots`",
        )
    } else {
        (
            "does not exist",
            "files are looked for in the folder of the outermost file, and in that of the file that includes them",
        )
    };
    Err(at.error_at("file", format!("the included file {} {why}", shown(named))).with_help(help))
}
