//! The globalised loop of nominal and belief-space plans: linearise, stop or solve for a step, search along it, and
//! raise or lower the regularisation. A kind of plan implements [`Descent`].

use std::time::Instant;
use supple_kernels::halt;
use supple_lqg::Decrease;

use super::{Plan, PlanSettings, PlanStatus};

/// Stationarity above which no plan counts as stationary up to rounding.
const NEARLY: f64 = 1e-5;
/// Maximum number of consecutive steps whose decrease is below rounding and that do not reduce the residual.
const MOST_HIDDEN: usize = 3;
/// Iterations between the milestones by which progress is judged.
const STRIDE: usize = 30;

/// The loop's interface to a search: a current plan, a step from it, and a trial plan along the step. The merit is the cost
/// that this kind of plan minimises.
pub(crate) trait Descent {
    /// The smallest regularisation tried after zero, and the largest.
    const MU: (f64, f64);
    /// Maximum number of regularisations tried in one iteration.
    const ATTEMPTS: usize;
    /// Replaces [`MOST_HIDDEN`] if the plan is stationary up to rounding.
    const MOST_HIDDEN_AT_END: usize;

    /// The current plan.
    fn plan(&mut self) -> &mut Plan;

    /// Its merit.
    fn merit(&self) -> f64;

    /// Linearises along the current plan, and sets its stationarity.
    fn measure(&mut self);

    /// Solves for a step with regularisation `mu`.
    ///
    /// # Errors
    /// Where no step leads downhill: how the search ends if no regularisation helps.
    fn solve(&mut self, mu: f64) -> Result<Model, PlanStatus>;

    /// Sets the trial to the plan a share of the step away; returns its merit, which is not finite if it has none.
    fn try_share(&mut self, share: f64) -> f64;

    /// Makes the trial the current plan.
    fn accept(&mut self, step: Step);

    /// The regularisation after a step that was found with `mu`.
    fn ease(&self, mu: f64, step: Step) -> f64;

    /// A step by a better model than the regularised one, accepted already, if there is one.
    fn refine(&mut self) -> Option<Step> {
        None
    }

    /// Whether to stop early.
    fn gives_up(&self) -> bool {
        false
    }
}

/// What is known of the merit along a step.
#[derive(Clone, Copy)]
pub(crate) enum Model {
    /// A quadratic model along it.
    Quadratic(Decrease),
    /// The slope at its start, negative; a whole Newton step decreases the merit by half of it.
    Slope(f64),
}

impl Model {
    /// The predicted decrease: first the one of which a share must be reached, then the one to compare with rounding.
    fn predicted(self, share: f64) -> [f64; 2] {
        match self {
            Self::Quadratic(model) => [-(share * model.linear + share * share * model.quadratic); 2],
            Self::Slope(slope) => [-share * slope, -0.5 * slope],
        }
    }
}

/// An accepted step.
#[derive(Clone, Copy)]
pub(crate) struct Step {
    /// The share of the whole step that was made.
    pub share: f64,
    /// The merit after it.
    pub merit: f64,
    /// Whether rounding hides the predicted decrease.
    pub hidden: bool,
}

