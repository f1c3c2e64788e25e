use std::cell::RefCell;
use std::collections::BTreeMap;
use std::rc::Rc;

use serde::de::value::MapDeserializer;
use serde::de::{Error, Visitor};

use super::error::ValueError;
use super::expression::{Expression, Tree};
use super::handle::ParameterHandle;
use super::parse::parse;
use super::{Value, is_name};

/// The names of parameters that the values of a file may use, and which of them were used.
///
/// Example: the [front page](crate).
#[derive(Debug, Default)]
pub struct Names {
    declared: Vec<String>,
    /// Their initial values, where they are known.
    initial: Option<Vec<f64>>,
    /// The numbers that some of them stand for; empty if all are parameters.
    set: Vec<Option<f64>>,
    used: Rc<RefCell<Vec<bool>>>,
}

impl Names {
    /// The names of all parameters, in their order; none is used yet.
    #[must_use]
    pub fn new(declared: Vec<String>) -> Self {
        let used = Rc::new(RefCell::new(vec![false; declared.len()]));
        Self { declared, initial: None, set: Vec::new(), used }
    }

    /// The same names, of which some stand for numbers: one entry per name. Which of them were used is known to both.
    ///
    /// ```
    /// use supple_model::value::Names;
    ///
    /// let names = Names::new(vec!["k".into(), "mass".into()]);
    /// let loaded = names.setting(vec![None, Some(3.0)]);
    /// assert_eq!(loaded.value("mass")?.resolve::<f64>(&[2.0, 1.0]), 3.0);
    /// assert_eq!(loaded.value("k * mass")?.resolve::<f64>(&[2.0, 1.0]), 6.0);
    /// assert!(names.unused().is_empty());
    /// # Ok::<(), supple_model::ValueError>(())
    /// ```
    #[must_use]
    pub fn setting(&self, set: Vec<Option<f64>>) -> Self {
        Self { declared: self.declared.clone(), initial: self.initial.clone(), set, used: self.used.clone() }
    }

    /// The same with the parameters' initial values, at which every value must be finite.
    #[must_use]
    pub fn starting_at(self, initial: Vec<f64>) -> Self {
        Self { initial: Some(initial), ..self }
    }

    /// Interprets text in place of a number as a parameter or an expression of parameters, which are marked as used.
    ///
    /// # Errors
    /// What is wrong with it.
    pub fn value(&self, text: &str) -> Result<Value, ValueError> {
        self.read(text).map(|(value, _)| value)
    }

    /// Gives text in place of a number to a visitor that requested a value: a map with the text as its only key, to the
    /// index of each name in it and, where it stands for one, its number.
    ///
    /// # Errors
    /// As of [`value`](Self::value), and those of the visitor.
    pub(crate) fn respond<'de, V: Visitor<'de>, E: Error>(&self, text: &str, visitor: V) -> Result<V::Value, E> {
        let (_, indices) = self.read(text).map_err(E::custom)?;
        visitor.visit_map(MapDeserializer::new(std::iter::once((text, indices))))
    }

    /// The value, and what each name in the text stands for.
    fn read(&self, text: &str) -> Result<(Value, BTreeMap<String, Vec<f64>>), ValueError> {
        let mut indices = BTreeMap::new();
        let mut leaf_of = |name: &str| {
            let index = self.declared.iter().position(|declared| declared == name)?;
            self.used.borrow_mut()[index] = true;
            let number = self.set.get(index).copied().flatten();
            let stands_for: Vec<f64> = std::iter::once(index as f64).chain(number).collect();
            let leaf = leaf(&stands_for);
            indices.insert(name.to_owned(), stands_for);
            leaf
        };
        let value = Value::read(text, &mut leaf_of, &self.declared)?;
        match self.initial.as_ref().map(|initial| value.resolve::<f64>(initial)) {
            Some(found) if !found.is_finite() => Err(ValueError::NotFiniteAtFirst { text: text.to_owned(), found }),
            _ => Ok((value, indices)),
        }
    }

    /// The names that no value used.
    #[must_use]
    pub fn unused(&self) -> Vec<&str> {
        let used = self.used.borrow();
        self.declared.iter().zip(used.iter()).filter(|(_, used)| !**used).map(|(name, _)| name.as_str()).collect()
    }
}

impl Value {
    /// Interprets text in place of a number: the name of a parameter, or an expression of parameter names.
    ///
    /// # Errors
    /// What is wrong with it.
    pub(super) fn read(
        text: &str,
        leaf_of: &mut impl FnMut(&str) -> Option<Tree>,
        declared: &[String],
    ) -> Result<Self, ValueError> {
        match leaf_of(text) {
            Some(Tree::Parameter(index)) => return Ok(Self::Parameter(ParameterHandle::at(index))),
            // Not a number of the text: what holds for numbers that somebody wrote does not hold for it.
            Some(number) => return Ok(Self::Expression(Expression::new(number))),
            None => {}
        }
        if text.trim().is_empty() {
            return Err(ValueError::Empty { text: text.to_owned() });
        }
        if text.parse::<f64>().is_ok() {
            return Err(undeclared(text, declared));
        }
        let mut is_named = false;
        let known = |name: &str| {
            is_named = true;
            leaf_of(name).ok_or_else(|| undeclared(name, declared))
        };
        // `a-b` may be intended as a name or as a difference.
        let tree = parse(text, &mut { known })
            .map_err(|error| if is_name(text) { undeclared(text, declared) } else { error })?;
        let expression = Expression::new(tree);
        if is_named {
            return Ok(Self::Expression(expression));
        }
        let number = expression.resolve::<f64>(&[]);
        if number.is_finite() { Ok(Self::Number(number)) } else { Err(ValueError::NotANumber { found: number }) }
    }
}

/// What a name stands for: the index of a parameter, and the number that it is set to, if any.
pub(super) fn leaf(stands_for: &[f64]) -> Option<Tree> {
    match *stands_for {
        [_, number] => Some(Tree::Number(number)),
        [index] => Some(Tree::Parameter(index as usize)),
        _ => None,
    }
}

/// The error for text in place of a number that is not the name of a parameter.
fn undeclared(name: &str, declared: &[String]) -> ValueError {
    match name.parse::<f64>() {
        Ok(_) => ValueError::Quoted { text: name.to_owned() },
        Err(_) => ValueError::Undeclared { name: name.to_owned(), declared: declared.to_vec() },
    }
}
