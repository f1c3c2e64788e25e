//! The one gate that all numbers of a result pass: which of them are not finite.

use std::fmt::Display;

use serde::ser::{
    SerializeMap, SerializeSeq, SerializeStruct, SerializeStructVariant, SerializeTuple, SerializeTupleStruct,
    SerializeTupleVariant,
};
use serde::{Serialize, Serializer};

/// Keys whose numbers may be infinite or NaN because they are undefined: the excess over the limit of a task
/// without one, limits of such tasks on a front, shadow prices without a finite value, and
/// spread and significance of a single roll-out. If roll-outs diverge, their mean is not finite either.
const MAY_BE_OPEN: [&str; 11] = [
    "violation",
    "cost_standard_error",
    "deviation",
    "half_width_95",
    "difference",
    "interval_95",
    "p_value",
    "growths",
    "at_greatest",
    "bounds",
    "prices",
];

/// A number that is not finite.
///
/// Example: [`not_finite`].
#[derive(Clone, Debug, PartialEq)]
pub struct NotFinite {
    /// Where it is, such as `tasks.0.cost.expected`.
    pub place: String,
    /// It.
    pub value: f64,
}

impl Display for NotFinite {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(f, "`{}` is {}", self.place, self.value)
    }
}

/// All non-finite numbers of a result, except those explained by an `error` in the same record and those that are
/// undefined.
///
/// ```
/// use supple_study::not_finite;
///
/// #[derive(serde::Serialize)]
/// struct Found {
///     cost: f64,
///     information: f64,
/// }
///
/// let found = not_finite(&Found { cost: f64::NAN, information: 3.0 });
/// assert_eq!((found.len(), found[0].place.as_str()), (1, "cost"));
/// ```
pub fn not_finite(result: &impl Serialize) -> Vec<NotFinite> {
    let mut walk = Walk { place: Vec::new(), found: Vec::new() };
    // The walk can only fail on map keys that are not strings, which results do not have.
    let _ = result.serialize(&mut walk);
    walk.found
}

struct Walk {
    place: Vec<String>,
    found: Vec<NotFinite>,
}

impl Walk {
    fn see(&mut self, value: f64) {
        if !value.is_finite() && !self.place.iter().any(|key| MAY_BE_OPEN.contains(&key.as_str())) {
            self.found.push(NotFinite { place: self.place.join("."), value });
        }
    }

    fn enter(&mut self, key: String, value: &(impl Serialize + ?Sized)) -> Result<(), Stop> {
        self.place.push(key);
        let seen = value.serialize(&mut *self);
        self.place.pop();
        seen
    }
}

/// An error that ends the walk.
#[derive(Debug)]
struct Stop(String);

impl Display for Stop {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for Stop {}

impl serde::ser::Error for Stop {
    fn custom<T: Display>(message: T) -> Self {
        Self(message.to_string())
    }
}

/// Entries of a list, or fields of a record.
struct Inside<'a> {
    walk: &'a mut Walk,
    entries: usize,
    key: String,
    /// Number of findings before this record, to which they are cut back if it has an error.
    before: usize,
    failed: bool,
}

impl<'a> Inside<'a> {
    fn of(walk: &'a mut Walk) -> Self {
        let before = walk.found.len();
        Self { walk, entries: 0, key: String::new(), before, failed: false }
    }

    fn entry(&mut self, value: &(impl Serialize + ?Sized)) -> Result<(), Stop> {
        let key = self.entries.to_string();
        self.entries += 1;
        self.walk.enter(key, value)
    }

    fn field(&mut self, key: &str, value: &(impl Serialize + ?Sized)) -> Result<(), Stop> {
        if key == "error" {
            self.failed |= serde_json::to_value(value).is_ok_and(|error| !error.is_null());
        }
        self.walk.enter(key.to_owned(), value)
    }

    /// Drops the findings in a record with an error, which explains them.
    fn left(self) -> Result<(), Stop> {
        if self.failed {
            self.walk.found.truncate(self.before);
        }
        Ok(())
    }
}

macro_rules! nothing_to_see {
    ($($name:ident($kind:ty)),*) => {
        $(fn $name(self, _: $kind) -> Result<(), Stop> { Ok(()) })*
    };
}

impl<'a> Serializer for &'a mut Walk {
    type Ok = ();
    type Error = Stop;
    type SerializeSeq = Inside<'a>;
    type SerializeTuple = Inside<'a>;
    type SerializeTupleStruct = Inside<'a>;
    type SerializeTupleVariant = Inside<'a>;
    type SerializeMap = Inside<'a>;
    type SerializeStruct = Inside<'a>;
    type SerializeStructVariant = Inside<'a>;

