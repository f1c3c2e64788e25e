use std::sync::OnceLock;
use supple_kernels::graph::{Batch, Program, Source};
use supple_kernels::{Matrices, Scratch};
use supple_lqg::Dimensions;
use supple_lqg::KnotAdjoints;

use super::batch::{after, at_points, parts};
use super::kept::Kept;
use super::products::CurvatureProducts;
use super::programs::{GradientOf, Recorder, SecondDerivatives};
use super::roll_out::{RollOut, step_by_step};
use super::second::DynamicsCurvature;
use super::substeps::{Step, step_repeatedly};
use super::trace::{residuals, source, substeps, values};
use super::{Adjoints, Constraints, Curvature, Points, System, Times, Variation, make_convex};
use crate::contacts::{Contact, ContactState, WantedDepth, WantedForce};
use crate::cost::{Cost, Target};
use crate::document::Unfit;
use crate::followed::{self, Followed, FollowedNumber};
use crate::parameters::Parameters;
use crate::quantity::{Measurable, Penetration, Quantity, Vocabulary};
use crate::scene::Seen;
use crate::trajectory::Trajectory;
use crate::{Channels, Limit, Model, ParameterHandle, Point, Value};

/// A model and the costs of one task, differentiated: the [`System`] of every authored [`Model`].
///
/// The physics is recorded as a graph, differentiated there, and compiled to one program per function; each program is
/// compiled on first use. Programs are the same at every step.
///
/// Example: the [front page](crate).
#[derive(Debug)]
pub struct Authored<M> {
    pub(super) model: M,
    costs: Vec<Cost>,
    followed: Vec<Followed>,
    /// Limits that plans enforce; `None` if there are none.
    pub(super) kept: Option<Kept>,
    /// Names of the model, used to label recorded numbers.
    vocabulary: OnceLock<Vocabulary>,
    time_step: Value,
    pub(super) parameters: usize,
    pub(super) size: Dimensions,
    /// Number of integration steps per time step.
    pub(super) substeps: usize,
    /// Whether stage costs take the next state as an input.
    pub(super) gives_next: bool,
    /// Which entries of the next state they depend on.
    counting_of_next: OnceLock<Vec<usize>>,
    pub(super) programs: Programs,
    /// The same with wider contacts and friction, using two additional parameters.
    widened: OnceLock<Option<Box<Self>>>,
}

#[derive(Debug, Default)]
pub(super) struct Programs {
    step: OnceLock<Program>,
    /// With the time step as an additional parameter.
    step_over: OnceLock<Program>,
    advance: OnceLock<Program>,
    observe: OnceLock<Program>,
    picks: OnceLock<Option<Vec<usize>>>,
    cost: [OnceLock<Program>; 2],
    /// With the time step as an additional parameter.
    follow_limited: OnceLock<Program>,
    dynamics_jacobian: OnceLock<Program>,
    /// With the time step as an additional parameter.
    dynamics_jacobian_with: OnceLock<Program>,
    measurement_jacobian: OnceLock<Program>,
    /// One per curvature, for a stage and for the end.
    cost_quadratic: [[OnceLock<Program>; 2]; 2],
    dynamics_curvature: OnceLock<Program>,
    responses: OnceLock<Program>,
    second_derivatives: OnceLock<SecondDerivatives>,
    curvature_along: OnceLock<Program>,
    /// Derivatives of the landmarks with respect to the states.
    landmarks: OnceLock<Program>,
    contract_dynamics: OnceLock<Program>,
    contract_curvature: OnceLock<Program>,
    contract_measurement: OnceLock<Program>,
    contract_cost: [[OnceLock<Program>; 2]; 2],
    /// One per [`GradientOf`].
    parameter_gradient: [OnceLock<Program>; 4],
    parameter_gradient_along: [OnceLock<Program>; 4],
}

