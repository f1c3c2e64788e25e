//! The page, of results that are computed here, and of ones that are made up where only their text matters.
#![allow(clippy::unwrap_used)]

use std::io::Read;
use std::path::{Path, PathBuf};

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flate2::read::GzDecoder;
use supple::design::{DesignSettings, DesignStatus, GradientKind, Method};
use supple::parameters::Scale;
use supple::{EvaluateOptions, Named};
use supple_report::{ReportError, page};
use supple_study::bound::BoundOptions;
use supple_study::evaluate::EvaluateReport;
use supple_study::pareto::{Pareto, ParetoOptions, ParetoPoint, RangeEnd, Remark};
use supple_study::sensors::SensorsOptions;
use supple_study::study::Work;
use supple_study::sweep::{Axis, Sweep, SweepOptions};
use supple_study::trace::{Trace, TraceOptions, TracePoint, TraceRun};
use supple_study::{Cell, Column, Folder, LoadedTask, Made, Source, Steps, StudyResult, Table, Watch};

fn task(name: &str) -> LoadedTask {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tasks").join(name);
    LoadedTask::load(&path).unwrap()
}

fn folder(name: &str, task: &LoadedTask, result: StudyResult) -> Folder {
    Folder {
        path: PathBuf::from("results").join(name),
        made: Made::of(task, Work::Evaluate(Default::default())),
        result,
    }
}

fn design(task: &LoadedTask, starts: usize, evaluations: usize) -> StudyResult {
    let settings = DesignSettings { starts, max_evaluations: evaluations, ..task.problem.design.clone() };
    let watch = Watch::default();
    StudyResult::Design(Box::new(supple_study::design::run(task, &settings, None, watch).unwrap()))
}

fn evaluation(task: &LoadedTask, phi: &[f64]) -> StudyResult {
    let options = EvaluateOptions { trajectories: true, total_gradient: true, ..Default::default() };
    StudyResult::Evaluate(Box::new(EvaluateReport { evaluation: task.problem.evaluate(phi, &options).unwrap() }))
}

/// Made-up landscape over the first two parameters.
fn sweep(task: &LoadedTask, count: usize) -> StudyResult {
    let axes: Vec<Axis> = (0..2)
        .map(|index| {
            let parameter = task.problem.parameters.get(index);
            let [least, most] = parameter.bounds;
            let value = |i: usize| least * (most / least).powf(i as f64 / (count - 1) as f64);
            let values = (0..count).map(value).collect();
            Axis { parameter: parameter.name.clone(), unit: parameter.unit.clone(), scale: Scale::Log, values }
        })
        .collect();
    let mut names: Vec<String> = axes.iter().map(|axis| axis.parameter.clone()).collect();
    names.push("information_nats".into());
    names.extend(task.tasks().iter().map(|task| format!("{task}.expected_cost")));
    let column = |name: &String| Column { name: name.clone(), unit: String::new(), description: String::new() };
    let columns: Vec<Column> = names.iter().map(column).collect();
    let mut table = Table { columns: columns.clone(), rows: Vec::new() };
    for (i, a) in axes[0].values.iter().enumerate() {
        for (j, b) in axes[1].values.iter().enumerate() {
            let mut row = vec![Cell::Number(*a), Cell::Number(*b), Cell::Number((i as f64 * 0.1).sin() + j as f64)];
            row.extend(task.problem.tasks.iter().map(|_| Cell::Number(80.0 + 200.0 * ((i + j) as f64 / 50.0).cos())));
            table.rows.push(row);
        }
    }
    let options = SweepOptions { axes, rollouts: 0, starts: 0, branches: 0, seed: 0 };
    StudyResult::Sweep(Box::new(Sweep { options, columns, table, complete: true }))
}

fn point(task: &LoadedTask, nats: f64) -> TracePoint {
    let parameters = Named::new(&task.problem.parameters, &task.phi);
    TracePoint { parameters, information_nats: nats, costs: vec![200.0; task.problem.tasks.len()] }
}

