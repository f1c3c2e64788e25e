use supple_kernels::Scalar;
use supple_kernels::graph::Node;

use super::{NoKeys, NormFile, NormKind};

/// `r^2`
///
/// Example: the [module](crate::cost).
#[derive(Clone, Copy, Debug)]
pub struct Quadratic;

impl NormKind for Quadratic {
    const NAME: &'static str = "quadratic";

    fn value<S: Scalar>(&self, r: S, _: &[S]) -> S {
        r * r
    }

    fn curvature(&self, _: Node, _: &[Node]) -> Node {
        Node::constant(2.0)
    }

    fn is_convex(&self) -> bool {
        true
    }
}

impl NormFile for Quadratic {
    type File = NoKeys;

    fn build(_: NoKeys) -> Self {
        Self
    }
}