impl<M: Model> Authored<M> {
    /// A model with the costs of a task, its time step in s, and how many parameters there are. The time step must be that of the task.
    ///
    /// # Panics
    /// Where the model reads a parameter that is not among so many.
    pub fn new(model: M, costs: Vec<Cost>, time_step: impl Into<Value>, parameters: usize) -> Self {
        let time_step = time_step.into();
        let (size, programs, widened) = (model.dimensions(), Programs::default(), OnceLock::new());
        let substeps = substeps(&model);
        let (followed, kept, vocabulary) = (Vec::new(), None, OnceLock::new());
        let recorder = Recorder { model: &model, costs: &costs, time_step, parameters };
        let (gives_next, time_step) = (recorder.gives_next(), recorder.time_step);
        Self {
            model,
            costs,
            followed,
            kept,
            vocabulary,
            time_step,
            parameters,
            size,
            substeps,
            gives_next,
            counting_of_next: OnceLock::new(),
            programs,
            widened,
        }
    }

    /// The same with quantities to record along plans. With sub-steps, limits of efforts hold in the first one too.
    #[must_use]
    pub fn following(self, mut followed: Vec<Followed>) -> Self {
        if self.substeps > 1 {
            let early: Vec<Followed> = followed.iter().filter_map(Followed::in_first_substep).collect();
            followed.extend(early);
        }
        Self { kept: Kept::of(&followed), followed, ..self }
    }

    pub(super) fn vocabulary(&self) -> &Vocabulary {
        self.vocabulary.get_or_init(|| Vocabulary::of(&self.model))
    }

    pub(super) fn recorder(&self) -> Recorder<'_, M> {
        let Self { model, costs, time_step, parameters, .. } = self;
        Recorder { model, costs, time_step: time_step.clone(), parameters: *parameters }
    }

    pub(super) fn program<'a>(
        &self,
        cell: &'a OnceLock<Program>,
        record: impl FnOnce(&Recorder<M>) -> Program,
    ) -> &'a Program {
        cell.get_or_init(|| record(&self.recorder()))
    }

    pub(super) fn cost(&self, x: &[f64], u: &[f64], phi: &[f64], last: bool) -> f64 {
        if !last && self.gives_next {
            let mut next = vec![0.0; x.len()];
            self.step(0, x, u, phi, &mut next);
            return self.stage_cost_before(&next, x, u, phi);
        }
        let program = self.program(&self.programs.cost[usize::from(last)], |recorder| recorder.cost(last));
        let mut cost = [0.0];
        program.run_single(&[x, u], phi, &mut [&mut cost]);
        cost[0]
    }
}

/// Programs, recorded when they are first asked for.
impl<M: Model> Authored<M> {
    pub(super) fn step_program(&self) -> &Program {
        self.program(&self.programs.step, |r| r.step())
    }

    pub(super) fn jacobian_program(&self) -> &Program {
        self.program(&self.programs.dynamics_jacobian, |r| r.dynamics_jacobian())
    }

    /// The time step is an additional parameter, as in [`Self::with_time_step`].
    fn step_over_program(&self) -> &Program {
        self.program(&self.programs.step_over, |r| r.of_any_time_step().step())
    }

    /// A step of `substeps` integration steps; `phi` as returned by [`Self::with_time_step`].
    fn step_over<'a>(&'a self, phi: &'a [f64], substeps: usize) -> Step<'a> {
        let (next, jacobian) = (self.step_over_program(), self.jacobian_with_program());
        Step { next, jacobian, phi, size: self.size, substeps }
    }

    /// The time step is an additional parameter, as in [`Self::with_time_step`].
    fn jacobian_with_program(&self) -> &Program {
        self.program(&self.programs.dynamics_jacobian_with, |r| r.of_any_time_step().dynamics_jacobian())
    }

    /// The parameters followed by the time step, as programs for arbitrary time steps take them.
    fn with_time_step(&self, phi: &[f64], time_step: f64) -> Vec<f64> {
        [&phi[..self.parameters], &[time_step]].concat()
    }

    pub(super) fn contraction_program(&self) -> &Program {
        self.program(&self.programs.contract_dynamics, |r| r.contract_dynamics(self.is_composed()))
    }

