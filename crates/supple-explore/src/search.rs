//! "Design from here": a search, with what it visits on its way.

use std::sync::Mutex;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

use serde_json::{Value, json};
use supple::design::{Event, Observer};
use supple_study::design::{DesignReport, run_observed};
use supple_study::{LoadedTask, Silent, StudyError, Watch};

/// Progress is sent as often as that.
const PERIOD: Duration = Duration::from_millis(60);

/// Tells visited designs.
struct Live<'a> {
    tell: &'a (dyn Fn(Value) + Sync),
    state: Mutex<State>,
}

struct State {
    evaluations: usize,
    told: Option<Instant>,
}

impl Observer for Live<'_> {
    fn observe(&self, event: Event) {
        let Event::Evaluated { design, information, costs, violation, .. } = event else { return };
        let Ok(mut state) = self.state.lock() else { return };
        state.evaluations += 1;
        if state.told.is_some_and(|told| told.elapsed() < PERIOD) {
            return;
        }
        state.told = Some(Instant::now());
        (self.tell)(json!({
            "evaluations": state.evaluations,
            "parameters": design,
            "bits": information / std::f64::consts::LN_2,
            "costs": costs,
            "violation": violation,
        }));
    }
}

/// Searches from the parameters of a task, from so many starts; tells what is visited.
///
/// # Errors
/// Where there is nothing to design, or the first design cannot be evaluated.
pub fn search(
    task: &LoadedTask,
    starts: usize,
    stop: &AtomicBool,
    tell: &(dyn Fn(Value) + Sync),
) -> Result<DesignReport, StudyError> {
    let mut settings = task.problem.design.clone();
    (settings.starts, settings.rollouts) = (starts.max(1), Some(0));
    let live = Live { tell, state: Mutex::new(State { evaluations: 0, told: None }) };
    run_observed(task, &settings, &live, (None, Watch { progress: &Silent, stop }))
}

/// How a search ended.
pub fn ended(report: &DesignReport) -> Value {
    let bits = |nats: f64| nats / std::f64::consts::LN_2;
    let prices: Vec<Value> = report
        .bound_prices
        .iter()
        .map(|price| json!({ "task": price.task, "bits_per_unit": bits(price.nats_per_unit) }))
        .collect();
    json!({
        "status": report.status,
        "evaluations": report.evaluations,
        "seconds": report.seconds,
        "from_bits": report.start.objective.information_bits,
        "to_bits": report.optimum.objective.information_bits,
        "feasible": report.optimum.feasible,
        "active": report.active_bounds,
        "prices": prices,
        "errors": report.starts.iter().filter_map(|start| start.error.as_deref()).collect::<Vec<_>>(),
    })
}
