//! What figures hold, and the files that are made of them.
#![allow(clippy::unwrap_used, missing_docs)]

mod common;

use common::{bound, design, evaluate, pareto, robustness, summary, sweep, trace};
use insta::assert_json_snapshot;
use resvg::usvg::{Options, Tree};
use supple_figures::figure::{Marker, Panel, Shape};
use supple_figures::{Figure, Format, Kind, Width, draw, render};
use supple_study::sweep::misses_contact;
use supple_study::{Cell, Folder, StudyResult};

fn figure(kind: Kind, folders: &[Folder]) -> Figure {
    draw(kind, folders, None).unwrap()
}

fn labels(panel: &Panel) -> Vec<&str> {
    panel.series.iter().filter_map(|series| series.label.as_deref()).collect()
}

#[test]
fn a_landscape_shows_fields_bound_paths_and_designs() {
    let folders = [sweep(&["k1=log:20:120:6", "k2=10:50:5"]), design(), trace(), pareto()];
    assert_json_snapshot!("landscape", summary(&figure(Kind::Landscape, &folders)));
}

#[test]
fn a_landscape_of_one_parameter_shows_curves() {
    assert_json_snapshot!("landscape_of_one", summary(&figure(Kind::Landscape, &[sweep(&["k1=20,120,60"])])));
}

#[test]
fn beliefs_show_plan_truth_and_estimate_of_start_and_optimum() {
    let belief = figure(Kind::Belief, &[design()]);
    assert_json_snapshot!("belief", summary(&belief));
    assert_eq!(figure(Kind::Belief, &[evaluate()]).panels.len(), 5);
}

#[test]
fn gains_show_every_entry_and_the_feedforward() {
    assert_json_snapshot!("gains", summary(&figure(Kind::Gains, &[design()])));
}

#[test]
fn robustness_shows_means_quantiles_and_theory() {
    assert_json_snapshot!("robustness", summary(&figure(Kind::Robustness, &[robustness()])));
}

#[test]
fn a_front_shows_information_and_parameters() {
    assert_json_snapshot!("pareto", summary(&figure(Kind::Pareto, &[pareto()])));
}

#[test]
fn a_curve_of_bounds_shows_the_minimum_and_the_design() {
    let drawn = figure(Kind::Bound, &[bound()]);
    assert_eq!(labels(&drawn.panels[0]), ["minimum", "DI(x → u) of the design", "DI(x → y) of the design"]);
    assert_json_snapshot!("bound", summary(&drawn));
    let mut plain = bound();
    let StudyResult::Bound(study) = &mut plain.result else { panic!() };
    study.curves.clear();
    let error = draw(Kind::Bound, &[plain], None).unwrap_err().to_string();
    assert!(error.contains("has no curve; recompute the result with `--curve`"), "{error}");
}

#[test]
fn information_shows_all_measurements_and_each() {
    assert_json_snapshot!("information", summary(&figure(Kind::Information, &[design()])));
}

