use std::sync::OnceLock;

use supple_kernels::graph::Program;

use crate::followed::{Ends, Followed};

/// The enforced limits of a task, and the programs of their excesses: for a stage, and for the end.
#[derive(Debug)]
pub(super) struct Kept {
    pub ends: Ends,
    /// Which entries of the next state excesses depend on.
    pub counting: OnceLock<Vec<usize>>,
    pub excesses: [OnceLock<Program>; 2],
    pub jacobian: [OnceLock<Program>; 2],
    pub curvature: [OnceLock<Program>; 2],
    pub parameter_gradient: [OnceLock<Program>; 2],
    pub parameter_gradient_along: [OnceLock<Program>; 2],
}

impl Kept {
    /// Those of the enforced limits in `followed`; `None` if no limit is enforced.
    pub fn of(followed: &[Followed]) -> Option<Self> {
        let cells = || [OnceLock::new(), OnceLock::new()];
        Some(Self {
            ends: Ends::of(followed)?,
            counting: OnceLock::new(),
            excesses: cells(),
            jacobian: cells(),
            curvature: cells(),
            parameter_gradient: cells(),
            parameter_gradient_along: cells(),
        })
    }
}
