/// A declared parameter, as returned by [`Parameters::declare`](crate::parameters::Parameters::declare); a model
/// or a task can use it in place of a number.
///
/// ```
/// use supple_model::Value;
/// use supple_model::parameters::{Parameter, Parameters};
///
/// let mut parameters = Parameters::default();
/// let stiffness = parameters.declare(Parameter::new("stiffness", 500.0, [100.0, 2000.0]).with_unit("N/m"));
/// let phi = parameters.initial();
/// assert_eq!(Value::from(stiffness).resolve::<f64>(&phi), 500.0);
/// assert_eq!(phi[stiffness.index()], 500.0);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ParameterHandle(usize);

impl ParameterHandle {
    /// The parameter that was declared at this place, counted from 0.
    #[must_use]
    pub const fn at(index: usize) -> Self {
        Self(index)
    }

    /// Its place among all parameters, and in vectors of their values.
    #[must_use]
    pub const fn index(self) -> usize {
        self.0
    }
}