/// The robot at six times of start and optimum, to one scale, with the force of the wall where it touches.
#[test]
fn motion_shows_poses_and_forces() {
    let folder = design();
    let StudyResult::Design(report) = &folder.result else { panic!() };
    let contacts = &report.optimum.tasks[0].contacts;
    assert!(contacts[0].touches);
    let motion = figure(Kind::Motion, std::slice::from_ref(&folder));
    assert_eq!(motion.panels.len(), 12);
    assert_eq!((motion.column.columns, motion.page.columns), (3, 6));
    assert!(motion.panels[0].title.starts_with("start, 0") && motion.panels[11].title.starts_with("optimum, "));
    let size = |range: [f64; 2]| range[1] - range[0];
    for panel in &motion.panels {
        assert!((size(panel.y.range) / size(panel.x.range) - motion.page.aspect).abs() < 1e-9, "a metre is a metre");
        assert_eq!((&panel.x, &panel.y), (&motion.panels[0].x, &motion.panels[0].y));
        assert!(panel.series.iter().any(|series| matches!(&series.shape, Shape::Outline { x, .. } if x.len() > 2)));
    }
    let arrow = |panel: &Panel| {
        let lengths = panel.series.iter().filter_map(|series| match series.shape {
            Shape::Arrow { x, y } => Some((x[1] - x[0]).hypot(y[1] - y[0])),
            _ => None,
        });
        lengths.fold(0.0, f64::max)
    };
    assert!(arrow(&motion.panels[6]) < 1e-2 * size(motion.panels[0].x.range), "it begins apart from the wall");
    assert!(arrow(&motion.panels[11]) > 0.05 * size(motion.panels[0].x.range), "it ends pressing");
    assert!(
        motion.entries().iter().any(|entry| entry.starts_with("contact force, at most ")),
        "{:?}",
        motion.entries()
    );

    let mut still = folder;
    let StudyResult::Design(report) = &mut still.result else { panic!() };
    for evaluation in [&mut report.start, &mut report.optimum] {
        evaluation.tasks[0].trajectory.as_mut().unwrap().scene = None;
    }
    let error = draw(Kind::Motion, &[still], None).unwrap_err().to_string();
    assert!(error.contains("has no motion to draw"), "{error}");
}

#[test]
fn more_than_twelve_states_are_reduced_to_those_that_move_or_are_learnt_most() {
    let mut folder = evaluate();
    let StudyResult::Evaluate(report) = &mut folder.result else { panic!() };
    let trajectory = report.evaluation.tasks[0].trajectory.as_mut().unwrap();
    let sample = &mut trajectory.sample;
    let tables = [&mut trajectory.states, &mut trajectory.deviations, &mut sample.states, &mut sample.estimates];
    trajectory.feedback.iter_mut().flatten().for_each(|row| row.extend([0.0; 9]));
    // Nine states more that rest.
    tables.into_iter().chain([&mut sample.deviations]).flatten().for_each(|row| row.extend([1.0; 9]));
    trajectory.state_names.extend(["a", "b", "c", "d", "e", "f", "g", "h", "i"].map(String::from));
    trajectory.state_units.extend([const { String::new() }; 9]);
    let belief = figure(Kind::Belief, &[folder]);
    let shown: Vec<&str> = belief.panels.iter().map(|panel| panel.y.label.as_str()).collect();
    assert_eq!(shown[5..], ["a", "b", "c", "d", "e", "f", "g"], "{shown:?}");
    assert!(belief.title.contains("(12 of 14)"), "{}", belief.title);
}

#[test]
fn every_figure_becomes_a_file_of_every_format_and_width() {
    let folders = [sweep(&["k1=log:20:120:6", "k2=10:50:5"]), design(), trace(), pareto(), robustness(), bound()];
    for kind in Kind::ALL {
        let figure = figure(kind, &folders);
        for (width, points, pixels) in [(Width::Column, "249.44", 2079), (Width::Page, "510.23", 4252)] {
            let svg = String::from_utf8(render(&figure, Format::Svg, width).unwrap()).unwrap();
            let tree = Tree::from_str(&svg, &Options::default()).unwrap();
            assert!(svg.contains(&format!("width=\"{:.3}mm\"", width.millimetres())), "{kind:?}");
            assert!(!svg.contains("<text") && svg.contains("<title>"), "{kind:?}: texts are outlines");
            assert!(tree.root().has_children() && !svg.contains("NaN"), "{kind:?}");
            let pdf = render(&figure, Format::Pdf, width).unwrap();
            let text = String::from_utf8_lossy(&pdf);
            assert!(pdf.starts_with(b"%PDF-") && text.contains(&format!("[0 0 {points}")), "{kind:?}");
            assert!(text.contains("NotoSans"), "{kind:?}: the font is embedded");
            let png = render(&figure, Format::Png, width).unwrap();
            let info = png::Decoder::new(std::io::Cursor::new(&png)).read_info().unwrap().info().clone();
            assert_eq!(info.width, pixels, "{kind:?}");
            assert!(info.height > pixels / 10 && info.pixel_dims.is_some());
        }
        assert_eq!(render(&figure, Format::Pdf, Width::Page).ok(), render(&figure, Format::Pdf, Width::Page).ok());
    }
}

