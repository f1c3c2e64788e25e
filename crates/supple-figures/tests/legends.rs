//! No legend has more entries than readers keep apart, whatever is drawn.
#![allow(clippy::unwrap_used, missing_docs)]

mod common;

use std::path::{Path, PathBuf};

use common::{bound, design, pareto, robustness, sweep, trace};
use supple::EvaluateOptions;
use supple::design::{GradientKind, Method};
use supple_figures::{Figure, Kind, MOST_ENTRIES, draw};
use supple_study::evaluate::EvaluateReport;
use supple_study::study::Work;
use supple_study::{Folder, LoadedTask, Made, StudyResult};

fn assert_short(figure: &Figure, what: &str) {
    let entries = figure.entries();
    assert!(entries.len() <= MOST_ENTRIES, "{what}: {entries:?}");
    // What has no entry of its own is named in the caption.
    assert_eq!(entries.contains(&"others"), figure.title.contains("in grey"), "{what}: {}", figure.title);
}

/// A task's evaluation, with trajectories.
fn evaluated(path: &Path) -> Folder {
    let task = LoadedTask::load(path).unwrap();
    let wanted = EvaluateOptions { trajectories: true, ..Default::default() };
    let evaluation = task.problem.evaluate(&task.phi, &wanted).unwrap();
    let result = StudyResult::Evaluate(Box::new(EvaluateReport { evaluation }));
    Folder { path: PathBuf::from("evaluated"), made: Made::of(&task, Work::Evaluate(Default::default())), result }
}

#[test]
fn figures_of_all_shipped_tasks_have_short_legends() {
    let tasks = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tasks");
    let (mut walked, mut grouped) = (0, 0);
    for entry in std::fs::read_dir(tasks).unwrap() {
        let path = entry.unwrap().path();
        let text = std::fs::read_to_string(&path).unwrap_or_default();
        if path.extension().is_none_or(|end| end != "toml") || !text.contains("[[tasks]]") {
            continue;
        }
        let folder = evaluated(&path);
        for kind in [Kind::Belief, Kind::Gains, Kind::Information] {
            for task in &folder.made.about.tasks {
                let figure = draw(kind, std::slice::from_ref(&folder), Some(&task.name)).unwrap();
                assert_short(&figure, &format!("{} of {}", kind.name(), path.display()));
                grouped += usize::from(figure.entries().contains(&"others"));
                walked += 1;
            }
        }
    }
    assert!(walked >= 30 && grouped > 0, "{walked} figures, {grouped} of them grouped");
}

#[test]
fn figures_of_many_results_have_short_legends() {
    let mut paths = trace();
    let StudyResult::Trace(found) = &mut paths.result else { panic!() };
    for (method, gradient) in [
        (Method::Barrier, GradientKind::Total),
        (Method::Barrier, GradientKind::Frozen),
        (Method::Cobyla, GradientKind::Total),
        (Method::Cobyla, GradientKind::Frozen),
    ] {
        let mut run = found.runs[0].clone();
        (run.method, run.gradient) = (method, gradient);
        found.runs.push(run);
    }
    let folders = [sweep(&["k1=20:120:6", "k2=10:50:5"]), design(), paths, pareto()];
    let landscape = draw(Kind::Landscape, &folders, None).unwrap();
    assert_short(&landscape, "landscape");
    let entries = landscape.entries();
    for name in ["cost at its limit, 25", "optimum", "initial design", "Pareto front", "start", "end", "others"] {
        assert!(entries.contains(&name), "{name}: {entries:?}");
    }

    let named = |index: usize, folder: Folder| Folder { path: PathBuf::from(format!("front_{index}")), ..folder };
    let fronts: Vec<Folder> = (0..10).map(|index| named(index, pareto())).collect();
    assert_short(&draw(Kind::Pareto, &fronts, None).unwrap(), "pareto");
    let curves: Vec<Folder> = (0..4).map(|index| named(index, bound())).collect();
    let drawn = draw(Kind::Bound, &curves, None).unwrap();
    assert_short(&drawn, "bound");
    assert!(
        (0..4).all(|index| drawn.entries().contains(&&*format!("minimum, front_{index}"))),
        "{:?}",
        drawn.entries()
    );

    let mut noises = robustness();
    let StudyResult::Robustness(study) = &mut noises.result else { panic!() };
    let (designs, cells) = (study.designs.clone(), study.cells.clone());
    for copy in 1..6 {
        for design in &designs {
            let name = format!("{} {copy}", design.name);
            study.designs.push(supple_study::robustness::RobustDesign { name, ..design.clone() });
        }
        study.cells.extend(cells.iter().map(|cell| supple_study::robustness::RobustCell {
            design: cell.design + copy * designs.len(),
            ..cell.clone()
        }));
    }
    assert_short(&draw(Kind::Robustness, &[noises], None).unwrap(), "robustness");
}
