//! Designs for the information needed, used and measured: what docs/paper.md says of them.
#![allow(clippy::unwrap_used, missing_docs)]

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use supple::aims::weighted_information;
use supple::design::InformationWeights;
use supple::design::{DesignSettings, DesignStatus, best_plan};
use supple::pipeline::TaskState;
use supple::{Evaluation, Verdict};
use supple_study::design::DesignReport;
use supple_study::{LoadedTask, Silent, Watch};

fn repository(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(path)
}

fn task(name: &str) -> LoadedTask {
    LoadedTask::load(&repository("tasks").join(name), &[]).unwrap()
}

fn designed(task: &LoadedTask, kind: &str, starts: usize) -> DesignReport {
    designed_with(task, kind, (starts, task.problem.design.seed))
}

fn designed_with(task: &LoadedTask, kind: &str, (starts, seed): (usize, u64)) -> DesignReport {
    let information = InformationWeights::of_kind(kind).unwrap();
    let settings = DesignSettings { information, starts, seed, ..task.problem.design.clone() };
    let watch = Watch { progress: &Silent, stop: &AtomicBool::new(false) };
    supple_study::design::run(task, &settings, None, watch).unwrap()
}

fn row(name: &str, at: &Evaluation, parameters: &[(&str, usize)]) -> String {
    let values = parameters.iter().map(|&(name, digits)| format!("{:.digits$}", at.parameters.get(name).unwrap()));
    let [of] = &at.tasks[..] else { panic!() };
    let (needed, used) = (of.information.needed.as_ref().unwrap(), of.information.control.as_ref().unwrap());
    format!(
        "| {name} | {} | {:.2} | {:.1} | {:.1} | {:.1} | {:.1} |",
        values.collect::<Vec<_>>().join(" | "),
        needed.total_bits,
        used.total_bits,
        of.information.total_bits,
        of.cost.expected,
        of.monte_carlo.as_ref().unwrap().cost_mean,
    )
}

fn assert_designs(name: &str, starts: usize, parameters: &[(&str, usize)]) {
    let task = task(name);
    let page = std::fs::read_to_string(repository("docs/paper.md")).unwrap();
    let kinds = ["needed", "used", "measured"];
    let reports = kinds.map(|kind| designed(&task, kind, starts));
    let mut rows = vec![row("start", &reports[0].start, parameters)];
    for (kind, report) in kinds.iter().zip(&reports) {
        assert_eq!(report.status, DesignStatus::Converged, "{name}, {kind}");
        assert_eq!(report.optimum.tasks[0].trust.as_ref().unwrap().verdict, Verdict::Holds, "{name}, {kind}");
        for split in &report.split {
            let parts = split.sensors_bits + split.uncertainty_bits + split.plan_bits + split.leaps_bits;
            assert!((parts - split.total_bits).abs() <= 1e-9 * split.total_bits.abs().max(1.0));
        }
        rows.push(row(&format!("least {kind}"), &report.optimum, parameters));
    }
    assert!(page.contains(&rows.join("\n")), "docs/paper.md lacks\n{}", rows.join("\n"));
    // Each is the least of its own kind.
    let of = |report: &DesignReport, kind: &str| {
        report.optimum.tasks[0].information.weighted_nats(InformationWeights::of_kind(kind).unwrap())
    };
    for (kind, own) in kinds.iter().zip(&reports) {
        assert!(reports.iter().all(|other| of(own, kind) <= of(other, kind) + 1e-6), "{name}, {kind}");
    }
}

#[test]
fn designs_of_two_masses_for_the_three_are_as_shown() {
    assert_designs("two_mass_unsure.toml", 4, &[("k1", 1), ("k2", 1)]);
}

#[test]
fn designs_of_a_wiping_arm_for_the_three_are_as_shown() {
    assert_designs("wiping_arm.toml", 2, &[("k", 2), ("d", 2), ("rest", 3)]);
}

/// All of ten starts find one optimum, for seeds whose branch searches miss the best plan at up to three of them, and no point
/// of a grid of 20 x 20 that keeps the bound is below it.
#[test]
fn the_least_needed_is_one_and_below_a_grid() {
    let task = task("two_mass_unsure.toml");
    let report = designed(&task, "needed", 10);
    assert_eq!(report.agreement(), (10, 0));
    for seed in [11, 18, 39] {
        let other = designed_with(&task, "needed", (10, seed));
        assert_eq!(other.agreement(), (10, 0), "seed {seed}");
        for (name, value) in &other.optimum.parameters.0 {
            let found = report.optimum.parameters.get(name).unwrap();
            assert!((value / found - 1.0).abs() < 1e-9, "seed {seed}, {name}: {value} {found}");
        }
        let [own, of_other] = [&report, &other].map(|of| of.optimum.objective.information_nats);
        assert!((of_other / own - 1.0).abs() < 1e-4, "seed {seed}: {of_other} {own}");
    }
    let least = report.optimum.tasks[0].information.needed.as_ref().unwrap().total_nats;
    let problem = &task.problem;
    let weights = InformationWeights::of_kind("needed").unwrap();
    let (mut lowest, mut feasible) = (f64::INFINITY, 0);
    for place in 0..400 {
        let mut phi = task.phi.clone();
        for (name, share) in [("k1", place % 20), ("k2", place / 20)] {
            let index = problem.parameters.index(name).unwrap();
            let [low, high] = problem.parameters.get(index).bounds;
            phi[index] = low * (high / low).powf(share as f64 / 19.0);
        }
        let mut state = TaskState::new(&problem.tasks[0]);
        best_plan((problem, &problem.tasks[0]), &phi, None, &mut state).unwrap();
        if state.cost.expected() <= 240.0 {
            feasible += 1;
            let found = weighted_information((&problem.tasks[0], &phi), weights, &mut state, &mut Vec::new()).unwrap();
            lowest = lowest.min(found);
        }
    }
    assert!(feasible > 40 && least <= lowest + 1e-6, "{least} {lowest} {feasible}");
}
