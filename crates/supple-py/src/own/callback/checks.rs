//! Numbers that must be finite.

use pyo3::prelude::*;
use supple::system::{Points, Times};

use super::Callback;
use crate::errors;

impl Callback {
    /// Keeps an error of the user's functions.
    pub(super) fn complain(&self, message: &str) {
        Python::attach(|py| self.failures.keep(errors::usage(py, message)));
    }

    /// Rejects non-finite derivatives along a trajectory at finite states and controls. In closed-loop samples,
    /// they come from a run that has diverged, which the engine counts.
    ///
    /// `width` numbers belong to each point; the points are those from `first` on.
    pub(super) fn check_finite(
        &self,
        what: &str,
        at: &Points,
        phi: &[f64],
        first: usize,
        numbers: &[f64],
        width: usize,
    ) {
        let Times::From(_) = at.times else { return };
        for (offset, found) in numbers.chunks(width.max(1)).enumerate() {
            let point = first + offset;
            let Some(bad) = found.iter().find(|number| !number.is_finite()) else { continue };
            let control: &[f64] = if point < at.stages { at.controls.vector(point) } else { &[] };
            let x = at.states.vector(point);
            if x.iter().chain(control).all(|number| number.is_finite()) {
                let step = at.times.of(point);
                let values = self.parameters.iter().zip(phi).map(|(name, value)| format!(", {name} = {value}"));
                let message = format!(
                    "{what} are {bad} at step {step}, where x = {x:?}, u = {control:?}{}: they must be finite along a \
                     trajectory. Write the function so that it and its derivatives are defined there; mind that square \
                     roots and norms have no derivative at 0, and that both branches of a `where` are differentiated",
                    values.collect::<String>()
                );
                Python::attach(|py| self.failures.keep_not_finite(errors::usage(py, &message)));
                return;
            }
        }
    }
}
