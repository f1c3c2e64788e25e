//! Robustness: the cost in closed loop as a noise grows, of several designs under the same random numbers.
//!
//! # Two designs at three levels
//!
//! ```
//! use supple_study::robustness::{DesignChoice, PlannedFor, RobustnessOptions, RobustnessUnits};
//! use supple_study::robustness::{combine, parts, run};
//! use supple_study::sweep::Axis;
//! use supple_study::{LoadedTask, Source, Stop, Watch};
//! # let text = r#"
//! #     model = { kind = "linear", A = [[1.0]], B = [[1.0]], C = [[1.0]] }
//! #     parameters.variance = { initial = 1e-2, bounds = [1e-4, 1.0] }
//! #     parameters.drive = { initial = 1e-3, bounds = [1e-5, 1e-1], role = "study" }
//! #     [[tasks]]
//! #     name = "hold"
//! #     steps = 20
//! #     time_step = 0.1
//! #     initial_state = [1.0]
//! #     noise = { initial = [1e-2], process = ["drive"], measurement = ["variance"] }
//! #     costs = [{ kind = "quadratic", Q = [[1.0]], R = [[1.0]] }]
//! # "#;
//! # let source = Source { path: "hold.toml".to_owned(), text: text.to_owned() };
//!
//! // The task of the front page with the process noise as the parameter `drive`.
//! let task = LoadedTask::restore(&[source])?;
//! let options = RobustnessOptions {
//!     designs: DesignChoice::parse_list("start,noisy=variance:0.1", &task)?,
//!     vary: Axis::parse("drive=log:1e-4:1e-2:3", &task)?,
//!     rollouts: 20,
//!     seed: 1,
//! };
//! let study = run(&task, &options, None, Watch::default())?;
//! assert_eq!((study.designs.len(), study.cells.len()), (2, 12));
//! assert_eq!(study.cells.iter().filter(|cell| cell.planned_for == PlannedFor::Truth).count(), 6);
//! assert!(study.comparisons[0].at_greatest.difference.is_finite());
//!
//! // The same by parts, which may run in different processes.
//! let (units, stop) = (RobustnessUnits::new(&task, &options, Vec::new())?, Stop::never());
//! let (designs, cells) = parts(&task, &options)?;
//! let designs = (0..designs).map(|design| units.design(&task, design, stop)).collect::<Result<Vec<_>, _>>()?;
//! let again = combine(&task, &options, designs, units.cells(&task, 0..cells, stop)?)?;
//! assert_eq!(again.cells, study.cells);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod cell;
mod choice;
mod comparison;
mod plan;
mod report;
mod statistics;
mod unit;

use std::fmt::Write;
use std::path::Path;

use supple::parameters::Role;

use crate::journal::{Identity, Parts};
use crate::{LoadedTask, StudyError, Watch};
pub use cell::Costs;
use cell::{cells, sample_all};
use plan::plan_all;
pub use report::{
    Comparison, DesignChoice, Paired, PlannedFor, RobustCell, RobustDesign, Robustness, RobustnessOptions,
};
pub use unit::{RobustnessUnits, combine, parts};

/// Makes a study of robustness.
///
/// Every design is planned on the cheapest local minimum that a search at the nominal parameters finds. Controllers
/// planned for the true noise are re-planned at every level in the same way. Cells computed before a
/// stop are kept; with a folder, a journal there stores them as well, and the same study resumes from it.
///
/// # Errors
/// Where a parameter is unknown, the varied one is the design's to choose or is set by a design, or a design cannot be
/// planned; if it is stopped before any cell was computed; where the journal cannot be written, is damaged, or belongs
/// to another study.
///
/// Example: the [module](crate::robustness).
pub fn run(
    task: &LoadedTask,
    options: &RobustnessOptions,
    folder: Option<&Path>,
    watch: Watch,
) -> Result<Robustness, StudyError> {
    let varied = check(task, options)?;
    let parts = Parts::open(folder, &identity(task, options, varied))?;
    let total = options.designs.len() + cells(task, options);
    watch.progress.begin("designs and levels", 0, total as u64);
    let planned = plan_all(task, &options.designs, &parts, watch)?;
    let (costs, done) = sample_all(task, &planned, options, varied, &parts, watch)?;
    if done == 0 {
        return Err(StudyError::Stopped);
    }
    let designs = planned.iter().map(|planned| planned.design(&task.problem)).collect();
    let stopped = done < costs.len();
    Ok(Robustness { stopped, ..assemble(task, options, varied, designs, costs) })
}

/// What a study of robustness is.
fn identity(task: &LoadedTask, options: &RobustnessOptions, varied: usize) -> Identity {
    let RobustnessOptions { designs, vary, rollouts, seed } = options;
    let mut text = String::new();
    for design in designs {
        let _ = write!(text, "design {}", design.name());
        if let DesignChoice::Named(_, values) = design {
            for (name, value) in values {
                let _ = write!(text, ", {name} = {value:?}");
            }
        }
        text.push('\n');
    }
    let _ = writeln!(text, "vary {} = {:?}\nrollouts {rollouts}\nseed {seed}", vary.parameter, vary.values);
    // The noise that controllers are planned for is not set by the options.
    let _ = writeln!(text, "planned for {} = {:?}", vary.parameter, task.phi[varied]);
    Identity::of("study of robustness", task, &text, &[varied])
}

/// The result of designs and cells, in their order.
fn assemble(
    task: &LoadedTask,
    options: &RobustnessOptions,
    varied: usize,
    designs: Vec<RobustDesign>,
    costs: Vec<Costs>,
) -> Robustness {
    let comparisons = comparison::compare(task, options, &costs);
    Robustness {
        options: options.clone(),
        nominal: task.phi[varied],
        designs,
        cells: costs.into_iter().map(|Costs { cell, .. }| cell).collect(),
        comparisons,
        stopped: false,
    }
}

/// Checks what was asked for; the index of the varied parameter.
pub(crate) fn check(task: &LoadedTask, options: &RobustnessOptions) -> Result<usize, StudyError> {
    let RobustnessOptions { designs, vary, rollouts, .. } = options;
    let name = &vary.parameter;
    let parameters = &task.problem.parameters;
    let varied = parameters.index(name)?;
    let wrong = |message: String| Err(StudyError::Usage(message));
    if parameters.get(varied).role == Role::Design {
        let others = parameters.iter().filter(|one| one.role == Role::Study).map(|one| one.name.as_str());
        let others: Vec<&str> = others.collect();
        let valid = match others.is_empty() {
            true => "the task has none: declare one, such as the variance of a noise".to_owned(),
            false => supple_text::quoted(&others),
        };
        return wrong(format!(
            "`{name}` is a design parameter and differs between designs; vary a parameter with role = \"study\" ({valid})"
        ));
    }
    let mut phi = task.phi.clone();
    vary.values.iter().try_for_each(|&value| parameters.set(&mut phi, name, value))?;
    if vary.values.len() < 2 {
        return wrong(format!("`{name}` has {} value; at least two are required", vary.values.len()));
    }
    supple::check_rollouts(*rollouts)?;
    if *rollouts < 2 {
        return wrong(format!(
            "at least 2 roll-outs are required to estimate the variance of the cost; found {rollouts}"
        ));
    }
    if designs.is_empty() {
        return wrong(choice::FORMS.to_owned());
    }
    for design in designs {
        if let DesignChoice::Named(design, values) = design
            && values.iter().any(|(parameter, _)| parameter == name)
        {
            return wrong(format!("the design `{design}` sets `{name}`, which is the parameter that is varied"));
        }
    }
    Ok(varied)
}