#[test]
fn the_line_of_the_bound_is_on_both_panels() {
    let landscape = figure(Kind::Landscape, &[sweep(&["k1=20:120:6", "k2=10:50:5"])]);
    let bound = |panel: &Panel| {
        let level = panel.series.iter().find_map(|series| match series.shape {
            Shape::Contour { level, .. } => Some(level),
            _ => None,
        });
        (level, labels(panel).contains(&"cost at its limit, 25"))
    };
    assert_eq!(landscape.panels.iter().map(bound).collect::<Vec<_>>(), [(Some(25.0), true); 2]);
}

/// Points that no reader must take for designs: on landscapes of one and two parameters, and along a front.
#[test]
fn plans_that_miss_a_contact_are_crossed() {
    let mut one = sweep(&["k1=20,60,120"]);
    let mut two = sweep(&["k1=20,60,120", "k2=10,50"]);
    for folder in [&mut one, &mut two] {
        let StudyResult::Sweep(sweep) = &mut folder.result else { panic!() };
        let column = sweep.table.columns.iter().position(|column| misses_contact(column).is_some()).unwrap();
        sweep.table.rows[1][column] = Cell::Number(1.0);
    }
    let mut front = pareto();
    let StudyResult::Pareto(found) = &mut front.result else { panic!() };
    found.points[1].warnings.push("it is missed".to_owned());
    let crosses = |kind: Kind, folder: Folder| -> Vec<usize> {
        let of_panel = |panel: &Panel| -> usize {
            let marks = panel.series.iter().filter(|series| series.style.marker == Some(Marker::Cross));
            marks.map(|series| if let Shape::Points { x, .. } = &series.shape { x.len() } else { 0 }).sum()
        };
        figure(kind, &[folder]).panels.iter().map(of_panel).collect()
    };
    assert_eq!(crosses(Kind::Landscape, one), [1, 1]);
    assert_eq!(crosses(Kind::Landscape, two), [1, 1]);
    assert!(crosses(Kind::Pareto, front).iter().all(|&count| count == 1));
    assert_eq!(crosses(Kind::Pareto, pareto()).iter().sum::<usize>(), 0);
}

#[test]
fn errors_say_what_is_needed_and_what_was_given() {
    let error = |kind, folders: &[Folder], task| draw(kind, folders, task).unwrap_err().to_string();
    let landscape = error(Kind::Landscape, &[evaluate()], None);
    assert!(landscape.contains("supple sweep") && landscape.contains("evaluate (of `supple evaluate`)"), "{landscape}");
    for kind in [Kind::Belief, Kind::Gains, Kind::Information] {
        let text = error(kind, &[pareto()], None);
        assert!(text.contains(kind.name()) && text.contains("supple design") && text.contains("pareto (of"), "{text}");
    }
    assert!(error(Kind::Pareto, &[], None).ends_with("given: nothing"));
    assert!(error(Kind::Robustness, &[robustness(), robustness()], None).contains("one folder of `supple robustness`"));
    let task = error(Kind::Belief, &[evaluate()], Some("pres"));
    assert_eq!(task, "no task is named `pres`; valid names: press");
    let point = error(Kind::Landscape, &[sweep(&["k1=20"])], None);
    assert!(point.contains("0 axes with more than one value"), "{point}");
}

#[test]
fn results_without_trajectories_are_refused() {
    let mut folder = evaluate();
    let StudyResult::Evaluate(report) = &mut folder.result else { panic!() };
    report.evaluation.tasks[0].trajectory = None;
    let error = draw(Kind::Gains, &[folder], None).unwrap_err().to_string();
    assert!(error.contains("has no trajectories"), "{error}");
}
