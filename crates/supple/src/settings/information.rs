use std::fmt;
use std::str::FromStr;

use serde::de::value::MapAccessDeserializer;
use serde::de::{Error, MapAccess, Visitor};
use serde::ser::SerializeStruct;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// Weights of the three kinds of information in the objective of a design.
///
/// Written as one of `"needed"`, `"used"` and `"measured"`, or as a table of weights.
///
/// Example: the [module](crate::settings).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InformationWeights {
    /// Weight of the minimum information over all sensors and controllers at the cost limit.
    pub needed: f64,
    /// Weight of the information that the controller uses, `DI(x -> u)`.
    pub used: f64,
    /// Weight of the information that the sensors deliver, `DI(x -> y)`.
    pub measured: f64,
}

/// The kinds by name, in the order in which searches proceed to the next.
const KINDS: [(&str, InformationWeights); 3] = [
    ("needed", InformationWeights::NEEDED),
    ("used", InformationWeights::USED),
    ("measured", InformationWeights::MEASURED),
];

impl Default for InformationWeights {
    fn default() -> Self {
        Self::MEASURED
    }
}

impl InformationWeights {
    /// The minimum information over all sensors and controllers.
    pub const NEEDED: Self = Self { needed: 1.0, used: 0.0, measured: 0.0 };
    /// Information that the controller uses.
    pub const USED: Self = Self { needed: 0.0, used: 1.0, measured: 0.0 };
    /// Information that the sensors deliver.
    pub const MEASURED: Self = Self { needed: 0.0, used: 0.0, measured: 1.0 };

    /// Whether weights make a sum to minimise: finite, none negative, not all 0.
    #[must_use]
    pub fn are_valid(&self) -> bool {
        let all = [self.needed, self.used, self.measured];
        all.iter().all(|weight| weight.is_finite() && *weight >= 0.0) && all.iter().any(|&weight| weight > 0.0)
    }

    /// The next kind, to be minimised once this one has reached zero; none after measured information.
    pub(crate) fn next(self) -> Option<Self> {
        match self {
            _ if self.measured > 0.0 => None,
            _ if self.used > 0.0 => Some(Self::MEASURED),
            _ => Some(Self::USED),
        }
    }

    /// The name of the kind that is minimised, if it is a single one.
    #[must_use]
    pub fn kind(&self) -> Option<&'static str> {
        KINDS.iter().find(|(_, weights)| weights == self).map(|&(name, _)| name)
    }

    /// The kind of a name.
    #[must_use]
    pub fn of_kind(name: &str) -> Option<Self> {
        KINDS.iter().find(|(other, _)| *other == name).map(|&(_, weights)| weights)
    }
}

/// From one of the kinds, or from weights: `needed=1,measured=0.01`.
impl FromStr for InformationWeights {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if let Some(weights) = Self::of_kind(text) {
            return Ok(weights);
        }
        let valid = "valid: `needed`, `used`, `measured`, or weights of them such as `needed=1,measured=0.01`";
        let mut weights = Self { needed: 0.0, used: 0.0, measured: 0.0 };
        for part in text.split(',') {
            let (name, weight) =
                part.split_once('=').ok_or_else(|| format!("unknown information `{text}`; {valid}"))?;
            let place = match name.trim() {
                "needed" => &mut weights.needed,
                "used" => &mut weights.used,
                "measured" => &mut weights.measured,
                other => return Err(format!("unknown information `{other}`; {valid}")),
            };
            *place = weight.trim().parse().map_err(|_| format!("the weight `{weight}` is not a number; {valid}"))?;
        }
        if weights.are_valid() {
            Ok(weights)
        } else {
            Err("weights must be at least 0, and one of them above 0".into())
        }
    }
}

impl InformationWeights {
    /// The text that [`InformationWeights::from_str`] parses.
    pub fn argument(&self) -> String {
        let weighed = || self.weighed().map(|(name, weight)| format!("{name}={weight}")).collect::<Vec<_>>().join(",");
        self.kind().map_or_else(weighed, str::to_owned)
    }

    /// The kinds that count, with their weights.
    fn weighed(&self) -> impl Iterator<Item = (&'static str, f64)> {
        let all = [("needed", self.needed), ("used", self.used), ("measured", self.measured)];
        all.into_iter().filter(|(_, weight)| *weight != 0.0)
    }
}

