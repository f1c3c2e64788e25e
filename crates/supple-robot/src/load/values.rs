//! Parses attributes and texts of an element: names, choices and numbers.

use std::borrow::Cow;

use supple_text::FileError;

use super::words::{listed, near, shown};
use super::xml::Element;

/// Location of numbers, for messages: an attribute, or the text of an element.
#[derive(Clone, Copy)]
enum Place<'a> {
    Attribute(&'a str),
    Content,
}

impl<'a> Element<'a> {
    /// The names of its attributes.
    pub(super) fn attributes(self) -> impl Iterator<Item = &'a str> {
        self.node.attributes().map(|attribute| attribute.name())
    }

    /// The name of the first attribute whose value satisfies a condition.
    pub(super) fn attribute_with(self, such: impl Fn(&str) -> bool) -> Option<&'a str> {
        self.node.attributes().find(|attribute| such(attribute.value())).map(|attribute| attribute.name())
    }

    /// The value of an attribute, where there is one.
    pub(super) fn attribute(self, name: &str) -> Option<&'a str> {
        self.node.attribute(name)
    }

    /// The value of an attribute, which must be there and not blank.
    ///
    /// # Errors
    /// Where it is missing or blank.
    pub(super) fn required(self, name: &str) -> Result<&'a str, FileError> {
        match self.node.attribute(name) {
            None => Err(self.error(format!("attribute {} is missing", shown(name)))),
            Some(value) if value.trim().is_empty() => {
                Err(self.error_at(name, format!("attribute {} is empty", shown(name))))
            }
            Some(value) => Ok(value),
        }
    }

    /// One of several words in an attribute, where there is one.
    ///
    /// # Errors
    /// If it is another word.
    pub(super) fn choice<T: Copy>(self, name: &str, valid: &[(&str, T)]) -> Result<Option<T>, FileError> {
        let Some(found) = self.node.attribute(name) else { return Ok(None) };
        self.choose(Place::Attribute(name), found, valid).map(Some)
    }

    /// One of several words in the element's text.
    ///
    /// # Errors
    /// Where it is another word.
    pub(super) fn content_choice<T: Copy>(self, valid: &[(&str, T)]) -> Result<T, FileError> {
        self.choose(Place::Content, &self.content()?, valid)
    }

    fn choose<T: Copy>(self, place: Place, found: &str, valid: &[(&str, T)]) -> Result<T, FileError> {
        if let Some((_, choice)) = valid.iter().find(|(word, _)| *word == found.trim()) {
            return Ok(*choice);
        }
        let words: Vec<_> = valid.iter().map(|(word, _)| *word).collect();
        let error = self.error_in(place, format!("{} is {}; valid: {}", said(place), shown(found), listed(&words)));
        Err(match near(found.trim(), &words) {
            Some(help) => error.with_help(help),
            None => error,
        })
    }

    /// Exactly `N` finite numbers in an attribute, where there is one.
    ///
    /// # Errors
    /// If they are anything else.
    pub(super) fn numbers<const N: usize>(self, name: &str) -> Result<Option<[f64; N]>, FileError> {
        let Some(text) = self.node.attribute(name) else { return Ok(None) };
        self.exactly(Place::Attribute(name), text).map(Some)
    }

    /// Exactly `N` finite numbers in an attribute, which must be there.
    ///
    /// # Errors
    /// If it is missing or anything else.
    pub(super) fn required_numbers<const N: usize>(self, name: &str) -> Result<[f64; N], FileError> {
        self.exactly(Place::Attribute(name), self.required(name)?)
    }

    /// Any number of finite numbers in an attribute, where there is one.
    ///
    /// # Errors
    /// If they are anything else.
    pub(super) fn list(self, name: &str) -> Result<Option<Vec<f64>>, FileError> {
        let Some(text) = self.node.attribute(name) else { return Ok(None) };
        self.parsed(Place::Attribute(name), text).map(Some)
    }

    /// One finite number in an attribute, where there is one.
    ///
    /// # Errors
    /// Where it is not that.
    pub(super) fn number(self, name: &str) -> Result<Option<f64>, FileError> {
        Ok(self.numbers::<1>(name)?.map(|[number]| number))
    }

    /// One finite number in an attribute, which must be there.
    ///
    /// # Errors
    /// If it is missing or anything else.
    pub(super) fn required_number(self, name: &str) -> Result<f64, FileError> {
        self.required_numbers::<1>(name).map(|[number]| number)
    }

    /// The text in the element, without blanks around it and without comments.
    ///
    /// # Errors
    /// Where there is none.
    pub(super) fn content(self) -> Result<Cow<'a, str>, FileError> {
        let texts = self.node.children().filter_map(|child| child.is_text().then(|| child.text()).flatten());
        let texts: Vec<_> = texts.map(str::trim).filter(|text| !text.is_empty()).collect();
        match texts.as_slice() {
            [] => Err(self.error("it must not be empty")),
            [text] => Ok(Cow::Borrowed(text)),
            texts => Ok(Cow::Owned(texts.join(" "))),
        }
    }

    /// Exactly `N` finite numbers in the element's text.
    ///
    /// # Errors
    /// Where it is not that.
    pub(super) fn content_numbers<const N: usize>(self) -> Result<[f64; N], FileError> {
        self.exactly(Place::Content, &self.content()?)
    }

    /// One finite number in the element's text.
    ///
    /// # Errors
    /// Where it is not that.
    pub(super) fn content_number(self) -> Result<f64, FileError> {
        self.content_numbers::<1>().map(|[number]| number)
    }

    /// One number in the element's text, which may be infinite: `inf`, `-inf`.
    ///
    /// # Errors
    /// Where it is not that.
    pub(super) fn content_extended(self) -> Result<f64, FileError> {
        match self.content()?.trim_start_matches('+').to_ascii_lowercase().as_str() {
            "inf" | "infinity" => Ok(f64::INFINITY),
            "-inf" | "-infinity" => Ok(f64::NEG_INFINITY),
            _ => self.content_number(),
        }
    }

    fn error_in(self, place: Place, message: String) -> FileError {
        match place {
            Place::Attribute(attribute) => self.error_at(attribute, message),
            Place::Content => self.error_in_content(message),
        }
    }

    fn exactly<const N: usize>(self, place: Place, text: &str) -> Result<[f64; N], FileError> {
        self.parsed(place, text)?.try_into().map_err(|found: Vec<f64>| {
            let expected = if N == 1 { "one number".to_owned() } else { format!("{N} numbers") };
            let found = match found.len() {
                0 => "is empty".to_owned(),
                count => format!("has {count}: {}", shown(text.trim())),
            };
            self.error_in(place, format!("{} must be {expected}, but {found}", said(place)))
        })
    }

    fn parsed(self, place: Place, text: &str) -> Result<Vec<f64>, FileError> {
        let number = |word: &str| match word.parse::<f64>() {
            Ok(number) if number.is_finite() => Ok(number),
            other => {
                let what = if other.is_ok() { "finite" } else { "a number" };
                Err(self.error_in(place, format!("{} holds {}, which is not {what}", said(place), shown(word))))
            }
        };
        text.split_ascii_whitespace().map(number).collect()
    }
}

/// How messages describe a location.
fn said(place: Place) -> String {
    match place {
        Place::Attribute(name) => shown(name),
        Place::Content => "its value".to_owned(),
    }
}