    pub(super) fn contract_curvature_program(&self) -> &Program {
        self.program(&self.programs.contract_curvature, |r| r.contract_curvature())
    }

    /// Of a stage.
    pub(super) fn quadratic_program(&self, curvature: Curvature) -> &Program {
        self.program(&self.programs.cost_quadratic[which(curvature)][0], |r| r.cost_quadratic(curvature, false))
    }

    /// Of a stage.
    pub(super) fn contract_cost_program(&self, curvature: Curvature) -> &Program {
        self.program(&self.programs.contract_cost[which(curvature)][0], |r| r.contract_cost(curvature, false))
    }

    /// Batches of stages and end that are not empty, without the stages if their cost takes the next state.
    fn parts_of_cost(&self, at: &Points) -> impl Iterator<Item = (bool, Batch)> + use<M> {
        let gives_next = self.gives_next;
        parts(at).into_iter().filter(move |&(last, batch)| batch.count > 0 && (last || !gives_next))
    }

    /// `[l_zz | l_z]`; if stage costs take the next state, costates are treated as in
    /// [`write_quadratics_of_next`](Self::write_quadratics_of_next).
    fn write_quadratics(
        &self,
        at: Points,
        phi: &[f64],
        curvature: Curvature,
        after: Option<&Matrices>,
        out: &mut Matrices,
        scratch: &mut Scratch,
    ) {
        if self.gives_next {
            self.write_quadratics_of_next(at, phi, curvature, after, out, scratch);
        }
        let cells = &self.programs.cost_quadratic[which(curvature)];
        for (last, batch) in self.parts_of_cost(&at) {
            let cell = &cells[usize::from(last)];
            let program = self.program(cell, |recorder| recorder.cost_quadratic(curvature, last));
            program.run(batch, (&at_points(at), phi), (Some(out), &mut []), scratch);
        }
    }

    pub(super) fn counting_of_next(&self) -> &[usize] {
        self.counting_of_next.get_or_init(|| self.recorder().counting_of_next())
    }

    pub(super) fn stage_cost_program(&self) -> &Program {
        self.program(&self.programs.cost[0], |r| r.cost(false))
    }

    /// The programs for products with second derivatives: responses, and curvature along a direction.
    pub(super) fn product_programs(&self) -> [&Program; 2] {
        let responses = self.program(&self.programs.responses, |r| r.responses());
        [responses, self.program(&self.programs.curvature_along, |r| r.curvature_along())]
    }

    /// The gradient with respect to the parameters, or its derivative along a variation.
    pub(super) fn gradient_program(&self, of: GradientOf, along: bool) -> &Program {
        let programs = &self.programs;
        if along {
            self.program(&programs.parameter_gradient_along[of as usize], |r| r.parameter_gradient_along(of))
        } else {
            self.program(&programs.parameter_gradient[of as usize], |r| r.parameter_gradient(of))
        }
    }

    /// Adds the second derivatives of `lambda' f` of an integration step with respect to `z`, given the costates `after`.
    pub(super) fn add_step_curvature(
        &self,
        at: Points,
        phi: &[f64],
        after: Source,
        out: &mut Matrices,
        scratch: &mut Scratch,
    ) {
        let (joint, unknowns) = (self.size.joint(), self.model.unknowns());
        if self.has_costly_curvature() {
            let responses = self.program(&self.programs.responses, |r| r.responses());
            let second = self.programs.second_derivatives.get_or_init(|| self.recorder().second_derivatives());
            return DynamicsCurvature { responses, second, joint, unknowns }.add(at, phi, after, out, scratch);
        }
        let program = self.program(&self.programs.dynamics_curvature, |r| r.dynamics_curvature());
        let sources = [at.states.into(), at.controls.into(), after];
        let batch = Batch { first: 0, count: at.stages };
        program.run(batch, (&sources, phi), (Some(out), &mut []), scratch);
    }
}

