use supple_kernels::Scalar;

use super::any::Coupling;
use crate::model::bodies::{Own, Situation};

/// A named element of compliance, and the indices of its coordinates and constants in the state.
#[derive(Clone, Debug)]
pub(in crate::model) struct Element {
    pub name: String,
    pub kind: Coupling,
    /// Index of its first coordinate among those that compliance adds.
    pub coordinate: usize,
    /// Index of its first constant.
    pub constant: usize,
}

impl Element {
    /// The situation as passed to the element, with its own indices.
    pub fn own<'a, S: Scalar>(&self, now: &'a Situation<'a, S>) -> Own<'a, S> {
        now.seen_from(self.coordinate, self.constant)
    }
}
