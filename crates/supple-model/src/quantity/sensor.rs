//! A sensor: a quantity and its noise.

use serde::Deserialize;
use supple_text::FileError;

#[cfg(feature = "schema")]
use super::Kinds;
use super::{Context, Quantity, Unfit};
use crate::Value;
use crate::channels::Channel;
#[cfg(feature = "schema")]
use crate::document::merged;
use crate::document::{Reader, Spot};
#[cfg(feature = "schema")]
use crate::noise::with_deviation;
use crate::noise::{DEVIATION, variances, with_noise_key};
use crate::parameters::Parameters;
use crate::value::OneOrMore;

/// A quantity that is measured.
///
/// Example: the [module](crate::quantity).
#[derive(Clone, Debug)]
pub struct Sensor {
    /// What it measures.
    pub quantity: Quantity,
    /// Names and units of its entries.
    pub channels: Vec<Channel>,
    /// Variances of their noise.
    pub variances: Vec<Value>,
}

impl Sensor {
    /// Whether it measures what a quantity was in the last step, as it depends on the control.
    #[must_use]
    pub fn recalls(&self) -> bool {
        self.quantity.depends_on_control()
    }
}

/// The keys of a sensor beside those of its quantity.
const KEYS: &[&str] = &["variance", DEVIATION];

/// What a sensor has beside its quantity.
#[derive(Debug, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
struct File {
    /// Variance of the noise, one for all or one for each number that is measured, in squares of the unit; above 0.
    variance: OneOrMore,
}

/// The noise specification in the table of a sensor at a place.
///
/// In a task file, as a standard deviation, rad:
///
/// ```toml
/// [[model.sensors]]
/// kind = "joint_position"
/// deviation = 1e-3
/// ```
pub struct Noise<'a> {
    spot: Spot<'a>,
    /// `variance` or `deviation`.
    key: &'static str,
}

impl<'a> Noise<'a> {
    /// Finds the noise key of a table, and returns the table with that key read as `variance`.
    ///
    /// # Errors
    /// Where it has both.
    pub fn of<'t>(table: Reader<'t>, spot: Spot<'a>) -> Result<(Self, Reader<'t>), FileError> {
        let wrong = |message: &str| Unfit::new(DEVIATION, message).at(spot.document, spot.at);
        let (key, table) = with_noise_key(table).map_err(wrong)?;
        Ok((Self { spot, key }, table))
    }

    /// The variance of each of `count` entries, from what the key gives.
    ///
    /// # Errors
    /// If there is neither one variance nor `count` of them, or one is not above 0.
    pub fn variances(&self, given: OneOrMore, count: usize, parameters: &Parameters) -> Result<Vec<Value>, FileError> {
        let wrong = |message: String| Unfit::new(self.key, message).at(self.spot.document, self.spot.at);
        let each = given.each(count).map_err(|found| wrong(found.to_string()))?;
        variances(self.key, each, parameters)
            .map_err(|found| wrong(format!("must be above 0: sensor noise is required; {found}")))
    }
}

/// Reads the sensor of kind `kind` from its table at a place, without the key `kind`.
///
/// # Errors
/// Where the table is wrong, or does not fit the model.
///
/// Such a table in a task file:
///
/// ```toml
/// [[model.sensors]]
/// kind = "joint_torque"
/// select = ["elbow"]
/// variance = 1e-2
/// ```
pub fn read_sensor(kind: &str, table: Reader, spot: Spot, context: &Context) -> Result<Sensor, FileError> {
    let unfit = |key: &'static str, message: &str| Unfit::new(key, message).at(spot.document, spot.at);
    let (noise, keys_of_noise) = Noise::of(table, spot)?;
    let quantity = context.read(kind, table.beside(KEYS), spot)?;
    if !quantity.is_measurable() {
        return Err(unfit("kind", &format!("`{kind}` cannot be measured: it depends on the next state")));
    }
    if quantity.is_empty() {
        return Err(unfit("select", "name at least one"));
    }
    let file = File::deserialize(keys_of_noise.only(KEYS)).map_err(|error| spot.document.read_error(spot.at, error))?;
    let variances = noise.variances(file.variance, quantity.len(), context.parameters)?;
    Ok(Sensor { channels: quantity.channels(context.vocabulary), quantity, variances })
}

/// The schema of each kind's table, by name.
///
/// It merges keys like the example of [`merged`].
#[cfg(feature = "schema")]
pub fn sensor_schemas(
    kinds: &Kinds,
    generator: &mut schemars::SchemaGenerator,
) -> Vec<(&'static str, schemars::Schema)> {
    let common = <File as schemars::JsonSchema>::json_schema(generator);
    let all = kinds.schemas(generator).into_iter();
    all.map(|(kind, own)| (kind, with_deviation(merged(own, &common)))).collect()
}
