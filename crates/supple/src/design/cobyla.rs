use std::cell::RefCell;

use cobyla::{FailStatus, Func, RhoBeg, StopTols, SuccessStatus};

use super::outer::{Ending, Optimiser, OuterProblem};

/// Linear approximations by differences of values (COBYLA, Powell 1994): without gradients, for objectives that have kinks
/// or jumps.
pub(super) struct Cobyla;

/// Size of the first simplex, of a variable from 0 to 1.
const FIRST: f64 = 0.2;

impl Optimiser for Cobyla {
    /// It may end far from an optimum, and goes on where it begins again with a wide trust region.
    fn runs(&self) -> usize {
        6
    }

    fn minimise(&self, problem: &mut OuterProblem) -> Ending {
        let (first, tolerance, evaluations) = (problem.first(), problem.tolerance(), problem.max_evaluations());
        let bounds: Vec<(f64, f64)> = problem.bounds().into_iter().map(|[lower, upper]| (lower, upper)).collect();
        let count = problem.constraints();
        let shared = RefCell::new(problem);
        let objective = |x: &[f64], _: &mut ()| {
            let mut problem = shared.borrow_mut();
            let Some(at) = problem.at(x) else { return f64::NAN };
            problem.step_to(x, true);
            at.objective
        };
        // Its constraints must be at least 0.
        let constraints: Vec<_> = (0..count)
            .map(|index| {
                let shared = &shared;
                move |x: &[f64], _: &mut ()| shared.borrow_mut().at(x).map_or(f64::NAN, |at| -at.constraints[index])
            })
            .collect();
        let constraints: Vec<&dyn Func<()>> =
            constraints.iter().map(|constraint| constraint as &dyn Func<()>).collect();
        let tolerances =
            StopTols { ftol_rel: tolerance, xtol_abs: vec![tolerance; first.len()], ..StopTols::default() };
        let simplex = RhoBeg::All(FIRST);
        let outcome =
            cobyla::minimize(objective, &first, &bounds, &constraints, (), evaluations, simplex, Some(tolerances));
        if let Some(ending) = shared.borrow().interrupted() {
            return ending;
        }
        match outcome {
            Ok((SuccessStatus::MaxEvalReached, ..)) => Ending::MaxEvaluations,
            Ok(_) | Err((FailStatus::RoundoffLimited, ..)) => Ending::Converged,
            Err(_) => Ending::Stalled,
        }
    }
}
