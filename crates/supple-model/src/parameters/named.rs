//! Values by the names of parameters.

use serde::de::{MapAccess, Visitor};
use serde::ser::SerializeMap;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::Parameters;

/// Values by parameter name, in the order of declaration.
///
/// Example: the [module](crate::parameters).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Named(pub Vec<(String, f64)>);

impl Named {
    /// Names with their values.
    #[must_use]
    pub fn new(parameters: &Parameters, values: &[f64]) -> Self {
        Self(parameters.iter().map(|p| p.name.clone()).zip(values.iter().copied()).collect())
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The value of `name`.
    #[must_use]
    pub fn get(&self, name: &str) -> Option<f64> {
        self.0.iter().find(|(other, _)| other == name).map(|&(_, value)| value)
    }
}

/// ```
/// use supple_model::Named;
///
/// let stiffnesses = Named::from([("hip", 300.0), ("knee", 200.0)]);
/// assert_eq!(stiffnesses.get("knee"), Some(200.0));
/// ```
impl<Name: Into<String>, const COUNT: usize> From<[(Name, f64); COUNT]> for Named {
    fn from(values: [(Name, f64); COUNT]) -> Self {
        Self(values.map(|(name, value)| (name.into(), value)).into())
    }
}

impl Serialize for Named {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(Some(self.0.len()))?;
        for (name, value) in &self.0 {
            map.serialize_entry(name, value)?;
        }
        map.end()
    }
}

impl<'de> Deserialize<'de> for Named {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_map(Pairs)
    }
}

/// Reads names with values in their order.
struct Pairs;

impl<'de> Visitor<'de> for Pairs {
    type Value = Named;

    fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.write_str("numbers by name")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Named, A::Error> {
        let mut pairs = Vec::new();
        while let Some((name, value)) = map.next_entry::<String, Option<f64>>()? {
            pairs.push((name, value.unwrap_or(f64::NAN)));
        }
        Ok(Named(pairs))
    }
}
