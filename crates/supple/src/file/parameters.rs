use serde::Deserialize;
use toml::de::DeValue;

use supple_files::FileError;

use super::document::{Document, Place};
use crate::Price;
use crate::parameters::{Parameter, Parameters, Role, Scale};

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
    /// What its value costs, in units of the budget of `[design]`; nothing where left out.
    price: Option<Price>,
}

/// Reads `[parameters]` in the order of the file.
pub(super) fn read(document: &Document) -> Result<Parameters, FileError> {
    let Some(value) = document.get(&["parameters".into()]) else {
        return Ok(Parameters::default());
    };
    let DeValue::Table(table) = value.get_ref() else {
        return Err(document.error(&["parameters".into()], "must hold one table per parameter: [parameters.NAME]"));
    };
    let mut names: Vec<_> = table.keys().collect();
    names.sort_by_key(|name| name.span().start);
    let list = names.into_iter().map(|name| read_one(document, name.get_ref()));
    Ok(Parameters::new(list.collect::<Result<_, _>>()?))
}

fn read_one(document: &Document, name: &str) -> Result<Parameter, FileError> {
    let at = ["parameters".into(), Place::Key(name)];
    let ParameterFile { initial, bounds, scale, unit, role, price } = document.read(&at)?;
    let parameter = Parameter { name: name.to_owned(), initial, bounds, scale, unit, role, price };
    match parameter.check() {
        Ok(()) => Ok(parameter),
        Err(("name", message)) => Err(document.error_at_key(&at, message)),
        Err((key, message)) => Err(document.error(&["parameters".into(), Place::Key(name), key.into()], message)),
    }
}
