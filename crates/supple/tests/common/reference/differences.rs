use supple::Task;
use supple::gradient::Functional;
use supple::pipeline::TaskState;
use supple::plan::PlanSettings;

use super::relative_error;

/// The derivatives of several numbers along `direction`, by central differences with Richardson's extrapolation:
/// their error falls with the fourth power of `step`.
pub fn derivative(at: &[f64], direction: &[f64], step: f64, mut numbers: impl FnMut(&[f64]) -> Vec<f64>) -> Vec<f64> {
    let mut difference = |step: f64| -> Vec<f64> {
        let moved = |factor: f64| at.iter().zip(direction).map(|(x, d)| x + factor * d).collect::<Vec<_>>();
        let (above, below) = (numbers(&moved(step)), numbers(&moved(-step)));
        above.iter().zip(below).map(|(above, below)| (above - below) / (2.0 * step)).collect()
    };
    let (wide, narrow) = (difference(step), difference(0.5 * step));
    wide.iter().zip(narrow).map(|(wide, narrow)| (4.0 * narrow - wide) / 3.0).collect()
}

/// All derivatives of several numbers: one list per number, one entry per variable. `steps` holds one per variable.
pub fn gradients(at: &[f64], steps: &[f64], mut numbers: impl FnMut(&[f64]) -> Vec<f64>) -> Vec<Vec<f64>> {
    let columns: Vec<Vec<f64>> = (0..at.len())
        .map(|variable| {
            let mut direction = vec![0.0; at.len()];
            direction[variable] = 1.0;
            derivative(at, &direction, steps[variable], &mut numbers)
        })
        .collect();
    (0..columns[0].len()).map(|number| columns.iter().map(|column| column[number]).collect()).collect()
}

/// What total gradients are taken of, beside the nominal cost.
pub const FUNCTIONALS: [(&str, Functional); 4] = [
    ("belief cost", Functional::BELIEF),
    ("process cost", Functional::PROCESS),
    ("initial cost", Functional::INITIAL),
    ("information", Functional::INFORMATION),
];

/// The numbers of [`FUNCTIONALS`], and the nominal cost.
pub fn numbers(state: &TaskState) -> Vec<f64> {
    let cost = state.cost;
    vec![cost.belief, cost.process, cost.initial, state.information.total, cost.nominal]
}

/// Plans as well as rounding lets, so that differences over small steps mean something.
pub fn tight() -> PlanSettings {
    PlanSettings { tolerance: 1e-13, ..PlanSettings::default() }
}

/// Errors of the total gradients against differences of the task solved anew, each relative to its gradient; with
/// their names. The entries of a gradient count per `scales`, a typical size of each parameter.
pub fn total_gradient_errors(
    task: &Task,
    state: &mut TaskState,
    phi: &[f64],
    scales: &[f64],
) -> Vec<(&'static str, f64)> {
    let settings = tight();
    let controls = state.plan.trajectory.controls.clone();
    let mut again = TaskState::new(task);
    let steps: Vec<f64> = scales.iter().map(|scale| 1e-5 * scale).collect();
    let expected = gradients(phi, &steps, |phi| {
        again.evaluate(task, phi, &settings, Some(&controls)).unwrap();
        assert!(again.plan.status.is_converged(), "{}", again.plan.status);
        numbers(&again)
    });
    let scaled = |gradient: &[f64]| gradient.iter().zip(scales).map(|(g, scale)| g * scale).collect::<Vec<_>>();
    let mut found = Vec::new();
    let mut errors = Vec::new();
    for ((name, functional), expected) in FUNCTIONALS.into_iter().zip(&expected) {
        state.total_gradient(task, phi, functional, &mut found).unwrap();
        errors.push((name, relative_error(&scaled(&found), &scaled(expected))));
    }
    state.nominal_gradient(task, phi, &mut found).unwrap();
    errors.push(("nominal cost", relative_error(&scaled(&found), &scaled(&expected[FUNCTIONALS.len()]))));
    errors
}
