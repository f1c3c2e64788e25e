//! Classes of defaults: values for attributes that elements do not set.
//!
//! A class inherits from its parent class and overrides some values. The outermost class is `main`. The class of an
//! element is the one that its `class` names, or else the `childclass` of the innermost enclosing body or frame with one,
//! or else `main`.

use std::collections::{BTreeMap, HashMap};

use supple_text::FileError;

use super::super::warnings::Warnings;
use super::super::words::{listed, near, shown};
use super::super::xml::Element;
use super::known::{ACTUATORS, ORIENTATIONS, attributes, check_attributes};
use super::law::{LAWS, Numbers};

/// The class `main`.
pub(super) const MAIN: usize = 0;
/// Classes of a file, at most.
const MOST: usize = 10_000;
/// Elements whose defaults are read.
const READ: [&str; 5] = ["joint", "geom", "site", "mesh", "equality"];
/// Elements of a class that are known but not modelled.
const PASSED: &str = "default material camera light pair tendon skin";

/// A class: for each tag and attribute, the element that sets the value.
#[derive(Clone, Default)]
struct Class<'a> {
    values: BTreeMap<(&'static str, &'static str), Element<'a>>,
    /// Sizes of geoms: an element may give fewer numbers than it inherits, and keeps the remaining ones.
    size: [f64; 3],
    /// Gain and bias of actuators.
    numbers: Numbers,
}

/// The classes of a file.
pub(super) struct Classes<'a> {
    classes: Vec<Class<'a>>,
    /// Index and element of each class by its name.
    names: HashMap<&'a str, (usize, Option<Element<'a>>)>,
}

impl<'a> Classes<'a> {
    /// The classes of a file.
    ///
    /// # Errors
    /// If a class has no name, or the same name as another one.
    pub(super) fn read(root: Element<'a>, warnings: &mut Warnings) -> Result<Self, FileError> {
        let mut classes = Self { classes: vec![Class::default()], names: HashMap::from([("main", (MAIN, None))]) };
        for at in root.all("default") {
            if let Some(name) = at.attribute("class").filter(|name| !matches!(*name, "" | "main")) {
                let message = format!("the outermost class is `main`, and cannot be called {}", shown(name));
                return Err(at.error_at("class", message).with_help("enclose it in a `default` without a class"));
            }
            classes.fill(MAIN, at, warnings)?;
        }
        Ok(classes)
    }

    /// Reads a `default` element into class `index`, with its nested classes.
    fn fill(&mut self, index: usize, at: Element<'a>, warnings: &mut Warnings) -> Result<(), FileError> {
        for tag in READ {
            let Some(element) = at.child(tag)? else { continue };
            check_attributes(element, tag, warnings);
            let class = &mut self.classes[index];
            if ORIENTATIONS.iter().any(|name| element.attribute(name).is_some()) {
                class.values.retain(|(of, name), _| *of != tag || !ORIENTATIONS.contains(name));
            }
            for name in attributes(tag).filter(|name| element.attribute(name).is_some()) {
                class.values.insert((tag, name), element);
            }
            if tag == "geom" {
                sizes(element, &mut class.size)?;
            }
        }
        let is_actuator = |element: &Element| ACTUATORS.split_ascii_whitespace().any(|tag| tag == element.tag());
        for element in at.children().filter(is_actuator) {
            self.actuator(index, element, warnings)?;
        }
        for element in at.children().filter(|element| !READ.contains(&element.tag()) && !is_actuator(element)) {
            if element.tag() == "default" {
                self.nested(index, element, warnings)?;
            } else if PASSED.split_ascii_whitespace().all(|tag| tag != element.tag()) {
                warnings.unknown(element, &READ);
            }
        }
        Ok(())
    }

    /// Reads an actuator element into class `index`: all kinds of actuators share their defaults.
    fn actuator(&mut self, index: usize, at: Element<'a>, warnings: &mut Warnings) -> Result<(), FileError> {
        if LAWS.contains(&at.tag()) {
            check_attributes(at, at.tag(), warnings);
        }
        let class = &mut self.classes[index];
        for name in attributes("actuator").filter(|name| at.attribute(name).is_some()) {
            class.values.insert(("actuator", name), at);
        }
        class.numbers.update(at)
    }

    /// Gain and bias of an actuator's class.
    ///
    /// # Errors
    /// Where it names a class that is not known.
    pub(super) fn numbers(&self, at: Element<'a>) -> Result<Numbers, FileError> {
        Ok(self.classes[self.named(at, "class", MAIN)?].numbers)
    }

