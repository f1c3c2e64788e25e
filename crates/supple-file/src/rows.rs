use std::collections::BTreeMap;

use serde::Deserialize;
use serde::de::{self, Deserializer, MapAccess, SeqAccess, Visitor};
use supple_model::Value;
use supple_model::document::matches;
use supple_model::value::OneOrList;
use supple_text::nearest;

/// A list of numbers, a list of rows of numbers, or numbers by name.
#[derive(Debug)]
pub(super) enum Rows {
    Flat(Vec<Value>),
    Nested(Vec<Vec<Value>>),
    Named(BTreeMap<String, Value>),
}

impl<'de> Deserialize<'de> for Rows {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Entries;

        impl<'de> Visitor<'de> for Entries {
            type Value = Rows;

            fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
                f.write_str("a list of numbers, a list of rows of numbers, or a table of numbers by name")
            }
            fn visit_map<A: MapAccess<'de>>(self, table: A) -> Result<Rows, A::Error> {
                BTreeMap::deserialize(de::value::MapAccessDeserializer::new(table)).map(Rows::Named)
            }
            fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Rows, A::Error> {
                let (mut flat, mut nested) = (Vec::new(), Vec::new());
                while let Some(entry) = list.next_element::<OneOrList>()? {
                    match entry {
                        OneOrList::One(value) => flat.push(value),
                        OneOrList::List(row) => nested.push(row),
                    }
                }
                match (flat.is_empty(), nested.is_empty()) {
                    (_, true) => Ok(Rows::Flat(flat)),
                    (true, false) => Ok(Rows::Nested(nested)),
                    (false, false) => Err(de::Error::custom("numbers and rows of numbers must not be mixed")),
                }
            }
        }

        deserializer.deserialize_any(Entries)
    }
}

/// A first guess of the controls.
#[derive(Debug)]
pub(super) struct Guess(pub Rows);

impl<'de> Deserialize<'de> for Guess {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Rows::deserialize(deserializer).map(Self)
    }
}

/// Numbers given by names, as of [`given_by_name`]; 0 where none is given.
///
/// # Errors
/// As of that.
pub(super) fn by_name(
    given: &BTreeMap<String, Value>,
    names: &[String],
) -> Result<Vec<Value>, (String, Option<String>)> {
    Ok(given_by_name(given, names)?.into_iter().map(|value| value.cloned().unwrap_or_default()).collect())
}

/// Numbers given by names or patterns, in which `*` matches any letters, in the order of `names`; `None` if not given. A
/// full name takes precedence over a pattern, and a longer pattern over a shorter one.
///
/// # Errors
/// The first name or pattern that is none of them, with advice.
pub(super) fn given_by_name<'a>(
    given: &'a BTreeMap<String, Value>,
    names: &[String],
) -> Result<Vec<Option<&'a Value>>, (String, Option<String>)> {
    for key in given.keys() {
        if !names.iter().any(|name| matches(key, name)) {
            return Err((key.clone(), nearest(key, names)));
        }
    }
    let best = |name: &String| {
        let fitting = given.iter().filter(|(key, _)| matches(key, name));
        fitting.max_by_key(|(key, _)| (*key == name, key.len())).map(|(_, value)| value)
    };
    Ok(names.iter().map(best).collect())
}

impl schemars::JsonSchema for Rows {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Numbers".into()
    }
    fn json_schema(generator: &mut schemars::SchemaGenerator) -> schemars::Schema {
        let value = generator.subschema_for::<Value>();
        schemars::json_schema!({
            "description": "A list of numbers, the rows of a matrix, or numbers by name, in which * stands for any letters",
            "anyOf": [
                { "type": "array", "items": value },
                { "type": "array", "items": { "type": "array", "items": value } },
                { "type": "object", "additionalProperties": value }
            ]
        })
    }
}

impl schemars::JsonSchema for Guess {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Guess".into()
    }
    fn json_schema(generator: &mut schemars::SchemaGenerator) -> schemars::Schema {
        let value = generator.subschema_for::<Value>();
        schemars::json_schema!({
            "description": "One row of controls for all steps, or one row per step",
            "anyOf": [
                { "type": "array", "items": value },
                { "type": "array", "items": { "type": "array", "items": value } }
            ]
        })
    }
}