/// Runs a search from its current plan, which becomes the best plan found; returns how it ended. A search without
/// further progress counts as converged if the plan is stationary up to rounding.
pub(crate) fn descend<D: Descent>(search: &mut D, settings: &PlanSettings, deadline: Option<Instant>) -> PlanStatus {
    let (mut mu, mut milestone) = (0.0, Milestone { iterations: 0, merit: f64::INFINITY, stationarity: f64::INFINITY });
    let (mut hidden, mut least) = (0, f64::INFINITY);
    let status = loop {
        search.measure();
        let merit = search.merit();
        let &mut Plan { iterations, relative_stationarity: stationarity, .. } = search.plan();
        if stationarity <= settings.tolerance {
            return PlanStatus::Converged;
        }
        if iterations >= settings.max_iterations {
            break PlanStatus::MaxIterations;
        }
        if is_over(deadline) {
            break PlanStatus::TimeLimit;
        }
        if creeps(&mut milestone, Milestone { iterations, merit, stationarity }) || search.gives_up() {
            break PlanStatus::SlowProgress;
        }
        search.plan().iterations += 1;
        match advance(search, settings, &mut mu) {
            Ok(Some(Step { hidden: true, .. })) => {
                // The search continues while such steps bring the plan closer to stationary, and for a few that do not.
                hidden = if stationarity < 0.5 * least { 0 } else { hidden + 1 };
                least = least.min(stationarity);
                let nearly = is_nearly_stationary(stationarity, settings);
                if hidden > if nearly { D::MOST_HIDDEN_AT_END } else { MOST_HIDDEN } {
                    break PlanStatus::LineSearchStalled;
                }
            }
            Ok(Some(_)) => hidden = 0,
            // The next iteration tries with more regularisation.
            Ok(None) => {}
            Err(status) => break status,
        }
    };
    search.measure();
    let nearly = is_nearly_stationary(search.plan().relative_stationarity, settings);
    if nearly { PlanStatus::Converged } else { status }
}

/// Whether a plan is as stationary as rounding may allow.
fn is_nearly_stationary(stationarity: f64, settings: &PlanSettings) -> bool {
    stationarity <= (1e4 * settings.tolerance).min(settings.tolerance.max(NEARLY))
}

/// Whether the deadline has passed, or a stop was requested.
pub(crate) fn is_over(deadline: Option<Instant>) -> bool {
    halt::is_requested() || deadline.is_some_and(|deadline| Instant::now() >= deadline)
}

/// How far a search has come.
struct Milestone {
    iterations: usize,
    merit: f64,
    stationarity: f64,
}

/// Whether neither merit nor stationarity improved much since the last milestone. Sets a new one every [`STRIDE`]
/// iterations, and is false in between.
fn creeps(milestone: &mut Milestone, now: Milestone) -> bool {
    if now.iterations < milestone.iterations + STRIDE {
        return false;
    }
    let before = std::mem::replace(milestone, now);
    before.merit - milestone.merit <= 1e-6 * (1.0 + milestone.merit.abs())
        && milestone.stationarity > 0.1 * before.stationarity
}

/// One iteration: a step by the refined model, or with as much regularisation as it takes. None if no attempt of this
/// iteration gave one.
///
/// # Errors
/// The cause, if even the largest regularisation gives no step.
fn advance<D: Descent>(search: &mut D, settings: &PlanSettings, mu: &mut f64) -> Result<Option<Step>, PlanStatus> {
    if let Some(step) = search.refine() {
        return Ok(Some(step));
    }
    for attempt in 0..D::ATTEMPTS {
        let solved = search.solve(*mu);
        let failure = match solved.map(|model| search_along(search, settings, model, settings.max_halvings, 0)) {
            Ok(Some(step)) => {
                *mu = search.ease(*mu, step);
                return Ok(Some(step));
            }
            Ok(None) => PlanStatus::LineSearchStalled,
            Err(status) => status,
        };
        search.plan().regularised += usize::from(attempt == 0);
        *mu = (10.0 * *mu).max(D::MU.0);
        if *mu > D::MU.1 {
            return Err(failure);
        }
    }
    Ok(None)
}

