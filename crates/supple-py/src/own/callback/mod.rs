//! Models whose functions and derivatives live in Python: each batch of points is one call of a backend.

mod checks;
mod exchange;

use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};
use supple::lqg::KnotAdjoints;
use supple::system::{Adjoints, Curvature, Points, RollOut, System, Variation, make_convex};
use supple::{Channel, Channels, Dimensions, Matrices, Scratch, Trajectory};

use exchange::{Argument, Given, add, matrices, numbers, poison, row, write, write_quadratics};
pub use exchange::{fill, read, vectors};

use super::context::{Context, Failures, field};

/// A [`System`] that calls an object with the methods of `supple._backends.protocol.Backend`.
///
/// Works on any thread: it attaches to the interpreter for each call. Exceptions, and results of the
/// wrong type or shape, go to [`Failures`]; the outputs become NaN, which soon ends the computation. Numbers that are not finite
/// end that of one design.
pub struct Callback {
    backend: Py<PyAny>,
    size: Dimensions,
    channels: Channels,
    /// Names of the parameters.
    parameters: Vec<String>,
    failures: Failures,
}

impl Callback {
    /// The system of a description: `backend`, and names and units of `states`, `controls` and `measurements`.
    ///
    /// # Errors
    /// Where something in the description is missing or of the wrong type.
    pub fn new(description: &Bound<'_, PyDict>, context: &Context<'_>) -> PyResult<Self> {
        let channels = |names: &str, units: &str| -> PyResult<Vec<Channel>> {
            let names: Vec<String> = field(description, names)?.extract()?;
            let units: Vec<String> = field(description, units)?.extract()?;
            Ok(names.into_iter().zip(units).map(|(name, unit)| Channel::new(name, unit)).collect())
        };
        let channels = Channels {
            states: channels("states", "state_units")?,
            controls: channels("controls", "control_units")?,
            measurements: channels("measurements", "measurement_units")?,
        };
        let size = Dimensions {
            states: channels.states.len(),
            controls: channels.controls.len(),
            measurements: channels.measurements.len(),
        };
        let backend = field(description, "backend")?.unbind();
        Ok(Self {
            backend,
            size,
            channels,
            parameters: context.parameters.to_vec(),
            failures: context.failures.clone(),
        })
    }

    /// Calls a method; the numbers of its results, which must have these shapes. `None` if anything went wrong, now or
    /// before.
    fn call<const K: usize>(
        &self,
        name: &str,
        arguments: Vec<Argument>,
        shapes: [&[usize]; K],
    ) -> Option<[Vec<f64>; K]> {
        if self.failures.any() {
            return None;
        }
        let outcome = Python::attach(|py| {
            let arguments =
                arguments.into_iter().map(|argument| argument.into_python(py)).collect::<PyResult<Vec<_>>>()?;
            let results = self.backend.bind(py).call_method1(name, PyTuple::new(py, arguments)?)?;
            read(name, &results, shapes)
        });
        outcome.map_err(|error| self.failures.keep(error)).ok()
    }

    fn points(&self, at: &Points) -> Vec<Argument> {
        vec![vectors(at.states, 0, at.stages), vectors(at.controls, 0, at.stages)]
    }

    /// Costs and their derivatives at the points that have a control, and at the end.
    fn ends(at: &Points) -> impl Iterator<Item = usize> {
        let stages = at.stages;
        at.has_end.then_some(stages).into_iter()
    }
}

impl System for Callback {
    fn dimensions(&self) -> Dimensions {
        self.size
    }

    fn state_names(&self) -> Vec<String> {
        self.channels.states.iter().map(|state| state.name.clone()).collect()
    }

    fn channels(&self) -> Channels {
        self.channels.clone()
    }

    fn depends_on(&self, parameters: usize) -> Vec<bool> {
        vec![true; parameters]
    }

    fn step(&self, _: usize, x: &[f64], u: &[f64], phi: &[f64], next: &mut [f64]) {
        let n = self.size.states;
        match self.call("steps", vec![row(x), row(u), numbers(phi)], [&[1, n]]) {
            Some([found]) => next.copy_from_slice(&found),
            None => next.fill(f64::NAN),
        }
    }

    fn observe(&self, _: usize, x: &[f64], phi: &[f64], y: &mut [f64]) {
        match self.call("observations", vec![row(x), numbers(phi)], [&[1, self.size.measurements]]) {
            Some([found]) => y.copy_from_slice(&found),
            None => y.fill(f64::NAN),
        }
    }

    fn stage_cost(&self, _: usize, x: &[f64], u: &[f64], phi: &[f64], _: &mut Scratch) -> f64 {
        self.call("stage_costs", vec![row(x), row(u), numbers(phi)], [&[1]]).map_or(f64::NAN, |[cost]| cost[0])
    }

    fn final_cost(&self, x: &[f64], phi: &[f64], _: &mut Scratch) -> f64 {
        self.call("final_costs", vec![row(x), numbers(phi)], [&[1]]).map_or(f64::NAN, |[cost]| cost[0])
    }

