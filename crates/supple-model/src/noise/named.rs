use serde::Deserialize;
use supple_text::{nearest, quoted};

use super::VaryingVariance;
use crate::document::{Unfit, matches};
use crate::parameters::Parameters;
use crate::{Channel, Channels, Value};

/// A [`VaryingVariance`] of measurements and a state by name, as task files write it:
/// `coefficient (state - center)^2` on top of the measurements' variances.
///
/// ```
/// use supple_model::noise::NamedVariance;
/// use supple_model::parameters::Parameters;
/// use supple_model::{Channels, Dimensions};
///
/// let size = Dimensions { states: 1, controls: 1, measurements: 2 };
/// let channels = Channels::plain(vec!["x1".to_owned()], size);
/// let (measurement, state) = (vec!["y*".to_owned()], "x2".to_owned());
/// let varying = NamedVariance { measurement, state, center: 0.0.into(), coefficient: 0.1.into() };
/// let wrong = varying.find(&channels, &Parameters::default()).err().ok_or("there is no state `x2`")?;
/// assert_eq!(wrong.key(), "state");
/// # Ok::<(), &'static str>(())
/// ```
#[derive(Clone, Debug, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(
    feature = "schema",
    schemars(description = "`coefficient (state - center)^2` on top of the measurements' variances")
)]
#[serde(deny_unknown_fields)]
pub struct NamedVariance {
    /// Names of the measurements, with * as a wildcard, whose variances depend on the state.
    #[cfg_attr(feature = "schema", schemars(length(min = 1)))]
    pub measurement: Vec<String>,
    /// Name of the state.
    pub state: String,
    /// State value at which the variance is smallest, in its unit.
    pub center: Value,
    /// Variance per square of the state's unit, at least 0.
    pub coefficient: Value,
}

impl NamedVariance {
    /// One entry for each measurement that is named.
    ///
    /// # Errors
    /// If a name does not exist, with advice, or a coefficient is or can be negative.
    pub fn find(&self, channels: &Channels, parameters: &Parameters) -> Result<Vec<VaryingVariance>, Unfit> {
        let states: Vec<&str> = channels.states.iter().map(|channel| channel.name.as_str()).collect();
        let Some(state) = states.iter().position(|name| *name == self.state) else {
            let message = format!("no state is `{}`; states: {}", self.state, quoted(&states));
            return Err(Unfit { help: nearest(&self.state, &states), ..Unfit::new("state", message) });
        };
        if let Some(least) = parameters.least(&self.coefficient).filter(|&least| least < 0.0) {
            let message = format!("must be at least 0, as it adds to a variance; {}", self.coefficient.found(least));
            return Err(Unfit::new("coefficient", message));
        }
        let of = |measurement| VaryingVariance {
            measurement,
            state,
            center: self.center.clone(),
            coefficient: self.coefficient.clone(),
        };
        Ok(self.places(&channels.measurements)?.map(of).collect())
    }

    /// Places of the measurements that are named, each once.
    fn places(&self, channels: &[Channel]) -> Result<impl Iterator<Item = usize>, Unfit> {
        if self.measurement.is_empty() {
            return Err(Unfit::new("measurement", "must name at least one measurement; found an empty list"));
        }
        let names: Vec<&str> = channels.iter().map(|channel| channel.name.as_str()).collect();
        for (entry, pattern) in self.measurement.iter().enumerate() {
            if !names.iter().any(|name| matches(pattern, name)) {
                let verb = if pattern.contains('*') { "fits" } else { "is" };
                let message = format!("no measurement {verb} `{pattern}`; measurements: {}", quoted(&names));
                let unfit = Unfit { help: nearest(pattern, &names), ..Unfit::new("measurement", message) };
                return Err(unfit.entry(entry));
            }
        }
        let fits = |name: &str| self.measurement.iter().any(|pattern| matches(pattern, name));
        let places = names.iter().enumerate().filter(|(_, name)| fits(name)).map(|(place, _)| place);
        Ok(places.collect::<Vec<_>>().into_iter())
    }
}