fn trace(task: &LoadedTask) -> StudyResult {
    let options = TraceOptions { starts: 1, methods: vec![Method::Sqp], gradients: vec![GradientKind::Total], seed: 0 };
    let run = TraceRun {
        method: Method::Sqp,
        gradient: GradientKind::Total,
        start: 0,
        status: DesignStatus::NotConverged,
        path: vec![point(task, 300.0), point(task, f64::NAN), point(task, 200.0)],
        steps: vec![0, 1, 2],
        end: point(task, 200.0),
        error: Some("no step".into()),
    };
    StudyResult::Trace(Box::new(Trace { options, runs: vec![run], stopped: false }))
}

fn front(task: &LoadedTask) -> StudyResult {
    let at = |factor: f64| ParetoPoint {
        factor,
        bounds: vec![250.0 * factor],
        status: DesignStatus::Converged,
        parameters: Named::new(&task.problem.parameters, &task.phi),
        information_nats: 200.0 / factor,
        task_nats: vec![200.0 / factor],
        costs: vec![250.0 * factor],
        prices: vec![1.0],
        price: None,
        at_ends: Vec::new(),
        warnings: Vec::new(),
        trust: Vec::new(),
    };
    let points = vec![at(0.9), at(1.0), at(1.2)];
    let options = ParetoOptions { points: 3, starts: 1, seed: 0 };
    let remarks = vec!["the bound is active <all along>".to_owned().into()];
    let information = supple::design::InformationWeights::MEASURED;
    StudyResult::Pareto(Box::new(Pareto { options, information, bounds: vec![250.0], points, remarks, stopped: false }))
}

fn bound(task: &LoadedTask) -> StudyResult {
    let options = BoundOptions { curve: Some(4), ..Default::default() };
    let watch = Watch::default();
    StudyResult::Bound(Box::new(supple_study::bound::run(task, &options, watch).unwrap()))
}

fn sensors(task: &LoadedTask) -> StudyResult {
    let options = SensorsOptions { count: Some(1), ..Default::default() };
    let watch = Watch::default();
    StudyResult::Sensors(Box::new(supple_study::sensors::run(task, &options, watch).unwrap()))
}

/// A shipped task, its two springs from a catalogue.
fn with_catalogue(name: &str) -> LoadedTask {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tasks").join(name);
    let text = std::fs::read_to_string(&path).unwrap();
    let [first, second] = ["initial = 60.0\n", "initial = 30.0\n"];
    let text = text
        .replace(first, &format!("{first}catalogue = [{{ value = 30.0, price = 2.0, name = \"S30\" }}, 90.0]\n"))
        .replace(second, &format!("{second}catalogue = [20.0, 40.0]\n"));
    LoadedTask::restore(&[Source { path: path.display().to_string(), text }]).unwrap()
}

#[test]
fn what_was_chosen_from_catalogues_and_of_sensors_is_told() {
    let task = with_catalogue("two_mass_small.toml");
    let text = text(
        &page(&[folder("design", &task, design(&task, 1, 20)), folder("sensors", &task, sensors(&task))]).unwrap(),
    );
    for told in ["Chosen from catalogues", "S30", "4 of 4 combinations were designed", "What each sensor is worth"] {
        assert!(text.contains(told), "nothing of `{told}`");
    }
    assert!(text.contains("A search of all sets proves its set to be the best one."));
    assert_eq!(text.matches("<td>chosen</td>").count(), 1, "one sensor is chosen");
}

/// The text of a page without its scripts and styles.
fn text(page: &str) -> String {
    let mut text = String::new();
    let mut rest = page;
    while let Some(at) = rest.find("<script").into_iter().chain(rest.find("<style")).min() {
        text += &rest[..at];
        let end = if rest[at..].starts_with("<script") { "</script>" } else { "</style>" };
        rest = rest[at..].split_once(end).unwrap().1;
    }
    text + rest
}

