//! Parameters: named numbers that designs and studies change.

use serde::{Deserialize, Serialize};

use crate::{Error, Price, Value, is_name};
use supple_files::quoted;

/// A named number that tasks and designs may change.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
pub struct Parameter {
    /// Its name.
    pub name: String,
    /// The value it starts from.
    pub initial: f64,
    /// Least and greatest value.
    pub bounds: [f64; 2],
    /// How the design search moves it.
    pub scale: Scale,
    /// Its unit, for people.
    pub unit: String,
    /// Who may change it.
    pub role: Role,
    /// What its value costs, where it has a price.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub price: Option<Price>,
}

impl Parameter {
    /// What is wrong with its name or numbers: the key, and what is valid.
    ///
    /// # Errors
    /// The first thing that is wrong.
    pub fn check(&self) -> Result<(), (&'static str, String)> {
        let Self { name, initial, bounds: [lower, upper], scale, price, .. } = self;
        if !is_name(name) {
            let message = format!("{name:?} cannot name a parameter: use letters, digits, `_`, `-` and `.`");
            return Err(("name", message));
        }
        if !(lower.is_finite() && upper.is_finite()) {
            return Err(("bounds", "must be two finite numbers".to_owned()));
        }
        if lower >= upper {
            let message = format!("are the wrong way round: [{lower}, {upper}]; the lower one comes first");
            return Err(("bounds", message));
        }
        if *scale == Scale::Log && *lower <= 0.0 {
            return Err(("bounds", format!("must be above 0 with scale = \"log\"; the lower one is {lower}")));
        }
        if !(lower..=upper).contains(&initial) {
            return Err(("initial", format!("{initial} is outside the bounds [{lower}, {upper}]")));
        }
        price.map_or(Ok(()), |price| price.check([*lower, *upper]).map_err(|message| ("price", message)))
    }
}

/// How the design search moves a parameter.
#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq, Eq, Serialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Scale {
    /// By differences.
    #[default]
    Linear,
    /// By ratios: for stiffnesses, variances and other positive numbers over decades.
    Log,
}

/// Who may change a parameter.
#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq, Eq, Serialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Role {
    /// The design search.
    #[default]
    Design,
    /// Only the user: set and swept, never optimised.
    Study,
}

/// All parameters of a problem, in the order in which they were declared.
#[derive(Clone, Debug, Default, Deserialize, PartialEq, Serialize)]
pub struct Parameters(Vec<Parameter>);

impl Parameters {
    /// The given parameters.
    pub fn new(list: Vec<Parameter>) -> Self {
        Self(list)
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// All of them.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = &Parameter> {
        self.0.iter()
    }

    /// The one with this index.
    pub fn get(&self, index: usize) -> &Parameter {
        &self.0[index]
    }

    /// Their names.
    pub fn names(&self) -> Vec<String> {
        self.iter().map(|parameter| parameter.name.clone()).collect()
    }

    /// The index of the parameter `name`.
    ///
    /// # Errors
    /// Where there is none; the error lists those there are.
    pub fn index(&self, name: &str) -> Result<usize, Error> {
        self.iter().position(|parameter| parameter.name == name).ok_or_else(|| Error::Unknown {
            what: "parameter",
            name: name.to_owned(),
            valid: if self.is_empty() { "none".to_owned() } else { quoted(&self.names()) },
        })
    }

    /// Their initial values.
    pub fn initial(&self) -> Vec<f64> {
        self.iter().map(|parameter| parameter.initial).collect()
    }

    /// Indices of those that the design search may change.
    pub fn design(&self) -> Vec<usize> {
        (0..self.len()).filter(|&i| self.0[i].role == Role::Design).collect()
    }

    /// The same, with those of these indices no longer the design search's to change.
    pub fn held(&self, indices: &[usize]) -> Self {
        let mut held = self.clone();
        for &index in indices {
            held.0[index].role = Role::Study;
        }
        held
    }

    /// The least a value can be: the number itself, or its parameter's lower bound. `None` for a parameter that is
    /// not of these.
    pub fn least(&self, value: Value) -> Option<f64> {
        match value {
            Value::Number(number) => Some(number),
            Value::Parameter(index) => self.0.get(index).map(|parameter| parameter.bounds[0]),
        }
    }

    /// Sets one parameter in a vector of all, checking its bounds.
    ///
    /// # Errors
    /// Where there is no such parameter or the value is outside its bounds.
    pub fn set(&self, phi: &mut [f64], name: &str, value: f64) -> Result<(), Error> {
        let index = self.index(name)?;
        let [lower, upper] = self.0[index].bounds;
        if !(lower..=upper).contains(&value) {
            return Err(Error::OutOfBounds { name: name.to_owned(), value, lower, upper });
        }
        phi[index] = value;
        Ok(())
    }
}
