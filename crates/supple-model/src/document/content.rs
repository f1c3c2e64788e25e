//! The content of a parsed file, regardless of its format: strings, numbers, lists and tables, each with its byte range.

use std::borrow::{Borrow, Cow};
use std::cmp::Ordering;
use std::collections::BTreeMap;
use std::ops::Range;

/// A value or a key, with its byte range in the text. Comparisons ignore the range.
///
/// Example: the [module](crate::document).
#[derive(Clone, Debug)]
pub struct Spanned<T> {
    value: T,
    span: Range<usize>,
}

impl<T> Spanned<T> {
    /// A value with its bytes in the text.
    pub fn new(span: Range<usize>, value: T) -> Self {
        Self { value, span }
    }

    /// The value.
    pub fn get_ref(&self) -> &T {
        &self.value
    }

    /// Its bytes in the text.
    pub fn span(&self) -> Range<usize> {
        self.span.clone()
    }
}

impl<T: PartialEq> PartialEq for Spanned<T> {
    fn eq(&self, other: &Self) -> bool {
        self.value == other.value
    }
}

impl<T: Eq> Eq for Spanned<T> {}

impl<T: PartialOrd> PartialOrd for Spanned<T> {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        self.value.partial_cmp(&other.value)
    }
}

impl<T: Ord> Ord for Spanned<T> {
    fn cmp(&self, other: &Self) -> Ordering {
        self.value.cmp(&other.value)
    }
}

/// Lets tables look up keys by text.
impl Borrow<str> for Spanned<Cow<'_, str>> {
    fn borrow(&self) -> &str {
        &self.value
    }
}

/// The entries of a table by key.
///
/// Example: the [module](crate::document).
pub type Table<'a> = BTreeMap<Spanned<Cow<'a, str>>, Spanned<Content<'a>>>;

/// A value of a parsed file. Numbers are kept as written, so that code reading one can report that it is too large.
///
/// Example: the [module](crate::document).
#[derive(Clone, Debug)]
pub enum Content<'a> {
    /// Text.
    Text(Cow<'a, str>),
    /// A whole number.
    Whole {
        /// Its digits, with a sign where there is one.
        digits: Cow<'a, str>,
        /// Their base.
        radix: u32,
    },
    /// A number with a decimal point or an exponent, or one that is not finite.
    Decimal(Cow<'a, str>),
    /// `true` or `false`.
    Boolean(bool),
    /// A date or a time.
    Date,
    /// A list.
    List(Vec<Spanned<Content<'a>>>),
    /// A table.
    Table(Table<'a>),
}
