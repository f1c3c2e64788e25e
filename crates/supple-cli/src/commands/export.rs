use std::path::PathBuf;

use supple::simulate::Rollouts;
use supple::{Trust, Verdict};
use supple_study::Folder;
use supple_study::controller::{At, ControllerFormat, ExportedController, check_out};

use crate::arguments::{AtArgument, ControllerFormatArgument, ExportOptions};
use crate::failure::Failure;
use crate::outcome::Outcome;
use crate::output::{print_text, warn, warn_changed};
use crate::tables::number;
use crate::trust;

/// `supple export DIR --to FORMAT`
pub fn export(options: &ExportOptions) -> Result<Outcome, Failure> {
    let format = match options.to {
        ControllerFormatArgument::C => ControllerFormat::C,
        ControllerFormatArgument::Json => ControllerFormat::Json,
        ControllerFormatArgument::Npz => ControllerFormat::Npz,
    };
    let at = options.at.map(|at| match at {
        AtArgument::Start => At::Start,
        AtArgument::Optimum => At::Optimum,
    });
    if let Some(out) = &options.out {
        check_out(format, out)?;
    }
    let folder = Folder::load(&options.folder)?;
    warn_changed(&folder.path);
    let exported = ExportedController::of(&folder, None, options.task.as_deref(), at)?;
    let standard = || PathBuf::from(format!("{}.{}", exported.name(), format.extension()));
    let out = options.out.clone().unwrap_or_else(standard);
    for path in exported.write(format, &out)? {
        print_text(&format!("wrote {}\n", path.display()))?;
    }
    let mut outcome = Outcome::Success;
    if options.rollouts.0 > 0 {
        outcome = outcome.and(roll_out(&exported, Rollouts { count: options.rollouts.0, seed: options.seed })?);
    }
    if !exported.status.is_converged() {
        let (task, status) = (&exported.task.name, exported.status);
        warn(&format!("the plan of task `{task}` has status {status}; its controller may not track the plan"));
        outcome = Outcome::Shortfall;
    }
    let task = &exported.task.name;
    match &exported.trust {
        Some(Trust { verdict: Verdict::Broken, .. }) => {
            warn(&format!(
                "roll-outs contradict the plan of task `{task}`: its controller does not perform as predicted"
            ));
            outcome = Outcome::Shortfall;
        }
        Some(doubtful @ Trust { verdict: Verdict::Doubtful, .. }) => {
            warn(&format!("the roll-outs of task `{task}` leave its predictions {doubtful}"));
        }
        _ => {}
    }
    Ok(outcome)
}

/// Share of the expected cost by which the cost in closed loop may surely be above it without a word.
const DEARER: f64 = 0.1;

/// Runs the controller in closed loop with the model and prints its cost.
fn roll_out(exported: &ExportedController, rollouts: Rollouts) -> Result<Outcome, Failure> {
    let found = exported.monte_carlo(rollouts)?;
    let expected = number(exported.expected_cost);
    if found.diverged > 0 {
        let (count, of) = (found.diverged, found.rollouts);
        warn(&format!("{count} of {of} closed-loop roll-outs diverged: the controller does not track the plan"));
        return Ok(Outcome::Shortfall);
    }
    let interval = found.cost_interval_95.map_or_else(String::new, |of| format!(" ({})", trust::between(of)));
    print_text(&format!(
        "cost in closed loop {}{interval} over {} roll-outs; expected {expected}\n",
        number(found.cost_mean),
        found.rollouts
    ))?;
    let least = found.cost_interval_95.map_or(f64::NEG_INFINITY, |[low, _]| low);
    if least > exported.expected_cost + DEARER * exported.expected_cost.abs() {
        warn("the controller costs more in closed loop than its plan is expected to, by more than a tenth");
    }
    Ok(Outcome::Success)
}