/// Greatest number of unknowns for which one program computes all second derivatives of the dynamics. Its size grows with
/// their cube; beyond it, a program treats the unknowns as variables too, and matrix products do the rest.
const MOST_UNKNOWNS: usize = 16;

impl<M: Model> System for Authored<M> {
    fn check(&self, parameters: &Parameters) -> Result<(), Unfit> {
        let (size, signals) = (self.model.dimensions(), self.model.signals().len());
        let mut costs = self.costs.iter().enumerate();
        costs.try_for_each(|(index, cost)| {
            cost.check(size, signals, parameters).map_err(|unfit| unfit.below(index).below("costs"))
        })?;
        self.followed.iter().try_for_each(|followed| followed.quantity.check_reach(size, signals))
    }

    fn time_step(&self) -> Option<&Value> {
        Some(&self.time_step)
    }

    fn parameters(&self) -> usize {
        self.parameters
    }

    fn dimensions(&self) -> Dimensions {
        self.size
    }

    fn state_names(&self) -> Vec<String> {
        self.model.state_names()
    }

    fn channels(&self) -> Channels {
        self.model.channels()
    }

    fn limits(&self) -> Vec<Limit> {
        self.model.limits()
    }

    fn contacts(&self) -> Vec<Contact> {
        self.model.contacts()
    }

    fn contact_states(&self, x: &[f64], phi: &[f64]) -> Vec<ContactState> {
        let idle = vec![0.0; self.size.controls];
        self.model.contact_states(&Point { x, u: &idle, phi, time_step: self.time_step.resolve(phi), w: &[] })
    }

    fn wanted_forces(&self, phi: &[f64]) -> Vec<WantedForce> {
        let contacts = self.model.contacts();
        let place = |(signal, target)| {
            let asked = |(index, contact): (usize, &Contact)| Some((index, contact.force_for(signal, target)?));
            contacts.iter().enumerate().find_map(asked)
        };
        let of_cost = |(index, cost): (usize, &Cost)| {
            let (kind, wanted) = (cost.name(), if cost.counts(phi) { cost.wanted(phi) } else { Vec::new() });
            let known = |asked| {
                let (contact, target) = place(asked)?;
                Some(WantedForce { cost: index, kind, contact, target })
            };
            wanted.into_iter().filter_map(known).collect::<Vec<_>>()
        };
        self.costs.iter().enumerate().flat_map(of_cost).collect()
    }

    fn wanted_depths(&self, phi: &[f64]) -> Vec<WantedDepth> {
        let contacts = self.model.contacts();
        let of_cost = |(index, cost): (usize, &Cost)| {
            let (signal, depth) = cost.wanted_depth(phi).filter(|&(_, depth)| depth >= 0.0 && cost.counts(phi))?;
            let contact = contacts.iter().position(|contact| contact.depth_signal == Some(signal))?;
            Some(WantedDepth { cost: index, kind: cost.name(), contact, depth })
        };
        self.costs.iter().enumerate().filter_map(of_cost).collect()
    }

    fn picture(&self, x: &[f64], u: &[f64], phi: &[f64]) -> Option<Seen> {
        let at = Point { x, u, phi, time_step: self.time_step.resolve(phi), w: &[] };
        let picture = self.model.picture(&at)?;
        let positions = self.model.landmarks(&at);
        let mut entries = vec![0.0; 3 * positions.len() * x.len()];
        if !entries.is_empty() {
            let program = self.program(&self.programs.landmarks, |r| r.landmarks());
            program.run_single(&[x, u], phi, &mut [&mut entries]);
        }
        let row = |place: usize, axis: usize| entries[(3 * place + axis) * x.len()..][..x.len()].to_vec();
        let jacobians = (0..positions.len()).map(|place| [0, 1, 2].map(|axis| row(place, axis))).collect();
        Some(Seen { picture, positions, jacobians })
    }

    fn depends_on(&self, parameters: usize) -> Vec<bool> {
        let mut dependencies = self.recorder().dependencies(self.kept.as_ref().map(|kept| &kept.ends));
        dependencies.resize(parameters, false);
        dependencies
    }