    nothing_to_see!(
        serialize_bool(bool),
        serialize_i8(i8),
        serialize_i16(i16),
        serialize_i32(i32),
        serialize_i64(i64),
        serialize_u8(u8),
        serialize_u16(u16),
        serialize_u32(u32),
        serialize_u64(u64),
        serialize_char(char),
        serialize_str(&str),
        serialize_bytes(&[u8]),
        serialize_unit_struct(&'static str)
    );

    fn serialize_f32(self, value: f32) -> Result<(), Stop> {
        self.see(f64::from(value));
        Ok(())
    }

    fn serialize_f64(self, value: f64) -> Result<(), Stop> {
        self.see(value);
        Ok(())
    }

    fn serialize_none(self) -> Result<(), Stop> {
        Ok(())
    }

    fn serialize_some<T: Serialize + ?Sized>(self, value: &T) -> Result<(), Stop> {
        value.serialize(self)
    }

    fn serialize_unit(self) -> Result<(), Stop> {
        Ok(())
    }

    fn serialize_unit_variant(self, _: &'static str, _: u32, _: &'static str) -> Result<(), Stop> {
        Ok(())
    }

    fn serialize_newtype_struct<T: Serialize + ?Sized>(self, _: &'static str, value: &T) -> Result<(), Stop> {
        value.serialize(self)
    }

    fn serialize_newtype_variant<T: Serialize + ?Sized>(
        self,
        _: &'static str,
        _: u32,
        variant: &'static str,
        value: &T,
    ) -> Result<(), Stop> {
        self.enter(variant.to_owned(), value)
    }

    fn serialize_seq(self, _: Option<usize>) -> Result<Inside<'a>, Stop> {
        Ok(Inside::of(self))
    }

    fn serialize_tuple(self, _: usize) -> Result<Inside<'a>, Stop> {
        Ok(Inside::of(self))
    }

    fn serialize_tuple_struct(self, _: &'static str, _: usize) -> Result<Inside<'a>, Stop> {
        Ok(Inside::of(self))
    }

    fn serialize_tuple_variant(self, _: &'static str, _: u32, _: &'static str, _: usize) -> Result<Inside<'a>, Stop> {
        Ok(Inside::of(self))
    }

    fn serialize_map(self, _: Option<usize>) -> Result<Inside<'a>, Stop> {
        Ok(Inside::of(self))
    }

    fn serialize_struct(self, _: &'static str, _: usize) -> Result<Inside<'a>, Stop> {
        Ok(Inside::of(self))
    }

    fn serialize_struct_variant(self, _: &'static str, _: u32, _: &'static str, _: usize) -> Result<Inside<'a>, Stop> {
        Ok(Inside::of(self))
    }
}

macro_rules! entries {
    ($($part:ident::$method:ident),*) => {
        $(impl $part for Inside<'_> {
            type Ok = ();
            type Error = Stop;

            fn $method<T: Serialize + ?Sized>(&mut self, value: &T) -> Result<(), Stop> {
                self.entry(value)
            }

            fn end(self) -> Result<(), Stop> {
                self.left()
            }
        })*
    };
}

entries!(
    SerializeSeq::serialize_element,
    SerializeTuple::serialize_element,
    SerializeTupleStruct::serialize_field,
    SerializeTupleVariant::serialize_field
);

macro_rules! fields {
    ($($part:ident),*) => {
        $(impl $part for Inside<'_> {
            type Ok = ();
            type Error = Stop;

            fn serialize_field<T: Serialize + ?Sized>(&mut self, key: &'static str, value: &T) -> Result<(), Stop> {
                self.field(key, value)
            }

            fn end(self) -> Result<(), Stop> {
                self.left()
            }
        })*
    };
}

fields!(SerializeStruct, SerializeStructVariant);

impl SerializeMap for Inside<'_> {
    type Ok = ();
    type Error = Stop;

    fn serialize_key<T: Serialize + ?Sized>(&mut self, key: &T) -> Result<(), Stop> {
        let text = serde_json::to_value(key).map_err(serde::ser::Error::custom)?;
        self.key = text.as_str().map_or_else(|| text.to_string(), str::to_owned);
        Ok(())
    }

    fn serialize_value<T: Serialize + ?Sized>(&mut self, value: &T) -> Result<(), Stop> {
        let key = std::mem::take(&mut self.key);
        self.field(&key, value)
    }

    fn end(self) -> Result<(), Stop> {
        self.left()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Serialize)]
    struct Inner {
        cost: f64,
        bound: Option<f64>,
        violation: f64,
        error: Option<String>,
    }

    #[derive(Serialize)]
    struct Outer {
        tasks: Vec<Inner>,
        by_name: std::collections::BTreeMap<String, f64>,
    }

    fn outer(cost: f64, error: Option<&str>, named: f64) -> Outer {
        let inner = Inner { cost, bound: None, violation: f64::NEG_INFINITY, error: error.map(str::to_owned) };
        Outer { tasks: vec![inner], by_name: [("k1".to_owned(), named)].into() }
    }

    fn places(result: &Outer) -> Vec<String> {
        not_finite(result).iter().map(ToString::to_string).collect()
    }

    #[test]
    fn every_number_is_seen_with_its_place() {
        assert_eq!(places(&outer(1.0, None, 2.0)), Vec::<String>::new());
        assert_eq!(places(&outer(f64::INFINITY, None, f64::NAN)), ["`tasks.0.cost` is inf", "`by_name.k1` is NaN"]);
    }

    #[test]
    fn a_record_that_says_why_it_failed_is_explained() {
        assert_eq!(places(&outer(f64::NAN, Some("it diverged"), 2.0)), Vec::<String>::new());
        assert_eq!(places(&outer(f64::NAN, Some("it diverged"), f64::NAN)), ["`by_name.k1` is NaN"]);
    }
}
