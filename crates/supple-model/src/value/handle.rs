use std::ops::{Index, IndexMut};

/// A declared parameter, as returned by [`Parameters::declare`](crate::parameters::Parameters::declare).
///
/// It stands for the parameter wherever one is asked for: in place of a number of a model, a noise or a cost, as the index
/// of its value among those of all parameters, of its entry in gradients, and of its bounds and its name in
/// [`Parameters`](crate::parameters::Parameters).
///
/// ```
/// use supple_model::Value;
/// use supple_model::parameters::{Named, Parameter, ParameterError, Parameters, Price};
///
/// let mut parameters = Parameters::default();
/// let variance = Parameter::new("variance", 1e-4, [1e-6, 1e-2]).with_price(Price::Inverse(1e-3));
/// let [stiffness, variance] = [Parameter::new("stiffness", 500.0, [100.0, 2000.0]), variance]
///     .map(|parameter| parameters.declare(parameter));
///
/// // Values and bounds.
/// let mut phi = parameters.initial();
/// parameters.set(&mut phi, stiffness, 700.0)?;
/// phi[variance] *= 10.0;
/// assert_eq!((phi[stiffness], parameters[stiffness].bounds), (700.0, [100.0, 2000.0]));
///
/// // In place of a number: a potential energy, with its gradient by all parameters.
/// let energy = Value::from(stiffness).times(&0.5.into());
/// let mut gradient = [0.0; 2];
/// energy.add_gradient(&phi, 1.0, &mut gradient);
/// assert_eq!((energy.resolve::<f64>(&phi), gradient[stiffness], gradient[variance]), (350.0, 0.5, 0.0));
/// assert!((parameters.price_gradient(&phi)[variance] + 1e3).abs() < 1e-9);
///
/// // Held, so that a search no longer changes it.
/// assert_eq!(parameters.held([stiffness]).design(), [variance.index()]);
///
/// // Results have parameters by name.
/// let report = Named::new(&parameters, &phi);
/// assert_eq!(report.get(&parameters[stiffness].name), Some(700.0));
/// # Ok::<(), ParameterError>(())
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

/// The parameter's entry among one number for each parameter, such as their values or a gradient.
impl Index<ParameterHandle> for [f64] {
    type Output = f64;

    fn index(&self, parameter: ParameterHandle) -> &f64 {
        &self[parameter.0]
    }
}

impl IndexMut<ParameterHandle> for [f64] {
    fn index_mut(&mut self, parameter: ParameterHandle) -> &mut f64 {
        &mut self[parameter.0]
    }
}

/// The parameter's entry among one number for each parameter, such as their values or a gradient.
impl Index<ParameterHandle> for Vec<f64> {
    type Output = f64;

    fn index(&self, parameter: ParameterHandle) -> &f64 {
        &self[parameter.0]
    }
}

impl IndexMut<ParameterHandle> for Vec<f64> {
    fn index_mut(&mut self, parameter: ParameterHandle) -> &mut f64 {
        &mut self[parameter.0]
    }
}
