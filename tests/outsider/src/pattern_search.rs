use supple::design::{Ending, Optimiser, OuterPoint, OuterProblem};

/// A pattern search on an exact penalty: it looks up and down along each variable, and halves its step where neither is
/// better.
#[derive(Clone, Copy, Debug)]
pub struct PatternSearch;

/// What a unit of a violated constraint counts, in units of the objective.
const PENALTY: f64 = 100.0;

impl Optimiser for PatternSearch {
    fn minimise(&self, problem: &mut OuterProblem) -> Ending {
        let merit = |at: &OuterPoint| {
            let excess: f64 = at.constraints.iter().map(|constraint| constraint.max(0.0)).sum();
            at.objective + PENALTY * excess
        };
        let (mut best, bounds) = (problem.first(), problem.bounds());
        let Some(mut least) = problem.at(&best).as_ref().map(merit) else { return Ending::Stalled };
        let mut step = 0.25;
        while step > 1e-7 {
            let mut better = false;
            for variable in 0..best.len() {
                for sign in [-1.0, 1.0] {
                    let mut next = best.clone();
                    let [lower, upper] = bounds[variable];
                    next[variable] = (next[variable] + sign * step).clamp(lower, upper);
                    let Some(at) = problem.at(&next) else { return Ending::Stalled };
                    if let Some(ending) = problem.interrupted() {
                        return ending;
                    }
                    if merit(&at) < least {
                        problem.step_to(&next, false);
                        (best, least, better) = (next, merit(&at), true);
                    }
                }
            }
            if !better {
                step *= 0.5;
            }
        }
        Ending::Converged
    }
}
