//! Expressions of parameters, such as `2 * sqrt(k * m)`, in the place of numbers.

use std::collections::BTreeSet;
use std::sync::Arc;

use supple_kernels::{Dual, Scalar};

use super::handle::ParameterHandle;
use super::range::Range;

/// An expression of parameters. Copies share it.
///
/// Example: the [front page](crate).
#[derive(Clone, Debug, PartialEq)]
pub struct Expression(Arc<Tree>);

/// What an expression is made of.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Tree {
    Number(f64),
    /// The parameter with this index.
    Parameter(usize),
    Negative(Box<Tree>),
    Binary(Operator, Box<[Tree; 2]>),
    Function(Function, Box<Tree>),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Operator {
    Add,
    Subtract,
    Multiply,
    Divide,
    Power,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Function {
    Sqrt,
    Exp,
    Ln,
    Sin,
    Cos,
    Tan,
    Tanh,
}

impl Function {
    /// All functions with their names in files.
    pub const ALL: [(&'static str, Self); 7] = [
        ("sqrt", Self::Sqrt),
        ("exp", Self::Exp),
        ("ln", Self::Ln),
        ("sin", Self::Sin),
        ("cos", Self::Cos),
        ("tan", Self::Tan),
        ("tanh", Self::Tanh),
    ];
}

/// Integer powers up to this exponent use multiplications.
const MOST_MULTIPLIED: f64 = 64.0;

impl Expression {
    pub(super) fn new(tree: Tree) -> Self {
        Self(Arc::new(tree))
    }

    pub(super) fn tree(&self) -> &Tree {
        &self.0
    }

    /// The value, given all parameters.
    pub fn resolve<S: Scalar>(&self, phi: &[S]) -> S {
        self.0.resolve(phi)
    }

    /// The indices of its parameters, in increasing order.
    #[must_use]
    pub fn parameters(&self) -> Vec<usize> {
        let mut found = BTreeSet::new();
        self.0.collect(&mut found);
        found.into_iter().collect()
    }

    /// The derivative by each of its parameters.
    #[must_use]
    pub fn slopes(&self, phi: &[f64]) -> Vec<(ParameterHandle, f64)> {
        let mut all: Vec<Dual<f64, 1>> = phi.iter().map(|&value| Dual::fixed(value)).collect();
        let slope = |index: usize| {
            all[index] = Dual::variable(phi[index], 0);
            let slope = self.0.resolve(&all).tangents[0];
            all[index] = Dual::fixed(phi[index]);
            (ParameterHandle::at(index), slope)
        };
        self.parameters().into_iter().map(slope).collect()
    }

    /// Bounds on its values, given the bounds of all parameters; conservative if a parameter occurs in
    /// it more than once.
    pub fn range(&self, bounds: &impl Fn(usize) -> Option<[f64; 2]>) -> Option<[f64; 2]> {
        self.0.range(bounds).map(|Range { lower, upper }| [lower, upper])
    }
}

impl Tree {
    pub fn resolve<S: Scalar>(&self, phi: &[S]) -> S {
        match self {
            Self::Number(number) => S::constant(*number),
            Self::Parameter(index) => phi[*index],
            Self::Negative(of) => -of.resolve(phi),
            Self::Binary(operator, of) => {
                let [a, b] = &**of;
                match (operator, b) {
                    (Operator::Power, Self::Number(exponent)) => power(a.resolve(phi), *exponent),
                    (Operator::Power, _) => (a.resolve(phi).ln() * b.resolve(phi)).exp(),
                    (Operator::Add, _) => a.resolve(phi) + b.resolve(phi),
                    (Operator::Subtract, _) => a.resolve(phi) - b.resolve(phi),
                    (Operator::Multiply, _) => a.resolve(phi) * b.resolve(phi),
                    (Operator::Divide, _) => a.resolve(phi) / b.resolve(phi),
                }
            }
            Self::Function(function, of) => {
                let of: S = of.resolve(phi);
                match function {
                    Function::Sqrt => of.sqrt(),
                    Function::Exp => of.exp(),
                    Function::Ln => of.ln(),
                    Function::Sin => of.sin(),
                    Function::Cos => of.cos(),
                    Function::Tan => of.sin() / of.cos(),
                    Function::Tanh => of.tanh(),
                }
            }
        }
    }

    fn collect(&self, found: &mut BTreeSet<usize>) {
        match self {
            Self::Number(_) => {}
            Self::Parameter(index) => {
                found.insert(*index);
            }
            Self::Negative(of) | Self::Function(_, of) => of.collect(found),
            Self::Binary(_, of) => of.iter().for_each(|of| of.collect(found)),
        }
    }

    fn range(&self, bounds: &impl Fn(usize) -> Option<[f64; 2]>) -> Option<Range> {
        Some(match self {
            Self::Number(number) => Range { lower: *number, upper: *number },
            Self::Parameter(index) => bounds(*index).map(|[lower, upper]| Range { lower, upper })?,
            Self::Negative(of) => -of.range(bounds)?,
            Self::Binary(operator, of) => {
                let [a, b] = [of[0].range(bounds)?, of[1].range(bounds)?];
                match (operator, &of[1]) {
                    (Operator::Add, _) => a + b,
                    (Operator::Subtract, _) => a - b,
                    (Operator::Multiply, _) => a * b,
                    (Operator::Divide, _) => a / b,
                    (Operator::Power, Self::Number(exponent)) => a.power(*exponent),
                    (Operator::Power, _) => (a.ln() * b).exp(),
                }
            }
            Self::Function(function, of) => {
                let of = of.range(bounds)?;
                match function {
                    Function::Sqrt => of.sqrt(),
                    Function::Exp => of.exp(),
                    Function::Ln => of.ln(),
                    Function::Sin | Function::Cos => of.of_circle(),
                    Function::Tan => Range::ALL,
                    Function::Tanh => of.tanh(),
                }
            }
        })
    }
}

/// A power with a constant exponent: integer exponents for any base, others for bases above 0.
fn power<S: Scalar>(base: S, exponent: f64) -> S {
    if exponent.fract() == 0.0 && exponent.abs() <= MOST_MULTIPLIED {
        let (mut left, mut square, mut product) = (exponent.abs() as u32, base, S::one());
        while left > 0 {
            if left % 2 == 1 {
                product = product * square;
            }
            square = square * square;
            left /= 2;
        }
        return if exponent < 0.0 { product.recip() } else { product };
    }
    if exponent == 0.5 { base.sqrt() } else { (base.ln() * exponent).exp() }
}
