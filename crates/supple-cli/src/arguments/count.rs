//! Values that the command line and study files read alike.

use std::fmt;
use std::str::FromStr;

use serde::de::value::StrDeserializer;
use serde::de::{DeserializeOwned, Error, IntoDeserializer, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};

/// A whole number within a range; the upper limit keeps memory use within bounds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Count<const LEAST: usize, const MOST: usize>(pub usize);

impl<const LEAST: usize, const MOST: usize> Count<LEAST, MOST> {
    fn of(number: Option<usize>, found: impl fmt::Display) -> Result<Self, String> {
        let within = number.filter(|number| (LEAST..=MOST).contains(number));
        within.map(Self).ok_or_else(|| format!("must be a whole number from {LEAST} to {MOST}; found {found}"))
    }
}

impl<const LEAST: usize, const MOST: usize> FromStr for Count<LEAST, MOST> {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        Self::of(text.parse().ok(), text)
    }
}

impl<const LEAST: usize, const MOST: usize> fmt::Display for Count<LEAST, MOST> {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        self.0.fmt(f)
    }
}

impl<'de, const LEAST: usize, const MOST: usize> Deserialize<'de> for Count<LEAST, MOST> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(CountVisitor)
    }
}

struct CountVisitor<const LEAST: usize, const MOST: usize>;

impl<const LEAST: usize, const MOST: usize> Visitor<'_> for CountVisitor<LEAST, MOST> {
    type Value = Count<LEAST, MOST>;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "a whole number from {LEAST} to {MOST}")
    }
    fn visit_i64<E: Error>(self, number: i64) -> Result<Self::Value, E> {
        Count::of(number.try_into().ok(), number).map_err(E::custom)
    }
    fn visit_u64<E: Error>(self, number: u64) -> Result<Self::Value, E> {
        Count::of(number.try_into().ok(), number).map_err(E::custom)
    }
}

/// Texts: one, or a list.
pub fn texts<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<String>, D::Error> {
    deserializer.deserialize_any(Texts)
}

struct Texts;

impl<'de> Visitor<'de> for Texts {
    type Value = Vec<String>;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("a text or a list of texts")
    }
    fn visit_str<E>(self, text: &str) -> Result<Vec<String>, E> {
        Ok(vec![text.to_owned()])
    }
    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Vec<String>, A::Error> {
        let mut texts = Vec::new();
        while let Some(text) = list.next_element()? {
            texts.push(text);
        }
        Ok(texts)
    }
}

/// Names of choices: in one text, separated by commas, or in a list.
pub fn choices<'de, T: DeserializeOwned, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<T>, D::Error> {
    let texts = texts(deserializer)?;
    let names = texts.iter().flat_map(|text| text.split(',')).map(str::trim);
    let choice = |name: &str| {
        let name: StrDeserializer<D::Error> = name.into_deserializer();
        T::deserialize(name)
    };
    names.map(choice).collect()
}

/// A count, or whether there is to be one: then this many.
pub fn count_or_flag<'de, const LEAST: usize, const MOST: usize, D: Deserializer<'de>>(
    deserializer: D,
    unsaid: usize,
) -> Result<Option<Count<LEAST, MOST>>, D::Error> {
    deserializer.deserialize_any(CountOrFlag::<LEAST, MOST> { unsaid })
}

struct CountOrFlag<const LEAST: usize, const MOST: usize> {
    unsaid: usize,
}

impl<const LEAST: usize, const MOST: usize> Visitor<'_> for CountOrFlag<LEAST, MOST> {
    type Value = Option<Count<LEAST, MOST>>;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "a whole number from {LEAST} to {MOST}, or true for {}", self.unsaid)
    }
    fn visit_bool<E>(self, wanted: bool) -> Result<Self::Value, E> {
        Ok(wanted.then_some(Count(self.unsaid)))
    }
    fn visit_i64<E: Error>(self, number: i64) -> Result<Self::Value, E> {
        CountVisitor.visit_i64(number).map(Some)
    }
    fn visit_u64<E: Error>(self, number: u64) -> Result<Self::Value, E> {
        CountVisitor.visit_u64(number).map(Some)
    }
}

/// Parses a seed.
pub fn seed(text: &str) -> Result<u64, String> {
    text.parse().map_err(|_| format!("must be a whole number from 0 to {}; found {text}", u64::MAX))
}