#[test]
fn a_page_has_a_section_for_all_that_there_is_and_needs_no_network() {
    let task = task("two_mass_small.toml");
    let folders = [
        folder("design", &task, design(&task, 1, 20)),
        folder("sweep", &task, sweep(&task, 8)),
        folder("trace", &task, trace(&task)),
        folder("front", &task, front(&task)),
        folder("bound", &task, bound(&task)),
    ];
    let all = page(&folders).unwrap();
    let text = text(&all);
    for id in [
        "answer",
        "landscape",
        "motion",
        "trajectories",
        "information",
        "controller",
        "pareto",
        "bound",
        "sensitivities",
        "convergence",
        "origin",
    ] {
        assert!(text.contains(&format!("<section aria-labelledby=\"{id}\">")), "no section {id}");
        assert!(text.contains(&format!("href=\"#{id}\"")), "no link to {id}");
    }
    assert!(!text.contains("aria-labelledby=\"robustness\""));
    assert!(text.contains("the bound is active &lt;all along&gt;"));
    assert!(text.contains("ended early: no step."));
    for outside in ["src=", "href=\"http", "url(", "@import", "<link"] {
        assert!(!text.contains(outside), "{outside}");
    }
    assert_eq!(all, page(&folders).unwrap(), "the same results give the same page");
}

#[test]
fn prices_and_the_budget_are_told() {
    let task = task("two_mass_sensors.toml");
    let result = design(&task, 1, 100);
    let StudyResult::Design(report) = &result else { panic!() };
    assert!(report.optimum.price.as_ref().unwrap().total < 1.0);
    let folders = |result: &StudyResult| {
        [folder("design", &task, result.clone()), folder("a", &task, evaluation(&task, &task.phi))]
    };
    let told = text(&page(&folders(&result)).unwrap());
    assert!(told.contains("The price falls from 100 to 0.09"), "{told}");
    assert!(told.contains("; the budget is 200. A unit of price counts as 2.885"), "{told}");
    assert!(told.contains("<th scope=\"col\" class=\"number\">price</th>"), "designs that no search found have prices");

    let mut dear = result.clone();
    let StudyResult::Design(report) = &mut dear else { panic!() };
    report.budget_nats_per_unit = 0.5 * std::f64::consts::LN_2;
    assert!(text(&page(&folders(&dear)).unwrap()).contains("exhausted: +1 in budget saves 0.5 bits"));
    let StudyResult::Design(report) = &mut dear else { panic!() };
    report.optimum.price.as_mut().unwrap().total = 201.0;
    assert!(text(&page(&folders(&dear)).unwrap()).contains("this exceeds the budget of 200"));
}

#[test]
fn whatever_files_hold_is_shown_as_text() {
    let task = task("two_mass_small.toml");
    let mut folder = folder("</title><i>", &task, design(&task, 1, 3));
    let hostile = "</script><b>bold</b>";
    folder.made.about.title = hostile.into();
    folder.made.about.tasks[0].name = hostile.into();
    folder.made.sources[0].text = format!("title = '{hostile}'");
    folder.made.study.as_mut().unwrap().task = hostile.into();
    let StudyResult::Design(report) = &mut folder.result else { panic!() };
    for at in [&mut report.start, &mut report.optimum] {
        at.tasks[0].name = hostile.into();
        at.tasks[0].trajectory.as_mut().unwrap().state_names[0] = hostile.into();
    }
    let page = page(&[folder]).unwrap();
    assert!(!page.contains("<b>") && !page.contains("<i>"));
    assert!(text(&page).contains("&lt;/script&gt;&lt;b&gt;bold&lt;/b&gt;"));
    let scripts = page.matches("<script").count();
    assert_eq!(scripts, page.matches("</script>").count());
}

