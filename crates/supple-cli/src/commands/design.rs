use serde::Serialize;
use supple::design::{
    Control, Design, DesignSettings, DesignStatus, GradientKind, Method, StartSummary, design as search,
};
use supple::{EvaluateOptions, Evaluation, Named, Problem};

use crate::Outcome;
use crate::arguments::{DesignOptions, Loaded};
use crate::failure::Failure;
use crate::output::{check_writable, print_json, print_text, write_json};
use crate::progress::{Progress, STOP, listen};
use crate::tables::design_page;

/// What `supple design --json` prints.
#[derive(Debug, Serialize)]
pub struct DesignReport {
    pub status: DesignStatus,
    pub method: Method,
    pub gradient: GradientKind,
    pub seed: u64,
    /// The design that the first start began from.
    pub start: Evaluation,
    /// The best design.
    pub optimum: Evaluation,
    /// Which bounds are active there, by task.
    pub active_bounds: Vec<String>,
    /// Nats that a unit more of bound would save, by task.
    pub bound_prices: Vec<TaskPrice>,
    /// Different local minima of the plans seen at the best design.
    pub branches: usize,
    pub starts: Vec<StartReport>,
    pub evaluations: usize,
    pub seconds: f64,
}

#[derive(Debug, Serialize)]
pub struct TaskPrice {
    pub task: String,
    pub nats_per_unit: f64,
}

/// One start.
#[derive(Debug, Serialize)]
pub struct StartReport {
    pub status: DesignStatus,
    pub from: Named,
    pub to: Named,
    pub information_nats: f64,
    pub expected_costs: Vec<f64>,
    pub violation: f64,
    pub optimality: f64,
    pub branches: usize,
    pub evaluations: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error: Option<String>,
}

/// The file that `--out` writes.
const RESULT: &str = "result.json";

/// What `--out` writes: a result with all that made it.
#[derive(Serialize)]
struct ResultFile<'a> {
    supple: &'static str,
    command: &'static str,
    arguments: Vec<String>,
    task_file: String,
    task: String,
    seed: u64,
    settings: &'a DesignSettings,
    result: &'a DesignReport,
}

/// `supple design TASK`
pub fn design(options: &DesignOptions) -> Result<Outcome, Failure> {
    let Loaded { problem, phi, text } = options.task.load()?;
    let settings = settings(options, &problem)?;
    if problem.parameters.design().is_empty() {
        let task = options.task.task.display();
        return Err(Failure::usage(format!(
            "{task} has no parameter with role = \"design\": there is nothing to design"
        )));
    }
    if let Some(folder) = &options.out {
        check_writable(folder, RESULT)?;
    }
    listen();
    let progress = Progress::new();
    let found = search(&problem, &phi, &settings, Control { observer: &progress, stop: &STOP });
    progress.finish();
    let report = report(&problem, &phi, &settings, &found?)?;
    if let Some(folder) = &options.out {
        let file = ResultFile {
            supple: env!("CARGO_PKG_VERSION"),
            command: "design",
            arguments: std::env::args_os().skip(1).map(|word| word.to_string_lossy().into_owned()).collect(),
            task_file: options.task.task.display().to_string(),
            task: text,
            seed: settings.seed,
            settings: &settings,
            result: &report,
        };
        write_json(folder, RESULT, &file)?;
    }
    if options.json {
        print_json(&report)?;
    } else {
        print_text(&design_page(&problem, &report))?;
    }
    Ok(if report.status == DesignStatus::Converged { Outcome::Success } else { Outcome::Shortfall })
}

fn settings(options: &DesignOptions, problem: &Problem) -> Result<DesignSettings, Failure> {
    let mut settings = problem.design.clone();
    if let Some(method) = options.method {
        settings.method = method.into();
    }
    if let Some(gradient) = options.gradient {
        settings.gradient = gradient.into();
    }
    if let Some(starts) = options.starts {
        settings.starts = starts;
    }
    if let Some(seed) = options.seed {
        settings.seed = seed;
    }
    settings.check().map_err(|(key, message)| Failure::usage(format!("--{key}: {message}")))?;
    Ok(settings)
}

fn report(problem: &Problem, phi: &[f64], settings: &DesignSettings, found: &Design) -> Result<DesignReport, Failure> {
    let wanted = EvaluateOptions { total_gradient: true, seed: settings.seed, ..Default::default() };
    let start = problem.evaluate(phi, &wanted)?;
    let best = &found.starts[found.best];
    let controls = Some(best.controls.clone());
    let optimum = problem.evaluate(&best.to, &EvaluateOptions { controls, trajectories: true, ..wanted })?;
    let active = |(task, price): (&supple::Task, &f64)| (*price > 0.0).then(|| task.name.clone());
    let price = |(task, &nats_per_unit): (&supple::Task, &f64)| TaskPrice { task: task.name.clone(), nats_per_unit };
    Ok(DesignReport {
        status: found.status,
        method: settings.method,
        gradient: settings.gradient,
        seed: settings.seed,
        start,
        optimum,
        active_bounds: problem.tasks.iter().zip(&best.multipliers).filter_map(active).collect(),
        bound_prices: problem.tasks.iter().zip(&best.multipliers).map(price).collect(),
        branches: best.branches,
        starts: found.starts.iter().map(|summary| start_report(problem, summary)).collect(),
        evaluations: found.evaluations,
        seconds: found.seconds,
    })
}

fn start_report(problem: &Problem, summary: &StartSummary) -> StartReport {
    StartReport {
        status: summary.status,
        from: Named::new(&problem.parameters, &summary.from),
        to: Named::new(&problem.parameters, &summary.to),
        information_nats: summary.information,
        expected_costs: summary.costs.clone(),
        violation: summary.violation,
        optimality: summary.optimality,
        branches: summary.branches,
        evaluations: summary.evaluations,
        error: summary.error.as_ref().map(ToString::to_string),
    }
}
