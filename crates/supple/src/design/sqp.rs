use std::cell::RefCell;

use slsqp::{FailStatus, Func, StopTols, SuccessStatus};

use super::optimality::OPTIMAL;
use super::visit::Visit;
use super::{Aim, Ending, Search};
use crate::Error;

/// What the callbacks share: the search, and the first error.
struct Shared<'s, 'a, 'b> {
    search: &'s mut Search<'a, 'b>,
    error: Option<Error>,
    /// How many coordinates designs have; what comes after them is the auxiliary variable.
    dimension: usize,
    /// Size of the objective at the start.
    scale: f64,
    /// Size of each task's bound at the start.
    bounds: Vec<f64>,
}

impl Shared<'_, '_, '_> {
    /// The design at scaled coordinates; the last one visited once an error came up or a stop was asked for.
    fn visit(&mut self, variables: &[f64]) -> Option<Visit> {
        if self.error.is_none() && !self.search.control.is_stopped() {
            let scaled: Vec<f64> = variables[..self.dimension].iter().map(|s| s.clamp(0.0, 1.0)).collect();
            match self.search.visit(&scaled) {
                Ok(visit) => return Some(visit),
                Err(error) => self.error = Some(error),
            }
        }
        self.search.visitor.visits.last().cloned()
    }

    /// Writes a gradient by all parameters over a scale, and by the auxiliary variable where there is one.
    fn gradient(&self, visit: &Visit, by_parameter: &[f64], (scale, auxiliary): (f64, f64), out: Option<&mut [f64]>) {
        if let Some(out) = out {
            out.fill(auxiliary);
            let scaled = self.search.visitor.scaling.gradient(&visit.phi, by_parameter);
            for (out, gradient) in out.iter_mut().zip(scaled) {
                *out = gradient / scale;
            }
        }
    }

    fn objective(&mut self, variables: &[f64], gradient: Option<&mut [f64]>) -> f64 {
        if self.search.aim() == Aim::Cost {
            if let Some(gradient) = gradient {
                gradient.fill(0.0);
                gradient[self.dimension] = 1.0;
            }
            return variables[self.dimension];
        }
        let known = self.search.evaluations;
        let Some(visit) = self.visit(variables) else { return f64::NAN };
        let problem = self.search.problem();
        // SLSQP asks for gradients at full steps, which it tries first, and where a line search ended that it had to make.
        if gradient.is_some() {
            self.search.step_to(&visit, self.search.evaluations > known);
        }
        self.gradient(&visit, &visit.objective_gradient(problem), (self.scale, 0.0), gradient);
        visit.objective(problem) / self.scale
    }

    /// What may be at most 0 for one task: `J - D` over the size of its bound at the start; of least cost, `J / D` over
    /// its size at the start, less the auxiliary variable.
    fn constraint(&mut self, task: usize, variables: &[f64], gradient: Option<&mut [f64]>) -> f64 {
        let Some(visit) = self.visit(variables) else { return f64::NAN };
        let at = &visit.tasks[task];
        if self.search.aim() == Aim::Cost {
            let by_parameter = at.violation_gradient().unwrap_or_else(|| vec![0.0; visit.phi.len()]);
            self.gradient(&visit, &by_parameter, (self.scale, -1.0), gradient);
            return at.violation().map_or(-1.0, |violation| (1.0 + violation) / self.scale - variables[self.dimension]);
        }
        let scale = self.bounds[task];
        self.gradient(&visit, &at.excess_gradient(1.0), (scale, 0.0), gradient);
        at.bound.map_or(-1.0, |bound| (at.cost - bound) / scale)
    }

    /// What may be at most 0 for the budget: how far the price is above it, relative to it.
    fn budget(&mut self, variables: &[f64], gradient: Option<&mut [f64]>) -> f64 {
        let Some(visit) = self.visit(variables) else { return f64::NAN };
        let budget = visit.price.budget.unwrap_or(f64::INFINITY);
        self.gradient(&visit, &visit.price.gradient, (budget, 0.0), gradient);
        visit.price.violation().unwrap_or(-1.0)
    }
}

/// Runs of SLSQP from its own best point at most, while that is no optimum.
const RUNS: usize = 3;

