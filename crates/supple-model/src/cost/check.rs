//! What is wrong with a cost, whoever made it.

use supple_lqg::Dimensions;
use supple_text::count;

use super::{Cost, Quadratic, Weights, quadratic};
use crate::document::Unfit;
use crate::parameters::Parameters;

impl Cost {
    /// Checks that it fits a model with this many signals: what its quantity reads, one target and one weight for each of the
    /// quantity's entries; and then its numbers, within the parameters' bounds.
    ///
    /// # Errors
    /// What is wrong: the key, what was found, and what is valid.
    ///
    /// ```
    /// use supple_lqg::Dimensions;
    /// use supple_model::cost::{Cost, Weights};
    /// use supple_model::parameters::Parameters;
    /// use supple_model::quantity::State;
    ///
    /// let size = Dimensions { states: 2, controls: 1, measurements: 1 };
    /// let cost = Cost::new(State::new([0, 1]), 1.0).with_weights(Weights::Each(vec![1.0.into()]));
    /// let wrong = cost.check(size, 0, &Parameters::default()).err().map(|unfit| unfit.to_string());
    /// assert_eq!(wrong.as_deref(), Some("weight: must be 2 numbers, one for each entry of `state`; found 1"));
    /// ```
    pub fn check(&self, size: Dimensions, signals: usize, parameters: &Parameters) -> Result<(), Unfit> {
        self.quantity.check_reach(size, signals)?;
        self.check_lengths()?;
        for target in &self.targets {
            parameters.number(target).map_err(|wrong| Unfit::new("target", wrong.to_string()))?;
        }
        self.quantity.check(parameters)?;
        self.check_numbers(parameters)
    }

    fn check_lengths(&self) -> Result<(), Unfit> {
        let (len, name) = (self.quantity.len(), self.quantity.name());
        let valid = format!("must be {}, one for each entry of `{name}`", count(len, "number"));
        if self.targets.len() != len {
            return Err(Unfit::new("target", format!("{valid}; found {}", self.targets.len())));
        }
        for (key, weights) in [("weight", &self.stage), ("final_weight", &self.last)] {
            match weights {
                Weights::Equal(_) => {}
                Weights::Each(weights) if weights.len() == len => {}
                Weights::Each(weights) => return Err(Unfit::new(key, format!("{valid}; found {}", weights.len()))),
                Weights::Matrix(_) if !self.norm.is::<Quadratic>() => {
                    let message = format!("must be numbers: the norm `{}` takes no matrix", self.norm.name());
                    return Err(Unfit::new(key, message));
                }
                Weights::Matrix(rows) if rows.len() == len && rows.iter().all(|row| row.len() == len) => {}
                Weights::Matrix(rows) => {
                    let columns = rows.first().map_or(0, Vec::len);
                    let message =
                        format!("must be a matrix of {len} x {len} numbers; found {} x {columns}", rows.len());
                    return Err(Unfit::new(key, message));
                }
            }
        }
        Ok(())
    }

    /// Checks the weights and the norm within the parameters' bounds.
    pub(super) fn check_numbers(&self, parameters: &Parameters) -> Result<(), Unfit> {
        for (key, weights) in [("weight", &self.stage), ("final_weight", &self.last)] {
            for weight in weights.iter() {
                parameters.number(weight).map_err(|wrong| Unfit::new(key, wrong.to_string()))?;
                // Entries of matrices may be negative.
                let is_factor = !matches!(weights, Weights::Matrix(_));
                if let Some(least) = parameters.least(weight).filter(|&least| is_factor && least < 0.0) {
                    return Err(Unfit::new(key, format!("must be at least 0; {}", weight.found(least))));
                }
            }
        }
        self.norm.check(parameters).map_err(|message| Unfit::new("norm", message))?;
        quadratic::check(self, parameters)
    }
}
