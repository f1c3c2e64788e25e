use supple_kernels::{Matrices, Scratch, dispatch};

use super::block::carve;
use super::contraction::{ContractCost, ContractDynamics};
use super::cost::CostQuadratics;
use super::jacobians::{DynamicsCurvature, Function, Jacobians};
use super::pattern::Structure;
use super::sensitivity::ParameterGradient;
use super::{Curvature, KnotAdjoints, Points, System, Variation};
use crate::cost::{Cost, Residual};
use crate::{Dimensions, Model, Point, Value};

/// A model and the costs of one task, differentiated: the [`System`] of every authored [`Model`].
#[derive(Debug)]
pub struct Authored<M> {
    pub(super) model: M,
    pub(super) costs: Vec<Cost>,
    pub(super) time_step: Value,
    pub(super) size: Dimensions,
    pub(super) signals: usize,
    pub(super) residuals: usize,
    pub(super) structure: Structure,
}

impl<M: Model> Authored<M> {
    /// A model with the costs of a task, its time step in s, and how many parameters there are.
    pub fn new(model: M, costs: Vec<Cost>, time_step: Value, parameters: usize) -> Self {
        let structure = Structure::of(&model, &costs, time_step, parameters);
        Self {
            size: model.dimensions(),
            signals: model.signals().len(),
            residuals: costs.iter().map(|cost| cost.kind.len()).sum(),
            structure,
            model,
            costs,
            time_step,
        }
    }

    fn cost(&self, x: &[f64], u: Option<&[f64]>, phi: &[f64], scratch: &mut Scratch) -> f64 {
        let last = u.is_none();
        let mut buffer = scratch.zeros::<f64>(self.size.controls + self.signals + self.residuals);
        let zero = carve(&mut buffer, self.size.controls);
        let signals = carve(&mut buffer, self.signals);
        let at = Point { x, u: u.unwrap_or(zero), phi, time_step: self.time_step.resolve(phi) };
        self.model.signal(&at, signals);
        let mut sum = 0.0;
        for cost in &self.costs {
            let r = carve(&mut buffer, cost.kind.len());
            cost.kind.evaluate(&at, signals, r);
            sum += cost.of_residual(r, phi, last);
        }
        sum
    }
}

impl<M: Model> System for Authored<M> {
    fn dimensions(&self) -> Dimensions {
        self.size
    }

    fn state_names(&self) -> Vec<String> {
        self.model.state_names()
    }

    fn depends_on(&self, parameters: usize) -> Vec<bool> {
        (0..parameters).map(|i| self.structure.parameters.contains(&i)).collect()
    }

    fn step(&self, x: &[f64], u: &[f64], phi: &[f64], next: &mut [f64]) {
        self.model.step(&Point { x, u, phi, time_step: self.time_step.resolve(phi) }, next);
    }

    fn observe(&self, x: &[f64], phi: &[f64], y: &mut [f64]) {
        self.model.observe(&Point { x, u: &[], phi, time_step: self.time_step.resolve(phi) }, y);
    }

    fn stage_cost(&self, x: &[f64], u: &[f64], phi: &[f64], scratch: &mut Scratch) -> f64 {
        self.cost(x, Some(u), phi, scratch)
    }

    fn final_cost(&self, x: &[f64], phi: &[f64], scratch: &mut Scratch) -> f64 {
        self.cost(x, None, phi, scratch)
    }

    fn dynamics_jacobians(&self, at: Points, phi: &[f64], out: &mut Matrices, scratch: &mut Scratch) {
        dispatch(Jacobians { system: self, function: Function::Dynamics, at, phi, out, scratch });
    }

    fn measurement_jacobians(&self, at: Points, phi: &[f64], out: &mut Matrices, scratch: &mut Scratch) {
        dispatch(Jacobians { system: self, function: Function::Measurement, at, phi, out, scratch });
    }

    fn cost_quadratics(
        &self,
        at: Points,
        phi: &[f64],
        curvature: Curvature,
        out: &mut Matrices,
        scratch: &mut Scratch,
    ) {
        dispatch(CostQuadratics { system: self, at, phi, curvature, out, scratch });
    }

    fn add_dynamics_curvature(
        &self,
        at: Points,
        phi: &[f64],
        costates: &Matrices,
        out: &mut Matrices,
        scratch: &mut Scratch,
    ) {
        dispatch(DynamicsCurvature { system: self, at, phi, costates, out, scratch });
    }

    fn contract(
        &self,
        at: Points,
        phi: &[f64],
        adjoints: &KnotAdjoints,
        joint: &mut Matrices,
        parameters: &mut [f64],
        scratch: &mut Scratch,
    ) {
        dispatch(ContractDynamics { system: self, at, phi, adjoints, joint, parameters, scratch });
        if adjoints.has_cost {
            dispatch(ContractCost { system: self, at, phi, adjoints, joint, parameters, scratch });
        }
    }

    fn add_parameter_gradient(
        &self,
        at: Points,
        phi: &[f64],
        costates: &Matrices,
        variation: Option<Variation>,
        parameters: &mut [f64],
        scratch: &mut Scratch,
    ) {
        dispatch(ParameterGradient { system: self, at, phi, costates, variation, parameters, scratch });
    }
}