    fn step(&self, _: usize, x: &[f64], u: &[f64], phi: &[f64], next: &mut [f64]) {
        let program = self.step_program();
        program.run_single(&[x, u], phi, &mut [&mut *next]);
        if self.is_divided() {
            self.go_on(&mut next.to_vec(), next, |x, next| program.run_single(&[x, u], phi, &mut [next]));
        }
    }

    fn step_all(&self, at: Points, phi: &[f64], next: &mut Matrices, scratch: &mut Scratch) {
        step_repeatedly(self.step_program(), self.substeps, at, phi, next, scratch);
    }

    fn step_part(&self, parts: usize, at: Points, phi: &[f64], next: &mut Matrices, scratch: &mut Scratch) {
        let phi = self.with_time_step(phi, self.time_step.resolve::<f64>(phi) / parts as f64);
        step_repeatedly(self.step_over_program(), self.substeps, at, &phi, next, scratch);
    }

    fn advance(&self, t: usize, x: &[f64], u: &[f64], phi: &[f64], next: &mut [f64], _: &mut Scratch) -> f64 {
        if self.is_divided() {
            self.step(t, x, u, phi, next);
            return self.stage_cost_before(next, x, u, phi);
        }
        let mut cost = [0.0];
        let program = self.program(&self.programs.advance, |r| r.advance());
        program.run_single(&[x, u], phi, &mut [next, &mut cost]);
        cost[0]
    }

    fn roll_out(&self, law: RollOut, phi: &[f64], out: &mut Trajectory, scratch: &mut Scratch) -> f64 {
        if self.is_divided() {
            return self.roll_out_divided(law, phi, out, scratch);
        }
        let mut program = self.program(&self.programs.advance, |r| r.advance()).with_parameters(phi, scratch);
        let cost = step_by_step(law, out, |_, x, u, next| {
            let mut cost = [0.0];
            program.run(&[x, u], &mut [next, &mut cost]);
            cost[0]
        });
        cost + self.cost(out.states.vector(out.steps()), &[], phi, true)
    }

    fn observe(&self, _: usize, x: &[f64], phi: &[f64], y: &mut [f64]) {
        self.program(&self.programs.observe, |r| r.observe()).run_single(&[x], phi, &mut [y]);
    }

    fn picks(&self) -> Option<&[usize]> {
        self.programs.picks.get_or_init(|| self.recorder().picks()).as_deref()
    }

    fn stage_cost(&self, _: usize, x: &[f64], u: &[f64], phi: &[f64], _: &mut Scratch) -> f64 {
        self.cost(x, u, phi, false)
    }

    fn final_cost(&self, x: &[f64], phi: &[f64], _: &mut Scratch) -> f64 {
        self.cost(x, &[], phi, true)
    }

    fn cost_names(&self) -> Vec<String> {
        let own = self.model.own_cost(false).or(self.model.own_cost(true)).map(|_| "the model's own".to_owned());
        let named = |(index, cost): (usize, &Cost)| format!("{} {}", index + 1, cost.name());
        self.costs.iter().enumerate().map(named).chain(own).collect()
    }

    fn cost_terms(&self, x: &[f64], u: &[f64], phi: &[f64], last: bool) -> Vec<f64> {
        let time_step = self.time_step.resolve(phi);
        let at = Point { x, u, phi, time_step, w: &[] };
        let term = |(cost, residual): (&Cost, Vec<f64>)| {
            if cost.weights(last).are_zero() { 0.0 } else { cost.of_residual(&residual, phi, last) }
        };
        let mut terms: Vec<f64> =
            self.costs.iter().zip(residuals(&self.model, &self.costs, &at, None)).map(term).collect();
        if self.model.own_cost(false).is_some() || self.model.own_cost(true).is_some() {
            let mut residual = vec![0.0; self.model.own_cost(last).map_or(0, |cost| cost.residuals)];
            self.model.own_residual(&at, last, &mut residual);
            terms.push(self.model.own_norm(&residual, phi, time_step, last));
        }
        terms
    }