    fn step_all(&self, at: Points, phi: &[f64], next: &mut Matrices, _: &mut Scratch) {
        let n = self.size.states;
        let mut arguments = self.points(&at);
        arguments.push(numbers(phi));
        let found = self.call("steps", arguments, [&[at.stages, n]]);
        fill(next, found.as_ref().map(|[found]| &**found), at.stages, 1, n);
    }

    fn observe_all(&self, at: Points, phi: &[f64], y: &mut Matrices, _: &mut Scratch) {
        let (count, p) = (at.count(), self.size.measurements);
        let found = self.call("observations", vec![vectors(at.states, 0, count), numbers(phi)], [&[count, p]]);
        fill(y, found.as_ref().map(|[found]| &**found), count, 1, p);
    }

    fn stage_costs(&self, at: Points, phi: &[f64], out: &mut [f64], _: &mut Scratch) {
        let mut arguments = self.points(&at);
        arguments.push(numbers(phi));
        match self.call("stage_costs", arguments, [&[at.stages]]) {
            Some([found]) => out[..at.stages].copy_from_slice(&found),
            None => out.fill(f64::NAN),
        }
    }

    fn final_costs(&self, states: &Matrices, phi: &[f64], out: &mut [f64], _: &mut Scratch) {
        let count = out.len();
        match self.call("final_costs", vec![vectors(states, 0, count), numbers(phi)], [&[count]]) {
            Some([found]) => out.copy_from_slice(&found),
            None => out.fill(f64::NAN),
        }
    }

    fn roll_out(&self, law: RollOut, phi: &[f64], out: &mut Trajectory, _: &mut Scratch) -> f64 {
        let Dimensions { states: n, controls: m, .. } = self.size;
        let steps = out.steps();
        law.start(out);
        let start = numbers(out.states.vector(0));
        let arguments = match law {
            RollOut::Controls => {
                let controls = vectors(&out.controls, 0, steps);
                vec![start, controls, Argument::Nothing, Argument::Nothing, Argument::Nothing, numbers(phi)]
            }
            RollOut::Law { reference, policy, step, bounds } => {
                let (ubar, k) = (&reference.controls, &policy.feedforward);
                let open = (0..steps).flat_map(|t| ubar.vector(t).iter().zip(k.vector(t)).map(|(u, k)| u + step * k));
                let bounds = bounds.map_or(Argument::Nothing, |bounds| {
                    let side = |numbers: &[f64]| Given(numbers.to_vec(), vec![m]);
                    Argument::Pair(side(bounds.lower()), side(bounds.upper()))
                });
                vec![
                    start,
                    Argument::Array(Given(open.collect(), vec![steps, m])),
                    Argument::Array(matrices(&policy.feedback, 0, steps, m, n)),
                    vectors(&reference.states, 0, steps),
                    bounds,
                    numbers(phi),
                ]
            }
        };
        let shapes: [&[usize]; 3] = [&[steps + 1, n], &[steps, m], &[]];
        let found = self.call("roll_out", arguments, shapes);
        let (states, controls, cost) = match &found {
            Some([states, controls, cost]) => (Some(&**states), Some(&**controls), cost[0]),
            None => (None, None, f64::NAN),
        };
        fill(&mut out.states, states, steps + 1, 1, n);
        fill(&mut out.controls, controls, steps, 1, m);
        // The search then tries other controls.
        if cost.is_finite() { cost } else { f64::INFINITY }
    }

    fn dynamics_jacobians(&self, at: Points, phi: &[f64], out: &mut Matrices, _: &mut Scratch) {
        let (n, joint) = (self.size.states, self.size.joint());
        let mut arguments = self.points(&at);
        arguments.push(numbers(phi));
        let found = self.call("dynamics_jacobians", arguments, [&[at.stages, n, joint]]);
        if let Some([found]) = &found {
            self.check_finite("derivatives of `step`", &at, phi, 0, found, n * joint);
        }
        fill(out, found.as_ref().map(|[found]| &**found), at.stages, n, joint);
    }

    fn measurement_jacobians(&self, at: Points, phi: &[f64], out: &mut Matrices, _: &mut Scratch) {
        let Dimensions { states: n, measurements: p, .. } = self.size;
        let count = at.count();
        let arguments = vec![vectors(at.states, 0, count), numbers(phi)];
        let found = self.call("measurement_jacobians", arguments, [&[count, p, n]]);
        if let Some([found]) = &found {
            self.check_finite("derivatives of `observe`", &at, phi, 0, found, p * n);
        }
        fill(out, found.as_ref().map(|[found]| &**found), count, p, n);
    }

