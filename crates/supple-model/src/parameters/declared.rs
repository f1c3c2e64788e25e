//! Parameters as users name them: by handle or by name.

use super::Parameters;
use super::error::ParameterError;
use crate::ParameterHandle;

/// A declared parameter: its handle, or its name.
///
/// Example: [`ParameterHandle`].
pub trait Declared {
    /// Its handle among these parameters.
    ///
    /// # Errors
    /// If there is no such parameter.
    fn among(self, parameters: &Parameters) -> Result<ParameterHandle, ParameterError>;
}

impl Declared for ParameterHandle {
    fn among(self, parameters: &Parameters) -> Result<Self, ParameterError> {
        let (number, count) = (self.index() + 1, parameters.len());
        if number > count { Err(ParameterError::Foreign { number, count }) } else { Ok(self) }
    }
}

impl Declared for &str {
    fn among(self, parameters: &Parameters) -> Result<ParameterHandle, ParameterError> {
        parameters.handle(self)
    }
}

impl Declared for &String {
    fn among(self, parameters: &Parameters) -> Result<ParameterHandle, ParameterError> {
        parameters.handle(self)
    }
}

impl Parameters {
    /// Sets one parameter in a vector of all, checking its bounds.
    ///
    /// # Errors
    /// Where there is no such parameter or the value is outside its bounds.
    pub fn set(&self, phi: &mut [f64], which: impl Declared, value: f64) -> Result<(), ParameterError> {
        let parameter = which.among(self)?;
        let [lower, upper] = self[parameter].bounds;
        if !(lower..=upper).contains(&value) {
            return Err(ParameterError::OutOfBounds { name: self[parameter].name.clone(), value, lower, upper });
        }
        phi[parameter] = value;
        Ok(())
    }
}
