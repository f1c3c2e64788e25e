//! The tables of docs/bounds.md are what the code gives.

use std::path::{Path, PathBuf};

use supple::Problem;
use supple::bound::{BoundOptions, TaskBound};

fn repository(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(path)
}

/// Panics with all rows that the page lacks.
fn assert_rows(rows: &[String]) {
    let page = std::fs::read_to_string(repository("docs/bounds.md")).unwrap();
    let lacking: Vec<&str> =
        rows.iter().map(String::as_str).filter(|row| !page.lines().any(|line| line == *row)).collect();
    assert!(lacking.is_empty(), "docs/bounds.md lacks\n{}", lacking.join("\n"));
}

fn load(task: &str) -> Problem {
    supple_file::load(repository(task)).unwrap()
}

/// What a design uses and what would do, in bits over the task; then what the virtual sensor measures at its strongest.
fn rows(name: &str, bound: &TaskBound) -> [String; 2] {
    let total = |rate: Option<f64>| rate.unwrap() * bound.steps as f64;
    let numbers = format!(
        "| {name} | {:.1} | {:.1} | {:.1} | {:.3} | {:.2} % | {:.2} % |",
        bound.cost,
        total(bound.measurement_bits_per_step),
        total(bound.control_bits_per_step),
        bound.minimum_bits,
        100.0 * bound.efficiency.unwrap(),
        100.0 * bound.control_efficiency.unwrap()
    );
    let windows = &bound.virtual_sensor.windows;
    let window = windows.iter().max_by(|a, b| a.bits.total_cmp(&b.bits)).unwrap();
    let direction = &window.directions[0];
    let sensor = format!(
        "| {name} | {} | {:.3} s | {} | {:.2e} {} |",
        bound.virtual_sensor.rank,
        window.strongest as f64 * bound.time_step_s,
        direction.text,
        direction.deviation,
        direction.unit
    );
    [numbers, sensor]
}

#[test]
fn the_plant_is_as_shown() {
    let problem = load("tasks/tanaka_plant.toml");
    let row = |cost: f64| {
        let options = BoundOptions { cost: Some(cost), stationary: true, ..Default::default() };
        let bound = problem.bound(&[], &options).unwrap().tasks.remove(0);
        assert!(bound.duality_gap_bits < 1e-6);
        format!(
            "| {cost} | {:.3} | {:.4} | {} | {:.3} |",
            bound.kostina_hassibi_bits_per_step.unwrap(),
            bound.minimum_bits_per_step,
            bound.virtual_sensor.rank,
            bound.quantiser_bits_per_step
        )
    };
    assert_rows(&[33.0, 35.0, 40.0, 50.0, 60.0, 80.0, 100.0, 200.0, 1000.0].map(row));
}

#[test]
fn the_two_masses_are_as_shown() {
    let problem = load("tasks/two_mass.toml");
    let designs = [("500, 500 N/m", [500.0, 500.0]), ("135.912, 171.458 N/m", [135.912, 171.458])];
    let found: Vec<String> = designs
        .into_iter()
        .flat_map(|(name, design)| {
            let mut phi = problem.parameters.initial();
            phi[..2].copy_from_slice(&design);
            rows(name, &problem.bound(&phi, &BoundOptions::default()).unwrap().tasks[0])
        })
        .collect();
    assert_rows(&found);
}

#[test]
fn the_door_is_as_shown() {
    let problem = load("tasks/iiwa_door.toml");
    let (mut found, mut proved) = (Vec::new(), 0);
    for (name, design) in [("1e6 N/m", [1e6; 3]), ("optimised", [1029.13, 1000.0, 1085.93])] {
        for bound in problem.bound(&design, &BoundOptions::default()).unwrap().tasks {
            let ordered = bound.is_ordered() && bound.duality_gap_bits < 0.5 * bound.minimum_bits_per_step;
            assert!(ordered || !bound.proved, "{:?}", bound.order);
            proved += usize::from(bound.proved);
            found.extend(rows(&format!("{}, {name}", bound.name), &bound));
        }
    }
    assert!(proved >= 1, "{proved} of 4");
    assert_rows(&found);
}
