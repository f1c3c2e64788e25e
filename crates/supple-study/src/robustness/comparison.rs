use super::cell::{Costs, extremes};
use super::report::{Comparison, DesignChoice, PlannedFor, RobustnessOptions};
use super::statistics::{mean_and_deviation, paired};
use crate::LoadedTask;

/// Compares the optimum, or else the last design, with every other one.
pub(super) fn compare(task: &LoadedTask, options: &RobustnessOptions, costs: &[Costs]) -> Vec<Comparison> {
    let RobustnessOptions { designs, vary, .. } = options;
    let tasks = task.problem.tasks.len();
    let levels = vary.values.len();
    let ends = extremes(&vary.values);
    let is_optimum = |choice: &DesignChoice| *choice == DesignChoice::Optimum;
    let design = designs.iter().position(is_optimum).unwrap_or(designs.len() - 1);
    let mut comparisons = Vec::new();
    for task in 0..tasks {
        for (number, planned_for) in [PlannedFor::Nominal, PlannedFor::Truth].into_iter().enumerate() {
            let at =
                |design: usize, level: usize| &costs[((design * tasks + task) * 2 + number) * levels + level].costs;
            let growth = |design: usize| less(at(design, ends[1]), at(design, ends[0]));
            for other in (0..designs.len()).filter(|&other| other != design) {
                let growths = [growth(design), growth(other)];
                comparisons.push(Comparison {
                    task,
                    planned_for,
                    design,
                    other,
                    levels: ends,
                    growth: paired(&less(&growths[0], &growths[1])),
                    growths: growths.map(|growth| mean_and_deviation(&growth).0),
                    at_greatest: paired(&less(at(design, ends[1]), at(other, ends[1]))),
                });
            }
        }
    }
    comparisons
}

/// Differences roll-out by roll-out; empty if one of the two could not be computed.
fn less(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a - b).collect()
}