/// Sequential quadratic programming from the last visited design (theory, equation D.2): minimises the information
/// subject to one constraint per bounded task, in scaled coordinates. For the least cost it minimises an auxiliary
/// variable that is at least every `J_i / D_i`. Leaves the best design as the last visit.
pub(super) fn minimise(search: &mut Search) -> Result<Ending, Error> {
    let mut ending = Ending::Stalled;
    for _ in 0..RUNS {
        let Some(first) = search.visitor.visits.last().cloned() else { break };
        ending = run(search, &first)?;
        let Some(best) = choose(search) else { break };
        if ending == Ending::Stopped
            || search.error.is_some()
            || search.optimality(&best).0 <= OPTIMAL
            || best.scaled == first.scaled
        {
            break;
        }
    }
    Ok(ending)
}

/// One run of SLSQP.
fn run(search: &mut Search, first: &Visit) -> Result<Ending, Error> {
    let (problem, settings, aim) = (search.problem(), search.settings(), search.aim());
    let bounded: Vec<usize> = (0..first.tasks.len()).filter(|&i| first.tasks[i].bound.is_some()).collect();
    let scale = match aim {
        Aim::Information { .. } => first.objective(problem).abs().max(1e-12),
        Aim::Cost => (1.0 + first.violation()).max(1e-12),
    };
    let bounds = first.tasks.iter().map(|task| task.bound.map_or(1.0, |bound| bound.abs().max(1e-12)));
    let dimension = first.scaled.len();
    let shared = RefCell::new(Shared { search, error: None, dimension, scale, bounds: bounds.collect() });
    let mut variables = first.scaled.clone();
    let mut bounds = vec![(0.0, 1.0); dimension];
    if aim == Aim::Cost {
        // The auxiliary variable: 1 where the search begins.
        variables.push(1.0);
        bounds.push((0.0, 2.0));
    }

    let objective = |x: &[f64], g: Option<&mut [f64]>, _: &mut ()| shared.borrow_mut().objective(x, g);
    let constraints: Vec<_> = bounded
        .iter()
        .map(|&task| {
            let shared = &shared;
            move |x: &[f64], g: Option<&mut [f64]>, _: &mut ()| shared.borrow_mut().constraint(task, x, g)
        })
        .collect();
    let mut constraints: Vec<&dyn Func<()>> =
        constraints.iter().map(|constraint| constraint as &dyn Func<()>).collect();
    let budget = |x: &[f64], g: Option<&mut [f64]>, _: &mut ()| shared.borrow_mut().budget(x, g);
    if settings.budget.is_some() {
        constraints.push(&budget);
    }
    let tolerances = StopTols {
        ftol_rel: settings.tolerance,
        xtol_abs: vec![settings.tolerance; variables.len()],
        ..StopTols::default()
    };
    let evaluations = settings.max_evaluations;
    let outcome = slsqp::minimize(objective, &variables, &bounds, &constraints, (), evaluations, Some(tolerances));

    let Shared { search, error, .. } = shared.into_inner();
    if error.is_some() {
        search.error = error;
        return Ok(Ending::Stalled);
    }
    // Whatever it returns is a candidate among all visits: with rounding it may fall back to its first point.
    Ok(match outcome {
        _ if search.control.is_stopped() => Ending::Stopped,
        Ok((SuccessStatus::MaxEvalReached, ..)) => Ending::MaxEvaluations,
        Ok(_) | Err((FailStatus::RoundoffLimited, ..)) => Ending::Converged,
        Err(_) => Ending::Stalled,
    })
}

/// Violations up to this, relative to the bound, are rounding.
const ROUNDING: f64 = 1e-9;

/// Makes the best visit the last one: the least objective of those that meet the bounds, or else the least violation of
/// those whose plans converged.
fn choose(search: &mut Search) -> Option<Visit> {
    let (problem, aim) = (search.problem(), search.aim());
    let feasibility = search.settings().feasibility;
    let visits = &mut search.visitor.visits;
    let met = |tolerance: f64| visits.iter().any(|visit| aim.is_met(visit, tolerance));
    let tolerance = [ROUNDING, feasibility].into_iter().find(|&tolerance| met(tolerance));
    let merit = |visit: &Visit| match tolerance {
        Some(tolerance) if aim.is_met(visit, tolerance) => aim.objective(visit, problem),
        None if visit.is_planned() => visit.excess(),
        _ => f64::INFINITY,
    };
    let best = (0..visits.len()).min_by(|&a, &b| merit(&visits[a]).total_cmp(&merit(&visits[b])))?;
    let best = visits.remove(best);
    visits.push(best.clone());
    Some(best)
}
