//! Robustness: costs in closed loop under the same random numbers, and how designs compare.
#![allow(clippy::unwrap_used)]

use std::path::Path;
use std::sync::atomic::AtomicBool;

use supple::parameters::Scale;
use supple::{EvaluateOptions, Stop};
use supple_study::robustness::{Comparison, DesignChoice, PlannedFor, RobustCell, Robustness, RobustnessOptions, run};
use supple_study::sweep::Axis;
use supple_study::{LoadedTask, Silent, StudyError, Watch};

fn shipped() -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tasks/two_mass.toml");
    std::fs::read_to_string(path).unwrap()
}

fn load(text: &str) -> LoadedTask {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("task.toml");
    std::fs::write(&path, text).unwrap();
    LoadedTask::load(&path).unwrap()
}

fn study(task: &LoadedTask, designs: &str, vary: &str, rollouts: usize) -> Result<Robustness, StudyError> {
    let designs = DesignChoice::parse_list(designs, task)?;
    let vary = Axis::parse_as(vary, task, Scale::Log)?;
    let options = RobustnessOptions { designs, vary, rollouts, seed: 11 };
    run(task, &options, None, Watch::default())
}

/// The cell of the first task.
fn cell(found: &Robustness, design: usize, planned_for: PlannedFor, level: usize) -> &RobustCell {
    let is_it = |cell: &&RobustCell| (cell.design, cell.planned_for, cell.level) == (design, planned_for, level);
    found.cells.iter().find(is_it).unwrap()
}

/// The two masses with a mass that may be another than believed.
fn with_mass() -> LoadedTask {
    let text = shipped().replace("mass = [0.8, 0.4]", "mass = [\"m1\", 0.4]");
    let mass = "[parameters.m1]\ninitial = 0.8\nbounds = [0.001, 2.0]\nrole = \"study\"\n\n[parameters.k1]";
    load(&text.replacen("[parameters.k1]", mass, 1))
}

#[test]
fn expected_costs_are_means_of_sampled_ones_at_small_noise() {
    let text = shipped()
        .replace("initial = [1e-3, 1e-3, 1e-3, 1e-3,", "initial = [1e-7, 1e-7, 1e-7, 1e-7,")
        .replace(
            "process = [1e-7, \"drive_variance\", 1e-7, 1e-2, 0.0]",
            "process = [1e-9, \"drive_variance\", 1e-9, 1e-7, 0.0]",
        )
        .replace("initial = 5e-3", "initial = 1e-7")
        .replace("initial = 1e-4", "initial = 1e-7");
    let found = study(&load(&text), "start,low=k1:60,k2:150", "wall_variance=1e-8:1e-6:3", 2000).unwrap();
    assert_eq!(found.cells.len(), 2 * 2 * 3);
    for cell in found.cells.iter().filter(|cell| cell.planned_for == PlannedFor::Truth) {
        let error = cell.deviation / 2000f64.sqrt();
        let difference = cell.mean - cell.expected.unwrap();
        assert!(error > 0.0 && difference.abs() < 4.0 * error, "{difference} of {error}: {cell:?}");
        assert!(cell.quantiles.is_sorted() && cell.quantiles[0] < cell.mean && cell.mean < cell.quantiles[4]);
        assert!((cell.half_width_95 - 1.9612 * error).abs() < 1e-3 * error);
    }
}

/// Local minima do not depend on the noise, so they are searched for once; which is the cheapest is found at every level, as
/// by a search there.
#[test]
fn levels_of_noise_are_planned_on_their_cheapest_branch() {
    let task = load(&shipped());
    let (levels, designs) = ([1e-6, 1e-4, 1e-2], [500.0, 60.0, 50.0]);
    let list = "start,low=k1:60,k2:150,soft=k1:50,k2:100";
    let found = study(&task, list, "wall_variance=1e-6,1e-4,1e-2", 2).unwrap();
    let (attempts, seed) = (task.problem.design.branch_attempts, task.problem.design.seed);
    assert!(attempts > 0);
    for (design, k1) in designs.into_iter().enumerate() {
        assert_eq!(found.designs[design].parameters.get("k1"), Some(k1));
        for (level, variance) in levels.into_iter().enumerate() {
            let mut phi: Vec<f64> = found.designs[design].parameters.0.iter().map(|(_, value)| *value).collect();
            task.problem.parameters.set(&mut phi, "wall_variance", variance).unwrap();
            let options = EvaluateOptions { branches: attempts, seed, ..EvaluateOptions::default() };
            let searched = task.problem.evaluate(&phi, &options).unwrap().tasks[0].cost.expected;
            let expected = cell(&found, design, PlannedFor::Truth, level).expected.unwrap();
            assert!((expected / searched - 1.0).abs() < 1e-9, "{design}, {variance}: {expected}, {searched}");
        }
    }
}