#[test]
fn the_answer_is_true_for_every_status() {
    let task = task("two_mass_small.toml");
    let result = design(&task, 1, 20);
    for (status, says, never) in [
        (DesignStatus::NotConverged, "The search did not converge", "Optimum:"),
        (DesignStatus::NotOptimal, "this is not an optimum", "Optimum:"),
        (DesignStatus::Stopped, "The search was stopped", "Optimum:"),
        (DesignStatus::BoundViolated, "No design within all cost limits", "Optimum:"),
        (DesignStatus::Converged, "Optimum:", "did not converge"),
    ] {
        let mut folder = folder("design", &task, result.clone());
        let StudyResult::Design(report) = &mut folder.result else { panic!() };
        report.status = status;
        if status == DesignStatus::BoundViolated {
            report.bound_prices[0].nats_per_unit = 0.0;
            report.optimum.tasks[0].cost.expected = 1.1 * report.optimum.tasks[0].cost.bound.unwrap();
        }
        let text = text(&page(&[folder]).unwrap());
        assert!(text.contains(says) && !text.contains(never), "{status}");
        assert_eq!(text.contains("this exceeds its cost limit"), status == DesignStatus::BoundViolated, "{status}");
    }
}

#[test]
fn a_task_without_bound_and_a_plan_that_did_not_converge_are_told() {
    let task = task("two_mass_small.toml");
    let mut folder = folder("design", &task, design(&task, 1, 3));
    let StudyResult::Design(report) = &mut folder.result else { panic!() };
    for at in [&mut report.start, &mut report.optimum] {
        at.tasks[0].cost.bound = None;
        at.tasks[0].status = supple::plan::PlanStatus::MaxIterations;
    }
    folder.made.about.tasks[0].bound = None;
    let text = text(&page(&[folder]).unwrap());
    assert!(text.contains("no cost limit") && text.contains("it has no cost limit"));
    assert!(text.contains("reached the maximum number of iterations"));
}

/// The page of an evaluation said that its cost limit was met, and nothing of roll-outs that contradict the prediction.
#[test]
fn roll_outs_that_contradict_an_evaluation_are_told() {
    let task = task("two_mass_small.toml");
    let options = EvaluateOptions { rollouts: 64, ..Default::default() };
    let mut evaluation = task.problem.evaluate(&task.phi, &options).unwrap();
    let trust = evaluation.tasks[0].trust.as_mut().unwrap();
    (trust.verdict, trust.reasons) = (supple::Verdict::Broken, vec!["32 of 64 diverge".to_owned()]);
    let says = format!("Roll-outs of press in kept: {trust}");
    assert!(says.contains("broken"), "{says}");
    let sampled = evaluation.tasks[0].monte_carlo.as_ref().unwrap().cost_mean;
    let result = StudyResult::Evaluate(Box::new(EvaluateReport { evaluation }));
    let text = text(&page(&[folder("kept", &task, result)]).unwrap());
    assert!(text.contains(&says) && text.contains("Evaluated designs") && !text.contains("Other designs"), "{says}");
    let shown = format!("{sampled:.2}");
    assert!(text.contains("sampled cost of press") && text.contains(&shown), "{shown}");
}

#[test]
fn results_of_one_task_belong_together_and_others_get_their_own_part() {
    let (small, large) = (task("two_mass_small.toml"), task("two_mass.toml"));
    let folders = [
        folder("a", &small, evaluation(&small, &small.phi)),
        folder("b", &large, evaluation(&large, &large.phi)),
        folder("c", &small, sweep(&small, 4)),
    ];
    let text = text(&page(&folders).unwrap());
    assert!(text.contains("id=\"part-1\"") && text.contains("id=\"part-2\"") && !text.contains("id=\"part-3\""));
    assert!(text.contains("id=\"part-1-landscape\"") && !text.contains("id=\"part-2-landscape\""));
    let levels: Vec<u8> = text
        .match_indices("<h")
        .filter_map(|(at, _)| text.as_bytes().get(at + 2).filter(|byte| byte.is_ascii_digit()).map(|byte| byte - b'0'))
        .collect();
    assert!(levels[0] == 1 && levels.windows(2).all(|pair| pair[1] <= pair[0] + 1), "{levels:?}");
}