/// Accepts the longest of the halved steps that lowers the merit enough; or, where rounding hides the predicted
/// decrease, that raises it by no more than rounding. A whole step is doubled as long as that lowers the merit further.
pub(crate) fn search_along(
    search: &mut impl Descent,
    settings: &PlanSettings,
    model: Model,
    halvings: usize,
    doublings: usize,
) -> Option<Step> {
    let before = search.merit();
    let resolution = 10.0 * (1e-14 * (1.0 + before.abs()));
    let mut share = 1.0;
    for tried in 0..=halvings {
        let [demanded, visible] = model.predicted(share);
        let (merit, hidden) = (search.try_share(share), visible <= resolution);
        let decrease = before - merit;
        let enough = decrease > 0.0 && decrease >= settings.sufficient_decrease * demanded;
        if merit.is_finite() && (enough || hidden && decrease >= -resolution) {
            let mut step = Step { share, merit, hidden };
            if tried == 0 {
                lengthen(search, &mut step, before, resolution, doublings);
            }
            search.accept(step);
            return Some(step);
        }
        share *= 0.5;
    }
    None
}

/// Doubles a step while the merit falls, or changes by less than its resolution from what it was `before`; leaves the best
/// as the trial.
fn lengthen(search: &mut impl Descent, step: &mut Step, before: f64, resolution: f64, doublings: usize) {
    let mut share = step.share;
    for _ in 0..doublings {
        share *= 2.0;
        let merit = search.try_share(share);
        if merit < step.merit {
            *step = Step { share, merit, hidden: before - merit <= resolution };
        } else if (merit - before).abs() > resolution || merit.is_nan() {
            break;
        }
    }
    if share != step.share {
        search.try_share(step.share);
    }
}

#[cfg(test)]
mod tests {
    use std::time::Instant;

    use supple_lqg::{Decrease, Dimensions};

    use super::{Descent, Model, Plan, PlanSettings, PlanStatus, Step, descend, search_along};

    /// A merit over one number, with the slope and the curvature that steps come from.
    struct Line {
        plan: Plan,
        at: f64,
        trial: f64,
        step: f64,
        merit: fn(f64) -> f64,
        slope: fn(f64) -> f64,
        curvature: f64,
    }

    impl Line {
        fn new(merit: fn(f64) -> f64, slope: fn(f64) -> f64, curvature: f64) -> Self {
            let plan = Plan::zeros(Dimensions { states: 1, controls: 1, measurements: 1 }, 1);
            Self { plan, at: 1.0, trial: f64::NAN, step: f64::NAN, merit, slope, curvature }
        }

        fn descend(&mut self) -> PlanStatus {
            descend(self, &PlanSettings::default(), None)
        }
    }

    impl Descent for Line {
        const MU: (f64, f64) = (1e-2, 1e6);
        const ATTEMPTS: usize = 3;
        const MOST_HIDDEN_AT_END: usize = 0;

        fn plan(&mut self) -> &mut Plan {
            &mut self.plan
        }

        fn merit(&self) -> f64 {
            (self.merit)(self.at)
        }

        fn measure(&mut self) {
            self.plan.relative_stationarity = (self.slope)(self.at).abs();
        }

        fn solve(&mut self, mu: f64) -> Result<Model, PlanStatus> {
            let (slope, curvature) = ((self.slope)(self.at), self.curvature + mu);
            if curvature <= 0.0 {
                return Err(PlanStatus::Indefinite);
            }
            self.step = -slope / curvature;
            let (linear, quadratic) = (slope * self.step, 0.5 * curvature * self.step.powi(2));
            Ok(Model::Quadratic(Decrease { linear, quadratic }))
        }

        fn try_share(&mut self, share: f64) -> f64 {
            self.trial = self.at + share * self.step;
            (self.merit)(self.trial)
        }

        fn accept(&mut self, _: Step) {
            self.at = self.trial;
        }

        fn ease(&self, mu: f64, _: Step) -> f64 {
            if mu > Self::MU.0 { 0.1 * mu } else { 0.0 }
        }
    }

    #[test]
    fn a_quadratic_merit_takes_one_step() {
        let mut line = Line::new(|x| x * x, |x| 2.0 * x, 2.0);
        assert_eq!(line.descend(), PlanStatus::Converged);
        assert_eq!((line.plan.iterations, line.plan.regularised, line.at), (1, 0, 0.0));
    }

