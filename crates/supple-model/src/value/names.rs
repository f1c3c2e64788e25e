use std::cell::RefCell;

use super::Value;

/// The names of parameters that the values of a file may use, and which of them were used.
///
/// Example: the [front page](crate).
#[derive(Debug, Default)]
pub struct Names {
    declared: Vec<String>,
    /// Their initial values, where they are known.
    initial: Option<Vec<f64>>,
    used: RefCell<Vec<bool>>,
}

impl Names {
    /// The names of all parameters, in their order; none is used yet.
    #[must_use]
    pub fn new(declared: Vec<String>) -> Self {
        let used = RefCell::new(vec![false; declared.len()]);
        Self { declared, initial: None, used }
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
    pub fn value(&self, text: &str) -> Result<Value, String> {
        let mut index_of = |name: &str| {
            let index = self.declared.iter().position(|declared| declared == name)?;
            self.used.borrow_mut()[index] = true;
            Some(index)
        };
        let value = Value::read(text, &mut index_of, &self.declared)?;
        match self.initial.as_ref().map(|initial| value.resolve::<f64>(initial)) {
            Some(found) if !found.is_finite() => {
                Err(format!("must be finite; at the initial values of the parameters `{text}` is {found}"))
            }
            _ => Ok(value),
        }
    }

    /// The first name that no value used.
    pub fn unused(&self) -> Option<&str> {
        let index = self.used.borrow().iter().position(|used| !used)?;
        Some(&self.declared[index])
    }
}