#[test]
fn without_results_there_is_no_page() {
    let nothing = page(&[]).unwrap_err();
    assert!(matches!(nothing, ReportError::Nothing(_)));
    let task = task("two_mass_small.toml");
    let study = StudyResult::Study(Box::new(Steps { steps: Vec::new(), figures: Vec::new() }));
    let mut study = folder("study", &task, study);
    study.made.about.title = "A study".into();
    assert!(page(&[study.clone()]).is_err());
    let titled = page(&[study, folder("a", &task, evaluation(&task, &task.phi))]).unwrap();
    assert!(text(&titled).contains("<title>A study</title>"));
}

#[test]
fn the_largest_page_is_below_six_megabytes() {
    let task = task("iiwa_door.toml");
    let mut middle = task.phi.clone();
    middle[0] = 9e5;
    let folders = [
        folder("design", &task, design(&task, 1, 2)),
        folder("middle", &task, evaluation(&task, &middle)),
        folder("landscape", &task, sweep(&task, 100)),
    ];
    let size = page(&folders).unwrap().len();
    assert!((2_000_000..6_000_000).contains(&size), "{size}");
}

/// The plots of a page, unpacked.
fn plots(page: &str) -> String {
    let is_packed = |piece: &&str| piece.len() > 100 && piece.starts_with("H4sI");
    let unpacked =
        page.split(|c: char| !c.is_ascii_alphanumeric() && !"+/=".contains(c)).filter(is_packed).map(|piece| {
            let mut text = String::new();
            GzDecoder::new(&STANDARD.decode(piece).unwrap()[..]).read_to_string(&mut text).unwrap();
            text
        });
    unpacked.filter(|text| text.contains("\"plots\"")).collect()
}

/// The closed loop of a design may diverge; the rest is shown all the same.
#[test]
fn a_run_that_ended_early_is_shown_as_far_as_it_came() {
    let task = task("two_mass_small.toml");
    let mut at = folder("a", &task, evaluation(&task, &task.phi));
    let StudyResult::Evaluate(report) = &mut at.result else { panic!() };
    let sample = &mut report.evaluation.tasks[0].trajectory.as_mut().unwrap().sample;
    for rows in [&mut sample.states, &mut sample.estimates, &mut sample.deviations, &mut sample.controls] {
        rows.truncate(7);
    }
    // Just before, as numbers grow.
    sample.states[6][0] = -1e27;
    sample.cost = f64::INFINITY;
    *report = serde_json::from_str(&serde_json::to_string(report).unwrap()).unwrap();
    let page = page(&[at]).unwrap();
    assert!(plots(&page).contains("(clipped: a run reaches −1e27)"), "the plan cannot be read beside that");
    let calm = self::page(&[folder("a", &task, evaluation(&task, &task.phi))]).unwrap();
    assert!(!plots(&calm).contains("(clipped"));
}

#[test]
fn units_are_printed_alike_in_tables_texts_and_plots() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tasks/two_mass_small.toml");
    let written = std::fs::read_to_string(&path).unwrap().replacen("unit = \"N/m\"", "unit = \"(N m)^2\"", 1);
    let written = written.replace("unit = \"N/m\"", "unit = \"kg m^2/s^2\"");
    let task = LoadedTask::restore(&[Source { path: path.display().to_string(), text: written }]).unwrap();
    let StudyResult::Pareto(mut front) = front(&task) else { panic!() };
    // The unit is that of the parameter, whatever the text has in its place.
    let end = RangeEnd { parameter: "k2".into(), side: "upper".into(), value: 50.0, places: "at factor 1.2".into() };
    front.remarks.push(Remark { text: "k2 is at its upper end".into(), end: Some(end) });
    let folders = [
        folder("design", &task, design(&task, 1, 5)),
        folder("sweep", &task, sweep(&task, 4)),
        folder("front", &task, StudyResult::Pareto(front)),
        folder("bound", &task, bound(&task)),
    ];
    let page = page(&folders).unwrap();
    let (text, plots) = (text(&page), plots(&page));
    // But for the task file itself, which is shown as it is written.
    let behind = |piece: &str| piece.split_once("</pre>").map_or(piece, |(_, behind)| behind).to_owned();
    let text: String = text.split("<pre").map(behind).collect();
    for shown in
        ["<td>(N·m)²</td>", "<td>kg·m²/s²</td>", "k2 is at its upper end, 50 kg·m²/s² at factor 1.2", "k1, (N·m)²"]
    {
        assert!(text.contains(shown), "no {shown}");
    }
    for shown in ["k1, (N·m)²", "k2, kg·m²/s²"] {
        assert!(plots.contains(shown), "no {shown} in plots");
    }
    for (place, all) in [("text", &text), ("plots", &plots)] {
        for unit in ["N m", "kg m", "m^2", "s^2"] {
            let found = all.find(unit).map(|at| all[at.saturating_sub(80)..].chars().take(160).collect::<String>());
            assert!(found.is_none(), "{place}: {found:?}");
        }
    }
}