    #[test]
    fn regularisation_grows_until_there_is_a_step() {
        let mut line = Line::new(|x| x * x, |x| 2.0 * x, -0.5);
        assert_eq!(line.descend(), PlanStatus::Converged);
        assert!(line.plan.regularised > 0 && line.at.abs() < 1e-9, "{}", line.at);
        line = Line::new(|x| x * x, |x| 2.0 * x, -1e7);
        assert_eq!(line.descend(), PlanStatus::Indefinite);
    }

    #[test]
    fn rejected_steps_end_the_search_where_it_began() {
        let mut line = Line::new(|x| (x - 1.0).abs(), |_| 1.0, 1.0);
        assert_eq!(line.descend(), PlanStatus::LineSearchStalled);
        // Tries no regularisation and nine powers of ten, with three attempts per iteration.
        assert_eq!((line.plan.iterations, line.plan.regularised, line.at), (4, 4, 1.0));
        // A merit that is finite only at the start.
        line = Line::new(|x| if x == 1.0 { 0.0 } else { f64::NAN }, |_| 1.0, 1.0);
        assert_eq!(line.descend(), PlanStatus::LineSearchStalled);
    }

    #[test]
    fn where_rounding_hides_the_decrease_the_slope_decides() {
        // Every step divides the slope by 4.
        let mut line = Line::new(|x| 1e9 + 1e-5 * x * x, |x| 2e-5 * x, 2e-5 * 4.0 / 3.0);
        assert_eq!(line.descend(), PlanStatus::Converged);
        assert!(line.at.abs() < 1e-7 && line.plan.iterations > 5, "{}", line.at);
        // No step reduces the residual: the first sets the reference, and the fourth after it ends the search.
        line = Line::new(|_| 1e9, |_| 1e-5, 1.0);
        assert_eq!(line.descend(), PlanStatus::LineSearchStalled);
        assert_eq!(line.plan.iterations, 5);
        // The same with a slope as small as rounding.
        line = Line::new(|_| 1e9, |_| 1e-10, 1.0);
        assert_eq!(line.descend(), PlanStatus::Converged);
        assert_eq!(line.plan.iterations, 2);
    }

    #[test]
    fn whole_steps_are_doubled_while_that_helps() {
        let along = |line: &mut Line, slope, doublings| {
            line.step = 1.0;
            search_along(line, &PlanSettings::default(), Model::Slope(slope), 3, doublings)
                .map(|step| (step.share, step.hidden))
        };
        let far = || Line::new(|x| (x - 9.0).powi(2), |x| 2.0 * (x - 9.0), 2.0);
        for (doublings, share) in [(0, 1.0), (2, 4.0), (20, 8.0)] {
            let mut line = far();
            assert_eq!(along(&mut line, -16.0, doublings), Some((share, false)));
            assert_eq!((line.at, line.trial), (1.0 + share, 1.0 + share));
        }
        // Half a step is not doubled again.
        let mut near = Line::new(|x| (x - 1.5).powi(2), |x| 2.0 * (x - 1.5), 2.0);
        assert_eq!(along(&mut near, -1.0, 20), Some((0.5, false)));
        // At first rounding hides the decrease.
        let mut ridge = Line::new(|x| 1.0 - 1e-16 * (x - 1.0).powi(4), |_| -1e-16, 1.0);
        assert_eq!(along(&mut ridge, -1e-16, 10), Some((1024.0, false)));
    }

    #[test]
    fn limits_and_slow_progress_end_the_search() {
        let slow = || Line::new(|x| 1e-5 * x, |_| 1e-5, 1e2);
        assert_eq!(slow().descend(), PlanStatus::SlowProgress);
        let settings = PlanSettings { max_iterations: 7, ..PlanSettings::default() };
        assert_eq!(descend(&mut slow(), &settings, None), PlanStatus::MaxIterations);
        assert_eq!(descend(&mut slow(), &settings, Some(Instant::now())), PlanStatus::TimeLimit);
    }
}
