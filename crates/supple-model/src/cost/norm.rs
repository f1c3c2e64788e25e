//! Norms: functions that convert a residual to a cost. To add one, write one file and one line in `norms.rs`.

use std::any::Any;
use std::fmt::Debug;
use std::sync::Arc;

use serde::Deserialize;
use supple_kernels::Scalar;
use supple_kernels::graph::{Function, Node, call, vjp};

use crate::document::Described;
use crate::parameters::Parameters;

/// What a kind of norm defines.
///
/// ```
/// use supple_model::cost::{Cost, NormKind};
/// use supple_model::quantity::State;
/// use supple_model::{Scalar, Value};
///
/// /// `ln(1 + (r / s)^2)`: bounded influence of outliers.
/// #[derive(Debug)]
/// struct Cauchy { scale: Value }
///
/// impl NormKind for Cauchy {
///     const NAME: &'static str = "cauchy";
///     fn value<S: Scalar>(&self, r: S, phi: &[S]) -> S {
///         (r / self.scale.resolve::<S>(phi)).square().ln_1p()
///     }
/// }
///
/// let cost = Cost::new(State::new([0]), 1.0).with_norm(Cauchy { scale: Value::Number(0.1) });
/// assert_eq!(cost.norm.name(), "cauchy");
/// ```
pub trait NormKind: Debug + Send + Sync + 'static {
    /// The name of the kind, as files write it.
    const NAME: &'static str;

    /// The norm of one entry of a residual at parameters `phi`: 0 at 0, at least 0 elsewhere.
    fn value<S: Scalar>(&self, r: S, phi: &[S]) -> S;

    /// Its second derivative with respect to the residual, which planning uses for the Gauss-Newton curvature. Override it
    /// if differentiating [`NormKind::value`] would lose digits.
    fn curvature(&self, r: Node, phi: &[Node]) -> Node {
        let r = r.opaque();
        let derivative = |of: Node| vjp(&[(of, Node::one())], &[r]).first().copied().unwrap_or_else(Node::zero);
        derivative(derivative(self.value(r, phi)))
    }

    /// Whether [`NormKind::curvature`] is never negative. If it can be, the curvature of the whole cost is projected to be
    /// positive semidefinite at every point.
    fn is_convex(&self) -> bool {
        false
    }

    /// Checks its numbers within the parameters' bounds.
    ///
    /// # Errors
    /// A message that states what was found and what is valid.
    fn check(&self, _parameters: &Parameters) -> Result<(), String> {
        Ok(())
    }
}

/// How a kind of norm is read from a task file.
///
/// Example: [`Kinds`](crate::Kinds).
pub trait NormFile: NormKind + Sized {
    /// Its settings; [`NoKeys`](super::NoKeys) if it has none.
    type File: for<'de> Deserialize<'de> + Described;

    /// The norm.
    fn build(file: Self::File) -> Self;
}

/// A function that converts a residual to a cost; any [`NormKind`] can be converted to it by `into`.
///
/// Example: [`NormKind`].
#[derive(Clone, Debug)]
pub struct Norm(Arc<dyn Kind>);

/// Object-safe interface of norms.
trait Kind: Any + Debug + Send + Sync {
    fn name(&self) -> &'static str;
    fn number(&self, r: f64, phi: &[f64]) -> f64;
    fn node(&self, r: Node, phi: &[Node]) -> Node;
    fn curvature(&self, r: Node, phi: &[Node]) -> Node;
    fn is_convex(&self) -> bool;
    fn check(&self, parameters: &Parameters) -> Result<(), String>;
}

impl<N: NormKind> Kind for N {
    fn name(&self) -> &'static str {
        N::NAME
    }
    fn number(&self, r: f64, phi: &[f64]) -> f64 {
        self.value(r, phi)
    }
    fn node(&self, r: Node, phi: &[Node]) -> Node {
        self.value(r, phi)
    }
    fn curvature(&self, r: Node, phi: &[Node]) -> Node {
        NormKind::curvature(self, r, phi)
    }
    fn is_convex(&self) -> bool {
        NormKind::is_convex(self)
    }
    fn check(&self, parameters: &Parameters) -> Result<(), String> {
        NormKind::check(self, parameters)
    }
}

impl<N: NormKind> From<N> for Norm {
    fn from(norm: N) -> Self {
        Self(Arc::new(norm))
    }
}

/// The norms of all entries of a residual, as a function of the residual and the parameters.
struct Values<'a>(&'a dyn Kind);

impl Function for Values<'_> {
    fn number(&self, inputs: &[&[f64]], outputs: &mut [f64]) {
        outputs.iter_mut().zip(inputs[0]).for_each(|(out, &r)| *out = self.0.number(r, inputs[1]));
    }
    fn node(&self, inputs: &[&[Node]], outputs: &mut [Node]) {
        outputs.iter_mut().zip(inputs[0]).for_each(|(out, &r)| *out = self.0.node(r, inputs[1]));
    }
}

impl Norm {
    /// The name of its kind, as files write it.
    #[must_use]
    pub fn name(&self) -> &'static str {
        self.0.name()
    }

    /// Whether it is of this kind.
    #[must_use]
    pub fn is<N: NormKind>(&self) -> bool {
        (&*self.0 as &dyn Any).is::<N>()
    }

    /// The norm of each entry of a residual.
    pub fn values<S: Scalar>(&self, r: &[S], phi: &[S]) -> Vec<S> {
        let mut values = vec![S::zero(); r.len()];
        call(&Values(&*self.0), &[r, phi], &mut values);
        values
    }

    /// The second derivative of the norm of one entry.
    #[must_use]
    pub fn curvature(&self, r: Node, phi: &[Node]) -> Node {
        self.0.curvature(r, phi)
    }

    /// Whether its [curvature](Self::curvature) is never negative.
    #[must_use]
    pub fn is_convex(&self) -> bool {
        self.0.is_convex()
    }

    /// Checks its numbers within the parameters' bounds.
    pub(super) fn check(&self, parameters: &Parameters) -> Result<(), String> {
        self.0.check(parameters)
    }
}
