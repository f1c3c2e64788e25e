//! Kinds of this crate do all that those of the library do.

use std::error::Error;

use outsider::kinds;
use supple::EvaluateOptions;
use supple::check::check;
use supple::design::{Control, DesignSettings, design};

type Tested = Result<(), Box<dyn Error>>;

const REACH: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tasks/reach.toml");
const BALANCE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tasks/balance.toml");

fn text() -> Result<String, Box<dyn Error>> {
    Ok(std::fs::read_to_string(REACH)?)
}

/// The error of the task file with a text in place of another.
fn error(from: &str, to: &str) -> Result<String, Box<dyn Error>> {
    let text = text()?;
    assert!(text.contains(from));
    match supple_file::parse_with(&text.replacen(from, to, 1), REACH, kinds()) {
        Ok(_) => Err(format!("`{to}` is accepted").into()),
        Err(error) => Ok(error.to_string()),
    }
}

#[test]
fn every_derivative_is_that_of_differences() -> Tested {
    for file in [REACH, BALANCE] {
        let problem = supple_file::load_with(file, kinds())?;
        let report = check(&problem, &problem.parameters.initial())?;
        for task in &report.tasks {
            let rows = task.rows.iter();
            let wrong: Vec<_> = rows.filter(|row| !row.passed || !row.not_compared.is_empty()).collect();
            assert!(wrong.is_empty(), "{file}: {wrong:#?}");
            assert!(task.rows.len() > 5, "{file}");
        }
        assert!(report.passed, "{file}");
    }
    Ok(())
}

#[test]
fn a_design_pays_for_and_improves_what_is_added() -> Tested {
    let problem = supple_file::load_with(REACH, kinds())?;
    let settings = DesignSettings { starts: 1, rounds: 1, price_weight: 1e-3, ..problem.design.clone() };
    let start = problem.parameters.initial();
    let control = Control::default();
    let found = design(&problem, &start, &settings, control)?;
    let best = &found.starts[found.best];
    assert!(best.status.meets_bounds(), "{:?}", best.status);
    let at = |phi: &[f64]| problem.evaluate(phi, &EvaluateOptions::default());
    let (before, after) = (at(&start)?, at(&best.to)?);
    let price = |phi: &[f64]| problem.parameters.price(phi);
    let objective = |information: f64, phi: &[f64]| information + 1e-3 * price(phi);
    let [first, last] = [(&before, &start), (&after, &best.to)]
        .map(|(evaluation, phi)| objective(evaluation.objective.information_bits, phi));
    assert!(last < first, "{last} is no better than {first}");
    for (parameter, name) in problem.parameters.names().iter().enumerate().filter(|(_, name)| *name != "s") {
        assert!(best.to[parameter] != start[parameter], "`{name}` stays where it was");
    }
    Ok(())
}

#[test]
fn what_is_added_is_named_in_results() -> Tested {
    let problem = supple_file::load_with(REACH, kinds())?;
    let options = EvaluateOptions { trajectories: true, ..EvaluateOptions::default() };
    let found = problem.evaluate(&problem.parameters.initial(), &options)?;
    let task = &found.tasks[0];
    let limit = task.limits_violated.iter().find(|violation| violation.name.contains("bearing of tool"));
    assert!(limit.is_some(), "{:?}", task.limits_violated);
    let shown = serde_json::to_string(task)?;
    for name in ["bearing of tool", "tendon.force_x", "tendon.deflection", "1 bearing", "2 coupling_force"] {
        assert!(shown.contains(name), "`{name}` is not in the results");
    }
    let sensors: Vec<_> = problem.tasks[0].system.channels().measurements;
    assert!(sensors.iter().any(|sensor| sensor.name == "bearing of tool" && sensor.unit == "rad"), "{sensors:?}");
    Ok(())
}

#[test]
fn pictures_show_the_tendon() -> Tested {
    let problem = supple_file::load_with(REACH, kinds())?;
    let (task, phi) = (&problem.tasks[0], problem.parameters.initial());
    let x: Vec<f64> = task.initial_state.iter().map(|value| value.resolve(&phi)).collect();
    let seen = task.system.picture(&x, &[0.0; 3], &phi).ok_or("a robot can be drawn")?;
    let tendon = seen.picture.connections.iter().find(|connection| connection.name == "tendon").ok_or("no tendon")?;
    // It pulls its end at the arm towards its anchor.
    let along: f64 = (0..3).map(|axis| tendon.force[axis] * (tendon.from[axis] - tendon.to[axis])).sum();
    assert!(along > 0.0, "{tendon:?}");
    // Uncertain points move with the states as differences say.
    for (place, jacobian) in seen.jacobians.iter().enumerate() {
        for (state, step) in (0..x.len()).map(|state| (state, 1e-6)) {
            let at = |by: f64| {
                let mut moved = x.clone();
                moved[state] += by;
                task.system.picture(&moved, &[0.0; 3], &phi).map(|seen| seen.positions[place])
            };
            let (Some(above), Some(below)) = (at(step), at(-step)) else { return Err("it can be drawn".into()) };
            for axis in 0..3 {
                let difference = (above[axis] - below[axis]) / (2.0 * step);
                assert!((jacobian[axis][state] - difference).abs() < 1e-8, "point {place}, state {state}");
            }
        }
    }
    Ok(())
}

#[test]
fn errors_name_the_place_and_what_is_valid() -> Tested {
    let found = error("camera = [\"camera\", 0.2]", "camara = [\"camera\", 0.2]")?;
    for part in ["reach.toml", "unknown key `camara`", "camera"] {
        assert!(found.contains(part), "{found}");
    }
    let found = error("frame_a = \"anchor\"", "frame_a = \"ancor\"")?;
    assert!(found.contains("no link or frame `ancor`") && found.contains("anchor"), "{found}");
    let found = error("smoothing = 0.02", "smoothing = 0.0")?;
    assert!(found.contains("model.compliance[0].smoothing") && found.contains("must be above 0"), "{found}");
    let found = error("{ cauchy = { scale = \"s\" } }", "\"cauchy\"")?;
    assert!(found.contains("costs[0].norm") && found.contains("`cauchy` needs settings"), "{found}");
    let found = error("{ cauchy = { scale = \"s\" } }", "{ cauchi = { scale = \"s\" } }")?;
    for part in ["costs[0].norm", "must be one of `absolute`, `cauchy`, `quadratic`", "`cauchi`"] {
        assert!(found.contains(part), "{found}");
    }
    let found = error("{ cauchy = { scale = \"s\" } }", "{ cauchy = { scale = -1 } }")?;
    assert!(found.contains("its scale must be above 0"), "{found}");
    Ok(())
}

#[test]
fn without_them_files_that_name_them_are_refused() -> Tested {
    for (file, kind) in [(REACH, "tendon"), (BALANCE, "cart_pole")] {
        let Err(found) = supple_file::load(file) else { return Err("kinds that nobody added are known".into()) };
        assert!(found.to_string().contains(&format!("`{kind}`")), "{found}");
    }
    Ok(())
}

#[test]
fn the_schema_has_them() {
    let schema = supple_file::json_schema_of(&kinds()).to_string();
    for key in ["bearing", "camera", "tendon", "frame_a", "cauchy", "cart_pole", "cart_mass"] {
        assert!(schema.contains(&format!("\"{key}\"")), "`{key}` is not in the schema");
    }
    let own = supple_file::json_schema().to_string();
    assert!(!own.contains("\"cauchy\"") && own.contains("\"absolute\""));
}