impl fmt::Display for InformationWeights {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        if let Some(kind) = self.kind() {
            return f.write_str(kind);
        }
        let parts: Vec<String> = self.weighed().map(|(name, weight)| format!("{weight} {name}")).collect();
        f.write_str(&parts.join(" + "))
    }
}

impl Serialize for InformationWeights {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        if let Some(kind) = self.kind() {
            return serializer.serialize_str(kind);
        }
        let mut table = serializer.serialize_struct("InformationWeights", 3)?;
        table.serialize_field("needed", &self.needed)?;
        table.serialize_field("used", &self.used)?;
        table.serialize_field("measured", &self.measured)?;
        table.end()
    }
}

impl<'de> Deserialize<'de> for InformationWeights {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(Written)
    }
}

struct Written;

#[derive(Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
#[derive(Default)]
struct Table {
    needed: f64,
    used: f64,
    measured: f64,
}

impl<'de> Visitor<'de> for Written {
    type Value = InformationWeights;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("`needed`, `used`, `measured`, or a table of their weights")
    }

    fn visit_str<E: Error>(self, name: &str) -> Result<Self::Value, E> {
        if name.contains('=') {
            return name.parse().map_err(E::custom);
        }
        let names = &["needed", "used", "measured"];
        InformationWeights::of_kind(name).ok_or_else(|| E::unknown_variant(name, names))
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Self::Value, A::Error> {
        let Table { needed, used, measured } = Table::deserialize(MapAccessDeserializer::new(map))?;
        Ok(InformationWeights { needed, used, measured })
    }
}

#[cfg(feature = "schema")]
impl schemars::JsonSchema for InformationWeights {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "InformationWeights".into()
    }

    fn json_schema(generator: &mut schemars::SchemaGenerator) -> schemars::Schema {
        let table = generator.subschema_for::<Table>();
        schemars::json_schema!({ "anyOf": [{ "type": "string", "enum": ["needed", "used", "measured"] }, table] })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<InformationWeights, String> {
        #[derive(Deserialize)]
        struct Top {
            information: InformationWeights,
        }
        toml::from_str::<Top>(&format!("information = {text}")).map(|top| top.information).map_err(|e| e.to_string())
    }

    #[test]
    fn they_are_written_as_a_name_or_as_a_table() {
        assert_eq!(read("\"used\""), Ok(InformationWeights { needed: 0.0, used: 1.0, measured: 0.0 }));
        let both = read("{ needed = 1.0, measured = 0.01 }").unwrap();
        assert_eq!(both.to_string(), "1 needed + 0.01 measured");
        assert_eq!(read("\"needed=1,measured=0.01\""), Ok(both));
        assert!(read("\"wanted\"").unwrap_err().contains("`needed`, `used`, `measured`"));
        assert!(read("{ wanted = 1.0 }").unwrap_err().contains("wanted"));
        for weights in [both, InformationWeights::MEASURED] {
            let text = serde_json::to_string(&weights).unwrap();
            assert_eq!(serde_json::from_str::<InformationWeights>(&text).unwrap(), weights);
        }
    }

    #[test]
    fn they_are_read_as_arguments() {
        for text in ["needed", "used", "measured", "needed=1,measured=0.01", "used=2"] {
            let weights: InformationWeights = text.parse().unwrap();
            assert_eq!(weights.argument(), text);
        }
        for (text, message) in [
            ("wanted", "unknown information `wanted`; valid: `needed`"),
            ("needed=1,wanted=2", "unknown information `wanted`"),
            ("needed=much", "the weight `much` is not a number"),
            ("needed=-1", "at least 0"),
            ("needed=0", "one of them above 0"),
        ] {
            let error = text.parse::<InformationWeights>().unwrap_err();
            assert!(error.contains(message), "{error}");
        }
    }

    #[test]
    fn searches_go_on_to_what_is_used_and_then_to_what_is_measured() {
        let needed = InformationWeights::of_kind("needed").unwrap();
        let used = needed.next().unwrap();
        assert_eq!(used.kind(), Some("used"));
        assert_eq!(used.next(), Some(InformationWeights::MEASURED));
        assert_eq!(InformationWeights::MEASURED.next(), None);
    }
}
