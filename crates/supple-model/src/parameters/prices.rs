//! Prices of all parameters of a design.

use serde::{Deserialize, Serialize};

use super::named::Named;
use super::{Parameter, Parameters, Role};

/// Prices of a design.
///
/// In results:
///
/// ```json
/// {
///   "total": 13.0,
///   "budget": 20.0,
///   "weight_nats_per_unit": 0.0,
///   "objective_nats": 24.3,
///   "parameters": { "stiffness": 12.0, "variance": 1.0 }
/// }
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PriceReport {
    /// The sum, in units of the budget.
    pub total: f64,
    /// Budget for the total; `None` if there is no budget.
    pub budget: Option<f64>,
    /// Weight of the price in the design objective, nats per unit.
    pub weight_nats_per_unit: f64,
    /// The design objective: information plus weighted price, nats.
    pub objective_nats: f64,
    /// The price of each parameter that has one.
    pub parameters: Named,
}

impl Parameter {
    /// Whether it has a price, either directly or for an entry of its catalogue.
    fn has_price(&self) -> bool {
        self.price.is_some() || self.catalogue.iter().any(|entry| entry.price.is_some())
    }

    /// The price of a value: that of its catalogue entry if there is one, else that of its price form, else 0.
    fn price_at(&self, value: f64) -> f64 {
        let of_entry = self.entry(value).and_then(|entry| entry.price);
        of_entry.or(self.price.map(|price| price.at(value))).unwrap_or(0.0)
    }
}

impl Parameters {
    /// Whether any parameter has a price, or an entry of its catalogue.
    pub fn have_prices(&self) -> bool {
        self.iter().any(Parameter::has_price)
    }

    /// The sum of all prices at the values `phi`; 0 where no parameter has one.
    #[must_use]
    pub fn price(&self, phi: &[f64]) -> f64 {
        self.prices(phi).0.iter().map(|(_, price)| price).sum()
    }

    /// The price of each parameter that has one.
    #[must_use]
    pub fn prices(&self, phi: &[f64]) -> Named {
        let priced = self.iter().zip(phi).filter(|(parameter, _)| parameter.has_price());
        Named(priced.map(|(parameter, &value)| (parameter.name.clone(), parameter.price_at(value))).collect())
    }

    /// The sum of all prices as a search evaluates it at the values `phi`: for design parameters the smooth price forms;
    /// the prices of catalogue entries count only for parameters that the search holds at one.
    #[must_use]
    pub fn price_in_search(&self, phi: &[f64]) -> f64 {
        let price = |(parameter, &value): (&Parameter, &f64)| match parameter.role {
            Role::Design => parameter.price.map_or(0.0, |price| price.at(value)),
            Role::Study => parameter.price_at(value),
        };
        self.iter().zip(phi).map(price).sum()
    }

    /// The derivatives of the sum by all parameters.
    #[must_use]
    pub fn price_gradient(&self, phi: &[f64]) -> Vec<f64> {
        let slope = |(parameter, &value): (&Parameter, &f64)| parameter.price.map_or(0.0, |price| price.slope(value));
        self.iter().zip(phi).map(slope).collect()
    }
}
