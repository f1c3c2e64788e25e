//! "Design from here": a search, with what it visits on its way.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use serde_json::{Value, json};
use supple::design::{Aim, Control, DesignStatus, Event, Observer, Searcher, StartSummary};
use supple::{Matrices, Stop};
use supple_study::LoadedTask;

use crate::surroundings::Surroundings;

/// Progress is sent as often as that.
const PERIOD: Duration = Duration::from_millis(60);
/// How long a search may take to end after a request to stop; then the answer is the best design so far.
const PATIENCE: Duration = Duration::from_millis(500);

/// What a search found.
#[derive(Clone, Debug)]
pub struct Found {
    /// All parameters of the best design.
    pub design: Vec<f64>,
    /// Controls of its plans, of each task; empty if the search was stopped.
    pub controls: Vec<Matrices>,
    /// How the search ended, for the page.
    pub ended: Value,
}

/// Messages that a search sends while it runs.
enum News {
    Visited(Value),
    Ended(Result<Found, String>),
}

/// A design that was visited.
#[derive(Clone, Debug)]
struct Visited {
    design: Vec<f64>,
    information: f64,
    violation: f64,
}

struct State {
    evaluations: usize,
    phase: &'static str,
    first: Option<Visited>,
    best: Option<Visited>,
    told: Option<Instant>,
}

/// Tells visited designs, and keeps the best one.
struct Live {
    news: Sender<News>,
    feasibility: f64,
    began: Instant,
    state: Mutex<State>,
}

fn bits(nats: f64) -> f64 {
    nats / std::f64::consts::LN_2
}

impl Live {
    fn new(news: Sender<News>, feasibility: f64) -> Self {
        let state = State { evaluations: 0, phase: "the first design", first: None, best: None, told: None };
        Self { news, feasibility, began: Instant::now(), state: Mutex::new(state) }
    }

    /// Whether a design is better than another: it meets the limits with less information, or is nearer to them.
    fn is_better(&self, one: &Visited, other: &Visited) -> bool {
        match (one.violation <= self.feasibility, other.violation <= self.feasibility) {
            (true, true) => one.information < other.information,
            (false, false) => one.violation < other.violation,
            (met, _) => met,
        }
    }

    /// The best design so far, where a search did not end by itself in time; `None` if it evaluated none.
    fn best(&self) -> Option<Found> {
        let state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        let (best, first) = (state.best.clone()?, state.first.clone()?);
        let feasible = best.violation <= self.feasibility;
        let ended = json!({
            "status": if feasible { DesignStatus::Stopped } else { DesignStatus::BoundViolated },
            "evaluations": state.evaluations,
            "seconds": self.began.elapsed().as_secs_f64(),
            "from_bits": bits(first.information),
            "to_bits": bits(best.information),
            "feasible": feasible,
            "prices": [],
            "errors": [],
        });
        Some(Found { design: best.design, controls: Vec::new(), ended })
    }

    /// What a search found that ended by itself.
    fn found(&self, task: &LoadedTask, best: &StartSummary, status: DesignStatus) -> Found {
        let state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        let price = |(task, &nats): (&supple::Task, &f64)| json!({ "task": task.name, "bits_per_unit": bits(nats) });
        let prices: Vec<Value> = task.problem.tasks.iter().zip(&best.multipliers).map(price).collect();
        let ended = json!({
            "status": status,
            "evaluations": state.evaluations,
            "seconds": self.began.elapsed().as_secs_f64(),
            "from_bits": state.first.as_ref().map(|first| bits(first.information)),
            "to_bits": bits(best.information),
            "feasible": status.meets_bounds(),
            "prices": prices,
            "errors": best.error.iter().map(ToString::to_string).collect::<Vec<_>>(),
        });
        Found { design: best.to.clone(), controls: best.controls.clone(), ended }
    }
}