#[test]
fn all_designs_see_the_same_random_numbers() {
    let task = load(&shipped());
    let found = study(&task, "start,twin=k1:500,soft=k1:60", "wall_variance=1e-5,1e-3,1e-4", 40).unwrap();
    assert_eq!(found.nominal, 1e-4);
    for planned_for in [PlannedFor::Nominal, PlannedFor::Truth] {
        for level in 0..3 {
            let [start, twin, soft] = [0, 1, 2].map(|design| cell(&found, design, planned_for, level));
            assert_eq!((start.mean, start.quantiles), (twin.mean, twin.quantiles));
            assert_ne!(start.mean, soft.mean);
        }
        // At the nominal noise both plannings are the same.
        assert_eq!(cell(&found, 0, PlannedFor::Nominal, 2).mean, cell(&found, 0, PlannedFor::Truth, 2).mean);
    }
    // The last design is compared, between the least and the greatest level wherever they stand.
    let [first, second] = [&found.comparisons[0], &found.comparisons[1]];
    assert_eq!((first.design, first.other, second.other, first.levels), (2, 0, 1, [0, 1]));
    assert_eq!(first.growth, second.growth);
    let growth =
        |design| cell(&found, design, PlannedFor::Nominal, 1).mean - cell(&found, design, PlannedFor::Nominal, 0).mean;
    assert!((first.growth.difference - (growth(2) - growth(0))).abs() < 1e-9, "{first:?}");
    assert!((first.growths[0] - growth(2)).abs() < 1e-9 && first.growth.p_value > 0.0 && first.growth.p_value < 1.0);
    // In results, the numbers of the test are keys of the comparison, also where roll-outs diverged.
    let kept = serde_json::to_value(first).unwrap();
    assert_eq!((&kept["p_value"], kept.get("growth")), (&first.growth.p_value.into(), None));
    let mut diverged = first.clone();
    (diverged.growth.difference, diverged.growth.interval_95) = (f64::NAN, [f64::NAN; 2]);
    let read: Comparison = serde_json::from_str(&serde_json::to_string(&diverged).unwrap()).unwrap();
    assert!(read.growth.difference.is_nan() && read.growth.interval_95[1].is_nan());
    assert_eq!((read.growth.p_value, read.at_greatest), (first.growth.p_value, first.at_greatest));
    let same = study(&task, "twin=k1:500,start", "wall_variance=1e-5,1e-3", 5).unwrap();
    let same = &same.comparisons[0];
    assert_eq!((same.growth.difference, same.growth.p_value, same.at_greatest.p_value), (0.0, 1.0, 1.0));
}

/// Gains for a plant that settles, on one that does not: the task ends before numbers overflow.
#[test]
fn costs_that_run_away_count_as_diverged() {
    let task = load(
        "model = { kind = \"linear\", A = [[\"a\"]], B = [[1.0]], C = [[1.0]] }\n\
         parameters.a = { initial = 0.9, bounds = [0.1, 4.0], role = \"study\" }\n\
         [[tasks]]\nname = \"hold\"\nsteps = 60\ntime_step = 1.0\ninitial_state = [1.0]\n\
         noise = { initial = [1.0], process = [1.0], measurement = [1.0] }\n\
         costs = [{ kind = \"quadratic\", Q = [[1.0]], R = [[1.0]] }]\n",
    );
    let found = study(&task, "start", "a=0.9,3.0", 20).unwrap();
    let far = cell(&found, 0, PlannedFor::Nominal, 1);
    assert_eq!((far.diverged, far.error.as_deref()), (20, None));
    assert!(far.is_broken() && far.mean.is_nan() && found.cells.iter().filter(|cell| cell.is_broken()).count() == 1);
}