/// Whoever asks for no optimum still gets an answer: the best of what was evaluated, what exceeds its limit, and a
/// sentence for every study. Points whose plan misses a contact are no answer.
#[test]
fn without_a_search_the_answer_is_told_of_what_there_is() {
    let task = task("two_mass.toml");
    let phi = |k1: f64| {
        let mut phi = task.phi.clone();
        phi[0] = k1;
        phi
    };
    let swept = || {
        let axes = vec![Axis::parse("k1=80:200:3", &task).unwrap()];
        let options = SweepOptions { axes, rollouts: 0, starts: 0, branches: 0, seed: 0 };
        supple_study::sweep::run(&task, &options, None, Watch::default()).unwrap()
    };
    let mut missing = swept();
    let missed = missing.table.columns.iter().position(|column| column.name == "press.misses_contact").unwrap();
    missing.table.rows[2][missed] = Cell::Number(1.0);
    let mut front = front(&task);
    if let StudyResult::Pareto(front) = &mut front {
        front.points[2].warnings.push("it is missed".to_owned());
    }
    let all = page(&[
        folder("soft", &task, evaluation(&task, &phi(100.0))),
        folder("stiff", &task, evaluation(&task, &phi(500.0))),
        folder("sweep", &task, StudyResult::Sweep(Box::new(swept()))),
        folder("missing", &task, StudyResult::Sweep(Box::new(missing))),
        folder("front", &task, front),
        folder("trace", &task, trace(&task)),
    ])
    .unwrap();
    let text = text(&all);
    for told in [
        "Of these 2 designs, stiff receives the least information within all cost limits: 474.54\u{a0}bits",
        "In soft, the expected cost of press, 278.15, exceeds 250.",
        "<a href=\"#landscape\">Sweep in sweep</a>: of 3 points, 1 within all cost limits",
        "Sweep in missing</a>: no point can be recommended",
        "Pareto front in front</a>: 3 designs, from 320.6 bits at a cost of 225 to 240.45 bits at a cost of 300; at 1 of them",
        "Searches in trace</a>: 0 of 1 converged",
        "Crosses: designs whose plan never makes a contact whose force a cost tracks, or whose predictions roll-outs contradict.",
    ] {
        let told = told.replace('\u{a0}', " ");
        assert!(text.contains(&told), "nothing of `{told}` in {}", text.split("<table").next().unwrap_or_default());
    }
}

/// A search that ended too early, or at a local optimum, is not the last word where another design is known.
#[test]
fn a_better_design_on_the_same_page_is_told() {
    let task = task("two_mass.toml");
    let mut phi = task.phi.clone();
    (phi[0], phi[1]) = (140.0, 175.0);
    let of = |other: &[f64]| {
        let folders = [folder("design", &task, design(&task, 1, 2)), folder("other", &task, evaluation(&task, other))];
        text(&page(&folders).unwrap())
    };
    let better = of(&phi);
    let bits = task.problem.evaluate(&phi, &EvaluateOptions::default()).unwrap().objective.information_bits;
    let told = format!("But other has a design within all limits that receives {} bits", supple_text::printed(bits));
    assert!(better.contains(&told), "{}", better.split("<table").next().unwrap_or_default());
    assert!(!of(&task.phi).contains("But other has"));
}