    /// A class in class `parent`.
    fn nested(&mut self, parent: usize, at: Element<'a>, warnings: &mut Warnings) -> Result<(), FileError> {
        let name = at.required("class")?;
        let index = self.classes.len();
        if index >= MOST {
            return Err(at.error(format!("a file has at most {MOST} classes")));
        }
        if let Some((_, first)) = self.names.insert(name, (index, Some(at))) {
            let place = first.map_or_else(String::new, |first| format!(", at {}", first.place()));
            return Err(at.error_at("class", format!("there is another class {}{place}", shown(name))));
        }
        self.classes.push(self.classes[parent].clone());
        self.fill(index, at, warnings)
    }

    /// The class that an attribute of an element names, or else `otherwise`.
    ///
    /// # Errors
    /// Where there is no such class.
    pub(super) fn named(&self, at: Element, attribute: &str, otherwise: usize) -> Result<usize, FileError> {
        let Some(name) = at.attribute(attribute).filter(|name| !name.is_empty()) else { return Ok(otherwise) };
        if let Some(&(index, _)) = self.names.get(name) {
            return Ok(index);
        }
        let mut known: Vec<_> = self.names.iter().map(|(name, (index, _))| (*index, *name)).collect();
        known.sort_unstable();
        let known: Vec<_> = known.into_iter().map(|(_, name)| name).collect();
        let message = format!("there is no class {}; known: {}", shown(name), listed(&known));
        let error = at.error_at(attribute, message);
        Err(match near(name, &known) {
            Some(help) => error.with_help(help),
            None => error,
        })
    }

    /// The values of an element with the defaults of `tag`, where elements are of `class` if they name none.
    ///
    /// # Errors
    /// Where it names a class that is not known.
    pub(super) fn values(&self, at: Element<'a>, tag: &'static str, class: usize) -> Result<Values<'a, '_>, FileError> {
        Ok(Values { at, tag, class: Some(&self.classes[self.named(at, "class", class)?]) })
    }
}

/// Overwrites sizes of a geom with those of an element.
fn sizes(at: Element, size: &mut [f64; 3]) -> Result<(), FileError> {
    let Some(found) = at.list("size")? else { return Ok(()) };
    if found.len() > 3 {
        return Err(at.error_at("size", format!("`size` is at most 3 numbers, and has {}", found.len())));
    }
    size.iter_mut().zip(found).for_each(|(size, found)| *size = found);
    Ok(())
}

/// The values of an element: its own, and those of its class.
#[derive(Clone, Copy)]
pub(super) struct Values<'a, 'c> {
    /// The element.
    pub(super) at: Element<'a>,
    tag: &'static str,
    class: Option<&'c Class<'a>>,
}

impl<'a> Values<'a, '_> {
    /// The values of an element that has no defaults.
    pub(super) fn own(at: Element<'a>) -> Self {
        Self { at, tag: "", class: None }
    }

    /// The element that has the attribute: itself, or one of its class.
    pub(super) fn holder(&self, name: &'static str) -> Option<Element<'a>> {
        if self.at.attribute(name).is_some() {
            return Some(self.at);
        }
        self.class?.values.get(&(self.tag, name)).copied()
    }

    /// The text of an attribute.
    pub(super) fn text(&self, name: &'static str) -> Option<&'a str> {
        self.holder(name)?.attribute(name)
    }

    /// One number.
    pub(super) fn number(&self, name: &'static str) -> Result<Option<f64>, FileError> {
        self.holder(name).map_or(Ok(None), |at| at.number(name))
    }

    /// `N` numbers.
    pub(super) fn numbers<const N: usize>(&self, name: &'static str) -> Result<Option<[f64; N]>, FileError> {
        self.holder(name).map_or(Ok(None), |at| at.numbers(name))
    }

    /// Any number of numbers.
    pub(super) fn list(&self, name: &'static str) -> Result<Option<Vec<f64>>, FileError> {
        self.holder(name).map_or(Ok(None), |at| at.list(name))
    }

    /// One of several words.
    pub(super) fn choice<T: Copy>(&self, name: &'static str, valid: &[(&str, T)]) -> Result<Option<T>, FileError> {
        self.holder(name).map_or(Ok(None), |at| at.choice(name, valid))
    }

    /// The sizes of a geom; 0 if not set.
    pub(super) fn sizes(&self) -> Result<[f64; 3], FileError> {
        let mut size = self.class.map_or([0.0; 3], |class| class.size);
        sizes(self.at, &mut size)?;
        Ok(size)
    }

    /// An error about the value of an attribute, which may be that of a class.
    pub(super) fn error(&self, name: &'static str, message: impl Into<String>) -> FileError {
        self.holder(name).unwrap_or(self.at).error_at(name, message)
    }
}
