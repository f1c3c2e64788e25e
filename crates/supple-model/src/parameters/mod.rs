//! Parameters: named numbers that designs and studies change.
//!
//! # A spring and a sensor
//!
//! ```
//! use supple_model::parameters::{CatalogueEntry, Named, Parameter, ParameterError, Parameters, Price, Role, Scale};
//!
//! let stock = [300.0, 500.0].map(|value| CatalogueEntry { value, price: Some(12.0), name: None });
//! let spring = Parameter::new("stiffness", 500.0, [100.0, 2000.0]).with_unit("N/m").with_scale(Scale::Log);
//! let sensor = Parameter::new("variance", 1e-4, [1e-6, 1e-2]).with_price(Price::Inverse(1e-3));
//! let payload = Parameter::new("payload", 1.0, [0.0, 5.0]).with_unit("kg").with_role(Role::Study);
//! let parameters = Parameters::new(vec![spring.with_catalogue(stock.to_vec()), sensor, payload]);
//!
//! let mut phi = parameters.initial();
//! parameters.set(&mut phi, "variance", 1e-3)?;
//! assert_eq!(Named::new(&parameters, &phi).get("variance"), Some(1e-3));
//! assert!((parameters.price(&phi) - 13.0).abs() < 1e-9, "12 for the spring, and 1 for the sensor");
//! assert_eq!(parameters.design(), [0, 1], "only studies change the payload");
//! let refused = parameters.set(&mut phi, "stiffness", 5.0);
//! assert!(matches!(refused, Err(ParameterError::OutOfBounds { lower: 100.0, .. })));
//! # Ok::<(), ParameterError>(())
//! ```

use std::ops::Index;

use serde::{Deserialize, Serialize};
use supple_kernels::math;
use supple_text::{digits, quoted};

use crate::document::Unfit;
use crate::{ParameterHandle, Value, ValueError, is_name};

mod declared;
mod error;
mod named;
mod price;
mod prices;

pub use declared::Declared;
pub use error::ParameterError;
pub use named::Named;
pub use price::{Price, PriceError};
pub use prices::PriceReport;

/// A named number that tasks and designs may change.
///
/// Example: the [module](crate::parameters).
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
    /// The available values in increasing order; empty if all values within the bounds are available.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub catalogue: Vec<CatalogueEntry>,
}

/// An available value of a parameter.
///
/// Example: the [module](crate::parameters).
#[derive(Clone, Debug, Default, Deserialize, PartialEq, Serialize)]
#[serde(deny_unknown_fields)]
pub struct CatalogueEntry {
    /// The value, in the unit of the parameter.
    pub value: f64,
    /// Its price in any currency, if given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub price: Option<f64>,
    /// The manufacturer's name for it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
}

impl Parameter {
    /// A parameter that the design search moves between these bounds on a linear scale, without unit and price.
    #[must_use]
    pub fn new(name: impl Into<String>, initial: f64, bounds: [f64; 2]) -> Self {
        Self {
            name: name.into(),
            initial,
            bounds,
            scale: Scale::Linear,
            unit: String::new(),
            role: Role::Design,
            price: None,
            catalogue: Vec::new(),
        }
    }

    /// The same with this scale.
    #[must_use]
    pub fn with_scale(self, scale: Scale) -> Self {
        Self { scale, ..self }
    }

    /// The same with this unit.
    #[must_use]
    pub fn with_unit(self, unit: impl Into<String>) -> Self {
        Self { unit: unit.into(), ..self }
    }

    /// The same, changeable by this role.
    #[must_use]
    pub fn with_role(self, role: Role) -> Self {
        Self { role, ..self }
    }

    /// The same with this price.
    #[must_use]
    pub fn with_price(self, price: Price) -> Self {
        Self { price: Some(price), ..self }
    }

    /// The same, restricted to these values.
    #[must_use]
    pub fn with_catalogue(self, catalogue: Vec<CatalogueEntry>) -> Self {
        Self { catalogue, ..self }
    }

    fn sort_catalogue(&mut self) {
        self.catalogue.sort_by(|a, b| a.value.total_cmp(&b.value));
    }

    /// Whether a value is at a bound within the accuracy of a search: within a millionth of the range, and within
    /// a thousandth of the bound itself or, of a bound of 0, of the initial value, which may be far smaller than the range.
    #[must_use]
    pub fn is_at(&self, end: f64, value: f64) -> bool {
        let distance = (value - end).abs();
        let [lower, upper] = self.bounds;
        let size = if end == 0.0 { self.initial.abs() } else { end.abs() };
        distance <= 1e-6 * (upper - lower) && (size == 0.0 || distance <= 1e-3 * size)
    }

