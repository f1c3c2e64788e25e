use std::cell::RefCell;

use slsqp::{FailStatus, Func, StopTols, SuccessStatus};

use super::search::OPTIMAL;
use super::visit::Visit;
use super::{Ending, Search};
use crate::Error;

/// What the callbacks share: the search, and the first error.
struct Shared<'s, 'a, 'b> {
    search: &'s mut Search<'a, 'b>,
    error: Option<Error>,
    /// Size of the objective at the start.
    scale: f64,
    /// Size of each task's bound at the start.
    bounds: Vec<f64>,
}

impl Shared<'_, '_, '_> {
    /// The design at scaled coordinates; the last one visited once an error came up or a stop was asked for.
    fn visit(&mut self, scaled: &[f64]) -> Option<Visit> {
        if self.error.is_none() && !self.search.control.is_stopped() {
            let scaled: Vec<f64> = scaled.iter().map(|s| s.clamp(0.0, 1.0)).collect();
            match self.search.visit(&scaled) {
                Ok(visit) => return Some(visit),
                Err(error) => self.error = Some(error),
            }
        }
        self.search.visitor.visits.last().cloned()
    }

    fn gradient(&self, visit: &Visit, by_parameter: &[f64], scale: f64, out: Option<&mut [f64]>) {
        if let Some(out) = out {
            let scaled = self.search.visitor.scaling.gradient(&visit.phi, by_parameter);
            for (out, gradient) in out.iter_mut().zip(scaled) {
                *out = gradient / scale;
            }
        }
    }

    fn objective(&mut self, scaled: &[f64], gradient: Option<&mut [f64]>) -> f64 {
        let Some(visit) = self.visit(scaled) else { return f64::NAN };
        let problem = self.search.problem();
        self.gradient(&visit, &visit.information_gradient(problem), self.scale, gradient);
        visit.information(problem) / self.scale
    }

    /// `J - D` of one task, over the size of its bound at the start.
    fn constraint(&mut self, task: usize, scaled: &[f64], gradient: Option<&mut [f64]>) -> f64 {
        let Some(visit) = self.visit(scaled) else { return f64::NAN };
        let at = &visit.tasks[task];
        let scale = self.bounds[task];
        self.gradient(&visit, &at.cost_gradient, scale, gradient);
        at.bound.map_or(-1.0, |bound| (at.cost - bound) / scale)
    }
}

/// Runs of SLSQP from its own best point at most, while that is no optimum.
const RUNS: usize = 3;

/// Sequential quadratic programming from the last visited design (theory, equation D.2): minimises the information
/// subject to one constraint per bounded task, in scaled coordinates. Leaves the best design as the last visit.
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
    let (problem, settings) = (search.problem(), search.settings());
    let bounded: Vec<usize> = (0..problem.tasks.len()).filter(|&i| problem.tasks[i].bound.is_some()).collect();
    let scale = first.information(problem).abs().max(1e-12);
    let bounds = first.tasks.iter().map(|task| task.bound.map_or(1.0, |bound| bound.abs().max(1e-12)));
    let shared = RefCell::new(Shared { search, error: None, scale, bounds: bounds.collect() });

    let objective = |x: &[f64], g: Option<&mut [f64]>, _: &mut ()| shared.borrow_mut().objective(x, g);
    let constraints: Vec<_> = bounded
        .iter()
        .map(|&task| {
            let shared = &shared;
            move |x: &[f64], g: Option<&mut [f64]>, _: &mut ()| shared.borrow_mut().constraint(task, x, g)
        })
        .collect();
    let constraints: Vec<&dyn Func<()>> = constraints.iter().map(|constraint| constraint as &dyn Func<()>).collect();
    let dimension = first.scaled.len();
    let tolerances =
        StopTols { ftol_rel: settings.tolerance, xtol_abs: vec![settings.tolerance; dimension], ..StopTols::default() };
    let bounds = vec![(0.0, 1.0); dimension];
    let evaluations = settings.max_evaluations;
    let outcome = slsqp::minimize(objective, &first.scaled, &bounds, &constraints, (), evaluations, Some(tolerances));

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

/// Makes the best visit the last one: the least information of those that meet the bounds, or else the least
/// violation.
fn choose(search: &mut Search) -> Option<Visit> {
    let problem = search.problem();
    let feasibility = search.settings().feasibility;
    let visits = &mut search.visitor.visits;
    let feasible = |tolerance: f64| visits.iter().any(|visit| visit.is_feasible(tolerance));
    let tolerance = [ROUNDING, feasibility].into_iter().find(|&tolerance| feasible(tolerance));
    let merit = |visit: &Visit| match tolerance {
        Some(tolerance) if visit.is_feasible(tolerance) => visit.information(problem),
        Some(_) => f64::INFINITY,
        None => visit.violation(),
    };
    let best = (0..visits.len()).min_by(|&a, &b| merit(&visits[a]).total_cmp(&merit(&visits[b])))?;
    let best = visits.remove(best);
    visits.push(best.clone());
    Some(best)
}