/// A controller that believes in the wrong mass is the dearer one, and what diverges is counted.
#[test]
fn the_model_may_be_another_than_believed() {
    let found = study(&with_mass(), "start", "m1=0.8,1.8,0.001", 8).unwrap();
    let [nominal, truth] =
        [PlannedFor::Nominal, PlannedFor::Truth].map(|planned| [0, 1, 2].map(|level| cell(&found, 0, planned, level)));
    assert_eq!(nominal[0].mean, truth[0].mean, "the believed mass is the true one");
    assert!(nominal[1].mean > truth[1].mean + 1.0, "{:?}, {:?}", nominal[1], truth[1]);
    assert_eq!((nominal[2].diverged, nominal[2].error.as_deref()), (8, None), "{:?}", nominal[2]);
    assert!(nominal[2].mean.is_nan() && nominal[2].quantiles == [f64::INFINITY; 5]);
    assert!(truth[2].error.is_some() && truth[2].mean.is_nan(), "no plan at this time step: {:?}", truth[2]);
    assert!(nominal[2].is_broken() && !nominal[0].is_broken() && !truth[2].is_missing());
    let text = serde_json::to_string(&found).unwrap();
    let again: Robustness = serde_json::from_str(&text).unwrap();
    assert_eq!(again.cells[2].diverged, 8, "what is kept is read again");
}

#[test]
fn the_optimum_is_that_of_the_search_and_threads_do_not_matter() {
    let task = load(&shipped());
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| study(&task, "optimum,start", "drive_variance=1e-4:1e-2:2", 6).unwrap())
    };
    let found = run(1);
    assert_eq!(found, run(5));
    assert!((found.designs[0].information_nats - 168.28594).abs() < 1e-4, "{:?}", found.designs[0]);
    assert!((found.designs[0].parameters.get("k1").unwrap() - 135.912).abs() < 1e-2);
    assert_eq!((found.comparisons[0].design, found.comparisons[0].other), (0, 1));
}

#[test]
fn designs_are_read_as_they_are_written() {
    let task = load(&shipped());
    let read = DesignChoice::parse_list("start, low=k1:50,k2 : 1e2 ,optimum,b=k2:600", &task).unwrap();
    let low = DesignChoice::Named("low".into(), vec![("k1".into(), 50.0), ("k2".into(), 100.0)]);
    let b = DesignChoice::Named("b".into(), vec![("k2".into(), 600.0)]);
    assert_eq!(read, [DesignChoice::Start, low, DesignChoice::Optimum, b]);
    for (text, message) in [
        ("", "a design is empty"),
        ("start,,optimum", "a design is empty"),
        ("best", "`best`: it is not a design"),
        ("k1:50", "it does not belong to a named design"),
        ("start,k1:50", "it does not belong to a named design"),
        ("low=", "write designs as"),
        ("low=50", "write designs as"),
        ("=k1:50", "the design has no name"),
        ("low=k1:soft", "the value `soft` is not a number"),
        ("low=k1:NaN", "outside [50, 600]"),
        ("low=k1:5", "parameter `k1` = 5 is outside [50, 600]"),
        ("low=k11:50", "no parameter `k11`"),
        ("low=k1:50,k1:60", "the design sets `k1` twice"),
        ("low=k1:50,low=k1:60", "there are two designs `low`"),
        ("start,start", "there are two designs `start`"),
        ("optimum=k1:50", "`optimum` is a reserved name"),
    ] {
        let error = DesignChoice::parse_list(text, &task).unwrap_err().to_string();
        assert!(error.contains(message), "{text}: {error}");
    }
}

#[test]
fn what_cannot_be_varied_is_an_error() {
    let task = load(&shipped());
    let error =
        |designs: &str, vary: &str, rollouts: usize| study(&task, designs, vary, rollouts).unwrap_err().to_string();
    assert!(error("start", "k1=100:200:2", 4).contains("`k1` is a design parameter"));
    assert!(
        error("a=wall_variance:1e-3", "wall_variance=1e-5,1e-4", 4).contains("the design `a` sets `wall_variance`")
    );
    assert!(error("start", "wall_variance=1e-5", 4).contains("at least two are required"));
    assert!(error("start", "wall_variance=1e-5,1e-4", 1).contains("at least 2 roll-outs are required"));
    let designs = DesignChoice::parse_list("start", &task).unwrap();
    let vary = Axis::parse_as("wall_variance=1e-5:1e-2:8", &task, Scale::Log).unwrap();
    let options = RobustnessOptions { designs, vary, rollouts: 4, seed: 0 };
    let flag = AtomicBool::new(true);
    let watch = Watch { progress: &Silent, stop: Stop::when(&flag) };
    assert!(matches!(run(&task, &options, None, watch), Err(StudyError::Stopped)));
}