    /// What is wrong with its name or numbers: the key, and what is valid.
    ///
    /// # Errors
    /// The first thing that is wrong.
    pub fn check(&self) -> Result<(), Unfit> {
        let Self { name, initial, bounds: [lower, upper], scale, price, .. } = self;
        if !is_name(name) {
            let message = format!("{name:?} cannot name a parameter: use letters, digits, `_`, `-` and `.`");
            return Err(Unfit::new("name", message));
        }
        if !(lower.is_finite() && upper.is_finite()) {
            return Err(Unfit::new("bounds", "must be two finite numbers".to_owned()));
        }
        if lower == upper {
            let message = format!("are equal: [{lower}, {upper}]; replace a fixed parameter by a number");
            return Err(Unfit::new("bounds", message));
        }
        if lower > upper {
            let message = format!("are reversed: [{}, {}]", digits(*lower), digits(*upper));
            return Err(Unfit::new("bounds", message));
        }
        if *scale == Scale::Log && *lower <= 0.0 {
            return Err(Unfit::new(
                "bounds",
                format!("must be above 0 with scale = \"log\"; the lower one is {lower}"),
            ));
        }
        if !(lower..=upper).contains(&initial) {
            let [initial, lower, upper] = [initial, lower, upper].map(|number| digits(*number));
            return Err(Unfit::new("initial", format!("{initial} is outside the bounds [{lower}, {upper}]")));
        }
        if let Some(Err(unfit)) = price.map(|price| price.check([*lower, *upper])) {
            return Err(Unfit::new("price", unfit.to_string()));
        }
        if !self.catalogue.is_empty() && self.role == Role::Study {
            let message = "applies only to design parameters; this one has role = \"study\"";
            return Err(Unfit::new("catalogue", message.to_owned()));
        }
        match self.wrong_entry() {
            Some((index, message)) => Err(Unfit::new("catalogue", format!("entry {}: {message}", index + 1))),
            None => Ok(()),
        }
    }

    /// The first entry of the catalogue that is wrong: its place, and what is valid.
    #[must_use]
    pub fn wrong_entry(&self) -> Option<(usize, String)> {
        let [lower, upper] = self.bounds;
        self.catalogue.iter().enumerate().find_map(|(index, entry)| {
            let CatalogueEntry { value, price, .. } = entry;
            let twice = self.catalogue[..index].iter().any(|other| other.value == *value);
            match price {
                _ if !(lower..=upper).contains(value) => {
                    let [lower, upper, value] = [lower, upper, *value].map(digits);
                    Some((index, format!("must be within the bounds [{lower}, {upper}]; found {value}")))
                }
                _ if twice => Some((index, format!("the value {} occurs twice", digits(*value)))),
                Some(price) if !(*price >= 0.0 && price.is_finite()) => {
                    Some((index, format!("a price must be a number of at least 0; found {}", digits(*price))))
                }
                _ => None,
            }
        })
    }

    /// The entry of its catalogue with this value, where there is one.
    #[must_use]
    pub fn entry(&self, value: f64) -> Option<&CatalogueEntry> {
        self.catalogue.iter().find(|entry| entry.value == value)
    }
}

/// How the design search moves a parameter.
///
/// Example: the [module](crate::parameters).
#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "schema", schemars(description = "How the design search moves a parameter."))]
#[serde(rename_all = "snake_case")]
pub enum Scale {
    /// Linear.
    #[default]
    Linear,
    /// Logarithmic: for stiffnesses, variances and other positive numbers that span decades.
    Log,
}

impl Scale {
    /// The position of a value within its range, from 0 at the lower bound to 1 at the upper one.
    #[must_use]
    pub fn share(self, [lower, upper]: [f64; 2], value: f64) -> f64 {
        match self {
            Self::Linear => (value - lower) / (upper - lower),
            Self::Log => math::ln(value / lower) / math::ln(upper / lower),
        }
    }

    /// The value at a position within the range, clamped to the bounds.
    #[must_use]
    pub fn value(self, [lower, upper]: [f64; 2], share: f64) -> f64 {
        let value = match self {
            Self::Linear => lower + share * (upper - lower),
            Self::Log => lower * math::powf(upper / lower, share),
        };
        value.clamp(lower, upper)
    }

    /// Converts a derivative with respect to a parameter into one with respect to the position within its range.
    #[must_use]
    pub fn slope(self, [lower, upper]: [f64; 2], value: f64, slope: f64) -> f64 {
        match self {
            Self::Linear => slope * (upper - lower),
            Self::Log => slope * value * math::ln(upper / lower),
        }
    }
}

/// Who may change a parameter.
///
/// Example: the [module](crate::parameters).
#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "schema", schemars(description = "Who may change a parameter."))]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum Role {
    /// The design search.
    #[default]
    Design,
    /// Only the user: set and swept, never optimised.
    Study,
}

/// All parameters of a problem, in the order in which they were declared.
///
/// Example: the [module](crate::parameters).
#[derive(Clone, Debug, Default, Deserialize, PartialEq, Serialize)]
pub struct Parameters(Vec<Parameter>);