    fn targets(&self, phi: &[f64]) -> Vec<Target> {
        let of_cost = |(index, cost): (usize, &Cost)| {
            let channels = cost.quantity.channels(self.vocabulary());
            let target = |entry: usize| Target {
                cost: index,
                channel: channels[entry].clone(),
                value: cost.targets[entry].resolve(phi),
                in_final_cost: cost.last.weighs(entry, phi),
                depends_on_control: cost.of_control(entry),
            };
            cost.weighed(phi).into_iter().map(target).collect::<Vec<_>>()
        };
        self.costs.iter().enumerate().flat_map(of_cost).collect()
    }

    fn weighed(&self, x: &[f64], u: &[f64], phi: &[f64]) -> Vec<f64> {
        let quantities: Vec<&Quantity> = self.costs.iter().map(|cost| &cost.quantity).collect();
        let at = Point { x, u, phi, time_step: self.time_step.resolve(phi), w: &[] };
        let values = values(&self.model, &quantities, &at, None);
        let of_cost = |(cost, values): (&Cost, Vec<f64>)| cost.weighed(phi).into_iter().map(move |entry| values[entry]);
        self.costs.iter().zip(values).flat_map(of_cost).collect()
    }

    fn followed(&self, phi: &[f64]) -> Vec<FollowedNumber> {
        followed::numbers(&self.costs, &self.followed, self.vocabulary(), phi)
    }

    fn follow(&self, x: &[f64], u: &[f64], phi: &[f64]) -> Vec<f64> {
        let of_costs = self.costs.iter().filter(|cost| followed::shows(cost)).map(|cost| &cost.quantity);
        let quantities: Vec<&Quantity> =
            of_costs.chain(self.followed.iter().map(|followed| &followed.quantity)).collect();
        let at = Point { x, u, phi, time_step: self.time_step.resolve(phi), w: &[] };
        values(&self.model, &quantities, &at, None).concat()
    }

    fn follow_limited(&self, parts: usize, at: Points, phi: &[f64], out: &mut Matrices, scratch: &mut Scratch) {
        let program = self.program(&self.programs.follow_limited, |recorder| {
            let numbers = followed::numbers(&[], &self.followed, self.vocabulary(), phi);
            let limited: Vec<bool> = numbers.iter().map(FollowedNumber::is_limited).collect();
            recorder.of_any_time_step().follow_limited(&self.followed, &limited)
        });
        let phi = self.with_time_step(phi, self.time_step.resolve::<f64>(phi) / parts as f64);
        let (batch, [x, u]) = (Batch { first: 0, count: at.stages }, at_points(at));
        if !self.followed.iter().any(|followed| followed.quantity.needs_next()) {
            return program.run(batch, (&[x, u], &phi), (Some(out), &mut []), scratch);
        }
        let mut next = Matrices::vectors(at.stages, self.size.states);
        step_repeatedly(self.step_over_program(), self.substeps, at, &phi, &mut next, scratch);
        program.run(batch, (&[x, u, (&next).into()], &phi), (Some(out), &mut []), scratch);
    }

    fn constraints(&self) -> Option<&dyn Constraints> {
        self.kept.is_some().then_some(self as &dyn Constraints)
    }

    fn dynamics_jacobians(&self, at: Points, phi: &[f64], out: &mut Matrices, scratch: &mut Scratch) {
        if self.is_divided() {
            return self.step_of(phi).write_jacobians(at, out, scratch);
        }
        let program = self.jacobian_program();
        let batch = Batch { first: 0, count: at.stages };
        program.run(batch, (&at_points(at), phi), (Some(out), &mut []), scratch);
    }

    fn dynamics_jacobians_in(&self, parts: usize, at: Points, phi: &[f64], out: &mut Matrices, scratch: &mut Scratch) {
        let phi = self.with_time_step(phi, self.time_step.resolve::<f64>(phi) / parts as f64);
        self.step_over(&phi, self.substeps * parts).write_jacobians(at, out, scratch);
    }

