use supple::parameters::{Parameter, Parameters};

use super::{Ends, ParetoPoint};
use crate::LoadedTask;

/// Where bounds become active along a front, where parameters reach an end of their range, and where the task's own
/// bounds lie.
pub(super) fn remarks(task: &LoadedTask, ends: &Ends, points: &[ParetoPoint]) -> Vec<String> {
    let mut remarks = vec![own_bounds(ends)];
    if points.len() == 1 {
        remarks.push("the design of least information is also the cheapest: the front is a single point".to_owned());
    }
    for (index, one) in task.problem.tasks.iter().enumerate().filter(|(_, one)| one.bound.is_some()) {
        let is_active = |point: &ParetoPoint| point.prices[index].is_nan() || point.prices[index] > 0.0;
        remarks.push(format!("the bound of {} is {}", one.name, places(points, "active", is_active)));
    }
    let parameters = &task.problem.parameters;
    for index in parameters.design() {
        let Parameter { name, unit, bounds, .. } = parameters.get(index);
        for (side, end) in ["lower", "upper"].into_iter().zip(bounds) {
            let is_there = |point: &ParetoPoint| is_at(parameters, point, index, *end);
            if points.iter().any(is_there) {
                let what = format!("at its {side} end, {end} {unit}").trim_end().to_owned();
                remarks.push(format!("{name} is {}", places(points, &what, is_there)));
            }
        }
    }
    remarks
}

/// Where factor 1 lies.
fn own_bounds(ends: &Ends) -> String {
    let Ends { tight_factor: tight, loose_factor: loose, .. } = ends;
    if *tight > 1.0 {
        format!("no design meets the cost limits in the task file; the smallest feasible factor is {tight:.6}")
    } else if *loose <= 1.0 {
        format!("the cost limits in the task file are not active; they become inactive at a factor of {loose:.6}")
    } else {
        format!("cost limits are active for factors from {tight:.6}, the smallest feasible factor, to {loose:.6}")
    }
}

fn is_at(parameters: &Parameters, point: &ParetoPoint, index: usize, end: f64) -> bool {
    parameters.get(index).is_at(end, point.parameters.0[index].1)
}

/// `what` with the factors where it holds.
fn places(points: &[ParetoPoint], what: &str, holds: impl Fn(&ParetoPoint) -> bool) -> String {
    let mut runs: Vec<[usize; 2]> = Vec::new();
    for (index, _) in points.iter().enumerate().filter(|(_, point)| holds(point)) {
        match runs.last_mut().filter(|run| run[1] + 1 == index) {
            Some(run) => run[1] = index,
            None => runs.push([index, index]),
        }
    }
    let run = |run: &[usize; 2]| match run.map(|index| points[index].factor) {
        [from, to] if from == to => format!("at factor {from:.6}"),
        [from, to] => format!("from factor {from:.6} to {to:.6}"),
    };
    match runs[..] {
        [] => format!("nowhere {what}"),
        [[0, to]] if to + 1 == points.len() => format!("{what} at all points"),
        _ => format!("{what} {}", runs.iter().map(run).collect::<Vec<_>>().join(", ")),
    }
}
