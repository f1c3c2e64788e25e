use std::cell::RefCell;

use slsqp::{FailStatus, Func, StopTols, SuccessStatus};

use super::outer::{Ending, Optimiser, OuterProblem};

/// Sequential quadratic programming (SLSQP).
pub(super) struct Sqp;

impl Optimiser for Sqp {
    fn runs(&self) -> usize {
        3
    }

    fn steps_back(&self) -> bool {
        true
    }

    fn minimise(&self, problem: &mut OuterProblem) -> Ending {
        let (first, tolerance, evaluations) = (problem.first(), problem.tolerance(), problem.max_evaluations());
        let bounds: Vec<(f64, f64)> = problem.bounds().into_iter().map(|[lower, upper]| (lower, upper)).collect();
        let count = problem.constraints();
        let shared = RefCell::new(problem);
        let objective = |x: &[f64], gradient: Option<&mut [f64]>, _: &mut ()| {
            let mut problem = shared.borrow_mut();
            let Some(at) = problem.at(x) else { return f64::NAN };
            // SLSQP requests gradients at full steps, which it tries first, and at the end of a line search, if it had to
            // make.
            if let Some(gradient) = gradient {
                let is_trial = problem.is_new();
                problem.step_to(x, is_trial);
                gradient.copy_from_slice(&at.gradient);
            }
            at.objective
        };
        let constraints: Vec<_> = (0..count)
            .map(|index| {
                let shared = &shared;
                move |x: &[f64], gradient: Option<&mut [f64]>, _: &mut ()| {
                    let Some(at) = shared.borrow_mut().at(x) else { return f64::NAN };
                    if let Some(gradient) = gradient {
                        gradient.copy_from_slice(&at.jacobian[index]);
                    }
                    at.constraints[index]
                }
            })
            .collect();
        let constraints: Vec<&dyn Func<()>> =
            constraints.iter().map(|constraint| constraint as &dyn Func<()>).collect();
        let tolerances =
            StopTols { ftol_rel: tolerance, xtol_abs: vec![tolerance; first.len()], ..StopTols::default() };
        let outcome = slsqp::minimize(objective, &first, &bounds, &constraints, (), evaluations, Some(tolerances));
        if let Some(ending) = shared.borrow().interrupted() {
            return ending;
        }
        // Whatever it returns is a candidate among all visits: with rounding it may fall back to its first point.
        match outcome {
            Ok((SuccessStatus::MaxEvalReached, ..)) => Ending::MaxEvaluations,
            Ok(_) | Err((FailStatus::RoundoffLimited, ..)) => Ending::Converged,
            Err(_) => Ending::Stalled,
        }
    }
}
