//! The door with a time step that is ten times longer: the table in docs/theory/robot.md.
#![allow(clippy::unwrap_used)]

use std::path::{Path, PathBuf};

use supple::{EvaluateOptions, Named};
use supple_study::LoadedTask;

fn repository(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(path)
}

/// Cost and bits of opening the door with all stiffnesses at `stiffness`, N/m, and the time step times `factor`; what the
/// file gives by step stays the same by time.
fn opened((integrator, substeps): (&str, usize), factor: f64, stiffness: f64) -> [f64; 2] {
    let mut sources = LoadedTask::load(&repository("tasks/iiwa_door.toml")).unwrap().sources;
    let mut change = |from: &str, to: String| {
        assert!(sources[0].text.contains(from), "the door has no `{from}`");
        sources[0].text = sources[0].text.replace(from, &to);
    };
    change("integrator = \"semi_implicit\"", format!("substeps = {substeps}\nintegrator = {integrator:?}"));
    change("steps = 500", format!("steps = {}", 500.0 / factor));
    change("time_step = 2.5e-4", format!("time_step = {:?}", 2.5e-4 * factor));
    change("\nvariance = 1e-2", format!("\nvariance = {:?}", 1e-2 / factor));
    change("\"q.*\" = 1e-7, \"v.*\" = 1e-4", format!("\"q.*\" = {:?}, \"v.*\" = {:?}", 1e-7 * factor, 1e-4 * factor));
    change("\nweight = 15.0", format!("\nweight = {:?}", 15.0 * factor));
    change("\nweight = 1e-5", format!("\nweight = {:?}", 1e-5 * factor));
    let set = Named::from(["k1", "k2", "k3"].map(|name| (name, stiffness)));
    let task = LoadedTask::restore(&sources).and_then(|task| task.setting(&set)).unwrap();
    let found = task.problem.evaluate(&task.phi, &EvaluateOptions::default()).unwrap();
    let open = &found.tasks[0];
    assert!(open.status.is_converged(), "{:?}", open.status);
    [open.cost.expected, open.information.total_bits]
}

fn percent(long: f64, short: f64) -> String {
    format!("{:+.1} %", 100.0 * (long / short - 1.0)).replace('-', "−")
}

#[test]
fn ten_times_longer_steps_are_as_shown() {
    let text = std::fs::read_to_string(repository("docs/theory/robot.md")).unwrap();
    for stiffness in [1e6, 1e4] {
        let [cost, bits] = opened(("semi_implicit", 1), 0.25, stiffness);
        let [long_cost, long_bits] = opened(("implicit", 1), 10.0, stiffness);
        let row = format!(
            "| {stiffness:e} | {cost:.1} | {} | {bits:.0} | {} |",
            percent(long_cost, cost),
            percent(long_bits, bits)
        );
        assert!(text.contains(&row), "{row}");
        // Half of the first stage, whose door is 0.33 rad from its target, less half of it with short steps.
        let sum = format!("{:.1} %", 50.0 * 15.0 * 0.33 * 0.33 * (10.0 - 0.25) / cost);
        assert!(text.contains(&sum), "{sum}");
        if stiffness < 1e5 {
            let [cost_within, bits_within] = opened(("semi_implicit", 10), 10.0, stiffness);
            let changes = format!("{} and its bits by {}", percent(cost_within, cost), percent(bits_within, bits));
            let words = text.split_whitespace().collect::<Vec<_>>().join(" ");
            assert!(words.contains(&changes), "{changes}");
        }
    }
}