    fn dynamics_jacobian_with(&self, t: usize, x: &[f64], u: &[f64], phi: &[f64], time_step: f64) -> Option<Matrices> {
        let mut out = Matrices::zeros(1, self.size.states, self.size.joint());
        let phi = self.with_time_step(phi, time_step);
        if self.is_divided() {
            let [x, u] = [x, u].map(|vector| Matrices::of_rows(&[vector.to_vec()], vector.len()));
            let at = Points { states: &x, controls: &u, stages: 1, has_end: false, times: Times::At(t) };
            self.step_over(&phi, self.substeps).write_jacobians(at, &mut out, &mut Scratch::new());
            return Some(out);
        }
        self.jacobian_with_program().run_single(&[x, u], &phi, &mut [out.as_mut_slice()]);
        Some(out)
    }

    fn substeps(&self) -> Option<usize> {
        self.model.substeps()
    }

    fn endures_longer_steps(&self) -> bool {
        self.model.endures_longer_steps()
    }

    fn widened(&self) -> Option<&dyn System> {
        let widened = self.widened.get_or_init(|| {
            let more = |more| Value::from(ParameterHandle::at(self.parameters + more));
            let [length, speed, longer] = [0, 1, 2].map(more);
            // Friction at the end of a step adds inertia in proportion to the step: this much less keeps it the same.
            let lead = Value::Number(0.5).plus(&Value::Number(0.5).over(&longer));
            let model = self.model.widened(&length, &speed, &lead)?;
            let mut costs = self.costs.clone();
            costs.iter_mut().for_each(|cost| cost.stage.scale(&longer));
            Some(Box::new(Self::new(model, costs, self.time_step.times(&longer), self.parameters + 3)))
        });
        widened.as_deref().map(|system| system as &dyn System)
    }

    fn drawn_to_contacts(&self, phi: &[f64]) -> Option<Box<dyn System>> {
        let (contacts, signals) = (self.model.contacts(), self.model.signals());
        let mut wanted: Vec<usize> = self.wanted_forces(phi).iter().map(|wanted| wanted.contact).collect();
        wanted.sort_unstable();
        wanted.dedup();
        let depth = |contact: usize| {
            let name = format!("{}.{}", contacts[contact].name, Penetration::NAME);
            signals.iter().position(|signal| *signal == name)
        };
        let weight = ParameterHandle::at(self.parameters);
        let pulls = wanted.into_iter().filter_map(depth).map(|signal| Cost::new(Penetration::new(signal), weight));
        let costs: Vec<Cost> = self.costs.iter().cloned().chain(pulls).collect();
        if costs.len() == self.costs.len() {
            return None;
        }
        // Not wider, with the same steps.
        let [nothing, whole] = [0.0, 1.0].map(Value::Number);
        let model = self.model.widened(&nothing, &nothing, &whole)?;
        Some(Box::new(Self::new(model, costs, self.time_step.clone(), self.parameters + 1)))
    }

    fn measurement_jacobians(&self, at: Points, phi: &[f64], out: &mut Matrices, scratch: &mut Scratch) {
        let program = self.program(&self.programs.measurement_jacobian, |r| r.measurement_jacobian());
        let batch = Batch { first: 0, count: at.count() };
        program.run(batch, (&at_points(at), phi), (Some(out), &mut []), scratch);
    }

    fn cost_quadratics(
        &self,
        at: Points,
        phi: &[f64],
        curvature: Curvature,
        out: &mut Matrices,
        scratch: &mut Scratch,
    ) {
        self.write_quadratics(at, phi, curvature, None, out, scratch);
        if curvature == Curvature::GaussNewton && !self.has_smooth_gauss_newton() {
            make_convex(out, self.size.joint());
        }
    }

    fn add_dynamics_curvature(
        &self,
        at: Points,
        phi: &[f64],
        costates: &Matrices,
        out: &mut Matrices,
        scratch: &mut Scratch,
    ) {
        if self.is_divided() {
            return self.add_curvature_divided(at, phi, costates, out, scratch);
        }
        self.add_step_curvature(at, phi, after(costates), out, scratch);
    }

