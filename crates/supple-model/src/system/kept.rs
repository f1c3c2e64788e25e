use std::sync::OnceLock;

use supple_kernels::graph::Program;

use crate::followed::{Ends, Followed};

/// The limits that plans of a task keep, and the programs of their excesses: of a stage, and of the end.
#[derive(Debug)]
pub(super) struct Kept {
    pub ends: Ends,
    pub excesses: [OnceLock<Program>; 2],
    pub jacobian: [OnceLock<Program>; 2],
    pub curvature: [OnceLock<Program>; 2],
    pub parameter_gradient: [OnceLock<Program>; 2],
    pub parameter_gradient_along: [OnceLock<Program>; 2],
}

impl Kept {
    /// Those among what is followed; none where no limit is kept.
    pub fn of(followed: &[Followed]) -> Option<Self> {
        let cells = || [OnceLock::new(), OnceLock::new()];
        Some(Self {
            ends: Ends::of(followed)?,
            excesses: cells(),
            jacobian: cells(),
            curvature: cells(),
            parameter_gradient: cells(),
            parameter_gradient_along: cells(),
        })
    }
}
