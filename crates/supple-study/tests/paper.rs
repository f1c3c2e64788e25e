//! The tables of docs/paper.md that come from studies are what the code gives.

#![allow(clippy::unwrap_used)]

use std::path::{Path, PathBuf};

use supple::EvaluateOptions;
use supple::Stop;
use supple_study::robustness::{DesignChoice, PlannedFor, RobustnessOptions, run};
use supple_study::sweep::Axis;
use supple_study::{LoadedTask, Silent, Watch};

fn repository(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(path)
}

fn assert_row(row: &str) {
    let page = std::fs::read_to_string(repository("docs/paper.md")).unwrap();
    let key: Vec<&str> = row.split('|').take(3).collect();
    let found = page.lines().find(|line| line.starts_with(&key[..2].join("|")));
    assert!(page.lines().any(|line| line == row), "docs/paper.md lacks\n{row}\nand has\n{found:?}");
}

/// Growth of cost by the noise at 2,000 roll-outs, and cost at the greatest noise in brackets.
#[test]
fn growth_of_cost_with_noise_is_as_shown() {
    let task = LoadedTask::load(&repository("tasks/two_mass.toml")).unwrap();
    let designs = "start,stiff=k1:600,k2:600,optimum,low=k1:60,k2:150,soft=k1:50,k2:100";
    for (what, vary) in [("wall", "wall_variance=1e-5,1e-2"), ("drive", "drive_variance=1e-4,1e-1")] {
        let options = RobustnessOptions {
            designs: DesignChoice::parse_list(designs, &task).unwrap(),
            vary: Axis::parse(vary, &task).unwrap(),
            rollouts: 2000,
            seed: 0,
        };
        let study = run(&task, &options, None, Watch { progress: &Silent, stop: Stop::never() }).unwrap();
        for (name, planned_for) in [("the task's noise", PlannedFor::Nominal), ("the actual noise", PlannedFor::Truth)]
        {
            let mean = |design: usize, level: usize| {
                let of = |cell: &&supple_study::robustness::RobustCell| {
                    (cell.design, cell.level, cell.planned_for) == (design, level, planned_for)
                };
                study.cells.iter().find(of).unwrap().mean
            };
            let entry = |design: usize| format!("{:.1} ({:.1})", mean(design, 1) - mean(design, 0), mean(design, 1));
            let entries: Vec<String> = (0..5).map(entry).collect();
            assert_row(&format!("| {what}, for {name} | {} |", entries.join(" | ")));
        }
        // Against every other design the difference is beyond doubt.
        assert_eq!(study.comparisons.len(), 8);
        assert!(study.comparisons.iter().all(|comparison| comparison.growth.p_value < 1e-12));
    }
}

/// How much the gains of the door's controllers change.
#[test]
fn variation_of_gains_is_as_shown() {
    let task = LoadedTask::load(&repository("tasks/iiwa_door.toml")).unwrap();
    for stiffness in [[1e6; 3], [1e4; 3], [1.0e3, 1.0e3, 1.1e3]] {
        let found = task.problem.evaluate(&stiffness, &EvaluateOptions::default()).unwrap();
        let entry = |task: &supple::TaskEvaluation| {
            format!(
                "{:.2} | {:.1e} | {:.2}",
                task.controller.feedback_variation,
                task.controller.feedback_variance,
                task.controller.feedforward_variation
            )
        };
        let [a, b, c] = stiffness.map(|k| if k == 1e4 || k == 1e6 { format!("{k:e}") } else { format!("{k:.1e}") });
        let entries: Vec<String> = found.tasks.iter().map(entry).collect();
        assert_row(&format!("| {a}, {b}, {c} | {} |", entries.join(" | ")));
    }
}