impl Parameters {
    /// The given parameters, with their catalogues sorted.
    #[must_use]
    pub fn new(mut list: Vec<Parameter>) -> Self {
        list.iter_mut().for_each(Parameter::sort_catalogue);
        Self(list)
    }

    /// Checks each of them, and that no two have the same name.
    ///
    /// # Errors
    /// The first thing that is wrong, with the name of the parameter.
    ///
    /// ```
    /// use supple_model::parameters::{Parameter, Parameters};
    ///
    /// let twice = ["k", "k"].map(|name| Parameter::new(name, 1.0, [0.5, 2.0]));
    /// let wrong = Parameters::new(twice.to_vec()).check().err().map(|unfit| unfit.to_string());
    /// assert_eq!(wrong.as_deref(), Some("parameters[1].name: `k` is the name of another parameter too"));
    /// ```
    pub fn check(&self) -> Result<(), Unfit> {
        for (index, parameter) in self.iter().enumerate() {
            let here = |unfit: Unfit| unfit.below(index).below("parameters");
            parameter.check().map_err(here)?;
            if self.iter().take(index).any(|other| other.name == parameter.name) {
                let message = format!("`{}` is the name of another parameter too", parameter.name);
                return Err(here(Unfit::new("name", message)));
            }
        }
        Ok(())
    }

    /// Adds a parameter; models and tasks refer to it by the returned handle.
    pub fn declare(&mut self, mut parameter: Parameter) -> ParameterHandle {
        parameter.sort_catalogue();
        self.0.push(parameter);
        ParameterHandle::at(self.0.len() - 1)
    }

    /// The parameter `name`.
    ///
    /// # Errors
    /// As [`Parameters::index`].
    pub fn handle(&self, name: &str) -> Result<ParameterHandle, ParameterError> {
        self.index(name).map(ParameterHandle::at)
    }

    /// How many there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// All of them.
    #[must_use]
    pub fn iter(&self) -> impl ExactSizeIterator<Item = &Parameter> {
        self.0.iter()
    }

    /// The one with this index.
    #[must_use]
    pub fn get(&self, index: usize) -> &Parameter {
        &self.0[index]
    }

    /// Their names.
    #[must_use]
    pub fn names(&self) -> Vec<String> {
        self.iter().map(|parameter| parameter.name.clone()).collect()
    }

    /// The index of the parameter `name`.
    ///
    /// # Errors
    /// If there is no such parameter; the error lists the valid names.
    pub fn index(&self, name: &str) -> Result<usize, ParameterError> {
        self.iter().position(|parameter| parameter.name == name).ok_or_else(|| ParameterError::Unknown {
            name: name.to_owned(),
            valid: if self.is_empty() { "none".to_owned() } else { quoted(&self.names()) },
        })
    }

    /// Their initial values.
    #[must_use]
    pub fn initial(&self) -> Vec<f64> {
        self.iter().map(|parameter| parameter.initial).collect()
    }

    /// Indices of those that the design search may change.
    #[must_use]
    pub fn design(&self) -> Vec<usize> {
        (0..self.len()).filter(|&i| self.0[i].role == Role::Design).collect()
    }

    /// Indices of those that the design search may change and that only have the values of a catalogue.
    #[must_use]
    pub fn catalogued(&self) -> Vec<usize> {
        self.design().into_iter().filter(|&index| !self.0[index].catalogue.is_empty()).collect()
    }

    /// The same with these parameters held: the design search no longer changes them.
    #[must_use]
    pub fn held(&self, which: impl IntoIterator<Item = ParameterHandle>) -> Self {
        let mut held = self.clone();
        which.into_iter().for_each(|parameter| held.0[parameter.index()].role = Role::Study);
        held
    }

    /// A lower bound of a value within the bounds of its parameters; exact if each parameter occurs in it only once.
    /// `None` if it uses a parameter that is not in this list.
    #[must_use]
    pub fn least(&self, value: &Value) -> Option<f64> {
        match value {
            Value::Number(number) => Some(*number),
            Value::Parameter(handle) => self.0.get(handle.index()).map(|parameter| parameter.bounds[0]),
            Value::Expression(expression) => {
                let bounds = |index: usize| self.0.get(index).map(|parameter| parameter.bounds);
                expression.range(&bounds).map(|[least, _]| least)
            }
        }
    }

    /// The number of a value at the initial values of its parameters.
    ///
    /// # Errors
    /// If it uses a parameter that is not in this list, or the number is not finite.
    pub fn number(&self, value: &Value) -> Result<f64, ValueError> {
        self.least(value).ok_or(ValueError::ForeignParameter)?;
        let number: f64 = value.resolve(&self.initial());
        if number.is_finite() { Ok(number) } else { Err(ValueError::NotFinite { found: number }) }
    }
}

/// A declared parameter.
impl Index<ParameterHandle> for Parameters {
    type Output = Parameter;

    fn index(&self, parameter: ParameterHandle) -> &Parameter {
        &self.0[parameter.index()]
    }
}