    fn cost_quadratics(&self, at: Points, phi: &[f64], curvature: Curvature, out: &mut Matrices, _: &mut Scratch) {
        let (n, joint) = (self.size.states, self.size.joint());
        if at.stages > 0 {
            let mut arguments = self.points(&at);
            arguments.push(numbers(phi));
            let shapes: [&[usize]; 2] = [&[at.stages, joint, joint], &[at.stages, joint]];
            let found = self.call("stage_quadratics", arguments, shapes);
            write_quadratics(out, 0, at.stages, joint, joint, found.as_ref());
            if let Some([second, first]) = &found {
                self.check_finite("second derivatives of `cost`", &at, phi, 0, second, joint * joint);
                self.check_finite("derivatives of `cost`", &at, phi, 0, first, joint);
            }
        }
        for end in Self::ends(&at) {
            let arguments = vec![vectors(at.states, end, 1), numbers(phi)];
            let found = self.call("final_quadratics", arguments, [&[1, n, n], &[1, n]]);
            write_quadratics(out, end, 1, n, joint, found.as_ref());
            if let Some([second, first]) = &found {
                self.check_finite("second derivatives of `final_cost`", &at, phi, end, second, n * n);
                self.check_finite("derivatives of `final_cost`", &at, phi, end, first, n);
            }
        }
        if curvature == Curvature::GaussNewton {
            make_convex(out, joint);
        }
    }

    fn add_dynamics_curvature(
        &self,
        at: Points,
        phi: &[f64],
        costates: &Matrices,
        out: &mut Matrices,
        _: &mut Scratch,
    ) {
        let joint = self.size.joint();
        let mut arguments = self.points(&at);
        arguments.extend([vectors(costates, 1, at.stages), numbers(phi)]);
        let found = self.call("dynamics_curvature", arguments, [&[at.stages, joint, joint]]);
        let Some([found]) = found else { return poison(out) };
        self.check_finite("second derivatives of `step`", &at, phi, 0, &found, joint * joint);
        for (t, own) in found.chunks(joint * joint).enumerate() {
            write(out, t, own, joint, add);
        }
    }

    fn contract(
        &self,
        at: Points,
        phi: &[f64],
        adjoints: Adjoints,
        joint: &mut Matrices,
        parameters: &mut [f64],
        _: &mut Scratch,
    ) {
        let (n, p, z) = (self.size.states, self.size.measurements, self.size.joint());
        let (stages, count) = (at.stages, at.count());
        let KnotAdjoints { dynamics, measurement, cost, has_cost } = adjoints.knots;
        let mut run = |name: &str, arguments: Vec<Argument>, (first, count, width): (usize, usize, usize)| {
            let arguments = arguments.into_iter().chain([numbers(phi)]).collect();
            let shapes: [&[usize]; 2] = [&[count, width], &[parameters.len()]];
            let Some([by_point, by_parameter]) = self.call(name, arguments, shapes) else {
                parameters.fill(f64::NAN);
                return;
            };
            let what = format!("derivatives of a higher order (`{name}`)");
            self.check_finite(&what, &at, phi, first, &by_point, width);
            for (offset, own) in by_point.chunks(width).enumerate() {
                let (stride, matrix) = (joint.stride(), joint.at_mut(first + offset));
                own.iter().enumerate().for_each(|(i, number)| matrix[i * stride + z] += number);
            }
            parameters.iter_mut().zip(&by_parameter).for_each(|(to, from)| *to += from);
        };
        let with = |mut arguments: Vec<Argument>, adjoint: Given| {
            arguments.push(Argument::Array(adjoint));
            arguments
        };
        let arguments = with(self.points(&at), matrices(dynamics, 0, stages, n, z));
        run("contract_dynamics", arguments, (0, stages, z));
        let arguments = with(vec![vectors(at.states, 0, count)], matrices(measurement, 0, count, p, n));
        run("contract_measurements", arguments, (0, count, n));
        if *has_cost {
            let arguments = with(self.points(&at), matrices(cost, 0, stages, z, z));
            run("contract_stage_costs", arguments, (0, stages, z));
            for end in Self::ends(&at) {
                let arguments = with(vec![vectors(at.states, end, 1)], matrices(cost, end, 1, n, n));
                run("contract_final_costs", arguments, (end, 1, n));
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
        _: &mut Scratch,
    ) {
        let n = self.size.states;
        let mut run = |name: &str, mut arguments: Vec<Argument>| {
            arguments.push(numbers(phi));
            let found = self.call(name, arguments, [&[parameters.len()]]);
            let Some([found]) = found else { return parameters.fill(f64::NAN) };
            if let Some(bad) = found.iter().find(|number| !number.is_finite()) {
                let what = "derivatives of the functions by the parameters";
                self.complain(&format!("{what} are {bad} along a plan (`{name}`): they must be finite"));
            }
            parameters.iter_mut().zip(&found).for_each(|(to, from)| *to += from);
        };
        let mut arguments = self.points(&at);
        arguments.push(vectors(costates, 1, at.stages));
        match variation {
            None => run("stage_parameters", arguments),
            Some(Variation { joint, costates }) => {
                arguments.extend([vectors(joint, 0, at.stages), vectors(costates, 1, at.stages)]);
                run("stage_parameters_along", arguments);
            }
        }
        for end in Self::ends(&at) {
            let mut arguments = vec![vectors(at.states, end, 1)];
            match variation {
                None => run("final_parameters", arguments),
                Some(Variation { joint, .. }) => {
                    arguments.push(Argument::Array(Given(joint.vector(end)[..n].to_vec(), vec![1, n])));
                    run("final_parameters_along", arguments);
                }
            }
        }
    }
}