impl Observer for Live {
    fn observe(&self, event: Event) {
        let Ok(mut state) = self.state.lock() else { return };
        let due = match event {
            Event::Evaluated { design, information, violation, .. } => {
                let visited = Visited { design: design.to_vec(), information, violation };
                state.evaluations += 1;
                state.phase = "searching";
                state.first.get_or_insert_with(|| visited.clone());
                if state.best.as_ref().is_none_or(|best| self.is_better(&visited, best)) {
                    state.best = Some(visited.clone());
                }
                let due = state.told.is_none_or(|told| told.elapsed() >= PERIOD);
                due.then_some(visited)
            }
            Event::SearchingBranches { .. } => {
                state.phase = "looking for other local minima of the plan";
                state.best.clone()
            }
            Event::Combination { .. } => {
                state.phase = "choosing from the catalogues";
                state.best.clone()
            }
            _ => None,
        };
        let Some(Visited { design, information, violation }) = due else { return };
        state.told = Some(Instant::now());
        // If nobody receives, the search is ended by `stop`.
        let _ = self.news.send(News::Visited(json!({
            "evaluations": state.evaluations,
            "phase": state.phase,
            "parameters": design,
            "bits": bits(information),
            "violation": violation,
        })));
    }
}

fn run(task: &LoadedTask, starts: usize, live: &Live, stop: &AtomicBool) -> Result<Found, String> {
    let mut settings = task.problem.design.clone();
    settings.starts = starts.max(1);
    task.problem.check_design(&task.phi).map_err(|error| error.to_string())?;
    let searcher =
        Searcher::new(&task.problem, &settings, Aim::default(), Control { observer: live, stop: Stop::when(stop) });
    let found = searcher.search(&task.phi).and_then(|found| searcher.choose(found)).map_err(|e| e.to_string())?;
    Ok(live.found(task, found.found(), found.status))
}

/// Searches from the parameters of a task, from so many starts; reports what it visits. After a request to stop it waits
/// only briefly: the thread of the search ends at its next check.
///
/// # Errors
/// Where the first design cannot be evaluated, or the search is stopped before it is.
pub fn search(
    task: LoadedTask,
    starts: usize,
    surroundings: &Arc<dyn Surroundings>,
    stop: &Arc<AtomicBool>,
    tell: &dyn Fn(Value),
) -> Result<Found, String> {
    let (news, told) = channel();
    let live = Arc::new(Live::new(news.clone(), task.problem.design.feasibility));
    std::thread::spawn({
        let (live, surroundings, stop) = (Arc::clone(&live), Arc::clone(surroundings), Arc::clone(stop));
        move || {
            let _entered = surroundings.enter();
            let caught = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| run(&task, starts, &live, &stop)));
            let found = caught.unwrap_or_else(|_| Err("the computation failed unexpectedly".to_owned()));
            let _ = news.send(News::Ended(found));
        }
    });
    let mut stopped: Option<Instant> = None;
    loop {
        match told.recv_timeout(PERIOD) {
            Ok(News::Visited(visited)) => tell(visited),
            Ok(News::Ended(found)) => return found,
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => return Err("the search ended unexpectedly".to_owned()),
        }
        if stop.load(Ordering::Relaxed) && stopped.get_or_insert_with(Instant::now).elapsed() > PATIENCE {
            return live.best().ok_or_else(|| "stopped before the first design was evaluated".to_owned());
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    fn visited(information: f64, violation: f64) -> Visited {
        Visited { design: vec![information], information, violation }
    }

    #[test]
    fn the_best_design_meets_the_limits_first_and_then_needs_the_least() {
        let (news, _told) = channel();
        let live = Live::new(news, 1e-6);
        assert!(live.is_better(&visited(9.0, -0.1), &visited(1.0, 0.2)));
        assert!(live.is_better(&visited(1.0, 0.0), &visited(2.0, -0.5)));
        assert!(live.is_better(&visited(9.0, 0.1), &visited(1.0, 0.2)));
        assert!(!live.is_better(&visited(1.0, 0.1), &visited(9.0, -0.1)));
        assert!(live.best().is_none());
    }
}