    fn lagrangian_quadratics(
        &self,
        at: Points,
        phi: &[f64],
        costates: &Matrices,
        out: &mut Matrices,
        scratch: &mut Scratch,
    ) {
        // If costs take the next state, one evaluation of the step's second derivatives serves both the given costates and
        // those that originate from the cost.
        self.write_quadratics(at, phi, Curvature::Exact, Some(costates), out, scratch);
        if !self.gives_next {
            self.add_dynamics_curvature(at, phi, costates, out, scratch);
        }
    }

    fn has_costly_curvature(&self) -> bool {
        self.model.unknowns() > MOST_UNKNOWNS
    }

    fn curvature_products<'a>(
        &'a self,
        at: Points<'a>,
        phi: &'a [f64],
        costates: &'a Matrices,
        scratch: &mut Scratch,
    ) -> Option<CurvatureProducts<'a>> {
        if !self.has_costly_curvature() {
            return None;
        }
        let (programs, sizes) = (self.product_programs(), [self.size.joint(), self.model.unknowns()]);
        if self.is_divided() {
            let steps = self.step_of(phi).divide(at, Batch { first: 0, count: at.stages }, scratch);
            let costates = steps.costates(costates, 0);
            return Some(CurvatureProducts::of_substeps(programs, sizes, steps, phi, costates, scratch));
        }
        Some(CurvatureProducts::new(programs, sizes, at, phi, costates, scratch))
    }

    fn has_smooth_gauss_newton(&self) -> bool {
        [false, true].into_iter().all(|last| self.recorder().is_convex(last))
    }

    fn contract(
        &self,
        at: Points,
        phi: &[f64],
        adjoints: Adjoints,
        joint: &mut Matrices,
        parameters: &mut [f64],
        scratch: &mut Scratch,
    ) {
        let programs = &self.programs;
        let KnotAdjoints { dynamics, measurement, cost, has_cost } = adjoints.knots;
        if self.gives_next && *has_cost {
            self.contract_with_next(at, phi, adjoints, joint, parameters, scratch);
        } else if self.is_composed() {
            self.contract_composed(at, phi, dynamics, joint, parameters, scratch);
        }
        let [x, u] = at_points(at);
        let sources = [x, u, x, dynamics.into(), measurement.into(), cost.into()];
        let mut run = |program: &Program, batch| {
            program.run(batch, (&sources, phi), (Some(&mut *joint), parameters), scratch);
        };
        if !self.is_composed() {
            run(self.contraction_program(), Batch { first: 0, count: at.stages });
        }
        let all = Batch { first: 0, count: at.count() };
        run(self.program(&programs.contract_measurement, |r| r.contract_measurement()), all);
        if *has_cost {
            for (last, batch) in self.parts_of_cost(&at) {
                let cell = &programs.contract_cost[which(adjoints.curvature)][usize::from(last)];
                run(self.program(cell, |recorder| recorder.contract_cost(adjoints.curvature, last)), batch);
            }
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
        let [x, u] = at_points(at);
        let mut sources = [x, u, after(costates), x, x, x, x, x];
        if let Some(Variation { joint, costates }) = variation {
            sources[source::VARIATION] = joint.into();
            sources[source::COSTATE_VARIATION] = after(costates);
        }
        for (last, batch) in self.parts_of_cost(&at) {
            let of = match (last, self.is_divided()) {
                (true, _) => GradientOf::End,
                (false, true) => GradientOf::StageCost,
                (false, false) => GradientOf::Stage,
            };
            let program = self.gradient_program(of, variation.is_some());
            program.run(batch, (&sources, phi), (None, parameters), scratch);
        }
        if self.is_composed() {
            self.add_gradient_composed(at, phi, costates, variation, parameters, scratch);
        }
    }
}

/// Index of the programs for a curvature.
fn which(curvature: Curvature) -> usize {
    usize::from(curvature == Curvature::Exact)
}
