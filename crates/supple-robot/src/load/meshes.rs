//! Resolves names of mesh files, which may only refer to files in the robot file's folder or a declared package root.

use std::path::{Component, Path, PathBuf};

use super::options::LoadOptions;
use super::warnings::Warnings;
use super::words::shown;
use super::xml::Element;

/// Message for meshes outside the permitted folders.
const OUTSIDE: &str = "is outside the robot file's folder and all package roots";

/// Why a mesh cannot be used.
pub(super) enum Unusable {
    /// Its package, with this name, is in no package root.
    NoPackage(String),
    /// Any other reason, worded as the end of a sentence whose subject is the mesh.
    Wrong(&'static str),
}

/// The path of a visual mesh; `None` and a warning if it cannot be used, as a robot loads without its
/// meshes. `at` is the element whose attribute or text holds the name `uri`.
pub(super) fn mesh_path(
    at: Element,
    uri: &str,
    options: &LoadOptions,
    folder: &Path,
    warnings: &mut Warnings,
) -> Option<PathBuf> {
    match find_mesh(uri, options, folder) {
        Ok(path) => return Some(path),
        Err(Unusable::Wrong(why)) => warnings.leave_out_mesh(at, uri, why),
        Err(Unusable::NoPackage(package)) => warnings.note(&format!("package {package}"), at, || {
            format!("package {} is in no declared package root; its meshes are left out", shown(&package))
        }),
    }
    None
}

/// The file that the mesh name `uri` refers to: relative to the robot file's `folder`, or with `package://`, `model://` or
/// `file://`.
///
/// `..` is removed from the name; if the file exists, symbolic links are resolved too. The file need not exist,
/// and is not read.
///
/// # Errors
/// If the file is neither in the folder nor in a package root, or the name has another URI scheme.
pub(super) fn find_mesh(uri: &str, options: &LoadOptions, folder: &Path) -> Result<PathBuf, Unusable> {
    let wrong = |why| Err(Unusable::Wrong(why));
    let named = uri.replace('\\', "/");
    let path = if let Some(rest) = named.strip_prefix("package://").or_else(|| named.strip_prefix("model://")) {
        let rest = rest.trim_start_matches('/');
        let (package, rest) = rest.split_once('/').unwrap_or((rest, ""));
        if matches!(package, "" | "." | "..") || rest.is_empty() {
            return wrong("must name a package and a file in it: `package://NAME/FILE`");
        }
        let Some(home) = options.package_roots.iter().map(|root| root.join(package)).find(|home| home.is_dir()) else {
            return Err(Unusable::NoPackage(package.to_owned()));
        };
        let rest = Path::new(rest.trim_start_matches('/'));
        if inside(&home.join(rest), &home).is_none() {
            return wrong("is outside its package");
        }
        home.join(rest)
    } else if let Some(rest) = named.strip_prefix("file://") {
        folder.join(rest)
    } else if named.split('/').next().is_some_and(|first| first.contains(':')) {
        return wrong("must be relative, or begin with `package://`, `model://` or `file://`");
    } else {
        folder.join(&named)
    };
    let bases = || bases(folder, options);
    let Some(path) = bases().find_map(|base| inside(&path, base)) else {
        return wrong(OUTSIDE);
    };
    if links_out(&path, folder, options) {
        return wrong("is outside the robot file's folder and all package roots by a symbolic link");
    }
    Ok(path)
}

/// Folders that the files of a robot may be in.
fn bases<'b>(folder: &'b Path, options: &'b LoadOptions) -> impl Iterator<Item = &'b Path> {
    std::iter::once(folder).chain(options.package_roots.iter().map(PathBuf::as_path))
}

/// Whether an existing file is outside all folders once its symbolic links are resolved.
fn links_out(path: &Path, folder: &Path, options: &LoadOptions) -> bool {
    let within = |real: &Path| {
        bases(folder, options).any(|base| known(base).canonicalize().is_ok_and(|base| real.starts_with(base)))
    };
    path.canonicalize().is_ok_and(|real| !within(&real))
}

/// The path without `..`, if it is inside the robot file's folder or a package root, with symbolic links resolved too.
pub(super) fn inside_of(path: &Path, folder: &Path, options: &LoadOptions) -> Option<PathBuf> {
    let path = bases(folder, options).find_map(|base| inside(path, base))?;
    (!links_out(&path, folder, options)).then_some(path)
}

/// The path without `..`, relative to `base`; `None` if it is outside `base`.
fn inside(path: &Path, base: &Path) -> Option<PathBuf> {
    let (full, full_base) = (plain(path), plain(base));
    let rest = full.strip_prefix(full_base).ok()?;
    Some(base.join(rest))
}

/// The folder; the current one if its name is empty.
fn known(folder: &Path) -> &Path {
    if folder.as_os_str().is_empty() { Path::new(".") } else { folder }
}

/// The path from the root of the file system, without `.` and `..`.
fn plain(path: &Path) -> PathBuf {
    let full = std::path::absolute(known(path)).unwrap_or_else(|_| path.to_owned());
    full.components().fold(PathBuf::new(), |mut plain, component| {
        match component {
            Component::ParentDir => drop(plain.pop()),
            Component::CurDir => {}
            other => plain.push(other),
        }
        plain
    })
}
