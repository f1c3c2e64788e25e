use std::path::{Path, PathBuf};

use serde::Deserialize;
use supple_model::Price;
use supple_model::document::{Content, Document, Place};
use supple_model::parameters::{Parameter, Parameters, Role, Scale};
use supple_text::FileError;

use crate::catalogue::CatalogueFile;

/// A parameter, by its name: `[parameters.NAME]`.
#[derive(Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct ParameterFile {
    /// The value it starts from.
    initial: f64,
    /// Least and greatest value.
    bounds: [f64; 2],
    /// How the design search moves it: by differences, or by ratios.
    #[serde(default)]
    scale: Scale,
    /// Its unit, for people.
    #[serde(default)]
    unit: String,
    /// Who may change it: the design search, or only the user.
    #[serde(default)]
    role: Role,
    /// What its value costs, in units of the budget of `[design]`; default: nothing.
    price: Option<Price>,
    /// The available values: a list, optionally with prices and names, or the name of a CSV file.
    catalogue: Option<CatalogueFile>,
}

/// Reads `[parameters]` in the order of the file.
///
/// Files that they name are looked for in `folder`, and added to `files`.
pub(super) fn read(document: &Document, folder: &Path, files: &mut Vec<PathBuf>) -> Result<Parameters, FileError> {
    let Some(value) = document.get(&["parameters".into()]) else {
        return Ok(Parameters::default());
    };
    let Content::Table(table) = value.get_ref() else {
        return Err(document.error(&["parameters".into()], "must hold one table per parameter: [parameters.NAME]"));
    };
    let mut names: Vec<_> = table.keys().collect();
    names.sort_by_key(|name| name.span().start);
    let list = names.into_iter().map(|name| read_one(document, name.get_ref(), folder, &mut *files));
    Ok(Parameters::new(list.collect::<Result<_, _>>()?))
}

fn read_one(document: &Document, name: &str, folder: &Path, files: &mut Vec<PathBuf>) -> Result<Parameter, FileError> {
    let at = ["parameters".into(), Place::Key(name)];
    let ParameterFile { initial, bounds, scale, unit, role, price, catalogue } = document.read(&at)?;
    let name_of = name.to_owned();
    let mut parameter = Parameter { name: name_of, initial, bounds, scale, unit, role, price, catalogue: Vec::new() };
    let checked = parameter.check();
    if let (Ok(()), Some(catalogue)) = (&checked, catalogue) {
        let at = ["parameters".into(), Place::Key(name), "catalogue".into()];
        catalogue.read_into(&mut parameter, document.spot(&at), folder, files)?;
    }
    match checked.and_then(|()| parameter.check()) {
        Ok(()) => Ok(parameter),
        Err(unfit) if unfit.key() == "name" => Err(document.error_at_key(&at, unfit.message)),
        Err(unfit) => Err(unfit.at(document, &at)),
    }
}
