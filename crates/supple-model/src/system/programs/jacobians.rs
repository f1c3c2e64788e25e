//! First derivatives of dynamics and measurement.

use supple_kernels::graph::{Program, jacobian, record};
use supple_kernels::padded;

use super::{Outputs, Recorder, set};
use crate::Model;
use crate::system::trace::{Linearised, dot};

impl<M: Model> Recorder<'_, M> {
    /// `[A B]` (theory, equation U.3)
    pub fn dynamics_jacobian(&self) -> Program {
        record(|| {
            let trace = self.trace(false);
            let Linearised { f_z, f_w, directions, .. } = trace.dynamics_to_linearise().linearise(&trace.z);
            let mut outputs = Outputs::new();
            let stride = padded(trace.z.len());
            for (i, (row, by_unknown)) in f_z.iter().zip(&f_w).enumerate() {
                for (j, &entry) in row.iter().enumerate() {
                    let total = entry + dot(by_unknown.iter().copied(), directions[j].iter().copied());
                    set(&mut outputs, total, i * stride + j);
                }
            }
            Program::compile(&outputs)
        })
    }

    /// The derivatives of the landmarks' places by the states: three rows each.
    pub fn landmarks(&self) -> Program {
        record(|| {
            let trace = self.trace(false);
            let x = &trace.z[..self.model.dimensions().states];
            let mut outputs = Outputs::new();
            for (i, row) in jacobian(&trace.landmarks().concat(), x).into_iter().enumerate() {
                for (j, entry) in row.into_iter().enumerate() {
                    set(&mut outputs, entry, i * x.len() + j);
                }
            }
            Program::compile(&outputs)
        })
    }

    /// `C`
    pub fn measurement_jacobian(&self) -> Program {
        record(|| {
            let trace = self.trace(true);
            let x = &trace.z[..self.model.dimensions().states];
            let mut outputs = Outputs::new();
            for (i, row) in jacobian(&trace.measurement(), x).into_iter().enumerate() {
                for (j, entry) in row.into_iter().enumerate() {
                    set(&mut outputs, entry, i * padded(x.len()) + j);
                }
            }
            Program::compile(&outputs)
        })
    }
}
